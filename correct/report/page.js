'use strict';
// Draws what `report-data` says; every decision about content was made by the program that wrote it. Text goes in as text, never as markup.
(() => {
  const data = JSON.parse(document.getElementById('report-data').textContent);
  // Okabe and Ito's colours, which the common kinds of colour blindness keep apart; lighter ones on dark ground. Dashes tell series apart too.
  const palette = {
    light: {ink: '#1b1b1b', line: '#d5d5d5', mark: '#5a5a5a', series: ['#4a4a4a', '#0072b2', '#d55e00', '#00795a', '#a8518a']},
    dark: {ink: '#e8e8e6', line: '#3a4046', mark: '#a9adb0', series: ['#d8d8d8', '#56b4e9', '#e69f00', '#2fc89a', '#e39bc4']},
  };
  const cividis = ['#00204c', '#00306f', '#2a406c', '#48526b', '#5e626e', '#727374', '#878479', '#9e9677', '#b6a971', '#d0be67', '#ead357', '#ffea46'];
  const diverging = ['#2166ac', '#67a9cf', '#d1e5f0', '#f7f7f7', '#fddbc7', '#ef8a62', '#b2182b'];  // blue to red by way of white
  const report = {graphs: {}, redraw: [], theme: 'system', printing: false};
  window.unrigReport = report;

  const make = (name, parent, text, kind) => {
    const element = document.createElement(name);
    if (text !== undefined) element.textContent = text;
    if (kind) element.className = kind;
    if (parent) parent.appendChild(element);
    return element;
  };
  // Dygraphs takes its axis labels for HTML; names and units come from files.
  const as_text = (text) => String(text ?? '').replace(/[&<>"']/g, (c) => `&#${c.charCodeAt(0)};`);
  const dark = () => !report.printing &&
      (report.theme === 'dark' || (report.theme === 'system' && window.matchMedia('(prefers-color-scheme: dark)').matches));
  const colours = () => palette[dark() ? 'dark' : 'light'];
  // Four digits; a minus sign as printers set it.
  const readable = (x) => {
    if (x === null || !isFinite(x)) return '';
    const size = Math.abs(x);
    const text = size !== 0 && (size < 1e-3 || size >= 1e5) ? (+x.toPrecision(3)).toExponential().replace('e+', 'e') : String(+x.toPrecision(5));
    return text.replace('-', '\u2212');
  };

  function verdict(parent, v) {
    const box = make('div', parent, undefined, 'verdict ' + v.tone);
    make('span', box, {good: '\u2713', bad: '\u2717', open: '?', told: '\u2022'}[v.tone], 'sign');
    make('span', box, v.text);
    make('small', box, v.about);
  }

  function table(parent, block) {
    if (block.title) make('h3', parent, block.title);
    const t = make('table', make('div', parent, undefined, 'scroll'));
    const numeric = block.header.map((_, c) => block.rows.length > 0 && block.rows.every((row) => /^\(?[-+\u2212\u2014\d]/.test(row[c] || '\u2014')));
    const head = make('tr', make('thead', t));
    block.header.forEach((name, c) => make('th', head, name, numeric[c] ? 'number' : '').scope = 'col');
    const body = make('tbody', t);
    for (const cells of block.rows) {
      const row = make('tr', body);
      cells.forEach((cell, c) => make('td', row, cell, numeric[c] ? 'number' : ''));
    }
    if (block.caption) make('p', parent, block.caption).className = 'caption';
  }

  // Rows as dygraphs wants them: x, then a number per series, or low, value, high where the plot has bands.
  function rows(block, bands) {
    const value = (s, k) => {
      const v = s.v[k];
      if (!bands) return v;
      if (v === null) return [null, null, null];
      const half = s.std ? 2 * s.std[k] : 0;
      return [v - half, v, v + half];
    };
    return block.x.map((x, k) => [x, ...block.series.map((s) => value(s, k))]);
  }

  // Vertical lines with a name, behind the data.
  function marks(block) {
    return (context, area, graph) => {
      context.save();
      context.strokeStyle = context.fillStyle = colours().mark;
      context.setLineDash([3, 4]);
      context.font = '12px sans-serif';
      block.marks.forEach((mark, i) => {
        const at = graph.toDomXCoord(mark.x);
        if (at < area.x || at > area.x + area.w) return;
        context.beginPath();
        context.moveTo(at, area.y);
        context.lineTo(at, area.y + area.h);
        context.stroke();
        const width = context.measureText(mark.name).width;
        context.fillText(mark.name, Math.min(at + 4, area.x + area.w - width), area.y + 12 + 14 * (i % 3));
      });
      context.restore();
    };
  }

  // Decades with their numbers, and the 2 to 9 between them without.
  function decades(low, high) {
    const found = [];
    for (let power = Math.floor(Math.log10(low)); power <= Math.log10(high); ++power)
      for (let m = 1; m < 10; ++m) {
        const v = +(m * Math.pow(10, power)).toPrecision(6);
        if (v < low || v > high) continue;
        const narrow = high / low < 50 && (m === 2 || m === 5);
        found.push({v, label: m === 1 || narrow ? readable(v) : ''});
      }
    return found;
  }

  const groups = {};  // name -> graphs that zoom together
  function follow(group) {
    let busy = false;
    const each = (me, act) => {
      if (busy) return;
      busy = true;
      for (const other of groups[group]) if (other !== me) act(other);
      busy = false;
    };
    return {
      drawCallback: (me, first) => {
        const range = me.xAxisRange();
        const elsewhere = (other) => other.xAxisRange().some((end, i) => end !== range[i]);  // or every redrawing would redraw them all
        if (!first) each(me, (other) => { if (elsewhere(other)) other.updateOptions({dateWindow: me.isZoomed('x') ? range : null}); });
      },
      highlightCallback: (event, x, points, row) => each(groups[group].find((g) => g.maindiv_.contains(event.target)), (other) => other.setSelection(row)),
      unhighlightCallback: () => each(null, (other) => other.clearSelection()),
    };
  }

  function plot(parent, block, name) {
    const figure = make('figure', parent);
    if (block.title) make('h3', figure, block.title);
    const legend = make('div', figure, undefined, 'legend');
    const box = make('div', figure, undefined, 'plot');
    box.style.height = (block.height || 260) + 'px';
    box.setAttribute('role', 'img');
    box.setAttribute('aria-label', `${block.title || block.y_label} against ${block.x_label}: ${block.series.map((s) => s.name).join(', ')}`);
    if (block.caption) make('figcaption', figure, block.caption);
    const bands = block.series.some((s) => s.std);
    const look = () => ({
      colors: block.series.map((s) => colours().series[s.colour]),
      gridLineColor: colours().line, axisLineColor: colours().mark,
    });
    const series = {};
    for (const s of block.series) {
      series[s.name] = {strokePattern: s.dashed ? [7, 4] : null, strokeWidth: s.width || 1.4};
      if (bands && !s.std) series[s.name].plotter = Dygraph.Plotters.linePlotter;  // filling a band of no width costs most of the time
      if (s.points) Object.assign(series[s.name], {drawPoints: true, strokeWidth: 0, pointSize: 2});
    }
    const graph = new Dygraph(box, rows(block, bands), Object.assign({
      labels: [block.x_label, ...block.series.map((s) => s.name)],
      xlabel: as_text(block.x_label), ylabel: as_text(block.y_label), series, customBars: bands, fillAlpha: 0.25, legend: 'always', labelsDiv: legend,
      labelsSeparateLines: false, axisLabelFontSize: 13, highlightCircleSize: 3, connectSeparatedPoints: false, logscale: !!block.log_y,
      axes: {
        x: {axisLabelFormatter: readable, valueFormatter: readable, logscale: !!block.log_x, axisLabelWidth: 70, ticker: block.log_x ? decades : Dygraph.numericLinearTicks},
        y: {axisLabelFormatter: readable, valueFormatter: readable, axisLabelWidth: 72, ticker: block.log_y ? decades : Dygraph.numericLinearTicks},
      },
    }, look(), block.marks ? {underlayCallback: marks(block)} : {}, block.group ? follow(block.group) : {}));
    if (block.group) (groups[block.group] = groups[block.group] || []).push(graph);
    report.graphs[name] = graph;
    report.redraw.push(() => graph.updateOptions(look()));
  }

  const between = (stops, share) => {
    const at = Math.min(Math.max(share, 0), 1) * (stops.length - 1), low = Math.min(Math.floor(at), stops.length - 2);
    const part = (stop, i) => parseInt(stop.slice(1 + 2 * i, 3 + 2 * i), 16);
    return [0, 1, 2].map((i) => Math.round(part(stops[low], i) + (at - low) * (part(stops[low + 1], i) - part(stops[low], i))));
  };
  function ticks(low, high, count) {
    const rough = (high - low) / count, power = Math.pow(10, Math.floor(Math.log10(rough)));
    const step = [1, 2, 5, 10].map((m) => m * power).find((s) => s >= rough) || rough;
    const found = [];
    for (let k = Math.ceil(low / step); k * step <= high + 1e-9 * step && found.length < 50; ++k) found.push(+(k * step).toPrecision(12));
    return found;
  }

  // Without the rows and columns at the rim that hold nothing, but for one.
  function cropped(block) {
    const range = (count, holds) => {
      const held = [...Array(count).keys()].filter(holds);
      return held.length ? [Math.max(0, held[0] - 1), Math.min(count, held[held.length - 1] + 2)] : [0, count];
    };
    const something = (z) => z !== null && z !== undefined;
    const [left, right] = range(block.x.length, (i) => block.z.some((row) => something(row[i])));
    const [low, high] = range(block.y.length, (j) => block.z[j].some(something));
    return {...block, x: block.x.slice(left, right), y: block.y.slice(low, high), z: block.z.slice(low, high).map((row) => row.slice(left, right))};
  }

  // z over x (columns) and y (rows, the first at the bottom), with its scale at the right.
  function map(parent, block) {
    const figure = make('figure', parent);
    if (block.title) make('h3', figure, block.title);
    if (block.signed) block = cropped(block);
    const canvas = make('canvas', figure, undefined, 'map');
    canvas.setAttribute('role', 'img');
    canvas.setAttribute('aria-label', `${block.title}: ${block.z_label} over ${block.x_label} and ${block.y_label}`);
    if (block.caption) make('figcaption', figure, block.caption);
    const values = block.z.flat().filter((z) => z !== null && (!block.log_z || z > 0)).map((z) => block.log_z ? Math.log10(z) : z);
    let low = values.reduce((a, b) => Math.min(a, b), Infinity), high = values.reduce((a, b) => Math.max(a, b), -Infinity);
    if (block.log_z) low = Math.max(low, high - 6);
    if (block.signed) { high = Math.max(Math.abs(low), Math.abs(high)); low = -high; }
    if (!(high > low)) high = low + 1;
    const stops = block.signed ? diverging : cividis;
    const columns = block.x.length, lines = block.y.length;
    const image = document.createElement('canvas');
    image.width = columns; image.height = lines;
    const pixels = image.getContext('2d').createImageData(columns, lines);
    for (let j = 0; j < lines; ++j) {
      for (let i = 0; i < columns; ++i) {
        let z = block.z[j][i];
        if (z === null || z === undefined) continue;  // stays transparent
        if (block.log_z) z = z > 0 ? Math.log10(z) : low;
        const at = 4 * ((lines - 1 - j) * columns + i);
        pixels.data.set([...between(stops, (z - low) / (high - low)), 255], at);
      }
    }
    image.getContext('2d').putImageData(pixels, 0, 0);
    const edges = (at) => {
      const half = at.length > 1 ? (at[at.length - 1] - at[0]) / (at.length - 1) / 2 : 0.5;
      return [at[0] - half, at[at.length - 1] + half];
    };
    const draw = () => {
      const sharp = window.devicePixelRatio || 1, width = canvas.clientWidth || 900, height = block.height || 320;
      canvas.style.height = height + 'px';
      canvas.width = width * sharp; canvas.height = height * sharp;
      const c = canvas.getContext('2d'), left = 76, right = 110, bottom = 46, top = 10, w = width - left - right, h = height - top - bottom;
      c.scale(sharp, sharp);
      c.imageSmoothingEnabled = false;
      c.fillStyle = dark() ? '#3a4046' : '#c4c8cc';  // seen where a cell is empty, and no colour of either scale
      if (block.signed) c.fillRect(left, top, w, h);
      c.drawImage(image, left, top, w, h);
      c.fillStyle = c.strokeStyle = colours().ink;
      c.strokeRect(left, top, w, h);
      c.font = '13px sans-serif';
      const [x0, x1] = edges(block.x), [y0, y1] = edges(block.y);
      c.textAlign = 'center';
      for (const t of ticks(x0, x1, 8)) c.fillText(readable(t), left + (t - x0) / (x1 - x0) * w, top + h + 18);
      c.fillText(block.x_label, left + w / 2, height - 6);
      c.textAlign = 'right';
      for (const t of ticks(y0, y1, 6)) c.fillText(readable(t), left - 6, top + h - (t - y0) / (y1 - y0) * h + 4);
      for (let k = 0; k < h; ++k) {
        c.fillStyle = `rgb(${between(stops, 1 - k / h).join()})`;
        c.fillRect(left + w + 16, top + k, 14, 1.5);
      }
      c.fillStyle = colours().ink;
      c.textAlign = 'left';
      for (const t of ticks(low, high, 4)) c.fillText(block.log_z ? readable(Math.pow(10, t)) : readable(t), left + w + 34, top + h - (t - low) / (high - low) * h + 4);
      const upright = (text, x) => {
        c.save();
        c.translate(x, top + h / 2);
        c.rotate(-Math.PI / 2);
        c.textAlign = 'center';
        c.fillText(text, 0, 0);
        c.restore();
      };
      upright(block.y_label, 14);
      upright(block.z_label, width - 6);
    };
    report.redraw.push(draw);
    requestAnimationFrame(draw);
  }

  function restyle() {
    document.documentElement.dataset.theme = dark() ? 'dark' : 'light';
    for (const redraw of report.redraw) redraw();
  }
  report.setTheme = (theme) => {
    report.theme = theme;
    document.getElementById('theme').textContent = 'theme: ' + theme;
    restyle();
  };

  document.documentElement.dataset.theme = dark() ? 'dark' : 'light';
  document.title = data.title;
  document.getElementById('title').textContent = data.title;
  document.getElementById('version').textContent = data.version;
  const main = document.getElementById('report');
  for (const v of data.verdicts) verdict(main, v);
  let section = main;
  data.blocks.forEach((block, i) => {
    if (block.type === 'section') make('h2', section = make('section', main), block.title);
    if (block.type === 'text') make('p', section, block.text);
    if (block.type === 'table') table(section, block);
    if (block.type === 'plot') plot(section, block, 'plot' + i);
    if (block.type === 'map') map(section, block);
  });
  const order = ['system', 'light', 'dark'];
  document.getElementById('theme').addEventListener('click', () => report.setTheme(order[(order.indexOf(report.theme) + 1) % 3]));
  window.matchMedia('(prefers-color-scheme: dark)').addEventListener('change', restyle);
  window.addEventListener('resize', () => report.redraw.forEach((redraw) => redraw()));
  // The plots keep the width that they were drawn in, and the window's layout still stands when this is called: the body gets the paper's width first (page.css).
  // A canvas that changes its size while a browser prepares to print prints as nothing, a new one as it is: it takes the drawing's place, in dots that paper needs.
  const print = (printing) => {
    report.printing = printing;
    document.documentElement.classList.toggle('printing', printing);
    for (const sheet of document.querySelectorAll('.sheet')) sheet.remove();
    for (const graph of Object.values(report.graphs)) {
      graph.updateOptions({pixelRatio: printing ? 2 : null}, true);
      graph.resize();
    }
    restyle();
    if (!printing) return;
    for (const graph of Object.values(report.graphs)) {
      const drawn = graph.hidden_, sheet = make('canvas', graph.graphDiv, undefined, 'sheet');
      [sheet.width, sheet.height, sheet.style.width, sheet.style.height] = [drawn.width, drawn.height, drawn.style.width, drawn.style.height];
      sheet.getContext('2d').drawImage(drawn, 0, 0);
    }
  };
  window.addEventListener('beforeprint', () => print(true));
  window.addEventListener('afterprint', () => print(false));
})();

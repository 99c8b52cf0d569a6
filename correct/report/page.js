'use strict';
// Draws what `report-data` says; every decision about content was made by the program that wrote it. Text goes in as text, never as markup.
(() => {
  const data = JSON.parse(document.getElementById('report-data').textContent);
  // Okabe and Ito's colours, which the common kinds of colour blindness keep apart; lighter ones on dark ground. Dashes tell series apart too.
  const palette = {
    light: {ink: '#1b1b1b', line: '#d5d5d5', mark: '#5a5a5a', bad: '#a33f00', empty: '#c4c8cc', series: ['#4a4a4a', '#0072b2', '#d55e00', '#00795a', '#a8518a', '#e3b505']},
    dark: {ink: '#e8e8e6', line: '#3a4046', mark: '#a9adb0', bad: '#f0a04b', empty: '#3a4046', series: ['#d8d8d8', '#56b4e9', '#e69f00', '#2fc89a', '#e39bc4', '#f0e442']},
  };
  const report = {graphs: {}, pictures: {}, figures: {}, redraw: [], theme: 'system', printing: false};
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
  const {readable, decades} = unrigDrawing;

  function verdict(parent, v) {
    const box = make('div', parent, undefined, 'verdict ' + v.tone);
    make('span', box, {good: '\u2713', bad: '\u2717', open: '?', told: '\u2022'}[v.tone], 'sign');
    make('span', box, v.text);
    make('small', box, v.about);
  }

  const on_paper = () => ({...palette.light, paper: '#ffffff'});
  function save(name, blob) {
    const link = make('a');
    link.download = name;
    link.href = URL.createObjectURL(blob);
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
  }
  // Buttons that save a figure, on white whatever the page is. `of`: {svg: () => element, csv: () => text}.
  function tools(parent, title, of) {
    const bar = make('div', undefined, undefined, 'tools'), file = title.toLowerCase().replace(/[^a-z0-9]+/g, '_').replace(/^_|_$/g, '') || 'figure';
    if (parent.tagName === 'FIGURE') parent.prepend(bar); else parent.appendChild(bar);
    const button = (kind, act) => {
      const b = make('button', bar, kind);
      b.type = 'button';
      b.title = `save "${title}" as ${kind}`;
      b.addEventListener('click', act);
    };
    if (of.svg) {
      button('PNG', () => unrigDrawing.painted(of.svg()).then((canvas) => canvas.toBlob((blob) => save(file + '.png', blob))));
      button('SVG', () => save(file + '.svg', new Blob([unrigDrawing.text_of(of.svg())], {type: 'image/svg+xml'})));
    }
    button('CSV', () => save(file + '.csv', new Blob([of.csv()], {type: 'text/csv'})));
    return {...of, bar};
  }

  function head(parent, told) {
    const box = make('section', parent, undefined, 'head'), list = make('dl', box);
    const fact = (name, text) => { make('dt', list, name); make('dd', list, text); };
    (told.rigs || []).forEach((rig, i) => fact(i === 0 ? 'rig' : '', rig));
    if (told.date) fact('page written', told.date);
    (told.made || []).forEach((made, i) => fact(i === 0 ? 'commands' : '', made));
    if (told.conditions) table(box, told.conditions, 'conditions');
  }

  function contents(parent, blocks) {
    const sections = blocks.filter((block) => block.type === 'section');
    if (sections.length < 2) return;
    const nav = make('nav', parent), list = make('ol', nav);
    nav.setAttribute('aria-label', 'contents');
    sections.forEach((block, i) => { const link = make('a', make('li', list), block.title); link.href = '#section' + i; });
  }

  function equation(parent, block) {
    const line = make('p', parent, undefined, 'equation');
    if (block.name) make('span', line, block.name, 'name');
    line.appendChild(unrigEquation.set(block.text));
    if (block.source) make('span', line, block.source, 'source');
  }

  function table(parent, block, name) {
    if (block.title) make('h3', parent, block.title);
    report.figures[name] = tools(parent, block.title || name, {csv: () => unrigDrawing.csv.table(block)});
    const t = make('table', make('div', parent, undefined, 'scroll'));
    const numeric = block.header.map((_, c) => block.rows.length > 0 && block.rows.every((row) => /^(\(?[-+\u2212]?[.\d]|\u2014)/.test(row[c] || '\u2014')));
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

  // Behind the data: stretches with a name, and vertical lines with theirs.
  function underlay(block) {
    return (context, area, graph) => {
      context.save();
      context.font = '12px sans-serif';
      const place = (x) => area.x + graph.toPercentXCoord(x) * area.w;  // toDomXCoord takes every axis for linear
      for (const box of block.boxes || []) {
        const left = Math.max(area.x, place(box.from)), right = Math.min(area.x + area.w, place(box.to));
        if (!(right > left)) continue;
        context.fillStyle = context.strokeStyle = colours().bad;
        context.globalAlpha = 0.12;
        context.fillRect(left, area.y, right - left, area.h);
        context.globalAlpha = 0.6;
        context.strokeRect(left, area.y, right - left, area.h);
        context.globalAlpha = 1;
        context.fillText(box.name, left + 4, area.y + area.h - 6, Math.max(20, area.x + area.w - left - 6));
      }
      context.strokeStyle = context.fillStyle = colours().mark;
      context.setLineDash([3, 4]);
      const inside = (block.marks || []).filter((mark) => { const at = place(mark.x); return at >= area.x && at <= area.x + area.w; });
      const rows = unrigDrawing.rows_of_names(inside, place, (name) => context.measureText(name).width);
      inside.forEach((mark, i) => {
        const at = place(mark.x), width = context.measureText(mark.name).width;
        context.beginPath();
        context.moveTo(at, area.y);
        context.lineTo(at, area.y + area.h);
        context.stroke();
        if (rows[i] >= 0) context.fillText(mark.name, Math.min(at + 4, area.x + area.w - width), area.y + 12 + 14 * rows[i]);
      });
      context.restore();
    };
  }

  // Shares of a whole, the last at the bottom. Dygraphs' own stacks leave out the top one of long records.
  function stack(block) {
    return (e) => {
      if (e.seriesIndex !== 0) return;  // all at once
      const context = e.drawingContext, sets = e.allSeriesPoints, x = sets[0].map((point) => point.canvasx);
      const rows = x.map((_, k) => k).filter((k) => sets.every((points) => isFinite(points[k].yval)));
      let below = x.map(() => 0);
      context.save();
      context.globalAlpha = 0.75;
      for (let s = sets.length - 1; s >= 0; --s) {
        const under = below, above = under.map((y, k) => y + sets[s][k].yval);
        context.fillStyle = colours().series[block.series[s].colour];
        context.beginPath();
        for (const k of rows) context.lineTo(x[k], e.dygraph.toDomYCoord(above[k]));
        for (const k of [...rows].reverse()) context.lineTo(x[k], e.dygraph.toDomYCoord(under[k]));
        context.fill();
        below = above;
      }
      context.restore();
    };
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
        y: {axisLabelFormatter: readable, valueFormatter: readable, axisLabelWidth: 72, ticker: block.log_y ? decades : Dygraph.numericLinearTicks, valueRange: block.stacked ? [0, 1] : block.y_range || null},
      },
    }, look(), block.stacked ? {plotter: stack(block), highlightCircleSize: 0} : {}, block.marks || block.boxes ? {underlayCallback: underlay(block)} : {}, block.group ? follow(block.group) : {}));
    if (block.group) (groups[block.group] = groups[block.group] || []).push(graph);
    report.graphs[name] = graph;
    const range = () => ({x: graph.xAxisRange(), y: graph.yAxisRange()});
    report.figures[name] = tools(figure, block.title || block.y_label, {svg: () => unrigDrawing.plot(block, range(), on_paper()), csv: () => unrigDrawing.csv.plot(block)});
    if (block.y_range) {
      const button = make('button', undefined, 'whole scale');
      button.type = 'button';
      let whole = false;
      button.addEventListener('click', () => {
        whole = !whole;
        button.textContent = whole ? 'without the spike' : 'whole scale';
        graph.updateOptions({axes: {y: {valueRange: whole ? null : block.y_range}}});
      });
      report.figures[name].bar.prepend(button);
    }
    report.redraw.push(() => graph.updateOptions(look()));
  }

  // A figure that is drawn as SVG, at the width that it has.
  function drawn(parent, block, name, kind, make_svg, csv) {
    const figure = make('figure', parent);
    if (block.title) make('h3', figure, block.title);
    const box = make('div', figure, undefined, 'drawn ' + kind);
    box.setAttribute('role', 'img');
    box.setAttribute('aria-label', block.title);
    if (block.caption) make('figcaption', figure, block.caption);
    report.figures[name] = tools(figure, block.title, {svg: () => make_svg(on_paper(), 900, true), csv});
    const draw = () => box.replaceChildren(make_svg(colours(), Math.max(280, Math.floor(box.clientWidth || 900)), false));
    report.redraw.push(draw);
    draw();
    requestAnimationFrame(draw);
  }
  function map(parent, block, name) {
    const colour = unrigDrawing.coloured(block);
    report.pictures[name] = colour.image;
    drawn(parent, block, name, 'map', (look, width, titled) => unrigDrawing.map(colour, look, width, titled), () => unrigDrawing.csv.map(block));
  }
  const bars = (parent, block, name) => drawn(parent, block, name, 'bars', (look, width, titled) => unrigDrawing.bars(block, look, width, titled), () => unrigDrawing.csv.bars(block));

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
  if (data.head) head(main, data.head);
  for (const v of data.verdicts) verdict(main, v);
  contents(main, data.blocks);
  let section = main, sections = 0;
  data.blocks.forEach((block, i) => {
    const name = block.type + i;
    if (block.type === 'section') {
      section = make('section', main);
      make('h2', section, block.title).id = 'section' + sections++;
    }
    if (block.type === 'heading') make('h3', section, block.title, 'chapter');
    if (block.type === 'text') make('p', section, block.text);
    if (block.type === 'equation') equation(section, block);
    if (block.type === 'table') table(section, block, name);
    if (block.type === 'plot') plot(section, block, name);
    if (block.type === 'map') map(section, block, name);
    if (block.type === 'bars') bars(section, block, name);
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

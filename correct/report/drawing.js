'use strict';
// Figures as SVG: the maps and bars of the page, and every figure as a file. Nothing here looks at the page; `look` has the colours.
const unrigDrawing = (() => {
  const ns = 'http://www.w3.org/2000/svg';
  const cividis = ['#00204c', '#00306f', '#2a406c', '#48526b', '#5e626e', '#727374', '#878479', '#9e9677', '#b6a971', '#d0be67', '#ead357', '#ffea46'];
  const diverging = ['#2166ac', '#67a9cf', '#d1e5f0', '#f7f7f7', '#fddbc7', '#ef8a62', '#b2182b'];  // blue to red by way of white

  const element = (name, parent, attributes, text) => {
    const made = document.createElementNS(ns, name);
    for (const [key, value] of Object.entries(attributes || {})) made.setAttribute(key, value);
    if (text !== undefined) made.textContent = text;
    if (parent) parent.appendChild(made);
    return made;
  };
  const sheet = (width, height, look) => {
    const svg = element('svg', null, {xmlns: ns, width, height, viewBox: `0 0 ${width} ${height}`, 'font-family': 'sans-serif', 'font-size': 13, fill: look.ink});
    if (look.paper) element('rect', svg, {width, height, fill: look.paper});
    return svg;
  };

  // Four digits; a minus sign as printers set it.
  const readable = (x) => {
    if (x === null || !isFinite(x)) return '';
    const size = Math.abs(x);
    const text = size !== 0 && (size < 1e-3 || size >= 1e5) ? (+x.toPrecision(3)).toExponential().replace('e+', 'e') : String(+x.toPrecision(5));
    return text.replace('-', '\u2212');
  };
  // Decades with their numbers, and the 2 to 9 between them without.
  function decades(low, high) {
    const found = [];
    for (let power = Math.floor(Math.log10(low)); power <= Math.log10(high); ++power)
      for (let m = 1; m < 10; ++m) {
        const v = +(m * Math.pow(10, power)).toPrecision(6);
        if (v < low || v > high) continue;
        const narrow = high / low < 200 && (m === 2 || m === 5);
        found.push({v, label: m === 1 || narrow ? readable(v) : ''});
      }
    return found;
  }
  function ticks(low, high, count) {
    const rough = (high - low) / count, power = Math.pow(10, Math.floor(Math.log10(rough)));
    const step = [1, 2, 5, 10].map((m) => m * power).find((s) => s >= rough) || rough;
    const found = [];
    for (let k = Math.ceil(low / step); k * step <= high + 1e-9 * step && found.length < 50; ++k) found.push(+(k * step).toPrecision(12));
    return found;
  }

  // One side of a frame: {low, high, log, label, names}; `at` turns a value into 0 to 1.
  const scale = (side) => {
    const f = side.log ? Math.log10 : (v) => v, low = f(side.low), high = f(side.high);
    return (v) => (f(v) - low) / (high - low);
  };
  const marked = (side, count) => {
    if (side.names) return side.names.map((label, v) => ({v, label}));
    return side.log ? decades(side.low, side.high) : ticks(side.low, side.high, count).map((v) => ({v, label: readable(v)}));
  };
  // The axes round a box {left, top, w, h}, and functions from values to places.
  function frame(svg, box, x, y, look, grid) {
    const share_x = scale(x), share_y = scale(y);
    const px = (v) => box.left + box.w * share_x(v), py = (v) => box.top + box.h * (1 - share_y(v));
    for (const t of marked(x, 8)) {
      if (grid) element('line', svg, {x1: px(t.v), x2: px(t.v), y1: box.top, y2: box.top + box.h, stroke: look.line});
      if (x.names) element('text', svg, {'text-anchor': 'end', transform: `translate(${px(t.v) + 4} ${box.top + box.h + 8}) rotate(-60)`, 'font-size': 11}, t.label);
      else element('text', svg, {x: px(t.v), y: box.top + box.h + 18, 'text-anchor': 'middle'}, t.label);
    }
    for (const t of marked(y, 6)) {
      if (grid) element('line', svg, {x1: box.left, x2: box.left + box.w, y1: py(t.v), y2: py(t.v), stroke: look.line});
      element('text', svg, {x: box.left - 6, y: py(t.v) + 4, 'text-anchor': 'end', 'font-size': y.names ? 11 : 13}, t.label);
    }
    element('rect', svg, {x: box.left, y: box.top, width: box.w, height: box.h, fill: 'none', stroke: look.mark});
    if (x.label) element('text', svg, {x: box.left + box.w / 2, y: box.top + box.h + 38, 'text-anchor': 'middle'}, x.label);
    if (y.label) upright(svg, y.label, 14, box.top + box.h / 2);
    return {px, py};
  }
  const upright = (svg, text, x, y) => element('text', svg, {'text-anchor': 'middle', transform: `translate(${x} ${y}) rotate(-90)`}, text);

  // A curve with its gaps; a band of two standard deviations to either side of it.
  function curve(svg, block, s, px, py, colour) {
    const whole = (k) => s.v[k] !== null && isFinite(py(s.v[k])) && isFinite(px(block.x[k]));
    const at = (k, v) => `${px(block.x[k]).toFixed(2)} ${py(v).toFixed(2)}`;
    if (s.points) {
      block.x.forEach((x, k) => { if (whole(k)) element('circle', svg, {cx: px(x).toFixed(2), cy: py(s.v[k]).toFixed(2), r: 2, fill: colour}); });
      return;
    }
    for (let first = 0; first < block.x.length; ++first) {
      if (!whole(first)) continue;
      let last = first;
      while (last + 1 < block.x.length && whole(last + 1)) ++last;
      const rows = [...Array(last - first + 1).keys()].map((k) => first + k);
      if (s.std) {
        const edge = (sign) => rows.map((k) => at(k, s.v[k] + 2 * sign * s.std[k]));
        element('polygon', svg, {points: [...edge(1), ...edge(-1).reverse()].join(' '), fill: colour, 'fill-opacity': 0.25});
      }
      const line = element('polyline', svg, {points: rows.map((k) => at(k, s.v[k])).join(' '), fill: 'none', stroke: colour, 'stroke-width': s.width || 1.4, 'stroke-linejoin': 'round'});
      if (s.dashed) line.setAttribute('stroke-dasharray', '7 4');
      first = last;
    }
  }

  // Shares of a whole: the last at the bottom, each on those that follow it.
  function stack(svg, block, px, py, look) {
    const rows = block.x.map((_, k) => k).filter((k) => block.series.every((s) => s.v[k] !== null));
    let below = rows.map(() => 0);
    for (const s of [...block.series].reverse()) {
      const above = rows.map((k, i) => below[i] + s.v[k]);
      const edge = (y) => rows.map((k, i) => `${px(block.x[k]).toFixed(2)} ${py(y[i]).toFixed(2)}`);
      element('polygon', svg, {points: [...edge(above), ...edge(below).reverse()].join(' '), fill: look.series[s.colour], 'fill-opacity': 0.75, class: 'share'});
      below = above;
    }
  }

  // Names of marks in up to three rows; one that finds no room is left out, its line stays.
  function rows_of_names(marks, place, width_of) {
    const ends = [-Infinity, -Infinity, -Infinity];
    return marks.map((mark) => {
      const x = place(mark.x), row = ends.findIndex((end) => end < x);
      if (row >= 0) ends[row] = x + width_of(mark.name) + 8;
      return row;
    });
  }

  function head(svg, block, width, look) {
    let y = 20;
    if (block.title) element('text', svg, {x: 10, y, 'font-weight': 600, 'font-size': 15}, block.title);
    const shown = block.series || [];
    let x = 10;
    if (shown.length) y += 20;
    for (const s of shown) {
      const wide = 34 + 7.2 * s.name.length;
      if (x + wide > width && x > 10) { x = 10; y += 18; }
      const colour = look.series[s.colour];
      if (s.points) element('circle', svg, {cx: x + 11, cy: y - 4, r: 3, fill: colour});
      else element('line', svg, {x1: x, x2: x + 22, y1: y - 4, y2: y - 4, stroke: colour, 'stroke-width': 2, 'stroke-dasharray': s.dashed ? '7 4' : 'none'});
      element('text', svg, {x: x + 27, y}, s.name);
      x += wide;
    }
    return y + 12;
  }

  // A plot as it is shown: `range` {x: [low, high], y: [low, high]}.
  function plot(block, range, look, width = 900) {
    const height = (block.height || 260) + 110, svg = sheet(width, height, look);
    const top = head(svg, block, width, look), box = {left: 84, top, w: width - 104, h: height - top - 50};
    const x = {low: range.x[0], high: range.x[1], log: block.log_x, label: block.x_label}, y = {low: range.y[0], high: range.y[1], log: block.log_y, label: block.y_label};
    const {px, py} = frame(svg, box, x, y, look, true);
    const inner = element('svg', svg, {x: box.left, y: box.top, width: box.w, height: box.h, viewBox: `${box.left} ${box.top} ${box.w} ${box.h}`});
    for (const b of block.boxes || []) {
      const left = px(Math.max(b.from, range.x[0])), right = px(Math.min(b.to, range.x[1]));
      if (!(right > left)) continue;
      element('rect', inner, {x: left, y: box.top, width: right - left, height: box.h, fill: look.bad, 'fill-opacity': 0.1, stroke: look.bad, 'stroke-opacity': 0.5});
      element('text', inner, {x: left + 4, y: box.top + box.h - 6, 'font-size': 12, fill: look.bad}, b.name);
    }
    const marks = (block.marks || []).filter((m) => m.x >= range.x[0] && m.x <= range.x[1]), rows = rows_of_names(marks, px, (name) => 6.5 * name.length);
    marks.forEach((m, i) => {
      element('line', inner, {x1: px(m.x), x2: px(m.x), y1: box.top, y2: box.top + box.h, stroke: look.mark, 'stroke-dasharray': '3 4'});
      if (rows[i] >= 0) element('text', inner, {x: Math.min(px(m.x) + 4, box.left + box.w - 6.5 * m.name.length), y: box.top + 14 + 14 * rows[i], 'font-size': 12, fill: look.mark}, m.name);
    });
    if (block.stacked) stack(inner, block, px, py, look);
    else for (const s of block.series) curve(inner, block, s, px, py, look.series[s.colour]);
    return svg;
  }

  const between = (stops, share) => {
    const at = Math.min(Math.max(share, 0), 1) * (stops.length - 1), low = Math.min(Math.floor(at), stops.length - 2);
    const part = (stop, i) => parseInt(stop.slice(1 + 2 * i, 3 + 2 * i), 16);
    return [0, 1, 2].map((i) => Math.round(part(stops[low], i) + (at - low) * (part(stops[low + 1], i) - part(stops[low], i))));
  };

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

  // A map in colours: one dot of `image` per cell.
  function coloured(block) {
    if (block.signed && !block.x_names) block = cropped(block);
    const values = block.z.flat().filter((z) => z !== null && (!block.log_z || z > 0)).map((z) => block.log_z ? Math.log10(z) : z);
    let low = values.reduce((a, b) => Math.min(a, b), Infinity), high = values.reduce((a, b) => Math.max(a, b), -Infinity);
    if (block.log_z) low = Math.max(low, high - 6);
    if (block.signed) { high = block.limit || Math.max(Math.abs(low), Math.abs(high)); low = -high; }
    if (!(high > low)) high = low + 1;
    const stops = block.signed ? diverging : cividis, columns = block.x.length, lines = block.y.length;
    const image = document.createElement('canvas');
    image.width = columns; image.height = lines;
    const pixels = image.getContext('2d').createImageData(columns, lines);
    for (let j = 0; j < lines; ++j)
      for (let i = 0; i < columns; ++i) {
        let z = block.z[j][i];
        if (z === null || z === undefined) continue;  // stays transparent
        if (block.log_z) z = z > 0 ? Math.log10(z) : low;
        pixels.data.set([...between(stops, (z - low) / (high - low)), 255], 4 * ((lines - 1 - j) * columns + i));
      }
    image.getContext('2d').putImageData(pixels, 0, 0);
    return {block, image, picture: image.toDataURL('image/png'), low, high, stops};
  }

  // z over x (columns) and y (rows, the first at the bottom), with its scale at the right.
  function map({block, picture, low, high, stops}, look, width, titled) {
    const longest = (names) => names ? Math.min(240, 12 + 6 * Math.max(...names.map((name) => name.length))) : 0;
    const left = Math.min(Math.max(76, longest(block.y_names)), width / 2.2), right = 110, top = titled ? 34 : 10, below = Math.max(46, longest(block.x_names));
    const w = Math.max(60, width - left - right), h = block.y_names ? Math.max(120, Math.min(20 * block.y.length, 900)) : 264, svg = sheet(width, top + h + below, look);
    if (titled && block.title) element('text', svg, {x: 10, y: 20, 'font-weight': 600, 'font-size': 15}, block.title);
    const edges = (at) => {
      const half = at.length > 1 ? (at[at.length - 1] - at[0]) / (at.length - 1) / 2 : 0.5;
      return [at[0] - half, at[at.length - 1] + half];
    };
    if (block.signed) element('rect', svg, {x: left, y: top, width: w, height: h, fill: look.empty});  // seen where a cell is empty, and no colour of either scale
    element('image', svg, {href: picture, x: left, y: top, width: w, height: h, preserveAspectRatio: 'none', style: 'image-rendering: pixelated'});
    const [x0, x1] = edges(block.x), [y0, y1] = edges(block.y);
    const {px, py} = frame(svg, {left, top, w, h}, {low: x0, high: x1, label: block.x_label, names: block.x_names}, {low: y0, high: y1, label: block.y_label, names: block.y_names}, look, false);
    for (const b of block.boxes || []) {
      const inside = (v, a, c) => Math.min(Math.max(v, a), c);
      const a = px(inside(b.from, x0, x1)), c = px(inside(b.to, x0, x1)), t = py(inside(b.high, y0, y1)), u = py(inside(b.low, y0, y1));
      const round = {x: a - 2, y: t - 2, width: c - a + 4, height: u - t + 4, fill: 'none'};  // a narrow one would hide what it shows
      element('rect', svg, {...round, stroke: '#ffffff', 'stroke-width': 3});
      element('rect', svg, {...round, stroke: '#d55e00', 'stroke-width': 1.5, class: 'mismatch'});
    }
    const steps = 60;
    for (let k = 0; k < steps; ++k)
      element('rect', svg, {x: left + w + 16, y: top + k * h / steps, width: 14, height: h / steps + 0.5, fill: `rgb(${between(stops, 1 - (k + 0.5) / steps).join()})`});
    for (const t of ticks(low, high, 4)) element('text', svg, {x: left + w + 34, y: top + h - (t - low) / (high - low) * h + 4}, block.log_z ? readable(Math.pow(10, t)) : readable(t));
    upright(svg, block.z_label, width - 6, top + h / 2);
    return svg;
  }

  // Bars from nothing to a share, each with its interval.
  function bars(block, look, width, titled) {
    const left = Math.min(200, width / 3), right = Math.min(170, width / 4), top = titled ? 34 : 10, row = 28, w = Math.max(60, width - left - right), h = row * block.rows.length;
    const svg = sheet(width, top + h + 50, look);
    if (titled && block.title) element('text', svg, {x: 10, y: 20, 'font-weight': 600, 'font-size': 15}, block.title);
    const at = (share) => left + w * share;
    for (const t of [0, 0.25, 0.5, 0.75, 1]) {
      element('line', svg, {x1: at(t), x2: at(t), y1: top, y2: top + h, stroke: look.line});
      element('text', svg, {x: at(t), y: top + h + 18, 'text-anchor': 'middle'}, `${100 * t}`);
    }
    block.rows.forEach((r, i) => {
      const y = top + row * i, middle = y + row / 2;
      element('text', svg, {x: left - 8, y: middle + 4, 'text-anchor': 'end', 'font-size': 12}, r.name);
      element('rect', svg, {x: at(0), y: y + 6, width: Math.max(0.5, w * r.value), height: row - 12, fill: look.series[r.colour], 'fill-opacity': 0.65, class: 'bar'});
      element('line', svg, {x1: at(r.low), x2: at(r.high), y1: middle, y2: middle, stroke: look.ink, 'stroke-width': 1.6, class: 'interval'});
      for (const end of [r.low, r.high]) element('line', svg, {x1: at(end), x2: at(end), y1: middle - 5, y2: middle + 5, stroke: look.ink, 'stroke-width': 1.6});
      element('text', svg, {x: left + w + 8, y: middle + 4, 'font-size': 12}, r.text);
    });
    element('text', svg, {x: left + w / 2, y: top + h + 40, 'text-anchor': 'middle'}, block.label);
    return svg;
  }

  const cell = (value) => {
    const text = value === null || value === undefined ? '' : String(value);
    return /[",\n]/.test(text) ? '"' + text.replace(/"/g, '""') + '"' : text;
  };
  const lines = (rows) => rows.map((row) => row.map(cell).join(',') + '\n').join('');
  // The numbers of a block, as a table that other programs read.
  const csv = {
    table: (block) => lines([block.header, ...block.rows]),
    plot: (block) => lines([[block.x_label, ...block.series.flatMap((s) => s.std ? [s.name, s.name + ' (one standard deviation)'] : [s.name])],
      ...block.x.map((x, k) => [x, ...block.series.flatMap((s) => s.std ? [s.v[k], s.std[k]] : [s.v[k]])])]),
    map: (block) => lines([[block.x_label || 'x', block.y_label || 'y', block.z_label],
      ...block.y.flatMap((y, j) => block.x.map((x, i) => [block.x_names ? block.x_names[i] : x, block.y_names ? block.y_names[j] : y, block.z[j][i]]))]),
    bars: (block) => lines([['name', 'value', 'low', 'high', 'count'], ...block.rows.map((r) => [r.name, r.value, r.low, r.high, r.text])]),
  };

  const text_of = (svg) => '<?xml version="1.0" encoding="UTF-8"?>\n' + new XMLSerializer().serializeToString(svg) + '\n';
  // A picture of an SVG, in dots that paper needs; a promise of a canvas.
  const painted = (svg) => new Promise((done, failed) => {
    const picture = new Image(), dots = 2.5;
    picture.onload = () => {
      const canvas = document.createElement('canvas');
      canvas.width = Math.round(svg.getAttribute('width') * dots);
      canvas.height = Math.round(svg.getAttribute('height') * dots);
      canvas.getContext('2d').drawImage(picture, 0, 0, canvas.width, canvas.height);
      done(canvas);
    };
    picture.onerror = () => failed(new Error('the figure cannot be drawn'));
    picture.src = 'data:image/svg+xml;charset=utf-8,' + encodeURIComponent(text_of(svg));
  });

  return {readable, decades, rows_of_names, plot, coloured, map, bars, csv, text_of, painted};
})();

// Plots as SVG. `createPlots` returns { setTime, setHover }; a click or drag on a time plot calls onSeek(t).
const PALETTE = ["#2f6fde", "#e8743b", "#2f9e6b", "#8b5fd0", "#c2488a", "#1899a8", "#b58a1b", "#6b7785"];

function createPlots(container, plots, replay, onSeek) {
  const NS = "http://www.w3.org/2000/svg";
  const MARGIN = { top: 18, right: 10, bottom: 20, bottomWithLabel: 36 };
  let time = null, hover = null, serial = 0;

  function node(parent, name, attributes = {}, text) {
    const element = document.createElementNS(NS, name);
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    if (text !== undefined) element.textContent = text;
    if (parent) parent.appendChild(element);
    return element;
  }
  function html(parent, name, className, text) {
    const element = document.createElement(name);
    if (className) element.className = className;
    if (text !== undefined) element.textContent = text;
    parent.appendChild(element);
    return element;
  }

  // About `count` round values that span low to high.
  function ticks(low, high, count) {
    const raw = (high - low) / Math.max(1, count), power = Math.pow(10, Math.floor(Math.log10(raw)));
    const step = [1, 2, 2.5, 5, 10].map(m => m * power).find(s => s >= raw * 0.999) || raw;
    const values = [];
    for (let i = Math.ceil(low / step - 1e-9); i * step <= high + step * 1e-9; i++) values.push(i * step);
    const decimals = Math.max(0, -Math.floor(Math.log10(step) + 1e-9) + (Math.abs(step / power - 2.5) < 1e-6 ? 1 : 0));
    return { values, step, decimals: Math.min(decimals, 8) };
  }
  const written = (v, decimals) => (Math.abs(v) >= 1e6 ? v.toExponential(2) : v.toFixed(decimals)).replace(/^-(?=[0.]*$)/, "").replace("-", "\u2212");

  // y at x by interpolation; null in a gap or outside.
  function valueAt(series, x) {
    const xs = series.x;
    if (!xs.length || x < xs[0] - 1e-9 || x > xs[xs.length - 1] + 1e-9) return null;
    const [i, s] = math.frameAt(xs, x);
    const a = series.y[i], b = series.y[Math.min(i + 1, xs.length - 1)];
    if (a === null || a === undefined) return null;
    return b === null || b === undefined || s === 0 ? a : a + (b - a) * s;
  }

  // An SVG path; where there are many points for a pixel only the extremes of each pixel are kept.
  function path(series, toX, toY, width) {
    const n = Math.min(series.x.length, series.y.length);
    const bucket = series.rising && n > 4 * width ? Math.ceil(n / (2 * width)) : 1;
    let text = "", pen = false;
    const point = i => {
      const y = series.y[i];
      if (y === null || series.x[i] === null) { pen = false; return; }
      text += (pen ? "L" : "M") + toX(series.x[i]).toFixed(1) + " " + toY(y).toFixed(1);
      pen = true;
    };
    for (let i = 0; i < n; i += bucket) {
      if (bucket === 1) { point(i); continue; }
      let low = i, high = i, gap = -1;
      for (let j = i; j < Math.min(i + bucket, n); j++) {
        if (series.y[j] === null) { gap = j; continue; }
        if (series.y[low] === null || series.y[j] < series.y[low]) low = j;
        if (series.y[high] === null || series.y[j] > series.y[high]) high = j;
      }
      point(Math.min(low, high));
      if (low !== high) point(Math.max(low, high));
      if (gap >= 0) pen = false;
    }
    return text;
  }

  function extent(plot) {
    let x0 = Infinity, x1 = -Infinity, y0 = Infinity, y1 = -Infinity;
    for (const s of plot.series)
      for (let i = 0; i < Math.min(s.x.length, s.y.length); i++) {
        if (s.y[i] === null || s.x[i] === null) continue;
        x0 = Math.min(x0, s.x[i]); x1 = Math.max(x1, s.x[i]);
        y0 = Math.min(y0, s.y[i]); y1 = Math.max(y1, s.y[i]);
      }
    if (plot.time && replay && replay.times.length > 1) { x0 = replay.times[0]; x1 = replay.times[replay.times.length - 1]; }
    if (!(x1 > x0)) { x0 = Number.isFinite(x0) ? x0 - 0.5 : 0; x1 = x0 + 1; }
    if (!Number.isFinite(y0)) { y0 = 0; y1 = 1; }
    // A limit is shown if that leaves the lines a third of the height; otherwise it is named at the edge.
    const span = Math.max(y1 - y0, Math.abs(y1) * 0.05, 1e-9);
    for (const [, v] of plot.limits)
      if (Math.max(y1, v) - Math.min(y0, v) < 3.2 * span) { y0 = Math.min(y0, v); y1 = Math.max(y1, v); }
    const pad = Math.max((y1 - y0) * 0.07, Math.abs(y1) * 1e-6, 1e-9);
    return { x0, x1, y0: y0 - pad, y1: y1 + pad };
  }

  function makePlot(plot) {
    const figure = html(container, "figure", "plot card");
    const caption = html(figure, "figcaption", "", plot.title);
    html(caption, "span", "", plot.yLabel);
    const legend = html(figure, "ul", "legend");
    plot.series.forEach((s, k) => {
      s.color = s.color || PALETTE[k % PALETTE.length];
      if (s.points) { s.x = s.points.map(p => p[0]); s.y = s.points.map(p => p[1]); }
      else s.x = plot.x || (replay ? replay.times : []);
      s.rising = s.x.every((v, i) => i === 0 || v >= s.x[i - 1]);
      const item = html(legend, "li");
      const swatch = node(item, "svg", { viewBox: "0 0 14 4" });
      node(swatch, "line", { x1: 0, x2: 14, y1: 2, y2: 2, stroke: s.color, "stroke-width": 3, ...(s.dashed ? { "stroke-dasharray": "4 3" } : {}) });
      html(item, "span", "", s.name);
      s.readout = html(item, "b");
    });
    const svg = node(figure, "svg", { class: "chart", role: "img", "aria-label": plot.title });
    const clip = "clip" + serial++, range = extent(plot);
    let toX, toY, fromX, left, cursor, hoverLine, dots = [], decimals = 2;

    function drawChart() {
      const width = svg.clientWidth, height = svg.clientHeight;
      if (!width || !height) return;
      svg.replaceChildren();
      svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
      const yTicks = ticks(range.y0, range.y1, (height - 40) / 26);
      decimals = Math.min(6, Math.max(0, 2 - Math.floor(Math.log10(range.y1 - range.y0) + 1e-9)));
      const labels = yTicks.values.map(v => written(v, yTicks.decimals));
      left = 12 + 6.6 * Math.max(2, ...labels.map(l => l.length));
      const xName = plot.time ? "" : plot.xLabel;
      const right = width - MARGIN.right, bottom = height - (xName ? MARGIN.bottomWithLabel : MARGIN.bottom), top = MARGIN.top;
      toX = x => left + ((x - range.x0) / (range.x1 - range.x0)) * (right - left);
      fromX = px => range.x0 + math.clamp((px - left) / (right - left), 0, 1) * (range.x1 - range.x0);
      toY = y => bottom - ((y - range.y0) / (range.y1 - range.y0)) * (bottom - top);

      node(node(node(svg, "defs"), "clipPath", { id: clip }), "rect", { x: left, y: top - 1, width: right - left, height: bottom - top + 2 });
      for (const [label, a, b] of plot.regions) {
        const xa = math.clamp(toX(Math.min(a, b)), left, right), xb = math.clamp(toX(Math.max(a, b)), left, right);
        if (xb <= xa) continue;
        const band = node(svg, "rect", { class: "region", x: xa, y: top, width: xb - xa, height: bottom - top });
        node(band, "title", {}, label);
        for (const x of [xa, xb]) node(svg, "line", { class: "region-edge", x1: x, x2: x, y1: top, y2: bottom });
        if (label.length * 6 < xb - xa) node(svg, "text", { class: "region-label", x: (xa + xb) / 2, y: top - 6, "text-anchor": "middle" }, label);
      }
      yTicks.values.forEach((v, i) => {
        node(svg, "line", { class: Math.abs(v) < yTicks.step * 1e-6 ? "zero" : "grid", x1: left, x2: right, y1: toY(v), y2: toY(v) });
        node(svg, "text", { x: left - 6, y: toY(v) + 3.8, "text-anchor": "end" }, labels[i]);
      });
      const xTicks = ticks(range.x0, range.x1, (right - left) / 64);
      xTicks.values.forEach((v, i) => {
        const last = i === xTicks.values.length - 1, x = toX(v);
        const text = written(v, xTicks.decimals) + (last && plot.time ? " s" : "");
        const anchor = x + 3.4 * text.length > width ? "end" : "middle";
        node(svg, "line", { class: "grid", x1: x, x2: x, y1: bottom, y2: bottom + 3 });
        node(svg, "text", { x: anchor === "end" ? width - 1 : x, y: bottom + 15, "text-anchor": anchor }, text);
      });
      if (xName) node(svg, "text", { x: (left + right) / 2, y: height - 5, "text-anchor": "middle" }, xName);
      if (plot.time && replay)
        for (const [t, label] of replay.events) {
          if (t < range.x0 || t > range.x1) continue;
          const line = node(svg, "line", { class: "event", x1: toX(t), x2: toX(t), y1: top, y2: bottom });
          node(line, "title", {}, label);
        }
      const lines = node(svg, "g", { "clip-path": `url(#${clip})` });
      for (const s of [...plot.series].reverse())
        node(lines, "path", { class: "series", d: path(s, toX, toY, right - left), stroke: s.color, ...(s.dashed ? { "stroke-dasharray": "5 4" } : {}) });
      // Whether a line runs through the place above a limit's right end, where its label would stand.
      const crowded = (text, y) => y + 16 < bottom && plot.series.some(s => s.y.some((v, i) =>
        v !== null && s.x[i] !== null && toX(s.x[i]) > right - 7 * text.length && toY(v) < y - 2 && toY(v) > y - 17));
      for (const [label, v] of plot.limits) {
        const inside = v >= range.y0 && v <= range.y1, y = inside ? toY(v) : v > range.y1 ? top + 4 : bottom - 4;
        const text = inside ? label : `${v > range.y1 ? "\u2191" : "\u2193"} ${label} ${written(v, Math.min(decimals, 2))}`;
        if (inside) node(svg, "line", { class: "limit", x1: left, x2: right, y1: y, y2: y });
        const under = inside ? crowded(text, y) || y - top < 14 : v > range.y1;
        node(svg, "text", { class: "limit-label halo", x: right - 3, y: under ? y + 12 : y - 4, "text-anchor": "end" }, text);
      }
      hoverLine = node(svg, "line", { class: "hover", y1: top, y2: bottom, visibility: "hidden" });
      cursor = node(svg, "line", { class: "cursor", y1: top, y2: bottom, visibility: "hidden" });
      dots = plot.series.map(s => node(svg, "circle", { class: "dot", r: 3.4, fill: s.color, visibility: "hidden" }));
      update();
    }

    // Moves the cursor and writes the values under it (or under the pointer).
    let ownHover = null;
    function update() {
      if (!toX) return;
      const at = plot.time ? time : null, over = plot.time ? hover : ownHover, shown = over ?? at;
      const line = (element, x) => {
        const visible = x !== null && x >= range.x0 && x <= range.x1;
        element.setAttribute("visibility", visible ? "visible" : "hidden");
        if (visible) { element.setAttribute("x1", toX(x)); element.setAttribute("x2", toX(x)); }
      };
      line(cursor, at);
      line(hoverLine, over);
      plot.series.forEach((s, k) => {
        const y = shown === null || !s.rising ? null : valueAt(s, shown);
        s.readout.textContent = y === null ? "" : written(y, decimals);
        const visible = y !== null && y >= range.y0 && y <= range.y1;
        dots[k].setAttribute("visibility", visible ? "visible" : "hidden");
        if (visible) { dots[k].setAttribute("cx", toX(shown)); dots[k].setAttribute("cy", toY(y)); }
      });
    }
    // The widest value a series can show keeps the legend from jumping.
    for (const s of plot.series) s.readout.style.minWidth = "3.2em";

    const xOf = event => fromX(event.clientX - svg.getBoundingClientRect().left);
    const setOver = x => { if (plot.time) api.setHover(x); else { ownHover = x; update(); } };
    let dragging = false;
    svg.addEventListener("pointerdown", event => {
      if (!fromX || event.button !== 0) return;
      dragging = plot.time;
      if (dragging) onSeek(xOf(event));
    });
    svg.addEventListener("pointermove", event => {
      if (!fromX) return;
      if (dragging && event.buttons) onSeek(xOf(event));
      setOver(xOf(event));
    });
    svg.addEventListener("pointerup", () => { dragging = false; });
    svg.addEventListener("pointerleave", () => { dragging = false; setOver(null); });
    new ResizeObserver(drawChart).observe(svg);
    return update;
  }

  const updates = [];
  const api = {
    setTime(t) { time = t; for (const update of updates) update(); },
    setHover(t) { hover = t; for (const update of updates) update(); },
  };
  for (const plot of plots) updates.push(makePlot(plot));
  return api;
}

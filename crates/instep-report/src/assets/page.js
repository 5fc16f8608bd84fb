// The page: reads the data, keeps the clock, and ties view, time line and plots together.
(() => {
  const find = id => document.getElementById(id);
  const data = JSON.parse(find("data").textContent);
  const replay = data.replay;

  // Base64 of little-endian f32.
  function floats(text) {
    const bytes = Uint8Array.from(atob(text), c => c.charCodeAt(0)), view = new DataView(bytes.buffer);
    return Float32Array.from({ length: bytes.length >> 2 }, (_, i) => view.getFloat32(4 * i, true));
  }
  if (replay)
    for (const actor of replay.actors) {
      for (const part of actor.parts) part.poses = floats(part.poses);
      for (const arrow of actor.arrows) arrow.frames = floats(arrow.frames);
    }

  const start = replay && replay.times.length ? replay.times[0] : 0;
  const end = replay && replay.times.length ? replay.times[replay.times.length - 1] : 0;
  const SPEEDS = [0.05, 0.1, 0.2, 0.25, 0.5, 1, 2];
  let time = start, playing = false, speed = 1, view = null, plots = null;

  if (data.matrix) createMatrix(find("matrix"), data.matrix);
  if (data.plots.length) plots = createPlots(find("plots"), data.plots, replay, t => { if (replay) { setPlaying(false); setTime(t); } });
  if (!replay) return;

  // ---- View ----------------------------------------------------------------------------------------------------
  const canvas = find("view"), frame = canvas.parentElement;
  function complain(text) {
    find("message").textContent = text;
    find("message").hidden = false;
    for (const element of [canvas, find("actors"), ...frame.querySelectorAll(".cameras, .hint")]) element.hidden = true;
  }
  try {
    view = createView(canvas, replay, () => frame.classList.add("used"));
    canvas.addEventListener("webglcontextlost", () => { view = null; complain("The browser stopped the 3-D view. Reload the page to see it again."); });
  } catch (error) {
    complain("The 3-D view needs WebGL 2, which this browser does not offer. The numbers and plots are complete without it.");
    console.warn(error);
  }
  for (const actor of replay.actors) {
    const entries = [[actor.name, actor.parts[0] && actor.parts[0].color, ""], ...actor.arrows.map(a => [a.name, a.color, "arrow"])];
    for (const [name, color, kind] of entries) {
      if (!name || !color) continue;
      const item = document.createElement("li"), swatch = document.createElement("i");
      swatch.className = kind;
      swatch.style.background = `rgb(${color[0]} ${color[1]} ${color[2]} / ${color[3] / 255})`;
      item.append(swatch, name);
      find("actors").append(item);
    }
  }
  const follow = find("follow");
  follow.addEventListener("click", () => {
    const on = follow.getAttribute("aria-pressed") !== "true";
    follow.setAttribute("aria-pressed", on);
    if (view) view.setFollow(on);
  });
  for (const button of document.querySelectorAll("[data-view]")) button.addEventListener("click", () => view && view.look(button.dataset.view));

  // ---- Time line -----------------------------------------------------------------------------------------------
  const timeline = find("timeline"), part = name => timeline.querySelector("." + name);
  const share = t => (end > start ? math.clamp((t - start) / (end - start), 0, 1) : 0);
  const events = replay.events.filter(([t]) => t >= start && t <= end).sort((a, b) => a[0] - b[0]);
  const labels = events.map(([t, text]) => {
    const tick = document.createElement("i"), label = document.createElement("span");
    tick.style.left = 100 * share(t) + "%";
    tick.title = label.title = `${text}, ${t.toFixed(3)} s`;
    label.textContent = text;
    part("ticks").append(tick);
    part("labels").append(label);
    return { t, label };
  });
  // Labels stand in two rows; one that fits in neither is left to its tick's tooltip.
  function layLabels() {
    const width = timeline.clientWidth, free = [-Infinity, -Infinity];
    for (const { t, label } of labels) {
      label.hidden = false;
      const half = label.offsetWidth / 2, x = math.clamp(share(t) * width, half, Math.max(half, width - half));
      const row = free.findIndex(edge => x - half > edge + 8);
      label.hidden = row < 0;
      if (row < 0) continue;
      free[row] = x + half;
      label.style.left = x + "px";
      label.style.top = (1 - row) * 16 + "px";
    }
  }
  new ResizeObserver(layLabels).observe(timeline);
  timeline.setAttribute("aria-valuemin", start);
  timeline.setAttribute("aria-valuemax", end);
  const scrub = event => {
    const box = timeline.getBoundingClientRect();
    setTime(start + math.clamp((event.clientX - box.left) / box.width, 0, 1) * (end - start));
  };
  timeline.addEventListener("pointerdown", event => { setPlaying(false); timeline.setPointerCapture(event.pointerId); scrub(event); });
  timeline.addEventListener("pointermove", event => { if (timeline.hasPointerCapture(event.pointerId)) scrub(event); });

  // ---- Clock ---------------------------------------------------------------------------------------------------
  const clock = find("clock"), phase = find("phase"), total = document.createElement("small");
  const current = document.createTextNode("");
  total.textContent = ` / ${end.toFixed(3)} s`;
  clock.append(current, total);
  function setTime(t) {
    time = math.clamp(t, start, end);
    if (view) view.setTime(time);
    if (plots) plots.setTime(time);
    current.data = time.toFixed(3);
    part("fill").style.width = part("knob").style.left = 100 * share(time) + "%";
    timeline.setAttribute("aria-valuenow", time.toFixed(3));
    timeline.setAttribute("aria-valuetext", time.toFixed(3) + " s");
    const last = events.filter(([at]) => at <= time + 1e-9).pop();
    phase.textContent = last ? (time - last[0] < 5e-4 ? last[1] : `${(time - last[0]).toFixed(3)} s after ${last[1]}`) : "";
    for (const { t: at, label } of labels) label.classList.toggle("past", at <= time + 1e-9);
  }
  const icons = {
    play: "M4 2.5v11a.7.7 0 0 0 1.1.6l8.4-5.5a.7.7 0 0 0 0-1.2L5.1 1.9A.7.7 0 0 0 4 2.5z",
    pause: "M3.5 2h3v12h-3zM9.5 2h3v12h-3z",
  };
  let before = null, restAtEnd = 0;
  function setPlaying(on) {
    if (on && !playing) { before = null; restAtEnd = 0; if (time >= end) setTime(start); requestAnimationFrame(step); }
    playing = on;
    find("play").innerHTML = `<svg viewBox="0 0 16 16" aria-hidden="true"><path d="${on ? icons.pause : icons.play}"/></svg>`;
  }
  // Plays in a loop, with a breath at the end.
  function step(stamp) {
    if (!playing) return;
    const elapsed = before === null ? 0 : Math.min((stamp - before) / 1000, 0.1);
    before = stamp;
    if (time < end) setTime(time + elapsed * speed);
    else if ((restAtEnd += elapsed) > 0.8) { restAtEnd = 0; setTime(start); }
    requestAnimationFrame(step);
  }
  const slider = find("speed");
  function setSpeed(index) {
    speed = SPEEDS[index];
    slider.value = index;
    find("speed-value").textContent = speed + "\u00d7";
  }
  slider.max = SPEEDS.length - 1;
  slider.addEventListener("input", () => setSpeed(Number(slider.value)));
  find("play").addEventListener("click", () => setPlaying(!playing));
  document.addEventListener("keydown", event => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target.matches("input, button")) return;
    const frameTime = (end - start) / Math.max(1, replay.times.length - 1) * (event.shiftKey ? 10 : 1);
    const keys = {
      " ": () => setPlaying(!playing), f: () => follow.click(),
      ArrowLeft: () => { setPlaying(false); setTime(time - frameTime); }, ArrowRight: () => { setPlaying(false); setTime(time + frameTime); },
      Home: () => setTime(start), End: () => setTime(end),
    };
    const action = keys[event.key];
    if (action) { event.preventDefault(); action(); }
  });

  // ---- Start: ?t=0.9 stops there, ?play=0 stops, ?speed=0.1; the same after a # ---------------------------------
  const wanted = new URLSearchParams(location.search), hash = new URLSearchParams(location.hash.slice(1));
  const option = name => wanted.get(name) ?? hash.get(name);
  const t = parseFloat(option("t"));
  const chosen = SPEEDS.indexOf(parseFloat(option("speed")));
  setSpeed(chosen < 0 ? SPEEDS.indexOf(1) : chosen);
  setTime(Number.isFinite(t) ? t : start);
  const still = Number.isFinite(t) || matchMedia("(prefers-reduced-motion: reduce)").matches;
  const play = option("play");
  setPlaying(end > start && (play === null ? !still : play !== "0"));
  addEventListener("hashchange", () => {
    const to = parseFloat(new URLSearchParams(location.hash.slice(1)).get("t"));
    if (Number.isFinite(to)) { setPlaying(false); setTime(to); }
  });
})();

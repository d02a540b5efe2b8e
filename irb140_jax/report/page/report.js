// The viewer: one joint along one recording; a cursor shared by all drawings.  Without it the page shows the still drawings.
"use strict";
(function () {
  const store = document.getElementById("data"), viewer = document.querySelector(".viewer");
  if (!store || !viewer) return;
  const data = JSON.parse(store.textContent);
  const MODELS = ["nominal", "refit", "corrected"];
  const byId = (id) => document.getElementById(id);
  const jointBox = byId("joint"), recordingBox = byId("recording"), readout = byId("readout");
  const TOP = 8, RIGHT = 10, BOTTOM = 38;
  let plots = [], at = null, LEFT = 62;

  const known = (v) => v !== null && v !== undefined && isFinite(v);
  const range = (lists) => {
    let low = Infinity, high = -Infinity;
    for (const list of lists) for (const v of list) if (known(v)) { if (v < low) low = v; if (v > high) high = v; }
    if (!(high >= low)) return [0, 1];
    const margin = 0.05 * (high - low) || 1;
    return [low - margin, high + margin];
  };
  const ticks = ([low, high], about) => {
    const span = high - low, power = 10 ** Math.floor(Math.log10(span / about));
    const steps = [1, 2, 5, 10].map((m) => m * power);
    const step = steps.reduce((a, b) => (Math.abs(span / b - about) < Math.abs(span / a - about) ? b : a));
    const out = [];
    for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * span; k++) out.push(k * step);
    return out;
  };
  const shown = (v) => (known(v) ? String(parseFloat(v.toPrecision(4))).replace("-", "−") : "–");
  const tickText = (v) => String(parseFloat(v.toPrecision(6))).replace("-", "−");
  const escaped = (s) => s.replace(/[&<>"]/g, (c) => ({ "&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;" })[c]);

  // Room at the left of all drawings, so that no label of an axis lies on those of its ticks; 12 px at most is their font.
  const margin = (lists, h) => 24 + 7.2 * Math.max(...ticks(range(lists), Math.max(2, h / 38)).map((v) => tickText(v).replace(/\./, "").length));

  // One drawing in `host`: lines [{name, x, y}], labels, and the curve {x, y} that the cursor follows.
  function plot(host, width, height, lines, xLabel, yLabel, follow, xRange) {
    const xs = xRange || range(lines.map((l) => l.x)), ys = range(lines.map((l) => l.y));
    const w = width - LEFT - RIGHT, h = height - TOP - BOTTOM;
    const px = (v) => LEFT + (w * (v - xs[0])) / (xs[1] - xs[0]), py = (v) => TOP + h * (1 - (v - ys[0]) / (ys[1] - ys[0]));
    let s = `<rect class="frame" x="${LEFT}" y="${TOP}" width="${w}" height="${h}"/>`;
    for (const v of ticks(ys, Math.max(2, h / 38)))
      s += `<path class="grid" d="M${LEFT} ${py(v).toFixed(1)}h${w}"/><text x="${LEFT - 6}" y="${(py(v) + 3.5).toFixed(1)}" text-anchor="end">${tickText(v)}</text>`;
    for (const v of ticks(xs, Math.max(2, w / 75)))
      s += `<path class="grid" d="M${px(v).toFixed(1)} ${TOP}v${h}"/><text x="${px(v).toFixed(1)}" y="${TOP + h + 15}" text-anchor="middle">${tickText(v)}</text>`;
    s += `<text class="axis" x="${LEFT + w / 2}" y="${height - 6}" text-anchor="middle">${xLabel}</text>`;
    s += `<text class="axis" transform="translate(13 ${TOP + h / 2}) rotate(-90)" text-anchor="middle">${yLabel}</text>`;
    for (const line of lines) {
      let d = "", pen = "M";
      for (let i = 0; i < line.y.length; i++) {
        if (!known(line.y[i]) || !known(line.x[i])) { pen = "M"; continue; }
        d += pen + px(line.x[i]).toFixed(1) + " " + py(line.y[i]).toFixed(1);
        pen = "L";
      }
      s += `<path class="line ${line.name}" d="${d}"/>`;
    }
    const name = escaped(`${host.dataset.name}: ${jointBox.value}, ${recordingBox.selectedOptions[0].text}`);
    host.innerHTML = `<svg viewBox="0 0 ${width} ${height}" role="img" tabindex="0" aria-label="${name}">${s}<g class="mark"></g></svg>`;
    plots.push({ svg: host.firstChild, width, px, py, follow, time: follow.x === "t", top: TOP, height: h });
  }

  function draw() {
    const motion = data.motions[+recordingBox.value], joint = jointBox.value, m = motion.joints[joint];
    const unit = data.units[joint] || "N m", moves = unit === "N" ? "m" : "rad";
    const line = (x) => (name) => ({ name, x, y: m[name] });
    const missed = (name) => m[name].map((v, i) => (known(v) && known(m.measured[i]) ? m.measured[i] - v : null));
    const t = motion.t, wide = Math.max(300, byId("over-t").clientWidth || 640);
    LEFT = Math.max(62, margin([m.measured, ...MODELS.map((name) => m[name])], 204), margin(MODELS.map(missed), 124), margin(data.motions.map((o) => o.joints[joint].qd), 204));
    plots = [];
    const whole = [t[0], t[t.length - 1]];
    plot(byId("over-t"), wide, 210, ["measured", ...MODELS].map(line(t)), "", `torque [${unit}]`, { x: "t", y: m.measured }, whole);
    const rest = MODELS.map((name) => ({ name, x: t, y: missed(name) }));
    plot(byId("missed-t"), wide, 170, rest, "time [s]", `missed [${unit}]`, { x: "t", y: rest[2].y }, whole);
    const loop = ["measured", "nominal", "corrected"], width = (id) => Math.max(260, byId(id).clientWidth || 320);
    plot(byId("over-q"), width("over-q"), 250, loop.map(line(m.q)), `position [${moves}]`, `torque [${unit}]`, { x: m.q, y: m.measured });
    plot(byId("over-qd"), width("over-qd"), 250, loop.map(line(m.qd)), `speed [${moves}/s]`, `torque [${unit}]`, { x: m.qd, y: m.measured });
    const others = data.motions.filter((o) => o !== motion).map((o) => ({ name: "others", x: o.joints[joint].q, y: o.joints[joint].qd }));
    plot(byId("coverage"), width("coverage"), 250, [...others, { name: "corrected", x: m.q, y: m.qd }], `position [${moves}]`, `speed [${moves}/s]`, { x: m.q, y: m.qd });
    if (at !== null) mark(Math.min(at, t.length - 1));
  }

  function mark(i) {
    at = i;
    const motion = data.motions[+recordingBox.value], joint = jointBox.value, m = motion.joints[joint];
    const unit = data.units[joint] || "N m", moves = unit === "N" ? "m" : "rad";
    for (const p of plots) {
      const x = p.px(p.time ? motion.t[i] : p.follow.x[i]), y = known(p.follow.y[i]) ? p.py(p.follow.y[i]) : null;
      p.svg.querySelector(".mark").innerHTML =
        (p.time ? `<path class="cursor" d="M${x.toFixed(1)} ${p.top}v${p.height}"/>` : "") +
        (y === null ? "" : `<circle class="dot" cx="${x.toFixed(1)}" cy="${y.toFixed(1)}" r="4"/>`);
    }
    const say = [["t", motion.t[i], "s"], ["position", m.q[i], moves], ["speed", m.qd[i], moves + "/s"]];
    for (const name of ["measured", ...MODELS]) say.push([name, m[name][i], unit]);
    readout.innerHTML = say.map(([name, v, u]) => `${name} <b>${shown(v)}</b> ${u}`).join(" · ");
  }

  // The sample nearest to a place in a drawing: by time there, by distance on the page in the loops.
  function nearest(p, event) {
    const frame = p.svg.getBoundingClientRect(), scale = p.width / frame.width;
    const x = (event.clientX - frame.left) * scale, y = (event.clientY - frame.top) * scale;
    const t = data.motions[+recordingBox.value].t;
    let best = 0, least = Infinity;
    for (let i = 0; i < t.length; i++) {
      if (!p.time && !(known(p.follow.x[i]) && known(p.follow.y[i]))) continue;
      const away = p.time ? Math.abs(p.px(t[i]) - x) : Math.hypot(p.px(p.follow.x[i]) - x, p.py(p.follow.y[i]) - y);
      if (away < least) { least = away; best = i; }
    }
    return best;
  }
  const plotAt = (event) => plots.find((p) => p.svg.contains(event.target));
  for (const kind of ["pointermove", "pointerdown"])
    viewer.addEventListener(kind, (event) => { const p = plotAt(event); if (p) mark(nearest(p, event)); });
  viewer.addEventListener("keydown", (event) => {
    const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key], last = data.motions[+recordingBox.value].t.length - 1;
    if (!step || !plotAt(event)) return;
    event.preventDefault();
    mark(Math.min(last, Math.max(0, (at === null ? 0 : at) + step * (event.shiftKey ? 10 : 1))));
  });
  jointBox.addEventListener("change", draw);
  recordingBox.addEventListener("change", draw);
  let waiting = 0;
  addEventListener("resize", () => { clearTimeout(waiting); waiting = setTimeout(draw, 120); });
  document.documentElement.classList.add("with-script");
  viewer.hidden = false;
  draw();
})();

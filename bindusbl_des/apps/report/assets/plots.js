"use strict";
// Line plots by uPlot, in the colours of the theme; each is made anew when the theme changes.

const axis = (label, more = {}) => ({
  size: 34, stroke: colours.soft, font: "12px system-ui, sans-serif",
  ...(label ? { label, labelSize: 20, labelGap: 2, labelFont: "12px system-ui, sans-serif" } : {}),
  grid: { stroke: colours.grid, width: 1 }, ticks: { stroke: colours.grid, width: 1 }, ...more,
});

// Steps of an axis that counts.
const COUNTS = [1, 2, 5].flatMap((it) => [it, 10 * it, 100 * it, 1e3 * it, 1e4 * it, 1e5 * it]).sort((a, b) => a - b);

class Plot {
  // `options(width)` and `data` as for uPlot; `name` is how tests find it.
  constructor(name, host, options, data) {
    Object.assign(this, { name, host, options, data });
    this.host.setAttribute("role", "img");
    onTheme(() => this.make());
    new ResizeObserver(() => this.fit()).observe(host);
    this.make();
    this.host.after(saving(name, { ...pictures(() => this.plot.ctx.canvas, () => this.plot.batch(() => this.plot.redraw()), { key: () => this.key() }), CSV: () => this.csv() }));
  }
  // The lines that are shown, if there are several.
  key() {
    const lines = this.options().series.slice(1).filter((_, i) => this.plot.series[i + 1].show);
    return lines.length > 1 ? lines : [];
  }
  // What is drawn, a column for each line, in the units of the axes.
  csv() { return csvOf([this.options().series.map(({ label }) => label), ...Array.from(this.data[0], (_, i) => this.data.map((column) => column[i] ?? NaN))]); }
  make() {
    this.plot?.destroy();
    this.width = this.host.clientWidth;
    this.plot = new uPlot({ ...this.options(), width: Math.max(this.width, 100) }, this.data, this.host);
    const points = this.data.slice(1).flatMap((series) => Array.from(series).filter((value) => Number.isFinite(value)));
    bindusbl.plots[this.name] = points.length;
  }
  set(data) { this.data = data; this.make(); }
  fit() {
    const width = this.host.clientWidth;
    if (width && width !== this.width) {
      this.width = width;
      this.plot.setSize({ width, height: this.options().height });
    }
  }
}

const drawTicks = (times, colour) => (u) => {
  const { ctx } = u, { left, width, top, height } = u.bbox, ratio = uPlot.pxRatio;
  shape(ctx, { stroke: colour(), width: ratio }, () => {
    for (const time of times) {
      const x = u.valToPos(time, "x", true);
      if (x < left || x > left + width) continue;
      ctx.moveTo(x, top + height - 9 * ratio);
      ctx.lineTo(x, top + height);
    }
  });
};

const drawGaps = (gaps) => (u) => {
  const { ctx } = u, { left, width, top, height } = u.bbox;
  ctx.save();
  ctx.fillStyle = colours.shade;
  for (const [start, end] of gaps) {
    const x1 = Math.max(u.valToPos(start, "x", true), left), x2 = Math.min(u.valToPos(end, "x", true), left + width);
    if (x2 > x1) ctx.fillRect(x1, top, x2 - x1, height);
  }
  ctx.restore();
};

// Where the playback is, as a thin line over a plot of time.
function nowLine(u, now) {
  const line = u.over.querySelector(".now") ?? u.over.appendChild(make("div", { class: "now" }));
  const x = Math.round(2 * u.valToPos(now, "x")) / 2; // a finer step is not seen
  if (x === line.x) return;
  line.x = x;
  line.style.transform = `translateX(${x}px)`;
  line.style.display = x < 0 || x > u.bbox.width / uPlot.pxRatio ? "none" : "";
}

function clickToSeek(u, seek) {
  let from = 0;
  u.over.addEventListener("mousedown", (event) => { from = event.clientX; });
  u.over.addEventListener("click", (event) => {
    if (Math.abs(event.clientX - from) < 4) seek(u.posToVal(event.offsetX, "x"));
  });
}

// Dragging across a plot of time zooms all of them, and selects that interval everywhere.
const selects = (playback) => (u, scale) => { if (scale === "x" && u.status) requestAnimationFrame(() => playback.select(u.scales.x.min, u.scales.x.max)); }; // once all have zoomed

// A plot over the time that is played; `lines` are its series but for the time, `more` are options of uPlot.
function timePlot(playback, name, host, label, data, lines, more) {
  const options = () => {
    const { hooks, scales, ...others } = more();
    return {
      cursor: { y: false, sync: { key: "time" } }, scales: { x: { time: false }, ...scales }, series: [timeSeries(), ...lines()], ...others,
      hooks: { ready: [(u) => clickToSeek(u, (time) => playback.seek(time))], setScale: [selects(playback)], ...hooks },
    };
  };
  if (label) host.setAttribute("aria-label", label);
  const plot = new Plot(name, host, options, data);
  playback.onChange((now) => nowLine(plot.plot, now));
  return plot;
}
const metres = told((value) => `${value.toFixed(2)} m`);

function errorPlot(host, mission, number, playback, highest) {
  const auv = mission.auvs[number];
  const lines = () => {
    const colour = seriesColour(number);
    return [
      { label: `${auv.name} error`, stroke: colour, width: 1.5, value: metres },
      { label: "3σ envelope", stroke: colour, width: 0.8, dash: dashed(4, 3), fill: colour + "22", value: metres },
    ];
  };
  const label = `Position error of ${auv.name} over time, with its 3-sigma envelope and its fixes`;
  timePlot(playback, `error ${auv.name}`, host, label, [mission.time, auv.error, auv.envelope], lines, () => ({
    height: 140, scales: { x: { time: false, range: (u, low, high) => [low ?? 0, high ?? mission.duration] }, y: { range: () => [0, highest] } },
    axes: [axis("", { size: 26, ...timeAxis(), values: instants }), axis(`${auv.name} (m)`, { size: 44 })],
    hooks: { drawClear: [drawGaps(auv.gaps)], draw: [drawTicks(mission.landed[number], () => seriesColour(number))] },
  }));
}

// The AUVs that navigated worst first: they are what a reader looks for.
function errorPlots(mission, playback) {
  const host = byId("error-plots"), more = byId("more-errors"), first = 4, { order } = mission;
  const shown = order.length <= first + 1 ? order : order.slice(0, first);
  const largest = (column) => Math.max(...mission.auvs.map((auv) => auv[column].reduce((a, b) => Math.max(a, b), 0)), 0.1);
  const highest = Math.min(1.05 * largest("envelope"), 1.6 * largest("error"));
  const add = (number) => {
    const place = make("div", { class: "error-plot" });
    host.append(place);
    errorPlot(place, mission, number, playback, highest);
  };
  shown.forEach(add);
  if (shown.length < order.length) {
    more.hidden = false;
    more.textContent = `Show the other ${order.length - shown.length} AUVs (these navigated worst)`;
    more.addEventListener("click", () => { more.hidden = true; order.slice(shown.length).forEach(add); });
  }
}

function coveredPlot(mission, playback) {
  if (!mission.covered) return;
  byId("survey").hidden = false;
  const lines = () => [{ label: "covered", value: told((share) => `${share.toFixed(1)} %`), stroke: colours.accent, fill: colours.accent + "33", width: 2, points: { show: false } }];
  timePlot(playback, "covered", byId("covered-plot"), "Share of the survey that is covered over time", [mission.time, mission.covered.share], lines, () => ({
    height: 220, cursor: { sync: { key: "time" } }, scales: { y: { range: (u, low, high) => [0, clamp(1.08 * high, 1, 105)] } },
    axes: [axis(timeWords(), timeAxis()), axis("survey covered (%)", { size: 50 })], hooks: { setScale: [] },
  }));
}

function fixesPlot(mission, playback) {
  const data = uPlot.join(mission.landed.map((times) => [[0, ...times, mission.duration], [0, ...times.map((_, i) => i + 1), times.length]]));
  const lines = () => mission.auvs.map((auv, i) => ({
    label: auv.name, stroke: seriesColour(i), dash: seriesDash(i), width: 2, spanGaps: true, points: { show: false }, paths: uPlot.paths.stepped({ align: 1 }),
    value: (u, v, s, at) => { for (let k = at ?? -1; k >= 0; k--) if (Number.isFinite(u.data[s][k])) return u.data[s][k]; return "–"; },
  }));
  timePlot(playback, "fixes", byId("fixes-plot"), "Delivered fixes of each AUV over time", data, lines, () => ({
    height: 260, cursor: { sync: { key: "time" } }, legend: { show: mission.auvs.length <= 12 },
    axes: [axis(timeWords(), timeAxis()), axis("fixes", { size: 46, incrs: COUNTS })], hooks: { setScale: [] },
  }));
}

// Draws how often values (s) occur; what lies beyond `top` is counted in the last bar.
function histogram(name, host, values, unit, top) {
  const low = Math.min(top, ...values.slice(0, 1), values.length ? quantile(values, 0) : 0);
  const width = roundStep(Math.max((top - low) / 40, 0.005 * top, 1e-3)), start = Math.floor(low / width) * width;
  const count = Math.max(Math.floor((top - start) / width) + 1, 2), end = start + count * width;
  const bins = Array.from({ length: count }, (_, i) => start + (i + 0.5) * width), heights = new Array(count).fill(0);
  for (const value of values) heights[clamp(Math.floor((value - start) / width), 0, count - 1)]++;
  const options = () => ({
    height: 220, cursor: { y: false, drag: { x: false } }, scales: { x: { time: false, range: [start, end] }, y: { range: (u, low, high) => [0, 1.08 * high || 1] } },
    axes: [axis(`time (s), in steps of ${significant(width, 1)} s`), axis(unit, { size: 50, incrs: COUNTS })],
    series: [{ label: "from–to", value: told((v) => `${(v - width / 2).toFixed(3)}–${(v + width / 2).toFixed(3)} s`) },
      { label: unit, value: told((v) => `${v}`), stroke: colours.accent, fill: colours.accent + "99", paths: uPlot.paths.bars({ size: [0.9, 100] }), points: { show: false } }],
  });
  host.setAttribute("aria-label", `Histogram: ${name}`);
  new Plot(name, host, options, [bins, heights]);
}

function histograms(mission) {
  const latency = Array.from(mission.deliveredOrder, (row) => mission.fixes.latency[row]);
  const waits = mission.landed.flatMap((times) => Array.from(times.slice(1), (time, i) => time - times[i]));
  histogram("latency", byId("latency-plot"), latency, "fixes", mission.shownUntil.latency);
  histogram("interval", byId("interval-plot"), waits, "intervals", mission.shownUntil.interval);
}

// What became of the pings, a bar for each AUV: words, and how the part of the bar is drawn.
const FATE_LOOKS = {
  delivered: ["fix delivered", "var(--accent)"],
  out_of_mf: ["fix beyond MF range", "repeating-linear-gradient(90deg, var(--mf) 0 4px, var(--sheet) 4px 6px)"],
  lost: ["lost", "radial-gradient(circle, var(--accent) 28%, var(--sheet) 32%) 0 0 / 7px 7px"],
  collided: ["collided", "var(--collided)"],
  out_of_hf: ["out of HF range", "repeating-linear-gradient(45deg, var(--hf) 0 2px, var(--sheet) 2px 6px)"],
  in_flight: ["in flight at the end", "var(--line)"],
};
// Beyond a channel that is no disc there is no range that one could name.
function fateLooks({ discs }) {
  const looks = { ...FATE_LOOKS };
  if (!discs.hf) looks.out_of_hf = ["beyond what the HF channel lets through", looks.out_of_hf[1]];
  if (!discs.mf) looks.out_of_mf = ["fix not decoded on MF", looks.out_of_mf[1]];
  return looks;
}
function fateBars(mission) {
  const looks = fateLooks(mission);
  const bars = make("div", { class: "bars" }), key = make("div", { class: "key" }), told = [], used = new Set();
  const totals = mission.auvs.map(() => ({}));
  mission.pings.auv.forEach((auv, i) => {
    const fate = mission.fates[mission.pings.fate[i]];
    totals[auv][fate] = (totals[auv][fate] || 0) + 1;
  });
  const full = []; // a bar of one part says what a sentence says shorter
  const alike = new Map(); // AUVs whose pings became the same share a bar
  for (const i of mission.order) {
    const fates = JSON.stringify(Object.entries(totals[i]).sort());
    alike.set(fates, [...(alike.get(fates) ?? []), i]);
  }
  for (const [i, ...others] of alike.values()) {
    const name = others.length > 2 ? `${mission.auvs[i].name} and ${others.length} others, each` : [i, ...others].map((it) => mission.auvs[it].name).join(", "), total = totals[i], all = Object.values(total).reduce((a, b) => a + b, 0), bar = make("div", { class: "bar" });
    told.push(`${name}: ${Object.entries(total).map(([fate, n]) => `${n} ${looks[fate][0]}`).join(", ")}`);
    if (Object.keys(total).length < 2) { full.push(all ? `All ${all} pings of ${name}: ${looks[Object.keys(total)[0]][0]}.` : `${name} sent no ping.`); continue; }
    for (const [fate, [words, look]] of Object.entries(looks)) {
      if (!total[fate]) continue;
      used.add(fate);
      const share = 100 * total[fate] / all;
      bar.append(make("span", { title: `${name}: ${total[fate]} of ${all} pings (${share.toFixed(1)} %) ${words}`, style: `width:${share}%;background:${look}` }));
    }
    bars.append(make("span", {}, name), bar);
  }
  for (const [fate, [words, look]] of Object.entries(looks)) {
    if (used.has(fate)) key.append(make("span", {}, make("span", { class: "swatch", style: `background:${look}` }), words));
  }
  byId("fates-plot").replaceChildren(bars, key, ...(full.length ? [make("p", {}, full.join(" "))] : []), make("p", { class: "hidden" }, told.join("; ")),
    saving("fates", { CSV: () => csvOf([["AUV", ...Object.values(looks).map(([words]) => words)], ...mission.order.map((i) => [mission.auvs[i].name, ...Object.keys(looks).map((fate) => totals[i][fate] ?? 0)])]) }));
  bindusbl.plots.fates = mission.pings.at.length;
}

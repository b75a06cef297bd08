"use strict";
// The page of a campaign: curves and maps along any varied key, the lookup table, all points.

const MOST_POINTS = 500;
// A key with more different values was sampled: its points are drawn as dots, the others not held.
const MOST_STEPS = 40;
// What the table of points shows.
const TABLED = ["worst_position_error_m", "worst_position_error_p95_m", "worst_fix_age_p95_s", "worst_fix_benefit_m", "position_error_m"];

class Sweep {
  constructor(data) {
    Object.assign(this, data);
    this.size = this.count.length;
    this.keys.forEach((key) => { key.short = this.shortName(key.key); });
  }
  // As many last words of a key as tell it from the others.
  shortName(key) {
    const words = key.split(".");
    for (let n = 1; n < words.length; n++) {
      const tail = words.slice(-n).join(".");
      if (this.keys.filter((other) => other.key === tail || other.key.endsWith(`.${tail}`)).length === 1) return n === 1 && tail === "count" ? words.slice(-2).join(".") : tail;
    }
    return key;
  }
  at(metric, point) {
    if (point === undefined) return null;
    const { mean, half, whole } = this.statistics[metric], count = this.count[point];
    return { mean: mean[point], half: half[point], count, whole: whole ? whole[point] : count, failed: this.failed[point] };
  }
  // The worst AUV at a point, and in how many of its missions it is, where the page knows it.
  whose(metric, point) {
    const known = this.worst[metric];
    if (!known || !Number.isFinite(known.auv[point])) return "";
    const [times, count] = [known.times[point], this.count[point]];
    return `AUV${known.auv[point]}${times < count ? ` ${times}/${count}` : ""}`;
  }
  words(metric) { return this.metrics.find(({ name }) => name === metric).words; }
  title(metric) { return this.metrics.find(({ name }) => name === metric).title; }
  // Options of metrics by whose they are; the worst AUV's come first.
  offer(select, metrics) {
    for (const [of, label] of [["worst", "the worst AUV of each mission"], ["fleet", "mean of the fleet"], ["mission", "the mission as a whole"]]) {
      const options = metrics.filter((it) => it.of === of).map(({ name }) => make("option", { value: name }, this.title(name)));
      if (options.length) select.append(make("optgroup", { label }, ...options));
    }
  }
  unit(metric) {
    const { unit } = this.metrics.find(({ name }) => name === metric);
    return unit === "1" ? "" : unit;
  }
}

class View {
  constructor(sweep) {
    this.sweep = sweep;
    sweep.offer(byId("metric"), sweep.metrics);
    sweep.keys.forEach(({ key }, k) => {
      byId("along").append(make("option", { value: k }, key));
      byId("by").append(make("option", { value: k }, key));
    });
    byId("by").append(make("option", { value: -1 }, "no other key"));
    const longest = sweep.keys.map((key, k) => k).filter((k) => sweep.keys[k].values !== null).sort((a, b) => sweep.keys[b].labels.length - sweep.keys[a].labels.length);
    const count = sweep.keys.findIndex(({ key }) => key === "asvs.count");
    this.along = count >= 0 ? count : longest[0] ?? 0;
    this.by = sweep.keys.findIndex((key, k) => k !== this.along && key.labels.length <= MOST_STEPS);
    byId("along").value = this.along;
    byId("by").value = this.by;
    this.fixed = sweep.keys.map(() => 0);
    byId("metric").addEventListener("change", () => this.show());
    byId("along").addEventListener("change", () => this.choose("along"));
    byId("by").addEventListener("change", () => this.choose("by"));
    this.choose("along");
  }
  choose(which) {
    const before = [this.along, this.by];
    this[which] = +byId(which).value;
    if (this.along === this.by) { // the other takes what was left
      const other = which === "along" ? "by" : "along";
      this[other] = which === "along" ? before[0] : before[1];
      if (this[other] === this[which] || (other === "along" && this[other] < 0)) this[other] = other === "by" ? -1 : (this[which] + 1) % this.sweep.keys.length;
      byId(other).value = this[other];
    }
    this.holders();
    this.show();
  }
  sampled(k) { return this.sweep.keys[k].labels.length > MOST_STEPS; }
  // Keys that are neither along nor by are held at one value each.
  holders() {
    const host = byId("fixed");
    host.replaceChildren();
    this.sweep.keys.forEach(({ key, labels }, k) => {
      if (k === this.along || k === this.by || this.sampled(k)) return;
      const select = make("select", { "aria-label": key }, ...labels.map((label, n) => make("option", { value: n }, label)));
      select.value = this.fixed[k];
      select.addEventListener("change", () => { this.fixed[k] = +select.value; this.show(); });
      host.append(make("label", {}, `${this.sweep.shortName(key)} `, select), " ");
    });
  }
  shownPoints() {
    const held = this.sweep.keys.map((_, k) => k).filter((k) => k !== this.along && k !== this.by && !this.sampled(k));
    return Array.from({ length: this.sweep.size }, (_, point) => point).filter((point) => held.every((k) => this.sweep.points[k][point] === this.fixed[k]));
  }
  show() {
    const { sweep } = this, metric = byId("metric").value, points = this.shownPoints();
    const gaps = points.some((point) => gapText(sweep.at(metric, point)));
    byId("meaning").textContent = `${metric}: ${sweep.metrics.find(({ name }) => name === metric).meaning}.${gaps ? " n/m beside a mean: n of m missions have a value for every AUV; the others leave one out." : ""}`;
    const columns = sweep.keys[this.along]?.labels ?? [""], rows = this.by >= 0 ? sweep.keys[this.by].labels : ["all"];
    const place = (k, point) => (k >= 0 && sweep.keys.length ? sweep.points[k][point] : 0);
    const cells = rows.map(() => columns.map(() => null));
    const dots = rows.map(() => []);
    for (const point of points) {
      const cell = sweep.at(metric, point), row = Math.round(place(this.by, point)), column = Math.round(place(this.along, point));
      cells[row][column] = cell;
      dots[row].push([column, cell]);
    }
    this.curves(metric, dots, rows, columns);
    const mapped = columns.length <= MOST_STEPS && rows.length <= MOST_STEPS;
    byId("heat-figure").hidden = !mapped;
    if (mapped) heatmap(byId("heat"), byId("scale"), { rows, columns, cells, unit: sweep.unit(metric), rowName: this.by >= 0 ? sweep.keys[this.by].short : "", columnName: sweep.keys[this.along]?.short ?? "" });
  }
  curves(metric, dots, rows, columns) {
    const key = this.sweep.keys[this.along], xs = key?.values ?? columns.map((_, i) => i), sampled = columns.length > MOST_STEPS;
    const data = [xs, ...dots.map((line) => {
      const means = xs.map(() => null);
      for (const [column, { mean }] of line) if (Number.isFinite(mean)) means[column] = mean;
      return means;
    })];
    const halves = dots.map((line) => new Map(line.map(([column, { half }]) => [column, half])));
    const gaps = dots.map((line) => line.map(([column, cell]) => [column, gapText(cell)]).filter(([, text]) => text));
    const unit = this.sweep.unit(metric);
    const ends = dots.flat().flatMap(([, { mean, half }]) => (Number.isFinite(half) ? [mean - half, mean + half] : [mean])).filter(Number.isFinite);
    const lowest = Math.min(0, ...ends), highest = Math.max(...ends, 0);
    const spread = (xs[xs.length - 1] - xs[0]) || 1;
    const options = () => ({
      height: 340, cursor: { drag: { x: false } }, legend: { show: rows.length <= 12, live: true },
      scales: { x: { time: false, range: [xs[0] - 0.05 * spread, xs[xs.length - 1] + 0.05 * spread] }, y: { range: () => [lowest * 1.05, highest > lowest ? highest * 1.05 : 1] } },
      axes: [axis(key?.key ?? "", key && key.values === null ? { splits: () => xs, values: () => columns } : { splits: sampled ? undefined : () => xs }), axis(this.sweep.title(metric), { size: 56 })],
      series: [{ label: key?.short ?? "", value: (u, v) => (v === null ? "–" : key?.values ? `${v}` : columns[v]) }, ...rows.map((label, i) => ({
        label: this.by >= 0 ? `${this.sweep.keys[this.by].short} ${label}` : metric, stroke: seriesColour(i), dash: seriesDash(i), width: 2, spanGaps: !gaps[i].length,
        paths: sampled || key?.values === null ? () => null : undefined, points: { show: true, size: 7, fill: seriesColour(i) }, value: (u, v) => (v === null || v === undefined ? "–" : `${significant(v)} ${unit}`),
      }))],
      hooks: { draw: [(u) => errorBars(u, halves), (u) => gapMarks(u, gaps)] },
    });
    byId("curves").setAttribute("aria-label", `${this.sweep.title(metric)} along ${key?.key ?? "nothing"}`);
    if (this.plot) Object.assign(this.plot, { options, data }).make();
    else this.plot = new Plot("curves", byId("curves"), options, data);
  }
}

function errorBars(u, halves) {
  const { ctx } = u, ratio = uPlot.pxRatio;
  ctx.save();
  ctx.lineWidth = 1.4 * ratio;
  halves.forEach((line, i) => {
    ctx.strokeStyle = seriesColour(i);
    ctx.beginPath();
    for (const [column, half] of line) {
      const mean = u.data[i + 1][column];
      if (mean === null || !Number.isFinite(half)) continue;
      const x = u.valToPos(u.data[0][column], "x", true), low = u.valToPos(mean - half, "y", true), high = u.valToPos(mean + half, "y", true);
      ctx.moveTo(x, low);
      ctx.lineTo(x, high);
      for (const y of [low, high]) { ctx.moveTo(x - 4 * ratio, y); ctx.lineTo(x + 4 * ratio, y); }
    }
    ctx.stroke();
  });
  ctx.restore();
}

// Beside a point, or on the axis where there is none: in how many missions every AUV has a value.
function gapMarks(u, gaps) {
  const { ctx } = u, ratio = uPlot.pxRatio;
  ctx.save();
  ctx.font = `${11 * ratio}px system-ui, sans-serif`;
  ctx.textAlign = "center";
  gaps.forEach((line, i) => {
    for (const [column, text] of line) {
      const mean = u.data[i + 1][column], x = u.valToPos(u.data[0][column], "x", true);
      const y = mean === null ? u.bbox.top + u.bbox.height - (4 + 13 * i) * ratio : u.valToPos(mean, "y", true);
      if (mean !== null) {
        ctx.fillStyle = colours.paper;
        ctx.beginPath();
        ctx.arc(x, y, 2.4 * ratio, 0, 2 * Math.PI);
        ctx.fill();
      }
      ctx.fillStyle = seriesColour(i);
      ctx.fillText(text, x, mean === null ? y : y - 8 * ratio);
    }
  });
  ctx.restore();
}

function pointsTable(sweep) {
  const metrics = sweep.metrics.filter(({ name }) => TABLED.includes(name));
  const head = make("tr", {}, make("th", {}, "point"), ...sweep.keys.map(({ key }) => make("th", { scope: "col" }, key)), make("th", { scope: "col" }, "missions"),
    make("th", { scope: "col" }, "worst AUV"), ...metrics.map(({ name, of }) => make("th", { scope: "col" }, sweep.words(name), make("span", { class: "unit" }, of === "worst" ? "worst AUV" : "fleet mean"))));
  const rows = Array.from({ length: Math.min(sweep.size, MOST_POINTS) }, (_, point) => make("tr", {}, make("th", { scope: "row" }, `${point}`),
    ...sweep.keys.map(({ labels }, k) => make("td", {}, labels[sweep.points[k][point]])), make("td", {}, sweep.failed[point] ? `${sweep.count[point]} of ${sweep.count[point] + sweep.failed[point]}` : `${sweep.count[point]}`),
    make("td", {}, sweep.whose(TABLED[0], point)), ...metrics.map(({ name }) => { const cell = sweep.at(name, point); return make("td", {}, `${plusMinus(cell.mean, cell.half)} ${gapText(cell)}`.trim()); })));
  byId("points").append(make("table", {}, make("thead", {}, head), make("tbody", {}, ...rows)));
  byId("points-note").textContent = `Means over the missions that went well ± half of the 95 % confidence interval; the worst AUV is that of most missions by its mean error.${sweep.size > MOST_POINTS ? ` The first ${MOST_POINTS} of ${sweep.size} points.` : ""}`;
}

async function start() {
  startTheme();
  const sweep = new Sweep(unpackAll(readData(), await unpacker()));
  const view = new View(sweep), lookup = new Lookup(sweep);
  pointsTable(sweep);
  Object.assign(bindusbl, { ready: true, sweep, view, lookup });
}
bindusbl.opened = start();

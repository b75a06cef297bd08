"use strict";
// The page of a campaign: curves and maps along any varied key, the lookup table.

// A key with more different values was sampled: its points are drawn as dots, the others not held.
const MOST_STEPS = 40;
// A reader tells so many lines apart.
const MOST_LINES = 6;

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
  // A point by its number and what is varied at it.
  named(point) { return `point ${point}: ${this.keys.map((key, k) => `${key.short} ${key.labels[this.points[k][point]]}`).join(", ")}`; }
  metric(wanted) { return this.metrics.find(({ name }) => name === wanted); }
  title(metric) { return this.metric(metric).title; }
  // Options of metrics by whose they are; the worst AUV's come first.
  offer(select, metrics) {
    for (const [of, label] of [["worst", "the worst AUV of each mission"], ["fleet", "mean of the fleet"], ["mission", "the mission as a whole"]]) {
      const options = metrics.filter((it) => it.of === of).map(({ name }) => make("option", { value: name }, this.title(name)));
      if (options.length) select.append(make("optgroup", { label }, ...options));
    }
  }
  unit(metric) { return this.metric(metric).unit.replace(/^1$/, ""); }
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
    const numbers = sweep.keys.findIndex(({ values, labels }) => values !== null && labels.length > 1);
    this.along = Math.max(numbers, 0); // as `plot curves` chooses
    this.by = sweep.keys.findIndex((key, k) => k !== this.along && key.labels.length <= MOST_STEPS);
    byId("along").value = this.along;
    byId("by").value = this.by;
    this.fixed = sweep.keys.map(() => 0);
    byId("scale").after(saving("heatmap", { CSV: () => csvOf(this.map) }));
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
    byId("meaning").textContent = `${metric}: ${sweep.metric(metric).meaning}.${gaps ? " n/m beside a mean: n of m missions have a value for every AUV; the others leave one out." : ""}`;
    const columns = sweep.keys[this.along]?.labels ?? [""], rows = this.by >= 0 ? sweep.keys[this.by].labels : ["all"];
    const place = (k, point) => (k >= 0 && sweep.keys.length ? sweep.points[k][point] : 0);
    const cells = rows.map(() => columns.map(() => null));
    const dots = rows.map(() => []);
    for (const point of points) {
      const cell = { ...sweep.at(metric, point), point: sweep.named(point) }, row = Math.round(place(this.by, point)), column = Math.round(place(this.along, point));
      cells[row][column] = cell;
      dots[row].push([column, cell]);
    }
    if (sweep.size === 1) { this.missions(metric); return; }
    this.curves(metric, dots, rows, columns);
    const mapped = columns.length <= MOST_STEPS && rows.length <= MOST_STEPS;
    byId("heat-figure").hidden = !mapped;
    const names = [this.by >= 0 ? sweep.keys[this.by].short : "", sweep.keys[this.along]?.short ?? ""];
    if (!mapped) return;
    const turned = innerWidth < 600 && columns.length > 4 && columns.length > rows.length; // a phone is higher than wide
    const laid = turned ? { rows: columns, columns: rows, cells: columns.map((_, c) => rows.map((_, r) => cells[r][c])), rowName: names[1], columnName: names[0] }
      : { rows, columns, cells, rowName: names[0], columnName: names[1] };
    this.map = heatmap(byId("heat"), byId("scale"), { ...laid, unit: sweep.unit(metric), more: sweep.metric(metric).less !== false });
  }
  // Draws the curves anew, as uPlot is told by `options`, over those of before.
  draw(label, options, data) {
    const height = () => (onPaper() ? 260 : 340), whole = () => ({ height: height(), cursor: { drag: { x: false } }, ...options() });
    byId("curves").setAttribute("aria-label", label);
    if (this.plot) Object.assign(this.plot, { options: whole, data }).make();
    else this.plot = new Plot("curves", byId("curves"), whole, data);
  }
  // Of a single point: each mission, and between which values their mean lies.
  missions(metric) {
    const { mean: [mean], half: [half], each } = this.sweep.statistics[metric], { seeds } = this.sweep, unit = this.sweep.unit(metric);
    byId("curves-figure").hidden = !each;
    if (!each) return;
    const xs = seeds.map((_, i) => i), steady = (value) => xs.map(() => (Number.isFinite(value) ? value : null));
    const data = [xs, Array.from(each, (value) => (Number.isFinite(value) ? value : null)), steady(mean), steady(mean - half), steady(mean + half)];
    byId("curves-caption").textContent = "Each mission, by its seed; the line is their mean, the dashes its 95 % confidence interval (Student's t)";
    const value = told((v) => `${significant(v)} ${unit}`), colour = seriesColour(0);
    const line = (label, dash) => ({ label, stroke: colours.ink, width: 1.5, dash, points: { show: false }, value });
    this.draw(`${this.sweep.title(metric)} of each mission`, () => ({
      scales: { x: { time: false, range: [-0.5, xs.length - 0.5] }, y: { range: (u, low, high) => [Math.min(1.05 * low, 0), 1.05 * high > low ? 1.05 * Math.max(high, 0) : 1] } },
      axes: [axis("seed", { incrs: COUNTS, values: (u, ticks) => ticks.map((i) => seeds[i] ?? "") }), axis(this.sweep.title(metric), { size: 56 })],
      series: [{ label: "seed", value: told((v) => seeds[v]) }, { label: "mission", stroke: colour, paths: () => null, points: { show: true, size: 7, fill: colour }, value }, line("mean"), line("from", dashed(6, 4)), line("to", dashed(6, 4))],
    }), data);
  }
  // No more lines than can be told apart, evenly chosen; the map has all.
  curves(metric, all, names, columns) {
    const few = Math.min(names.length, MOST_LINES), chosen = Array.from({ length: few }, (_, i) => Math.round(i * (names.length - 1) / Math.max(few - 1, 1)));
    const dots = chosen.map((row) => all[row]), rows = chosen.map((row) => names[row]);
    const key = this.sweep.keys[this.along], letters = key && key.values === null ? lettersFor(columns, byId("curves").clientWidth) : null;
    const named = letters ? `; ${columns.map((name, i) => `${letters[i]}: ${name}`).join(", ")}` : "";
    byId("curves-caption").textContent = `${few < names.length ? `${few} of ${names.length} rows as curves, the map has all` : "The same as curves"}; bars are 95 % confidence intervals (Student's t)${named}`;
    const xs = key?.values ?? columns.map((_, i) => i), sampled = columns.length > MOST_STEPS;
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
    this.draw(`${this.sweep.title(metric)} along ${key?.key ?? "nothing"}`, () => ({
      legend: { show: true, live: true, markers: { width: 2, stroke: (u, i) => seriesColour(i - 1), dash: (u, i) => ["solid", "dashed", "dotted", "double"][(i - 1 + Math.floor((i - 1) / 8)) % 4] } },
      scales: { x: { time: false, range: [xs[0] - 0.05 * spread, xs[xs.length - 1] + 0.05 * spread] }, y: { range: () => [lowest * 1.05, highest > lowest ? highest * 1.05 : 1] } },
      axes: [axis(key?.key ?? "", key && key.values === null ? { splits: () => xs, values: () => letters ?? columns } : { splits: sampled ? undefined : () => xs }), axis(this.sweep.title(metric), { size: 56 })],
      series: [{ label: key?.short ?? "", value: told((v) => (key?.values ? `${v}` : columns[v])) }, ...rows.map((label, i) => ({
        label: this.by >= 0 ? `${this.sweep.keys[this.by].short} ${label}` : metric, stroke: seriesColour(i), dash: seriesDash(i), width: 2, spanGaps: !gaps[i].length,
        paths: sampled || key?.values === null ? () => null : undefined, points: { show: true, size: 7, fill: seriesColour(i) }, value: told((v) => `${significant(v)} ${unit}`),
      }))],
      padding: [null, rows.length > 1 ? labelRoom(rows, byId("curves").clientWidth) : null, null, null],
      hooks: { draw: [(u) => errorBars(u, halves), (u) => gapMarks(u, gaps), (u) => endLabels(u, rows.length > 1 ? rows : [])] },
    }), data);
  }
}

function errorBars(u, halves) {
  const { ctx } = u, ratio = uPlot.pxRatio;
  halves.forEach((line, i) => shape(ctx, { stroke: seriesColour(i), width: 1.4 * ratio }, () => {
    for (const [column, half] of line) {
      const mean = u.data[i + 1][column];
      if (mean === null || !Number.isFinite(half)) continue;
      const x = u.valToPos(u.data[0][column], "x", true), low = u.valToPos(mean - half, "y", true), high = u.valToPos(mean + half, "y", true);
      ctx.moveTo(x, low);
      ctx.lineTo(x, high);
      for (const y of [low, high]) { ctx.moveTo(x - 4 * ratio, y); ctx.lineTo(x + 4 * ratio, y); }
    }
  }));
}

// Letters in the place of names that have no room along an axis of a plot so wide (px); nothing where they have.
function lettersFor(names, width) {
  const longest = Math.max(...names.map(({ length }) => length));
  return 7 * longest < 0.8 * width / names.length ? null : names.map((_, i) => `${String.fromCharCode(65 + i % 26)}${i < 26 ? "" : Math.floor(i / 26)}`);
}

// Room (px) beside a plot so wide for what its lines are: a quarter of it at most.
function labelRoom(rows, width) { return Math.min(24 + 7 * Math.max(...rows.map(({ length }) => length)), Math.max(width / 4, 64)); }

// A label, or both ends of it where it has less room (of the canvas).
function fitting(ctx, label, room) {
  let text = label;
  for (let left = label.length - 1; left > 2 && ctx.measureText(text).width > room; left--) text = `${label.slice(0, Math.ceil(left / 2))}…${label.slice(-Math.floor(left / 2))}`;
  return text;
}

// Beside the end of each line what it is, apart from each other.
function endLabels(u, rows) {
  const { ctx } = u, ratio = uPlot.pxRatio, high = 13 * ratio;
  const ends = rows.map((label, i) => {
    const line = u.data[i + 1], last = line.findLastIndex((value) => value !== null);
    return { label, i, x: last < 0 ? 0 : u.valToPos(u.data[0][last], "x", true), y: last < 0 ? NaN : u.valToPos(line[last], "y", true) };
  }).filter(({ y }) => Number.isFinite(y)).sort((a, b) => a.y - b.y);
  ends.forEach((end, k) => { end.at = k ? Math.max(end.y, ends[k - 1].at + high) : end.y; });
  const over = ends.length ? ends[ends.length - 1].at - (u.bbox.top + u.bbox.height) : 0;
  if (over > 0) for (let k = ends.length - 1, most = u.bbox.top + u.bbox.height; k >= 0; k--) { ends[k].at = Math.min(ends[k].at, most); most = ends[k].at - high; }
  ctx.save();
  ctx.font = `600 ${11 * ratio}px system-ui, sans-serif`;
  ctx.textBaseline = "middle";
  ctx.textAlign = "left"; // axes leave theirs behind
  const right = u.bbox.left + u.bbox.width + 8 * ratio;
  for (const { label, i, x, y, at } of ends) {
    shape(ctx, { stroke: seriesColour(i), width: ratio }, () => { ctx.moveTo(x + 5 * ratio, y); ctx.lineTo(right - 2 * ratio, at); });
    ctx.fillStyle = seriesColour(i);
    ctx.fillText(fitting(ctx, label, ctx.canvas.width - right), right, at);
  }
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
      if (mean !== null) shape(ctx, { fill: colours.paper }, () => disc(ctx, x, y, 2.4 * ratio));
      ctx.fillStyle = seriesColour(i);
      ctx.fillText(text, x, mean === null ? y : y - 8 * ratio);
    }
  });
  ctx.restore();
}

async function start() {
  startTheme();
  const sweep = new Sweep(unpackAll(readData(), await unpacker()));
  const view = new View(sweep), lookup = new Lookup(sweep);
  Object.assign(bindusbl, { ready: true, sweep, view, lookup });
}
bindusbl.opened = start();

"use strict";
// The page of a plan: the chart with its sliders and numbers, the candidates, and how they go together.

// How long (ms) nothing must have been moved until the shades are made fine again.
const REST = 140;
// Where predicting takes longer than this (ms), numbers follow now and then while one moves a vessel,
// which itself moves with each frame: of the time a share of one in PAUSES is spent on predicting.
const SLOW = 25, PAUSES = 3;

// What a planner may read of each AUV: a column of the prediction, its words, unit, factor.
const COLUMNS = [
  ["hf_coverage", "in HF range", "%", 100], ["fix_rate_hz", "fixes", "/min", 60], ["fix_age_max_s", "oldest fix", "s", 1],
  ["fix_age_mean_s", "mean age", "s", 1], ["fix_age_p95_s", "95 % age", "s", 1],
  ["position_error_m", "mean error", "m", 1], ["position_error_rms_m", "RMS error", "m", 1], ["position_error_p95_m", "95 % error", "m", 1],
];
// Those that the table shows, whatever is asked for; and one error, that of the goal or else this.
const ALWAYS = ["hf_coverage", "fix_rate_hz", "fix_age_max_s"], ERROR = "position_error_p95_m";

class Chart {
  // `data` is all that the page holds; `data.chart` is where vessels can be moved.
  constructor(data, pareto) {
    Object.assign(this, { scenario: data.scenario, candidates: data.candidates, chosen: data.chosen, pareto, last: 0, frames: [], waiting: null, resting: null });
    const { outline, centre } = data.chart;
    this.centre = centre;
    this.team = new Team(data.chart);
    this.grids = { fine: PlanMap.grid(outline, FINE), coarse: PlanMap.grid(outline, COARSE) };
    this.goals = data.goal;
    this.goal = data.goal.find(({ metric }) => COLUMNS.some(([name]) => name === metric)) ?? null;
    const error = this.goal?.metric.startsWith("position_error") ? this.goal.metric : ERROR;
    this.columns = COLUMNS.filter(([name]) => [...ALWAYS, this.goal?.metric, error].includes(name));
    this.rows = this.layTable(data.chart.inputs.ways.places_m.length);
    this.offerTeams();
    this.sliders = new Sliders(byId("sliders"), this.team, data, (act) => this.change(act));
    this.map = new PlanMap(byId("map"), this.team, data.chart, {
      moved: (number, place) => this.change(() => this.team.move(number, place)),
      removed: (number) => this.drop(number),
      chosen: (number) => { this.last = number; this.nameLast(); },
    });
    byId("vessels").nextElementSibling.append(saving("chart", this.map.pictures()));
    this.listen();
    this.show(data.first);
  }
  listen() {
    byId("add").addEventListener("click", () => this.change(() => this.team.add(this.neediest())));
    byId("remove").addEventListener("click", () => this.drop(Math.min(this.last, this.team.stations.length - 1)));
    byId("all").addEventListener("click", () => this.map.seeAll());
    byId("team").addEventListener("change", () => this.show(byId("team").value === "" ? null : +byId("team").value));
    byId("shade").addEventListener("change", () => this.refine());
    for (const button of document.querySelectorAll(".copy")) button.addEventListener("click", () => copy(byId(button.dataset.copies), button));
  }
  offerTeams() {
    const { moving, stations } = this.team.chart, own = stations.length ? [make("option", { value: "" }, "as in the scenario")] : [];
    const offered = this.candidates.map((it, i) => [it, i]).filter(([it, i]) => it.simulated && (it.stations.length || moving[i]));
    byId("team").append(make("option", { value: "own", disabled: "" }, "moved by hand"), ...own, ...offered.map(([{ asvs }, i]) => make("option", { value: i }, this.named(i, asvs))));
  }
  named(number, asvs) { return `${number === this.chosen ? "the answer, " : ""}candidate ${number + 1}: ${asvs} vessel${asvs === 1 ? "" : "s"}`; }
  // Puts a candidate on the chart, or the scenario's own team.
  show(number) {
    const known = Number.isInteger(number) && this.candidates[number];
    this.team.take(known ? number : null, known || null);
    if (known && !this.candidates[number].simulated && !byId("team").querySelector(`[value="${number}"]`)) {
      byId("team").append(make("option", { value: number }, this.named(number, known.asvs)));
    }
    byId("team").value = known ? number : "";
    this.shown = known ? number : null;
    this.map.view = null;
    this.update();
    this.refine();
  }
  // Something was moved: all is predicted anew in the next frame, and only once in it.
  change(act) {
    act();
    this.shown = null;
    byId("team").value = "own";
    clearTimeout(this.resting);
    this.resting = setTimeout(() => { this.resting = null; this.refine(); }, REST);
    this.waiting ??= requestAnimationFrame(() => { this.waiting = null; this.frame(); });
  }
  drop(number) {
    this.change(() => this.team.remove(number));
    this.map.buttons[Math.min(number, this.team.stations.length - 1)]?.focus();
  }
  frame() {
    const began = performance.now();
    if (this.cost < SLOW || began - this.updated > PAUSES * this.cost) this.update();
    else {
      this.stale = true;
      this.map.sheet.paint();
    }
    this.frames.push(performance.now() - began);
  }
  update() {
    const began = performance.now();
    this.inputs = this.team.inputs;
    this.predicted = this.team.moving ? null : predict(this.inputs, this.team.stations);
    for (const id of ["add", "shade"]) byId(id).disabled = Boolean(this.team.moving);
    for (const id of ["auvs", "sliders", "emitted"]) byId(id).hidden = Boolean(this.team.moving);
    this.shade("coarse");
    this.tell();
    this.sliders.tell();
    this.stale = false;
    this.updated = performance.now();
    this.cost = this.updated - began;
  }
  refine() {
    if (this.stale) this.update();
    this.shade("fine");
    announce(this.worstTold());
    this.pareto?.show(this.shown);
  }
  shade(kind) {
    const grid = this.grids[kind], dwells = byId("shade").value === "dwells", { ways } = this.inputs;
    if (!this.predicted) {
      this.map.shade(grid, [], 1);
      byId("field-scale").replaceChildren();
      return;
    }
    if (grid.ways !== ways) Object.assign(grid, { ways, nearest: nearestOnWays(ways, grid.places) });
    const values = dwells ? errorMap(this.inputs, this.team.stations, grid.places) : laneMap(grid.nearest, this.predicted);
    this.top ??= this.goalOfErrors() ?? roundStep(quantile(values.filter((it, i) => grid.inside[i]), 0.9) || 1);
    const lost = dwells ? drifted(this.inputs) : Infinity; // as far as an AUV drifts without any fix
    this.map.shade(grid, values.map((value) => (value < lost ? value : NaN)), this.top);
    if (kind === "fine") { this.field = values; this.tellShades(dwells); }
  }
  goalOfErrors() { return this.goal?.metric.startsWith("position_error") ? this.goal.below : null; }
  tellShades(dwells) {
    const words = dwells ? "mean error of an AUV that dwells at a place, predicted; dark is bad, hatched where no fix is to be expected" : "mean error of the AUV that passes nearest on its lanes, as it passes, predicted; dark is bad";
    const top = `${significant(this.top)} m${this.goalOfErrors() ? ", the goal," : ""} or more`;
    byId("field-scale").replaceChildren(make("p", { class: "note" }, `Shades: ${words}`), ramp("0 m", top, true));
  }
  // Where the predicted error is largest; of places equally bad that furthest from all vessels.
  neediest() {
    const { places, inside } = this.grids.fine;
    const found = places.map((place, i) => ({
      place, bad: this.field[i],
      away: Math.min(...this.team.stations.map(([x, y]) => Math.hypot(x - place[0], y - place[1]))),
    })).filter((it, i) => inside[i]);
    found.sort((a, b) => (a.bad === b.bad ? b.away - a.away : b.bad - a.bad));
    return found[0]?.place ?? this.centre;
  }
  nameLast() { byId("remove-name").textContent = this.team.moving ? "a vessel" : `ASV${Math.min(this.last, this.team.stations.length - 1)}`; }
  layTable(auvs) {
    const head = this.columns.map(([, words, unit]) => make("th", { scope: "col" }, words, make("span", { class: "unit" }, unit)));
    const body = make("tbody");
    const cells = Array.from({ length: auvs }, (_, auv) => {
      const own = this.columns.map(() => make("td"));
      body.append(make("tr", {}, make("th", { scope: "row", style: `color:var(--c${auv % 8})` }, `AUV${auv}`), ...own));
      return own.map((cell, i) => {
        const bar = this.columns[i][0] === this.goal?.metric ? new GoalBar(cell, this.goal) : null, text = make("span");
        cell.append(text);
        return { cell, text, bar };
      });
    });
    this.worst = this.columns.map(() => make("td"));
    body.append(make("tr", {}, make("th", { scope: "row", title: "The worst AUV of each mission, averaged over missions: more than the largest of the AUVs' own means" }, "worst of a mission"), ...this.worst));
    byId("auvs").replaceChildren(make("table", {}, make("thead", {}, make("tr", {}, make("th", {}, "AUV"), ...head)), body));
    return cells;
  }
  // Everything that follows the vessels: the worst AUV, the table, the text to copy.
  tell() {
    const text = (value, unit, factor) => (unit === "s" && value >= LONG ? timed(value) : significant(value * factor));
    this.columns.forEach(([name, , unit, factor], i) => this.rows.forEach((row, auv) => {
      const value = this.predicted?.[name][auv];
      row[i].text.textContent = Number.isFinite(value) ? text(value, unit, factor) : "–";
      row[i].bar?.show(value);
    }));
    this.columns.forEach(([name, , unit, factor], i) => {
      const value = this.predicted ? worstOf(name, this.predicted) : NaN;
      this.worst[i].textContent = Number.isFinite(value) ? text(value, unit, factor) : "–";
    });
    const line = byId("worst");
    line.textContent = this.worstTold();
    line.classList.toggle("warning", this.met() === false);
    byId("simulated").textContent = this.predicted ? this.simulatedTold() : this.movingTold();
    byId("remove").disabled = this.team.stations.length < 2;
    byId("add").disabled ||= this.team.stations.length >= MOST_VESSELS;
    this.nameLast();
    if (this.team.moving) return;
    byId("positions").textContent = `asvs.formation.positions_m: ${this.team.positions()}`;
    byId("run").textContent = this.team.command(this.scenario);
  }
  judged() { return this.goal?.metric ?? ERROR; }
  // What the goal asks of: the worst AUV or the mean of all, as missions would have them.
  value() {
    return this.goal?.of === "mean" ? mean(this.predicted[this.judged()]) : worstOf(this.judged(), this.predicted);
  }
  // What missions made of the candidate on the chart, while it is as it was flown.
  simulatedTold(goal = this.goal) {
    const it = this.candidates[this.shown]?.simulated;
    const which = this.goals.indexOf(goal), [mean, low, high] = ["mean", "low", "high"].map((name) => it?.[name]?.[which]);
    if (!Number.isFinite(mean)) return "Not simulated as it lies here.";
    const { factor, unit } = goal, [told, from, to] = withEnds(mean * factor, low * factor, high * factor);
    return `Simulated in ${it.missions} missions: ${told} ${unit}${Number.isFinite(low) && Number.isFinite(high) ? `, the mean lying from ${from} to ${to} ${unit}` : ""}.`;
  }
  movingTold() {
    const { asvs, seed } = this.team.moving;
    return `Vessels that move are not predicted${asvs.length ? `; drawn are their ways in the mission of seed ${seed}` : ", and those of this team are not drawn"}.`;
  }
  met() {
    if (!this.predicted) return this.candidates[this.shown]?.verdict !== "not met";
    const value = this.value();
    if (!this.goal || !Number.isFinite(value)) return this.goal ? false : null;
    return Number.isFinite(this.goal.below) ? value < this.goal.below : value > this.goal.above;
  }
  worstTold() {
    if (!this.predicted) {
      const it = this.candidates[this.shown], goal = this.goal ?? this.goals[0], mark = { met: "✓ ", "not met": "✗ " }[it?.verdict] ?? "";
      const bound = goal ? `; ${goal.words} ${Number.isFinite(goal.below) ? "below" : "above"} ${significant((goal.below ?? goal.above) * goal.factor)} ${goal.unit}: ${mark}${it?.verdict}` : "";
      return `${this.simulatedTold(goal).replace(/\.$/, "")}${bound}, with ${it?.asvs} vessel${it?.asvs === 1 ? "" : "s"} that move.`;
    }
    const [, , unit, factor] = COLUMNS.find(([name]) => name === this.judged()), value = this.value() * factor;
    const words = this.goal?.words ?? "position error, 95 % of the time", whose = this.goal?.of === "mean" ? "Mean of the AUVs" : "Worst AUV of a mission";
    const told = Number.isFinite(value) ? `${significant(value)} ${unit}` : "no fix to be expected";
    const bound = this.goal ? `; goal ${Number.isFinite(this.goal.below) ? "below" : "above"} ${significant((this.goal.below ?? this.goal.above) * factor)} ${unit}: ${this.met() ? "✓ met" : "✗ not met"}` : "";
    const count = this.team.stations.length, values = Array.from(this.predicted[this.judged()]);
    const worst = this.goal?.of === "mean" || values.length < 2 ? "" : `, most often AUV${values.indexOf(MORE_IS_BETTER.includes(this.judged()) ? Math.min(...values) : Math.max(...values))}`;
    return `${whose}, predicted: ${told} (${words}${worst})${bound}, with ${count} vessel${count === 1 ? "" : "s"}.`;
  }
}

// A bar from 0 to twice the goal, with the goal marked in its middle.
class GoalBar {
  constructor(cell, { below, above }) {
    this.goal = below ?? above;
    this.bar = svg("rect", { class: "goal-value", x: 0, y: 1, height: 6 });
    cell.append(svg("svg", { class: "goal-bar", viewBox: "0 0 60 8", preserveAspectRatio: "none", "aria-hidden": "true" }, svg("rect", { class: "goal-ground", x: 0, y: 1, width: 60, height: 6 }), this.bar, svg("line", { class: "goal", x1: 30, x2: 30, y1: 0, y2: 8 })));
  }
  show(value) {
    this.bar.setAttribute("width", Number.isFinite(value) ? Math.min(30 * value / this.goal, 60) : 60);
    this.bar.classList.toggle("over", !(value <= this.goal));
  }
}

// Copies the text of an element; where the browser refuses, the text is left selected.
async function copy(element, button) {
  const range = document.createRange();
  range.selectNodeContents(element);
  getSelection().removeAllRanges();
  getSelection().addRange(range);
  const done = await navigator.clipboard?.writeText(element.textContent).then(() => true, () => false) || document.execCommand("copy");
  button.textContent = done ? "copied" : "selected";
  announce(done ? "Copied" : "Selected; copy it with the keyboard");
  setTimeout(() => { button.textContent = "copy"; }, 1500);
}

// Rows of candidates get a button that puts them on the chart.
function candidateButtons(choose) {
  for (const row of document.querySelectorAll(".candidates tbody tr")) {
    const cell = row.querySelector("th"), number = +cell.textContent - 1;
    const button = make("button", { type: "button", class: "plain link" }, `candidate ${number + 1}`);
    button.addEventListener("click", () => choose(number));
    cell.replaceChildren(button);
  }
}

function start() {
  startTheme();
  const data = readData(), page = {};
  const choose = (number) => {
    if (!page.chart) { page.pareto.show(number); return; }
    page.chart.show(number);
    byId("chart").scrollIntoView({ behavior: calm() ? "auto" : "smooth", block: "start" });
  };
  page.pareto = byId("pareto") ? new Pareto(byId("pareto"), data, choose) : null;
  page.chart = data.chart ? new Chart(data, page.pareto) : null;
  candidateButtons(choose);
  Object.assign(bindusbl, { ready: true, ...page });
}
bindusbl.opened = start();

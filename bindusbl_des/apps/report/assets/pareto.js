"use strict";
// Candidates as dots: what they cost against what they reach; intervals where they were simulated.

const PARETO_HEIGHT = 360;
const MARGIN = { left: 58, right: 16, top: 14, bottom: 44 };

class Pareto {
  constructor(host, data, choose) {
    Object.assign(this, { host, ...data, choose, place: 0 });
    this.goal.forEach(({ words }, i) => byId("goal").append(make("option", { value: i }, words)));
    byId("goal-label").hidden = this.goal.length < 2;
    byId("cost-label").hidden = this.candidates.every(({ cost, asvs }) => cost === asvs || !Number.isFinite(cost));
    for (const name of ["goal", "against"]) byId(name).addEventListener("change", () => this.draw());
    new ResizeObserver(() => this.draw()).observe(host);
    this.key();
    this.draw();
    this.host.after(saving("candidates", { SVG: () => standalone(this.host.firstChild), CSV: () => this.csv() }));
  }
  csv() { return csvOf([["candidate", byId("against").value, "mean", "low", "high", "predicted"], ...this.dots().map((dot) => [dot.number + 1, ...["x", "mean", "low", "high", "predicted"].map((name) => dot[name] ?? NaN)])]); }
  // Dots of one kind: where they are, as values; those of as many vessels stand side by side.
  dots() {
    const which = +byId("goal").value || 0, against = byId("against").value, factor = this.goal[which]?.factor ?? 1;
    const found = this.candidates.map((it, number) => {
      const of = (part, name) => { const value = it[part]?.[name]?.[which]; return Number.isFinite(value) ? value * factor : null; };
      const predicted = of("predicted", "value"), mean = of("simulated", "mean");
      return { number, x: it[against], mean, low: of("simulated", "low"), high: of("simulated", "high"), predicted, y: mean ?? predicted, simulated: mean !== null };
    }).filter(({ x, y }) => Number.isFinite(x) && y !== null);
    const groups = new Map();
    for (const dot of found) groups.set(`${dot.x} ${dot.simulated}`, [...(groups.get(`${dot.x} ${dot.simulated}`) ?? []), dot]);
    for (const group of groups.values()) {
      group.sort((a, b) => a.y - b.y || a.number - b.number);
      group.forEach((dot, i) => { dot.beside = group.length > 1 ? (i / (group.length - 1) - 0.5) * Math.min(0.7, 0.12 * group.length) : 0; });
    }
    return found;
  }
  scales(dots) {
    const width = Math.max(this.host.clientWidth, 240), xs = dots.map(({ x }) => x);
    const [low, high] = [Math.min(...xs), Math.max(...xs)], goal = this.line();
    const flown = dots.filter(({ simulated }) => simulated), tops = (flown.length ? flown : dots).map(({ high: it, y }) => it ?? y);
    // What lies far beyond the goal and all that was flown is drawn at the edge.
    const top = 1.08 * Math.max(1.5 * (goal ?? 0), Math.min(Math.max(...tops), 6 * (goal ?? Infinity)));
    const inner = width - MARGIN.left - MARGIN.right, tall = PARETO_HEIGHT - MARGIN.top - MARGIN.bottom, step = inner / (high - low + 1);
    const unit = byId("against").value === "asvs" ? 1 : (high - low || 1) / 12;
    return {
      width, top, low, high, step: step * unit,
      x: (value, beside = 0) => MARGIN.left + (value - low + 0.5 + beside * unit) * step,
      y: (value) => MARGIN.top + tall * (1 - clamp(value, 0, top) / top),
    };
  }
  line() {
    const goal = this.goal[+byId("goal").value || 0], bound = goal?.below ?? goal?.above;
    return Number.isFinite(bound) ? bound * goal.factor : null;
  }
  draw() {
    const dots = this.dots();
    if (!dots.length) { this.host.replaceChildren(make("p", { class: "note" }, "No candidate has a number to show.")); return; }
    const scales = this.scales(dots), root = svg("svg", { width: scales.width, height: PARETO_HEIGHT, viewBox: `0 0 ${scales.width} ${PARETO_HEIGHT}`, role: "group", "aria-label": "Candidates" });
    this.drawAxes(root, scales);
    const guessed = dots.filter(({ simulated }) => !simulated), flown = dots.filter(({ simulated }) => simulated);
    for (const dot of guessed) root.append(this.dot(dot, scales));
    this.drawGoal(root, scales);
    this.order = [...flown].sort((a, b) => a.x - b.x || a.beside - b.beside);
    for (const dot of this.order) root.append(this.dot(dot, scales));
    this.host.replaceChildren(root);
    this.place = Math.max(this.order.findIndex(({ number }) => number === (this.shown ?? this.chosen)), 0);
    this.reachable();
    bindusbl.plots.pareto = dots.length;
  }
  drawAxes(root, { x, y, top, low, high, width }) {
    const text = (at, words, more = {}) => root.append(svg("text", { x: at[0], y: at[1], ...more }, words));
    const step = roundStep(top / 6), base = PARETO_HEIGHT - MARGIN.bottom;
    for (let value = 0; value <= top; value += step) {
      root.append(svg("line", { class: "grid", x1: MARGIN.left, x2: width - MARGIN.right, y1: y(value), y2: y(value) }));
      text([MARGIN.left - 6, y(value) + 4], `${+value.toPrecision(6)}`, { "text-anchor": "end" });
    }
    const across = Math.max(roundStep((high - low + 1) * 34 / (width - MARGIN.left - MARGIN.right)), 1);
    for (let value = Math.ceil(low / across) * across; value <= high; value += across) text([x(value), base + 18], `${value}`, { "text-anchor": "middle" });
    const goal = this.goal[+byId("goal").value || 0], unit = goal?.unit ? ` (${goal.unit})` : "";
    text([(MARGIN.left + width) / 2, PARETO_HEIGHT - 6], byId("against").selectedOptions[0].textContent, { "text-anchor": "middle" });
    text([-(MARGIN.top + base) / 2, 14], `${goal?.words ?? ""}${unit}`, { "text-anchor": "middle", transform: "rotate(-90)" });
    byId("pareto-told").textContent = `Bars are intervals of the mean over missions; candidates with as many vessels stand side by side${top < Infinity ? ", those beyond the top at the edge" : ""}.`;
  }
  drawGoal(root, { y, width }) {
    const goal = this.line();
    if (goal === null) return;
    root.append(svg("line", { class: "goal", x1: MARGIN.left, x2: width - MARGIN.right, y1: y(goal), y2: y(goal) }), svg("text", { class: "goal", x: width - MARGIN.right - 4, y: y(goal) - 6, "text-anchor": "end" }, `goal ${significant(goal)} ${this.goal[+byId("goal").value || 0].unit}`));
  }
  dot(dot, { x, y }) {
    const { number, simulated } = dot, px = x(dot.x, dot.beside), py = y(dot.y), it = this.candidates[number];
    const kinds = ["dot", simulated ? "simulated" : "predicted", ...(number === this.chosen ? ["answer"] : []), ...(number === this.shown ? ["shown"] : [])];
    const group = svg("g", { class: kinds.join(" ") });
    if (Number.isFinite(dot.low) && Number.isFinite(dot.high)) group.append(svg("path", { d: `M${px} ${y(dot.low)}V${y(dot.high)}M${px - 4} ${y(dot.low)}h8M${px - 4} ${y(dot.high)}h8` }));
    group.append(number === this.chosen ? svg("path", { class: "mark", d: starPath(px, py) }) : svg("circle", { class: "mark", cx: px, cy: py, r: simulated ? 4.5 : 2.5 }));
    const told = this.words(dot);
    group.append(svg("title", {}, told));
    group.addEventListener("click", () => this.choose(number));
    if (simulated) {
      for (const [name, value] of Object.entries({ role: "button", tabindex: "-1", "aria-label": told, "data-candidate": number })) group.setAttribute(name, value);
      group.append(svg("circle", { class: "touch-target", cx: px, cy: py, r: 14 }));
      group.addEventListener("keydown", (event) => this.press(event, number));
    }
    return group;
  }
  words({ number, y, low, high, simulated }) {
    const it = this.candidates[number], goal = this.goal[+byId("goal").value || 0];
    const [mean, from, to] = withEnds(y, low, high), bars = Number.isFinite(low) && Number.isFinite(high) ? ` (${from} to ${to})` : "";
    return `Candidate ${number + 1}, ${it.asvs} vessels: ${mean}${bars} ${goal?.unit ?? ""} ${simulated ? `simulated in ${it.simulated.missions} missions` : "predicted, not simulated"}${it.verdict ? `; ${it.verdict}` : ""}`;
  }
  // Arrow keys go from one simulated candidate to the next; the plot is one stop of tab.
  press(event, number) {
    const way = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[event.key];
    if (event.key === "Enter" || event.key === " ") this.choose(number);
    else if (way) {
      this.place = (this.place + way + this.order.length) % this.order.length;
      this.reachable().focus();
    } else return;
    event.preventDefault();
  }
  reachable() {
    const dots = [...this.host.querySelectorAll("[data-candidate]")];
    dots.forEach((dot, i) => dot.setAttribute("tabindex", i === this.place ? "0" : "-1"));
    return dots[this.place];
  }
  show(number) {
    const focused = this.host.contains(document.activeElement);
    this.shown = number;
    this.draw();
    if (focused) this.reachable()?.focus();
  }
  key() {
    const parts = [["answer", "the answer"], ["simulated", "simulated"], ["predicted", "predicted only"], ["shown", "on the chart"]];
    byId("pareto-key").append(...parts.filter(([kind]) => kind !== "answer" || this.chosen !== null).flatMap(([kind, words]) => {
      const group = svg("g", { class: `dot ${kind === "shown" ? "simulated shown" : kind === "answer" ? "simulated answer" : kind}` });
      group.append(kind === "answer" ? svg("path", { class: "mark", d: starPath(9, 9) }) : svg("circle", { class: "mark", cx: 9, cy: 9, r: kind === "predicted" ? 2.5 : 4.5 }));
      return [make("span", { class: "pareto-kind" }, svg("svg", { width: 18, height: 18, "aria-hidden": "true" }, group), words)];
    }));
  }
}

const starPath = (px, py) => `M${starAt(px, py, 3.8, 9).map(([x, y]) => `${x.toFixed(2)} ${y.toFixed(2)}`).join("L")}Z`;

// What is simulated and planned: asked for, how far it is, what it found.

const unitOf = (metric) => (metric.endsWith("_s") ? "s" : "m");
// A question in the words of its form.
const worded = (form) => [...form.childNodes].map((it) => it.selectedOptions?.[0].textContent ?? it.value ?? it.textContent).join("").replace(/\s+/g, " ").replace(/ ([,.])/g, "$1").replace(", also when none of them is lost", "");
// What is exported of a plan's team
const EXPORTS = ["kmz", "kml", "gpx", "geojson", "qgc", "pdf"];
const button = (words, act, more = {}) => {
  const made = make("button", { type: "button", ...more }, words);
  made.addEventListener("click", act);
  return made;
};
const copied = (text) => make("div", { class: "tools command" }, make("code", {}, text), button("copy", ({ target }) => navigator.clipboard.writeText(text).then(() => { target.textContent = "copied"; })));
const seconds = (value) => (value >= 90 ? `${Math.round(value / 60)} min` : `${Math.ceil(value)} s`);

export class Jobs {
  constructor(bench) {
    Object.assign(this, { bench, known: new Map() });
    bench.on("jobs", (jobs) => this.show(jobs));
    byId("simulate").addEventListener("submit", (event) => {
      event.preventDefault();
      bench.ask("begin", { kind: "simulate", seeds: byId("seeds").valueAsNumber });
    });
    const goal = () => ({ below: `${byId("metric").value}=${byId("below").value}`, mean: byId("whose").value === "mean" });
    const judge = () => {
      byId("unit").textContent = unitOf(byId("metric").value);
      if (byId("below").checkValidity()) bench.ask("goal", goal());
    };
    for (const id of ["metric", "below", "whose"]) byId(id).addEventListener("change", judge);
    const predicted = (found) => { byId("predicted").textContent = found?.goal?.told ?? ""; };
    bench.on("forecast", ({ found }) => predicted(found));
    bench.on("tried", predicted);
    bench.on("compared", (told) => this.beside(told));
    byId("plan").addEventListener("submit", (event) => {
      event.preventDefault();
      const [least, most] = ["least", "most"].map((id) => byId(id).valueAsNumber).sort((a, b) => a - b), { below, mean } = goal();
      const vary = [`asvs.count=${least}:${most}`, ...byId("vary").value.split("\n").map((line) => line.trim()).filter(Boolean)];
      const numbers = { survive: +byId("survive").value || null, budget_missions: byId("budget").valueAsNumber || null };
      bench.ask("begin", { kind: "plan", below: [below], vary, mean, placed: byId("placed").value.split(","), ...numbers, words: worded(byId("question")) });
    });
  }
  // Answers of the plans that are marked, side by side.
  beside({ head, rows, lines }) {
    const host = byId("compared"), cells = (tag, row) => make("tr", {}, ...row.map((cell) => make(tag, {}, cell)));
    host.hidden = false;
    host.replaceChildren(make("h3", {}, "Side by side"), make("div", { class: "scroll" }, make("table", {}, make("thead", {}, cells("th", head)), make("tbody", {}, ...rows.map((row) => cells("td", row))))), ...lines.map((line) => make("p", { class: "note" }, line)), button("close", () => { host.hidden = true; }));
    host.scrollIntoView({ block: "nearest" });
  }
  compare() {
    const jobs = [...document.querySelectorAll("#planned input:checked")].map((it) => +it.value).sort((a, b) => a - b);
    if (jobs.length > 1) this.bench.ask("compare", { jobs });
    else this.bench.say("Mark two plans of one goal or more, to see them side by side.");
  }
  // Those that are as they were keep their place on the page, and the focus in it.
  show(jobs) {
    const hosts = { simulate: byId("simulated"), replay: byId("simulated"), fit: byId("simulated"), plan: byId("planned") };
    for (const job of jobs) {
      const told = JSON.stringify(job), before = this.known.get(job.number);
      if (before?.told === told) continue;
      const box = this.box(job);
      if (before) before.box.replaceWith(box);
      else hosts[job.kind].prepend(box);
      this.known.set(job.number, { told, box });
    }
  }
  box(job) {
    const { number, kind, status, told } = job, { bench } = this;
    const head = make("h3", {}, `${{ plan: "Plan", replay: "Recorded log", fit: "Noise of a recorded log" }[kind] ?? "Simulation"} ${number}${kind !== "plan" && job.words ? `: ${job.words}` : ""}`);
    const parts = [head, make("p", { class: "note" }, `${this.asked(job)}; ${this.far(job)}${job.version === bench.version ? "" : " (the scenario was another)"}`)];
    if (status === "running") {
      parts.push(make("progress", job.missions ? { max: job.missions, value: job.done } : {}), make("div", { class: "tools" }, button("stop", () => bench.ask("stop", { job: number }))));
      if (kind === "plan" && told) parts.push(make("p", { class: "note" }, told));
    } else if (status !== "complete") {
      parts.push(make("div", { class: "tools" }, button("go on", () => bench.ask("go_on", { job: number }))));
      if (told) parts.push(make("pre", {}, told));
    }
    if (kind === "simulate" && job.seeds_flown?.length) parts.push(...this.seeds(job));
    if (job.said) parts.push(...this.recorded(job));
    if (kind === "plan" && job.answered) parts.push(...this.answer(job));
    if (job.command) parts.push(make("details", {}, make("summary", {}, "As a command"), copied(job.command)));
    return make("section", { class: "job", "data-job": number, "data-status": status }, ...parts);
  }
  // What was made of a recorded log: figures and a picture, or the noise as keys of the scenario.
  recorded({ number, kind, said }) {
    const { bench } = this;
    const acts = kind === "fit" ? [button("give it to the scenario", () => bench.ask("noise", { job: number }))]
      : [button("its way", () => bench.open(`pages/${number}/picture`, `Recorded log ${number}`)), button("fit its noise", () => bench.ask("begin", { kind: "fit", of: number }))];
    return [make("div", { class: "tools" }, ...acts), make("pre", {}, said)];
  }
  asked({ kind, log, seeds, below, vary, mean, words }) {
    if (log) return log.split("/").pop();
    if (kind === "plan" && words) return words.replace(/\.$/, "");
    return kind === "simulate" ? `${seeds} seed${seeds === 1 ? "" : "s"}` : `${[...(below ?? []), ...(vary ?? [])].join(", ")}${mean ? ", mean of the AUVs" : ""}`;
  }
  far({ kind, log, status, done, missions, left_s: left, failed }) {
    if (log) return status === "complete" ? "done" : status;
    const flown = kind === "simulate" ? `${done} of ${missions} flown` : `${done} missions flown`;
    return `${status === "complete" ? "done" : status}, ${flown}${failed ? `, ${failed} failed` : ""}${status === "running" && kind !== "plan" && Number.isFinite(left) ? `, ${seconds(left)} left` : ""}`;
  }
  // Best, median and worst seed, and a table of all; each is played on its page.
  seeds({ number, seeds_flown: flown, mean: average, half }) {
    const told = half === null ? significant(average) : withHalf(average, half).join(" ± ");
    const play = (row) => this.bench.playing.open(number, row.seed, `Simulation ${number}`);
    const named = [["best", flown[0]], ["median", flown[Math.floor((flown.length - 1) / 2)]], ["worst", flown[flown.length - 1]]];
    const cell = (value, unit) => make("td", {}, value === null ? "–" : unit === "s" ? timed(value) : significant(value));
    const rows = flown.map((row) => make("tr", {}, make("th", { scope: "row" }, button(`seed ${row.seed}`, () => play(row), { class: "plain link" })), make("td", {}, row.worst_position_error_m_auv ?? ""), cell(row.worst_position_error_m), cell(row.worst_position_error_p95_m), cell(row.worst_fix_age_max_s, "s")));
    const heads = [["play", ""], ["worst", ""], ["mean error", "m"], ["95 %", "m"], ["oldest fix", ""]].map(([words, unit]) => make("th", { scope: "col" }, words, make("span", { class: "unit" }, unit)));
    return [
      make("p", {}, "Worst AUV, mean error: ", make("b", {}, `${told} m`), half === null ? ", of one mission." : ` (95 % interval of the mean of ${flown.length} missions).`),
      make("div", { class: "tools" }, ...named.map(([words, row]) => button(`▶ ${words} seed`, () => play(row))), button("all missions", () => this.bench.open(`pages/${number}/all`, `Simulation ${number}`))),
      make("details", {}, make("summary", {}, "Each seed"), make("table", {}, make("thead", {}, make("tr", {}, ...heads)), make("tbody", {}, ...rows))),
    ];
  }
  answer({ number, answered, answer, would, doubts, keys, teams, unit, run }) {
    const { bench } = this, [first, ...others] = answered;
    const team = make("select", { "aria-label": "Team" }, ...teams.map((it) => make("option", { value: it.number }, it.told)));
    const takeOver = button("put it on the chart", () => bench.ask("take", { job: number, team: +team.value }));
    const exports = EXPORTS.map((kind) => make("a", { href: `export/${number}/${kind}`, download: "" }, kind.toUpperCase()));
    const fly = (words, more, told) => button(told, () => { bench.ask("begin", { kind: "simulate", seeds: byId("seeds").valueAsNumber || 8, set: { ...keys, ...more }, words }); bench.tab("simulate"); }, { class: "plain link", title: "Simulate the team in this condition, to look at its missions" });
    const doubted = doubts.map((doubt) => make("tr", {}, make("th", { scope: "row" }, fly(doubt.told, doubt.keys, doubt.told)), make("td", {}, doubt.verdict), make("td", {}, doubt.planned), make("td", {}, doubt.mean), make("td", {}, doubt.known ? fly(`${doubt.told}, known to the filter`, doubt.known_keys, doubt.known) : "")));
    const heads = ["if", "goal", "planned", unit, "if the filter knows"].map((words) => make("th", { scope: "col" }, words));
    const mark = make("input", { type: "checkbox", value: number });
    return [
      make("p", { class: answer ? "verdict" : "verdict warning" }, first),
      make("div", { class: "tools" }, button("the plan's page", () => bench.open(`pages/${number}/plan`, `Plan ${number}`)), ...exports.flatMap((it) => [it, " "])),
      ...(would ? [make("p", {}, make("b", {}, "What would: "), would)] : []),
      make("div", { class: "tools team" }, team, takeOver),
      ...(doubted.length ? [make("p", {}, "If it is not as planned (press one to simulate it):"), make("div", { class: "scroll" }, make("table", { class: "doubts" }, make("thead", {}, make("tr", {}, ...heads)), make("tbody", {}, ...doubted)))] : []),
      ...(answer ? [make("p", {}, "To fly it: "), copied(run)] : []),
      make("div", { class: "tools" }, make("label", {}, mark, " compare"), button("side by side", () => this.compare())),
      make("details", {}, make("summary", {}, "All that it says"), ...others.map((text) => make("p", {}, text))),
    ];
  }
}

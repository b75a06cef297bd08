"use strict";
// The fewest ASVs with which an error stays below a threshold, for every combination of the other keys.
// Judged is the worst AUV of each mission, averaged over seeds, unless the reader asks for the fleet.

const MOST_COMBINATIONS = 300;

class Lookup {
  constructor(sweep) {
    this.sweep = sweep;
    this.key = sweep.keys.findIndex(({ key }) => key === "asvs.count");
    if (this.key < 0 || sweep.keys[this.key].values === null) return;
    byId("lookup-section").hidden = false;
    sweep.offer(byId("lookup-metric"), sweep.metrics.filter(({ name }) => /_error_/.test(name) && !/imu|path|fix_error/.test(name)));
    byId("lookup-metric").value = "worst_position_error_p95_m";
    for (const id of ["lookup-metric", "threshold"]) byId(id).addEventListener("input", () => this.show());
    this.show();
  }
  combinations() {
    const rows = new Map();
    for (let point = 0; point < this.sweep.size; point++) {
      const values = this.sweep.keys.map((_, k) => (k === this.key ? -1 : this.sweep.points[k][point]));
      const name = values.join();
      if (!rows.has(name)) rows.set(name, { values, byCount: new Map() });
      rows.get(name).byCount.set(this.sweep.points[this.key][point], point);
    }
    return [...rows.values()];
  }
  show() {
    const { sweep, key } = this, threshold = +byId("threshold").value, metric = byId("lookup-metric").value;
    const counts = sweep.keys[key].labels, others = sweep.keys.map((_, k) => k).filter((k) => k !== key);
    const rows = this.combinations();
    const head = make("tr", {}, ...others.map((k) => make("th", { scope: "col" }, sweep.keys[k].short)),
      ...counts.map((label) => make("th", { scope: "col" }, `${label} ASV${label === "1" ? "" : "s"}`, make("span", { class: "unit" }, "m"))), make("th", { scope: "col" }, "fewest"));
    let nearest = null;
    this.answers = rows.map(({ values, byCount }) => {
      let fewest = null;
      const cells = counts.map((label, count) => {
        const cell = sweep.at(metric, byCount.get(count));
        if (!cell || !Number.isFinite(cell.mean)) return make("td", {}, "–");
        const sure = cell.mean + cell.half < threshold, mark = sure ? " ✓" : cell.mean < threshold ? " ~" : "";
        const first = sure && fewest === null;
        if (!nearest || cell.mean < nearest.mean) nearest = { mean: cell.mean, half: cell.half, point: byCount.get(count) };
        if (first) fewest = label;
        const whose = sweep.whose(metric, byCount.get(count)), went = cell.failed ? `${cell.count} of ${cell.count + cell.failed} missions` : "";
        const text = make("td", first ? { class: "fewest" } : {}, plusMinus(cell.mean, cell.half) + mark);
        const served = sweep.at("worst_latency_mean_s", byCount.get(count)), starved = served.count - served.whole;
        const alone = starved ? `an AUV without a fix in ${starved}/${served.count}` : "";
        for (const more of [whose, went, alone, gapText(cell)]) if (more) text.append(make("small", {}, more));
        return text;
      });
      return { fewest, row: make("tr", {}, ...others.map((k) => make("th", { scope: "row" }, sweep.keys[k].labels[values[k]])), ...cells, make("td", { class: "answer" }, fewest ?? `more than ${counts[counts.length - 1]}`)) };
    });
    const none = this.answers.every(({ fewest }) => fewest === null), told = byId("lookup-none");
    told.hidden = !none || !nearest;
    if (none && nearest) told.textContent = `None of these keeps it surely below ${threshold} m; the nearest is ${sweep.named(nearest.point)}: ${plusMinus(nearest.mean, nearest.half)} m.`;
    if (none) for (const { row } of this.answers) row.lastChild.textContent = "none of these";
    byId("lookup").replaceChildren(make("table", {}, make("thead", {}, head), make("tbody", {}, ...this.answers.slice(0, MOST_COMBINATIONS).map(({ row }) => row))));
    if (rows.length > MOST_COMBINATIONS) byId("lookup").append(make("p", { class: "note" }, `The first ${MOST_COMBINATIONS} of ${rows.length} combinations.`));
    bindusbl.plots.lookup = rows.length;
  }
}

"use strict";
// The tables of the fewest ASVs, marked for the error and the threshold that are asked for.

class Lookup {
  constructor(sweep) {
    this.sweep = sweep;
    if (!sweep.lookup) return; // rows of points, one at each number of ASVs
    const metrics = sweep.metrics.filter(({ name }) => byId(`lookup-${name}`));
    sweep.offer(byId("lookup-metric"), metrics);
    byId("lookup-metric").value = byId("lookup").firstChild.id.slice("lookup-".length);
    for (const id of ["lookup-metric", "threshold"]) byId(id).addEventListener("input", () => this.show());
    this.show();
  }
  show() {
    const { counts, points } = this.sweep.lookup, threshold = +byId("threshold").value, metric = byId("lookup-metric").value;
    for (const { name } of this.sweep.metrics) if (byId(`lookup-${name}`)) byId(`lookup-${name}`).hidden = name !== metric;
    byId("asked").textContent = `${this.sweep.title(metric)}, below ${threshold}`;
    const rows = byId(`lookup-${metric}`).querySelector("tbody").rows;
    this.fewest = points.map((row, place) => {
      const cells = row.map((point) => this.sweep.at(metric, point ?? undefined));
      const first = cells.findIndex((cell) => cell && cell.mean + cell.half < threshold);
      cells.forEach((cell, k) => {
        const mark = cell && cell.mean + cell.half < threshold ? "sure" : cell && cell.mean < threshold ? "near" : "";
        rows[place].cells[k + 1].className = k === first ? "sure fewest" : mark;
      });
      const isKnown = cells.every((cell) => !cell || cell.count + cell.failed > 0);
      rows[place].lastChild.textContent = counts[first] ?? (isKnown ? `more than ${counts[counts.length - 1]}` : "not known yet");
      return counts[first] ?? null;
    });
    bindusbl.plots.lookup = points.length;
  }
}

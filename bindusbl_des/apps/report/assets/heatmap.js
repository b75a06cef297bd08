"use strict";
// A table whose cells are coloured by their values.

// In how many missions every AUV has a value, where that is not in all.
function gapText({ whole, count }) { return whole < count ? `${whole}/${count}` : ""; }

// `cells[row][column]` is {mean, half, count, whole} or nothing.
function heatmap(host, scale, { rows, columns, rowName, columnName, cells, unit, more }) {
  const known = cells.flat().filter((cell) => cell && Number.isFinite(cell.mean)).map((cell) => cell.mean);
  const low = Math.min(...known), high = Math.max(...known);
  const top = make("tr", {}, make("th", {}, rowName ? `${rowName} ↓  ${columnName} →` : `${columnName} →`), ...columns.map((label) => make("th", { scope: "col" }, label)));
  const body = cells.map((line, r) => make("tr", {}, make("th", { scope: "row" }, rows[r]), ...line.map((cell) => {
    const gap = cell ? gapText(cell) : "";
    if (!cell || !Number.isFinite(cell.mean)) return make("td", { class: gap ? "gap none" : "none" }, "–", ...(gap ? [make("small", {}, gap)] : []));
    const share = high > low ? (cell.mean - low) / (high - low) : 0.5;
    const [told, half] = withHalf(cell.mean, cell.half);
    const text = make("td", { class: `shade${Math.round(10 * (more ? 1 - share : share))}`, title: `${cell.point}; ${cell.count} missions` }, told);
    text.append(make("small", {}, Number.isFinite(cell.half) ? `± ${half}` : "one seed"));
    if (gap) text.append(make("small", {}, gap));
    return text;
  })));
  host.replaceChildren(make("table", { class: "heat" }, make("thead", {}, top), make("tbody", {}, ...body)));
  scale.replaceChildren(ramp(`${significant(low)} ${unit}`, `${significant(high)} ${unit}`, more));
  bindusbl.plots.heatmap = known.length;
  return [["", ...columns], ...cells.map((line, r) => [rows[r], ...line.map((cell) => cell?.mean ?? NaN)])];
}

"use strict";
// The page of a plan: the chart of each team that is drawn, the candidates, and how they go together.

class Chart {
  constructor({ chart, goal, candidates, first }, chosen) {
    const error = goal.find(({ metric, below }) => metric.startsWith("position_error") && Number.isFinite(below));
    Object.assign(this, { candidates, chosen, goal: error?.below ?? null });
    this.map = new PlanMap(byId("map"), chart, this.goal);
    byId("map").after(saving("chart", this.map.pictures()));
    byId("team").addEventListener("change", () => this.show(+byId("team").value));
    byId("all").addEventListener("click", () => this.map.seeAll());
    this.show(first);
  }
  draws(number) { return number in this.map.chart.forecasts; }
  show(number) {
    this.shown = number;
    byId("team").value = number;
    for (const told of document.querySelectorAll(".drawn")) told.hidden = +told.dataset.team !== number;
    this.map.show(number);
    const shade = this.map.mission.fields && `${significant(this.map.top)} m${this.goal === null ? "" : ", the goal,"} or more`;
    byId("field-scale").replaceChildren(...(shade ? [make("p", { class: "note" }, "Shades: mean error of the AUV that passes nearest on its lanes, as it passes, predicted; dark is bad"), ramp("0 m", shade, true)] : []));
    announce(byId("team").selectedOptions[0].textContent);
    this.chosen(number);
  }
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
    if (!page.chart?.draws(number)) { page.pareto?.show(number); return; }
    page.chart.show(number);
    byId("chart").scrollIntoView({ behavior: calm() ? "auto" : "smooth", block: "start" });
  };
  page.pareto = byId("pareto") ? new Pareto(byId("pareto"), data, choose) : null;
  page.chart = byId("map") ? new Chart(data, (number) => page.pareto?.show(number)) : null;
  candidateButtons(choose);
  Object.assign(bindusbl, { ready: true, ...page });
}
bindusbl.opened = start();

"use strict";
// A team on the map of the survey: lanes of AUVs, vessels with their ranges, the predicted error as shades.

class PlanMap extends SeaMap {
  // `chart` holds the first team, what others have otherwise, and the shade of each; `goal` is the error (m) asked for, if one is.
  constructor(canvas, chart, goal) {
    super(canvas, chart.first);
    Object.assign(this, { chart, goal, field: "lanes" });
  }
  show(number) {
    const { first, teams, forecasts } = this.chart, shade = forecasts[number], team = { ...first, ...teams[number] };
    const values = shade?.values.map((value) => value ?? NaN), known = values?.filter(Number.isFinite);
    this.top = this.goal ?? (known?.length ? roundStep(quantile(known, 0.9) || 1) : 1);
    const fields = shade && { ...shade, lanes: values, ends: [0, this.top] };
    this.mission = { ...team, fields, asvsRest: true, hasFailed: () => false, asvAt: (asv) => ({ x: team.asvs[asv].x[0], y: team.asvs[asv].y[0] }) };
    Object.assign(this, { view: null, drawn: "" });
    this.sheet.paint();
  }
  draw(context, width, height) {
    this.fit(width, height);
    this.still([], (own) => this.drawStill(own));
    context.drawImage(this.paths, 0, 0, width, height);
    this.drawCursor(context);
  }
  drawStill(context) {
    const { auvs, asvs } = this.mission;
    this.drawField(context);
    this.drawGrid(context);
    auvs.forEach(({ x, y }, i) => {
      this.line(context, x, y, { colour: colours.sea, width: 4, alpha: 0.8 });
      this.line(context, x, y, { colour: seriesColour(i), width: 2, dash: PATH_DASHES[Math.floor(i / 8) % PATH_DASHES.length] });
    });
    asvs.forEach(({ x, y }, i) => this.line(context, x, y, { colour: colours.ink, width: 1.6, dash: PATH_DASHES[i % PATH_DASHES.length] }));
    asvs.forEach((_, i) => this.drawRanges(context, i));
    auvs.forEach(({ name, x, y }, i) => this.label(context, name, ...this.at(x[0], y[0]).map((it, axis) => it + [4, -5][axis]), seriesColour(i)));
    asvs.forEach((_, i) => this.drawAsv(context, i));
  }
}

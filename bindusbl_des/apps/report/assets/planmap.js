"use strict";
// The survey with the ways of AUVs, vessels that can be moved, and the predicted error as shades.

// Cells along the longer side of the survey: at rest, and while something is moved.
const FINE = 56, COARSE = 20;
// How far (CSS pixels) an arrow key moves a vessel, with shift and without.
const LEAP = 40, STEP = 8;

class PlanMap extends SeaMap {
  // `team` says where vessels lie, `moved(number, place)` and `removed(number)` hear what was asked for.
  // `survey` is where it lies: its outline, origin and current.
  constructor(canvas, team, { outline, origin, current }, { moved, removed, chosen }) {
    let [known, auvs] = [null, []]; // candidates may differ in how AUVs go
    super(canvas, {
      outline, origin, current,
      get auvs() {
        if (known !== team.base.ways) auvs = team.base.ways.places_m.map((way) => ({ x: way.map(([x]) => x), y: way.map(([, y]) => y) }));
        known = team.base.ways;
        return auvs;
      },
      get asvs() { return team.moving ? team.moving.asvs : team.stations.map(([x, y]) => ({ x: [x], y: [y] })); },
      get hf() { return { reach: team.reach() }; },
    });
    Object.assign(this, { team, moved, removed, chosen, host: canvas.parentElement, buttons: [] });
    this.shades = document.createElement("canvas");
  }
  // Middles of cells that cover the survey, `across` in a row, row by row from low y on; `inside`
  // tells which of them lie in it.
  static grid(outline, cells) {
    const [xs, ys] = [0, 1].map((axis) => outline.map((corner) => corner[axis]));
    const box = [Math.min(...xs), Math.min(...ys), Math.max(...xs), Math.max(...ys)];
    const [width, height] = [box[2] - box[0], box[3] - box[1]], side = Math.max(width, height) / cells;
    const [across, down] = [width, height].map((length) => Math.max(Math.round(length / side), 1));
    const places = Array.from({ length: across * down }, (_, i) => [
      box[0] + (i % across + 0.5) * width / across, box[1] + (Math.floor(i / across) + 0.5) * height / down,
    ]);
    return { box, across, down, places, inside: places.map((place) => within(place, outline)) };
  }
  shade(grid, values, top) {
    const { across, down } = grid, context = this.shades.getContext("2d");
    Object.assign(this.shades, { width: down, height: across });
    const image = context.createImageData(down, across);
    this.unknown = [];
    this.cells = [across, down];
    values.forEach((value, i) => { // cells at the edge are cut where they are drawn
      const row = across - 1 - i % across, column = Math.floor(i / across);
      if (!Number.isFinite(value)) { this.unknown.push([row, column]); return; }
      image.data.set([...shadeOf(value / top, true), 150], 4 * (row * down + column));
    });
    context.putImageData(image, 0, 0);
    this.box = values.length ? grid.box : null;
    this.sheet.paint();
  }
  draw(context, width, height) {
    this.fit(width, height);
    this.drawShades(context);
    this.drawPaths();
    context.drawImage(this.paths, 0, 0, width, height);
    this.team.moving?.asvs.forEach((way, number) => this.drawMoving(context, way, number));
    this.team.stations.forEach((place, number) => this.drawVessel(context, place, number));
    this.drawCursor(context);
    this.layButtons();
  }
  drawShades(context) {
    if (!this.box) return;
    const [south, west, north, east] = this.box, [left, top] = this.at(north, west), [right, bottom] = this.at(south, east);
    context.save();
    context.beginPath();
    this.outline(context);
    context.clip();
    context.drawImage(this.shades, left, top, right - left, bottom - top);
    const [across, down] = this.cells, [wide, tall] = [(right - left) / down, (bottom - top) / across];
    context.globalAlpha = 0.6;
    for (const [row, column] of this.unknown) hatch(context, left + column * wide, top + row * tall, wide, tall);
    context.restore();
  }
  // The grid and the ways stay as they are while vessels move.
  drawPaths() {
    if (this.mission.auvs !== this.drawnWays) this.drawn = "";
    this.drawnWays = this.mission.auvs;
    this.still([], (context) => this.drawStill(context));
  }
  drawStill(context) {
    this.drawGrid(context);
    this.mission.auvs.forEach(({ x, y }, i) => {
      this.line(context, x, y, { colour: colours.sea, width: 4, alpha: 0.8 });
      this.line(context, x, y, { colour: seriesColour(i), width: 2 });
    });
    this.mission.auvs.forEach(({ x, y }, i) => {
      this.label(context, `AUV${i}`, this.at(x[0], y[0])[0] + 4, this.at(x[0], y[0])[1] - 5, seriesColour(i));
    });
  }
  drawVessel(context, [x, y], number) {
    this.ring(context, x, y, this.team.reach(), colours.sea, { width: 4, alpha: 0.7 });
    this.ring(context, x, y, this.team.reach(), colours.ink, { dash: [7, 4], width: 1.6 });
    this.ring(context, x, y, this.team.mfReach(), colours.mf, { dash: [2, 4], width: 1.6 });
    const [px, py] = this.at(x, y);
    shape(context, { fill: colours.paper, shade: 0.85, stroke: colours.ink, width: 1.5 }, () => disc(context, px, py, 13));
    this.star(context, px, py);
    this.label(context, `ASV${number}`, px + 16, py - 10, colours.ink);
  }
  // A vessel that moves: its way in one mission, and its range where it begins.
  drawMoving(context, { x, y }, number) {
    this.line(context, x, y, { colour: colours.sea, width: 4, alpha: 0.7 });
    this.line(context, x, y, { colour: colours.ink, width: 1.6, dash: PATH_DASHES[number % PATH_DASHES.length] });
    this.ring(context, x[0], y[0], this.team.reach(), colours.ink, { dash: [7, 4], width: 1.3, alpha: 0.7 });
    const [px, py] = this.at(x[0], y[0]);
    this.star(context, px, py);
    this.label(context, `ASV${number}`, px + 9, py - 8, colours.ink);
  }
  // A vessel is a button over the chart: it can be dragged, reached with tab and moved by keys.
  layButtons() {
    const { stations } = this.team;
    while (this.buttons.length > stations.length) this.buttons.pop().remove();
    while (this.buttons.length < stations.length) this.buttons.push(this.button(this.buttons.length));
    stations.forEach(([x, y], number) => {
      const [px, py] = this.at(x, y), { style } = this.buttons[number];
      style.transform = `translate(${px}px, ${py}px)`;
      style.display = px < 0 || py < 0 || px > this.width || py > this.height ? "none" : "";
      this.buttons[number].setAttribute("aria-label", `ASV${number}, at north ${significant(x)} m, east ${significant(y)} m`);
    });
  }
  button(number) {
    const button = make("button", { type: "button", class: "vessel", "aria-roledescription": "vessel that can be moved" });
    let grip = null; // from the pointer to the vessel, in pixels
    button.addEventListener("pointerdown", (event) => {
      const [px, py] = this.at(...this.team.stations[number]);
      button.setPointerCapture(event.pointerId);
      grip = [px - event.clientX, py - event.clientY];
    });
    button.addEventListener("pointermove", (event) => {
      if (!grip) return;
      this.cursor = this.placeAt(event.clientX + grip[0], event.clientY + grip[1]);
      this.moved(number, this.cursor);
    });
    for (const end of ["pointerup", "pointercancel"]) button.addEventListener(end, () => { grip = null; });
    button.addEventListener("focus", () => this.chosen(number));
    button.addEventListener("keydown", (event) => {
      const way = { ArrowLeft: [0, -1], ArrowRight: [0, 1], ArrowUp: [1, 0], ArrowDown: [-1, 0] }[event.key];
      if (event.key === "Delete" || event.key === "Backspace") this.removed(number);
      else if (way) this.moved(number, this.team.stations[number].map((it, axis) => it + way[axis] * this.step(event.shiftKey)));
      else return;
      event.preventDefault();
    });
    this.host.append(button);
    return button;
  }
  step(far) { return roundStep((far ? LEAP : STEP) / this.view.scale); }
}

// Whether a place lies inside a polygon, by how often a ray from it crosses the outline.
function within([x, y], outline) {
  let inside = false;
  for (let i = 0, j = outline.length - 1; i < outline.length; j = i++) {
    const [[ax, ay], [bx, by]] = [outline[i], outline[j]];
    if ((ay > y) !== (by > y) && x < (bx - ax) * (y - ay) / (by - ay) + ax) inside = !inside;
  }
  return inside;
}

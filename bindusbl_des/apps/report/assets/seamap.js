"use strict";
// The survey seen from above at an instant: north (x) up, east (y) to the right, as on a chart.

const LAYERS = [
  ["plan", "planned path"], ["truth", "true path"], ["fused", "fused estimate"], ["sure", "95 % ellipse of the estimate"], ["imu", "IMU only"],
  ["hf", "HF range"], ["mf", "MF range"], ["pings", "pings and what became of them"],
  ["downlink", "broadcasts and fixes"], ["signals", "signals, relays, data: from who sends to who hears"],
];

// Those of a mission, and what they are called in it: no band that nothing is sent on, and no range
// of the protocol for one that decides what is decoded.
function layersOf({ discs, broadcasting, asvsPing, signals }) {
  const names = {
    hf: discs.hf ? "HF range" : "HF range that the protocol plans with",
    mf: broadcasting && (discs.mf ? "MF range" : "MF range as set; the channel decides"),
    downlink: broadcasting ? "broadcasts and fixes" : asvsPing ? "fixes" : "answers and fixes",
  };
  if (!signals) names.signals = "";
  return LAYERS.map(([layer, words]) => [layer, names[layer] ?? words]).filter(([, words]) => words);
}

// What the survey can be shaded by: its name, what it is, and how a value is written.
const FIELDS = {
  chance: ["chance of a fix", "chance that a ping makes a fix which is delivered, if no other sound overlaps it", (value) => `${+(100 * value).toFixed(value > 0.1 && value < 0.999 ? 0 : 1)} %`],
  age: ["age of a fix", "time since the last fix was made, to be expected (mean)", (value) => `${significant(value)} s`],
  error: ["error", "horizontal position error to be expected of an AUV that dwells there (RMS)", (value) => `${significant(value)} m`],
};

// Where fewer pings than this share make a fix, none is to be expected: apps/report/possible.py.
const LEAST_CHANCE = 1e-3;

// Fronts are drawn in so many steps (rad) where there is land.
const STEP = Math.PI / 180;
// Where fronts are held to be seen, no more of them than can be told apart.
const MOST_RINGS = 6;

// Eight AUVs have colours of their own; the dashes of their paths tell further ones from these.
const PATH_DASHES = [[], [9, 4], [9, 3, 2, 3]];

// The ellipse that holds a normal error in the plane with 95 %, in standard deviations.
const SURE = Math.sqrt(-2 * Math.log(0.05));

// What the ends of a field's colours stand for: chances from 0 to 1, else what there is.
function fieldEnds(field, values) {
  if (field === "chance") return [0, 1];
  const known = values.filter(Number.isFinite);
  return known.length ? [known.reduce((a, b) => Math.min(a, b)), quantile(known, 0.98)] : [0, 1];
}

// WGS-84: semi-major axis (m), flattening, and the square of the eccentricity.
const [AXIS, FLATTENING] = [6378137, 1 / 298.257223563], SQUARED = FLATTENING * (2 - FLATTENING);

// Latitude and longitude (deg) of a place of the survey (m), whose x = y = 0 is at `origin` (deg): core/geometry/geodesy.py.
function onEarth([x, y], origin) {
  const [lat, lon] = origin.map((it) => it * Math.PI / 180), [sine, cosine] = [Math.sin(lat), Math.cos(lat)];
  const normal = AXIS / Math.sqrt(1 - SQUARED * sine ** 2), outwards = normal * cosine - sine * x;
  const [east, north] = [outwards * Math.cos(lon) - Math.sin(lon) * y, outwards * Math.sin(lon) + Math.cos(lon) * y];
  const up = normal * (1 - SQUARED) * sine + cosine * x, across = Math.hypot(east, north), reduced = Math.atan2(up, across * (1 - FLATTENING));
  const upper = up + SQUARED / (1 - FLATTENING) * AXIS * Math.sin(reduced) ** 3, lower = across - SQUARED * AXIS * Math.cos(reduced) ** 3;
  return [Math.atan2(upper, lower), Math.atan2(north, east)].map((it) => it * 180 / Math.PI);
}

function closedWater(context, x, y, width, height, path) {
  context.save();
  context.beginPath();
  path();
  context.clip();
  hatches(context, x, y, width, height, colours.ink, true);
  context.restore();
  shape(context, { stroke: colours.ink, dash: [5, 3] }, path);
}

// How far it is from the origin along (north, east) to a closed ring of corners.
function wayTo(ring, north, east) {
  let least = Infinity, [x1, y1] = ring[ring.length - 1];
  for (const [x2, y2] of ring) {
    const one = north * y1 - east * x1, two = north * y2 - east * x2; // aside of the way, to either side
    if (one * two < 0) {
      const way = (one * (x2 * north + y2 * east) - two * (x1 * north + y1 * east)) / (one - two);
      if (way > 0) least = Math.min(least, way);
    }
    [x1, y1] = [x2, y2];
  }
  return least;
}

class SeaMap {
  constructor(canvas, mission, options = {}) {
    this.mission = mission;
    this.ways = new Map();
    this.hidden = options.hidden || new Set();
    this.linger = () => 1;
    this.now = 0;
    this.paths = document.createElement("canvas");
    this.sheet = new Sheet(canvas, (context, width, height) => this.draw(context, width, height));
    onTheme(() => { this.drawn = ""; });
    if (!options.still) this.listen(canvas);
  }
  // The part of the sea that is shown: what the vehicles and HF circles take up.
  home(width, height) {
    const { outline, asvs, auvs, hf } = this.mission;
    const [x, y] = [0, 1].map((axis) => {
      const places = outline.map((corner) => corner[axis]);
      return (Math.min(...places) + Math.max(...places)) / 2;
    });
    let [tall, wide] = [0, 0]; // half of what is shown, northwards and eastwards (m)
    const show = (px, py, around = 0) => {
      tall = Math.max(tall, Math.abs(px - x) + around);
      wide = Math.max(wide, Math.abs(py - y) + around);
    };
    for (const corner of outline) show(...corner);
    for (const asv of asvs) asv.x.forEach((px, i) => show(px, asv.y[i], 0.15 * hf.reach));
    for (const auv of auvs) auv.x.forEach((px, i) => show(px, auv.y[i]));
    this.view = { x, y, scale: Math.min(width / wide, height / tall) / 2.16 };
    this.touched = false;
  }
  // The only places where the survey's x (north) and y (east), m, become those of the canvas, in px, and back.
  at(x, y) {
    return [this.width / 2 + (y - this.view.y) * this.view.scale, this.height / 2 - (x - this.view.x) * this.view.scale];
  }
  placeAt(px, py) {
    return [this.view.x + (this.height / 2 - py) / this.view.scale, this.view.y + (px - this.width / 2) / this.view.scale];
  }
  // A heading, from north towards east, as the angle by which the canvas turns what points to the right.
  static turnTo(heading) { return heading - Math.PI / 2; }
  zoom(factor, px = this.width / 2, py = this.height / 2) {
    const [x, y] = this.placeAt(px, py);
    this.view = { x: x - (x - this.view.x) / factor, y: y - (y - this.view.y) / factor, scale: this.view.scale * factor };
    this.touched = true;
    this.sheet.paint();
  }
  move(dx, dy) {
    const [x, y] = this.placeAt(this.width / 2 - dx, this.height / 2 - dy);
    this.view = { ...this.view, x, y };
    this.touched = true;
    this.sheet.paint();
  }
  // What lies under the cursor is told until the mouse leaves the map.
  point(place) { this.cursor = place; this.sheet.paint(); }
  seeAll() { this.view = null; this.sheet.paint(); }
  listen(canvas) {
    const pointers = new Map();
    canvas.addEventListener("wheel", (event) => {
      if (!event.ctrlKey && document.activeElement !== canvas) return; // the page scrolls
      event.preventDefault();
      this.zoom(Math.exp(-event.deltaY / 400), event.offsetX, event.offsetY);
    }, { passive: false });
    // One finger scrolls the page, two move and zoom the map.
    for (const kind of ["touchstart", "touchmove"]) {
      canvas.addEventListener(kind, (event) => { if (event.touches.length > 1) event.preventDefault(); }, { passive: false });
    }
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      pointers.set(event.pointerId, [event.offsetX, event.offsetY]);
      this.point(this.placeAt(event.offsetX, event.offsetY));
    });
    canvas.addEventListener("pointerleave", (event) => { if (event.pointerType === "mouse") this.point(null); });
    canvas.addEventListener("pointermove", (event) => {
      if (event.pointerType !== "touch") this.point(this.placeAt(event.offsetX, event.offsetY));
      const before = pointers.get(event.pointerId);
      if (!before) return;
      const other = [...pointers].find(([id]) => id !== event.pointerId);
      const now = [event.offsetX, event.offsetY];
      if (other) {
        const [, [ox, oy]] = other;
        this.zoom(Math.hypot(now[0] - ox, now[1] - oy) / Math.max(Math.hypot(before[0] - ox, before[1] - oy), 1), ox, oy);
      } else if (event.pointerType !== "touch") this.move(now[0] - before[0], now[1] - before[1]);
      pointers.set(event.pointerId, now);
    });
    for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, (event) => pointers.delete(event.pointerId));
    canvas.addEventListener("keydown", (event) => {
      const act = { "+": () => this.zoom(1.3), "=": () => this.zoom(1.3), "-": () => this.zoom(1 / 1.3), 0: () => this.seeAll() }[event.key];
      if (act) { act(); event.preventDefault(); }
    });
  }
  pictures() { return pictures(() => this.sheet.canvas, () => { this.drawn = ""; this.sheet.paint(); }, { others: [this.paths] }); }
  draw(context, width, height) {
    this.fit(width, height);
    this.drawPaths();
    context.drawImage(this.paths, 0, 0, width, height);
    if (!this.hidden.has("downlink")) this.drawBroadcasts(context);
    if (!this.hidden.has("pings") && this.mission.calls) this.drawCalls(context);
    if (!this.hidden.has("pings")) this.drawPings(context);
    if (!this.hidden.has("signals") && this.mission.signals) this.drawSignals(context);
    this.mission.asvs.forEach((_, number) => this.drawAsv(context, number));
    this.labelled = [];
    for (const number of this.mission.order ?? this.mission.auvs.keys()) this.drawAuv(context, number);
    this.overlay?.(context);
    this.drawCursor(context);
  }
  fit(width, height) {
    if (!this.view || (!this.touched && (width !== this.width || height !== this.height))) this.home(width, height);
    Object.assign(this, { width, height });
  }
  // Draws what does not move, once for each view and state.
  still(state, draw) {
    const ratio = pixelRatio(), drawn = [this.width, this.height, ratio, JSON.stringify(this.view), colours.paper, ...state].join();
    if (drawn === this.drawn) return;
    this.drawn = drawn;
    Object.assign(this.paths, { width: Math.round(this.width * ratio), height: Math.round(this.height * ratio) });
    const context = this.paths.getContext("2d");
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    draw(context);
  }
  drawPaths() {
    const { asvs, asvsRest } = this.mission, failed = asvsRest && asvs.map((_, number) => this.mission.hasFailed(number, this.now));
    this.still([...this.hidden, this.field, this.span, failed], (context) => this.drawStill(context));
  }
  drawStill(context) {
    const { auvs, asvs, asvsRest } = this.mission;
    this.drawField(context);
    this.drawGrid(context);
    if (asvsRest) asvs.forEach((_, number) => this.drawRanges(context, number));
    if (!this.hidden.has("truth")) for (const { x, y } of asvs) this.line(context, x, y, { colour: colours.ink, width: 1, alpha: 0.45 });
    if (!this.hidden.has("plan")) for (const { plan } of auvs) if (plan) this.line(context, plan.x, plan.y, { colour: colours.plan, width: 1 });
    // Of a selected interval (s) only the paths in it.
    const [from, until] = this.span ? this.span.map((time) => above(this.mission.time, time)) : [0, this.mission.time.length];
    auvs.forEach((whole, i) => {
      const auv = { ...whole, ...Object.fromEntries(["x", "y", "off_x", "off_y", "drift_x", "drift_y"].map((column) => [column, whole[column].subarray(from, until)])) };
      const colour = seriesColour(i);
      const sum = (a, b) => a.map((value, k) => value + b[k]);
      if (!this.hidden.has("imu")) this.line(context, sum(auv.x, auv.drift_x), sum(auv.y, auv.drift_y), { colour, width: 1.2, dash: [1.5, 3.5], alpha: 0.75 });
      if (!this.hidden.has("truth")) this.line(context, auv.x, auv.y, { colour, width: 4, alpha: 0.25 });
      if (!this.hidden.has("fused")) this.line(context, sum(auv.x, auv.off_x), sum(auv.y, auv.off_y), { colour, width: 1, alpha: 0.8, dash: PATH_DASHES[Math.floor(i / 8) % PATH_DASHES.length] });
    });
  }
  // The field that is chosen, cell by cell; cells without a value stay as the sea is.
  drawField(context) {
    const values = this.mission.fields?.[this.field];
    if (!values) return;
    const { box: [south, west, north, east], across } = this.mission.fields;
    const [low, high] = this.mission.fields.ends ?? fieldEnds(this.field, values), [tall, wide] = [(north - south) / across, (east - west) * across / values.length];
    const inside = this.mission.fields.chance ?? values;
    context.save();
    context.beginPath();
    this.outline(context);
    context.clip();
    context.globalAlpha = 0.6;
    values.forEach((value, i) => {
      if (!Number.isFinite(inside[i])) return; // beyond the survey
      const row = i % across, column = Math.floor(i / across);
      const [px, py] = this.at(south + (row + 1) * tall, west + column * wide).map(Math.round);
      const [qx, qy] = this.at(south + row * tall, west + (column + 1) * wide).map(Math.round);
      if (!Number.isFinite(value) || (this.field === "chance" && value < LEAST_CHANCE)) return hatch(context, px, py, qx - px, qy - py);
      context.fillStyle = `rgb(${shadeOf(high > low ? (value - low) / (high - low) : 1, this.field !== "chance")})`;
      context.fillRect(px, py, qx - px, qy - py);
    });
    context.restore();
  }
  line(context, xs, ys, { colour, width, dash = [], alpha = 1 }) {
    shape(context, { stroke: colour, width, dash, alpha, join: "round" }, () => {
      let [lastX, lastY] = [NaN, NaN];
      for (let i = 0; i < xs.length; i++) {
        const [px, py] = this.at(xs[i], ys[i]);
        if (Math.abs(px - lastX) + Math.abs(py - lastY) < 0.7) continue;
        context.lineTo(px, py);
        [lastX, lastY] = [px, py];
      }
    });
  }
  outline(context) { polygon(context, this.mission.outline.map(([x, y]) => this.at(x, y))); }
  drawGrid(context) {
    const step = roundStep(70 / this.view.scale);
    context.font = "11px system-ui, sans-serif";
    const [south, west] = this.placeAt(0, this.height), [north, east] = this.placeAt(this.width, 0);
    const text = (value) => `${+value.toPrecision(6)}`.replace("-", "−");
    for (let y = Math.ceil(west / step) * step; y < east; y += step) {
      const px = Math.round(this.at(south, y)[0]) + 0.5;
      this.stroke(context, colours.grid, px, 0, px, this.height);
      context.fillStyle = colours.soft;
      if (px > 34 && px < this.width - 84) context.fillText(text(y), px + 3, this.height - 5);
    }
    for (let x = Math.ceil(south / step) * step; x < north; x += step) {
      const py = Math.round(this.at(x, west)[1]) + 0.5;
      this.stroke(context, colours.grid, 0, py, this.width, py);
      context.fillStyle = colours.soft;
      if (py > 34 && py < this.height - 18) context.fillText(text(x), 4, py - 3);
    }
    context.fillText("east (m)", this.width - 48, this.height - 5);
    context.fillText("north (m)", 4, 13);
    this.drawBottom(context);
    shape(context, { stroke: colours.soft }, () => this.outline(context));
    this.drawClosed(context);
    this.drawScale(context, step, `${text(step)} m`);
    this.drawNorth(context);
    this.drawCurrent(context);
  }
  // Lines of equal depth, each with its depth at the middle of its longest.
  drawBottom(context) {
    for (const { depth, lines } of this.mission.contours ?? []) {
      for (const line of lines) this.line(context, line.map(([x]) => x), line.map(([, y]) => y), { colour: colours.depth, width: 1 });
      const [longest = []] = [...lines].sort((one, other) => other.length - one.length);
      if (longest.length) this.label(context, `${depth} m`, ...this.at(...longest[Math.floor(longest.length / 2)]), colours.depth);
    }
  }
  // Water where nobody goes, hatched the other way than what is unknown, and land.
  drawClosed(context) {
    const { land = [], keepOut = [] } = this.mission;
    for (const rings of keepOut) closedWater(context, 0, 0, this.width, this.height, () => this.rings(context, rings));
    for (const rings of land) shape(context, { fill: colours.land, stroke: colours.shore, width: 1.2 }, () => this.rings(context, rings));
  }
  rings(context, rings) {
    for (const ring of rings) {
      ring.forEach(([x, y], i) => context[i ? "lineTo" : "moveTo"](...this.at(x, y)));
      context.closePath();
    }
  }
  drawScale(context, length, words) {
    const [right, y, long] = [this.width - 12, this.height - 24, length * this.view.scale];
    for (const [x1, y1, x2, y2] of [[right - long, y, right, y], [right - long, y - 4, right - long, y], [right, y - 4, right, y]]) this.stroke(context, colours.ink, x1, y1, x2, y2, 1.5);
    this.label(context, words, right - long / 2 - context.measureText(words).width / 2, y - 5, colours.ink);
  }
  drawNorth(context) {
    this.arrow(context, this.width - 20, 34, 0, colours.ink);
    this.label(context, "N", this.width - 25, 17, colours.ink);
  }
  drawCurrent(context) {
    const { current } = this.mission;
    if (!current.speed) return;
    this.arrow(context, this.width - 20, 70, current.direction * Math.PI / 180, colours.hf);
    const words = `current ${significant(current.speed, 2)} m/s`;
    this.label(context, words, this.width - 8 - context.measureText(words).width, 98, colours.hf);
  }
  // An arrow of 28 px through its middle, along a heading.
  arrow(context, px, py, heading, colour) {
    context.save();
    context.translate(px, py);
    context.rotate(SeaMap.turnTo(heading));
    this.stroke(context, colour, -14, 0, 8, 0, 2);
    shape(context, { fill: colour }, () => polygon(context, [[14, 0], [5, -5], [5, 5]]));
    context.restore();
  }
  // In metres, and as latitude and longitude where the survey has a place.
  drawCursor(context) {
    if (!this.cursor) return;
    const [x, y] = this.cursor, { origin } = this.mission, digits = Math.max(Math.ceil(Math.log10(this.view.scale)), 0);
    const metres = (value) => value.toFixed(digits).replace("-", "−");
    this.label(context, `north ${metres(x)} m, east ${metres(y)} m`, 70, 14, colours.ink);
    if (!origin) return;
    const [lat, lon] = onEarth(this.cursor, origin), degrees = (value, letters) => `${Math.abs(value).toFixed(6)}° ${letters[+(value < 0)]}`;
    this.label(context, `${degrees(lat, "NS")}, ${degrees(lon, "EW")}`, 70, 30, colours.ink);
  }
  stroke(context, colour, x1, y1, x2, y2, width = 1, dash = []) {
    shape(context, { stroke: colour, width, dash }, () => {
      context.moveTo(x1, y1);
      context.lineTo(x2, y2);
    });
  }
  // Two strokes through a place of the canvas, upright (a plus) or slanted (a cross).
  plus(context, px, py, size, colour, width) {
    this.stroke(context, colour, px - size, py, px + size, py, width);
    this.stroke(context, colour, px, py - size, px, py + size, width);
  }
  slanted(context, px, py, size, colour, width) {
    this.stroke(context, colour, px - size, py - size, px + size, py + size, width);
    this.stroke(context, colour, px - size, py + size, px + size, py - size, width);
  }
  ring(context, x, y, radius, colour, { width = 1, dash = [], alpha = 1 } = {}) {
    shape(context, { stroke: colour, width, dash, alpha }, () => disc(context, ...this.at(x, y), Math.max(radius * this.view.scale, 0.1)));
  }
  // The front of a sound: a circle, less what is on or behind land.
  front(context, x, y, radius, colour, looks) {
    if (!this.mission.land?.length) return this.ring(context, x, y, radius, colour, looks);
    const ways = this.waysFrom(x, y), on = (k) => this.at(x + radius * Math.cos(k * STEP), y + radius * Math.sin(k * STEP));
    shape(context, { stroke: colour, ...looks }, () => ways.forEach((way, k) => {
      if (way < radius) return;
      if (!k || ways[k - 1] < radius) context.moveTo(...on(k - 0.5));
      context.lineTo(...on(k + 0.5));
    }));
  }
  // How far (m) sound gets from a place before land, in each direction.
  waysFrom(x, y) {
    const known = `${x} ${y}`;
    if (this.ways.size > 500) this.ways.clear();
    if (!this.ways.has(known)) {
      const rings = this.mission.land.flat().map((ring) => ring.map(([north, east]) => [north - x, east - y]));
      const way = (_, k) => rings.reduce((least, ring) => Math.min(least, wayTo(ring, Math.cos(k * STEP), Math.sin(k * STEP))), Infinity);
      this.ways.set(known, Array.from({ length: 360 }, way));
    }
    return this.ways.get(known);
  }
  drawAsv(context, number) {
    const { x, y } = this.mission.asvAt(number, this.now);
    if (this.mission.hasFailed(number, this.now)) {
      const [px, py] = this.at(x, y);
      this.cross(context, x, y, colours.ink, 1);
      this.label(context, `${this.mission.asvs[number].name} failed`, px + 9, py - 8, colours.ink);
      return;
    }
    if (!this.mission.asvsRest) this.drawRanges(context, number);
    const [px, py] = this.at(x, y);
    this.star(context, px, py);
    this.label(context, this.mission.asvs[number].name, px + 9, py - 8, colours.ink);
  }
  drawRanges(context, number) {
    if (this.mission.hasFailed(number, this.now)) return;
    const { x, y } = this.mission.asvAt(number, this.now), { seen } = this.mission.asvs[number];
    const range = (band, dash) => { // a circle, less what land hides
      if (this.hidden.has(band)) return;
      const looks = { dash, alpha: 0.8, width: 1.3 };
      if (!seen) return this.ring(context, x, y, this.mission[band].reach, colours[band], looks);
      const [north, east] = seen[band];
      shape(context, { stroke: colours[band], ...looks }, () => polygon(context, Array.from(north, (it, i) => this.at(it, east[i]))));
    };
    range("hf", [7, 4]);
    if (this.mission.broadcasting) range("mf", [2, 4]);
  }
  star(context, px, py) {
    shape(context, { fill: colours.ink }, () => polygon(context, starAt(px, py, 3.4, 8)));
  }
  label(context, text, px, py, colour) {
    context.font = "600 12px system-ui, sans-serif";
    context.lineWidth = 3;
    context.strokeStyle = colours.sea;
    context.lineJoin = "round";
    context.strokeText(text, px, py);
    context.fillStyle = colour;
    context.fillText(text, px, py);
  }
  drawAuv(context, number) {
    const state = this.mission.auvAt(number, this.now), colour = seriesColour(number);
    const [px, py] = this.at(state.x, state.y), [ex, ey] = this.at(state.estimateX, state.estimateY);
    if (!this.hidden.has("sure")) this.sure(context, state, colour);
    if (!this.hidden.has("fused")) {
      this.stroke(context, colour, px, py, ex, ey, 1);
      this.plus(context, ex, ey, 5, colour, 2);
    }
    this.hull(context, px, py, state.yaw, colour);
    const { auvs } = this.mission, { name } = auvs[number], words = auvs.length > 12 ? name.slice(3) : name;
    // A name that would cover another goes above, or is left out; the worst AUVs come first.
    const free = (y) => this.labelled.every(([left, top]) => Math.abs(left - px) > 8 * words.length + 2 || Math.abs(top - y) > 12);
    const y = [py + 15, py - 9, py + 27].find(free);
    if (y === undefined) return;
    this.labelled.push([px, y]);
    this.label(context, words, px > this.width ? px + 9 : Math.min(px + 9, this.width - 9 * words.length - 2), y, colour); // not cut at the edge
  }
  // Where an AUV believes to be with 95 %, faintly.
  sure(context, { estimateX, estimateY, spread }, colour) {
    this.ellipse(context, estimateX, estimateY, spread, SURE, colour, { fill: 0.12, alpha: 0.6, width: 1 });
  }
  // An ellipse of `scale` standard deviations; `spread` holds xx, yy, xy (m2).
  ellipse(context, x, y, [xx, yy, xy], scale, colour, { fill, alpha = 1, width = 1.5 }) {
    const middle = (xx + yy) / 2, spread = Math.hypot((xx - yy) / 2, xy), [px, py] = this.at(x, y);
    const radius = (variance) => Math.max(scale * Math.sqrt(Math.max(variance, 0)) * this.view.scale, 0.5);
    shape(context, { fill: colour, stroke: colour, width, alpha, shade: fill }, () =>
      context.ellipse(px, py, radius(middle + spread), radius(middle - spread), SeaMap.turnTo(0.5 * Math.atan2(2 * xy, xx - yy)), 0, 2 * Math.PI));
  }
  hull(context, px, py, yaw, colour) {
    context.save();
    context.translate(px, py);
    context.rotate(SeaMap.turnTo(yaw));
    shape(context, { fill: colour, stroke: colours.paper, width: 1.2 }, () => polygon(context, [[9, 0], [-6, 5], [-3, 0], [-6, -5]]));
    context.restore();
  }
  // A ping's front takes milliseconds; it is shown for `linger` seconds of mission time at least.
  drawPings(context) {
    const { pings, hf, soundSpeed, pingLength, receptions } = this.mission;
    const linger = this.linger(), crossing = hf.range / soundSpeed;
    const growing = Math.max(crossing, linger * 0.5), shown = Math.max(2.5 * growing, linger);
    const most = MOST_RINGS * (this.mission.asvsPing ? this.mission.auvs.length : 1);
    const latest = above(pings.at, this.now) - 1, first = growing > crossing ? Math.max(latest - most, -1) : -1;
    for (let i = latest; i > first && this.now - pings.at[i] < shown; i--) {
      const age = this.now - pings.at[i], share = Math.min(age / growing, 1);
      const fade = Math.max(1 - age / shown, 0);
      const colour = this.mission.colourOf(i), { asvsPing } = this.mission;
      if (!this.mission.isSent(i)) continue;
      if (this.mission.isFirst(i)) this.front(context, pings.x[i], pings.y[i], share * hf.reach, colour, { width: 2, alpha: fade });
      if (!asvsPing && this.mission.fates[pings.fate[i]] === "out_of_hf" && share === 1) this.cross(context, pings.x[i], pings.y[i], colours.soft, fade);
      for (const row of this.mission.receptionsOf[i]) { // decided when all of the ping has arrived
        const passed = receptions.at[row] - pings.at[i] + pingLength;
        if (age >= passed * growing / crossing) this.reception(context, i, row, fade);
      }
    }
  }
  // What vehicles say to each other, as it arrives; its kind stands beside who says it.
  drawSignals(context) {
    const said = new Set(), { signals, auvs, outcomes } = this.mission, linger = this.linger(), most = MOST_RINGS * (auvs.length + 1);
    const where = (vehicle, t) => vehicle < auvs.length ? this.mission.auvAt(vehicle, t) : this.mission.asvAt(vehicle - auvs.length, t);
    const latest = above(signals.at, this.now) - 1;
    for (let i = latest; i >= 0 && i > latest - most && this.now - signals.at[i] < linger; i--) {
      const outcome = outcomes[signals.outcome[i]], from = where(signals.from[i], signals.sent[i]), to = where(signals.to[i], signals.at[i]);
      if (outcome === "in_flight") continue;
      const [x1, y1] = this.at(from.x, from.y), [x2, y2] = this.at(to.x, to.y);
      const colour = outcome === "collided" ? colours.collided : signals.from[i] < auvs.length ? seriesColour(signals.from[i]) : colours.hf;
      context.save();
      context.globalAlpha = 1 - (this.now - signals.at[i]) / linger;
      this.pointed(context, colour, x1, y1, x2, y2, outcome === "heard" ? [] : [5, 4]);
      if (outcome !== "heard") this.sign(context, outcome, x1 + 0.8 * (x2 - x1), y1 + 0.8 * (y2 - y1), colour);
      if (!said.has(signals.from[i])) { // the latest of each
        said.add(signals.from[i]);
        context.fillStyle = colour;
        context.fillText(signals.kinds[signals.kind[i]], x1 + 10, y1 - 8); // above its name
      }
      context.restore();
    }
  }
  pointed(context, colour, x1, y1, x2, y2, dash = []) {
    const length = Math.hypot(x2 - x1, y2 - y1), [ux, uy] = length ? [(x2 - x1) / length, (y2 - y1) / length] : [0, 0];
    this.stroke(context, colour, x1, y1, x2 - 8 * ux, y2 - 8 * uy, 1.5, dash);
    shape(context, { fill: colour }, () => polygon(context, [[x2, y2], ...[-1, 1].map((side) => [x2 - 9 * ux - 4 * side * uy, y2 - 9 * uy + 4 * side * ux])]));
  }
  // A call of an ASV, which an AUV answers by its ping (twtt, polling).
  drawCalls(context) {
    const { pings, hf, soundSpeed } = this.mission, linger = this.linger();
    const growing = Math.max(hf.range / soundSpeed, linger * 0.5), shown = Math.max(2.5 * growing, linger);
    const latest = above(pings.called, this.now) - 1, first = Math.max(latest - MOST_RINGS, -1);
    for (let i = latest; i > first; i--) {
      const age = this.now - pings.called[i], fade = Math.max(1 - age / shown, 0), { x, y } = this.mission.asvAt(pings.caller[i], pings.called[i]);
      if (fade) this.front(context, x, y, Math.min(age / growing, 1) * hf.reach, colours.hf, { width: 1.5, dash: [3, 3], alpha: fade });
    }
  }
  reception(context, ping, row, fade) {
    const { pings, receptions, outcomes } = this.mission;
    const outcome = outcomes[receptions.outcome[row]];
    if (outcome === "in_flight") return;
    const colour = outcome === "collided" ? colours.collided : seriesColour(pings.auv[ping]);
    const hearer = this.mission.hearerAt(row);
    const [x1, y1] = this.at(pings.x[ping], pings.y[ping]), [x2, y2] = this.at(hearer.x, hearer.y);
    context.save();
    context.globalAlpha = fade;
    this.stroke(context, colour, x1, y1, x2, y2, outcome === "heard" ? 2 : 2.5, outcome === "heard" ? [] : [5, 4]);
    if (outcome !== "heard") this.sign(context, outcome, x1 + 0.8 * (x2 - x1), y1 + 0.8 * (y2 - y1), colour);
    context.restore();
  }
  sign(context, outcome, px, py, colour) {
    if (outcome === "collided") this.slanted(context, px, py, 6, colour, 3);
    else shape(context, { fill: colours.sea, stroke: colour, width: 2 }, () => disc(context, px, py, 5));
  }
  cross(context, x, y, colour, fade) {
    context.save();
    context.globalAlpha = fade;
    this.slanted(context, ...this.at(x, y), 4, colour, 1.5);
    context.restore();
  }
  wayDown(context, from, auv, fade) {
    const [x1, y1] = this.at(from.x, from.y), [x2, y2] = this.at(auv.x, auv.y);
    context.save();
    context.globalAlpha = fade;
    this.stroke(context, colours.mf, x1, y1, x2, y2, 2, [1, 4]);
    context.restore();
  }
  drawBroadcasts(context) {
    const { broadcasts, fixes, mf } = this.mission;
    const linger = this.linger(), growing = Math.max(mf.range / this.mission.soundSpeed, 0.5 * linger);
    const latest = above(broadcasts.at, this.now) - 1, rings = MOST_RINGS * this.mission.asvs.length;
    for (let i = latest; i >= 0 && i > latest - rings; i--) {
      const age = this.now - broadcasts.at[i], shown = Math.max(broadcasts.airtime[i], linger);
      if (age > shown) continue; // of several at once some are shorter
      const { x, y } = this.mission.asvAt(broadcasts.asv[i], this.now);
      this.front(context, x, y, Math.min(age / growing, 1) * mf.reach, colours.mf, { width: 2.5, alpha: 0.9 * (1 - age / shown) });
    }
    const { deliveredOrder: order, deliveredTimes: times } = this.mission;
    const last = above(times, this.now) - 1, most = MOST_RINGS * this.mission.auvs.length;
    for (let i = last; i >= 0 && i > last - most && this.now - times[i] < linger; i--) {
      const row = order[i], fade = 1 - (this.now - times[i]) / linger;
      const auv = this.mission.auvAt(fixes.auv[row], times[i]);
      if (!this.mission.asvsPing) this.wayDown(context, this.mission.asvAt(fixes.by[row], times[i]), auv, fade);
      this.ring(context, auv.x, auv.y, 14 / this.view.scale, colours.mf, { width: 2.5, alpha: fade });
    }
  }
}

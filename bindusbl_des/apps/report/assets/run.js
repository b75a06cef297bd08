"use strict";
// The page of one run: data in, map and plots out.

// Each AUV now; a click on one follows it.
class StateTable {
  constructor(mission, follow) {
    this.mission = mission;
    this.rows = mission.auvs.map((auv, i) => {
      const cells = ["", "", ""].map(() => make("td")), dot = make("span", { class: "swatch" });
      const name = make("button", { type: "button", class: "plain", "aria-pressed": "false", title: `Follow ${auv.name}` }, dot, auv.name);
      name.addEventListener("click", () => follow(i));
      const paint = () => { dot.style.background = seriesColour(i); };
      onTheme(paint);
      paint();
      return { row: make("tr", {}, make("th", { scope: "row" }, name), ...cells), name, cells };
    });
    const heads = ["now", "error, m", "last fix, ago", "fixes"].map((text) => make("th", { scope: "col" }, text));
    byId("now").append(make("table", {}, make("thead", {}, make("tr", {}, ...heads)), make("tbody", {}, ...mission.order.map((i) => this.rows[i].row))));
  }
  show(now, playing) {
    if (playing && performance.now() - this.shownAt < 100) return; // nobody reads faster
    this.shownAt = performance.now();
    this.rows.forEach(({ cells }, i) => {
      const state = this.mission.auvAt(i, now);
      [state.error.toFixed(2), state.fixes ? timed(state.sinceFix) : "none yet", `${state.fixes}`].forEach((text, k) => { cells[k].textContent = text; });
    });
  }
  follow(number) {
    this.rows.forEach(({ row, name }, i) => {
      row.classList.toggle("followed", i === number);
      name.setAttribute("aria-pressed", i === number);
    });
    const host = byId("now"), { row } = this.rows[number];
    const below = row.offsetTop - row.closest("table").tHead.offsetHeight - host.scrollTop; // its head stays
    if (below < 0 || row.offsetTop + row.offsetHeight > host.scrollTop + host.clientHeight) host.scrollTop += below;
  }
}

// Above the slider: when each AUV was without fixes, a line for each.
function gapStrip(mission) {
  const canvas = byId("gaps"), lines = mission.auvs.length;
  canvas.style.height = `${clamp(4 * lines, 6, 60)}px`;
  new Sheet(canvas, (context, width, height) => {
    const inset = 8, x = (time) => inset + time / mission.duration * (width - 2 * inset), each = height / lines;
    mission.order.forEach((i, line) => {
      context.fillStyle = colours.grid;
      context.fillRect(inset, line * each, width - 2 * inset, Math.max(each - 1, 0.5));
      context.fillStyle = seriesColour(i);
      for (const [start, end] of mission.auvs[i].gaps) context.fillRect(x(start), line * each, Math.max(x(end) - x(start), 1), Math.max(each - 1, 0.5));
    });
  });
  canvas.title = "Times without fixes, a line for each AUV, the worst first";
  canvas.hidden = mission.auvs.every((auv) => !auv.gaps.length);
}

// The choice of what the survey is shaded by, and what the colours mean.
function shading(map) {
  const { fields } = map.mission, select = byId("field"), scale = byId("field-scale");
  if (!fields) return select.closest("label").remove();
  select.append(make("option", { value: "" }, "nothing"));
  for (const [field, [words]] of Object.entries(FIELDS)) if (fields[field]) select.append(make("option", { value: field }, words));
  select.addEventListener("change", () => {
    map.field = select.value;
    map.sheet.paint();
    if (!map.field) return scale.replaceChildren();
    const [, words, told] = FIELDS[map.field], [low, high] = fieldEnds(map.field, fields[map.field]);
    const none = fields[map.field].every(Number.isFinite) ? "" : "; hatched where no fix is to be expected";
    scale.replaceChildren(make("span", {}, `${words}; dark is bad${none}`), ramp(told(low), map.field === "chance" ? told(high) : `${told(high)} or more`, map.field !== "chance"));
  });
}

function legend(map, closeup) {
  const host = byId("marks"), { mission } = map, { fates, pings, receptions, outcomes } = mission;
  const became = (fate) => pings.fate.some((it) => fates[it] === fate), met = (outcome) => receptions.outcome.some((it) => outcomes[it] === outcome);
  const there = { heard: met("heard"), lost: met("lost"), collided: met("collided"), cross: !mission.asvsPing && became("out_of_hf"), ring: mission.deliveredOrder.length, gap: mission.auvs.some(({ gaps }) => gaps.length), failed: mission.asvs.some(({ failures }) => failures.length), call: mission.calls, land: Boolean(mission.land?.length), keepOut: Boolean(mission.keepOut?.length), star: mission.asvs.length > 0 };
  const nobody = mission.discs.hf ? "no ASV in range" : "beyond what the channel lets through to any ASV";
  const add = (mark, words, ...before) => {
    const sample = make("canvas", { "aria-hidden": "true" });
    host.append(make("label", {}, ...before, sample, words));
    new Sheet(sample, (context, width, height) => legendMark(context, mark, width, height));
  };
  for (const [layer, words] of layersOf(mission)) {
    const box = make("input", { type: "checkbox", checked: "" });
    box.addEventListener("change", () => { map.hidden[box.checked ? "delete" : "add"](layer); map.sheet.paint(); closeup.map.sheet.paint(); });
    add(layer, words, box);
  }
  for (const [mark, words] of [["land", "land"], ["keepOut", "nobody goes here"], ["star", "ASV"], ["hull", "AUV, at its true position"], ["plus", "its estimate"], ["heard", "decoded, in the AUV's colour"], ["lost", "lost"], ["collided", "collided"], ["cross", nobody], ["ring", "fix delivered"], ["call", "call of an ASV, which an AUV answers by a ping"], ["failed", "ASV that failed"], ["gap", "bar over the slider: time without fixes"]].filter(([mark]) => there[mark] ?? true)) add(mark, words);
}

function legendMark(context, mark, width, height) {
  const y = height / 2, x = width / 2, map = SeaMap.prototype, colour = colours.series[0];
  const line = (of, thick, dash, alpha = 1) => { context.globalAlpha = alpha; map.stroke(context, of, 2, y, width - 2, y, thick, dash); context.globalAlpha = 1; };
  const ring = (of, radius, dash) => shape(context, { stroke: of, width: 2, dash }, () => disc(context, x, y, radius));
  const oval = (of) => shape(context, { fill: of, shade: 0.12, stroke: of, alpha: 0.6 }, () => context.ellipse(x, y, 11, 5.5, 0, 0, 2 * Math.PI));
  const marks = {
    plan: () => line(colours.plan, 1), truth: () => line(colour, 5, [], 0.3), fused: () => line(colour, 1.3), sure: () => oval(colour), imu: () => line(colour, 1.5, [1.5, 3.5]),
    hf: () => line(colours.hf, 1.5, [7, 4]), mf: () => line(colours.mf, 1.5, [2, 4]), pings: () => ring(colour, 6), signals: () => map.pointed(context, colour, 2, y, width - 2, y), downlink: () => ring(colours.mf, 6, [2, 2]),
    star: () => map.star(context, x, y), hull: () => map.hull(context, x, y, Math.PI / 2, colour),
    plus: () => map.plus(context, x, y, 5, colour, 2),
    land: () => shape(context, { fill: colours.land, stroke: colours.shore, width: 1.2 }, () => context.rect(3, 2, width - 6, height - 4)),
    keepOut: () => closedWater(context, 0, 0, width, height, () => context.rect(3, 2, width - 6, height - 4)),
    heard: () => line(colour, 2), lost: () => { line(colour, 2.5, [5, 4]); map.sign(context, "lost", x, y, colour); },
    collided: () => { line(colours.collided, 2.5, [5, 4]); map.sign(context, "collided", x, y, colours.collided); },
    failed: () => marks.cross(), cross: () => map.slanted(context, x, y, 4, colours.soft, 1.5),
    call: () => ring(colours.hf, 6, [3, 3]), ring: () => ring(colours.mf, 6), gap: () => { context.fillStyle = colour; context.fillRect(4, y - 3, width - 8, 6); },
  };
  marks[mark]();
}

function followed(mission, closeup, playback) {
  const select = byId("follow");
  mission.auvs.forEach((auv, i) => select.append(make("option", { value: i }, auv.name)));
  const follow = (number) => {
    closeup.auv = number;
    select.value = number;
    states.follow(number);
    byId("closeup-caption").textContent = `Close-up of ${mission.auvs[number].name}: hull truth, + estimate with its 95 % ellipse, ✕ last fix with its 3σ ellipse, dashed circle 3σ envelope.`;
    closeup.paint(playback.now);
  };
  const chosen = (number) => { follow(number); announce(`Following ${mission.auvs[number].name}`); };
  const states = new StateTable(mission, chosen);
  states.choose = chosen;
  follow(mission.order[0]);
  select.addEventListener("change", () => chosen(+select.value));
  document.querySelectorAll("[data-seek]").forEach((link) => link.addEventListener("click", (event) => {
    event.preventDefault();
    follow(+link.dataset.auv);
    playback.play(false);
    playback.seek(+link.dataset.seek);
    byId("playback").scrollIntoView({ behavior: calm() ? "auto" : "smooth" });
    byId("slider").focus({ preventScroll: true });
  }));
  return states;
}

async function start() {
  startTheme();
  const mission = new Mission(unpackAll(readData(), await unpacker()));
  const playback = new Playback(mission), map = new SeaMap(byId("map"), mission), closeup = new Closeup(byId("closeup"), mission, map.hidden);
  map.linger = () => playback.linger();
  const log = new Log(byId("log"), mission), states = followed(mission, closeup, playback);
  playback.onChange((now) => { map.now = now; map.sheet.show(playback.playing); closeup.paint(now, playback.playing); states.show(now, playback.playing); log.show(now); });
  playback.onSelect((span) => {
    map.span = log.span = span;
    log.list.classList.toggle("selected", Boolean(span));
    announce(span ? `Selected ${instant(span[0]).replace(/ s$/, "")} to ${aloud(span[1])}` : "All of the mission");
  });
  byId("all").addEventListener("click", () => { map.touched = false; map.seeAll(); });
  byId("speed").addEventListener("change", () => slowed(playback));
  byId("map").nextElementSibling.append(saving("map", map.pictures()));
  byId("closeup-caption").after(saving("close-up", closeup.map.pictures()));
  gapStrip(mission);
  legend(map, closeup);
  shading(map);
  errorPlots(mission, playback);
  fixesPlot(mission, playback);
  coveredPlot(mission, playback);
  fateBars(mission);
  histograms(mission);
  new Timeline(byId("timeline"), mission, playback);
  slowed(playback);
  mission.log = log;
  const inspector = new Inspector({ mission, playback, map, follow: states.choose });
  playback.inspect = (id) => inspector.show(id, { seek: false });
  if (!inspector.read()) playback.seek(0);
  Object.assign(bindusbl, {
    ready: true, mission, playback, map, closeup, log, inspector,
    vehicles: () => mission.auvs.map((auv, i) => ({ name: auv.name, ...mission.auvAt(i, playback.now) })),
  });
}

function slowed(playback) {
  byId("visible-note").textContent = playback.speed > 0.02
    ? "At this speed sound would cross the map unseen: fronts and receptions are held long enough to be seen. At 0.01 × they move as fast as they do."
    : "";
}

bindusbl.opened = start();

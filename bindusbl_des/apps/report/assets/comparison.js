"use strict";
// Several runs at the same mission time: their maps beside each other, their errors in one plot.

// One run alone keeps the time; the page's clock ends with the longest of them.
const sharedClock = (missions) => new Playback(missions.reduce((a, b) => (b.duration > a.duration ? b : a)));

// Another run on the map of this one: where its AUVs are and were the last minute, as they believed.
function ghost(map, other, caption) {
  if (!other) return;
  const box = make("input", { type: "checkbox", checked: "" });
  box.addEventListener("change", () => map.sheet.paint());
  caption.append(" ", make("label", { class: "on-screen" }, box, `with the ghost of ${other.name}`));
  map.overlay = (context) => {
    if (!box.checked) return;
    const now = Math.min(map.now, other.duration), end = above(other.time, now), start = above(other.time, now - 60);
    other.auvs.forEach((auv, number) => {
      const along = (column, off) => Array.from(auv[column].subarray(start, end), (value, i) => value + auv[off][start + i]);
      map.line(context, along("x", "off_x"), along("y", "off_y"), { colour: colours.soft, width: 1.5, dash: [2, 3] });
      const { estimateX, estimateY, yaw } = other.auvAt(number, now);
      context.globalAlpha = 0.5;
      map.hull(context, ...map.at(estimateX, estimateY), yaw, colours.soft);
      context.globalAlpha = 1;
    });
  };
}

function maps(missions, playback) {
  const host = byId("maps");
  return missions.map((mission, run) => {
    const canvas = make("canvas", { class: "map", tabindex: "0", role: "img", "aria-label": `Map of ${mission.name}` });
    const caption = make("figcaption", {}, mission.name), map = new SeaMap(canvas, mission);
    host.append(make("figure", {}, caption, canvas));
    caption.append(saving(`map ${mission.name.split(":")[0]}`, map.pictures()));
    ghost(map, missions[run ? 0 : 1], caption);
    map.linger = () => playback.linger(mission);
    playback.onChange((now) => { map.now = Math.min(now, mission.duration); map.sheet.show(playback.playing); });
    playback.onSelect((span) => { map.span = span; });
    return map;
  });
}

// The AUV that is the worst of a run: with the largest error, mean over time.
const WORST = -2;
function worstOf(mission) {
  const errors = mission.auvs.map((auv) => mean(Array.from(auv.error).filter(Number.isFinite)));
  return errors.reduce((worst, error, i) => (error > errors[worst] ? i : worst), 0);
}

// One AUV's own error, the worst one's, or the mean over the AUVs (number -1).
function errorOf(mission, number) {
  if (number === WORST) return mission.auvs[worstOf(mission)].error;
  if (number >= 0) return mission.auvs[number].error;
  return mission.time.map((_, k) => mean(mission.auvs.map((auv) => auv.error[k])));
}

// Runs are told apart by greys and dashes: hues belong to AUVs.
const runLook = (i) => ({ stroke: i % 2 ? colours.hf : colours.ink, dash: DASHES[Math.floor(i / 2) % DASHES.length], width: i % 2 ? 2.5 : 1.8 });

function overTime(name, host, missions, table, unit, playback, stepped) {
  const lines = () => missions.map((mission, i) => ({
    label: mission.name, ...runLook(i), spanGaps: true, points: { show: false },
    paths: stepped ? uPlot.paths.stepped({ align: 1 }) : undefined, value: told((v) => `${v.toFixed(unit ? 2 : 0)} ${unit}`),
  }));
  const plot = timePlot(playback, name, host, "", uPlot.join(table()), lines, () => ({
    height: 280, legend: { markers: { width: 2, dash: (u, i) => ["solid", "dashed", "dotted"][Math.floor((i - 1) / 2)] ?? "double" } },
    axes: [axis(timeWords(), timeAxis()), axis(unit ? `error (${unit})` : "fixes, all AUVs", { size: 52 })],
  }));
  return { again: () => plot.set(uPlot.join(table())) };
}

// By how much the second run's error is above the first's, at the instants of the first.
function differences([a, b], number) {
  const known = number < Math.min(a.auvs.length, b.auvs.length);
  if (!known) return [[0], [null]];
  const [one, other] = [errorOf(a, number), errorOf(b, number)], last = b.time[b.time.length - 1];
  return [a.time, Array.from(a.time, (time, i) => {
    if (time > last) return null;
    const [k, share, next] = b.place(time);
    return other[k] + share * (other[next] - other[k]) - one[i];
  })];
}

function differenceOf(missions, whose, playback) {
  if (missions.length !== 2) return null;
  byId("difference-title").hidden = false;
  const lines = () => [{ label: "error of B − error of A", stroke: colours.ink, fill: colours.ink + "22", width: 1.5, points: { show: false }, value: metres }];
  return timePlot(playback, "difference", byId("difference-plot"), "Error of run B less that of run A over time", differences(missions, +whose.value), lines, () => ({
    height: 200, scales: { y: { range: (u, low, high) => (low === 0 && high === 0 ? [-1, 1] : uPlot.rangeNum(low, high, 0.1, true)) } },
    axes: [axis(timeWords(), timeAxis()), axis("B − A (m)", { size: 52 })],
  }));
}

async function start() {
  startTheme();
  const missions = unpackAll(readData(), await unpacker()).runs.map((run) => new Mission(run));
  const playback = sharedClock(missions), shown = maps(missions, playback), whose = byId("whose");
  const most = missions.reduce((a, b) => (b.auvs.length > a.auvs.length ? b : a));
  const worst = missions.map((mission) => mission.auvs[worstOf(mission)].name).join(", ");
  whose.append(make("option", { value: WORST }, `the worst AUV of each run (${worst})`), make("option", { value: -1 }, "all AUVs (mean)"));
  most.auvs.forEach((auv, i) => whose.append(make("option", { value: i }, auv.name)));
  const errors = overTime("errors", byId("error-plot"), missions, () => missions.map((mission) => {
    const number = +whose.value;
    return number < mission.auvs.length ? [mission.time, errorOf(mission, number)] : [[0], [null]];
  }), "m", playback, false);
  const difference = differenceOf(missions, whose, playback);
  whose.addEventListener("change", () => { errors.again(); difference?.set(differences(missions, +whose.value)); });
  overTime("fixes", byId("fixes-plot"), missions, () => missions.map((mission) => {
    const times = mission.deliveredTimes;
    const firsts = Array.from(times).filter((time, i) => time !== times[i + 1]); // a time stands once
    return [[0, ...firsts, mission.duration], [0, ...firsts.map((time) => above(times, time)), times.length]];
  }), "", playback, true);
  playback.onSelect((span) => announce(span ? `Selected ${instant(span[0]).replace(/ s$/, "")} to ${aloud(span[1])}` : "All of the missions"));
  playback.seek(0);
  Object.assign(bindusbl, { ready: true, missions, playback, maps: shown });
}
bindusbl.opened = start();

// A mission played on the chart: truth, belief and fixes of each AUV, vessels where they were. What was when, and its
// clock, are those of a mission's page (mission.js, playback.js).

import { at } from "./chart.js";

// So long (s) a trail is at least, and as many seconds of the clock on the wall; of so many points at most.
const TRAIL_S = 60, TRAIL_WALL_S = 5, MOST_POINTS = 300;
// How often (ms) words are renewed.
const WORDS_MS = 200;

export class Playing {
  constructor(bench) {
    Object.assign(this, { bench, host: byId("playback"), layer: L.layerGroup(), ends: null });
    bench.on("desk", () => this.close()); // another scenario, other places
  }
  async open(job, seed, words) {
    const answer = await fetch(`play/${job}/${seed}`).catch(() => null);
    if (!answer?.ok) return this.bench.say((await answer?.text()) ?? "The workbench does not answer.", true);
    const { data, packed } = await answer.json();
    const mission = new Mission(unpackAll(data, await unpacker(packed)));
    this.close();
    this.ends = new AbortController();
    this.controls(`${words}, seed ${seed}`, () => this.bench.open(`pages/${job}/${seed}#playback`, `${words}, seed ${seed}`));
    this.draw(mission);
    this.clock = bindusbl.playback = new Playback(mission, this.ends.signal);
    this.log = new Log(byId("log"), mission);
    this.clock.onChange((now) => this.show(mission, now));
    this.clock.seek(0);
    byId("play").focus();
    this.clock.play(!calm());
  }
  close() {
    if (this.clock) this.clock.playing = false;
    this.ends?.abort();
    this.clock = null;
    this.host.hidden = true;
    this.layer.clearLayers().remove();
    byId("sea").classList.remove("playing");
  }
  controls(title, page) {
    const button = (id, words, more = {}) => make("button", { type: "button", id, ...more }, words);
    const leave = button("play-end", "back to drawing"), alone = button("play-page", "why? its page");
    leave.addEventListener("click", () => this.close());
    alone.addEventListener("click", page);
    this.host.replaceChildren(
      make("div", { class: "tools" }, make("strong", {}, title), leave, alone),
      make("div", { class: "tools", role: "group", "aria-label": "Playback" }, button("play", "▶", { "aria-label": "Play", title: "Play or pause (space)" }), make("label", {}, "speed ", make("select", { id: "speed" })),
        button("previous", "◀", { "aria-label": "Step back" }), button("next", "▶", { "aria-label": "Step forward" }), button("next-fix", "next fix"), button("next-lost", "next lost ping"), make("span", { id: "clock" }, "0.0 s")),
      make("input", { id: "slider", type: "range", min: 0, step: "any", value: 0, "aria-label": "Mission time in seconds" }),
      make("p", { id: "now" }), make("ol", { id: "log" }),
    );
    this.host.hidden = false;
  }
  draw(mission) {
    const { map } = this.bench.chart, how = { interactive: false, pmIgnore: true, renderer: this.canvas ??= L.canvas({ padding: 0.3 }) };
    byId("sea").classList.add("playing");
    this.layer.addTo(map);
    const put = (it) => it.addTo(this.layer);
    const name = (words, color) => put(L.marker([0, 0], { icon: L.divIcon({ className: "auv-name", html: make("span", { style: `color:${color}` }, words), iconSize: [0, 0], iconAnchor: [-8, 14] }), interactive: false, keyboard: false, pmIgnore: true }));
    this.auvs = mission.auvs.map((auv, number) => {
      const color = seriesColour(number);
      return {
        truth: put(L.polyline([], { ...how, color, weight: 2.5 })), belief: put(L.polyline([], { ...how, color, weight: 1.3, dashArray: "4 4" })),
        is: put(L.circleMarker([0, 0], { ...how, color, fillColor: color, fillOpacity: 1, radius: 5 })), thinks: put(L.circleMarker([0, 0], { ...how, color, fill: false, weight: 1.5, radius: 6 })), name: name(auv.name, color),
      };
    });
    this.asvs = mission.asvs.map((asv) => ({ ring: put(L.circle([0, 0], { ...how, radius: mission.hf.reach, color: colours.ink, weight: 1.2, dashArray: "7 4", fill: false })), is: put(L.circleMarker([0, 0], { ...how, color: colours.ink, fillColor: colours.paper, fillOpacity: 1, radius: 7 })), name: name(asv.name, colours.ink) }));
    this.told = 0;
  }
  show(mission, now) {
    const from = Math.max(now - Math.max(TRAIL_S, TRAIL_WALL_S * this.clock.speed), 0), step = Math.max((now - from) / MOST_POINTS, 1 / mission.rate), flash = this.clock.linger();
    const instants = [];
    for (let t = from; t < now; t += step) instants.push(t);
    instants.push(now);
    const states = this.auvs.map((drawn, number) => {
      const ways = instants.map((t) => mission.auvAt(number, t)), state = ways[ways.length - 1];
      drawn.truth.setLatLngs(ways.map(({ x, y }) => at([x, y])));
      drawn.belief.setLatLngs(ways.map(({ estimateX, estimateY }) => at([estimateX, estimateY])));
      drawn.is.setLatLng(at([state.x, state.y])).setRadius(state.fix !== null && state.sinceFix < flash ? 8 : 5);
      drawn.thinks.setLatLng(at([state.estimateX, state.estimateY]));
      drawn.name.setLatLng(at([state.x, state.y]));
      return state;
    });
    this.asvs.forEach((drawn, number) => {
      const { x, y } = mission.asvAt(number, now), where = at([x, y]), works = !mission.hasFailed(number, now);
      drawn.is.setLatLng(where).setStyle({ opacity: works ? 1 : 0.3 });
      drawn.ring.setLatLng(where).setStyle({ opacity: works ? 1 : 0 });
      drawn.name.setLatLng(where);
    });
    const wall = performance.now();
    if (this.clock.playing && wall - this.told < WORDS_MS) return;
    this.told = wall;
    this.log.show(now);
    byId("now").replaceChildren(...states.map((state, number) => make("span", { style: `color:${seriesColour(number)}` }, `${mission.auvs[number].name} is ${significant(state.error)} m off, ${state.fix === null ? "no fix yet" : `fix ${instant(state.sinceFix)} ago`}`)));
  }
}

"use strict";
// What became of one ping, beside the map, in the words of `explain` as far as the page's tables go;
// its address (#t=92.4&ping=198) is kept by reload and by the back button.

const WORDS = { heard: "decodes it", lost: "loses it", collided: "hears pings mixed", in_flight: "would hear it, but the mission ends" };

class Inspector {
  constructor({ mission, playback, map, follow }) {
    Object.assign(this, { mission, playback, map, follow, ping: null, rowOf: new Map() });
    mission.pings.id.forEach((id, row) => this.rowOf.has(id) || this.rowOf.set(id, row));
    this.host = byId("inspector");
    map.overlay = (context) => this.draw(context);
    map.sheet.canvas.addEventListener("click", (event) => this.pick(event.offsetX, event.offsetY));
    byId("log").addEventListener("click", (event) => { const at = event.target.closest("[data-ping]"); if (at) this.show(+at.dataset.ping, { seek: false }); });
    addEventListener("hashchange", () => this.read());
    playback.paused = () => this.write();
  }
  // A ping's mark, a vehicle or a fix under the cursor; of several the nearest.
  pick(px, py) {
    const { mission, map, playback } = this, { pings, fixes } = mission, now = playback.now, found = [];
    const near = ([x, y], act) => { const away = Math.hypot(x - px, y - py); if (away < 16) found.push([away, act]); };
    const last = (auv) => { let row = above(pings.at, now) - 1; while (row >= 0 && pings.auv[row] !== auv) row--; return row; };
    mission.auvs.forEach((_, auv) => {
      const state = mission.auvAt(auv, now);
      near(map.at(state.x, state.y), () => { this.follow(auv); const row = last(auv); if (row >= 0) this.show(pings.id[row], { seek: false }); });
      if (state.fix !== null) near(map.at(fixes.x[state.fix], fixes.y[state.fix]), () => this.show(fixes.ping[state.fix], { seek: false }));
    });
    const linger = playback.linger();
    for (let row = above(pings.at, now) - 1; row >= 0 && now - pings.at[row] < linger; row--) near(map.at(pings.x[row], pings.y[row]), () => this.show(pings.id[row], { seek: false }));
    const { broadcasts } = mission;
    mission.asvs.forEach((_, asv) => {
      const place = mission.asvAt(asv, now);
      near(map.at(place.x, place.y), () => { // the last frame of this ASV: its first fix
        for (let row = above(broadcasts.at, now) - 1; row >= 0; row--) {
          const first = broadcasts.asv[row] === asv ? fixes.broadcast.findIndex((at, fix) => at === broadcasts.at[row] && fixes.by[fix] === asv) : -1;
          if (first >= 0) return this.show(fixes.ping[first], { seek: false });
        }
      });
    });
    found.sort((a, b) => a[0] - b[0])[0]?.[1]();
  }
  show(id, { seek = true, write = true } = {}) {
    const row = this.rowOf.get(id), { pings } = this.mission;
    if (row === undefined) return;
    this.ping = row;
    if (seek) { this.playback.play(false); this.playback.seek(Number.isFinite(this.mission.decided[row]) ? this.mission.decided[row] + 1e-4 : pings.at[row]); }
    if (write) this.write(true);
    this.tell();
    this.map.sheet.paint();
  }
  close() {
    this.ping = null;
    this.host.hidden = true;
    this.write(true);
    this.map.sheet.paint();
  }
  fixesOf(row) {
    const { fixes, pings } = this.mission;
    return Array.from(fixes.ping.keys()).filter((fix) => fixes.ping[fix] === pings.id[row] && (!this.mission.asvsPing || fixes.auv[fix] === pings.auv[row]));
  }
  // Steps [time (s), words], as `explain` orders them.
  steps(row) {
    const { mission } = this, { pings, receptions, fixes, broadcasts, outcomes, auvs, asvs } = mission;
    const sender = mission.asvsPing ? asvs[pings.asv[row]].name : auvs[pings.auv[row]].name, steps = [];
    if (mission.calls) steps.push([pings.called[row], `${asvs[pings.caller[row]].name} calls ${sender}${mission.isSent(row) ? "" : ", and has no answer"}`]);
    if (!mission.isSent(row)) return steps;
    steps.push([pings.at[row], `${sender} pings at x ${pings.x[row].toFixed(1)}, y ${pings.y[row].toFixed(1)}`]);
    const met = new Set();
    for (const at of mission.receptionsOf[row]) {
      const hearer = mission.asvsPing ? auvs[pings.auv[row]].name : asvs[receptions.asv[at]].name;
      met.add(receptions.asv[at]);
      steps.push([receptions.at[at], `${hearer} ${WORDS[outcomes[receptions.outcome[at]]]} (${(1e3 * (receptions.at[at] - pings.at[row])).toFixed(1)} ms)`]);
    }
    if (!mission.asvsPing) asvs.forEach(({ name }, asv) => {
      if (met.has(asv)) return;
      const { x, y } = mission.asvAt(asv, pings.at[row]), away = Math.hypot(x - pings.x[row], y - pings.y[row]);
      steps.push([pings.at[row] + away / mission.soundSpeed, mission.hasFailed(asv, pings.at[row]) ? `${name} hears nothing: it had failed` : `${name} is too far away (${away.toFixed(1)} m seen from above)`]);
    });
    for (const fix of this.fixesOf(row)) {
      const made = Math.min(Number.isFinite(fixes.broadcast[fix]) ? fixes.broadcast[fix] : Infinity, Math.max(...steps.map(([at]) => at)));
      steps.push([made, `Fix ${fix} is made: x ${withHalf(fixes.x[fix], fixes.sd_x[fix]).join(" ± ")}, y ${withHalf(fixes.y[fix], fixes.sd_y[fix]).join(" ± ")} m`]);
      const frame = broadcasts.at.findIndex((at, i) => Math.abs(at - fixes.broadcast[fix]) < 1e-6 && broadcasts.asv[i] === fixes.by[fix]);
      if (Number.isFinite(fixes.broadcast[fix]) && fixes.by[fix] >= 0 && !mission.asvsPing) {
        const told = frame < 0 ? "answers it" : `broadcasts ${broadcasts.fixes[frame] === 1 ? "the fix alone" : `it among ${broadcasts.fixes[frame]} fixes`}, ${broadcasts.airtime[frame].toFixed(4)} s on the air`;
        steps.push([fixes.broadcast[fix], `${asvs[fixes.by[fix]].name} ${told}`]);
      }
      if (fixes.outcome[fix] === 0) {
        const moved = Number.isFinite(fixes.correction[fix]) ? `; it moves the estimate by ${fixes.correction[fix].toFixed(2)} m` : "";
        steps.push([fixes.delivered[fix], `${auvs[fixes.auv[fix]].name} has it ${fixes.latency[fix].toFixed(4)} s after its ping${moved}`]);
      } else if (Number.isFinite(fixes.broadcast[fix])) steps.push([fixes.broadcast[fix], `Fix ${fix} is never delivered: ${this.mission.log.became.get(row) ?? "it is under way as the mission ends"}`]);
    }
    return steps.sort((a, b) => a[0] - b[0]);
  }
  head(row) {
    const { mission } = this, { pings, fates, fixes } = mission, [fix] = this.fixesOf(row), whose = mission.log.whose(row);
    if (fix !== undefined && fixes.outcome[fix] === 0) return `${whose}: fix ${fix}, delivered ${fixes.latency[fix].toFixed(4)} s after the ping.`;
    return `${whose}: ${mission.log.became.get(row) ?? fates[pings.fate[row]].replaceAll("_", " ")}.`;
  }
  tell() {
    const { mission, ping: row } = this, { pings } = mission, own = Array.from(pings.auv.keys()).filter((it) => pings.auv[it] === pings.auv[row]), at = own.indexOf(row);
    const button = (words, to, name) => { const it = make("button", { type: "button", "aria-label": name }, words); it.disabled = to === undefined; it.addEventListener("click", () => this.show(pings.id[to])); return it; };
    const shut = make("button", { type: "button", "aria-label": "Close" }, "✕");
    shut.addEventListener("click", () => this.close());
    this.host.hidden = false;
    this.host.replaceChildren(
      make("div", { class: "controls" }, make("strong", {}, this.head(row)), button("◀︎", own[at - 1], "Its ping before"), button("▶︎", own[at + 1], "Its next ping"), shut),
      make("ol", {}, ...this.steps(row).map(([time, words]) => make("li", {}, `${instant(time, 4)}  ${words}`))),
      make("p", { class: "note" }, "Every rule that decided it: ", make("code", {}, `bindusbl-des explain . --ping ${pings.id[row]}`), " in this folder."),
    );
    announce(this.head(row));
  }
  // The ways of its sound and of its fix, for as long as it is looked at.
  draw(context) {
    const { mission, map, ping: row } = this;
    if (row === null || map.hidden.has("pings") || !mission.isSent(row)) return;
    const { pings, receptions, fixes, outcomes } = mission;
    map.ring(context, pings.x[row], pings.y[row], 9 / map.view.scale, colours.ink, { width: 2 });
    for (const at of mission.receptionsOf[row]) if (outcomes[receptions.outcome[at]] !== "in_flight") map.reception(context, row, at, 1);
    for (const fix of this.fixesOf(row)) {
      if (!(fixes.by[fix] >= 0) || mission.asvsPing) continue;
      const when = fixes.outcome[fix] === 0 ? fixes.delivered[fix] : fixes.broadcast[fix];
      if (Number.isFinite(when)) map.wayDown(context, mission.asvAt(fixes.by[fix], fixes.broadcast[fix]), mission.auvAt(fixes.auv[fix], when), 1);
    }
  }
  write(step = false) {
    if (this.reading) return;
    const parts = [`t=${+this.playback.now.toFixed(3)}`, ...(this.ping === null ? [] : [`ping=${this.mission.pings.id[this.ping]}`])], hash = `#${parts.join("&")}`;
    if (hash === location.hash) return;
    history[step ? "pushState" : "replaceState"](null, "", hash);
  }
  read() {
    const asked = new URLSearchParams(location.hash.slice(1)), time = parseFloat(asked.get("t")), ping = parseInt(asked.get("ping"), 10);
    if (!Number.isFinite(time) && !Number.isFinite(ping)) return false;
    this.reading = true;
    if (Number.isFinite(ping)) this.show(ping, { seek: !Number.isFinite(time), write: false });
    else if (this.ping !== null) { this.ping = null; this.host.hidden = true; }
    if (Number.isFinite(time)) { this.playback.play(false); this.playback.seek(time); }
    this.reading = false;
    return true;
  }
}

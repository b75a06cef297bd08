"use strict";
// Mission time: a clock that plays, the controls that move it, and what listens to it.

const SPEEDS = [0.01, 0.1, 1, 5, 10, 20, 60, 200];

class Playback {
  // Its keys are heard until a signal ends that.
  constructor(mission, signal) {
    this.mission = mission;
    this.now = 0;
    this.playing = false;
    this.speed = SPEEDS.find((speed) => mission.duration / speed <= 60) ?? 200;
    this.listeners = [];
    this.span = null;
    this.selecting = [];
    this.controls();
    this.keyboard(signal);
  }
  onChange(listener) { this.listeners.push(listener); }
  onSelect(listener) { this.selecting.push(listener); }
  // An interval of time (s) that was dragged across in a plot; all of the mission is none.
  select(from, until) {
    const { time } = this.mission, span = from <= 0 && until >= time[time.length - 1] ? null : [Math.max(from, 0), Math.min(until, this.mission.duration)];
    if (`${span}` === `${this.span}`) return;
    this.span = span;
    this.selecting.forEach((listener) => listener(span));
    if (span && (this.now < span[0] || this.now > span[1])) { this.play(false); this.seek(span[1]); }
    else this.listeners.forEach((listener) => listener(this.now));
  }
  seek(time) {
    this.now = clamp(time, 0, this.mission.duration);
    byId("slider").value = this.now;
    if (!this.playing) this.tell();
    byId("clock").textContent = instant(this.now, this.speed < 1 ? 3 : 1);
    this.listeners.forEach((listener) => listener(this.now));
  }
  tell() { byId("slider").setAttribute("aria-valuetext", aloud(this.now)); }
  // How long (s of mission time) something that happens in an instant stays on the map.
  linger({ round } = this.mission) { return Math.max(Math.min(0.8 * this.speed, 1.2 * round), 0.05 * this.speed); }
  step() { return this.speed < 1 ? this.speed : Math.max(this.mission.duration / 300, 0.1); }
  play(on) {
    if (on && this.now >= this.mission.duration) this.seek(0);
    const pauses = this.playing && !on;
    this.playing = on;
    document.documentElement.classList.toggle("playing", on); // plots out of view are not drawn
    if (pauses) { announce(`Paused at ${aloud(this.now)}`); this.seek(this.now); }
    if (!on) { this.tell(); this.paused?.(); }
    byId("play").textContent = on ? "❚❚" : "▶";
    byId("play").setAttribute("aria-label", on ? "Pause" : "Play");
    if (!on) return;
    let last = performance.now();
    const frame = (time) => {
      if (!this.playing) return;
      this.seek(this.now + (time - last) / 1000 * this.speed);
      last = time;
      if (this.now >= this.mission.duration) this.play(false);
      else requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
  }
  leap(times) {
    const next = above(times, this.now + 1e-6);
    this.play(false);
    if (next === times.length) return announce("None after this");
    this.seek(times[next] + 1e-4);
    announce(`At ${aloud(this.now)}`);
  }
  nextFix() { this.leap(this.mission.deliveredTimes); }
  // To when a loss is known, and its ring on the map has grown to the ASVs.
  nextLost() {
    const { pings, hf, soundSpeed, pingLength, decided, lost } = this.mission, crossing = hf.range / soundSpeed;
    const grown = (1 + pingLength / crossing) * Math.max(crossing, 0.5 * this.linger());
    const known = lost.map((ping) => [Math.max(decided[ping], pings.at[ping] + grown), ping]).sort((a, b) => a[0] - b[0]);
    this.leap(Float64Array.from(known, ([time]) => time));
    const next = known.find(([time]) => Math.abs(time + 1e-4 - this.now) < 1e-9);
    if (next) this.inspect?.(pings.id[next[1]]); // says whose it was
  }
  controls() {
    const slider = byId("slider"), speed = byId("speed");
    slider.max = this.mission.duration;
    slider.addEventListener("input", () => { this.play(false); this.seek(+slider.value); });
    for (const value of SPEEDS) speed.append(make("option", { value }, `${value} ×`));
    speed.value = this.speed;
    speed.addEventListener("change", () => { this.speed = +speed.value; this.seek(this.now); });
    byId("play").addEventListener("click", () => this.play(!this.playing));
    byId("previous").addEventListener("click", () => { this.play(false); this.seek(this.now - this.step()); });
    byId("next").addEventListener("click", () => { this.play(false); this.seek(this.now + this.step()); });
    byId("next-fix")?.addEventListener("click", () => this.nextFix());
    byId("next-lost")?.addEventListener("click", () => this.nextLost());
  }
  // Keys play only where the reader is: after a click or with the focus in the playback.
  keyboard(signal) {
    const { duration } = this.mission, by = (step) => () => this.seek(this.now + step());
    const keys = {
      " ": () => this.play(!this.playing), f: () => this.nextFix(), l: () => this.nextLost(),
      ArrowLeft: by(() => -this.step()), ArrowRight: by(() => this.step()),
    };
    const ofSlider = { PageUp: by(() => -duration / 20), PageDown: by(() => duration / 20), Home: () => this.seek(0), End: () => this.seek(duration) };
    let here = false;
    for (const kind of ["pointerdown", "focusin"]) {
      document.addEventListener(kind, (event) => { here = byId("playback").contains(event.target); }, { capture: true, signal });
    }
    document.addEventListener("keydown", (event) => {
      const at = event.target, act = keys[event.key] ?? (at.id === "slider" ? ofSlider[event.key] : null);
      if (!here || !act || event.ctrlKey || event.metaKey || event.altKey || event.shiftKey) return;
      if (at.matches("a, summary, select, textarea, input:not(#slider), [contenteditable]")) return;
      if (at.matches("button") && event.key === " ") return; // presses it
      act();
      event.preventDefault();
    }, { signal });
  }
}

const MOST_EVENTS = 300; // of an interval that is selected

// What is known at an instant of what went on before it, or in a selected interval, in words; the latest first.
class Log {
  constructor(list, mission) {
    this.list = list;
    const { auvs, pings, fixes, fates, decided, deliveredOrder } = mission;
    const whose = (i) => mission.asvsPing ? `${mission.asvs[pings.asv[i]].name} ping ${pings.id[i]} at ${auvs[pings.auv[i]].name}` : `${auvs[pings.auv[i]].name} ping ${pings.id[i]}`;
    const { hf, mf } = mission.discs, beyond = hf ? "out of range" : "beyond what the channel lets through", behind = mission.land ? ", or behind land" : "";
    const words = mission.asvsPing ? { out_of_hf: beyond + behind, lost: "lost to the channel", collided: "collided" } : {
      out_of_hf: `${beyond} ${hf ? "of every" : "to any"} ASV${behind}`, lost: "lost to the channel", collided: "collided at the ASVs",
      out_of_mf: mf ? `its fix was sent beyond MF range${behind}` : "the frame with its fix was not decoded",
    };
    const unanswered = { out_of_hf: `${beyond} of it${behind}`, lost: "lost to the channel", collided: "collided at the AUV" };
    this.whose = (i) => mission.asvsPing ? whose(i) : `Ping ${pings.id[i]} of ${auvs[pings.auv[i]].name}`;
    this.became = new Map();
    pings.fate.forEach((fate, i) => { if (words[fates[fate]]) this.became.set(i, words[fates[fate]]); });
    const became = (i) => mission.isSent(i) ? `${whose(i)}: ${words[fates[pings.fate[i]]]}`
      : `${mission.asvs[pings.caller[i]].name} calls ${auvs[pings.auv[i]].name}, no answer: ${unanswered[fates[pings.fate[i]]]}`;
    this.events = Array.from(pings.id, (_, i) => [decided[i], became(i), fates[pings.fate[i]], pings.id[i]])
      .filter(([at, , fate]) => words[fate] && Number.isFinite(at));
    for (const row of deliveredOrder) {
      const by = Number.isFinite(fixes.correction[row]) ? `, corrects by ${fixes.correction[row].toFixed(2)} m` : "";
      this.events.push([fixes.delivered[row], `${auvs[fixes.auv[row]].name} gets a fix, ${fixes.latency[row].toFixed(2)} s old${by}`, "delivered", fixes.ping[row]]);
    }
    this.events.sort((a, b) => a[0] - b[0]);
    this.times = Float64Array.from(this.events, (event) => event[0]);
  }
  show(now) {
    const [from, until] = this.span ? this.span.map((time) => above(this.times, time)) : [0, above(this.times, now)];
    const key = `${from} ${until} ${!this.span}`;
    if (key === this.shown) return;
    this.shown = key;
    const first = Math.max(from, until - (this.span ? MOST_EVENTS : 6));
    const signs = { delivered: "●", out_of_hf: "×", lost: "○", collided: "✕", out_of_mf: "◌" };
    const lines = this.events.slice(first, until).reverse().map(([at, text, fate, ping]) =>
      make("li", { class: fate, "data-ping": ping }, `${instant(at, 2)}  ${signs[fate]} ${text}`));
    this.list.replaceChildren(...(lines.length ? lines : [make("li", {}, "Fixes and lost pings are listed here as time goes on.")]));
  }
}

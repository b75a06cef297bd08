"use strict";
// Mission time: a clock that plays, the controls that move it, and whoever wants to know.

const SPEEDS = [0.01, 0.1, 1, 5, 10, 20, 60, 200];

class Playback {
  constructor(mission) {
    this.mission = mission;
    this.now = 0;
    this.playing = false;
    this.speed = SPEEDS.find((speed) => mission.duration / speed <= 60) ?? 200;
    this.listeners = [];
    this.controls();
    this.keyboard();
  }
  onChange(listener) { this.listeners.push(listener); }
  seek(time) {
    this.now = Math.min(Math.max(time, 0), this.mission.duration);
    byId("slider").value = this.now;
    byId("slider").setAttribute("aria-valuetext", `${this.now.toFixed(1)} seconds`);
    byId("clock").textContent = `${this.now.toFixed(this.speed < 1 ? 3 : 1)} s`;
    this.listeners.forEach((listener) => listener(this.now));
  }
  // How long (s of mission time) something that happens in an instant stays on the map.
  linger() { return Math.max(Math.min(0.8 * this.speed, 1.2 * this.mission.round), 0.05 * this.speed); }
  step() { return this.speed < 1 ? this.speed : Math.max(this.mission.duration / 300, 0.1); }
  play(on) {
    if (on && this.now >= this.mission.duration) this.seek(0);
    this.playing = on;
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
    if (next < times.length) this.seek(times[next] + 1e-4);
  }
  nextFix() { this.leap(this.mission.deliveredTimes ??= Float64Array.from(this.mission.deliveredOrder, (row) => this.mission.fixes.delivered[row])); }
  nextLost() {
    const crossing = this.mission.hf.range / this.mission.soundSpeed;
    this.leap(this.mission.lostTimes.map((time) => time + Math.max(crossing, 0.5 * this.linger())));
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
  keyboard() {
    const acts = {
      " ": () => this.play(!this.playing),
      ArrowLeft: () => this.seek(this.now - this.step()), ArrowRight: () => this.seek(this.now + this.step()),
      PageDown: () => this.seek(this.now + this.mission.duration / 20), PageUp: () => this.seek(this.now - this.mission.duration / 20),
      Home: () => this.seek(0), End: () => this.seek(this.mission.duration),
      f: () => this.nextFix(), l: () => this.nextLost(),
    };
    // Only where no other element wants the key: a page must still scroll, a button be pressed.
    document.addEventListener("keydown", (event) => {
      const at = event.target, inside = at === document.body || at.closest("#playback") !== null;
      if (event.ctrlKey || event.metaKey || event.altKey || !inside || !acts[event.key]) return;
      if (["SELECT", "BUTTON", "SUMMARY", "A"].includes(at.tagName) && event.key !== "f" && event.key !== "l") return;
      if (at.type === "checkbox") return;
      if (at === document.body && ["PageDown", "PageUp", "Home", "End"].includes(event.key)) return;
      acts[event.key]();
      event.preventDefault();
    });
  }
}

// What went on in the last moments, in words.
class Log {
  constructor(list, mission) {
    this.list = list;
    this.mission = mission;
    const name = (auv) => mission.auvs[auv].name, { pings, fixes } = mission;
    const words = {
      out_of_hf: "out of range of every ASV", lost: "lost to the channel", collided: "collided at the ASVs",
      out_of_mf: "heard, but its fix went beyond MF range",
    };
    this.events = [];
    pings.at.forEach((at, i) => {
      const why = words[mission.fates[pings.fate[i]]];
      if (why) this.events.push([at, `${name(pings.auv[i])} ping ${pings.id[i]}: ${why}`, true]);
    });
    mission.deliveredOrder.forEach((row) => this.events.push([fixes.delivered[row],
      `${name(fixes.auv[row])} gets a fix, ${fixes.latency[row].toFixed(2)} s old, corrects ${fixes.innovation[row].toFixed(2)} m`, false]));
    this.events.sort((a, b) => a[0] - b[0]);
    this.times = Float64Array.from(this.events, (event) => event[0]);
  }
  show(now) {
    const end = above(this.times, now);
    if (end === this.end) return;
    this.end = end;
    this.list.replaceChildren(...this.events.slice(Math.max(end - 6, 0), end).reverse().map(([at, text, bad]) =>
      make("li", bad ? { class: "bad" } : {}, `${at.toFixed(2)} s  ${bad ? "✕ " : "● "}${text}`)));
  }
}

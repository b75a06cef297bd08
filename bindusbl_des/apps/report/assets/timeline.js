"use strict";
// Who owns the channels when: HF pings of each AUV, arrivals and broadcasts at each ASV.

class Timeline {
  constructor(canvas, mission, playback) {
    Object.assign(this, { mission, playback, canvas });
    this.lanes = [...mission.auvs.map((it, i) => ["auv", i, it.name]), ...mission.asvs.map((it, i) => ["asv", i, it.name])];
    this.length = clamp(8 * mission.round, 5, mission.duration);
    this.height = Math.max(Math.min(26, Math.floor(900 / this.lanes.length)), 8);
    canvas.style.height = `${this.lanes.length * this.height + 30}px`;
    this.sheet = new Sheet(canvas, (context, width) => this.draw(context, width));
    this.choices();
    this.listen();
    playback.onChange(() => this.sheet.show(playback.playing));
    playback.onSelect(() => this.sheet.paint());
    byId("timeline-legend").textContent = mission.asvsPing ? "ASV lanes: a tick is a ping. AUV lanes: dots are pings arriving (filled: decoded, and a fix; open: lost; red ✕: collided). "
      + "The upright line is the time of the playback; drag to move in time." : "AUV lanes: a tick is a ping, with ✕ in red where it collided, ○ where it was lost, half as high where no ASV was in HF range. "
      + "ASV lanes: dots above are pings arriving, in the colour of their AUV (filled: decoded, open: lost, red ✕: collided), bars below are its MF broadcasts" + (mission.calls ? ", grey ticks above its calls, which AUVs answer by a ping" : "") + ". The upright line is the time of the playback; drag to move in time.";
    canvas.after(saving("timeline", pictures(() => canvas, () => this.sheet.paint())));
    bindusbl.plots.timeline = mission.pings.at.length + mission.broadcasts.at.length;
  }
  choices() {
    const select = byId("window"), { duration, round } = this.mission;
    const lengths = [...new Set([2 * round, 8 * round, 30 * round, duration].map((it) => Math.min(it, duration)))];
    lengths.forEach((length) => select.append(make("option", { value: length }, length === duration ? "whole mission" : length < LONG ? `${significant(length, 2)} s` : timed(length))));
    select.value = lengths[Math.min(1, lengths.length - 1)];
    this.length = +select.value;
    select.addEventListener("change", () => { this.length = +select.value; this.sheet.paint(); });
  }
  listen() {
    let last = null;
    this.canvas.addEventListener("pointerdown", (event) => { last = event.clientX; this.canvas.setPointerCapture(event.pointerId); });
    this.canvas.addEventListener("pointermove", (event) => {
      if (last === null) return;
      this.playback.play(false);
      this.playback.seek(this.playback.now - (event.clientX - last) * this.length / this.canvas.clientWidth);
      last = event.clientX;
    });
    for (const end of ["pointerup", "pointercancel"]) this.canvas.addEventListener(end, () => { last = null; });
    this.canvas.addEventListener("keydown", (event) => {
      const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
      if (step) { this.playback.seek(this.playback.now + step * this.length / 20); event.preventDefault(); }
    });
  }
  draw(context, width) {
    const { mission, playback } = this, label = 52;
    const start = clamp(playback.now - this.length / 2, 0, mission.duration - this.length), end = start + this.length;
    this.x = (time) => label + (time - start) / this.length * (width - label - 6);
    context.font = "12px system-ui, sans-serif";
    this.lanes.forEach(([kind, number, name], row) => {
      const y = row * this.height;
      context.fillStyle = row % 2 ? colours.paper : colours.sheet;
      context.fillRect(0, y, width, this.height);
      context.fillStyle = colours.shade;
      for (const [from, until] of kind === "asv" ? mission.asvs[number].failures : []) context.fillRect(Math.max(this.x(from), label), y, Math.max(Math.min(this.x(until ?? end), width) - Math.max(this.x(from), label), 0), this.height);
      context.fillStyle = kind === "auv" ? seriesColour(number) : colours.ink;
      if (this.height > 12 || row % 2 === 0) context.fillText(name, 6, y + this.height / 2 + 4);
    });
    context.save();
    context.beginPath();
    context.rect(label, 0, width - label, this.canvas.clientHeight);
    context.clip();
    this.broadcasts(context, start, end);
    this.pings(context, start, end);
    if (playback.span) { // what is not selected, shaded
      const [from, until] = playback.span.map((time) => clamp(this.x(time), label, width)), tall = this.lanes.length * this.height;
      context.fillStyle = colours.line;
      context.globalAlpha = 0.6;
      context.fillRect(label, 0, from - label, tall);
      context.fillRect(until, 0, width - until, tall);
      context.globalAlpha = 1;
    }
    context.fillStyle = colours.accent;
    context.fillRect(this.x(playback.now) - 0.75, 0, 1.5, this.lanes.length * this.height);
    context.restore();
    this.axis(context, start, end, width);
    byId("timeline-range").textContent = `${instant(start).replace(/ s$/, "")} to ${instant(end)}`;
  }
  broadcasts(context, start, end) {
    const { broadcasts, auvs } = this.mission;
    const longest = this.longest ??= broadcasts.airtime.reduce((a, b) => Math.max(a, b), 0);
    for (let i = above(broadcasts.at, start - longest); i < broadcasts.at.length && broadcasts.at[i] < end; i++) {
      const y = (auvs.length + broadcasts.asv[i]) * this.height, x = this.x(broadcasts.at[i]);
      const width = Math.max(this.x(broadcasts.at[i] + broadcasts.airtime[i]) - x, 1);
      context.fillStyle = colours.mf;
      context.fillRect(x, y + this.height * 0.55, width, this.height * 0.38);
      if (width > 60 && this.height > 18) {
        context.fillStyle = "#000";
        context.font = "10px system-ui, sans-serif";
        context.fillText(`${broadcasts.fixes[i]} fixes`, x + 4, y + this.height * 0.87);
      }
    }
  }
  pings(context, start, end) {
    const { pings, fates, hf, soundSpeed, calls } = this.mission, late = (calls ? 4 : 2) * hf.range / soundSpeed;
    for (let i = above(pings.at, start - late); i < pings.at.length && pings.at[i] < end; i++) {
      const fate = fates[pings.fate[i]], y = this.mission.laneOf(i) * this.height, x = this.x(pings.at[i]), middle = y + this.height / 2;
      const width = Math.max(this.x(pings.at[i] + this.mission.pingLength) - x, 2);
      if (this.mission.asvsPing) {
        context.fillStyle = colours.hf;
        if (this.mission.isFirst(i)) context.fillRect(x, y + 2, width, this.height - 4);
        for (const row of this.mission.receptionsOf[i]) this.arrival(context, row);
        continue;
      }
      if (this.mission.calls) this.call(context, i);
      if (!this.mission.isSent(i)) continue;
      const colour = fate === "collided" ? colours.collided : seriesColour(pings.auv[i]);
      const unheard = fate === "out_of_hf"; // half as high: nobody was there to hear it
      context.fillStyle = colour;
      context.fillRect(x, unheard ? middle : y + 2, width, unheard ? this.height / 2 - 2 : this.height - 4);
      if (this.length < 40 * this.mission.round && this.height > 12) {
        if (fate === "collided") this.cross(context, x + width + 6, middle);
        if (fate === "lost") this.dot(context, x + width + 6, middle, colour, false);
      }
      for (const row of this.mission.receptionsOf[i]) this.arrival(context, row);
    }
  }
  call(context, i) {
    const { pings, auvs, pingLength } = this.mission, x = this.x(pings.called[i]);
    context.fillStyle = colours.hf;
    context.fillRect(x, (auvs.length + pings.caller[i]) * this.height + 2, Math.max(this.x(pings.called[i] + pingLength) - x, 2), this.height / 2 - 2);
  }
  arrival(context, row) {
    const { receptions, outcomes } = this.mission, outcome = outcomes[receptions.outcome[row]];
    if (outcome === "in_flight") return;
    const x = this.x(receptions.at[row]), y = this.mission.hearingLane(row) * this.height + this.height * 0.28;
    if (outcome === "collided") this.cross(context, x, y);
    else this.dot(context, x, y, seriesColour(this.mission.pings.auv[this.mission.receptions.ping[row]]), outcome === "heard");
  }
  dot(context, x, y, colour, filled) {
    shape(context, { fill: filled ? colour : colours.paper, stroke: colour, width: 1.5 }, () => disc(context, x, y, Math.min(3.4, this.height / 4)));
  }
  cross(context, x, y) { SeaMap.prototype.slanted(context, x, y, 4, colours.collided, 2); }
  axis(context, start, end, width) {
    const bottom = this.lanes.length * this.height, least = this.length / Math.max(width / 110, 2);
    const step = bindusbl.long && least > 1 ? MINUTES.find((it) => it >= least) ?? least : roundStep(least), digits = step < 1 ? 1 : 0;
    context.fillStyle = colours.soft;
    context.font = "11px system-ui, sans-serif";
    for (let time = Math.ceil(start / step) * step; time <= end; time += step) {
      context.fillRect(this.x(time), bottom, 1, 5);
      context.fillText(bindusbl.long ? instant(time, digits) : `${+time.toPrecision(6)} s`, Math.min(this.x(time) + 3, width - (bindusbl.long ? 50 : 34)), bottom + 17);
    }
  }
}

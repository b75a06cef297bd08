"use strict";
// The team on the chart: where its vessels lie and what they carry, and how a scenario says that.

const MOST_VESSELS = 24;
// Keys that the chart itself sets; what else a candidate has set goes along in its command.
const OWN_KEYS = ["asvs.count", "acoustics.hf.range_m", "acoustics.mf.range_m", "navigation.filter.gain", "navigation.filter"];
const isOwn = (key) => OWN_KEYS.includes(key) || key === "asvs.formation" || key.startsWith("asvs.formation.");

// Places are told, predicted and copied to the centimetre, so that all three are the same.
const toCentimetre = (value) => Math.round(value * 100) / 100 + 0;

class Team {
  // `chart`: the scenario's own stations and what a prediction is made of; that of a candidate is
  // a variant, which names only the parts in which it differs.
  constructor(chart) {
    this.chart = chart;
    this.centre = chart.centre;
    this.take(null, null);
  }
  // A candidate, or the scenario as it is: its places, its ranges and all that it sets.
  take(number, candidate) {
    const variant = this.chart.variants[this.chart.variant_of[number] ?? -1] ?? {};
    this.base = { ...this.chart.inputs, ...variant };
    this.keys = candidate?.keys ?? {};
    this.hf = this.base.hf.range_m;
    this.mf = this.base.mf.range_m;
    this.gain = this.base.navigator.gain;
    this.filter = this.base.navigator.filter;
    this.stations = (candidate?.stations ?? this.chart.stations).map((place) => place.map(toCentimetre));
    // vessels that move are not predicted; those of the answer are drawn as they went
    this.moving = this.stations.length ? null : this.chart.moving[number] ?? { asvs: [] };
    this.ring = this.moving ? { radius: 0, angle: 0 } : this.ringOf(this.stations);
  }
  get inputs() {
    const own = this.filter === this.base.navigator.filter ? this.base : { ...this.base, ...this.chart.filters[this.filter] };
    return withEquipment(own, this);
  }
  get hasGain() { return this.inputs.navigator.kind.has_gain; }
  // How far, seen from above, an AUV is heard, and hears frames.
  reach() { return this.fromAbove(this.hf, this.base.hf.by_slant); }
  mfReach() { return this.fromAbove(this.mf, this.base.mf.is_cut && this.base.mf.by_slant); }
  fromAbove(range, bySlant) { return bySlant ? Math.sqrt(Math.max(range ** 2 - this.base.slots.deepest_m ** 2, 0)) : range; }
  // Radius (m) and angle (deg) of the regular formation that these places are; null if they are none.
  ringOf(stations) {
    const count = stations.length, [cx, cy] = this.centre;
    const [dx, dy] = [stations[0][0] - cx, stations[0][1] - cy], radius = Math.hypot(dx, dy), turn = 360 / count;
    const angle = count > 1 && radius > 0.01 ? ((Math.atan2(dy, dx) * 180 / Math.PI % turn) + turn) % turn : 0;
    const same = this.regular(count, radius, angle).every(([x, y]) => stations.some(([a, b]) => Math.hypot(a - x, b - y) < 0.03));
    return same ? { radius, angle } : null;
  }
  regular(count, radius, angle) {
    const [cx, cy] = this.centre;
    if (count === 1) return [[cx, cy].map(toCentimetre)];
    return Array.from({ length: count }, (_, i) => {
      const at = angle * Math.PI / 180 + 2 * Math.PI * i / count;
      return [cx + radius * Math.cos(at), cy + radius * Math.sin(at)].map(toCentimetre);
    });
  }
  // The formation that sliders show while vessels lie anywhere: as far out as they are in the mean.
  shape() {
    const [cx, cy] = this.centre;
    return this.ring ?? { radius: mean(this.stations.map(([x, y]) => Math.hypot(x - cx, y - cy))), angle: 0 };
  }
  form(count, { radius, angle }) {
    this.ring = { radius, angle: angle % (360 / count) };
    this.stations = this.regular(count, this.ring.radius, this.ring.angle);
  }
  move(number, place) {
    this.stations[number] = place.map(toCentimetre);
    this.ring = null;
  }
  add(place) {
    if (this.stations.length >= MOST_VESSELS) return;
    this.stations.push(place.map(toCentimetre));
    this.ring = null;
  }
  remove(number) {
    if (this.stations.length < 2) return;
    this.stations.splice(number, 1);
    this.ring = null;
  }
  // What `--set` takes: the places, what is not as in the scenario, and what a candidate has set.
  settings() {
    const own = this.chart.inputs, now = [
      ["acoustics.hf.range_m", this.hf, own.hf.range_m], ["acoustics.mf.range_m", this.mf, own.mf.range_m],
      ["navigation.filter", this.filter, own.navigator.filter],
      ...(this.hasGain ? [["navigation.filter.gain", this.gain, own.navigator.gain]] : []),
    ];
    const set = [["asvs.count", this.stations.length], ["asvs.formation", `{positions_m: ${this.positions()}}`]];
    set.push(...now.filter(([, value, before]) => value !== before).map(([key, value]) => [key, value]));
    // a threshold that is not given is that at the range: the channel stays what it was
    for (const band of ["hf", "mf"]) {
      const { range_m, kept } = this.base[band];
      if (this[band] !== range_m) set.push(...Object.entries(kept));
    }
    return [...set, ...Object.entries(this.keys).filter(([key]) => !isOwn(key))];
  }
  positions() { return `[${this.stations.map(([x, y]) => `[${x}, ${y}]`).join(", ")}]`; }
  command(scenario) {
    const sets = this.settings().map(([key, value]) => `--set ${quoted(`${key}=${typeof value === "string" ? value : JSON.stringify(value)}`)}`);
    return `bindusbl-des run ${[quoted(scenario), ...sets].join(" ")}`;
  }
}

// A word that a shell takes as it is.
function quoted(word) { return /^[\w@%+=:,./-]+$/.test(word) ? word : `'${word.replaceAll("'", `'"'"'`)}'`; }

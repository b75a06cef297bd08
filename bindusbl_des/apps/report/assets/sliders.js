"use strict";
// Sliders of the team: how many, how far out, how far they hear, and how AUVs weigh their fixes.

class Sliders {
  constructor(host, team, { candidates, chart }, change) {
    Object.assign(this, { team, host });
    const counts = candidates.map(({ asvs }) => asvs), { base } = team;
    const [cx, cy] = team.centre, corner = Math.max(...chart.outline.map(([x, y]) => Math.hypot(x - cx, y - cy)));
    const most = Math.min(Math.max(8, ...counts, team.stations.length), MOST_VESSELS), shape = () => team.shape();
    this.all = [
      this.slider("vessels", "", 1, () => most, 1, () => team.stations.length, (value) => change(() => team.form(value, shape()))),
      this.slider("radius", "m", 0, () => 1.5 * corner, roundStep(corner / 150), () => shape().radius, (radius) => change(() => team.form(team.stations.length, { ...shape(), radius }))),
      this.slider("angle", "°", 0, () => Math.ceil(360 / team.stations.length) - 1, 1, () => shape().angle, (angle) => change(() => team.form(team.stations.length, { ...shape(), angle }))),
      ...[["hf", "HF range"], ["mf", "MF range"]].map(([band, words]) => {
        const { range_m, step_m, chances } = base[band], step = roundStep(range_m / 100);
        const most = Math.min(3 * range_m, step_m * (chances.length - 1)); // as far as its table reaches
        return this.slider(words, "m", step * Math.round(0.2 * range_m / step), () => most, step, () => team[band], (value) => change(() => { team[band] = value; }));
      }),
    ];
    this.gain = this.slider("gain", "", 0.05, () => 1, 0.05, () => team.gain, (value) => change(() => { team.gain = value; }));
    this.filter = make("select", {}, ...Object.keys(chart.filters).map((name) => make("option", { value: name }, name)));
    this.filter.addEventListener("change", () => change(() => { team.filter = this.filter.value; }));
    host.append(make("label", { class: "slider" }, make("span", {}, "navigator"), this.filter), this.gain.label);
    this.all.push(this.gain);
  }
  slider(words, unit, least, most, step, value, set) {
    const input = make("input", { type: "range", min: least, step }), told = make("span", { class: "told" });
    const label = make("label", { class: "slider" }, make("span", {}, words), input, told);
    input.addEventListener("input", () => set(+input.value));
    this.host.append(label);
    return { label, tell: () => {
      input.max = most();
      if (document.activeElement !== input || +input.value !== value()) input.value = value();
      told.textContent = `${+value().toFixed(2)} ${unit}`.trim();
      input.setAttribute("aria-valuetext", told.textContent);
      label.classList.toggle("free", !this.team.ring && (words === "radius" || words === "angle"));
    } };
  }
  tell() {
    this.all.forEach((slider) => slider.tell());
    this.filter.value = this.team.filter;
    this.gain.label.hidden = !this.team.hasGain;
  }
}

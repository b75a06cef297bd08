"use strict";
// The error to be expected over a survey: planning/prediction/mapping.py, number for number.

// Where one round in so many brings a fix, or fewer, none is to be expected.
const HARDLY_ANY = 1e-3;

// The RMS (m) of the error of an AUV that is at places [[x, y], ...]; NaN where hardly a fix comes.
function errorMap(inputs, stations, places) {
  const { navigator } = inputs, { chance, round, noise, lasts } = serviceAt(inputs, stations, places);
  const out = new Float64Array(places.length).fill(NaN), bias = biasOf(inputs), walk = navigator.walk_m2_per_s;
  if (navigator.filter === "dead_reckoning") return out;
  for (let i = 0; i < out.length; i++) {
    if (!(chance[i] > HARDLY_ANY)) continue;
    const wait = round / chance[i];
    const square = navigator.filter === "fixed_gain"
      ? withFixedGain(navigator.gain, bias, walk, chance[i], wait, noise[i])
      : 2 * Math.sqrt(walk ** 2 * wait ** 2 / 4 + walk * wait * noise[i]);
    out[i] = Math.sqrt(square + 2 * lasts[i]);
  }
  return out;
}

// What fixes are at places, of an AUV as deep as the deepest: how likely a round brings one, how
// long rounds are (s), and the variance of a fix along an axis and what of it lasts (m2).
function serviceAt(inputs, stations, places) {
  const { ways, noise: tables } = inputs, depths = flat(ways.depths_m), deepest = depths.indexOf(Math.max(...depths));
  const only = (rows) => [rows[deepest]];
  const own = { ...inputs, ways: { ...ways, depths_m: only(ways.depths_m) }, noise: {
    step_m: tables.step_m, along_m2: only(tables.along_m2), across_m2: only(tables.across_m2), down_m2: only(tables.down_m2), leaning_m2: only(tables.leaning_m2),
  } };
  const flatPlaces = Float64Array.from(places.flat()), here = sightsOf(own, flatPlaces, places.length, stations);
  const found = located(own, here), errs = fixesOf(own, here, flatPlaces, stations), { kinds } = found;
  const [chance, noise, lasts] = Array.from({ length: 3 }, () => new Float64Array(places.length));
  for (let i = 0; i < places.length; i++) {
    let any = 0;
    for (let kind = 0; kind < kinds; kind++) any += found.chance[i * kinds + kind];
    for (let kind = 0; kind < kinds; kind++) {
      const at = i * kinds + kind, weight = found.chance[at] / Math.max(any, 1e-30);
      noise[i] += weight * (errs.noise[3 * at] + errs.noise[3 * at + 1]);
      lasts[i] += weight * (errs.lasts[3 * at] + errs.lasts[3 * at + 1]);
    }
    noise[i] /= 2;
    lasts[i] /= 2;
    chance[i] = any / kinds * toldAt(inputs, here, i);
  }
  const sights = sightsOf(inputs, flat(ways.places_m), ways.times_s.length, stations);
  const { period } = plannedRounds(inputs, sights, located(inputs, sights));
  return { chance, noise, lasts, round: period.length / period.reduce((sum, it) => sum + 1 / it, 0) };
}

// How likely what was found is told to the AUV: by the mean ASV, or by the one that is to.
function toldAt({ access, slots }, { asvs, told, level }, i) {
  const turns = ["round_robin", "random"].includes(access.schedule) ? 1 / (slots.downlink_s.length - 1) : 1;
  if (access.ranging === "passive") return 1;
  if (access.downlink === "direct_reply") return turns;
  if (access.broadcaster === "fixed") return turns * told[i * asvs + access.fixed_asv];
  if (access.broadcaster === "nearest") return turns * told[nearestOf(level, i, asvs)];
  let sum = 0;
  for (let asv = 0; asv < asvs; asv++) sum += told[i * asvs + asv];
  return turns * sum / asvs;
}

// What drives dead reckoning off (m/s), drawn or known, at the mean speed of the AUVs.
function biasOf({ ways, navigator, duration_s }) {
  const lengths = ways.places_m.map((way) => way.reduce((sum, [x, y], k) => (k ? sum + Math.hypot(x - way[k - 1][0], y - way[k - 1][1]) : 0), 0));
  const speed = mean(lengths) / duration_s;
  return Math.hypot(...navigator.sources.flatMap(({ frame, mean: known, drawn_sd }) => [...known, ...drawn_sd].map((it) => (frame === "way" ? speed : 1) * it)));
}

// What a fixed gain lets through of the noise, the bias that it follows late, and the walk since.
function withFixedGain(gain, bias, walk, p, wait, noise) {
  const left = (1 - gain) ** 2 * (2 * walk * wait + bias ** 2 * wait ** 2 * (1 - p));
  const after = (left + 2 * gain ** 2 * noise) / (gain * (2 - gain)), lag = (1 - gain) * bias * wait / gain;
  const drift = lag * bias * wait * (2 - p) + bias ** 2 * wait ** 2 * (p * p - 6 * p + 6) / 3;
  return after + lag ** 2 + drift + walk * wait * (2 - p);
}

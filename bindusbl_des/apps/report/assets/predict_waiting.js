"use strict";
// How long AUVs wait for fixes that come with some chance each: apps/planning/prediction/predicting.py.

// A wait that is less likely than this to go on is over.
const OVER = 1e-5;

// Fixes a second, and mean, 95 % quantile and longest of the time since the ping of the last one (s),
// of each AUV.
function waitingOf({ rounds, told, pinged, chance, many }, auvs, end) {
  const out = { fix_rate_hz: [], fix_age_mean_s: [], fix_age_p95_s: [], fix_age_max_s: [] };
  for (let auv = 0; auv < auvs; auv++) {
    const [first, last] = [auv * rounds, (auv + 1) * rounds], chances = chancesOf(...[told, pinged, chance].map((it) => it.subarray(first, last)), many, end);
    const [mean_s, p95_s, longest_s] = overTime(...agesOf(chances, end), end);
    out.fix_rate_hz.push(chances.fixes / end);
    out.fix_age_mean_s.push(mean_s);
    out.fix_age_p95_s.push(p95_s);
    out.fix_age_max_s.push(longest_s);
  }
  return out;
}

// When an AUV may be told of a fix (s), how old that is then and how likely; rounds that stand for
// several have all theirs.
function chancesOf(told, pinged, chance, many, end) {
  const instants = [], lags = [], odds = [];
  let fixes = 0;
  for (let turn = 0; turn < told.length; turn++) {
    if (chance[turn] <= 0 || told[turn] >= end) continue;
    const later = turn + 1 < told.length ? told[turn + 1] : end;
    for (let k = 0; k < many; k++) {
      instants.push(told[turn] + k * (later - told[turn]) / many);
      lags.push(told[turn] - pinged[turn]);
      odds.push(chance[turn]);
      fixes += chance[turn];
    }
  }
  return { instants, lags, odds, fixes };
}

// Ages (s) at which waits end, and how many of each are to be expected; those at which they begin
// count against them.
function agesOf({ instants, lags, odds }, end) {
  const ages = [], weights = [];
  for (let begin = -1; begin < instants.length; begin++) {
    const lag = begin >= 0 ? lags[begin] : 0, since = begin >= 0 ? instants[begin] - lag : 0, first = begin >= 0 ? odds[begin] : 1;
    for (let left = first, k = begin + 1; left > OVER * first; k++) {
      const odd = k < odds.length ? odds[k] : 1;
      ages.push((k < instants.length ? instants[k] : end) - since, lag);
      weights.push(left * odd, -left * odd);
      left *= 1 - odd;
    }
  }
  return [ages, weights];
}

// The mean over time of the age of a fix, its 95 % quantile, and the largest (s).
function overTime(ages, weights, end) {
  const order = Uint32Array.from(ages, (_, i) => i).sort((a, b) => ages[b] - ages[a] || a - b);
  let [square, longest, total, number, p95, none] = [0, 0, 0, 0, -1, 1];
  for (let k = 0; k < order.length; k++) {
    const old = ages[order[k]], weight = weights[order[k]], younger = k + 1 < order.length ? ages[order[k + 1]] : 0;
    square += weight * old * old;
    total += weight * old;
    number += weight;
    none *= 1 - Math.min(Math.max(weight, 0), 1);
    longest += (1 - none) * (old - younger);
    if (p95 < 0 && number > OVER) {
      const age = (total - 0.05 * end) / number;
      if (age >= younger) p95 = age;
    }
  }
  return [square / (2 * end), Math.max(p95, 0), longest];
}

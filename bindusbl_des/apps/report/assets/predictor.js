"use strict";
// The error of each AUV, predicted without simulation: predicting.py and sizes.py of
// planning/prediction in the page's language, the same to 1e-6.

const HALF_NORMAL = [0.062706777943, 0.189118426273, 0.318639363964, 0.45376219017, 0.597760126042,
  0.75541502636, 0.934589291073, 1.150349380376, 1.439531470938, 1.95996398454];
const TWENTIETHS = [...HALF_NORMAL.map((it) => -it).reverse(), ...HALF_NORMAL];

// Of these a larger value is the better one.
const MORE_IS_BETTER = ["hf_coverage", "fix_rate_hz"];

// What is expected of each AUV, by the names of table `auvs`, with vessels at stations [[x, y], ...].
function predict(inputs, stations) {
  const { ways } = inputs, instants = ways.times_s.length, places = flat(ways.places_m);
  const sights = sightsOf(inputs, places, instants, stations), found = located(inputs, sights);
  const plan = plannedRounds(inputs, sights, found), turns = turnsOf(inputs, sights, found, plan);
  const known = inputs.navigator.kind.is_smoother ? smoothed : errorsOf;
  const errors = known(inputs, turns, fixesOf(inputs, sights, places, stations));
  return { hf_coverage: coverageOf(inputs, sights, plan), ...waitingOf(turns, sights.auvs, inputs.duration_s), ...sizesOf(errors, sights) };
}

// The share of pings that some ASV is in range of; where ASVs ping, of those of which the AUV is.
function coverageOf({ access }, { auvs, instants, asvs, heard }, { period }) {
  const passive = access.ranging.asvs_ping, all = period.reduce((sum, it) => sum + 1 / it, 0);
  return Array.from({ length: auvs }, (_, auv) => {
    let covered = 0;
    for (let k = 0; k < instants; k++) {
      const first = (auv * instants + k) * asvs;
      let near = 0;
      for (let n = first; n < first + asvs; n++) if (heard[n] > SELDOM) near++;
      covered += (passive ? near / asvs : Math.min(near, 1)) / period[k];
    }
    return covered / all;
  });
}

// How large errors are whose mean and covariance are known.
function sizesOf({ means, spreads, alike, since }, { auvs, instants }) {
  const out = { position_error_m: [], position_error_rms_m: [], position_error_p95_m: [], error_over_time: [], varies: [] };
  const count = TWENTIETHS.length, cases = new Float64Array(count * instants); // squares, m2
  for (let auv = 0; auv < auvs; auv++) {
    const overTime = new Float64Array(instants), scattered = new Float64Array(instants);
    let squares = 0;
    for (let k = 0; k < instants; k++) {
      const i = auv * instants + k, { square, shape } = sizeOf(means[2 * i], means[2 * i + 1], spreads[3 * i], spreads[3 * i + 1], spreads[3 * i + 2]);
      const third = 1 / (9 * shape), spread = Math.sqrt(third);
      for (let j = 0; j < count; j++) {
        const root = Math.max(1 - third + TWENTIETHS[j] * spread, 0);
        cases[k * count + j] = square * root * root * root;
      }
      overTime[k] = meanSize(square, shape);
      squares += square;
      scattered[k] = Math.sqrt(Math.max(square - overTime[k] * overTime[k], 0));
    }
    const whole = mean(overTime);
    out.error_over_time.push(overTime);
    out.position_error_m.push(whole);
    out.position_error_rms_m.push(Math.sqrt(squares / instants));
    out.varies.push(scatterOf(scattered, alike, since, auv) / Math.max(whole, 1e-30));
    out.position_error_p95_m.push(rootQuantile(cases, 0.95));
  }
  return out;
}

// The standard deviation (m) of the mean length over one mission: lengths at two instants are as much
// alike as their squares, and pairs with one of a few instants stand for all.
function scatterOf(spread, alike, since, auv) {
  const instants = spread.length;
  let [total, known] = [0, 0];
  for (let row = auv * ANCHORS; row < (auv + 1) * ANCHORS; row++) {
    if (since[row] < 0) continue;
    const begin = spread[since[row]];
    let pairs = 0;
    for (let k = 0; k < instants; k++) pairs += alike[row * instants + k] * spread[k];
    total += 2 * (pairs * begin - 0.5 * begin * begin) / instants;
    known++;
  }
  return Math.sqrt(Math.max(total / Math.max(known, 1), 0));
}

// A quantile of the roots of numbers, which are put into another order: linear between two of them.
function rootQuantile(values, share) {
  const place = share * (values.length - 1), low = Math.min(Math.trunc(place), values.length - 2);
  select(values, low);
  let above = Infinity;
  for (let i = low + 1; i < values.length; i++) above = Math.min(above, values[i]);
  const [first, second] = [Math.sqrt(values[low]), Math.sqrt(above)];
  return first + (place - low) * (second - first);
}

// Puts the number that is `rank`-th in order there, smaller ones before it (Hoare's selection).
function select(values, rank) {
  for (let left = 0, right = values.length - 1; left < right;) {
    const pivot = values[(left + right) >> 1];
    let [i, j] = [left, right];
    while (i <= j) {
      while (values[i] < pivot) i++;
      while (values[j] > pivot) j--;
      if (i > j) break;
      [values[i], values[j]] = [values[j], values[i]];
      i++;
      j--;
    }
    if (rank <= j) right = j;
    else if (rank >= i) left = i;
    else return;
  }
}

// The mean square (m2) of an error, and how many of its standard deviations that is, squared.
function sizeOf(x, y, xx, yy, xy) {
  const square = x * x + y * y + xx + yy;
  const varies = 2 * (xx * xx + yy * yy + 2 * xy * xy) + 4 * (x * x * xx + y * y * yy + 2 * x * y * xy);
  return { square, shape: varies <= 1e-12 * square * square ? Infinity : square * square / varies };
}

function meanSize(square, shape) { return shape === Infinity ? Math.sqrt(square) : Math.sqrt(square / shape) * gammaQuotient(shape); }

// G(k + 1/2) / G(k) of the gamma function.
function gammaQuotient(shape) {
  let out = 1;
  for (let k = 0; k < 8; k++) out *= (shape + k) / (shape + k + 0.5);
  const z = shape + 8, expansion = 1 - 1 / (8 * z) + 1 / (128 * z ** 2) + 5 / (1024 * z ** 3) - 21 / (32768 * z ** 4);
  return out * Math.sqrt(z) * expansion;
}

// A metric of the worst AUV as it is expected of single missions: which AUV fares worst is partly
// luck, so that the largest error of a mission is more than the largest that is expected.
function worstOf(metric, found) {
  if (metric.startsWith("position_error")) return expectedLargest(found[metric], found.varies);
  return MORE_IS_BETTER.includes(metric) ? Math.min(...found[metric]) : Math.max(...found[metric]);
}

// The expected largest of independent numbers that each scatter by a share.
function expectedLargest(values, varies) {
  const count = TWENTIETHS.length, cases = new Float64Array(values.length * count);
  for (let i = 0; i < cases.length; i++) {
    const own = Math.trunc(i / count), third = varies[own] / 3, root = Math.max(1 - third * third + TWENTIETHS[i % count] * third, 0);
    cases[i] = values[own] * root * root * root;
  }
  const order = Uint32Array.from(cases, (_, i) => i).sort((a, b) => cases[a] - cases[b] || a - b), passed = new Float64Array(values.length);
  let [below, total] = [0, 0];
  for (const place of order) {
    passed[Math.trunc(place / count)] += 1 / count;
    const largest = passed.reduce((product, it) => product * it, 1);
    total += (largest - below) * cases[place];
    below = largest;
  }
  return total;
}

// The same with other ranges (m), and another gain.
function withEquipment(inputs, { hf, mf, gain }) {
  return { ...inputs, hf: { ...inputs.hf, range_m: hf }, mf: { ...inputs.mf, range_m: mf }, navigator: { ...inputs.navigator, gain } };
}

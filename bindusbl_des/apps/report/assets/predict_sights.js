"use strict";
// Who hears whom, how likely, and what a fix errs by then: apps/planning/prediction/sights.py and
// systematic.py, number for number. Arrays are flat; AUVs come first, then instants, then ASVs.

const SELDOM = 1e-6, CLOSE_M = 1e-6;

// Lists of numbers, however nested, as one typed array that is made once.
const flattened = new WeakMap();
function flat(nested) {
  if (nested instanceof Float64Array) return nested;
  if (!flattened.has(nested)) flattened.set(nested, Float64Array.from(nested.flat(Infinity)));
  return flattened.get(nested);
}

// The value of a table from `start` on, `length` long, at a distance: straight between its steps.
function lookedUp(table, start, length, step, away) {
  const place = Math.min(away / step, length - 1), low = Math.min(Math.trunc(place), length - 2);
  const value = table[start + low];
  return value + (place - low) * (table[start + low + 1] - value);
}

// How likely a signal is decoded over a way.
function chanceOf({ is_cut, by_slant, range_m, step_m }, table, level, slant) {
  if (is_cut && (by_slant ? slant : level) > range_m) return 0;
  return lookedUp(table, 0, table.length, step_m, slant);
}

// What AUVs at `places` (x, y after each other, so many `instants` of each AUV) and stations are.
function sightsOf(inputs, places, instants, stations) {
  const asvs = stations.length, auvs = places.length / 2 / instants, size = auvs * instants * asvs;
  const [level, slant, heard, told] = Array.from({ length: 4 }, () => new Float64Array(size));
  const inRange = new Uint8Array(size), depths = flat(inputs.ways.depths_m), { hf, mf } = inputs;
  const hfChances = flat(hf.chances), mfChances = flat(mf.chances);
  for (let i = 0, n = 0; i < auvs * instants; i++) {
    const depth = depths[Math.floor(i / instants)];
    for (let asv = 0; asv < asvs; asv++, n++) {
      const north = places[2 * i] - stations[asv][0], east = places[2 * i + 1] - stations[asv][1];
      const squares = north * north + east * east;
      level[n] = Math.sqrt(squares);
      slant[n] = Math.sqrt(squares + depth * depth);
      inRange[n] = (hf.by_slant ? slant[n] : level[n]) <= hf.range_m ? 1 : 0;
      heard[n] = chanceOf(hf, hfChances, level[n], slant[n]);
      told[n] = chanceOf(mf, mfChances, level[n], slant[n]);
    }
  }
  return { auvs, instants, asvs, level, slant, inRange, heard, told };
}

// The first of a row's ASVs whose value is smallest.
function nearestOf(values, row, asvs) {
  let best = row * asvs;
  for (let n = best + 1; n < (row + 1) * asvs; n++) if (values[n] < values[best]) best = n;
  return best;
}

// How likely the answer of the first ASV that hears a ping is decoded: of the nearest, where that misses
// it of the next.
function toldByFirst({ asvs, level, heard, told }, row) {
  const nearestFirst = Array.from({ length: asvs }, (_, asv) => row * asvs + asv).sort((one, other) => level[one] - level[other] || one - other);
  let [missed, any, decoded] = [1, 0, 0];
  for (const n of nearestFirst) {
    any += missed * heard[n];
    decoded += missed * heard[n] * told[n];
    missed *= 1 - heard[n];
  }
  return decoded / Math.max(any, 1e-30);
}

// How likely a ping makes a fix: of all ASVs that hear it, or (passive) of each by itself.
function located(inputs, { auvs, instants, asvs, level, heard }) {
  const { ranging } = inputs.access;
  if (ranging.asvs_ping) return { kinds: asvs, chance: heard };
  const chance = new Float64Array(auvs * instants);
  for (let row = 0; row < chance.length; row++) {
    let missed = 1;
    for (let n = row * asvs; n < (row + 1) * asvs; n++) missed *= 1 - heard[n];
    chance[row] = 1 - missed;
    if (ranging.calls) chance[row] *= heard[nearestOf(level, row, asvs)];
  }
  return { kinds: 1, chance };
}

// Variances xx, yy and covariance xy of errors along and across a line.
function turned(along, across, cosine, sine) {
  return [
    along * cosine * cosine + across * sine * sine, along * sine * sine + across * cosine * cosine,
    (along - across) * cosine * sine,
  ];
}

// What fixes err by, xx, yy, xy of each row and kind: `noise` of their own, and what `lasts`, which
// falls apart at a `rate` (1/s).
function fixesOf(inputs, sights, places, stations) {
  const { auvs, instants, asvs, level } = sights, passive = inputs.access.ranging.asvs_ping;
  const kinds = passive ? asvs : 1, size = 3 * auvs * instants * kinds;
  const noise = new Float64Array(size), lasts = new Float64Array(size), rate = new Float64Array(size / 3);
  const slowS = inputs.systematic.slow_s, slows = flat(inputs.noise.slow);
  const row = newRow(inputs, asvs), systematic = hasCommon(inputs), speeds = systematic ? speedsOf(inputs.ways, auvs, instants, places) : null;
  for (let auv = 0, i = 0; auv < auvs; auv++) for (let k = 0; k < instants; k++, i++) {
    fillRow(row, inputs, sights, auv, i, places, stations);
    if (passive) {
      for (let asv = 0; asv < asvs; asv++) {
        const n = i * asvs + asv, [cosine, sine] = [row.cosine[asv], row.sine[asv]];
        noise.set(turned(row.along[asv], row.across[asv], cosine, sine), 3 * n);
        if (systematic) rate[n] = lastsOfEach(inputs, level[n], sights.slant[n], cosine, sine, speeds[auv], lasts, 3 * n);
        if (slowS) rate[n] = withSlow(lookedUp(slows, auv * row.length, row.length, inputs.noise.step_m, level[n]), slowS, rate[n], noise, lasts, 3 * n);
      }
      continue;
    }
    noise.set(fused(row, asvs), 3 * i);
    if (systematic) rate[i] = lastsOfAll(inputs, row, asvs, speeds[auv], lasts, 3 * i);
    if (!slowS) continue;
    let [slow, heard] = [0, 0];
    for (let asv = 0; asv < asvs; asv++) {
      heard += row.weight[asv];
      slow += row.weight[asv] * lookedUp(slows, auv * row.length, row.length, inputs.noise.step_m, row.level[asv]);
    }
    rate[i] = withSlow(slow / Math.max(heard, SELDOM), slowS, rate[i], noise, lasts, 3 * i);
  }
  return { kinds, noise, lasts, rate };
}

// Of the noise of a fix a share is slow, and so of what fixes have in common; the rate of both.
function withSlow(share, slowS, rate, noise, lasts, at) {
  const other = lasts[at] + lasts[at + 1];
  let own = 0;
  for (let k = 0; k < 3; k++) {
    const slow = share * noise[at + k];
    noise[at + k] -= slow;
    lasts[at + k] += slow;
    if (k < 2) own += slow;
  }
  return (own / slowS + other * rate) / Math.max(own + other, 1e-30);
}

// Room for what is to be known of each ASV where an AUV is.
function newRow({ noise, ways }, asvs) {
  const [along, across, down, leaning, cosine, sine, weight, level, slant] = Array.from({ length: 9 }, () => new Float64Array(asvs));
  const tables = [noise.along_m2, noise.across_m2, noise.down_m2, noise.leaning_m2].map(flat);
  return { along, across, down, leaning, cosine, sine, weight, level, slant, tables, length: tables[0].length / ways.depths_m.length };
}

function fillRow(row, inputs, { asvs, level, slant, heard }, auv, i, places, stations) {
  const { step_m } = inputs.noise, [along, across, down, leaning] = row.tables, start = auv * row.length;
  const direct = inputs.access.downlink.replies, first = i * asvs;
  let least = Infinity;
  for (let asv = 0; asv < asvs; asv++) least = Math.min(least, level[first + asv]);
  for (let asv = 0; asv < asvs; asv++) {
    const away = level[first + asv], above = away < CLOSE_M; // where any line will do
    row.along[asv] = lookedUp(along, start, row.length, step_m, away);
    row.across[asv] = lookedUp(across, start, row.length, step_m, away);
    row.down[asv] = lookedUp(down, start, row.length, step_m, away);
    row.leaning[asv] = lookedUp(leaning, start, row.length, step_m, away);
    row.cosine[asv] = above ? 1 : (places[2 * i] - stations[asv][0]) / away;
    row.sine[asv] = above ? 0 : (places[2 * i + 1] - stations[asv][1]) / away;
    row.level[asv] = away;
    row.slant[asv] = slant[first + asv];
    row.weight[asv] = direct && away !== least ? 0 : heard[first + asv]; // the first to hear it answers
  }
}

// The covariance of the fix that ASVs make together: their information adds up, in three axes.
function fused({ along, across, down, leaning, cosine, sine, weight }, asvs) {
  let missed = 1, xx = 0, yy = 0, xy = 0, zz = 0, xz = 0, yz = 0;
  for (let asv = 0; asv < asvs; asv++) missed *= 1 - weight[asv];
  const any = Math.max(1 - missed, SELDOM);
  for (let asv = 0; asv < asvs; asv++) {
    const share = weight[asv] / any, c = cosine[asv], s = sine[asv];
    const determinant = Math.max(along[asv] * down[asv] - leaning[asv] * leaning[asv], 1e-30);
    const byAlong = share * down[asv] / determinant, byAcross = share / Math.max(across[asv], 1e-30);
    const byBoth = -share * leaning[asv] / determinant;
    xx += byAlong * c * c + byAcross * s * s;
    yy += byAlong * s * s + byAcross * c * c;
    xy += (byAlong - byAcross) * c * s;
    zz += share * along[asv] / determinant;
    xz += byBoth * c;
    yz += byBoth * s;
  }
  zz = Math.max(zz, 1e-30);
  [xx, yy, xy] = [xx - xz * xz / zz, yy - yz * yz / zz, xy - xz * yz / zz];
  const determinant = Math.max(xx * yy - xy * xy, 1e-30);
  return [yy / determinant, xx / determinant, -xy / determinant];
}

// Whether fixes have errors in common.
function hasCommon({ systematic: it }) { return [it.misalignment_rad, it.gnss_m, it.sound_speed_share, it.clock_s, it.slow_s].some((size) => size !== 0); }

// How fast each AUV goes on average (m/s).
function speedsOf({ times_s }, auvs, instants, places) {
  return Array.from({ length: auvs }, (_, auv) => {
    let length = 0;
    for (let i = auv * instants + 1; i < (auv + 1) * instants; i++) length += Math.sqrt((places[2 * i] - places[2 * i - 2]) ** 2 + (places[2 * i + 1] - places[2 * i - 1]) ** 2);
    return length / times_s[times_s.length - 1];
  });
}

// The rate (1/s) at which an error of some mean square falls apart: GNSS wanders, all else turns.
function rateOf({ gnss_m, gnss_time_constant_s }, square, level, arrays, speed) {
  const byGnss = Math.min(2 * gnss_m ** 2 / arrays / Math.max(square, 1e-30), 1);
  return byGnss / gnss_time_constant_s + (1 - byGnss) * (speed / Math.max(level, 1));
}

function lastsOfEach({ systematic, slots }, level, slant, cosine, sine, speed, out, at) {
  const late = systematic.clock_s * slots.sound_speed_m_per_s * (level / Math.max(slant, 1e-9));
  const along = (systematic.sound_speed_share * level) ** 2 + late ** 2 + systematic.gnss_m ** 2;
  const across = (systematic.misalignment_rad * level) ** 2 + systematic.gnss_m ** 2;
  out.set(turned(along, across, cosine, sine), at);
  return rateOf(systematic, along + across, level, 1, speed);
}

// What lasts in fixes that ASVs make together: of each array by itself, and what all ranges have.
function lastsOfAll({ systematic, slots }, { along, across, cosine, sine, weight, level, slant }, asvs, speed, lasts, at) {
  const shift = systematic.gnss_m ** 2, said = [], own = [], sum = [0, 0, 0];
  for (let asv = 0; asv < asvs; asv++) {
    const turns = (systematic.misalignment_rad * level[asv]) ** 2 + shift;
    said.push(turned(weight[asv] / Math.max(along[asv] + shift, 1e-30), weight[asv] / Math.max(across[asv] + turns, 1e-30), cosine[asv], sine[asv]));
    own.push(turned(shift, turns, cosine[asv], sine[asv]));
    for (let k = 0; k < 3; k++) sum[k] += said[asv][k];
  }
  const [xx, yy, xy] = sum, determinant = Math.max(xx * yy - xy * xy, 1e-30), out = [0, 0, 0];
  const late = [0, 0], far = [0, 0];
  for (let asv = 0; asv < asvs; asv++) {
    const [a, b, c] = said[asv], [ox, oy, oxy] = own[asv];
    const pull = [[(yy * a - xy * c) / determinant, (yy * c - xy * b) / determinant], [(-xy * a + xx * c) / determinant, (-xy * c + xx * b) / determinant]];
    [[0, 0], [1, 1], [0, 1]].forEach(([i, j], k) => {
      out[k] += pull[i][0] * (ox * pull[j][0] + oxy * pull[j][1]) + pull[i][1] * (oxy * pull[j][0] + oy * pull[j][1]);
    });
    const clock = systematic.clock_s * slots.sound_speed_m_per_s * level[asv] / Math.max(slant[asv], 1e-9);
    for (const axis of [0, 1]) {
      const along_line = pull[axis][0] * cosine[asv] + pull[axis][1] * sine[asv];
      late[axis] += along_line * clock;
      far[axis] += along_line * systematic.sound_speed_share * level[asv];
    }
  }
  [[0, 0], [1, 1], [0, 1]].forEach(([i, j], k) => { out[k] += late[i] * late[j] + far[i] * far[j]; });
  lasts.set(out, at);
  let [heard, apart] = [0, 0];
  for (let asv = 0; asv < asvs; asv++) {
    heard += weight[asv];
    apart += weight[asv] * level[asv];
  }
  heard = Math.max(heard, 1e-9);
  return rateOf(systematic, out[0] + out[1], apart / heard, heard, speed);
}

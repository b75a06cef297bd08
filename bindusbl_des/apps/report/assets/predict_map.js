"use strict";
// What error an AUV settles at where it dwells: apps/planning/prediction/mapping.py, number for number.

// Where on the AUVs' ways each place [x, y] is nearest: [AUV, instant, share of the way to the next].
function nearestOnWays({ places_m }, places) {
  return places.map(([x, y]) => {
    let [least, found] = [Infinity, [0, 0, 0]];
    places_m.forEach((way, auv) => {
      for (let k = 0; k + 1 < way.length; k++) {
        const [ax, ay] = way[k], dx = way[k + 1][0] - ax, dy = way[k + 1][1] - ay, square = dx * dx + dy * dy;
        const share = square > 0 ? Math.min(Math.max(((x - ax) * dx + (y - ay) * dy) / square, 0), 1) : 0;
        const away = (ax + share * dx - x) ** 2 + (ay + share * dy - y) ** 2;
        if (away < least) [least, found] = [away, [auv, k, share]];
      }
    });
    return found;
  });
}

// The mean error (m) of the AUV that passes nearest to each of these places, as it passes.
function laneMap(nearest, { error_over_time }) {
  return Float64Array.from(nearest, ([auv, k, share]) => (1 - share) * error_over_time[auv][k] + share * error_over_time[auv][k + 1]);
}

// Fixes that come more seldom than one in so many rounds are none.
const HARDLY_ANY = 1e-3;

// The mean error (m) at places [[x, y], ...]; where no fix comes, how far dead reckoning drifts.
function errorMap(inputs, stations, places) {
  const { ways, noise, access, navigator } = inputs, instants = ways.times_s.length, one = (rows) => [rows[0]];
  const fleet = sightsOf(inputs, flat(ways.places_m), instants, stations), plan = plannedRounds(inputs, fleet, located(inputs, fleet));
  let period = instants / plan.period.reduce((sum, it) => sum + 1 / it, 0);
  if (access.schedule.turn !== "each") period *= ways.places_m.length;
  const here = { ...inputs, ways: { ...ways, depths_m: one(ways.depths_m) }, noise: {
    step_m: noise.step_m, along_m2: one(noise.along_m2), across_m2: one(noise.across_m2), down_m2: one(noise.down_m2), leaning_m2: one(noise.leaning_m2),
    slow: one(noise.slow),
  } };
  const spots = Float64Array.from(places.flat()), around = sightsOf(here, spots, places.length, stations), found = located(here, around);
  const own = fixesOf(here, around, spots, stations), lost = drifted(inputs), settled = new Settled(inputs, lateOf(inputs, plan, ways.places_m.length));
  return Float64Array.from(places, (_, i) => {
    const { chance, kind, slower } = chanceAt(here, around, found, i), at = 3 * (i * found.kinds + kind);
    if (!(chance > HARDLY_ANY) || navigator.kind.ignores_fixes) return lost;
    const [mean_x, xx, yy, xy] = settled.at(period * slower / Math.max(chance, HARDLY_ANY), chance, own.noise.subarray(at, at + 3));
    const { square, shape } = sizeOf(mean_x, 0, xx + own.lasts[at], yy + own.lasts[at + 1], xy + own.lasts[at + 2]);
    return Math.min(meanSize(square, shape), lost);
  });
}

// How likely a round brings a fix, of which kind, and how much longer rounds are for that.
function chanceAt({ access }, around, { kinds, chance }, i) {
  if (!access.ranging.asvs_ping) return { chance: chance[i] * toldAt(access, around, i), kind: 0, slower: 1 };
  const own = chance.subarray(i * kinds, (i + 1) * kinds), most = own.reduce((a, b) => Math.max(a, b)), sum = own.reduce((a, b) => a + b, 0);
  return { chance: most, kind: own.indexOf(most), slower: kinds / Math.max(sum / Math.max(most, HARDLY_ANY), 1) };
}

// How likely an AUV decodes a broadcast.
function toldAt({ downlink, replies_in_frames, broadcaster, fixed_asv }, around, i) {
  const { asvs, told, level } = around;
  if (downlink.replies) return replies_in_frames ? toldByFirst(around, i) : 1;
  if (broadcaster.chosen_by === "one") return told[i * asvs + fixed_asv];
  if (broadcaster.chosen_by === "distance") return told[nearestOf(level, i, asvs)];
  let sum = 0;
  for (let asv = 0; asv < asvs; asv++) sum += told[i * asvs + asv];
  return sum / asvs;
}

// How long after its ping (s) an AUV is told of it, on average.
function lateOf({ access }, { slot, pitch, send, frame }, auvs) {
  if (access.ranging.asvs_ping) return 0;
  if (access.downlink.replies) return access.reply_s;
  let sum = 0;
  const instants = send.length, byGroup = access.downlink.by_group;
  for (let auv = 0; auv < auvs; auv++) for (let k = 0; k < instants; k++) sum += send[k] + frame[k] - (byGroup ? 0 : slot[auv * instants + k] * pitch[k]);
  return sum / (auvs * instants);
}

// The error that settles: its mean along x (m), and xx, yy, xy (m2). Drift that is not estimated is
// taken to be along x.
class Settled {
  constructor(inputs, late) {
    const { navigator, duration_s } = inputs;
    Object.assign(this, { late, duration: duration_s, gain: navigator.gain, walk: navigator.walk_m2_per_s, biases: velocities(inputs), fixed: navigator.kind.has_gain });
  }
  at(interval, chance, noise) {
    const { walk, gain, biases } = this, varies = interval * interval * (1 - Math.min(chance, 1));
    const age = (interval * interval + varies) / (2 * interval) + this.late; // of the last fix, over time
    if (this.fixed) {
      const left = (1 - gain) ** 2 / (gain * (2 - gain)), since = interval * interval / 12 + varies, own = gain / (2 - gain);
      const grown = left * walk * interval + walk * age;
      return [Math.sqrt(biases) * ((1 - gain) / gain * interval + age), own * noise[0] + biases * (varies * left + since) + grown, own * noise[1] + grown, own * noise[2]];
    }
    const grown = walk * age - 0.5 * walk * interval, count = Math.max(this.duration / interval, 1), [xx, yy, xy] = settling(walk * interval, noise);
    return [0, xx + 4 / count * noise[0] + grown, yy + 4 / count * noise[1] + grown, xy + 4 / count * noise[2]];
  }
}

// sqrt(q^2 / 4 + q R), the covariance between two fixes of a Kalman filter.
function settling(walk, noise) {
  const quarter = 0.25 * walk * walk, xx = quarter + walk * noise[0], yy = quarter + walk * noise[1], xy = walk * noise[2];
  const root = Math.sqrt(Math.max(xx * yy - xy * xy, 0)), trace = Math.max(Math.sqrt(xx + yy + 2 * root), 1e-30);
  return [(xx + root) / trace, (yy + root) / trace, xy / trace];
}

// The mean square (m2/s2) of the velocity by which dead reckoning is off.
function velocities({ ways, navigator, duration_s }) {
  const [way] = ways.places_m, length = way.reduce((sum, [x, y], k) => (k ? sum + Math.sqrt((x - way[k - 1][0]) ** 2 + (y - way[k - 1][1]) ** 2) : 0), 0);
  return navigator.sources.reduce((total, { frame, mean: known, drawn_sd }) => {
    const scale = frame === "way" ? length / duration_s : 1;
    return total + [...known, ...drawn_sd].reduce((sum, it) => sum + (scale * it) ** 2, 0);
  }, 0);
}

// How far off (m) dead reckoning is on average over the mission, going straight.
function drifted(inputs) {
  const { duration_s: end, navigator } = inputs;
  return Math.sqrt(2 * navigator.start_sd_m ** 2 + velocities(inputs) * end * end / 4 + navigator.walk_m2_per_s * end);
}

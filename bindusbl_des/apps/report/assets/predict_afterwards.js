"use strict";
// The errors of a smoother, two marches of which one begins with the end: afterwards.py of
// planning/prediction/march.

const ANYWHERE_M = 1e4;

function smoothed(inputs, turns, fixes) {
  const auvs = inputs.ways.depths_m.length, forward = errorsOf(inputs, { ...turns, told: turns.pinged }, fixes), back = errorsOf(...backwards(inputs, turns, fixes));
  const before = secondMoments(forward), after = reversed(secondMoments(back), auvs, 3);
  const spreads = new Float64Array(before.length);
  for (let at = 0; at < before.length; at += 3) spreads.set(bothKnown(before.subarray(at, at + 3), after.subarray(at, at + 3)), at);
  return { ...forward, means: new Float64Array(forward.means.length), spreads };
}

// Each AUV's rows of so many numbers in the opposite order.
function reversed(values, auvs, width) {
  const out = new values.constructor(values.length), rows = values.length / auvs / width;
  for (let auv = 0; auv < auvs; auv++) for (let row = 0; row < rows; row++) {
    const from = (auv * rows + row) * width;
    out.set(values.subarray(from, from + width), (auv * rows + rows - 1 - row) * width);
  }
  return out;
}

// A mission that begins with its end, of which nothing is known.
function backwards(inputs, turns, fixes) {
  const { ways, navigator, duration_s } = inputs, auvs = ways.depths_m.length, instants = ways.times_s.length;
  const headings = reversed(flat(ways.headings_s), auvs, 2), ends = flat(ways.headings_s);
  for (let i = 0; i < headings.length; i++) headings[i] = ends[2 * (Math.floor(i / 2 / instants) * instants + instants - 1) + i % 2] - headings[i];
  const open = ({ sources }) => sources.map((it) => ({ ...it, mean: [0, 0], drawn_sd: it.assumed_sd }));
  const unknown = { ...navigator, start_sd_m: ANYWHERE_M, assumed_start_sd_m: ANYWHERE_M, sources: open(navigator) };
  const others = inputs.others.map((it) => ({ ...it, sources: open(it) }));
  const pinged = reversed(turns.pinged, auvs, 1).map((it) => duration_s - it), turn = (values, width = 1) => reversed(values, auvs, width);
  return [
    { ...inputs, ways: { ...ways, places_m: turn(flat(ways.places_m), 2), headings_s: headings }, navigator: unknown, others },
    { ...turns, pinged, told: pinged, chance: turn(turns.chance), late: turn(turns.late).map((it) => instants - 1 - it), kind: turn(turns.kind) },
    { ...fixes, noise: turn(fixes.noise, 3 * fixes.kinds), lasts: turn(fixes.lasts, 3 * fixes.kinds), rate: turn(fixes.rate, fixes.kinds) },
  ];
}

// xx, yy, xy of errors about nothing.
function secondMoments({ means, spreads }) {
  return spreads.map((it, i) => {
    const at = 2 * Math.floor(i / 3), [x, y] = [means[at], means[at + 1]];
    return it + [x * x, y * y, x * y][i % 3];
  });
}

// What is left of errors where another estimate is independent of them, A - A (A + B)^-1 A.
function bothKnown([xx, yy, xy], other) {
  const [a, b, c] = [xx + other[0], yy + other[1], xy + other[2]], determinant = Math.max(a * b - c * c, 1e-30);
  return [
    Math.max(xx - (b * xx * xx - 2 * c * xx * xy + a * xy * xy) / determinant, 0),
    Math.max(yy - (b * xy * xy - 2 * c * xy * yy + a * yy * yy) / determinant, 0),
    xy - (b * xx * xy - c * (xx * yy + xy * xy) + a * xy * yy) / determinant,
  ];
}

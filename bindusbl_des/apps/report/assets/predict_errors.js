"use strict";
// The errors of each AUV over time, a march through the fixes that it may expect: drift.py,
// correction.py and errors.py of planning/prediction/march. States are the error (m) along x and y,
// and two numbers of each source of drift; carried on are their true covariance, that in which the
// filter believes, and rows that change as a mean does: the first is the mean, two each of the
// others are the covariances of the error at an earlier instant, an anchor, with the states now.

const WEIGHED = -1, HARDLY = 1e-9, ANCHORS = 6;

class March {
  constructor({ navigator, ways, systematic }) {
    const { sources } = navigator;
    this.sources = sources.map((it) => ({ ...it, lasts: it.time_constant_s || Infinity }));
    // What fixes have in common: two numbers without a unit, of which a fix has some metres.
    this.common = hasCommon({ systematic }) ? 2 + 2 * sources.length : 0;
    if (this.common) {
      const told = systematic.is_estimated ? 1 : 0;
      this.sources.push({ frame: "none", mean: [0, 0], drawn_sd: [1, 1], assumed_sd: [told, told], wander_per_s: 0, lasts: Infinity });
    }
    this.size = 2 + 2 * this.sources.length;
    this.rows = 1 + 2 * ANCHORS;
    this.variances = this.sources.flatMap(({ drawn_sd }) => drawn_sd.map((it) => it * it));
    this.assumed = this.sources.flatMap(({ assumed_sd }) => assumed_sd.map((it) => it * it));
    this.walks = [navigator.walk_m2_per_s, navigator.assumed_walk_m2_per_s];
    this.starts = [navigator.start_sd_m ** 2, navigator.assumed_start_sd_m ** 2];
    this.mean = [0, 0, ...this.sources.flatMap(({ mean: it }) => it)];
    this.gain = navigator.kind.has_gain ? navigator.gain : navigator.kind.ignores_fixes ? 0 : WEIGHED;
    this.atPing = navigator.at_ping;
    this.step = ways.times_s[1];
    this.instants = ways.times_s.length;
    const { size } = this;
    [this.moved, this.gainX, this.gainY, this.saidX, this.saidY] = Array.from({ length: 5 }, () => new Float64Array(size));
    this.half = new Float64Array(size * size);
  }
  start() {
    const { size } = this, spread = (first, rest) => {
      const out = new Float64Array(size * size);
      for (let i = 0; i < size; i++) out[i * size + i] = i < 2 ? first : rest[i - 2];
      return out;
    };
    const rows = new Float64Array(this.rows * size);
    rows.set(this.mean);
    return { used: 1, rows, true: spread(this.starts[0], this.variances), believed: spread(this.starts[1], this.assumed) };
  }
  // An AUV's time (s), integrals of its heading (s) and place (m) at an instant.
  moment(time, places, headings, auv, out) {
    const place = Math.min(Math.max(time / this.step, 0), this.instants - 1), low = Math.min(Math.trunc(place), this.instants - 2);
    const share = place - low, at = 2 * (auv * this.instants + low);
    out[0] = time;
    for (let axis = 0; axis < 2; axis++) {
      out[1 + axis] = headings[at + axis] + share * (headings[at + 2 + axis] - headings[at + axis]);
      out[3 + axis] = places[at + axis] + share * (places[at + 2 + axis] - places[at + axis]);
    }
    return out;
  }
  // Carries errors, in their place, from one moment to a later one; what the filter believes of them
  // only where that is asked for.
  carry(state, begin, end) {
    const passed = end[0] - begin[0], { size, sources } = this, { rows, true: real, believed } = state, used = state.used * size;
    if (passed <= 0) return;
    for (let source = 0; source < sources.length; source++) {
      const { frame, lasts, wander_per_s } = sources[source], k = 2 + 2 * source;
      let ahead = frame === "none" ? 0 : passed, aside = 0;
      if (frame === "body") {
        ahead = end[1] - begin[1];
        aside = end[2] - begin[2];
      } else if (frame === "way") {
        ahead = end[3] - begin[3];
        aside = end[4] - begin[4];
      }
      const share = passed / lasts, left = share > 0 ? -Math.expm1(-share) / share : 1, a = left * ahead, b = left * aside;
      for (let row = 0; row < used; row += size) {
        const first = rows[row + k], second = rows[row + k + 1];
        rows[row] += a * first - b * second;
        rows[row + 1] += b * first + a * second;
      }
      this.spread(real, k, a, b);
      if (believed) this.spread(believed, k, a, b);
      if (share > 0) {
        const kept = Math.exp(-share), line = [ahead / passed, aside / passed];
        for (let row = 0; row < used; row += size) {
          rows[row + k] *= kept;
          rows[row + k + 1] *= kept;
        }
        this.fade(real, k, kept, this.variances);
        this.roam(real, k, line, share, lasts, this.variances[k - 2]);
        if (believed) {
          this.fade(believed, k, kept, this.assumed);
          this.roam(believed, k, line, share, lasts, this.assumed[k - 2]);
        }
      }
      if (wander_per_s > 0) {
        this.wander(real, k, passed, wander_per_s);
        if (believed) this.wander(believed, k, passed, wander_per_s);
      }
    }
    for (let i = 0; i < 2 * size; i += size + 1) {
      real[i] += this.walks[0] * passed;
      if (believed) believed[i] += this.walks[1] * passed;
    }
  }
  // Lets the states k and k + 1 change the error (F P F^T).
  spread(p, k, ahead, aside) {
    const { size } = this;
    for (let i = 0; i < size; i++) {
      const first = p[k * size + i], second = p[(k + 1) * size + i];
      p[i] += ahead * first - aside * second;
      p[size + i] += aside * first + ahead * second;
    }
    for (let i = 0; i < size; i++) {
      const row = i * size, first = p[row + k], second = p[row + k + 1];
      p[row] += ahead * first - aside * second;
      p[row + 1] += aside * first + ahead * second;
    }
  }
  fade(p, k, kept, variances) {
    const { size } = this;
    for (let j = k; j < k + 2; j++) {
      for (let i = 0; i < size; i++) p[j * size + i] *= kept;
      for (let i = 0; i < size; i++) p[i * size + j] *= kept;
      p[j * size + j] += variances[j - 2] * (1 - kept * kept);
    }
  }
  roam(p, k, [cosine, sine], share, lasts, variance) {
    const { size } = this, gone = -Math.expm1(-share);
    let own = share > 1e-3 ? 2 * (share - gone) - gone * gone : 2 * share * share * share / 3;
    own *= variance * lasts * lasts * (cosine * cosine + sine * sine);
    const beside = variance * lasts * gone * gone;
    for (let axis = 0; axis < 2; axis++) {
      p[axis * size + axis] += own;
      p[axis * size + k + axis] += beside * cosine;
      p[(k + axis) * size + axis] += beside * cosine;
    }
    p[k + 1] -= beside * sine;
    p[(k + 1) * size] -= beside * sine;
    p[size + k] += beside * sine;
    p[k * size + 1] += beside * sine;
  }
  wander(p, k, passed, rate) {
    const { size } = this;
    for (let axis = 0; axis < 2; axis++) {
      p[axis * size + axis] += rate * passed * passed * passed / 3;
      p[axis * size + k + axis] += rate * passed * passed / 2;
      p[(k + axis) * size + axis] += rate * passed * passed / 2;
      p[(k + axis) * size + k + axis] += rate * passed;
    }
  }
  // Reads a fix: its noise, as it is and as the filter thinks, and what it has of the common error.
  read({ noise, lasts }, at) {
    this.noise = [noise[at], noise[at + 1], noise[at + 2]];
    this.thought = this.noise;
    if (!this.common) return;
    if (this.assumed[this.common - 2] === 0) this.thought = this.noise.map((it, k) => it + lasts[at + k]);
    this.xx = Math.sqrt(lasts[at]);
    this.yx = this.xx > 0 ? lasts[at + 2] / this.xx : 0;
    this.yy = Math.sqrt(Math.max(lasts[at + 1] - this.yx * this.yx, 0));
  }
  // Takes in so many fixes at once, or one with a chance; the estimate is behind where it holds.
  correct(state, fixes, behindX, behindY) {
    const { size, gainX, gainY, moved, common } = this, chance = Math.min(fixes, 1), share = 1 / Math.max(fixes, 1), { rows: it, true: real } = state;
    const noise = this.noise.map((own) => own * share), thought = this.thought.map((own) => own * share);
    this.gains(state.believed, thought);
    for (let row = (state.used - 1) * size; row >= 0; row -= size) { // the mean last: it stays in `moved`
      let x = it[row], y = it[row + 1];
      if (common) {
        x += this.xx * it[row + common];
        y += this.yx * it[row + common] + this.yy * it[row + common + 1];
      }
      if (row === 0) {
        x += behindX;
        y += behindY;
      }
      for (let i = 0; i < size; i++) {
        moved[i] = gainX[i] * x + gainY[i] * y;
        it[row + i] -= chance * moved[i];
      }
    }
    this.joseph(real, noise, chance);
    this.joseph(state.believed, thought, chance);
    for (let i = 0; i < size; i++) for (let j = 0; j < size; j++) real[i * size + j] += chance * (1 - chance) * moved[i] * moved[j];
  }
  // The covariances of all states with what a fix says, P H^T.
  said(p) {
    const { size, saidX, saidY, common } = this;
    for (let i = 0; i < size; i++) {
      const row = i * size;
      saidX[i] = p[row];
      saidY[i] = p[row + 1];
      if (!common) continue;
      saidX[i] += this.xx * p[row + common];
      saidY[i] += this.yx * p[row + common] + this.yy * p[row + common + 1];
    }
  }
  gains(p, noise) {
    const { size, gainX, gainY, saidX, saidY, common } = this;
    gainX.fill(0);
    gainY.fill(0);
    if (this.gain !== WEIGHED) {
      gainX[0] = gainY[1] = this.gain;
      return;
    }
    this.said(p);
    let [xx, yy, xy] = [saidX[0], saidY[1], saidY[0]];
    if (common) {
      xx += this.xx * saidX[common];
      xy += this.xx * saidY[common];
      yy += this.yx * saidY[common] + this.yy * saidY[common + 1];
    }
    [xx, yy, xy] = [xx + noise[0], yy + noise[1], xy + noise[2]];
    const determinant = xx * yy - xy * xy;
    if (!(determinant > 1e-12 * (xx + yy) * (xx + yy))) return;
    for (let i = 0; i < size; i++) {
      gainX[i] = (saidX[i] * yy - saidY[i] * xy) / determinant;
      gainY[i] = (saidY[i] * xx - saidX[i] * xy) / determinant;
    }
  }
  // P becomes, with a chance, (1 - K H) P (1 - K H)^T + K R K^T.
  joseph(p, [xx, yy, xy], chance) {
    const { size, gainX, gainY, half, saidX, saidY } = this;
    this.said(p);
    for (let i = 0; i < size; i++) for (let j = 0; j < size; j++) half[i * size + j] = p[i * size + j] - gainX[i] * saidX[j] - gainY[i] * saidY[j];
    this.said(half);
    for (let i = 0; i < size; i++) {
      const row = i * size, over = gainX[i] * xx + gainY[i] * xy, beside = gainX[i] * xy + gainY[i] * yy;
      for (let j = 0; j < size; j++) {
        const after = half[row + j] - saidX[i] * gainX[j] - saidY[i] * gainY[j] + (over * gainX[j] + beside * gainY[j]);
        p[row + j] += chance * (after - p[row + j]);
      }
    }
  }
}

// The errors of all AUVs at the instants of their ways: true mean (x, y) and covariance (xx, yy, xy),
// and how much their squares are correlated with those at anchors before, numbered by `since`.
function errorsOf(inputs, { rounds, pinged, told, chance, late, kind, many }, fixes) {
  const { instants, step } = new March(inputs), places = flat(inputs.ways.places_m), headings = flat(inputs.ways.headings_s);
  const auvs = inputs.ways.depths_m.length, means = new Float64Array(2 * auvs * instants), spreads = new Float64Array(3 * auvs * instants);
  const alike = new Float64Array(auvs * ANCHORS * instants), since = new Int32Array(auvs * ANCHORS).fill(-1);
  let [known, then, here] = [0, 1, 2].map(() => new Float64Array(5));
  for (let auv = 0; auv < auvs; auv++) {
    const other = inputs.others.find(({ members }) => members.includes(auv)), navigator = { ...inputs.navigator, ...other };
    const march = new March({ ...inputs, navigator }), { size } = march, state = march.start();
    const ahead = { ...march.start(), believed: null }, last = march.sources[march.sources.length - 1];
    march.moment(0, places, headings, auv, known);
    for (let turn = 0, next = 0, anchors = 0; turn <= rounds; turn++) {
      const i = auv * rounds + turn;
      if (turn < rounds && chance[i] < HARDLY) continue;
      const until = turn < rounds ? told[i] : Infinity, holds = turn < rounds && march.atPing ? pinged[i] : until;
      for (; next < instants && next * step < until; next++) {
        const at = auv * instants + next;
        march.moment(next * step, places, headings, auv, here);
        if (anchors < ANCHORS && here[0] <= holds && next >= Math.floor((2 * anchors + 1) * instants / (2 * ANCHORS))) {
          march.carry(state, known, here);
          known.set(here);
          state.rows.set(state.true.subarray(0, 2 * size), (1 + 2 * anchors) * size);
          since[auv * ANCHORS + anchors] = next;
          anchors++;
          state.used += 2;
        }
        ahead.used = state.used;
        ahead.rows.set(state.rows);
        ahead.true.set(state.true);
        march.carry(ahead, known, here);
        means.set(ahead.rows.subarray(0, 2), 2 * at);
        spreads[3 * at] = ahead.true[0];
        spreads[3 * at + 1] = ahead.true[size + 1];
        spreads[3 * at + 2] = ahead.true[1];
        for (let anchor = 0; anchor < anchors; anchor++) {
          const row = auv * ANCHORS + anchor;
          alike[row * instants + next] = alikeOf(ahead.rows, (1 + 2 * anchor) * size, size, means, spreads, auv * instants + since[row], at);
        }
      }
      if (next === instants) break;
      march.moment(holds, places, headings, auv, then);
      march.carry(state, known, then);
      march.moment(pinged[i], places, headings, auv, here);
      const own = (auv * instants + late[i]) * fixes.kinds + kind[i];
      march.read(fixes, 3 * own);
      march.correct(state, many * chance[i], then[3] - here[3], then[4] - here[4]);
      if (march.common) last.lasts = 1 / fixes.rate[own];
      [known, then] = [then, known];
    }
  }
  return { means, spreads, alike, since };
}

// How much the squares of errors at two instants are correlated.
function alikeOf(rows, first, size, means, spreads, begin, end) {
  const second = first + size, [mx, my, nx, ny] = [means[2 * begin], means[2 * begin + 1], means[2 * end], means[2 * end + 1]];
  const together = 2 * (rows[first] ** 2 + rows[first + 1] ** 2 + rows[second] ** 2 + rows[second + 1] ** 2)
    + 4 * mx * (rows[first] * nx + rows[first + 1] * ny) + 4 * my * (rows[second] * nx + rows[second + 1] * ny);
  const apart = variesOf(mx, my, spreads, 3 * begin) * variesOf(nx, ny, spreads, 3 * end);
  return apart > 0 ? together / Math.sqrt(apart) : 0;
}

// The variance (m4) of the square of an error.
function variesOf(x, y, spreads, at) {
  const [xx, yy, xy] = [spreads[at], spreads[at + 1], spreads[at + 2]];
  return 2 * (xx * xx + yy * yy + 2 * xy * xy) + 4 * (x * x * xx + y * y * yy + 2 * x * y * xy);
}

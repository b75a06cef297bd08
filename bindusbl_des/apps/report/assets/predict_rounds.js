"use strict";
// The rounds of a mission as its plan lets them be expected: apps/planning/prediction/rounds.py.

const MOST_ROUNDS = 3000;

// Groups of AUVs without a common listener: greedy in index order, or DSATUR (core/protocol/conflicts.py).
// `hears(auv, asv)` tells who hears whom; returned is the group of each AUV.
function coloured(auvs, asvs, hears, kind) {
  const colours = new Int32Array(auvs).fill(-1), used = Array.from({ length: asvs }, () => new Uint8Array(auvs + 1));
  const smallest = (auv) => {
    for (let colour = 0; ; colour++) {
      let free = true;
      for (let asv = 0; asv < asvs && free; asv++) free = !(hears(auv, asv) && used[asv][colour]);
      if (free) return colour;
    }
  };
  const paint = (auv) => {
    const colour = colours[auv] = smallest(auv);
    for (let asv = 0; asv < asvs; asv++) if (hears(auv, asv)) used[asv][colour] = 1;
  };
  if (kind !== "saturation") {
    for (let auv = 0; auv < auvs; auv++) paint(auv);
    return colours;
  }
  const shared = (a, b) => { for (let asv = 0; asv < asvs; asv++) if (hears(a, asv) && hears(b, asv)) return true; return false; };
  const met = Array.from({ length: auvs }, () => new Set()), degree = new Int32Array(auvs);
  for (let a = 0; a < auvs; a++) for (let b = 0; b < auvs; b++) if (a !== b && shared(a, b)) degree[a]++;
  for (let turn = 0; turn < auvs; turn++) {
    let best = -1;
    for (let auv = 0; auv < auvs; auv++) {
      if (colours[auv] >= 0) continue;
      if (best < 0 || met[auv].size > met[best].size || (met[auv].size === met[best].size && degree[auv] > degree[best])) best = auv;
    }
    paint(best);
    for (let auv = 0; auv < auvs; auv++) if (colours[auv] < 0 && shared(auv, best)) met[auv].add(colours[best]);
  }
  return colours;
}

// The slot of each AUV at each instant, and how many slots there are then.
function groupedOf({ schedule: { groups: kind } }, { auvs, instants, asvs, inRange }) {
  const slot = new Int32Array(auvs * instants), groups = new Float64Array(instants), known = new Map();
  for (let k = 0; k < instants; k++) {
    if (kind === "frame") { groups[k] = 1; continue; }
    let colours = null;
    if (kind !== "each") {
      let key = "";
      for (let auv = 0; auv < auvs; auv++) for (let asv = 0; asv < asvs; asv++) key += inRange[(auv * instants + k) * asvs + asv];
      colours = known.get(key) ?? coloured(auvs, asvs, (auv, asv) => inRange[(auv * instants + k) * asvs + asv], kind);
      known.set(key, colours);
    }
    for (let auv = 0; auv < auvs; auv++) {
      const own = colours ? colours[auv] : auv;
      slot[auv * instants + k] = own;
      groups[k] = Math.max(groups[k], own + 1);
    }
  }
  return { slot, groups };
}

function inTicks({ tick_rate_hz }, duration) {
  return tick_rate_hz === 0 ? duration : Math.ceil(duration * tick_rate_hz - 1e-9) / tick_rate_hz;
}

function uplinkSlot({ hf, slots }) {
  if (slots.fixed_uplink_s !== null) return inTicks(slots, slots.fixed_uplink_s);
  const way = hf.by_slant ? hf.range_m : Math.sqrt(hf.range_m ** 2 + slots.deepest_m ** 2);
  const ways = slots.ways * (slots.ping_s + way / slots.sound_speed_m_per_s);
  return inTicks(slots, Math.max(ways + slots.turnaround_s + slots.uplink_guard_s, slots.shortest_uplink_s) + slots.answer_s);
}

// What belongs to a number of fixes that need not be whole.
function between(table, fixes) {
  const low = Math.min(Math.trunc(fixes), Math.max(table.length - 2, 0));
  return table[low] + (fixes - low) * (table[low + 1] - table[low]);
}

// How rounds go at each instant: slots, their pitch, when what they brought is sent, how long that
// takes, the round's length (s), and how many broadcasts it has.
function plannedRounds(inputs, sights, { kinds, chance }) {
  const { access, slots } = inputs, { auvs, instants } = sights, uplink = uplinkSlot(inputs);
  const column = (value) => new Float64Array(instants).fill(value);
  if (access.ranging.asvs_ping) return { slot: new Int32Array(auvs * instants), pitch: column(uplink), send: column(0), frame: column(0), period: column(uplink), broadcasts: column(1) };
  const { slot, groups } = groupedOf(access, sights), downlinks = flat(slots.downlink_s), frames = flat(slots.frame_s);
  const [pitch, send, frame, period, broadcasts] = [column(uplink), column(0), column(0), column(0), column(1)];
  for (let k = 0; k < instants; k++) {
    let expected = 0;
    for (let auv = 0; auv < auvs; auv++) for (let kind = 0; kind < kinds; kind++) expected += chance[(auv * instants + k) * kinds + kind];
    expected = Math.min(expected, auvs);
    if (access.frame_s > 0) expected /= auvs;
    const busy = groups[k] * uplink, byGroup = access.downlink.by_group, fixes = byGroup ? expected / groups[k] : expected;
    if (access.downlink.replies) {
      period[k] = Math.max(busy, access.frame_s);
      broadcasts[k] = 0;
      continue;
    }
    const downlink = between(downlinks, fixes);
    frame[k] = between(frames, fixes);
    if (byGroup) {
      pitch[k] = send[k] = Math.max(uplink, downlink);
      period[k] = Math.max(groups[k] * pitch[k], access.frame_s);
      broadcasts[k] = groups[k];
    } else if (!access.downlink.waits) {
      send[k] = Math.max(busy, downlink);
      period[k] = Math.max(send[k], access.frame_s);
    } else {
      send[k] = busy;
      period[k] = Math.max(busy + downlink, access.frame_s);
    }
  }
  return { slot, pitch, send, frame, period, broadcasts };
}

// When rounds begin (s), at which instant of the ways, and the number of each one's first broadcast.
function begunRounds({ period, broadcasts }, step, end, many) {
  const begin = [], at = [], number = [];
  for (let time = 0, sent = 0; time < end && begin.length < 4 * MOST_ROUNDS;) {
    const k = Math.min(Math.trunc(time / step + 0.5), period.length - 1);
    begin.push(time);
    at.push(k);
    number.push(sent);
    time += many * period[k];
    sent += broadcasts[k];
  }
  return { begin, at, number };
}

// What AUVs may expect of all rounds: when each pings and is told (s), how likely, the instant of
// the ways at which it does, and the kind of fix. Each round stands for `many` equal ones.
function turnsOf(inputs, sights, found, plan) {
  const { access, ways, slots } = inputs, { auvs, instants, asvs, slant } = sights, step = ways.times_s[1], end = inputs.duration_s;
  const often = plan.period.reduce((sum, it) => sum + 1 / it, 0) / instants, many = Math.max(Math.ceil(end * often / MOST_ROUNDS), 1);
  const { begin, at, number } = begunRounds(plan, step, end, many), rounds = begin.length, c = slots.sound_speed_m_per_s;
  const [pinged, told, chance] = [0, 1, 2].map(() => new Float64Array(auvs * rounds)), [late, kind] = [0, 1].map(() => new Int32Array(auvs * rounds));
  const passive = access.ranging.asvs_ping, byGroup = access.downlink.by_group;
  const tick = slots.tick_rate_hz === 0 ? 0 : 1 / slots.tick_rate_hz, senders = new Senders(inputs, sights, found, plan);
  for (let auv = 0, i = 0; auv < auvs; auv++) for (let round = 0; round < rounds; round++, i++) {
    const k = at[round], slot = plan.slot[auv * instants + k];
    pinged[i] = begin[round] + slot * plan.pitch[k];
    late[i] = Math.min(Math.trunc(pinged[i] / step + 0.5), instants - 1);
    const row = auv * instants + late[i];
    if (passive) {
      kind[i] = number[round] % asvs;
      chance[i] = found.chance[row * asvs + kind[i]];
      told[i] = pinged[i] + slant[row * asvs + kind[i]] / c + slots.ping_s;
      continue;
    }
    chance[i] = found.chance[row];
    if (access.schedule.turn === "rotation" && round % auvs !== auv) chance[i] = 0;
    if (access.schedule.turn === "lot") chance[i] /= auvs;
    if (access.downlink.replies) {
      told[i] = pinged[i] + 2 * slant[nearestOf(slant, row, asvs)] / c + access.reply_s + (access.replies_in_frames ? 0.5 * tick : 0);
      continue;
    }
    const [hears, way] = senders.at(auv, late[i], byGroup ? number[round] + slot : number[round]);
    told[i] = (byGroup ? pinged[i] : begin[round]) + plan.send[k] + plan.frame[k] + way / c + 0.5 * tick;
    chance[i] *= hears;
  }
  if (access.replies_in_frames) chance.set(answered(sights, plan, { at, late, chance }, access.frame_s > 0));
  return { rounds, pinged, told, chance, late, kind, many };
}

// How likely pings are answered: each of the first ASV that hears it, unless an answer to another that
// has pinged in the same slot, of the ASV nearest to that, is heard as well.
function answered(sights, plan, { at, late, chance }, alone) {
  const { auvs, instants, asvs, level, told } = sights, byFirst = Float64Array.from({ length: auvs * instants }, (_, row) => toldByFirst(sights, row));
  const rounds = at.length, found = new Float64Array(chance.length);
  const nearest = (auv, round) => nearestOf(level, auv * instants + late[auv * rounds + round], asvs) % asvs;
  for (let auv = 0, i = 0; auv < auvs; auv++) for (let round = 0; round < rounds; round++, i++) {
    const row = auv * instants + late[i], first = row * asvs, slotOf = (it) => plan.slot[it * instants + at[round]];
    let heard = byFirst[row];
    for (let other = 0; other < auvs && !alone; other++) {
      if (other !== auv && slotOf(other) === slotOf(auv)) heard *= 1 - chance[other * rounds + round] * told[first + nearest(other, round)];
    }
    found[i] = chance[i] * heard;
  }
  return found;
}

// Who broadcasts: how likely an AUV decodes that, and over which way (m).
class Senders {
  constructor(inputs, sights, found, plan) {
    Object.assign(this, { sights, chosenBy: inputs.access.broadcaster.chosen_by, atOnce: inputs.access.broadcaster.at_once, fixed: inputs.access.fixed_asv });
    if (!["hearing", "distance"].includes(this.chosenBy)) return;
    const { auvs, instants } = sights, fleet = Array.from({ length: auvs }, (_, auv) => auv), byGroup = inputs.access.downlink.by_group;
    const alone = this.atOnce || inputs.access.frame_s > 0; // a frame has the fix of one AUV, else those of its ping group or of all
    const frameOf = (auv, k) => fleet.filter((other) => !byGroup || plan.slot[other * instants + k] === plan.slot[auv * instants + k]);
    this.best = Int32Array.from({ length: auvs * instants }, (_, row) => {
      const auv = Math.floor(row / instants), k = row % instants;
      return this.choose(found, k, alone ? [auv] : frameOf(auv, k));
    });
  }
  choose(found, k, auvs) {
    const { instants, asvs, heard, level } = this.sights, most = this.chosenBy === "hearing";
    const scores = Array.from({ length: asvs }, (_, asv) => {
      let score = 0;
      for (const auv of auvs) {
        const row = auv * instants + k, n = row * asvs + asv;
        const weight = this.atOnce ? 1 : found.chance[found.kinds === 1 ? row : n];
        score += most ? -heard[n] : weight * level[n];
      }
      return score;
    });
    return scores.reduce((best, it, asv) => (it < scores[best] ? asv : best), 0);
  }
  at(auv, k, number) {
    const { instants, asvs, told, level } = this.sights, row = auv * instants + k, first = row * asvs;
    if (this.chosenBy === "lot") {
      let [sum, ways] = [0, 0];
      for (let asv = 0; asv < asvs; asv++) { sum += told[first + asv]; ways += level[first + asv]; }
      return [sum / asvs, ways / asvs];
    }
    const asv = this.chosenBy === "turn" ? number % asvs : this.chosenBy === "one" ? this.fixed : this.best[row];
    return [told[first + asv], level[first + asv]];
  }
}

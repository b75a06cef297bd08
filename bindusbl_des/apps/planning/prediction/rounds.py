"""The expected rounds of a mission: when each AUV pings and receives its fix."""

import math
from typing import NamedTuple

import numpy as np

from ....core.protocol.conflicts import dsatur_groups, greedy_colours
from ....support.arrays import Flags, Floats, Ints
from ....support.compiled import compiled
from ...preflight.fix_chance import by_first, senders
from .inputs import Inputs, SlotLengths
from .sights import ExpectedSights, added, located

# The most rounds to compute; more are grouped, each group with one fix that counts several times.
MOST_ROUNDS = 3000


class RoundPlan(NamedTuple):
    """The rounds at each of k instants.

    `slot` (n, k) is each AUV's slot, `pitch_s` the time from slot to slot, `send_s` from a round's
    start to its broadcast, `frame_s` from that to the frame's end, `period_s` from round to round;
    `broadcasts` counts those of a round, (k,) each.
    """

    slot: Ints
    pitch_s: Floats
    send_s: Floats
    frame_s: Floats
    period_s: Floats
    broadcasts: Ints


class Turns(NamedTuple):
    """The turns of n AUVs in r rounds: time of ping and delivery (s), probability of a fix, instant
    of the paths, and kind of fix, (n, r) each.

    Each round stands for `many` equal ones.
    """

    pinged_s: Floats
    delivered_s: Floats
    chance: Floats
    at: Ints
    kind: Ints
    many: int


def uplink_slot(slots: SlotLengths, hf_range: float, by_slant: bool) -> float:
    """Return the length (s) of an uplink slot (eq. UL_slot) for an HF range (m)."""
    if slots.fixed_uplink_s is not None:
        return in_ticks(slots, slots.fixed_uplink_s)
    way = hf_range if by_slant else math.sqrt(hf_range**2 + slots.deepest_m**2)
    ways = slots.ways * (slots.ping_s + way / slots.sound_speed_m_per_s)
    least = max(ways + slots.turnaround_s + slots.uplink_guard_s, slots.shortest_uplink_s)
    return in_ticks(slots, least + slots.answer_s)


def in_ticks(slots: SlotLengths, duration: float) -> float:
    """Return a duration (s) rounded up to whole ticks, if there are ticks."""
    rate = slots.tick_rate_hz
    return duration if rate == 0.0 else math.ceil(duration * rate - 1e-9) / rate


def planned_rounds(inputs: Inputs, sights: ExpectedSights) -> RoundPlan:
    """Return the rounds at each instant of the paths."""
    access, slots = inputs.access, inputs.slots
    uplink = uplink_slot(slots, inputs.hf.range_m, inputs.hf.by_slant)
    auvs, instants = sights.in_range.shape[:2]
    found = located(inputs, sights).sum(axis=2)
    expected = np.minimum(added(found.T), float(auvs))
    if access.ranging.asvs_ping:
        ones, zeros = np.ones(instants), np.zeros((auvs, instants), dtype=np.int64)
        return RoundPlan(zeros, uplink * ones, 0.0 * ones, 0.0 * ones, uplink * ones, _whole(ones))
    if access.frame_s > 0.0:
        expected = expected / auvs
    slot, groups = _grouped(access.schedule.groups, sights.in_range)
    return RoundPlan(slot, *timed(inputs, uplink, groups, expected))


def timed(
    inputs: Inputs, uplink: float, groups: Floats, expected: Floats
) -> tuple[Floats, Floats, Floats, Floats, Ints]:
    """Return all fields of :class:`RoundPlan` but `slot`, for ping groups (k,), an uplink slot (s),
    and an expected number of fixes (k,), which may be fractional.

    For whole numbers they equal what the downlinks' generators do
    (:mod:`....core.protocol.cycles`).
    """
    access, slots = inputs.access, inputs.slots
    busy, none = groups * uplink, np.zeros(len(groups))
    if access.downlink.replies:
        return uplink + none, none, none, np.maximum(busy, access.frame_s), _whole(none)
    by_group = access.downlink.by_group
    fixes = expected / groups if by_group else expected
    downlink, frame = _between(slots.downlink_s, fixes), _between(slots.frame_s, fixes)
    if by_group:
        pitch = np.maximum(uplink, downlink)
        period = np.maximum(groups * pitch, access.frame_s)
        return pitch, pitch, frame, period, _whole(groups)
    if not access.downlink.waits:
        send = np.maximum(busy, downlink)
        period = np.maximum(send, access.frame_s)
    else:
        send, period = busy, np.maximum(busy + downlink, access.frame_s)
    return uplink + none, send, frame, period, _whole(none + 1.0)


def _whole(numbers: Floats) -> Ints:
    return numbers.astype(np.int64)


def _between(table: Floats, fixes: Floats) -> Floats:
    """Interpolate a table at fractional numbers of fixes."""
    low = np.minimum(fixes.astype(np.int64), max(len(table) - 2, 0))
    return np.asarray(table[low] + (fixes - low) * (table[low + 1] - table[low]))


def _grouped(groups: str, in_range: Flags) -> tuple[Ints, Floats]:
    """Return the slot of each AUV (n, k), and the number of slots (k,)."""
    auvs, instants, _ = in_range.shape
    slot = np.zeros((auvs, instants), dtype=np.int64)
    if groups == "each":
        slot[:] = np.arange(auvs)[:, np.newaxis]
        return slot, np.full(instants, float(auvs))
    if groups == "frame":
        return slot, np.ones(instants)
    if groups == "saturation":
        for instant in range(instants):
            found = dsatur_groups(np.ascontiguousarray(in_range[:, instant]))
            for number, group in enumerate(found):
                slot[list(group), instant] = number
    else:
        _greedily(in_range, slot)
    return slot, slot.max(axis=0) + 1.0


@compiled
def _greedily(in_range: Flags, slot: Ints) -> None:
    for instant in range(slot.shape[1]):
        colours = np.empty(len(slot), dtype=np.int64)
        greedy_colours(in_range[:, instant].copy(), colours)
        slot[:, instant] = colours


def turns_of(inputs: Inputs, sights: ExpectedSights, plan: RoundPlan) -> Turns:
    """Return the turns of AUVs in all rounds of a mission."""
    access, ways = inputs.access, inputs.ways
    step, end = ways.times_s[1], inputs.duration_s
    expected = end * float((1.0 / plan.period_s).mean())
    many = max(math.ceil(expected / MOST_ROUNDS), 1)
    begin, at, number = _begun(plan.period_s, plan.broadcasts, step, end, many)
    auvs, _, asvs = sights.heard.shape
    slot, pitch = np.ascontiguousarray(plan.slot[:, at]), plan.pitch_s[at]
    pinged = begin + slot * pitch
    late = np.minimum((pinged / step + 0.5).astype(np.int64), len(ways.times_s) - 1)
    rows = np.arange(auvs)[:, np.newaxis]
    found, c = located(inputs, sights), inputs.slots.sound_speed_m_per_s
    if access.ranging.asvs_ping:
        kind = np.tile(number % asvs, (auvs, 1))
        chance = found[rows, late, kind]
        delivered = pinged + sights.slant_m[rows, late, kind] / c + inputs.slots.ping_s
        return Turns(pinged, delivered, chance, late, kind, many)
    kind = np.zeros(pinged.shape, dtype=np.int64)
    chance = found[rows, late, kind]
    if access.schedule.turn == "rotation":
        chance = np.where(np.arange(len(at)) % auvs == rows, chance, 0.0)
    elif access.schedule.turn == "lot":
        chance = chance / auvs
    if access.downlink.replies:
        way = sights.slant_m.min(axis=2)
        delivered = pinged + 2.0 * way[rows, late] / c + access.reply_s
        if access.replies_in_frames:
            delivered = delivered + 0.5 * _tick(inputs.slots)
            alone = access.frame_s > 0.0  # one AUV pings in each frame
            together = np.broadcast_to(rows, slot.shape) if alone else slot
            chance = chance * _answered(sights, together, chance, late)
        return Turns(pinged, delivered, chance, late, kind, many)
    by_group = access.downlink.by_group
    base = pinged + plan.send_s[at] if by_group else begin + plan.send_s[at]
    sender = number + slot if by_group else np.broadcast_to(number, pinged.shape)
    alone = access.broadcaster.at_once or access.frame_s > 0.0
    frame = None if alone else plan.slot * by_group
    hears, way = _by_sender(inputs, sights, frame, sender, late)
    delivered = base + plan.frame_s[at] + way / c + 0.5 * _tick(inputs.slots)
    return Turns(pinged, delivered, chance * hears, late, kind, many)


def _answered(sights: ExpectedSights, slot: Ints, chance: Floats, at: Ints) -> Floats:
    """Return the probability (n, r) that AUVs decode the answers of the first ASVs to hear them.

    Others ping in the same `slot` (n, r), and their nearest ASVs answer them with probability
    `chance` (n, r) at the same time: an AUV that hears such an answer loses both.
    """
    auvs, rows = len(slot), np.arange(len(slot))[:, np.newaxis]
    nearest = sights.level_m.argmin(axis=2)[rows, at]
    heard = by_first(sights.heard, sights.delivered, sights.level_m)[rows, at]
    for other in range(auvs):
        overheard = sights.delivered[rows, at, nearest[other]]
        beside = (slot == slot[other]) & (rows != other)
        heard = heard * np.where(beside, 1.0 - chance[other] * overheard, 1.0)
    return np.asarray(heard)


def _tick(slots: SlotLengths) -> float:
    return 0.0 if slots.tick_rate_hz == 0.0 else 1.0 / slots.tick_rate_hz


def _by_sender(
    inputs: Inputs, sights: ExpectedSights, frame: Ints | None, number: Ints, at: Ints
) -> tuple[Floats, Floats]:
    """Return the probability that AUVs decode broadcasts (n, r), and the horizontal distance (m).

    `number` (n, r) counts broadcasts.  AUVs with the same `frame` (n, k) share one; None: each has
    its own.
    """
    chosen, rows = inputs.access.broadcaster, np.arange(len(number))[:, np.newaxis]
    asvs = sights.delivered.shape[2]
    if chosen.chosen_by == "lot":
        return sights.delivered.mean(axis=2)[rows, at], sights.level_m.mean(axis=2)[rows, at]
    if chosen.chosen_by == "turn":
        sender = number % asvs
    elif chosen.chosen_by == "one":
        sender = np.full(number.shape, inputs.access.fixed_asv)
    else:
        at_instants = (sights.heard, sights.level_m, located(inputs, sights))
        heard, away, found = (of_auvs.swapaxes(0, 1) for of_auvs in at_instants)
        together = None if frame is None else frame.T
        sender = senders(chosen, heard, away, found, together).T[rows, at]
    return sights.delivered[rows, at, sender], sights.level_m[rows, at, sender]


@compiled
def _begun(
    period: Floats, broadcasts: Ints, step: float, end: float, many: int
) -> tuple[Floats, Ints, Ints]:
    """Return the begin (s), instant and number of the first broadcast of each round, (r,) each."""
    begin, at = np.empty(4 * MOST_ROUNDS), np.empty(4 * MOST_ROUNDS, dtype=np.int64)
    number, count, time, sent = np.empty(4 * MOST_ROUNDS, dtype=np.int64), 0, 0.0, 0
    while time < end and count < begin.size:
        k = min(int(time / step + 0.5), period.size - 1)
        begin[count], at[count], number[count] = time, k, sent
        time += many * period[k]
        sent += broadcasts[k]
        count += 1
    return begin[:count].copy(), at[:count].copy(), number[:count].copy()

"""Rounds played against a protocol by somebody who wants its signals to meet.

Nothing here knows the verifier's inequalities: AUVs are put at worst corners or anywhere, move as
fast as they may, clocks and sound are at their worst or in between; who shares a slot is the
package's own choice.  Whatever then overlaps at a receiver is counted.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bindusbl_des import Scenario, Setup
from bindusbl_des.apps.verification.case import Bounds
from bindusbl_des.core.protocol.conflicts import dsatur_groups, greedy_groups

Array = NDArray[np.float64]
COLOURS = {"spatial_reuse": greedy_groups, "dsatur": dsatur_groups}
WORST_FIRST_SLOTS = 4

# Rounding of instants, as the simulator has it
TOUCH = 1e-9


@dataclass
class Worlds:
    """Many rounds at once: n trials of N AUVs that move straight, and M ASVs at rest."""

    scenario: Scenario
    bounds: Bounds
    draw: np.random.Generator
    trials: int

    def __post_init__(self) -> None:
        scenario, n, draw = self.scenario, self.trials, self.draw
        self.stations = np.array(Setup(scenario).stations_m)
        self.auvs, self.asvs = scenario.auvs.count, len(self.stations)
        self.slots, self.protocol = Setup(scenario).slots, scenario.protocol
        hf = scenario.acoustics.hf
        self.reach, self.lasts, self.slant = hf.range_m, hf.ping_s, hf.range_metric == "slant"
        self.depth = np.array([auv.depth_m for auv in Setup(scenario).auvs])
        error = self.bounds.sound_speed_error_m_per_s
        worst = draw.choice((-error, error), n)
        off = np.where(draw.random(n) < 0.7, worst, draw.uniform(-error, error, n))
        self.sound = Setup(scenario).assumed_sound_speed_m_per_s + off
        late = 2 * self.bounds.clock_error_s
        some = draw.uniform(0.0, late, (n, self.auvs))
        self.late = np.where(draw.random((n, self.auvs)) < 0.6, some.round() * 0 + late, some)
        self.late[draw.random((n, self.auvs)) < 0.4] = 0.0
        self.start, self.velocity = self._moving()

    def _moving(self) -> tuple[Array, Array]:
        """Return where AUVs begin (n, N, 2), m, and how they move, m/s."""
        n, count, draw = self.trials, self.auvs, self.draw
        at = self.draw.integers(self.asvs, size=(n, count))
        about = self.stations[at]
        bearing = draw.uniform(0, 2 * np.pi, (n, count))
        toward = self.stations[draw.integers(self.asvs, size=(n, count))] - about
        along = np.arctan2(toward[..., 1], toward[..., 0]) + draw.choice((0.0, np.pi), (n, count))
        bearing = np.where(draw.random((n, count)) < 0.5, along, bearing)
        margin = self.protocol.conflict_margin_m
        level = np.where(
            self.slant, np.sqrt(np.maximum((self.reach + margin) ** 2 - self.depth**2, 0.0)),
            self.reach + margin,
        )  # fmt: skip
        hears = np.where(
            self.slant, np.sqrt(np.maximum(self.reach**2 - self.depth**2, 0.0)), self.reach
        )
        kinds = draw.integers(6, size=(n, count))
        tiny = draw.choice((-1e-9, 1e-9, 1e-4), (n, count))
        away = np.choose(
            kinds,
            [
                np.broadcast_to(level, (n, count)) * (1 + tiny),
                np.broadcast_to(hears, (n, count)) * (1 - 1e-12),
                np.zeros((n, count)),
                draw.uniform(0, 1.3, (n, count)) * self.reach,
                np.linalg.norm(toward, axis=2) / 2,
                np.broadcast_to(level, (n, count)) + draw.uniform(0, 1, (n, count)),
            ],
        )
        place = about + away[..., None] * np.stack((np.cos(bearing), np.sin(bearing)), axis=2)
        aim = np.where(
            (draw.random((n, count)) < 0.7)[..., None],
            self.stations[self.draw.integers(self.asvs, size=(n, count))] - place,
            draw.normal(size=(n, count, 2)),
        )
        inward = (about - place) * draw.choice((-1.0, 1.0, 1.0), (n, count))[..., None]
        aim = np.where((draw.random((n, count)) < 0.5)[..., None], inward, aim)
        norm = np.linalg.norm(aim, axis=2, keepdims=True)
        speed = self.bounds.max_speed_m_per_s * draw.choice((0.0, 1.0, 1.0), (n, count, 1))
        return place, speed * np.divide(aim, norm, out=np.zeros_like(aim), where=norm > 0)

    def place(self, time: Array) -> Array:
        """Return where AUVs are at instants (n, N), s: (n, N, 2)."""
        return self.start + self.velocity * time[..., None]

    def away(self, time: Array) -> tuple[Array, Array]:
        """Return how far AUVs are from ASVs at instants (n, N), aslant and as the range is
        measured, (n, N, M).
        """
        level = np.linalg.norm(self.place(time)[:, :, None] - self.stations, axis=3)
        aslant = np.hypot(level, self.depth[:, None])
        return aslant, aslant if self.slant else level

    def after(self, times: Array, duration: float) -> Array:
        """Return instants a duration later on the clock of the protocol (all at equal ticks)."""
        step = self.slots.clock.after(0.0, duration)
        return times + step


def overlaps(scenario: Scenario, bounds: Bounds, rounds: int, seed: int) -> int:
    """Play so many rounds; return in how many pairs of them signals overlapped."""
    worlds = Worlds(scenario, bounds, np.random.default_rng(seed), max(rounds // 2, 1))
    play = {"owtt_sync": _one_way, "twtt": _two_way, "passive": _passive}
    return int(play[str(scenario.protocol.ranging)](worlds).sum()) + int(_frames(worlds).sum())


def _slots_of_round(worlds: Worlds, number: int, begins: Array) -> tuple[Array, Array]:
    """Return the slot of each AUV in a round (n, N), NaN for none, and how many slots it has."""
    n, count = worlds.trials, worlds.auvs
    schedule = str(worlds.protocol.schedule)
    if schedule == "one_per_slot":
        return np.tile(np.arange(count, dtype=float), (n, 1)), np.full(n, count)
    if schedule in ("round_robin", "random"):
        slots = np.full((n, count), np.nan)
        offset = worlds.draw.integers(count, size=n)
        who = (offset + number) % count
        if schedule == "random":
            who = worlds.draw.integers(count, size=n)
        slots[np.arange(n), who] = 0.0
        return slots, np.ones(n, dtype=int)
    believed = worlds.away(np.repeat(begins[:, None], count, axis=1))[1]
    heard = believed <= worlds.reach + worlds.protocol.conflict_margin_m
    slots, most = np.full((n, count), np.nan), np.empty(n, dtype=int)
    for trial in range(n):
        order = np.arange(count)
        if schedule == "worst_first":  # claims may be any
            order = worlds.draw.permutation(count)
        groups = COLOURS.get(schedule, greedy_groups)(np.ascontiguousarray(heard[trial, order]))
        groups = groups[:WORST_FIRST_SLOTS] if schedule == "worst_first" else groups
        most[trial] = len(groups)
        for slot, group in enumerate(groups):
            slots[trial, order[list(group)]] = slot
    return slots, most


def _turns(worlds: Worlds) -> Array:
    """Return when AUVs' slots begin in two rounds, one after the other (n, 2 N), NaN for none."""
    begins, turns, slots = np.zeros(worlds.trials), [], worlds.slots
    step = slots.clock.after(0.0, slots.uplink_slot)
    if worlds.protocol.downlink == "pipelined_group":
        wait = slots.clock.after(0.0, slots.downlink_slot(worlds.auvs))
        slow = worlds.draw.random(worlds.trials) < 0.5
        step = np.where(slow, max(step, wait), step)  # while a broadcast goes on
    for number in range(2):
        at, most = _slots_of_round(worlds, number, begins)
        turns.append(begins[:, None] + at * np.broadcast_to(step, (worlds.trials,))[:, None])
        ends = begins + most * step
        if worlds.protocol.downlink == "sequential":
            ends = ends + slots.clock.after(0.0, slots.downlink_slot(0))
        frame = (
            worlds.protocol.frame_s
            if str(worlds.protocol.schedule) in ("round_robin", "random")
            else 0.0
        )
        begins = np.maximum(ends, slots.clock.after(0.0, frame)) if frame else ends
    return np.concatenate(turns, axis=1)


def _doubled(worlds: Worlds, call: str, times: Array) -> Array:
    first, second = np.hsplit(times, 2)
    parts = [worlds.away(np.nan_to_num(part)) for part in (first, second)]
    return np.concatenate([part[0 if call == "aslant" else 1] for part in parts], axis=1)


def _met(arrivals: Array, lasts: float) -> NDArray[np.bool_]:
    """Return in which trials two of the arrivals (n, signals, receivers) overlap at a receiver."""
    order = np.sort(np.where(np.isnan(arrivals), np.inf, arrivals), axis=1)
    with np.errstate(invalid="ignore"):
        gaps = np.diff(order, axis=1)
    return np.asarray((gaps < lasts - TOUCH).any(axis=(1, 2)))


def _one_way(worlds: Worlds) -> NDArray[np.bool_]:
    pings = _turns(worlds) + np.tile(worlds.late, 2)
    aslant, ranged = (_doubled(worlds, kind, pings) for kind in ("aslant", "ranged"))
    arrive = pings[..., None] + aslant / worlds.sound[:, None, None]
    arrive[ranged > worlds.reach] = np.nan
    return _met(arrive, worlds.lasts)


def _two_way(worlds: Worlds) -> NDArray[np.bool_]:
    calls = _turns(worlds)  # of one AUV in a slot, or of one ASV for all
    ranged = _doubled(worlds, "ranged", calls)
    aslant = _doubled(worlds, "aslant", calls)
    level = np.sqrt(np.maximum(aslant**2 - np.tile(worlds.depth, 2)[:, None] ** 2, 0.0))
    caller = level.argmin(axis=2)
    pick = np.take_along_axis
    audible = pick(ranged, caller[..., None], axis=2)[..., 0] <= worlds.reach
    travel = pick(aslant, caller[..., None], axis=2)[..., 0] / worlds.sound[:, None]
    for _ in range(4):
        at = _doubled(worlds, "aslant", calls + travel)
        travel = pick(at, caller[..., None], axis=2)[..., 0] / worlds.sound[:, None]
    answers = calls + travel + worlds.lasts + worlds.protocol.turnaround_s
    aslant, ranged = (_doubled(worlds, kind, answers) for kind in ("aslant", "ranged"))
    arrive = answers[..., None] + aslant / worlds.sound[:, None, None]
    arrive[(ranged > worlds.reach) | ~audible[..., None]] = np.nan
    apart = np.linalg.norm(worlds.stations[:, None] - worlds.stations, axis=2)
    sound = calls[..., None] + apart[caller] / worlds.sound[:, None, None]
    sound[apart[caller] > worlds.reach] = np.nan
    drowned = np.zeros(worlds.trials, dtype=bool)
    for number in range(calls.shape[1]):
        with np.errstate(invalid="ignore"):
            near = np.abs(arrive - sound[:, number : number + 1]) < worlds.lasts - TOUCH
        drowned |= near.any(axis=(1, 2))
    return drowned | _met(arrive, worlds.lasts) | _calls_met(worlds, calls, caller)


def _calls_met(worlds: Worlds, calls: Array, caller: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return in which trials an AUV hears its call and that of another ASV at once."""
    aslant, ranged = (_doubled(worlds, kind, calls) for kind in ("aslant", "ranged"))
    met = np.zeros(worlds.trials, dtype=bool)
    for one in range(calls.shape[1]):
        travel = aslant[:, one] / worlds.sound[:, None]
        own = np.take_along_axis(travel, caller[:, one, None], axis=1)
        for other in range(calls.shape[1]):
            same = np.abs(calls[:, one] - calls[:, other]) < TOUCH
            by = caller[:, other]
            hers = np.take_along_axis(travel, by[:, None], axis=1)
            near = np.take_along_axis(ranged[:, one], by[:, None], axis=1) <= worlds.reach
            mine = np.take_along_axis(ranged[:, one], caller[:, one, None], axis=1) <= worlds.reach
            both = near & mine & (np.abs(own - hers) < worlds.lasts - TOUCH)
            met |= same & (by != caller[:, one]) & both[:, 0]
    return met


def _passive(worlds: Worlds) -> NDArray[np.bool_]:
    n, slots = worlds.trials, worlds.slots
    step = slots.clock.after(0.0, slots.uplink_slot)
    arrivals = []
    for slot in range(2 * worlds.asvs):
        sent = np.full((n, worlds.auvs), slot * step)
        aslant, ranged = (it[:, :, slot % worlds.asvs] for it in worlds.away(sent))
        came = sent + aslant / worlds.sound[:, None]
        for _ in range(3):
            came = sent + worlds.away(came)[0][:, :, slot % worlds.asvs] / worlds.sound[:, None]
        came[ranged > worlds.reach] = np.nan
        arrivals.append(came)
    return _met(np.stack(arrivals, axis=1), worlds.lasts)


def _frames(worlds: Worlds) -> NDArray[np.bool_]:
    """Return in which trials a broadcast is still at an AUV when the next begins there."""
    protocol, slots, n = worlds.protocol, worlds.slots, worlds.trials
    if protocol.asvs_ping or protocol.downlink == "direct_reply":
        return np.zeros(n, dtype=bool)
    band, draw = worlds.scenario.acoustics.mf, worlds.draw
    deep = worlds.depth[draw.integers(worlds.auvs, size=n)]
    mf = np.full(n, band.range_m)
    if band.range_metric == "slant":
        mf = np.sqrt(np.maximum(mf**2 - deep**2, 0.0))
    one, other = draw.integers(worlds.asvs, size=(2, n))
    if protocol.broadcaster == "rotate":
        other = (one + 1) % worlds.asvs
    way = worlds.stations[other] - worlds.stations[one]
    norm = np.linalg.norm(way, axis=1, keepdims=True)
    unit = np.divide(way, norm, out=np.tile([1.0, 0.0], (n, 1)), where=norm > 0)
    begins = worlds.stations[one] + unit * mf[:, None] * draw.choice((1 - 1e-12, 0.9, 0.5), (n, 1))
    velocity = draw.choice((-1.0, 1.0), (n, 1)) * unit * worlds.bounds.max_speed_m_per_s
    schedule, framed = str(protocol.schedule), str(protocol.schedule) in ("round_robin", "random")
    alone, in_groups = schedule == "one_per_slot", protocol.downlink == "pipelined_group"
    most = worlds.auvs  # whom somebody hears in a round, or in a slot
    if framed or (alone and in_groups):
        most = 1
    elif in_groups:
        most = min(most, worlds.asvs)
    fixes = int(draw.integers(most + 1))
    airtime = slots.airtime(fixes)
    lasts = slots.clock.after(0.0, slots.downlink_slot(fixes))
    uplink = 0.0
    for _ in range(worlds.auvs if alone and not in_groups else 1):
        uplink = slots.clock.after(uplink, slots.uplink_slot)
    sent = lasts + uplink if protocol.downlink == "sequential" else max(lasts, uplink)
    if framed:  # a tick early at most
        tick = 1.0 / protocol.tick_rate_hz if protocol.tick_rate_hz else 0.0
        sent = max(sent, protocol.frame_s - tick)

    def meets(asv: NDArray[np.int64], time: float) -> Array:
        came = np.full(n, time)
        for _ in range(5):
            level = np.linalg.norm(begins + velocity * came[:, None] - worlds.stations[asv], axis=1)
            came = time + np.hypot(level, deep) / worlds.sound
        return came

    at_next = np.linalg.norm(begins + velocity * sent - worlds.stations[other], axis=1)
    return np.asarray((at_next <= mf) & (meets(one, airtime) > meets(other, sent) + TOUCH))

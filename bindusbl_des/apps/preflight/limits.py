"""What medium, modems and conflict graph make possible in a scenario.

The planned positions of AUVs and ASVs decide who is in range of whom, and so the ping groups of a
round; from that follow the rates of fixes if only range loses pings and frames.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ...core.protocol.conflicts import GROUPINGS
from ...core.protocol.cycles import cycle
from ...core.protocol.slots import Slots
from ...core.scenario import families
from ...core.scenario.scenario import Scenario
from ...core.setup import Setup
from ...support.arrays import Flags, Floats, Ints
from .bounds import (
    EXACT_UP_TO,
    aloha_capacity,
    clique_number,
    decode_bound,
    disjoint_senders,
    fewest_groups,
    latency_bound,
    most_heard,
    record_bound,
    reuse_bound,
    slotted_aloha_capacity,
)
from .fix_chance import (
    LOOKED_UP,
    frame_chance,
    made_and_delivered,
    ping_chance,
    told_ahead,
)
from .round_lengths import Rounds, rounds_of

# Number of instants at which a mission is evaluated; fewer if pairs of AUV and ASV, or of AUVs that
# may share a slot, would exceed these numbers.
INSTANTS, MOST_PAIRS, MOST_CHOICES = 121, 4_000_000, 121_000_000

# Downlinks whose rates are computed beside those of the scenario's own rounds.
COMPARED = tuple(name for name, traits in families.DOWNLINK.traits.items() if traits.is_foreseen)

# The length of a round is computed for numbers of fixes that are likelier than this, for at most so
# many numbers of fixes and of groups; others are interpolated.
HARDLY_EVER, MOST_LENGTHS = 1e-6, 17

# The most records of a frame that are tried for the highest rate of records.
MOST_RECORDS = 1000


class SurveySights(NamedTuple):
    """Who hears whom, of n AUVs and m ASVs, at k instants (s), evenly spread.

    `heard` and `reached` (k, n, m): the ASV is in HF range of the AUV's ping, the AUV in MF range
    of the ASV's frame.  `away_m` (k, n, m): their distance (m), infinite for a failed ASV.  `pings`
    and `frames` (k, n, m): the chances of decoding without other sounds.  `at_best` (k, n): the
    chance that a ping's fix is delivered alone in a frame by the ASV that reaches the AUV best.
    With user-defined channels, the chances are 1 in range and 0 elsewhere.
    """

    times_s: Floats
    heard: Flags
    reached: Flags
    away_m: Floats
    pings: Floats
    frames: Floats
    at_best: Floats


def planned_sights(setup: Setup) -> SurveySights:
    """Return who is in range of whom by the plans of a scenario.

    Raises:
        ValueError: when the route cannot be flown.
        PluginError: when a user-defined part is not allowed or fails.
    """
    times, vehicles = instants(setup.scenario), setup.planned_auvs
    auvs = np.empty((len(times), len(vehicles), 3))
    for auv, vehicle in enumerate(vehicles):
        auvs[:, auv, :2] = vehicle.sample(times)[:, :2]
        auvs[:, auv, 2] = setup.auvs[auv].depth_m
    stations = np.array(setup.nominal_stations_m, dtype=np.float64)  # a ring for those that move
    asvs = np.column_stack((stations, np.zeros(len(stations))))
    return sights(setup, times, auvs, np.broadcast_to(asvs, (len(times), *asvs.shape)))


def instants(scenario: Scenario, most: int = INSTANTS) -> Floats:
    """Return the instants (s) at which a mission is evaluated: the middles of equal parts of it.

    There are `most` of them, fewer for many vehicles.
    """
    auvs, pairs = scenario.auvs.count, scenario.auvs.count * scenario.asvs.count
    count = max(min(most, MOST_PAIRS // pairs, MOST_CHOICES // auvs**2), 1)
    return np.asarray((np.arange(count) + 0.5) * scenario.duration_s / count)


def sights(setup: Setup, times: Floats, auvs: Floats, asvs: Floats) -> SurveySights:
    """Return who is in range of whom, for AUVs (k, n, 3) and ASVs (k, m, 3), m, at instants (k,),
    s.

    An ASV that has failed neither hears nor is heard.
    """
    scenario = setup.scenario
    hf, mf = scenario.acoustics.hf, scenario.acoustics.mf
    apart = auvs[:, :, np.newaxis, :] - asvs[:, np.newaxis, :, :]
    level = np.hypot(apart[..., 0], apart[..., 1])
    slant = np.hypot(level, apart[..., 2])
    broken = np.zeros((len(times), 1, asvs.shape[1]), dtype=np.bool_)
    for failure in scenario.asvs.failures:
        broken[[failure.lasts(time) for time in times.tolist()], 0, failure.asv] = True
    clear = np.broadcast_to(~broken, slant.shape)
    if setup.land is not None:
        blocked = map(setup.land.crossed, auvs, asvs)
        clear = clear & ~np.stack(list(blocked))
    heard = ((slant if hf.range_metric == "slant" else level) <= hf.range_m) & clear
    away = np.where(broken, np.inf, slant)
    reached = ((slant if mf.range_metric == "slant" else level) <= mf.range_m) & clear
    pings = _chances(setup, slant, heard, clear, "hf", ping_chance)
    frames = _chances(setup, slant, reached, clear, "mf", frame_chance)
    at_best = made_and_delivered(setup, pings, frames, away)[0]
    if not scenario.protocol.asvs_ping:  # the shortest frames are lost least
        shortest = partial(frame_chance, fixes=1)
        at_best = at_best * _chances(setup, slant, reached, clear, "mf", shortest).max(axis=2)
    return SurveySights(times, heard, reached, away, pings, frames, at_best)


def told(setup: Setup, sights: SurveySights, downlink: str) -> tuple[Floats, Floats, int]:
    """Return the chances that a ping makes a fix, and that a downlink delivers it, (k, n), and a
    cycle.

    The cycle is the number of broadcasts after which the one with an AUV's fix recurs: 1 where that
    changes, or all AUVs share a broadcast.
    """
    rule, schedule = setup.broadcaster, setup.schedule
    known = families.DOWNLINK.traits.get(downlink)
    by_group = known is not None and known.by_group and not schedule.framed
    fleet, slots, number = np.arange(setup.scenario.auvs.count), None, None
    is_own = schedule.framed  # each AUV has a broadcast of its own
    if by_group:
        is_own = schedule.groups == "each" and not setup.schedule_settings.shares_calls
        slots = fleet[np.newaxis] if is_own else slots_made(schedule, sights.heard)
        number = None if slots is None or (slots != slots[0]).any() else slots[0]
    elif schedule.framed and schedule.turn == "rotation" and known is not None:
        number = fleet
    if number is not None and _some_wait(setup, sights, int(np.bincount(number).max())):
        number = None
    frame = None if rule.at_once or is_own else np.zeros_like(fleet) if slots is None else slots
    cycle = 1 if number is None else int(number.max()) + 1
    made, delivered = made_and_delivered(
        setup, sights.pings, sights.frames, sights.away_m, frame=frame, cycle=cycle,
        number=0 if number is None else number,
        ahead=0 if by_group else told_ahead(setup, downlink),
    )  # fmt: skip
    return made, delivered, cycle


def _some_wait(setup: Setup, sights: SurveySights, fixes: int) -> bool:
    """Tell whether fixes may miss their group's broadcast, for lack of a working ASV or of room."""
    messages = setup.messages
    is_short = messages.most is not None and not messages.splits
    is_late = is_short and (setup.scenario.protocol.calls or (messages.most or 0) < fixes)
    return is_late or bool(np.isinf(sights.away_m).all(axis=2).any())


def _chances(
    setup: Setup, slant: Floats, in_range: Flags, works: Flags, band: str,
    chance: Callable[[Setup, Floats, float], Floats | None],
) -> Floats:  # fmt: skip
    """Return the chance of decoding signals over slant ranges (k, n, m), m, from each AUV's own
    depth.

    `chance` is tabulated by range and interpolated.
    """
    ranges = np.linspace(0.0, max(float(slant.max()), 1.0), LOOKED_UP)
    depths = np.array([setup.auvs[auv].depth_m for auv in range(slant.shape[1])])
    found = np.empty_like(slant)
    for depth in np.unique(depths).tolist():
        table = chance(setup, ranges, depth)
        if table is None:
            return in_range.astype(np.float64)
        found[:, depths == depth] = np.interp(slant[:, depths == depth], ranges, table)
    is_cut = setup.scenario.acoustics.bands[band].traits.ends_at_range
    return np.where(in_range if is_cut else works, found, 0.0)


@dataclass(frozen=True)
class Groups:
    """Ping groups of a round, as means over instants.

    `made` by the schedule (None: only it knows); bounds of the `fewest` conflict-free groups, equal
    where the chromatic number is known; the `clique` number (None: not computed); the most AUVs
    that one ASV hears; the bound of AUVs that share a slot (`reuse`).
    """

    made: float | None
    fewest: tuple[float, float]
    clique: float | None
    most_heard: float
    reuse: float

    @property
    def is_exact(self) -> bool:
        """Whether the fewest groups are known at every instant."""
        return self.fewest[0] == self.fewest[1]


def groups_of(schedule: families.ScheduleTraits, heard: Flags) -> Groups:
    """Return the ping groups of rounds, for AUVs and ASVs in HF range (k, n, m)."""
    made = groups_made(schedule, heard)
    small = heard.shape[1] <= EXACT_UP_TO
    low, high = each(heard, fewest_groups).mean(axis=0).tolist()
    return Groups(
        None if made is None else float(made.mean()),
        (low, high),
        float(each(heard, lambda now: clique_number(now) or 0).mean()) if small else None,
        float(each(heard, most_heard).mean()),
        float(each(heard, reuse_bound).mean()),
    )


def groups_made(schedule: families.ScheduleTraits, heard: Flags) -> Ints | None:
    """Return the number of ping groups of a schedule at each instant (k,), for `heard` (k, n, m).

    None where only the schedule knows.
    """
    slots = slots_made(schedule, heard)
    return None if slots is None else np.asarray(slots.max(axis=1) + 1)


def slots_made(schedule: families.ScheduleTraits, heard: Flags) -> Ints | None:
    """Return the slot of each AUV at each instant (k, n), as :func:`groups_made`."""
    if schedule.framed:
        return np.zeros(heard.shape[:2], dtype=np.int64)
    if not schedule.has_exact_groups:
        return None

    def slots(now: Flags) -> Ints:
        slot = np.empty(len(now), dtype=np.int64)
        for number, group in enumerate(GROUPINGS[schedule.groups](now)):
            slot[list(group)] = number
        return slot

    return np.asarray(each(heard, slots))


def each(heard: Flags, of: Callable[[Flags], ArrayLike]) -> Floats:
    """Return `of` applied to what is in range (n, m) at each instant, (k, ...); equal ones once."""
    kept: dict[bytes, ArrayLike] = {}
    keys = [now.tobytes() for now in heard]
    for key, now in zip(keys, heard, strict=True):
        if key not in kept:
            kept[key] = of(now)
    return np.array([kept[key] for key in keys])


@dataclass(frozen=True)
class Rates:
    """Rates of fixes (1/s) of n AUVs, (n,), as means over the mission."""

    each: Floats

    @property
    def mean(self) -> float:
        """The mean rate (1/s) of the fleet."""
        return float(self.each.mean())

    @property
    def worst(self) -> int:
        """The number of the AUV with the lowest rate."""
        return int(self.each.argmin())

    @property
    def lowest(self) -> float:
        """The lowest rate (1/s) of an AUV."""
        return float(self.each[self.worst])


def rates_of(setup: Setup, rounds: Rounds, sights: SurveySights, senders: int) -> dict[str, Rates]:
    """Return the rates of fixes by kind of round.

    `planned`: the scenario's own rounds (left out where their length is unknown); other downlinks
    by their names, with the scenario's schedule; `back_to_back`: frame behind frame (left out
    without frames), which no protocol exceeds whose AUVs ping, and collide, equally often.
    `senders` ASVs broadcast at once.
    """
    scenario = setup.scenario
    protocol = scenario.protocol
    of_own = made, delivered, _ = told(setup, sights, protocol.downlink)
    if protocol.asvs_ping:
        every = rounds.length(rounds.most, 0) / scenario.asvs.count
        return {"planned": Rates(np.asarray(delivered.mean(axis=0) / every))}
    found: dict[str, Rates] = {}
    if rounds.frame and rounds.are_known:
        empty, full = rounds.length(1, 0), rounds.length(1, 1)
        usual = empty + made.mean(axis=1) * (full - empty)  # frames after a late one catch up
        found["planned"] = _shared(delivered, scenario.auvs.count * np.maximum(usual, rounds.frame))
    groups = groups_made(setup.schedule, sights.heard)
    if groups is not None and not rounds.frame:
        downlinks = dict.fromkeys((protocol.downlink, *COMPARED))
        if protocol.replies:
            downlinks = {protocol.downlink: None}
        for downlink in downlinks:
            if downlink not in families.DOWNLINK.traits:
                continue
            is_own = downlink == protocol.downlink
            alone = protocol.replies or families.DOWNLINK.traits[downlink].by_group
            made_then, by_it, _ = of_own if is_own else told(setup, sights, downlink)
            share = 1.0 if alone else _carried(rounds.slots, made_then)
            lengths = _lengths(downlink, rounds, groups, made_then)
            found["planned" if is_own else downlink] = _shared(by_it * share, lengths)
    if protocol.sends_frames:  # for any AUV that pings, whether or not a frame named its slot
        heard = made_and_delivered(setup, sights.pings, sights.frames, sights.away_m)[0]
        carried = cache(lambda auvs: _records(scenario, rounds.slots, senders, auvs)[0])
        records_hz = np.array([carried(auvs) for auvs in (heard > 0.0).sum(axis=1).tolist()])
        # if most pings are lost, there may be more of them than frames, but each takes its time
        fixes = np.maximum(heard.sum(axis=1), records_hz * scenario.acoustics.hf.ping_s)
        found["back_to_back"] = _shared(sights.at_best, fixes / records_hz)
    return found


def _carried(slots: Slots, made: Floats) -> Floats:
    """Return the share (k, 1) of fixes made (k, n) that broadcasts of one message carry.

    If messages are not split, the other fixes are never sent.
    """
    most = slots.messages.most
    if most is None or slots.messages.splits:
        return np.ones((len(made), 1))
    return np.asarray(most / np.maximum(made.sum(axis=1, keepdims=True), most))


def _shared(delivered: Floats, lengths: Floats) -> Rates:
    """Return the rates of AUVs with `delivered` (k, n) fixes in each round of length (k,), s."""
    return Rates(np.asarray((delivered / lengths[:, np.newaxis]).mean(axis=0)))


def _lengths(downlink: str, rounds: Rounds, groups: Ints, made: Floats) -> Floats:
    """Return the mean length (s) of a round at each instant (k,); pings make fixes with chances (k,
    n).
    """
    further, named, slots = rounds.contention, rounds.named, rounds.slots
    numbers = _numbers(made)
    asked = _some(np.flatnonzero(numbers.max(axis=0) > HARDLY_EVER))
    some = _some(np.unique(groups))
    sizes = [int(fixes) for fixes in asked]
    known = np.array(
        [
            [cycle(downlink, slots, int(count) + further, fixes, named).length_s for fixes in sizes]
            for count in some
        ]
    )
    every = np.arange(numbers.shape[1])
    of_some = np.array([numbers @ np.interp(every, asked, lengths) for lengths in known])
    return np.array(
        [np.interp(count, some, column) for count, column in zip(groups, of_some.T, strict=True)]
    )


def _some(numbers: Ints) -> Ints:
    """Return rising whole numbers, or of many the first, the last and some between."""
    if len(numbers) <= MOST_LENGTHS:
        return numbers
    return np.unique(np.linspace(numbers[0], numbers[-1], MOST_LENGTHS).astype(np.int64))


def _numbers(made: Floats) -> Floats:
    """Return the distribution (k, n + 1) of the number of fixes, for chances (k, n) of each AUV."""
    numbers = np.eye(1, made.shape[1] + 1) * np.ones((len(made), 1))
    for chance in made.T[..., np.newaxis]:
        numbers[:, 1:] += chance * (numbers[:, :-1] - numbers[:, 1:])
        numbers[:, :1] *= 1.0 - chance
    return numbers


@dataclass(frozen=True)
class Limits:
    """What is possible in a mission; None where it does not apply to the protocol.

    `in_range` (n,): share of time in which each AUV is in range of an ASV.  `fix_chance` (n,): mean
    chance that a ping makes a fix that its AUV receives.  `decodes_hz`: pings (1/s) that an ASV
    decodes at most if arrivals may touch; `cleared_hz` if each has `CLEARING_S` to die away;
    `capacity_hz` the mean with ALOHA at the best load (slotted: if no two of a slot are heard).
    `records_hz`: records (1/s) that the downlink carries at most, by `senders` that broadcast at
    once, `in_a_frame` in each frame.  `latency_s`: least latency (s) of a fix, a mean over AUVs in
    range.  `rates`: see :func:`.limits.rates_of`.
    """

    in_range: Floats
    fix_chance: Floats
    groups: Groups | None
    decodes_hz: float
    cleared_hz: float
    capacity_hz: float | None
    records_hz: float | None
    senders: int
    in_a_frame: int
    latency_s: float | None
    rates: dict[str, Rates]

    @property
    def frames(self) -> str:
        """The frames that carry `records_hz`, in words."""
        each = f"{self.in_a_frame} a frame" if self.in_a_frame < MOST_RECORDS else "long frames"
        return each + f", {self.senders} ASVs at once" * (self.senders > 1)


def limits(scenario: Scenario) -> Limits:
    """Return what is possible in a mission whose vehicles keep to their plans.

    A ring of stations replaces ASVs that move.

    Raises:
        ValueError: when the route cannot be flown.
        PluginError: when a user-defined part is not allowed or fails.
    """
    setup = Setup.of(scenario)
    return limits_of(setup, planned_sights(setup))


def limits_of(setup: Setup, sights: SurveySights) -> Limits:
    """Return what is possible in a mission with these vehicles in range."""
    scenario = setup.scenario
    rounds, protocol = rounds_of(setup), scenario.protocol
    slots, ping = rounds.slots, scenario.acoustics.hf.ping_s
    senders = _senders(setup, sights) if protocol.sends_frames else 1
    slotted = not (protocol.asvs_ping or scenario.protocol.random_access)
    records, in_a_frame = None, 0
    if protocol.sends_frames:
        records, in_a_frame = _records(scenario, slots, senders, scenario.auvs.count)
    return Limits(
        in_range=np.asarray(sights.heard.any(axis=2).mean(axis=0)),
        fix_chance=np.asarray(told(setup, sights, protocol.downlink)[1].mean(axis=0)),
        groups=groups_of(setup.schedule, sights.heard) if slotted else None,
        decodes_hz=decode_bound(ping, 0.0),
        cleared_hz=decode_bound(ping),
        capacity_hz=_capacity(setup, sights, slots),
        records_hz=records,
        senders=senders,
        in_a_frame=in_a_frame,
        latency_s=_latency(setup, sights, slots),
        rates=rates_of(setup, rounds, sights, senders),
    )


def _records(scenario: Scenario, slots: Slots, senders: int, auvs: int) -> tuple[float, int]:
    """Return the records (1/s) that `senders` can send at most, and how many are in a frame then.

    AUVs ping once before each frame, or by random access.
    """
    most = slots.messages.most or MOST_RECORDS
    fixes = senders * MOST_RECORDS if scenario.protocol.random_access else max(auvs, 1)
    if scenario.protocol.replies:  # each answer is a frame of one
        fixes = senders
    elif slots.messages.most and not slots.messages.splits:
        fixes = min(scenario.auvs.count, most)  # those of rounds before wait for a place
    return record_bound(slots.airtime, fixes, senders, min(most, MOST_RECORDS))


def _capacity(setup: Setup, sights: SurveySights, slots: Slots) -> float | None:
    """Return the pings (1/s) of ALOHA that the busiest ASV decodes at the best load.

    None without a closed form, or where no AUV is heard.
    """
    auvs = round(float(each(sights.heard, most_heard).mean()))
    if not setup.scenario.protocol.random_access or auvs == 0 or setup.scenario.traffic is not None:
        return None
    match setup.schedule.access:
        case "poisson":
            return aloha_capacity(slots.ping_duration, auvs)
        case "slotted":
            return slotted_aloha_capacity(slots.clock.after(0.0, slots.uplink_slot), auvs)
        case _:
            return None


def _senders(setup: Setup, sights: SurveySights) -> int:
    """Return the largest number of ASVs that may send frames at once."""
    if not setup.broadcaster.at_once and not setup.scenario.protocol.replies:
        return 1
    return int(each(sights.reached, disjoint_senders).max())


def _latency(setup: Setup, sights: SurveySights, slots: Slots) -> float | None:
    """Return the mean of the least latency (s) over AUVs in range; None if none ever is."""
    near = sights.away_m.min(axis=2)[sights.heard.any(axis=2)]
    if not near.size:
        return None
    return least_latency(setup, slots, float(near.mean()), float(near.mean()))


def least_latency(setup: Setup, slots: Slots, up_m: float, down_m: float) -> float:
    """Return the least latency (s) of a fix whose ping and frame travel `up_m` and `down_m` (m)."""
    c, protocol = setup.sound_speed_m_per_s, setup.scenario.protocol
    if protocol.asvs_ping:
        return latency_bound(0.0, slots.ping_duration, down_m, c)
    frame = slots.airtime(1) + slots.messages.delay(1) if protocol.sends_frames else 0.0
    decoded = setup.reply_delay_s if protocol.replies else 0.0
    return latency_bound(up_m, decoded + frame, down_m, c)

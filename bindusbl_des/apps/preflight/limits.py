"""The limits of a scenario: what its medium, its modems and its conflict graph leave possible.

Where AUVs and ASVs are going to be if they keep to their plans decides who is within range of whom,
and into how many ping groups that makes a round; from that follows how often AUVs would be fixed if
pings and frames were lost by range alone.
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

# A mission is looked at so often, less often where there are more pairs of AUV and ASV, or of AUVs
# that may share a slot, than these.
INSTANTS, MOST_PAIRS, MOST_CHOICES = 121, 4_000_000, 121_000_000

# Whose rates stand beside those of the scenario's own rounds.
COMPARED = tuple(name for name, traits in families.DOWNLINK.traits.items() if traits.is_foreseen)

# Rounds with numbers of fixes that are rarer than this are not asked how long they are, nor those
# of more numbers of fixes, or of groups, than so many: others lie between them.
HARDLY_EVER, MOST_LENGTHS = 1e-6, 17

# Frames of more records are not tried in search of the one that carries most of them a second.
MOST_RECORDS = 1000


class SurveySights(NamedTuple):
    """What n AUVs and m ASVs are to each other at k instants (s), evenly spread.

    Which ASVs hear the pings of which AUVs, and which AUVs the frames of which ASVs, as the
    protocol counts its ranges, and how far (m) those are that work (else infinite), (k, n, m).  How
    likely each decodes each other's `pings` and `frames`, if no other sound overlaps (k, n, m), and
    a ping's fix is delivered alone in a frame by the ASV that reaches the AUV best (k, n); as often
    as in range where a channel of somebody's own decides.
    """

    times_s: Floats
    heard: Flags
    reached: Flags
    away_m: Floats
    pings: Floats
    frames: Floats
    at_best: Floats


def planned_sights(setup: Setup) -> SurveySights:
    """Return who is to be within range of whom, by the plans of a scenario.

    Raises:
        ValueError: when the route cannot be flown.
        PluginError: when one's own is not allowed, or makes none.
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
    """Return the instants (s) at which a mission is looked at: midway through equal parts of it,
    `most` of them unless there are many vehicles.
    """
    auvs, pairs = scenario.auvs.count, scenario.auvs.count * scenario.asvs.count
    count = max(min(most, MOST_PAIRS // pairs, MOST_CHOICES // auvs**2), 1)
    return np.asarray((np.arange(count) + 0.5) * scenario.duration_s / count)


def sights(setup: Setup, times: Floats, auvs: Floats, asvs: Floats) -> SurveySights:
    """Return who is within range of whom, of AUVs (k, n, 3) and ASVs (k, m, 3), m, at instants
    (k,), s.  An ASV that has failed neither hears nor is heard.
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
    """Return how likely a ping makes a fix, and one that is delivered by a downlink, (k, n); and
    after how many broadcasts the one comes back that has an AUV's fix: 1 where that changes, or all
    share them.
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
    """Tell whether fixes wait for an ASV that works, or for a place in messages: not all of a group
    with so many fixes are in the broadcast that follows.
    """
    messages = setup.messages
    is_short = messages.most is not None and not messages.splits
    is_late = is_short and (setup.scenario.protocol.calls or (messages.most or 0) < fixes)
    return is_late or bool(np.isinf(sights.away_m).all(axis=2).any())


def _chances(
    setup: Setup, slant: Floats, in_range: Flags, works: Flags, band: str,
    chance: Callable[[Setup, Floats, float], Floats | None],
) -> Floats:  # fmt: skip
    """Return how likely signals are decoded over slant ranges (k, n, m), m, looked up by these, for
    each AUV from its own depth.
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
    """Ping groups of a round, means over instants.

    Those that the schedule makes (None: only it knows); between what the fewest lie that are free
    of conflicts, equal where the chromatic number is known; the clique number (None: not worked
    out); the most AUVs that one ASV hears; how many AUVs that are heard share a slot, at most.
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
    """Return the ping groups of rounds that begin with so much in HF range, (k, n, m)."""
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
    """Return how many ping groups a schedule makes of what is in range (k, n, m), at each instant
    (k,); None where only the schedule knows.
    """
    slots = slots_made(schedule, heard)
    return None if slots is None else np.asarray(slots.max(axis=1) + 1)


def slots_made(schedule: families.ScheduleTraits, heard: Flags) -> Ints | None:
    """Return the slot of each AUV (k, n) at each instant, as :func:`groups_made`."""
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
    """Return what belongs to what is in range (k, n, m) at each instant, (k, ...): of equal ones
    asked once.
    """
    kept: dict[bytes, ArrayLike] = {}
    keys = [now.tobytes() for now in heard]
    for key, now in zip(keys, heard, strict=True):
        if key not in kept:
            kept[key] = of(now)
    return np.array([kept[key] for key in keys])


@dataclass(frozen=True)
class Rates:
    """How often (1/s) each of n AUVs is fixed, (n,), as a mean over the mission."""

    each: Floats

    @property
    def mean(self) -> float:
        """The mean of the fleet."""
        return float(self.each.mean())

    @property
    def worst(self) -> int:
        """The number of the AUV with the lowest rate."""
        return int(self.each.argmin())

    @property
    def lowest(self) -> float:
        """The rate of that AUV."""
        return float(self.each[self.worst])


def rates_of(setup: Setup, rounds: Rounds, sights: SurveySights, senders: int) -> dict[str, Rates]:
    """Return the rates of a scenario's own rounds (`planned`; none where they are not known), of
    sequential and pipelined ones of its schedule, and with frame behind frame (`back_to_back`; none
    without frames): no protocol has more whose AUVs ping, and collide, equally often.

    `senders` broadcast at once.
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
    if protocol.sends_frames:  # whoever pings, told of its slot or not
        heard = made_and_delivered(setup, sights.pings, sights.frames, sights.away_m)[0]
        carried = cache(lambda auvs: _records(scenario, rounds.slots, senders, auvs)[0])
        records_hz = np.array([carried(auvs) for auvs in (heard > 0.0).sum(axis=1).tolist()])
        # of pings that are mostly lost there may be more than frames, but not without a pause
        fixes = np.maximum(heard.sum(axis=1), records_hz * scenario.acoustics.hf.ping_s)
        found["back_to_back"] = _shared(sights.at_best, fixes / records_hz)
    return found


def _carried(slots: Slots, made: Floats) -> Floats:
    """Return which share of the fixes that are made (k, n) is carried (k, 1) by broadcasts of one
    message, whoever share it: if they are not split, others never get a place.
    """
    most = slots.messages.most
    if most is None or slots.messages.splits:
        return np.ones((len(made), 1))
    return np.asarray(most / np.maximum(made.sum(axis=1, keepdims=True), most))


def _shared(delivered: Floats, lengths: Floats) -> Rates:
    """Return the rates of AUVs whose ping in each round (k,), s, makes as many fixes (k, n)."""
    return Rates(np.asarray((delivered / lengths[:, np.newaxis]).mean(axis=0)))


def _lengths(downlink: str, rounds: Rounds, groups: Ints, made: Floats) -> Floats:
    """Return how long (s) rounds are on average at each instant (k,), whose pings make fixes as
    often as told (k, n).
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
    """Return rising whole numbers, of many the first, the last and some between them."""
    if len(numbers) <= MOST_LENGTHS:
        return numbers
    return np.unique(np.linspace(numbers[0], numbers[-1], MOST_LENGTHS).astype(np.int64))


def _numbers(made: Floats) -> Floats:
    """Return how likely pings that make fixes as often as told (k, n) make 0 to n together
    (k, n + 1).
    """
    numbers = np.eye(1, made.shape[1] + 1) * np.ones((len(made), 1))
    for chance in made.T[..., np.newaxis]:
        numbers[:, 1:] += chance * (numbers[:, :-1] - numbers[:, 1:])
        numbers[:, :1] *= 1.0 - chance
    return numbers


@dataclass(frozen=True)
class Limits:
    """What is possible in a mission; what does not apply to its protocol is None.

    `in_range` (n,) is the share of the time in which each AUV is in range of some ASV, `fix_chance`
    (n,) how likely a ping makes a fix that its AUV gets, a mean over the mission.  An ASV decodes
    `decodes_hz` pings (1/s) at most whose arrivals may touch, `cleared_hz` if each has `CLEARING_S`
    to die away; with ALOHA `capacity_hz` on average, whatever the load (slotted: if no two of a
    slot are heard).  The downlink carries `records_hz` (1/s) at most, of as many `senders` as may
    broadcast at once, with `in_a_frame` of them in each frame.  A fix takes `latency_s` (s) at
    least, a mean over AUVs in range.  `rates` are those of :func:`.limits.rates_of`.
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
        """The frames that carry so many records, in words."""
        each = f"{self.in_a_frame} a frame" if self.in_a_frame < MOST_RECORDS else "long frames"
        return each + f", {self.senders} ASVs at once" * (self.senders > 1)


def limits(scenario: Scenario) -> Limits:
    """Return what is possible in a mission whose vehicles keep to their plans.

    A ring of stations stands in for ASVs that move.

    Raises:
        ValueError: when the route cannot be flown.
        PluginError: when one's own is not allowed, or makes none.
    """
    setup = Setup.of(scenario)
    return limits_of(setup, planned_sights(setup))


def limits_of(setup: Setup, sights: SurveySights) -> Limits:
    """Return what is possible in a mission in which so much is in range."""
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
    """Return how many records (1/s) so many ASVs can send, of AUVs that ping once before each frame
    or as they like, and how many are in a frame then.
    """
    most = slots.messages.most or MOST_RECORDS
    fixes = senders * MOST_RECORDS if scenario.protocol.random_access else max(auvs, 1)
    if scenario.protocol.replies:  # each answer is a frame of one
        fixes = senders
    elif slots.messages.most and not slots.messages.splits:
        fixes = min(scenario.auvs.count, most)  # those of rounds before wait for a place
    return record_bound(slots.airtime, fixes, senders, min(most, MOST_RECORDS))


def _capacity(setup: Setup, sights: SurveySights, slots: Slots) -> float | None:
    """Return how many pings (1/s) of ALOHA the ASV decodes that hears most AUVs, at the best load.

    None where no closed form tells, and where nobody is heard.
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
    """Return how many ASVs may send frames at once, at most."""
    if not setup.broadcaster.at_once and not setup.scenario.protocol.replies:
        return 1
    return int(each(sights.reached, disjoint_senders).max())


def _latency(setup: Setup, sights: SurveySights, slots: Slots) -> float | None:
    """Return the least latency (s) of fixes, a mean over AUVs in range; None if none ever is."""
    near = sights.away_m.min(axis=2)[sights.heard.any(axis=2)]
    if not near.size:
        return None
    return least_latency(setup, slots, float(near.mean()), float(near.mean()))


def least_latency(setup: Setup, slots: Slots, up_m: float, down_m: float) -> float:
    """Return the least latency (s) of a fix whose ping travels up and which travels down, m."""
    c, protocol = setup.sound_speed_m_per_s, setup.scenario.protocol
    if protocol.asvs_ping:
        return latency_bound(0.0, slots.ping_duration, down_m, c)
    frame = slots.airtime(1) + slots.messages.delay(1) if protocol.sends_frames else 0.0
    decoded = setup.reply_delay_s if protocol.replies else 0.0
    return latency_bound(up_m, decoded + frame, down_m, c)

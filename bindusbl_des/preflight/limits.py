"""The limits of a scenario: what its medium, its modems and its conflict graph leave possible.

How often AUVs would be fixed if pings and frames were lost by range alone.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np

from ..core.arrays import Floats, Ints
from ..protocol.bounds import (
    aloha_capacity,
    decode_bound,
    disjoint_senders,
    latency_bound,
    most_heard,
    record_bound,
    slotted_aloha_capacity,
)
from ..protocol.cycles import cycle
from ..protocol.replies import reply_delay_of
from ..protocol.slots import Slots
from ..scenario.declared import DOWNLINKS
from ..scenario.families import broadcaster_of, schedule_of
from ..scenario.scenario import Scenario
from ..scenario.site import sound_speed_of
from .round_lengths import Rounds, rounds_of
from .sights import Groups, SurveySights, each, groups_made, groups_of, planned_sights

# Whose rates stand beside those of the scenario's own rounds.
COMPARED = tuple(name for name, it in DOWNLINKS.items() if it.is_foreseen)


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


def rates_of(
    scenario: Scenario, rounds: Rounds, sights: SurveySights, senders: int, records_hz: float | None
) -> dict[str, Rates]:
    """Return the rates of a scenario's own rounds (`planned`; none where they are not known), of
    sequential and pipelined ones of its schedule, and with frame behind frame (`back_to_back`).

    `senders` broadcast at once; the downlink carries `records_hz` (1/s) at most, None: has none.
    """
    protocol, heard, delivered = scenario.protocol, sights.heard, sights.delivered
    if protocol.asvs_ping:
        every = rounds.length(rounds.most, 0) / scenario.asvs.count
        return {"planned": Rates(np.asarray(delivered.mean(axis=0) / every))}
    found: dict[str, Rates] = {}
    if rounds.frame and rounds.are_known:
        in_turn = np.full(len(heard), scenario.auvs.count * rounds.period(1, 1))
        found["planned"] = _shared(delivered, in_turn)
    groups = groups_made(schedule_of(scenario), heard)
    if groups is not None and not rounds.frame:
        downlinks = dict.fromkeys((protocol.downlink, *COMPARED))
        if protocol.replies:
            downlinks = {protocol.downlink: None}
        for downlink in downlinks:
            if downlink in DOWNLINKS:
                name = "planned" if downlink == protocol.downlink else downlink
                found[name] = _shared(delivered, _lengths(downlink, rounds, groups, sights.made))
    if records_hz is not None:
        frames = _airtimes(rounds.slots, sights.made, senders)
        if scenario.protocol.random_access or protocol.replies:  # whatever waits, or one fix each
            frames = np.maximum(sights.made.sum(axis=1), 1.0) / records_hz
        found["back_to_back"] = _shared(sights.at_best, frames)
    return found


def _shared(delivered: Floats, lengths: Floats) -> Rates:
    """Return the rates of AUVs whose ping in each round (k,), s, makes as many fixes (k, n)."""
    return Rates(np.asarray((delivered / lengths[:, np.newaxis]).mean(axis=0)))


def _lengths(downlink: str, rounds: Rounds, groups: Ints, made: Floats) -> Floats:
    """Return how long (s) rounds are at each instant (k,), with as many fixes (k, n) as are
    made on average.
    """
    further, named, slots = rounds.contention, rounds.named, rounds.slots
    length = cache(
        lambda count, fixes: cycle(downlink, slots, count + further, fixes, named).length_s
    )
    fixes = np.rint(made.sum(axis=1)).astype(np.int64).tolist()
    return np.array([length(*it) for it in zip(groups.tolist(), fixes, strict=True)])


def _airtimes(slots: Slots, made: Floats, senders: int) -> Floats:
    """Return how long (s) frames with all fixes (k, n) are at each instant (k,), if so many ASVs
    share them evenly.
    """
    airtime = cache(slots.airtime)
    fixes = np.maximum(np.ceil(np.rint(made.sum(axis=1)) / senders), 1.0).astype(np.int64)
    return np.array([airtime(count) for count in fixes.tolist()])


# Frames of more records are not tried in search of the one that carries most of them a second.
MOST_RECORDS = 1000


@dataclass(frozen=True)
class Limits:
    """What is possible in a mission; what does not apply to its protocol is None.

    `in_range` (n,) is the share of the time in which each AUV is in range of some ASV, `fix_chance`
    (n,) how likely a ping makes a fix that its AUV gets, a mean over the mission.  An ASV decodes
    `decodes_hz` pings (1/s) at most whose arrivals may touch, `cleared_hz` if each has `CLEARING_S`
    to die away; with ALOHA `capacity_hz` on average, whatever the load (slotted: if no two of a
    slot are heard).  The downlink carries `records_hz` (1/s) at most, of as many `senders` as may
    broadcast at once.  A fix takes `latency_s` (s) at least, a mean over AUVs in range.  `rates`
    are those of :func:`.limits.rates_of`.
    """

    in_range: Floats
    fix_chance: Floats
    groups: Groups | None
    decodes_hz: float
    cleared_hz: float
    capacity_hz: float | None
    records_hz: float | None
    senders: int
    latency_s: float | None
    rates: dict[str, Rates]


def limits(scenario: Scenario) -> Limits:
    """Return what is possible in a mission whose vehicles keep to their plans.

    A ring of stations stands in for ASVs that move.

    Raises:
        ValueError: when the route cannot be flown.
        PluginError: when one's own is not allowed, or makes none.
    """
    return limits_of(scenario, planned_sights(scenario))


def limits_of(scenario: Scenario, sights: SurveySights) -> Limits:
    """Return what is possible in a mission in which so much is in range."""
    rounds, protocol = rounds_of(scenario), scenario.protocol
    slots, ping = rounds.slots, scenario.acoustics.hf.ping_s
    senders = _senders(scenario, sights) if protocol.sends_frames else 1
    slotted = not (protocol.asvs_ping or scenario.protocol.random_access)
    fixes = scenario.auvs.count if slotted else MOST_RECORDS
    if protocol.replies:  # each answer is a frame of one
        fixes = 1
    records = senders * _records(slots, fixes) if protocol.sends_frames else None
    return Limits(
        in_range=np.asarray(sights.heard.any(axis=2).mean(axis=0)),
        fix_chance=np.asarray(sights.delivered.mean(axis=0)),
        groups=groups_of(schedule_of(scenario), sights.heard) if slotted else None,
        decodes_hz=decode_bound(ping, 0.0),
        cleared_hz=decode_bound(ping),
        capacity_hz=_capacity(scenario, sights, slots),
        records_hz=records,
        senders=senders,
        latency_s=_latency(scenario, sights, slots),
        rates=rates_of(scenario, rounds, sights, senders, records),
    )


def _records(slots: Slots, fixes: int) -> float:
    """Return how many records (1/s) one ASV can send, of so many fixes in a frame at most."""
    most = min(fixes, slots.messages.most or fixes, MOST_RECORDS)
    return record_bound(slots.airtime, range(1, most + 1))


def _capacity(scenario: Scenario, sights: SurveySights, slots: Slots) -> float | None:
    """Return how many pings (1/s) of ALOHA the ASV decodes that hears most AUVs, at the best load.

    None where no closed form tells, and where nobody is heard.
    """
    auvs = round(float(each(sights.heard, most_heard).mean()))
    if not scenario.protocol.random_access or auvs == 0:
        return None
    match schedule_of(scenario).access:
        case "poisson":
            return aloha_capacity(slots.ping_duration, auvs)
        case "slotted":
            return slotted_aloha_capacity(slots.clock.after(0.0, slots.uplink_slot), auvs)
        case _:
            return None


def _senders(scenario: Scenario, sights: SurveySights) -> int:
    """Return how many ASVs may send frames at once, at most."""
    if not broadcaster_of(scenario).at_once and not scenario.protocol.replies:
        return 1
    return int(each(sights.reached, disjoint_senders).max())


def _latency(scenario: Scenario, sights: SurveySights, slots: Slots) -> float | None:
    """Return the least latency (s) of fixes, a mean over AUVs in range; None if none ever is."""
    near = sights.nearest_m[sights.heard.any(axis=2)]
    if not near.size:
        return None
    return least_latency(scenario, slots, float(near.mean()), float(near.mean()))


def least_latency(scenario: Scenario, slots: Slots, up_m: float, down_m: float) -> float:
    """Return the least latency (s) of a fix whose ping travels up and which travels down, m."""
    c, protocol = sound_speed_of(scenario), scenario.protocol
    if protocol.asvs_ping:
        return latency_bound(0.0, slots.ping_duration, down_m, c)
    frame = slots.airtime(1) + slots.messages.delay(1) if protocol.sends_frames else 0.0
    decoded = reply_delay_of(scenario) if protocol.replies else 0.0
    return latency_bound(up_m, decoded + frame, down_m, c)

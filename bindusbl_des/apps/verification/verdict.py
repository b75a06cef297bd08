"""The verdict on a scenario's protocol: accepted, refused with two signals that overlap, or
undecided; and how long guards and margins would have to be.

Every kind of pair of signals that may meet at a receiver is decided by itself.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ...core.scenario.files.overrides import put
from ...core.scenario.files.scenario_file import load_scenario
from ...core.scenario.scenario import Scenario
from ...core.setup import Setup
from ...support.facts import cached_property
from ...support.plugins import is_plugin
from ...support.wording import plain
from . import rules
from .case import ACCEPTED, REFUSED, UNDECIDED, Bounds, Case, SignalPair, bounds_of, undecided
from .playing import Witness, seen, witnessed
from .witnesses import groups_shown

Rule = Callable[[Case], Iterator[SignalPair]]

# Pairs whose margin grows by as much as an uplink slot does
OF_SLOTS = (
    "consecutive slots", "answer and next call", "consecutive beacons", "consecutive answers",
)  # fmt: skip

Changes = dict[str, Any]

# What is proposed is rounded up to so much: seconds of a guard, metres of a margin.
STEP_S, STEP_M = 1e-4, 0.01

# No margin beyond the range itself is proposed: hardly any AUVs would share a slot.
MOST_RANGES = 1.0

# One change may ask for another: a longer slot lets AUVs go farther.
MOST_ROUNDS = 4

# Larger fleets have too many pairs to look at all of them.
LARGEST_FLEET = 1000


@dataclass(frozen=True)
class Guard:
    """The time left in a slot once its signals and the longest way are taken off (s): how much
    there is, and how much it takes for no two signals to overlap.
    """

    set_s: float
    needed_s: float

    @property
    def wasted_s(self) -> float:
        """What could be left out (s); negative is what lacks."""
        return self.set_s - self.needed_s


@dataclass(frozen=True)
class Remedy:
    """Keys of the scenario and the values with which its protocol is accepted."""

    changes: tuple[tuple[str, Any], ...]

    @property
    def options(self) -> tuple[str, ...]:
        """The changes as options of a command."""
        return tuple(f"--set {key}={plain(value)}" for key, value in self.changes)


@dataclass(frozen=True)
class Verdict:
    """What was decided of a scenario, for which bounds, and why.

    `pairs` are all kinds of pairs of signals that may meet; a `witness` shows two that overlap:
    there is one if anything is refused.  `remedy` is what would be accepted, None where all is, or
    nothing is known that would be.  `lost` says in a sentence which signals were destroyed in a
    mission that was played, though by no other signal as a whole (echoes are none), or is empty.
    """

    case: Case
    pairs: tuple[SignalPair, ...]
    witness: Witness | None
    remedy: Remedy | None
    lost: str = ""

    @property
    def accepted(self) -> bool:
        """Whether no two signals may overlap."""
        return self.verdict == ACCEPTED

    @property
    def verdict(self) -> str:
        """Accepted: no two signals may overlap; refused: some do in a scenario that has been run;
        else undecided.
        """
        if self.witness is not None:
            return REFUSED
        return ACCEPTED if all(pair.is_safe for pair in self.pairs) else UNDECIDED

    @property
    def scenario(self) -> Scenario:
        """The scenario that was verified."""
        return self.case.scenario

    @property
    def bounds(self) -> Bounds:
        """The bounds for which that holds."""
        return self.case.bounds

    @cached_property
    def uplink(self) -> Guard | None:
        """The guard of uplink slots; None where none is needed or nothing is known."""
        return uplink_guard(self.case, self.pairs)

    @cached_property
    def downlink(self) -> Guard | None:
        """The guard of downlink slots; None where there are none."""
        decided = any(pair.kind == "consecutive frames" for pair in self.pairs)
        return downlink_guard(self.case) if decided else None

    @property
    def reuses(self) -> bool:
        """Whether AUVs may share a slot."""
        shared = self.case.setup.schedule.is_shared_and_proved
        return shared and not self.case.setup.ranging.asvs_ping

    @property
    def position_age_s(self) -> float | None:
        """How old positions may be by which AUVs share a slot (s); None where none do."""
        return rules.position_age_s(self.case) if self.reuses else None

    @property
    def position_error_m(self) -> float | None:
        """How far (m) fixes may be off by which AUVs share a slot; None where none do, or nothing
        bounds it.
        """
        return rules.bounded(rules.believed_off_m(self.case)) if self.reuses else None

    @property
    def conflict_margin(self) -> dict[str, float | None] | None:
        """The conflict margin that is set and the least that is needed (m), None for none."""
        if not self.reuses:
            return None
        is_set = self.scenario.protocol.conflict_margin_m
        return {"set_m": is_set, "needed_m": rules.bounded(rules.margin_needed(self.case))}

    @property
    def frame(self) -> dict[str, Any] | None:
        """How long frames are, and the longest rounds (s); None where rounds have no frames."""
        frame = self.case.rounds.frame
        if not frame:
            return None
        lasts = rules.round_s(self.case)
        return {"frame_s": frame, "round_s": lasts, "fits": lasts <= frame}


def verify(
    scenario: Scenario | str | Path,
    *,
    max_speed: float | None = None,
    clock_error: float | None = None,
    sound_speed_error: float | None = None,
) -> Verdict:
    """Decide before a mission whether any two signals of its protocol may overlap at a receiver.

    Bounds that are not given are the scenario's own: speed of AUVs over ground (m/s), error of
    their clocks (s, either way), error of the assumed speed of sound (m/s).

    Raises:
        ScenarioError: when the scenario file cannot be read or used.
        ValueError: for a bound that is no number or impossible, and of a fleet that is too large.

    >>> verify("recovery_140m").accepted
    False
    """
    if not isinstance(scenario, Scenario):
        scenario = load_scenario(scenario)
    for who, fleet in (("AUVs", scenario.auvs), ("ASVs", scenario.asvs)):
        if fleet.count > LARGEST_FLEET:
            raise ValueError(
                f"{who.lower()}.count: all pairs of up to {LARGEST_FLEET:,} {who} are looked at; "
                f"got {fleet.count:,}; verify a part of the fleet"
            )
    setup = Setup.of(scenario)
    case = Case(setup, bounds_of(setup, max_speed, clock_error, sound_speed_error))
    found = [witnessed(pair) for pair in pairs_of(case)]
    pairs = tuple(pair for pair, _ in found)
    if all(pair.is_safe for pair in pairs):
        return Verdict(case, pairs, None, None)
    witness, lost = next((witness for _, witness in found if witness is not None), None), ""
    if witness is None:
        firsts = {pair.band: pair for pair in reversed(pairs) if not pair.is_safe}
        shown = {band: seen(pair, groups_shown(case)) for band, pair in firsts.items()}
        pairs = tuple(
            pair if pair.is_safe or shown[pair.band][0] is None else replace(pair, verdict=REFUSED)
            for pair in pairs
        )
        witness = next((found for found, _ in shown.values() if found is not None), None)
        lost = "" if witness is not None else next((text for _, text in shown.values() if text), "")
    return Verdict(case, pairs, witness, remedy_of(case), lost)


def pairs_of(case: Case) -> list[SignalPair]:
    """Return every kind of pair of signals of a scenario's protocol, each with its verdict.

    Where nothing is proved of one band, the other's pairs are judged as ever.
    """
    unknown = list(_unknown(case))
    bands = {pair.band for pair in unknown}
    if bands not in (set(), {"hf"}, {"mf"}):
        return unknown
    judged = [pair for rule in _rules(case) for pair in rule(case)]
    return unknown + [pair for pair in judged if not bands or pair.band not in (*bands, None)]


def _rules(case: Case) -> tuple[Rule, ...]:
    """Return what may meet where AUVs ping as they like, where ASVs ping, where they call AUVs, and
    where AUVs ping by their clocks.
    """
    ranging = case.setup.ranging
    if case.scenario.protocol.random_access:
        return (rules.random_access,)
    if ranging.asvs_ping:
        return (rules.beacons,)
    called = (rules.calls_of_a_slot, rules.call_and_answer, rules.answer_and_next_call)
    pings = called if ranging.calls else (rules.consecutive_slots,)
    return (rules.same_slot, *pings, rules.broadcasts, rules.answers)


def _unknown(case: Case) -> Iterator[SignalPair]:
    """Yield what of a protocol lies beyond what is proved here."""
    protocol, acoustics = case.scenario.protocol, case.scenario.acoustics
    for name in (protocol.schedule, protocol.downlink, protocol.ranging):
        if is_plugin(str(name)):
            why = "who sends when only the plug-in says: nothing is proved beyond what was played"
            yield undecided("part of one's own", str(name), why, None)
    if protocol.pings_by_steps and not protocol.ranging.is_own:
        why = "its steps say when AUVs ping: nothing is proved beyond what was played"
        yield undecided("ranging by steps", str(protocol.ranging), why, "hf")
    if protocol.random_access and case.setup.schedule.access == "program":
        why = "who sends when its program says, by what it hears: nothing is proved beyond play"
        yield undecided("program of access", str(protocol.program), why, "hf")
    if case.scenario.has_peers:
        why = "AUVs speak to each other beside the slots: nothing is proved beyond what was played"
        yield undecided("peers", "messages and pings", why, "hf")
    if case.scenario.modems is not None:
        why = "modems send what their hosts say: nothing is proved beyond what was played"
        yield undecided("modems", "messages and pings", why, "hf")
    if protocol.duplex != "per_band":
        why = "who sends on one band is deaf on both"
        yield undecided("half duplex", "pings and frames", why, None)
    if case.scenario.traffic is not None:
        why = "data follow pings, as long as some wait: nothing is proved beyond what was played"
        yield undecided("data behind pings", "pings and data", why, "hf")
    if protocol.sends_auv_frames or protocol.most_repeats != 0:
        why = "AUVs send behind broadcasts by what they have decoded, or fixes are repeated"
        yield undecided("acknowledged, repeated, relayed", "frames on MF", why, "mf")
    bands = {"hf": ("pings", acoustics.hf.traits, acoustics.hf.channel)}
    if not protocol.asvs_ping:
        bands["mf"] = "frames", acoustics.mf.traits, acoustics.mf.channel
    for band, (what, traits, channel) in bands.items():
        limit = acoustics.bands[band].doppler_limit_m_per_s
        if limit is not None and case.closing_m_per_s > limit:
            why = (
                f"ways that change by up to {case.closing_m_per_s:.3g} m/s lose signals to Doppler"
            )
            yield undecided("Doppler limit", what, why, band)
        if not traits.ends_at_range:
            why = f"how far sound reaches is told by the channel {str(channel)!r}, not by range_m"
            yield undecided("sound beyond the range", what, why, band)
    known = protocol.asvs_ping or protocol.schedule.is_own or protocol.random_access
    if not known and not case.setup.schedule.is_proved:
        why = "nothing is proved of this schedule beyond what was played"
        yield undecided("schedule", str(protocol.schedule), why, None)
    if case.setup.tells_slots and protocol.dissemination.missed != "silent":
        why = "AUVs that received no slots ping when they reckon these to be"
        missed = f"missed {protocol.dissemination.missed}"
        yield undecided("disseminated slots", missed, why, None)
    elif case.setup.tells_slots and case.setup.schedule.is_shared_and_proved:
        why = "slots are shared by where AUVs are believed to be as a frame begins, a round ahead"
        yield undecided("disseminated slots", str(protocol.schedule), why, None)


def uplink_guard(case: Case, pairs: Sequence[SignalPair]) -> Guard | None:
    """Return the guard of an uplink slot (T_G and whatever the shortest slot adds), on the clock.

    Guards against echoes are not in what is needed: echoes are not verified.
    """
    margins = [
        pair.margin_s for pair in pairs if pair.kind in OF_SLOTS and pair.margin_s is not None
    ]
    if not margins or not case.scenario.asvs.count:
        return None
    guard = case.slot_s - _busy_s(case)
    return Guard(guard, max(guard - min(margins), 0.0))


def _busy_s(case: Case) -> float:
    """Return what an uplink slot holds beside its guard (s), at the speed of sound assumed."""
    slots = case.slots
    if case.setup.ranging.calls:
        answered = slots.ping_duration + rules.answering_s(case) + 2 * slots.longest_travel_time
        return answered + slots.answer
    return slots.ping_duration + slots.longest_travel_time + slots.answer


def downlink_guard(case: Case) -> Guard | None:
    """Return the guard of a downlink slot, the least of all sizes of a frame, on the clock.

    What uplink slots between two broadcasts add is not taken for a guard, but makes less needed.
    """
    downlink, slots = case.setup.downlink, case.slots
    if case.setup.ranging.asvs_ping or downlink.replies or not case.scenario.asvs.count:
        return None
    guard = min(
        slots.clock.after(0.0, slots.downlink_slot(*size)) - slots.airtime(*size)
        for size in rules.sizes(case)
    )
    needed = spread = rules.frame_spread(case)
    if downlink.waits:
        needed -= rules.fewest_slots(case) * case.slot_s
    if rules.downlink_gap(case) >= spread:  # whatever comes between
        needed = min(needed, guard)
    return Guard(guard, max(needed, 0.0))


def remedy_of(case: Case) -> Remedy | None:
    """Return the least change that is accepted: of guards and margin, else with a slot for each AUV
    as well; None where there is none such.
    """
    for first in ({}, {"schedule": "one_per_slot"}):
        changes: Changes = dict(first)
        for _ in range(MOST_ROUNDS):
            try:
                now = _changed(case, changes)
            except ValueError:  # a longer guard than a scenario may have
                break
            pairs = pairs_of(now)
            if all(pair.is_safe for pair in pairs):
                return Remedy(tuple((f"protocol.{key}", value) for key, value in changes.items()))
            changes |= dict(_lacking(now, pairs))
    return None


def _lacking(case: Case, pairs: list[SignalPair]) -> Iterator[tuple[str, Any]]:
    """Yield keys of the protocol, and values by which its pairs would be kept apart."""
    refused = {pair.kind: pair for pair in pairs if not pair.is_safe}
    for key, guard in (
        ("uplink_guard_s", uplink_guard(case, pairs)),
        ("downlink_guard_s", downlink_guard(case)),
    ):
        if guard is not None and guard.wasted_s < 0.0:
            yield key, _up(guard.needed_s, STEP_S)
    margin = rules.margin_needed(case)
    if "same slot" in refused and margin <= MOST_RANGES * case.scenario.acoustics.hf.range_m:
        yield "conflict_margin_m", _up(margin, STEP_M)
    if case.setup.broadcaster.at_once:
        yield "broadcaster", "rotate"
    if "call and answer" in refused:
        lacks = -(refused["call and answer"].margin_s or 0.0)
        yield "ranging.turnaround_s", _up(case.scenario.protocol.turnaround_s + lacks, STEP_S)


def _changed(case: Case, changes: Changes) -> Case:
    """Return the case of a scenario with other values of some keys of its protocol."""
    data = case.scenario.model_dump(mode="json")
    for key, value in changes.items():
        put(data, f"protocol.{key}", value)
    return Case(Setup.of(Scenario.model_validate(data)), case.bounds)


def _up(value: float, step: float) -> float:
    return round(math.ceil(value / step + 1e-6) * step, 6)

"""Every kind of pair of signals that may meet at a receiver, and what is decided of it."""

from collections.abc import Callable, Iterator
from functools import partial

from ..core.plugins import is_plugin
from ..scenario.declared import channel_named, ranging_of, schedule_of
from ..scenario.families import is_random
from ..scenario.telling import tells_slots
from .case import Case
from .frames import beacons, broadcasts
from .pair import Pair, undecided
from .reuse import same_slot
from .two_way import answer_and_next_call, answers, call_and_answer, calls_of_a_slot, random_access
from .uplink import consecutive_slots
from .witnesses.signals import groups_shown

Rule = Callable[[Case], Iterator[Pair]]

# What may meet where ASVs ping, where they call AUVs, and where AUVs ping by their clocks
BEACONS: tuple[Rule, ...] = (beacons,)
CALLED: tuple[Rule, ...] = (same_slot, calls_of_a_slot, call_and_answer, answer_and_next_call)
BY_CLOCKS: tuple[Rule, ...] = (same_slot, consecutive_slots)
FRAMES: tuple[Rule, ...] = (broadcasts, answers)


def pairs_of(case: Case) -> list[Pair]:
    """Return every kind of pair of signals of a scenario's protocol, each with its verdict."""
    unknown = list(_unknown(case))
    if unknown:
        return unknown
    if is_random(case.scenario):
        return list(random_access(case))
    return [pair for rule in _rules(case) for pair in rule(case)]


def _rules(case: Case) -> tuple[Rule, ...]:
    ranging = ranging_of(case.scenario)
    if ranging.asvs_ping:
        return BEACONS
    return (*(CALLED if ranging.calls else BY_CLOCKS), *FRAMES)


def _unknown(case: Case) -> Iterator[Pair]:
    """Yield what of a protocol lies beyond what is proved here."""
    protocol, acoustics = case.scenario.protocol, case.scenario.acoustics
    for name in (protocol.schedule, protocol.downlink, protocol.ranging):
        if is_plugin(str(name)):
            why = "who sends when only the plug-in says: nothing is proved beyond what was played"
            yield undecided("part of one's own", str(name), why, partial(groups_shown, case))
    if protocol.duplex != "per_band":
        yield undecided("half duplex", "pings and frames", "who sends on one band is deaf on both")
    bands = [("pings", acoustics.hf.channel)]
    if not protocol.is_passive:
        bands.append(("frames", acoustics.mf.channel))
    for what, channel in bands:
        if not channel_named(channel).ends_at_range:
            why = f"with the channel {str(channel)!r} sound ends at no range"
            yield undecided("sound without a range", what, why)
    known = protocol.is_passive or is_plugin(str(protocol.schedule)) or is_random(case.scenario)
    if not known and not schedule_of(case.scenario).is_proved:
        why = "nothing is proved of this schedule beyond what was played"
        yield undecided("schedule", str(protocol.schedule), why, partial(groups_shown, case))
    if tells_slots(case.scenario) and protocol.dissemination.missed != "silent":
        why = "AUVs that were not told their slots ping when they reckon these to be"
        shown = partial(groups_shown, case)
        yield undecided(
            "slots that are told", f"missed {protocol.dissemination.missed}", why, shown
        )
    elif tells_slots(case.scenario) and schedule_of(case.scenario).is_shared_and_proved:
        why = "slots are shared by where AUVs are believed to be as a frame begins, a round ahead"
        shown = partial(groups_shown, case)
        yield undecided("slots that are told", str(protocol.schedule), why, shown)

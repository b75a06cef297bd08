"""AUVs that ping in one slot because no ASV hears both, as far as the fleet knows."""

import math
from collections.abc import Iterator
from functools import partial

import numpy as np

from ..preflight.round_lengths import rounds_of
from .bounds import Beside, farthest_off
from .case import ACCEPTED, REFUSED, Case, Plan, SignalPair, undecided
from .signals import at_the_edge, come_in_together, comes_into_range, rounds_shown
from .uplink import answering_s

KIND = "same slot"
WHAT = "AUVs of one ping group"

# What a margin lacks by less (m) is rounding.
TOUCH_M = 1e-9


def same_slot(case: Case) -> Iterator[SignalPair]:
    """Yield whether an ASV may hear two AUVs of one group by the time at which they ping.

    They share a group because no ASV had both within R + m where they were believed, m the conflict
    margin.  What was believed is wrong by e and has aged by a when they ping, at a relative speed
    of v: an ASV that hears both within R then had both believed within R + v a + e.  So they are
    apart iff m >= v a + e.  (Aslant the AUV comes nearer by less than it moves: R + m is the slant
    range of a place v a farther, seen from above.)

    With true positions e = 0 and a is the way from the round's start to their slot.  An AUV in slot
    s is there because AUVs of all slots before are in conflict with it, and so is the other: of N
    AUVs two share slot N - 2 at most.  One ASV alone hears all that conflict, and has nobody share
    but slot 0, a = 0.  Clocks make a longer by 2 e_c.  With last fixes a may be the whole mission:
    who is not heard is not fixed.
    """
    scenario = case.scenario
    setup = case.setup
    if not setup.schedule.is_shared_and_proved or scenario.auvs.count < 2:
        return
    returning = [failure for failure in scenario.asvs.failures if failure.until_s is not None]
    if returning:
        why = (
            f"ASV{returning[0].asv} works again at {returning[0].until_s:g} s, and may hear AUVs "
            "of one group that was formed without it"
        )
        yield undecided(KIND, WHAT, why)
        return
    margin, needed = scenario.protocol.conflict_margin_m, margin_needed(case)
    spare = margin - needed
    why = f"{_rule(case)}: {needed:.3g} m of conflict margin needed, {margin:.3g} m set"
    if needed == math.inf:
        why = "nothing bounds how far AUVs may be from where they are believed"
    if spare > -TOUCH_M:
        yield SignalPair(KIND, WHAT, ACCEPTED, why, margin_m=max(spare, 0.0))
    else:
        witnesses = partial(_witnesses, case)
        yield SignalPair(KIND, WHAT, REFUSED, why, margin_m=bounded(spare), witnesses=witnesses)


def bounded(value: float) -> float | None:
    """Return a number, None for one that is infinite."""
    return value if math.isfinite(value) else None


def margin_needed(case: Case) -> float:
    """Return the least conflict margin (m) with which no ASV hears two AUVs of one group."""
    if not case.setup.schedule.is_shared_and_proved or case.scenario.auvs.count < 2:
        return 0.0
    return _nearer(case, case.closing_m_per_s * age_s(case)) + believed_off_m(case)


def believed_off_m(case: Case) -> float:
    """Return how far (m) an AUV may have been from where it is believed, as it was fixed.

    Infinite where nothing bounds it: of instruments of one's own; of fixes of several ASVs, since
    where ranges nearly agree in direction, weighing makes any way across of what both err by; and
    of fixes carried along a tour, which may be taken for those of another leg.
    """
    scenario, hf = case.scenario, case.scenario.acoustics.hf
    setup = case.setup
    positions, usbl = scenario.protocol.positions, scenario.usbl
    if positions == "truth":
        return 0.0
    route = setup.route
    tours = not (route.is_held or route.is_recorded)
    if usbl.model.is_own or (positions == "carried_forward" and tours):
        return math.inf
    many = len(case.apart_m) and float(case.apart_m.min()) <= 2 * hf.range_m
    both_ways = setup.ranging.calls
    if many or (both_ways and case.bounds.asv_speed_m_per_s > 0.0):
        return math.inf
    systematic, auvs = (
        {kind.name: kind.sds[0] for kind in setup.lasting_errors},
        range(scenario.auvs.count),
    )
    beside = Beside(
        systematic.get("misalignment", 0.0),
        systematic.get("gnss", 0.0),
        usbl.outlier_sd_m if usbl.outlier_share > 0.0 else 0.0,
        0.0 if both_ways else case.bounds.clock_error_s,
        case.bounds.sound_speed_error_m_per_s,
        case.closing_m_per_s * answering_s(case) if both_ways else 0.0,
    )
    nearest, longest = min(map(case.shortest_m, auvs)), max(map(case.longest_m, auvs))
    return farthest_off(setup.usbl, nearest, longest, beside, case.bounds.sigmas)


def _nearer(case: Case, moved: float) -> float:
    """Return how much nearer (m) an AUV at the edge of range comes that moves so far (m)."""
    scenario = case.scenario
    if scenario.acoustics.hf.range_metric != "slant" or scenario.auvs.vehicle.is_steered:
        return moved
    return _aslant(case, moved)


def _aslant(case: Case, moved: float) -> float:
    """Return how much nearer aslant (m) an AUV at the edge of range comes that moves so far (m)."""
    reach, found = case.scenario.acoustics.hf.range_m, 0.0
    for shallow, _ in set(case.depths):
        if shallow < reach:
            across = math.sqrt(reach**2 - shallow**2) + moved
            found = max(found, math.hypot(across, shallow) - reach)
    return found


def age_s(case: Case) -> float:
    """Return how long (s) before a shared slot AUVs may have been where they are believed."""
    if case.scenario.protocol.positions != "truth":
        return case.scenario.duration_s
    return most_shared_slot(case) * _slot_in_round(case) + case.late_s


def most_shared_slot(case: Case) -> int:
    """Return the last slot of a round that two AUVs may share and an ASV hear both."""
    last = case.scenario.auvs.count - 2
    last = min(last, rounds_of(case.setup).most - 1)  # whoever finds no room has no slot
    if last < 1 or not len(case.apart_m):
        return 0
    protocol, reach = case.scenario.protocol, case.scenario.acoustics.hf.range_m
    ways = case.closing_m_per_s * (last * _slot_in_round(case) + case.late_s)
    met = case.apart_m <= 2 * reach + protocol.conflict_margin_m + ways
    return last if bool(np.any(met)) else 0


def _slot_in_round(case: Case) -> float:
    """Return the most time (s) from one slot of a round to the next."""
    if not case.setup.downlink.by_group:
        return case.slot_s
    slots = case.slots
    return max(case.slot_s, slots.clock.after(0.0, slots.downlink_slot(len(case.depths))))


def _rule(case: Case) -> str:
    age, speed = age_s(case), case.closing_m_per_s
    if case.scenario.protocol.positions != "truth":
        return f"positions may be {age:.4g} s old, and {speed:.3g} m/s makes of that"
    slot = most_shared_slot(case)
    return f"slot {slot} is {1e3 * age:.4g} ms after the round's start, at {speed:.3g} m/s"


def _witnesses(case: Case) -> Iterator[Plan]:
    margin, speed = case.scenario.protocol.conflict_margin_m, case.closing_m_per_s
    positions = case.scenario.protocol.positions
    if positions == "last_fix" and speed > 0.0:
        shown = min(margin / speed + rounds_shown(case), case.scenario.duration_s)
        yield come_in_together(case, shown)
    if positions != "truth":
        yield at_the_edge(case)
        return
    if most_shared_slot(case):
        yield from comes_into_range(case)
    if case.late_s:
        yield come_in_together(case, rounds_shown(case), case.late_s)

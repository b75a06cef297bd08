"""Why a ping had its slot: how an AUV knows it and why it was silent before, and why it was its
turn, where the schedule goes by more than who hears whom.
"""

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.wording import counted
from ..protocol.schedules.view import weighed
from ..scenario.declared import channel_named
from .chain import Step, apart, place, row_of, rows_where
from .overlapping import number_of

if TYPE_CHECKING:
    from ..results.result import Result


def slot_steps(result: "Result", ping: Any) -> Iterator[Step]:
    """Yield the slots that the AUV has missed since its last ping, and the frame that named it."""
    assigned = rows_where(result.tables["assignments"], auv=ping.auv)
    pings = rows_where(result.tables["pings"], auv=ping.auv)
    before = pings[pings.sent_at_s < ping.sent_at_s].sent_at_s.max()
    since = assigned[(assigned.starts_at_s < ping.sent_at_s) & ~(assigned.starts_at_s <= before)]
    missed = since[since.outcome == "missed"]
    if len(missed):
        last: Any = missed.iloc[-1]
        yield Step(
            last.starts_at_s,
            ping.auv,
            f"has missed {counted(len(missed), 'slot')} since its last ping, in round "
            f"{last['round']} the last",
            _why_missed(result, last),
            {"missed": len(missed), "round": int(last["round"])},
        )
    assigned = _assigned(result, ping)
    if len(assigned) and assigned.told_at_s.notna().all():
        frame: Any = assigned.iloc[0]
        yield Step(
            frame.told_at_s,
            frame.told_by,
            f"tells {ping.auv} that slot {frame.slot} of round {frame['round']} is its own",
            f"in a frame that {ping.auv} has decoded before it begins",
            {"round": int(frame["round"]), "slot": int(frame.slot)},
        )


def is_reckoned(result: "Result", ping: Any) -> bool:
    """Tell whether an AUV pinged without having been told of that slot."""
    protocol = result.scenario.protocol
    if not len(result.tables["assignments"]) or len(_assigned(result, ping)):
        return False
    return protocol.dissemination.missed in ("last_slot", "contention")


def by_reckoning(result: "Result", ping: Any) -> str:
    """Tell why an AUV pings that was not told to."""
    if result.scenario.protocol.dissemination.missed == "contention":
        return "it knows of no slot of its own, and tries its luck where it takes contention to be"
    return (
        f"it has received no slot since, and pings in the last that it received, {ping.slot}, "
        f"when that is by its reckoning{_turn_of_others(result, ping)}"
    )


def _turn_of_others(result: "Result", ping: Any) -> str:
    """Name the AUVs whose slot it is by now in which an AUV pings by reckoning; "" for none."""
    assigned = result.tables["assignments"]
    begun = assigned[assigned.starts_at_s <= ping.sent_at_s]
    now = begun[(begun.starts_at_s == begun.starts_at_s.max()) & (begun.auv != ping.auv)]
    if not len(now):
        return ""
    slot: Any = now.iloc[0]
    return f"; that is slot {slot.slot} of round {slot['round']} by now, of {', '.join(now.auv)}"


def _assigned(result: "Result", ping: Any) -> Any:
    """Return the assignment (at most one row) by which an AUV pings."""
    return rows_where(
        result.tables["assignments"], round=ping["round"], slot=ping.slot, auv=ping.auv,
        starts_at_s=ping.sent_at_s, outcome="known",
    )  # fmt: skip


def _why_missed(result: "Result", slot: Any) -> str:
    """Tell why an AUV did not know a slot."""
    if slot.told_by is None or slot.told_at_s != slot.told_at_s:
        return "no frame had named the slots of that round"
    auv, asv = (place(result, name, slot.told_at_s) for name in (slot.auv, slot.told_by))
    mf = result.scenario.acoustics.mf
    away = apart(mf, auv, asv)
    frame = f"the frame of {slot.told_by} that began at {slot.told_at_s:.4f} s"
    if channel_named(mf.channel).ends_at_range and away > mf.range_m:
        return f"it was out of MF range of {frame}: {away:.1f} m > {mf.range_m:g} m"
    return f"it had not decoded {frame} when that slot began, from {away:.1f} m away"


Why = tuple[list[str], dict[str, Any]]


def why_now(result: "Result", ping: Any) -> Why:
    """Return why an AUV pings now, in sentences and numbers; nothing where its slot says it all."""
    rule = RULES.get(result.setup.schedule.turn_by)
    if rule is None:
        return [], {}
    (first, *others), facts = rule(result, ping)
    return [f"{result.scenario.protocol.schedule}: {first}", *others], facts


def _by_expected_error(result: "Result", ping: Any) -> Why:
    """Tell what the fleet expected of the AUV when the round began, and how long it had waited."""
    begins = float(row_of(result, "rounds", "round", ping["round"]).started_at_s)
    pings, fixes = result.tables["pings"], result.tables["fixes"]
    own = rows_where(fixes, auv=ping.auv)
    variance, fixed_at, last = 2.0 * result.scenario.navigation.initial_position_sd_m**2, 0.0, -1
    for fix in own[own.broadcast_at_s <= begins].itertuples():
        if fix.pinged_at_s >= fixed_at:
            variance += _drift(result, ping.auv, fix.pinged_at_s - fixed_at) ** 2
            variance = weighed(variance, fix.sd_x_m**2 + fix.sd_y_m**2)
            fixed_at, last = float(fix.pinged_at_s), int(fix.ping)
    before = rows_where(pings, auv=ping.auv)
    before = before[before["round"] < ping["round"]]
    since_then = int((before.ping > last).sum())
    passed = int(ping["round"]) - 1 - int(before["round"].max() if len(before) else -1)
    since = begins - fixed_at
    error = math.sqrt(variance + _drift(result, ping.auv, since) ** 2)
    age = f"its last fix is {since:.1f} s old" if last >= 0 else "it has had no fix yet"
    tried = f", {counted(since_then, 'ping')} since then made none" if since_then else ""
    waited = f", passed over for {counted(passed, 'round')}" if passed else ""
    return (
        [f"{age}, an expected error of {error:.2f} m{tried}{waited}"],
        {
            "since_s": since, "expected_error_m": error, "pings_since": since_then,
            "rounds_passed_over": passed,
        },
    )  # fmt: skip


def _drift(result: "Result", auv: str, time: float) -> float:
    """Return the drift (m, RMS) that the fleet expects of an AUV in a time (s) without fixes."""
    auvs = result.scenario.auvs
    speed = 0.0 if auvs.route.is_held else auvs.speed(number_of(auv))
    return result.setup.own_sensors.straight_drift_rms(time, speed)


def _by_calls(result: "Result", ping: Any) -> Why:
    """Tell what the call has waited for."""
    pings = rows_where(result.tables["pings"], round=ping["round"])
    before = pings[pings.slot == ping.slot - 1]
    if not len(before):
        return ["it is the first to be called in this round"], {}
    names, unheard = ", ".join(before.auv), []
    for earlier in before.itertuples():
        met = rows_where(result.tables["receptions"], ping=earlier.ping, asv=earlier.called_by)
        if earlier.call != "heard" or "heard" not in set(met.outcome):
            unheard.append(earlier.auv)
    if unheard:
        silent = ", ".join(unheard)
        return [f"it was called when the wait for {silent} was over, unanswered"], {}
    return [f"it was called when the answer of {names} had been decoded"], {}


def _by_arrivals(result: "Result", ping: Any) -> Why:
    """Tell behind whose arrival this one comes in most closely, at which ASV."""
    lasts = result.scenario.acoustics.hf.ping_s
    pings = rows_where(result.tables["pings"], round=ping["round"])
    met = result.tables["receptions"]
    met = met[met.ping.isin(pings.ping) & (met.outcome != "out_of_range")]
    gaps = []
    for own in met[met.ping == ping.ping].itertuples():
        others = met[(met.asv == own.asv) & (met.arrived_at_s < own.arrived_at_s)]
        if len(others):
            other = others.loc[others.arrived_at_s.idxmax()]
            gaps.append((own.arrived_at_s - other.arrived_at_s - lasts, own.asv, other.auv))
    departs = f"it sets out {1e3 * _late(result, ping):.1f} ms after the round began"
    if not gaps:
        return [f"{departs}, as the first to arrive wherever it is heard"], {}
    gap, asv, other = min(gaps)
    how = f"{1e3 * gap:.1f} ms after that of {other} is over"
    if gap < 0.0:
        how = f"{-1e3 * gap:.1f} ms before that of {other} is over"
    return [f"{departs}, so that its ping comes in at {asv} {how}"], {"gap_s": float(gap)}


def _late(result: "Result", ping: Any) -> float:
    begins = row_of(result, "rounds", "round", ping["round"]).started_at_s
    return float(np.subtract(ping.sent_at_s, begins))


RULES = {"expected_error": _by_expected_error, "calls": _by_calls, "arrivals": _by_arrivals}

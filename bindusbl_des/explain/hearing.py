"""What each ASV makes of a ping: who hears it, who does not, and by which rule.

With passive ranging an ASV pings, and AUVs make something of it (:mod:`.itself`).
"""

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from ..acoustics.channel import contention_of
from ..acoustics.loss import COMBINERS, FITTED_RANGE, loss_law, range_loss
from ..core.plugins import is_plugin
from ..scenario.declared import channel_named
from .by_channel import decided_by_channel, levels, loss_by_channel
from .chain import Step
from .failing import failed_while, had_failed
from .lasting import ping_lasting
from .numbers import compared, out_of_range, place, rows_where
from .overlapping import deafened, sounds_beside
from .sending import is_sent
from .under_way import on_its_way

if TYPE_CHECKING:
    from ..results.result import Result


def receptions(result: "Result", ping: Any) -> Iterator[Step]:
    """Yield what each ASV makes of a ping, and by which rule; nothing of one that was not sent.

    With passive ranging it is each AUV that hears the ping of an ASV.
    """
    if not is_sent(ping):
        return
    hf = result.scenario.acoustics.hf
    met = rows_where(result.tables["receptions"], ping=ping.ping).sort_values("arrived_at_s")
    for reception in met.itertuples():
        depth = ping.z_m
        if is_passive(result):
            depth = place(result, str(reception.auv), float(reception.arrived_at_s))[2]
        what, why = _decided(result, reception, depth)
        if reception.outcome == "out_of_range":
            why += on_its_way(result, str(reception.asv), float(reception.arrived_at_s))
        way = f"{reception.slant_range_m:.1f} m, {1e3 * reception.travel_time_s:.1f} ms"
        probability = _loss(result, reception)[0]
        facts = {
            "outcome": reception.outcome,
            "slant_range_m": reception.slant_range_m,
            "travel_time_s": reception.travel_time_s,
            "range_m": _counted_range(result, reception, depth),
            "limit_m": hf.range_m if channel_named(hf.channel).ends_at_range else None,
            "loss_probability": None if reception.outcome == "out_of_range" else probability,
            **levels(reception),
        }
        who = getattr(reception, result.scenario.protocol.listening)
        yield Step(reception.arrived_at_s, who, f"{what} ({way})", why, facts)


def is_passive(result: "Result") -> bool:
    """Tell whether ASVs pinged, and AUVs fixed themselves."""
    return result.scenario.protocol.is_passive


def _decided(result: "Result", reception: Any, depth: float) -> tuple[str, str]:
    hf, outcome = result.scenario.acoustics.hf, reception.outcome
    if told := _failed(result, reception):
        return "loses it" if outcome == "lost" else "hears nothing", told
    if told := deafened(result, reception):
        return "hears nothing", told
    others = sounds_beside(result, reception)
    if not channel_named(hf.channel).ends_at_range and not is_plugin(hf.channel):
        return decided_by_channel(result, reception, others)
    away = _counted_range(result, reception, depth)
    # A vessel that moves may cross the limit while the ping is under way.
    is_beyond = outcome == "out_of_range"
    told = compared(away, hf.range_m) if (away > hf.range_m) == is_beyond else "at the edge of the"
    within = f"{hf.range_metric} range {told} HF range"
    if is_plugin(hf.channel):
        if is_beyond:
            return "hears nothing", f"it is {out_of_range(hf)}"
        within = f"{hf.channel.told}: the plug-in let some sound through"
    if is_beyond:
        return "is too far away", within
    if outcome == "in_flight":
        ends = reception.arrived_at_s + hf.ping_s
        return "would hear it, but the mission ends", (
            f"{within}; the ping ends at {ends:.4f} s, the mission at "
            f"{result.scenario.duration_s:g} s"
        )
    if outcome == "collided":
        return "hears pings mixed", f"{within}; overlaps {', '.join(others)}"
    probability, told = _loss(result, reception)
    if outcome == "lost":
        return (
            "loses it",
            "; ".join(filter(None, [
                within, "no other ping overlaps",
                f"{told}, and the draw (not recorded) was below",
                ping_lasting(result, reception, probability),
            ])),
        )  # fmt: skip
    return "decodes it", f"{within}; no other ping overlaps; {told}"


def _failed(result: "Result", reception: Any) -> str:
    """Tell that the ASV of a reception had failed, or failed meanwhile; "" if it worked."""
    arrives, lasts = float(reception.arrived_at_s), result.scenario.acoustics.hf.ping_s
    if is_passive(result):
        sent = arrives - float(reception.travel_time_s)
        return _meanwhile(result, reception, (sent, sent + lasts), "pinged")
    if reception.outcome == "out_of_range":
        return had_failed(result, reception.asv, arrives)
    return _meanwhile(result, reception, (arrives, arrives + lasts), "was hearing it")


def _meanwhile(result: "Result", reception: Any, span: tuple[float, float], doing: str) -> str:
    lost = reception.outcome == "lost"
    return failed_while(result, reception.asv, *span, doing) if lost else ""


def _counted_range(result: "Result", reception: Any, depth: float) -> float:
    """Return the range (m) that the rule compares; ASVs float at the surface."""
    slant = float(reception.slant_range_m)
    if result.scenario.acoustics.hf.range_metric == "slant":
        return slant
    return math.sqrt(max(slant**2 - depth**2, 0.0))


def _loss(result: "Result", reception: Any) -> tuple[float | None, str]:
    """Return the probability of losing a ping, and how it comes about."""
    channel, slant_range = result.scenario.acoustics.hf.channel, float(reception.slant_range_m)
    if is_plugin(channel):
        return None, "the chance is the plug-in's (not recorded)"
    if not channel_named(channel).ends_at_range:
        return loss_by_channel(result.scenario, slant_range), ""
    loss, contention = result.scenario.acoustics.loss, contention_of(result.scenario)
    hf_range = result.scenario.acoustics.hf.range_m
    raw = range_loss(slant_range, loss_law(loss.law, hf_range))
    law = f"range law '{loss.law}'"
    if loss.law == "scaled" and hf_range > FITTED_RANGE:
        law += f" (the paper's at {slant_range * FITTED_RANGE / hf_range:.1f} m)"
    probability = COMBINERS[loss.combine](raw, contention, loss.cap)
    if loss.combine == "off":
        return probability, f"loss probability {probability:.3f} by {law}"
    return probability, (
        f"loss probability {probability:.3f} ({loss.combine} of {law} {raw:.3f} "
        f"and contention {contention:.3f})"
    )

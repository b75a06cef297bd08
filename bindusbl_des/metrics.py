"""What a mission achieved: each figure defined once, here."""

from collections.abc import Sequence
from dataclasses import fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .events import COLLIDED, IN_FLIGHT, LOST, AuvMetrics, Fix, Utilisation
from .propagation import AUV, HEARD_BY, IN_RANGE_OF, OF_AUV, OF_PING, OUTCOME, SENT_AT
from .recorder import Recorder
from .samples import Samples, instants, sample
from .world import World

Array = NDArray[np.float64]


def auv_metrics(world: World) -> list[AuvMetrics]:
    """Return the metrics of every AUV, in index order."""
    times = instants(world.scenario.duration_s, world.scenario.record.metrics_hz)
    reach = _reach(world.record, len(world.auvs))
    fixes: list[list[Fix]] = [[] for _ in world.auvs]
    for fix in world.record.fixes:
        fixes[fix.auv].append(fix)
    return [
        AuvMetrics(
            auv=auv.index,
            **{name: counts[auv.index] for name, counts in reach.items()},
            **_service(fixes[auv.index], world),
            **_accuracy(sample(auv, times)),
            path_error_m=_mean(auv.vehicle.path_error(times)),
            distance_m=auv.vehicle.distance(world.scenario.duration_s),
            speed_m_per_s=auv.vehicle.distance(world.scenario.duration_s)
            / world.scenario.duration_s,
            saturated_share=auv.vehicle.saturated(),
        )
        for auv in world.auvs
    ]


def _reach(record: Recorder, auvs: int) -> dict[str, list[Any]]:
    """Return what became of the pings of each AUV."""
    pings, receptions = record.pings.rows, record.receptions.rows
    sender, outcome = pings[:, AUV].astype(np.intp), receptions[:, OUTCOME]

    def count(of: NDArray[Any], which: NDArray[np.bool_]) -> list[int]:
        counts: list[int] = np.bincount(of[which].astype(np.intp), minlength=auvs).tolist()
        return counts

    landed = np.ones(len(pings), dtype=bool)
    landed[receptions[outcome == IN_FLIGHT, OF_PING].astype(np.intp)] = False
    in_range = pings[:, IN_RANGE_OF] > 0
    covered, known = count(sender, landed & in_range), count(sender, landed)
    return {
        "pings": count(sender, np.ones(len(pings), dtype=bool)),
        "pings_in_range": count(sender, in_range),
        "pings_heard": count(sender, pings[:, HEARD_BY] > 0),
        "hf_coverage": [c / k if k else None for c, k in zip(covered, known, strict=True)],
        "receptions_lost": count(receptions[:, OF_AUV], outcome == LOST),
        "collisions": count(receptions[:, OF_AUV], outcome == COLLIDED),
    }


def _service(fixes: Sequence[Fix], world: World) -> dict[str, Any]:
    delivered = [fix for fix in fixes if fix.delivered_at_s is not None]
    arrivals = np.sort([fix.delivered_at_s or 0.0 for fix in delivered])
    latency = np.array([fix.latency_s or 0.0 for fix in delivered])
    since_broadcast = [
        (fix.delivered_at_s or 0.0) - (fix.broadcast_at_s or 0.0) for fix in delivered
    ]
    slots = world.slots
    since_slot = [
        (fix.delivered_at_s or 0.0) - slots.clock.after(fix.pinged_at_s, slots.uplink_slot)
        for fix in delivered
    ]
    one_way = world.scenario.protocol.ranging == "owtt_sync"
    return {
        "fixes": len(fixes),
        "fixes_delivered": len(delivered),
        "fixes_out_of_range": sum(1 for fix in fixes if fix.outcome == "out_of_range"),
        "fixes_in_flight": sum(1 for fix in fixes if fix.outcome == "in_flight"),
        "fix_rate_hz": len(delivered) / world.scenario.duration_s,
        **_spread("interval", np.diff(arrivals)),
        **_spread("latency", latency),
        "latency_from_broadcast_s": _mean(np.array(since_broadcast)),
        "latency_from_slot_s": _mean(np.array(since_slot)) if one_way else None,
        "fix_error_rms_m": _rms(np.array([fix.error_m for fix in fixes])),
    }


def _accuracy(samples: Samples) -> dict[str, Any]:
    error = samples.position_error
    return {
        "position_error_m": _mean(error),
        "position_error_rms_m": _rms(error),
        "position_error_p95_m": float(np.quantile(error, 0.95)),
        "position_error_max_m": float(error.max()),
        "cross_track_error_m": _mean(np.abs(samples.cross_track_error)),
        "imu_error_m": _mean(samples.imu_error),
    }


def _spread(name: str, values: Array) -> dict[str, float | None]:
    return {
        f"{name}_mean_s": _mean(values),
        f"{name}_p95_s": float(np.quantile(values, 0.95)) if len(values) else None,
        f"{name}_max_s": float(values.max()) if len(values) else None,
    }


def _mean(values: Array) -> float | None:
    return float(values.mean()) if len(values) else None


def _rms(values: Array) -> float | None:
    return float(np.sqrt(np.mean(values**2))) if len(values) else None


def utilisation(world: World) -> Utilisation:
    """Return what only the mission as a whole has."""
    record, duration = world.record, world.scenario.duration_s
    sent = np.unique(record.pings.rows[:, SENT_AT]).tolist()
    on_air = [min(b.airtime_s, duration - b.sent_at_s) for b in record.broadcasts]
    return Utilisation(
        rounds=len(record.rounds),
        collisions=int(np.sum(record.receptions.rows[:, OUTCOME] == COLLIDED)),
        hf_utilisation=_covered(sent, world.slots.ping_duration, duration) / duration,
        mf_utilisation=sum(on_air) / duration,
    )


def _covered(starts: Sequence[float], length: float, end: float) -> float:
    """Return the time (s) that intervals of one length cover, overlaps counted once."""
    total, free_from = 0.0, 0.0
    for start in starts:
        until = min(start + length, end)
        total += max(until - max(start, free_from), 0.0)
        free_from = max(free_from, until)
    return total


def mission_metrics(auvs: Sequence[AuvMetrics], whole: Utilisation) -> dict[str, float | None]:
    """Return the fleet means of all AUV metrics (AUVs without a value left out) and its own."""
    means: dict[str, float | None] = {}
    for column in fields(AuvMetrics)[1:]:
        values = [getattr(auv, column.name) for auv in auvs]
        known = [value for value in values if value is not None]
        means[column.name] = float(np.mean(known)) if known else None
    own = {column.name: getattr(whole, column.name) for column in fields(Utilisation)}
    return {**means, **own}

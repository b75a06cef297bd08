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
            saturated_share=auv.vehicle.saturated(world.scenario.duration_s),
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
    """Return what became of the fixes of one AUV, and how late they were."""
    pinged, broadcast, delivered, error = (
        np.array(
            [(f.pinged_at_s, f.broadcast_at_s, f.delivered_at_s, f.error_m) for f in fixes],
            dtype=float,
        )
        .reshape(-1, 4)
        .T
    )  # None is NaN
    arrived = ~np.isnan(delivered)
    latency = (delivered - pinged)[arrived]
    outcomes = [fix.outcome for fix in fixes]
    one_way = world.scenario.protocol.ranging == "owtt_sync"
    slot = world.slots.clock.after(0.0, world.slots.uplink_slot)  # pings begin with their slots
    return {
        "fixes": len(fixes),
        "fixes_delivered": len(latency),
        "fixes_out_of_range": outcomes.count("out_of_range"),
        "fixes_in_flight": outcomes.count("in_flight"),
        "fix_rate_hz": len(latency) / world.scenario.duration_s,
        **_spread("interval", np.diff(np.sort(delivered[arrived]))),
        **_spread("latency", latency),
        "latency_from_broadcast_s": _mean((delivered - broadcast)[arrived]),
        "latency_from_slot_s": _mean(latency - slot) if one_way else None,
        "fix_error_rms_m": _rms(error),
    }


def _accuracy(samples: Samples) -> dict[str, Any]:
    error = samples.position_error
    return {
        "position_error_m": _mean(error),
        "position_error_rms_m": _rms(error),
        "position_error_p95_m": _p95(error),
        "position_error_max_m": float(error.max()),
        "cross_track_error_m": _mean(np.abs(samples.cross_track_error)),
        "imu_error_m": _mean(samples.imu_error),
    }


def _spread(name: str, values: Array) -> dict[str, float | None]:
    return {
        f"{name}_mean_s": _mean(values),
        f"{name}_p95_s": _p95(values),
        f"{name}_max_s": float(values.max()) if len(values) else None,
    }


def _p95(values: Array) -> float | None:
    """Return the 95 % quantile, linear between the two values beside it, as numpy's."""
    if not len(values):
        return None
    place = 0.95 * (len(values) - 1)
    low = int(place)
    pair = np.partition(values, (low, min(low + 1, len(values) - 1)))[low : low + 2]
    return float(pair[0] + (place - low) * (pair[-1] - pair[0]))


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

"""What a mission achieved: each figure defined once, here."""

import math
from collections.abc import Sequence
from dataclasses import fields
from functools import partial
from math import cos, sin, sqrt
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from ..acoustics.energy import Powers, Times, energy, on_hf, on_mf
from ..core.compiled import entry
from ..navigation.dead_reckoning import Odometry
from ..navigation.weighing import SURE
from ..records.events import (
    COLLIDED,
    DELIVERED,
    HEARD,
    IN_FLIGHT,
    LOST,
    OUT_OF_RANGE,
    AuvMetrics,
    Broadcast,
    Utilisation,
)
from ..records.recorder import Recorder
from ..records.rows import NONE, Rows
from ..records.worst import worst_of
from ..scenario.families import UNEQUAL_SLOTS, is_random
from ..scenario.sections.acoustics import Band
from ..scenario.survey_area import area_of
from ..vehicles.motion import places
from .outcomes.reach import heard_by_auvs, heard_of_auvs
from .samples import Samples, instants, sample
from .world import World

Array = NDArray[np.float64]


def auv_metrics(world: World) -> list[AuvMetrics]:
    """Return the metrics of every AUV, in index order."""
    duration = world.scenario.duration_s
    times = instants(duration, world.scenario.record.metrics_hz)
    look = heard_by_auvs if world.scenario.protocol.is_passive else heard_of_auvs
    reach, fixes = look(world.record, len(world.auv_fleet)), world.record.fixes.rows
    metrics, errors = [], np.empty(len(times))
    own = _by_auv(fixes["auv"], len(world.auv_fleet))
    energies, missed = modem_energies(world), _missed(world.record, len(world.auv_fleet))
    for auv, vehicle in enumerate(world.auv_fleet.vehicles):
        distance = vehicle.distance(duration)
        drawn = None if energies is None else float(energies[0][auv])
        service = _service(fixes[own[auv]], world)
        metrics.append(
            AuvMetrics(
                auv=auv,
                **{name: counts[auv] for name, counts in reach.items()},
                **service,
                **_accuracy(world, auv, times, errors),
                path_error_m=_mean(vehicle.path_error(times)),
                energy_j=drawn,
                energy_per_fix_j=_each(drawn, service["fixes_delivered"]),
                distance_m=distance,
                speed_m_per_s=distance / duration,
                saturated_share=vehicle.saturated(duration),
                lanes_flown_share=world.lanes_flown(auv),
                swept_m2=world.swept_m2(duration, auv),
                slots_missed=missed[auv],
            )
        )
        for column in fields(AuvMetrics):
            value = getattr(metrics[-1], column.name)
            if value is not None and math.isnan(value):
                _refuse(auv, f"{column.name} is no number")
    return metrics


def _missed(record: Recorder, auvs: int) -> list[int]:
    """Return how many slots of its own each AUV did not know as they began."""
    owners = [it.auv for it in record.assignments if it.outcome == "missed"]
    counts: list[int] = np.bincount(np.array(owners, dtype=np.int64), minlength=auvs).tolist()
    return counts


def _refuse(auv: int, trouble: str) -> NoReturn:
    """End the run: a NaN in a table would pass for a missing value, and be left out of means."""
    raise ArithmeticError(
        f"AUV{auv}'s {trouble}; this is a mistake of the program, not of the scenario: please "
        "report it with scenario and seed"
    )


def _by_auv(owners: NDArray[np.int64], auvs: int) -> list[NDArray[np.int64]]:
    """Return the rows of each of so many AUVs, in order; not a search of all for each."""
    order = np.argsort(owners, kind="stable")
    return np.split(order, np.cumsum(np.bincount(owners, minlength=auvs))[:-1])


def _service(fixes: Rows, world: World) -> dict[str, Any]:
    """Return what became of the fixes of one AUV (rows of the buffer), and how late they were."""
    arrived = fixes[fixes["outcome"] == DELIVERED]
    delivered, latency = arrived["delivered_at_s"], arrived["latency_s"]
    outcomes = fixes["outcome"].tolist()
    protocol = world.scenario.protocol
    regular = protocol.ranging == "owtt_sync" and protocol.schedule not in UNEQUAL_SLOTS
    in_slots = regular and protocol.downlink != "direct_reply" and not is_random(world.scenario)
    slot = world.network.slots.clock.after(
        0.0, world.network.slots.uplink_slot
    )  # pings begin with their slots
    return {
        "fixes": len(fixes),
        "fixes_delivered": len(latency),
        "fixes_out_of_range": outcomes.count(OUT_OF_RANGE),
        "fixes_lost": outcomes.count(LOST) + outcomes.count(COLLIDED),
        "fixes_in_flight": outcomes.count(IN_FLIGHT),
        "fix_rate_hz": len(latency) / world.scenario.duration_s,
        **_spread("interval", np.diff(np.sort(delivered))),
        **_ages(np.sort(delivered), world.scenario.duration_s),
        **_spread("latency", latency),
        "latency_from_broadcast_s": None
        if protocol.is_passive
        else _mean(delivered - arrived["broadcast_at_s"]),
        "latency_from_slot_s": _mean(latency - slot) if in_slots else None,
        "fix_error_rms_m": _rms(fixes["error_m"]),
        "nis": _mean(arrived["nis"][~np.isnan(arrived["nis"])]),
        "fixes_refused": int(np.isnan(arrived["correction_m"]).sum()),
    }


def _accuracy(world: World, auv: int, times: Array, errors: Array) -> dict[str, Any]:
    """Return how far off an AUV was, and whether it knew."""
    found = sample(world, auv, times)
    mean, square, largest, cross_track, imu = _errors(
        errors, found.truth, found.odometry.position, found.estimate
    )
    if not math.isfinite(mean):
        lost_at = times[np.flatnonzero(~np.isfinite(errors))[0]]
        _refuse(auv, f"estimate is no number from {lost_at:g} s on")
    return {
        "position_error_m": mean,
        "position_error_rms_m": math.sqrt(square),
        "position_error_p95_m": _p95(errors),
        "position_error_max_m": largest,
        "cross_track_error_m": cross_track,
        "imu_error_m": imu,
        "fix_benefit_m": imu - mean,
        "nees": _nees(world, auv, found),
    }


@entry
def _errors(
    errors: Array, truth: Array, reckoned: Array, estimate: Array
) -> tuple[float, float, float, float, float]:
    """Write the horizontal errors (n,), m, of an estimate (n, 2), m, of the truth (n, 4).

    Return the mean, the mean square and the largest of them, and the mean errors across the heading
    and of dead reckoning (n, 2).
    """
    total = square = largest = sideways = alone = 0.0
    heading, cosine, sine = 0.0, 1.0, 0.0
    for k in range(len(truth)):
        x, y = estimate[k, 0] - truth[k, 0], estimate[k, 1] - truth[k, 1]
        drift_x, drift_y = reckoned[k, 0] - truth[k, 0], reckoned[k, 1] - truth[k, 1]
        if truth[k, 3] != heading:  # lanes keep theirs
            heading = truth[k, 3]
            cosine, sine = cos(heading), sin(heading)
        errors[k] = sqrt(x * x + y * y)
        total += errors[k]
        square += x * x + y * y
        largest = max(largest, errors[k])
        sideways += abs(cosine * y - sine * x)
        alone += sqrt(drift_x * drift_x + drift_y * drift_y)
    n = len(truth)
    return total / n, square / n, largest, sideways / n, alone / n


def _nees(world: World, auv: int, found: Samples) -> float | None:
    """Return the time mean of e' P^-1 e of the horizontal estimate, sampled once a second.

    While an AUV is sure in some direction, as at the start, there is none.
    """
    thin = slice(None, None, max(1, round(world.scenario.record.metrics_hz)))
    odometry = Odometry(*(column[thin] for column in found.odometry))
    xx, yy, xy = world.navigator.covariance(auv, odometry).T
    x, y = found.error[thin].T
    determinant = xx * yy - xy**2
    unsure = determinant > SURE * (xx + yy) ** 2
    return _mean((yy * x**2 - 2 * xy * x * y + xx * y**2)[unsure] / determinant[unsure])


def _ages(delivered: Array, end: float) -> dict[str, float]:
    """Return mean, 95 % quantile and maximum over time of the age of the last fix (s).

    The age grows from 0 at the start and at each of the instants `delivered`, which rise, up to the
    `end`: waits before the first fix and after the last count like any other.

    >>> _ages(np.array([10.0]), 20.0)
    {'fix_age_mean_s': 5.0, 'fix_age_p95_s': 9.5, 'fix_age_max_s': 10.0}
    """
    waits = np.diff(delivered, prepend=0.0, append=end)
    longest = -np.sort(-waits)
    # an age a is exceeded for sum(max(wait - a, 0)); the k longest waits exceed the quantile
    number = np.arange(1, len(waits) + 1)
    quantile = (np.cumsum(longest) - 0.05 * end) / number
    enough = np.flatnonzero(quantile >= np.append(longest[1:], 0.0))
    return {
        "fix_age_mean_s": float(np.sum(waits**2) / (2 * end)),
        "fix_age_p95_s": float(quantile[enough[0]]),
        "fix_age_max_s": float(longest[0]),
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
    ping = world.network.slots.ping_duration
    covered, area = world.swept_m2(duration), area_of(world.scenario)
    energies = modem_energies(world)
    drawn = None if energies is None else float(energies[0].sum() + energies[1].sum())
    delivered = int(np.sum(record.fixes.rows["outcome"] == DELIVERED))
    return Utilisation(
        rounds=len(record.rounds),
        collisions=int(np.sum(record.receptions.rows["outcome"] == COLLIDED)),
        hf_utilisation=_covered(_sounds(record), ping, duration) / duration,
        mf_utilisation=_on_air(record.broadcasts, duration) / duration,
        energy_j=drawn,
        energy_per_fix_j=_each(drawn, delivered),
        duration_s=float(duration),
        area_covered_m2=covered,
        area_covered_share=None if covered is None else covered / area.square_m,
        survey_finished_at_s=world.finished_at,
    )


def _on_air(broadcasts: Sequence[Broadcast], end: float) -> float:
    """Return the time (s) before `end` in which some frame is on the air, in the order in which
    they were sent.
    """
    total = until = 0.0
    for frame in broadcasts:
        ends = min(frame.sent_at_s + frame.airtime_s, end)
        if frame.sent_at_s >= until:
            total += min(frame.airtime_s, end - frame.sent_at_s)
        else:
            total += max(ends - until, 0.0)
        until = max(until, ends)
    return total


def _each(energy: float | None, fixes: int) -> float | None:
    return None if energy is None or not fixes else energy / fixes


def modem_energies(world: World) -> tuple[Array, Array] | None:
    """Return what the modems of the n AUVs and of the m ASVs draw (J), (n,) and (m,); None where
    no band in use has powers.
    """
    scenario, record = world.scenario, world.record
    bands, protocol, end = scenario.acoustics, scenario.protocol, scenario.duration_s
    fleets = world.auv_fleet, world.asv_fleet
    broadcasts = not protocol.is_passive and protocol.downlink != "direct_reply"
    drawn: list[tuple[Array, Array]] = []
    failures = fleets[1].failures
    worked = end if failures is None else failures.worked_s(end)
    if (powers := _powers(bands.hf)) is not None:
        times, counts = Times(bands.hf.ping_s, end), (len(fleets[0]), len(fleets[1]))
        on_air = on_hf(record, protocol.pinging, *counts, times)
        drawn.append((energy(on_air["auv"], powers, end), energy(on_air["asv"], powers, worked)))
    if broadcasts and (powers := _powers(bands.mf)) is not None:
        where = partial(places, fleets[0].motion), partial(places, fleets[1].motion)
        auvs, asvs = on_mf(record.broadcasts, where, bands.mf.range_m, end)
        drawn.append((energy(auvs, powers, end), energy(asvs, powers, worked)))
    if not drawn:
        return None
    of_auvs, of_asvs = zip(*drawn, strict=True)
    return np.sum(of_auvs, axis=0), np.sum(of_asvs, axis=0)


def _powers(band: Band) -> Powers | None:
    """Return what a modem of a band draws, None where that is not known."""
    if band.transmit_w is None:
        return None
    waiting = band.receive_w if band.idle_w is None else band.idle_w
    return Powers(band.transmit_w, band.receive_w, waiting)


def _sounds(record: Recorder) -> Array:
    """Return the instants (s) at which a ping or a call begins on HF, in rising order."""
    pings = record.pings.rows
    called = pings["call"] != NONE
    answered = ~called | (pings["call"] == HEARD)
    return np.sort(np.concatenate((pings["called_at_s"][called], pings["sent_at_s"][answered])))


def _covered(starts: Array, length: float, end: float) -> float:
    """Return the time (s) before `end` that intervals of one length cover, overlaps counted once.

    `starts` (n,) rise.

    >>> round(_covered(np.array([0.0, 1.0, 1.0, 1.5, 9.5]), 1.0, 10.0), 9)
    3.0
    """
    return float(np.minimum(np.diff(starts, append=end), length).sum())


def mission_metrics(auvs: Sequence[AuvMetrics], whole: Utilisation) -> dict[str, float | None]:
    """Return the fleet means of all AUV metrics (AUVs without a value left out), the mission's own,
    and the worst AUV's with its number.
    """
    means: dict[str, float | None] = {}
    for column in fields(AuvMetrics)[1:]:
        known = [v for auv in auvs if (v := getattr(auv, column.name)) is not None]
        means[column.name] = math.fsum(known) / len(known) if known else None
    own = {column.name: getattr(whole, column.name) for column in fields(Utilisation)}
    return {**means, **own, **worst_of(auvs)}

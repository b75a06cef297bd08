"""Samples of the AUVs' true motion, and what follows from it alone."""

import math
from collections.abc import Hashable, Sequence
from functools import lru_cache
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from ...support.arrays import Floats
from ..setup import Setup
from ..vehicles.fleet import VehicleFleet
from ..vehicles.sweeping import Sweep, sweep
from ..vehicles.vehicle import Vehicle

# Tolerance of ceil(duration * rate) against rounding, as for ticks
COUNT_TOLERANCE = 1e-9


@lru_cache(maxsize=8)
def instants(duration: float, rate: float, begin: float = 0.0) -> Floats:
    """Return the instants k / rate in [begin, duration) (s); read-only, since missions share them.

    With `begin` 0 the first is always 0, however low the rate.

    >>> instants(3.0, 1e-12).tolist()
    [0.0]
    """
    count = max(1, int(np.ceil(duration * rate - COUNT_TOLERANCE)))
    times: Floats = np.arange(count) / rate
    times = times[times.searchsorted(begin) :]
    times.setflags(write=False)
    return times


# A lane is flown within this distance (m) of its end; its instant is exact to 2^-50 of the mission.
ARRIVED_M, HALVINGS = 1e-6, 50


class Trajectories(NamedTuple):
    """The motion of n AUVs after the mission; NaN stands for what is unknown or never happened.

    `metrics` are columns of :class:`.metrics.AuvMetrics`, (n,).  At the k instants of `tracks` (0
    without tracks), each AUV was `beside_m` (n, k) from its path (m) and `altitude_m` (n, k) above
    the bottom, and had been the first to sweep `swept_m2` (n, k).  All of them have swept
    `covered_m2` (m2), and the last has flown its lanes by `finished_at_s`.
    """

    metrics: dict[str, Floats]
    beside_m: Floats
    altitude_m: Floats
    swept_m2: Floats
    covered_m2: float | None
    finished_at_s: float | None


_looked_back: WeakKeyDictionary[VehicleFleet, tuple[Hashable, Trajectories]] = WeakKeyDictionary()


def trajectories_of(setup: Setup, fleet: VehicleFleet) -> Trajectories:
    """Return what follows from the motion of AUVs, known to the mission's end.

    Missions share it where no seed changes the motion.
    """
    if not fleet.foreseen:
        return _look_back(setup, fleet)
    scenario = setup.scenario
    asked = scenario.duration_s, scenario.record, scenario.survey, scenario.auvs
    question = *asked, scenario.environment
    kept = _looked_back.get(fleet)
    if kept is None or kept[0] != question:
        kept = _looked_back[fleet] = question, _look_back(setup, fleet)
    return kept[1]


def _look_back(setup: Setup, fleet: VehicleFleet) -> Trajectories:
    end, vehicles, record = setup.scenario.duration_s, fleet.vehicles, setup.scenario.record
    often, seldom = instants(end, record.metrics_hz), instants(end, record.tracks_hz)
    if record.detail == "summary":
        seldom = seldom[:0]
    swept = _swept(setup, fleet)
    swept_m2 = _first_to_sweep(swept, setup.swaths_m, np.append(seldom, end))
    distance = np.array([vehicle.distance(end) for vehicle in vehicles])
    lanes = _lanes(setup, fleet)
    flown = [_flown(*pair, end) for pair in zip(vehicles, lanes, strict=True)]
    metrics = {
        "path_error_m": np.array([_mean(vehicle.path_error(often)) for vehicle in vehicles]),
        "distance_m": distance,
        "speed_m_per_s": distance / end,
        "saturated_share": np.array([vehicle.saturated(end) for vehicle in vehicles], np.float64),
        "lanes_flown_share": np.array(flown),
        "swept_m2": swept_m2[:, -1],
        "least_altitude_m": _least(altitudes(setup, vehicles, often)),
        "lock_share": _lock(setup, vehicles, often),
    }
    return Trajectories(
        metrics,
        beside(vehicles, seldom),
        altitudes(setup, vehicles, seldom),
        swept_m2[:, :-1],
        None if swept is None else float(swept.area(np.array([end]))[0]),
        _finished_at(vehicles, lanes, end),
    )


def _mean(values: Floats) -> float:
    return float(values.mean()) if len(values) else math.nan


def beside(vehicles: Sequence[Vehicle], times: Floats) -> Floats:
    """Return the distance (m) of vehicles from their paths at k instants (s), (n, k)."""
    found = np.full((len(vehicles), len(times)), np.nan)
    for its_own, vehicle in zip(found, vehicles, strict=True):
        off = vehicle.path_error(times)
        if len(off):
            its_own[:] = off
    return found


def altitudes(setup: Setup, vehicles: Sequence[Vehicle], times: Floats) -> Floats:
    """Return how far (m) vehicles are above the bottom at k instants (s), (n, k); NaN where it is
    not known.
    """
    found = np.full((len(vehicles), len(times)), np.nan)
    if setup.bottom.is_known:
        for its_own, vehicle in zip(found, vehicles, strict=True):
            places = vehicle.sample(times)
            its_own[:] = setup.bottom.below(places) - places[:, 2]
    return found


def _least(values: Floats) -> Floats:
    """Return the least of the numbers (n, k) of each AUV, (n,); NaN of those without any."""
    known = np.where(np.isnan(values), np.inf, values).min(axis=1, initial=np.inf)
    return np.where(np.isinf(known), np.nan, known)


def _lock(setup: Setup, vehicles: Sequence[Vehicle], times: Floats) -> Floats:
    """Return at which share of k instants (s) each vehicle's log sees the bottom, (n,); NaN where
    it sees it always or never.
    """
    if math.isinf(setup.log_sees_m):
        return np.full(len(vehicles), np.nan)
    return np.array([1.0 - setup.blind(vehicle.sample(times)).mean() for vehicle in vehicles])


def _swept(setup: Setup, fleet: VehicleFleet) -> Sweep | None:
    """Return what of the survey the AUVs have swept, and when; None without a swath."""
    swaths, depths = setup.swaths_m, None
    if rising := setup.rising:
        depths = [auv.depth_m if auv.number in rising else -math.inf for auv in setup.auvs]
    return sweep(setup.area, fleet.vehicles, swaths, setup.scenario.duration_s, depths)


def _first_to_sweep(swept: Sweep | None, swaths: Sequence[float | None], times: Floats) -> Floats:
    """Return how much of the survey (m2) each AUV was the first to sweep by k instants (s); NaN of
    those without a swath (m).
    """
    found = np.full((len(swaths), len(times)), np.nan)
    for auv, swath in enumerate(swaths):
        if swept is not None and swath is not None:
            found[auv] = swept.area(times, auv)
    return found


Lanes = tuple[tuple[float, float], ...]


def _lanes(setup: Setup, fleet: VehicleFleet) -> list[Lanes | None]:
    """Return where along its plan (m) each AUV's lanes begin and end; None without a plan."""
    flies = [vehicle.along(0.0) is not None for vehicle in fleet.vehicles]
    plans = setup.plans if any(flies) else [None] * len(flies)
    return [
        plan.lanes if plan is not None and does else None
        for plan, does in zip(plans, flies, strict=True)
    ]


def _flown(vehicle: Vehicle, lanes: Lanes | None, end: float) -> float:
    """Return which share of its lanes an AUV has flown by an instant (s); NaN without lanes."""
    if lanes is None:
        return math.nan
    begin, end_m = np.array(lanes).T
    along = vehicle.along(end)
    return float(np.clip(along - begin, 0.0, end_m - begin).sum() / (end_m - begin).sum())


def _finished_at(
    vehicles: Sequence[Vehicle], lanes: Sequence[Lanes | None], end: float
) -> float | None:
    """Return the instant (s) at which the last had flown all its lanes; None if one has not, or
    none has lanes.
    """
    goals = [
        (vehicle, its_own[-1][1] - ARRIVED_M)
        for vehicle, its_own in zip(vehicles, lanes, strict=True)
        if its_own is not None
    ]
    if not all(_is_there(*pair, end) for pair in goals):
        return None
    last: float | None = None
    for vehicle, goal in goals:
        if last is None or not _is_there(vehicle, goal, last):
            last = _reached(vehicle, goal, end)
    return last


def _is_there(vehicle: Vehicle, along: float, time: float) -> bool:
    """Return whether a vehicle is so far along its plan (m) at an instant (s)."""
    return (vehicle.along(time) or 0.0) >= along


def _reached(vehicle: Vehicle, along: float, until: float) -> float:
    """Return when (s) a vehicle got so far along its plan (m), at `until` (s) the latest."""
    low, high = 0.0, until
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        if _is_there(vehicle, along, middle):
            high = middle
        else:
            low = middle
    return high

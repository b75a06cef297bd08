"""What would have helped: other stations and ranges tried on the ways that the AUVs went.

Everything here is geometry on recorded positions: it says how much of the time an AUV would have
been within HF range, not what a simulation of the change would give.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..formations import formation
from ..launch import asv_stations
from .recording import LOST, Recording

Floats = NDArray[np.float64]

# More places than this add nothing to a share in per cent.
MOST_PLACES = 800
# Formations tried: angles between two that look alike, and radii up to the survey's corner.
ANGLES, RADII = 18, 16
# A change that improves the worst AUV's coverage by less is not worth saying.
WORTHWHILE = 0.02


@dataclass(frozen=True)
class Remedy:
    """One change to a scenario: in words, as `--set` options, and the coverage it would give.

    Coverage is the share of time within HF range of an ASV: of the worst AUV, and of all.
    """

    words: str
    settings: tuple[str, ...]
    worst: float
    all: float


def reach(mission: Recording) -> float:
    """Return the HF range seen from above (m)."""
    hf, depth = mission.scenario.acoustics.hf, mission.scenario.survey.depth_m
    if hf.range_metric == "horizontal":
        return hf.range_m
    return math.sqrt(max(hf.range_m**2 - depth**2, 0.0))


class Trial:
    """The places where AUVs were, on which stations of ASVs can be tried."""

    def __init__(self, mission: Recording) -> None:
        x, y = (mission.truth[name][: mission.auvs] for name in ("x_m", "y_m"))
        step = max(1, -(-x.size // MOST_PLACES))
        self.places = np.stack((x[:, ::step], y[:, ::step]), axis=-1)
        self._reach = reach(mission)

    def coverage(self, stations: Floats) -> tuple[Floats, Floats]:
        """Return the share of time in range, of the worst AUV and of all.

        `stations` in m, of the shape (..., ASVs, 2); the shares have the shape (...).
        """
        x, y = self.places[..., 0], self.places[..., 1]
        apart = (stations[..., 0, None, None] - x) ** 2 + (stations[..., 1, None, None] - y) ** 2
        own = (apart <= self._reach**2).any(axis=-3).mean(axis=-1)
        return own.min(axis=-1), own.mean(axis=-1)

    def furthest(self, stations: Floats) -> float:
        """Return the greatest distance (m) of an AUV from its nearest ASV, seen from above."""
        apart = self.places[..., None, :] - stations
        return float(np.hypot(apart[..., 0], apart[..., 1]).min(axis=-1).max())

    def best(self, count: int, radii: Floats) -> tuple[tuple[float, float], float, float]:
        """Return the best coverage of `count` ASVs in a regular formation, its radius and angle."""
        angles = np.arange(ANGLES) * (360.0 / count / ANGLES) if count > 1 else np.zeros(1)
        unit = np.array([formation(count, 1.0, math.radians(angle)) for angle in angles.tolist()])
        tried = []
        for radius in radii.tolist():
            worst, every = self.coverage(radius * unit)
            order = np.lexsort((every, worst))[-1]
            tried.append(((float(worst[order]), float(every[order])), radius, float(angles[order])))
        return max(tried, key=lambda it: it[0])


def remedies(mission: Recording) -> list[Remedy]:
    """Return changes that would have kept the AUVs in HF range, the smallest change first."""
    trial, asked = Trial(mission), mission.scenario.asvs.formation
    stations = np.array(asv_stations(mission.scenario))
    now, count = float(trial.coverage(stations)[0]), len(stations)
    radius = float(np.hypot(*stations[0]))
    half = mission.scenario.survey.side_m / 2
    radii = half * np.sqrt(2) * np.arange(1, RADII + 1) / RADII
    found = []
    if asked.positions_m is None and count > 1:
        (covered, _, angle) = trial.best(count, np.array([radius]))
        found.append(_turned(covered, angle))
        (covered, wide, angle) = trial.best(count, radii)
        found.append(_resized(covered, wide, angle))
    if asked.positions_m is None:
        (covered, wide, angle) = trial.best(count + 1, radii)
        found.append(_enlarged(covered, count + 1, wide, angle))
    worthwhile, least = [], now
    for remedy in found:
        if remedy.worst >= least + WORTHWHILE:
            worthwhile.append(remedy)
            least = remedy.worst
    if now < 1 - WORTHWHILE:
        worthwhile.append(_longer_range(mission, radius, trial.furthest(stations)))
    return worthwhile


def _turned(covered: tuple[float, float], angle: float) -> Remedy:
    words = f"turn the formation to {angle:.3g}° (same ASVs, same radius)"
    return Remedy(words, (f"asvs.formation.angle_deg={angle:.4g}",), *covered)


def _resized(covered: tuple[float, float], radius: float, angle: float) -> Remedy:
    words = f"give the formation a radius of {radius:.3g} m at {angle:.3g}° (same ASVs)"
    return Remedy(words, (*_at_radius(radius), f"asvs.formation.angle_deg={angle:.4g}"), *covered)


def _enlarged(covered: tuple[float, float], count: int, radius: float, angle: float) -> Remedy:
    words = f"{count} ASVs instead of {count - 1}, {radius:.3g} m out at {angle:.3g}°"
    settings = (*_at_radius(radius), f"asvs.formation.angle_deg={angle:.4g}")
    return Remedy(words, (f"asvs.count={count}", *settings), *covered)


def _at_radius(radius: float) -> tuple[str, ...]:
    return (f"asvs.formation.radius_m={radius:.4g}",)


def _longer_range(mission: Recording, radius: float, furthest: float) -> Remedy:
    """Return the HF range that would have reached the AUVs always, the ASVs where they are."""
    metric, depth = mission.scenario.acoustics.hf.range_metric, mission.scenario.survey.depth_m
    needed = math.ceil(math.hypot(furthest, depth) if metric == "slant" else furthest)
    asked = mission.scenario.asvs.formation
    # By default the formation grows with the range; here the ASVs stay.
    fixed = asked.positions_m is None and asked.radius_m is None and mission.scenario.asvs.count > 1
    settings = (f"acoustics.hf.range_m={needed}", *(_at_radius(radius) if fixed else ()))
    now_m = mission.scenario.acoustics.hf.range_m
    return Remedy(f"an HF range of {needed} m instead of {now_m:g} m", settings, 1.0, 1.0)


def broadcast_distances(mission: Recording) -> tuple[Floats, Floats]:
    """Return of fixes beyond MF range how far (m) their broadcaster and the nearest ASV were."""
    fixes = mission.fixes
    rows = np.flatnonzero(fixes["outcome"] == "out_of_range")
    times = fixes["broadcast_at_s"][rows]
    column = np.clip(np.searchsorted(mission.times, times), 0, len(mission.times) - 1)
    x, y = mission.truth["x_m"][:, column], mission.truth["y_m"][:, column]
    auv, every = fixes["auv"][rows], np.arange(len(rows))
    away = np.hypot(x[mission.auvs :] - x[auv, every], y[mission.auvs :] - y[auv, every])
    return away[fixes["broadcast_by"][rows], every], away.min(axis=0)


def loss_by_listeners(mission: Recording) -> dict[int, tuple[int, int]]:
    """Return, by how many ASVs were in range of a ping, how many were lost, of how many."""
    pings = mission.pings
    return {
        int(listeners): (
            int(np.sum((pings["in_range_of"] == listeners) & (mission.fate == LOST))),
            int(np.sum(pings["in_range_of"] == listeners)),
        )
        for listeners in np.unique(pings["in_range_of"])
        if listeners > 0
    }

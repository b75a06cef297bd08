"""Where ASVs would serve the AUVs' ways: geometry that proposes, not a simulation of the change."""

import math
from collections.abc import Sequence
from typing import TypeAlias

import numpy as np

from ...core.geometry.formation import formation
from ...core.scenario.scenario import Scenario
from ...core.setup import Setup
from ...support.arrays import Floats

Score: TypeAlias = tuple[float, float, float]

# Of stations where nobody may lie
NOWHERE: Score = (-1.0, -1.0, -math.inf)

# More AUVs, or more places on the way of each, change no proposal.
MOST_AUVS, PLACES = 40, 120
# Formations tried: angles between two that look alike, and radii up to the survey's corner.
ANGLES, RADII = 18, 16
# Places for one more ASV: so many along each side of the survey.
GRID = 15


class Ways:
    """The places where AUVs are going to be, on which stations of ASVs can be tried."""

    def __init__(self, scenario: Scenario) -> None:
        setup = Setup.of(scenario)
        self._area, self._land, self._closed = setup.area, setup.land, setup.closed
        self._hears, self._reaches = setup.horizontal_reach_m, setup.horizontal_mf_reach_m
        sender = setup.broadcaster
        self._choice = sender.serves_nearest and not sender.at_once
        self._choice |= scenario.protocol.replies
        self._instant = not scenario.protocol.sends_frames
        count = scenario.auvs.count
        chosen = range(0, count, -(-count // MOST_AUVS))
        self.places = np.stack([_way(setup, auv) for auv in chosen])

    def score(self, stations: Floats) -> Score:
        """Return how stations (n, 2), m, serve: of the worst AUV, of all, and how near they are.

        An AUV is served where some ASV hears it, as far as the ASV that broadcasts reaches it: any
        of them, if ASVs take turns.  Behind land none does, and on land lies none.
        """
        if self._closed is not None and self._closed.holds(stations).any():
            return NOWHERE
        apart = self.places[..., None, :] - stations
        away = np.hypot(apart[..., 0], apart[..., 1])
        level = away.min(axis=-1)
        if self._land is not None:
            blocked = self._land.crossed(self.places.reshape(-1, 2), stations)
            away = np.where(blocked.reshape(away.shape), np.inf, away)
        nearest = away.min(axis=-1)
        reached = (away <= self._reaches).mean(axis=-1)
        if self._choice:
            reached = (nearest <= self._reaches) | self._instant
        own = ((nearest <= self._hears) * reached).mean(axis=-1)
        return float(own.min()), float(own.mean()), -float(level.mean())

    def best(
        self,
        count: int,
        radii: Sequence[float] | None = None,
        angles: Sequence[float] | None = None,
    ) -> tuple[float, float]:
        """Return radius (m) and angle (deg) of the regular formation that serves best."""
        if radii is None:
            centre = self._area.centroid
            corner = max(math.dist(centre, place) for place in self._area.outline)
            radii = [float(f"{corner * k / RADII:.3g}") for k in range(1, RADII + 1)]
        if angles is None:
            angles = [float(round(360 * k / count / ANGLES)) for k in range(ANGLES)]
        tried = [
            (self.score(self._ring(count, radius, angle)), radius, angle)
            for radius in radii
            for angle in angles
        ]
        _, radius, angle = max(tried, key=lambda ring: ring[0])
        return radius, angle

    def _ring(self, count: int, radius: float, angle: float) -> Floats:
        """Return the regular formation of a radius (m) and an angle (deg) about the survey."""
        return formation(count, radius, math.radians(angle)) + self._area.centroid

    def further(self, stations: Sequence[tuple[float, float]]) -> tuple[float, float]:
        """Return where one more ASV would serve best (x, y in m), the others where they are."""
        box = self._area.box
        along = np.linspace(box.x_min, box.x_max, GRID)
        across = np.linspace(box.y_min, box.y_max, GRID)
        places = [(round(float(x), 1), round(float(y), 1)) for x in along for y in across]
        return max(places, key=lambda place: self.score(np.array([*stations, place])))


def _way(setup: Setup, auv: int) -> Floats:
    """Return places (PLACES, 2), m, at even distances in time on the way that an AUV is to go."""
    times = np.linspace(0.0, setup.scenario.duration_s, PLACES)
    held, track, plan = setup.held_places_m[auv], setup.auv_tracks[auv], setup.plans[auv]
    if held is not None:
        return np.tile(np.array(held), (PLACES, 1))
    if track is not None:
        at, places = track
        return np.column_stack([np.interp(times, at, places[:, axis]) for axis in (0, 1)])
    assert plan is not None, "an AUV flies, holds, or repeats a track"
    return plan.tour.sample(setup.auvs[auv].speed_m_per_s * times)[:, :2]

"""What a scenario's signals are decided from: slots, bounds, where ASVs lie, how deep AUVs are."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..core.plugins import PluginError
from ..protocol.slots import Slots, slots_of
from ..scenario.declared import ranging_of
from ..scenario.planned import NoStations, asv_stations, tracks_of
from ..scenario.scenario import Scenario
from ..scenario.telling import tells_slots
from ..scenario.water import assumed_sound_speed_of
from .bounds import FASTEST, SLOWEST, Bounds

Array = NDArray[np.float64]

# Autopilots may take an AUV so much deeper than it is told to be.
OVERSHOOT_M = 1.0


@dataclass(frozen=True)
class Case:
    """A scenario and the bounds that it is to hold for."""

    scenario: Scenario
    bounds: Bounds

    @cached_property
    def slots(self) -> Slots:
        """The durations of the protocol."""
        return slots_of(self.scenario)

    @cached_property
    def slot_s(self) -> float:
        """The uplink slot on the clock (s)."""
        return self.slots.clock.after(0.0, self.slots.uplink_slot)

    @cached_property
    def sound_speeds(self) -> tuple[float, float]:
        """The slowest and the fastest that sound may travel (m/s)."""
        assumed = assumed_sound_speed_of(self.scenario)
        error = self.bounds.sound_speed_error_m_per_s
        return max(assumed - error, SLOWEST), min(assumed + error, FASTEST)

    @property
    def late_s(self) -> float:
        """How much later (s) one AUV may ping than another whose slot is the same."""
        return 2 * self.bounds.clock_error_s if not ranging_of(self.scenario).calls else 0.0

    @property
    def recalls(self) -> int:
        """How many AUVs a round may call back that have not been heard for long: 1, else 0."""
        protocol = self.scenario.protocol
        if not tells_slots(self.scenario) or protocol.dissemination.missed == "contention":
            return 0
        return int((protocol.forget_after_s or math.inf) < self.scenario.duration_s)

    @property
    def closing_m_per_s(self) -> float:
        """How fast an AUV and an ASV may approach each other (m/s)."""
        return self.bounds.max_speed_m_per_s + self.bounds.asv_speed_m_per_s

    @cached_property
    def stations(self) -> Array | None:
        """Where the ASVs lie (m), shape (m, 2); None where they move or are not known."""
        if self.bounds.asv_speed_m_per_s > 0.0:
            return None
        try:
            return np.array(asv_stations(self.scenario), dtype=float).reshape(-1, 2)
        except (NoStations, PluginError):
            return None

    @cached_property
    def apart_m(self) -> Array:
        """Distances (m) of pairs of ASVs at different places; where they move, any: 0 alone."""
        if self.scenario.asvs.count == 1:
            return np.empty(0)
        if self.stations is None:
            return np.zeros(1)
        found = np.linalg.norm(self.stations[:, None] - self.stations, axis=2)
        return np.asarray(np.unique(found[found > 0.0]))

    @cached_property
    def in_turn_m(self) -> Array:
        """The same of pairs of which one sends after the other, in the order of their numbers."""
        if self.stations is None or self.scenario.asvs.failures:
            return self.apart_m
        ways = self.stations - np.roll(self.stations, -1, axis=0)
        found = np.linalg.norm(ways, axis=1)
        return np.asarray(np.unique(found[found > 0.0]))

    @cached_property
    def depths(self) -> tuple[tuple[float, float], ...]:
        """The least and greatest depth of each AUV (m).

        AUVs with equations of motion are taken to be anywhere down to their depth.
        """
        scenario = self.scenario
        tracks = tracks_of(scenario) if scenario.auvs.route.kind in ("track", "own") else None
        if tracks is not None:
            downs = [track[1][:, 2] for track in tracks]
            return tuple((float(z.min()), float(z.max())) for z in downs)
        own = [scenario.survey.depth(auv) for auv in range(scenario.auvs.count)]
        flies = scenario.auvs.vehicle.flies_paths
        return tuple((0.0 if flies else depth, depth) for depth in own)

    def longest_m(self, auv: int) -> float:
        """Return the longest way (m) that a ping of an AUV is heard over."""
        hf, deepest = self.scenario.acoustics.hf, self.depths[auv][1]
        if self.scenario.auvs.vehicle.flies_paths:
            deepest += OVERSHOOT_M
        return hf.range_m if hf.range_metric == "slant" else math.hypot(hf.range_m, deepest)

    def shortest_m(self, auv: int) -> float:
        """Return the shortest way (m) of a ping of an AUV: straight up."""
        return self.depths[auv][0]

"""The vehicles that take part in a mission: where each is, and when each has failed.

A vehicle has failed from the instant of its failure on, and works again at the end of it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...support.arrays import Flags, Floats
from ...support.facts import cached_property
from .motion import PLACE, Motion, lines
from .vehicle import Vehicle

if TYPE_CHECKING:
    from ..records.rows import Rows
    from .guidance.guided_fleet import GuidedFleet
    from .poses import Poses
    from .vehicle import Steered


# Largest cache of one fleet's tracks (bytes): ten vehicles for 300 s at 30 Hz, not a thousand.
MOST_BYTES = 8_000_000


class VehicleTrack(NamedTuple):
    """A vehicle's track at n instants (n,), s: `lines` (n, 8) have x, y, z (m), yaw (rad), the
    integrals of cos(yaw) and sin(yaw) (s), cos(yaw) and sin(yaw).
    """

    times: Floats
    lines: Floats

    @property
    def truth(self) -> Floats:
        """True x, y, z (m) and yaw (rad), (n, 4)."""
        return self.lines[:, PLACE]


class FleetTracksCache:
    """Tracks of a fleet; it keeps those that are asked for again if the motion is known to its end.

    A track is kept only if its array of instants is read-only, and is found again by the same
    array.
    """

    def __init__(self, motion: Motion, *, foreseen: bool) -> None:
        self._motion, self._room = motion, MOST_BYTES if foreseen else 0
        self._kept: dict[tuple[int, int], tuple[Floats, VehicleTrack]] = {}

    def of(self, vehicle: int, times: Floats) -> VehicleTrack:
        """Return the track of a vehicle at instants (s) up to which its motion is known."""
        asked, found = self._kept.get((vehicle, id(times)), (None, None))
        if asked is times and found is not None:
            return found
        own = np.array(times, dtype=np.float64)  # numba would compile anew for a read-only array
        way = VehicleTrack(own, lines(*self._motion, vehicle, own))
        size = sum(column.nbytes for column in way)
        if size <= self._room and not times.flags.writeable:
            self._kept[vehicle, id(times)] = times, way
            self._room -= size
        return way


class Failures(NamedTuple):
    """The failures of a fleet of `vessels` vehicles, (k,) each: whose, from and until when (s)."""

    vessels: int
    whose: NDArray[np.intp]
    begin_s: Floats
    end_s: Floats

    def alive(self, time: float) -> Flags:
        """Return which vehicles work at an instant (s), shape (vessels,)."""
        working = np.ones(self.vessels, dtype=np.bool_)
        working[self.whose[(self.begin_s <= time) & (time < self.end_s)]] = False
        return working

    def failed(self, time: float) -> tuple[int, ...]:
        """Return the numbers of the vehicles that have failed at an instant (s)."""
        return tuple(np.flatnonzero(~self.alive(time)).tolist())

    def met(self, vehicles: ArrayLike, begin_s: ArrayLike, end_s: ArrayLike) -> tuple[Flags, Flags]:
        """Return which of n signals at `vehicles`, (n,), from `begin_s` to `end_s` (s), are lost.

        First those that begin while their vehicle has failed, then those during which it fails,
        both (n,). A vehicle that fails as a signal ends has received it.
        """
        at, begin, end = (np.asarray(values)[..., None] for values in (vehicles, begin_s, end_s))
        missed = (at == self.whose) & (self.begin_s <= begin) & (begin < self.end_s)
        cut = (at == self.whose) & (begin < self.begin_s) & (self.begin_s < end)
        return missed.any(axis=-1), cut.any(axis=-1)

    def next_of(self, vehicle: int, time: float) -> float:
        """Return the next instant (s) after `time` at which a vehicle fails; infinite if none."""
        later = (self.whose == vehicle) & (self.begin_s > time)
        return float(self.begin_s[later].min(initial=np.inf))

    def worked_s(self, duration: float) -> Floats:
        """Return how long (s) each vehicle works in a mission of a duration (s), (vessels,)."""
        worked = np.full(self.vessels, duration)
        missed = np.minimum(self.end_s, duration) - np.minimum(self.begin_s, duration)
        np.subtract.at(worked, self.whose, missed)
        return worked

    def next_change(self, time: float) -> float:
        """Return the next instant (s) after `time` at which any vehicle fails or recovers, or
        infinity.
        """
        changes = np.concatenate((self.begin_s, self.end_s))
        return float(changes[changes > time].min(initial=np.inf))


@dataclass(frozen=True, eq=False)
class VehicleFleet:
    """All AUVs, or all ASVs: where each is at any instant.

    `guided` fleets steer by fixes, so their motion is known only up to now; `steering` has the sum
    of the corrections by fixes (n, 2), m, and what filters have learnt (n,). An outside program
    gives `poses`, which the fleet asks for as the mission goes on. `steered` vehicles get orders
    during the mission, each with a lead. `failures` is None where no vehicle fails.
    """

    vehicles: Sequence[Vehicle]
    motion: Motion
    guided: "tuple[GuidedFleet, ...]" = ()
    steering: "tuple[Floats, Rows] | None" = None
    poses: "Poses | None" = None
    failures: Failures | None = None
    steered: "Steered | None" = None

    def __len__(self) -> int:
        return len(self.vehicles)

    @cached_property
    def foreseen(self) -> bool:
        """Whether the motion is known to the end, whatever happens in the mission."""
        return not self.guided and self.poses is None and self.steered is None

    @cached_property
    def ways(self) -> FleetTracksCache:
        """The tracks of the vehicles, at instants up to which their motion is known."""
        return FleetTracksCache(self.motion, foreseen=self.foreseen)

    @property
    def sure_s(self) -> float:
        """How far ahead of now (s) the motion is known, whatever happens meanwhile."""
        if self.steered is not None:
            return self.steered.lead_s
        return inf if self.foreseen else 0.0

    @property
    def predicted(self) -> bool:
        """Whether the motion ahead is only predicted, and must be corrected once it is known."""
        return self.poses is not None

    def failed(self, time: float) -> tuple[int, ...]:
        """Return the numbers of the vehicles that do not work at an instant (s)."""
        return () if self.failures is None else self.failures.failed(time)

    def works_for(self, vehicle: int, time: float, longest: float) -> float:
        """Return how long (s) a vehicle works on from an instant (s); at most `longest` (s)."""
        if self.failures is None:
            return longest
        if vehicle in self.failed(time):
            return 0.0
        return min(longest, self.failures.next_of(vehicle, time) - time)

    def works_from(self, time: float) -> float:
        """Return the first instant (s), from `time` on, at which any vehicle works, or infinity."""
        failures = self.failures
        while failures is not None and time < inf and len(failures.failed(time)) == len(self):
            time = failures.next_change(time)
        return time

    def advance(self, time: float) -> None:
        """Make the motion known up to an instant (s)."""
        for guided in self.guided:
            guided.advance(time)
        if self.poses is not None:
            self.poses.advance(time)

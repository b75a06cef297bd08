"""The vehicles that take part in a mission, where each of them is, and which have failed when.

A failure holds from its instant on, up to that from which its vehicle works again, which is no part
of it.
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


# So much at most (bytes) is kept of one fleet: ten vehicles for 300 s at 30 Hz, not a thousand.
MOST_BYTES = 8_000_000


class VehicleTrack(NamedTuple):
    """A vehicle at n instants (n,), s: x, y, z (m), yaw (rad), the integrals of the cosine and
    sine of its yaw (s), and these two, `lines` (n, 8).
    """

    times: Floats
    lines: Floats

    @property
    def truth(self) -> Floats:
        """True x, y, z (m) and yaw (rad), (n, 4)."""
        return self.lines[:, PLACE]


class FleetTracksCache:
    """The ways of a fleet; what is asked for again is kept, where the motion is known to its end.

    Instants that will be asked for again are read-only, and always the same array.
    """

    def __init__(self, motion: Motion, *, foreseen: bool) -> None:
        self._motion, self._room = motion, MOST_BYTES if foreseen else 0
        self._kept: dict[tuple[int, int], tuple[Floats, VehicleTrack]] = {}

    def of(self, vehicle: int, times: Floats) -> VehicleTrack:
        """Return the way of a vehicle at instants (s), by which its motion is known."""
        asked, found = self._kept.get((vehicle, id(times)), (None, None))
        if asked is times and found is not None:
            return found
        own = np.array(times, dtype=np.float64)  # as code for what is read-only is another
        way = VehicleTrack(own, lines(*self._motion, vehicle, own))
        size = sum(column.nbytes for column in way)
        if size <= self._room and not times.flags.writeable:
            self._kept[vehicle, id(times)] = times, way
            self._room -= size
        return way


class Failures(NamedTuple):
    """The failures of a fleet of so many vehicles, (k,) each: whose, from and until when (s)."""

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
        """Return the numbers of those that do not."""
        return tuple(np.flatnonzero(~self.alive(time)).tolist())

    def met(self, vehicles: ArrayLike, begin_s: ArrayLike, end_s: ArrayLike) -> tuple[Flags, Flags]:
        """Tell what failures leave of signals at vehicles, (n,), begun and ended at instants (s).

        Return which begin while their vehicle has failed, and which it fails in the midst of, both
        (n,).  Who fails at the end of a signal has had it.
        """
        at, begin, end = (np.asarray(values)[..., None] for values in (vehicles, begin_s, end_s))
        missed = (at == self.whose) & (self.begin_s <= begin) & (begin < self.end_s)
        cut = (at == self.whose) & (begin < self.begin_s) & (self.begin_s < end)
        return missed.any(axis=-1), cut.any(axis=-1)

    def next_of(self, vehicle: int, time: float) -> float:
        """Return when (s) after an instant a vehicle fails; infinite if it does not."""
        later = (self.whose == vehicle) & (self.begin_s > time)
        return float(self.begin_s[later].min(initial=np.inf))

    def worked_s(self, duration: float) -> Floats:
        """Return how long (s) each vehicle works in a mission of a duration (s), (vessels,)."""
        worked = np.full(self.vessels, duration)
        missed = np.minimum(self.end_s, duration) - np.minimum(self.begin_s, duration)
        np.subtract.at(worked, self.whose, missed)
        return worked

    def next_change(self, time: float) -> float:
        """Return when (s) after an instant a vehicle fails or works again; infinite if never."""
        changes = np.concatenate((self.begin_s, self.end_s))
        return float(changes[changes > time].min(initial=np.inf))


@dataclass(frozen=True, eq=False)
class VehicleFleet:
    """All AUVs, or all ASVs: where each is at any instant.

    Who steers by fixes has no sure future: its `guided` fleet is moved on as the mission goes on,
    by the `steering` of all: what fixes have put right (n, 2), m, and taught (n,).
    Nor has who is moved by an outside program: its `poses` are asked for as the mission goes on.
    Of the vehicles that fail, `failures` tell when; None where none does.
    Who is `steered` is told where to go as the mission goes on, but ahead of whoever looks.
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
        """Where the vehicles are at instants by which their motion is known."""
        return FleetTracksCache(self.motion, foreseen=self.foreseen)

    @property
    def sure_s(self) -> float:
        """How long ahead of the mission (s) the motion is known, whatever happens meanwhile."""
        if self.steered is not None:
            return self.steered.lead_s
        return inf if self.foreseen else 0.0

    @property
    def predicted(self) -> bool:
        """Whether what lies ahead is only predicted, and must be settled when it has come."""
        return self.poses is not None

    def failed(self, time: float) -> tuple[int, ...]:
        """Return the vehicles that do not work at an instant (s), by number."""
        return () if self.failures is None else self.failures.failed(time)

    def works_for(self, vehicle: int, time: float, longest: float) -> float:
        """Return how long (s) a vehicle works on from an instant (s), at most."""
        if self.failures is None:
            return longest
        if vehicle in self.failed(time):
            return 0.0
        return min(longest, self.failures.next_of(vehicle, time) - time)

    def works_from(self, time: float) -> float:
        """Return when (s), from an instant on, one of the vehicles works; infinite if none does."""
        failures = self.failures
        while failures is not None and len(failures.failed(time)) == len(self):
            time = failures.next_change(time)
        return time

    def advance(self, time: float) -> None:
        """Make the motion known up to an instant (s)."""
        for guided in self.guided:
            guided.advance(time)
        if self.poses is not None:
            self.poses.advance(time)

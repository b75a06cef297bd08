"""Which vehicles of a fleet have failed when.

A failure holds from its instant on, up to that from which its vehicle works again, which is no
part of it.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]


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
        at, begin, end = (np.asarray(it)[..., None] for it in (vehicles, begin_s, end_s))
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

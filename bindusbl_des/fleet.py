"""The vehicles that take part in a mission, each with what it carries."""

from collections.abc import Sequence
from dataclasses import dataclass

from .dead_reckoning import DeadReckoning
from .guidance import Voyage
from .motion import Motion
from .navigation import FixedGain
from .vehicles import Vehicle


@dataclass(frozen=True)
class Fleet:
    """All AUVs, or all ASVs: where each is at any instant.

    Who steers by fixes has no sure future: its `voyage` is moved on as the mission goes on.
    """

    vehicles: Sequence[Vehicle]
    motion: Motion
    voyage: Voyage | None = None

    def __len__(self) -> int:
        return len(self.vehicles)

    @property
    def foreseen(self) -> bool:
        """Whether the motion is known to the end, whatever happens in the mission."""
        return self.voyage is None

    def reach(self, time: float) -> None:
        """Make the motion known up to an instant (s)."""
        if self.voyage is not None:
            self.voyage.advance(time)

    def steer(self, vehicle: int, corrections: tuple[float, float]) -> None:
        """Tell a vehicle the sum of all corrections (m) of where it believes to be."""
        if self.voyage is not None:
            self.voyage.corrections[vehicle] = corrections


@dataclass(frozen=True)
class Auv:
    """An underwater vehicle: where it really is, and where it believes to be."""

    index: int
    vehicle: Vehicle
    reckoning: DeadReckoning
    navigator: FixedGain

    @property
    def name(self) -> str:
        return f"AUV{self.index}"

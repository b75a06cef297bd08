"""The vehicles that take part in a mission, and where each of them is."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from .motion import Motion
from .vehicle import Vehicle

if TYPE_CHECKING:
    from .guidance import GuidedFleet
    from .poses import Poses


@dataclass(frozen=True)
class Fleet:
    """All AUVs, or all ASVs: where each is at any instant.

    Who steers by fixes has no sure future: its `guided` fleet is moved on as the mission goes on.
    Nor has who is moved by an outside program: its `poses` are asked for as the mission goes on.
    """

    vehicles: Sequence[Vehicle]
    motion: Motion
    guided: "GuidedFleet | None" = None
    poses: "Poses | None" = None

    def __len__(self) -> int:
        return len(self.vehicles)

    @property
    def foreseen(self) -> bool:
        """Whether the motion is known to the end, whatever happens in the mission."""
        return self.guided is None and self.poses is None

    @property
    def predicted(self) -> bool:
        """Whether what lies ahead is only predicted, and must be settled when it has come."""
        return self.poses is not None

    def reach(self, time: float) -> None:
        """Make the motion known up to an instant (s)."""
        if self.guided is not None:
            self.guided.advance(time)
        if self.poses is not None:
            self.poses.advance(time)

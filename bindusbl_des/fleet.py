"""The vehicles that take part in a mission, each with what it carries."""

from dataclasses import dataclass

from .dead_reckoning import Drift, SteeredDrift
from .navigation import FixedGain
from .vehicles import Vehicle


@dataclass(frozen=True)
class Auv:
    """An underwater vehicle: where it really is, and where it believes to be."""

    index: int
    vehicle: Vehicle
    drift: Drift | SteeredDrift
    navigator: FixedGain

    @property
    def name(self) -> str:
        return f"AUV{self.index}"


@dataclass(frozen=True)
class Asv:
    """A surface vessel that hears pings and broadcasts fixes."""

    index: int
    vehicle: Vehicle

    @property
    def name(self) -> str:
        return f"ASV{self.index}"

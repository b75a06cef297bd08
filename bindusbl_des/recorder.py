"""What happened, row by row, in the order in which it happened."""

from dataclasses import dataclass, field

from .events import Broadcast, Fix, Ping, Reception, Round


@dataclass
class Recorder:
    """The event rows of one mission; it is told, it never asks."""

    rounds: list[Round] = field(default_factory=list)
    pings: list[Ping] = field(default_factory=list)
    receptions: list[Reception] = field(default_factory=list)
    broadcasts: list[Broadcast] = field(default_factory=list)
    fixes: list[Fix] = field(default_factory=list)

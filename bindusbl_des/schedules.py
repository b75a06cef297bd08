"""Who pings when: the ping groups of a round.

A schedule is a function from what the fleet knows (:class:`View`) to ping groups: lists of AUV
numbers that ping in the same slot, in the order of the slots.  A schedule whose attribute `framed`
is true starts its rounds on frames of `protocol.frame_s`.  A scenario can name one of one's own as
``module:object``.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import networkx as nx
import numpy as np
from numpy.typing import NDArray

from .conflicts import (
    Hearing,
    colour_dsatur,
    colour_greedily,
    conflict_graph,
    ping_groups,
)
from .consistency import FRAMED_SCHEDULES
from .own_parts import own_part

Array = NDArray[np.float64]
Groups = Sequence[Sequence[int]]


@dataclass
class View:
    """What the surface fleet knows when it schedules a round.

    `auvs` (n, 3) are the AUV positions it believes and `asvs` (m, 3) its own (m); `heard` tells who
    is within HF range of whom (AUVs, ASVs); `random` is a stream of the schedule's own.
    `conflicts` is the conflict graph of the AUVs.
    """

    round: int
    time: float
    auvs: Array
    asvs: Array
    heard: Hearing
    hf_range: float
    range_metric: str
    random: np.random.Generator

    def __post_init__(self) -> None:
        self.conflicts: nx.Graph[int] = conflict_graph(self.heard)


Schedule = Callable[[View], Groups]


def spatial_reuse(view: View) -> Groups:
    """Let AUVs without a common listener ping together, coloured greedily (the paper)."""
    return ping_groups(view.conflicts, colour_greedily)


def dsatur(view: View) -> Groups:
    """Let AUVs without a common listener ping together, coloured by DSATUR."""
    return ping_groups(view.conflicts, colour_dsatur)


def one_per_slot(view: View) -> Groups:
    """Give every AUV a slot of its own: TDMA without spatial reuse."""
    return [[auv] for auv in range(len(view.auvs))]


def round_robin(view: View) -> Groups:
    """Give every frame to one AUV, in turn."""
    return [[view.round % len(view.auvs)]]


def random(view: View) -> Groups:
    """Give every frame to an AUV drawn by lot."""
    return [[int(view.random.integers(len(view.auvs)))]]


SCHEDULES: dict[str, Schedule] = {
    function.__name__: function
    for function in (spatial_reuse, dsatur, one_per_slot, round_robin, random)
}


def is_framed(name: str, schedule: Schedule) -> bool:
    """Tell whether the rounds of a schedule start on frames."""
    return name in FRAMED_SCHEDULES or bool(getattr(schedule, "framed", False))


def schedule_named(name: str) -> Schedule:
    """Return a schedule by its name in the scenario; one's own is named ``module:object``.

    Raises:
        ValueError: when there is no such module or object, or it cannot be called.
    """
    if name in SCHEDULES:
        return SCHEDULES[name]
    return OwnSchedule(name, own_part("protocol.schedule", name, SCHEDULES))


@dataclass(frozen=True)
class OwnSchedule:
    """A schedule of somebody's own: each of its rounds is checked."""

    name: str
    schedule: Schedule

    @property
    def framed(self) -> bool:
        return bool(getattr(self.schedule, "framed", False))

    def __call__(self, view: View) -> Groups:
        try:
            groups = self.schedule(view)
        except Exception as error:
            raise ValueError(
                f"protocol.schedule: {self.name!r} raised {type(error).__name__} in round "
                f"{view.round}: {error}"
            ) from error
        return checked(groups, len(view.auvs), self.name)


def checked(groups: Groups, auv_count: int, name: str) -> list[list[int]]:
    """Return ping groups as lists of int; a schedule of one's own that breaks the rules is refused.

    Raises:
        ValueError: when there is no group, an AUV does not exist or pings twice in a round.
    """
    try:
        plain = [[int(auv) for auv in group] for group in groups]
    except (TypeError, ValueError):
        raise ValueError(
            f"protocol.schedule: {name!r} returned {groups!r}; a round is a list of groups, each a "
            "list of AUV numbers"
        ) from None
    flat = [auv for group in plain for auv in group]
    if not plain or len(set(flat)) != len(flat) or not set(flat) <= set(range(auv_count)):
        raise ValueError(
            f"protocol.schedule: {name!r} returned {plain}; a round needs at least one group, and "
            f"each of the AUVs 0..{auv_count - 1} at most once"
        )
    return plain

"""What a schedule is asked with, and what it may answer: ping groups, with slots of any length."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..conflicts import Hearing, conflict_graph
from ..slots import Slots
from .known import Known

if TYPE_CHECKING:
    import networkx as nx

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Groups = Sequence[Sequence[int]]


class TimedGroups(tuple[Sequence[int], ...]):
    """Ping groups whose slots last as long as they say: `lengths_s` (s), one for each group.

    >>> TimedGroups([[0], [2, 1]], [0.1, 0.25]).lengths_s
    (0.1, 0.25)
    """

    lengths_s: tuple[float, ...]

    def __new__(cls, groups: Groups, lengths_s: Iterable[float]) -> "TimedGroups":
        made = super().__new__(cls, groups)
        made.lengths_s = tuple(lengths_s)
        return made


@dataclass
class View:
    """What the surface fleet knows when it schedules a round.

    `round` is its number, `time` (s) when it begins.  `auvs` (n, 3) are the AUV positions it
    believes and `asvs` (m, 3) its own (m); `heard` (n, m) tells which ASVs each AUV is within HF
    range and `protocol.conflict_margin_m` of, `hf_range` (m) and `range_metric` (horizontal or
    slant) what that range is; `random` is a stream of the schedule's own.  `failed` are the ASVs
    that have failed, which hear nobody, and `lost` AUVs that nobody counts on.  The round begins up
    to `ahead_s` (s) later, where frames have to tell of it first.  `conflicts` is the conflict
    graph of the AUVs, and `slots` what the protocol's slots are made of.  What it knows of each AUV
    is worked out when it is asked for: of its estimate `since_s`, `expected_error_m` and
    `turns_in_vain`, of its place `misplaced_m` and `range_rates_m_per_s`.
    """

    round: int
    time: float
    auvs: Array
    asvs: Array
    heard: Hearing
    hf_range: float
    range_metric: str
    random: np.random.Generator
    failed: tuple[int, ...] = ()
    slots: Slots | None = None
    known: Known | None = field(default=None, repr=False)
    lost: tuple[int, ...] = ()
    ahead_s: float = 0.0

    @cached_property
    def conflicts(self) -> "nx.Graph[int]":
        """The conflict graph; of a large fleet it is large, so only made when asked for."""
        return conflict_graph(self.heard)

    @cached_property
    def since_s(self) -> Array:
        """How long (s) ago each AUV sent the ping of the last fix that was broadcast for it; since
        the start of the mission where there was none, shape (n,).
        """
        return self._known.since_s(self.time)

    @cached_property
    def expected_error_m(self) -> Array:
        """How wrong (m, RMS) each AUV's estimate is expected to be: as its last fix was, and what
        dead reckoning has drifted by on a straight way since, shape (n,).
        """
        return self._known.expected_error_m(self.time)

    @cached_property
    def turns_in_vain(self) -> Ints:
        """How many pings each AUV has been given since then where an ASV was believed to hear it,
        none of which made a fix that was broadcast, shape (n,); of rounds whose view was asked.
        """
        return self._known.turns_in_vain(np.asarray(self.heard.any(axis=1)))

    @cached_property
    def range_rates_m_per_s(self) -> Array:
        """How fast (m/s) each AUV and an ASV may come nearer to each other, or go apart, (n,)."""
        return self._known.range_rates_m_per_s

    def misplaced_m(self, sds: float) -> Array:
        """Return how far (m) each AUV may be from where it is believed, (n,), by so many standard
        deviations of fixes: nothing with `positions: truth`.
        """
        return self._known.misplaced_m(self.time, sds)

    def may_hear(self, margins: Array) -> Hearing:
        """Return which ASVs may hear each AUV, (n, m), that is up to so much, `margins` (n,), m,
        nearer than it is believed to be.
        """
        axes = 3 if self.range_metric == "slant" else 2
        away = np.linalg.norm(self.auvs[:, None, :axes] - self.asvs[None, :, :axes], axis=2)
        near: Hearing = away <= self.hf_range + margins[:, None]
        near[:, list(self.failed)] = False
        near[list(self.lost)] = False
        return near | self.heard

    @property
    def _known(self) -> Known:
        if self.known is None:
            raise LookupError(
                "this view was made by hand, without a mission: give it a `known`, "
                "or set view.since_s, view.expected_error_m or view.turns_in_vain"
            )
        return self.known

"""Which ASV hears which AUV, and so which AUVs must not ping at once: conflicts, their graph,
groups.

The graph of thousands of AUVs has millions of edges.  Since two AUVs are in conflict if one ASV
hears both, counting and colouring need for each ASV only the AUVs, or colours, that it hears.  Only
user-defined schedules get the graph.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache, wraps
from typing import TYPE_CHECKING, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from ...support.arrays import Flags, Floats, Ints
from ...support.compiled import compiled
from ...support.packed import Packed, unpacked
from ..acoustics.propagation import all_within, places_of
from ..vehicles.motion import Motion

if TYPE_CHECKING:
    import networkx as nx

Words = NDArray[np.uint64]
Groups = tuple[tuple[int, ...], ...]
Answer = TypeVar("Answer")

BYTE, EIGHT = np.uint64(255), np.uint64(8)
BITS = np.array([number.bit_count() for number in range(256)], dtype=np.int64)

# Results that are kept: AUVs move a metre between rounds, so the same conflicts recur.
REMEMBERED = 256

# Fleets whose results are kept: conflicts of more AUVs hardly ever recur, and are too large.
SMALL_FLEET = 32


def hearing(auvs: Floats, asvs: Floats, reach: float, slant: bool) -> Flags:
    """Return which AUVs are within `reach` (m) of which ASVs, (n, m): slant or horizontal distance.

    `auvs` (n, 3) and `asvs` (m, 3) are positions in m.
    """
    return all_within(np.ascontiguousarray(auvs), np.ascontiguousarray(asvs), slant, reach)


class Surveyed(NamedTuple):
    """The motions of AUVs and ASVs, and the reach (m) and `slant` of :func:`hearing`."""

    auvs: Motion
    asvs: Motion
    reach: float
    slant: bool


class VehiclePositions:
    """Positions of all vehicles at any instant, and which AUVs are within a reach of which ASVs."""

    def __init__(self, surveyed: Surveyed) -> None:
        self._packed = Packed(surveyed)
        self._auvs, self._asvs = len(surveyed.auvs.first) - 1, len(surveyed.asvs.first) - 1

    def at(self, time: float) -> tuple[Floats, Floats, Flags]:
        """Return the positions of AUVs (n, 3) and ASVs (m, 3) at an instant (s), in m, and their
        :func:`hearing` (n, m).
        """
        auvs, asvs = np.empty((self._auvs, 3)), np.empty((self._asvs, 3))
        heard = np.empty((self._auvs, self._asvs), dtype=np.bool_)
        _survey(self._packed.address, time, auvs, asvs, heard)
        return auvs, asvs, heard


@compiled
def _survey(packed: int, time: float, auvs: Floats, asvs: Floats, heard: Flags) -> None:
    """Write positions (m) at `time` (s) to `auvs` (n, 3), `asvs` (m, 3); their :func:`hearing`."""
    of = unpacked(packed, Surveyed)
    auvs[:], asvs[:] = places_of(of.auvs, time), places_of(of.asvs, time)
    heard[:] = all_within(auvs, asvs, of.slant, of.reach)


def _remembered(work_out: Callable[[Flags], Answer]) -> Callable[[Flags], Answer]:
    """Return a function of hearing (n, m) that keeps its answers for small fleets."""

    def asked(heard: bytes, auvs: int, asvs: int) -> Answer:
        return work_out(np.frombuffer(heard, dtype=np.bool_).reshape(auvs, asvs))

    kept = lru_cache(maxsize=REMEMBERED)(asked)

    @wraps(work_out)
    def answer(heard: Flags) -> Answer:
        ask = kept if len(heard) <= SMALL_FLEET else asked
        return ask(heard.tobytes(), *heard.shape)

    return answer


@_remembered
def conflict_graph(heard: Flags) -> "nx.Graph[int]":
    """Return the graph (eq. conflict_pred) whose edges join two AUVs that one ASV hears both.

    It is frozen, because rounds share it.

    >>> sorted(conflict_graph(np.array([[True, False], [True, True], [False, True]])).edges)
    [(0, 1), (1, 2)]
    """
    import networkx as nx  # takes as long as a mission, and no schedule that ships asks for it

    hears = heard.astype(np.float32)
    graph: nx.Graph[int] = nx.Graph()
    graph.add_nodes_from(range(len(heard)))
    pairs = np.argwhere(np.triu(hears @ hears.T > 0, 1)).tolist()
    graph.add_edges_from((i, j) for i, j in pairs)
    frozen: nx.Graph[int] = nx.freeze(graph)
    return frozen


@_remembered
def conflict_count(heard: Flags) -> int:
    """Return the number of pairs of AUVs that one ASV hears both; `heard` (AUVs, ASVs).

    >>> conflict_count(np.array([[True, False], [True, True], [False, True]]))
    2
    """
    return int(_degrees(heard).sum()) // 2


@_remembered
def greedy_groups(heard: Flags) -> Groups:
    """Return groups of AUVs without a common listener: each AUV, in index order, joins the first
    group in which no ASV that hears it hears another (eq. greedy_colour).

    An AUV that no ASV hears joins the first group, and takes no slot of its own.

    >>> greedy_groups(np.array([[True], [True], [False]]))
    ((0, 2), (1,))
    """
    colours = np.empty(len(heard), dtype=np.int64)
    greedy_colours(heard, colours)
    return _grouped(colours)


@_remembered
def dsatur_groups(heard: Flags) -> Groups:
    """Return groups without a common listener by DSATUR (Brelaz 1979): the AUV whose neighbours
    have most colours is next, among equals the one with most conflicts.
    """
    colours = np.full(len(heard), -1, dtype=np.int64)
    _dsatur(heard, _degrees(heard), colours)
    return _grouped(colours)


# Functions from hearing (AUVs, ASVs) to ping groups, by the names that schedules declare.
GROUPINGS: Mapping[str, Callable[[Flags], Sequence[Sequence[int]]]] = {
    "first_fit": greedy_groups,
    "saturation": dsatur_groups,
    "each": lambda heard: [[auv] for auv in range(len(heard))],
}


def _grouped(colours: Ints) -> Groups:
    """Return the AUVs of each colour, in index order; `colours` (AUVs,)."""
    order = np.argsort(colours, kind="stable")
    ends = np.cumsum(np.bincount(colours))[:-1]
    return tuple(tuple(group.tolist()) for group in np.split(order, ends))


def _degrees(heard: Flags) -> Ints:
    """Return the number of conflicts of each AUV, (AUVs,)."""
    words = -(-len(heard) // 64)
    hearers = np.zeros((heard.shape[1], 8 * words), dtype=np.uint8)
    hearers[:, : -(-len(heard) // 8)] = np.packbits(heard.T, axis=1)
    degrees = np.zeros(len(heard), dtype=np.int64)
    _count_neighbours(heard, hearers.view(np.uint64), BITS, degrees)
    return degrees


@compiled
def _count_neighbours(heard: Flags, hearers: Words, bits: Ints, degrees: Ints) -> None:
    """Write each AUV's number of conflicts to `degrees` (AUVs,), zeros at first.

    `hearers` (ASVs, words) has a bit for each AUV that an ASV hears; `bits` (256,) counts those of
    a byte.
    """
    met = np.empty(hearers.shape[1], dtype=np.uint64)
    for auv in range(len(heard)):
        for word in range(met.size):
            met[word] = 0
        for asv in range(len(hearers)):
            if heard[auv, asv]:
                for word in range(met.size):
                    met[word] |= hearers[asv, word]
        for word in range(met.size):
            rest = met[word]
            while rest != 0:
                degrees[auv] += bits[rest & BYTE]
                rest >>= EIGHT
        degrees[auv] -= degrees[auv] > 0  # itself


@compiled
def greedy_colours(heard: Flags, colours: Ints) -> None:
    """Write each AUV's group number (AUVs,), as of :func:`greedy_groups`, to `colours`."""
    used = np.zeros((heard.shape[1], len(heard) + 1), dtype=np.bool_)
    lowest = np.zeros(heard.shape[1], dtype=np.int64)  # the first colour that an ASV has not heard
    for auv in range(len(heard)):
        own = np.flatnonzero(heard[auv])
        first = 0
        for asv in own:
            first = max(first, lowest[asv])
        colours[auv] = colour = _smallest(own, used, first)
        for asv in own:
            used[asv, colour] = True
            while used[asv, lowest[asv]]:
                lowest[asv] += 1


@compiled
def _smallest(own: Ints, used: Flags, first: int) -> int:
    """Return the least colour from `first` on that no ASV of `own` hears; `used` (ASVs, k)."""
    colour = first
    while _is_used(own, used, colour):
        colour += 1
    return colour


@compiled
def _is_used(own: Ints, used: Flags, colour: int) -> bool:
    for asv in own:  # noqa: SIM110 (compiled)
        if used[asv, colour]:
            return True
    return False


@compiled
def _dsatur(heard: Flags, degrees: Ints, colours: Ints) -> None:
    """Write each AUV's colour by DSATUR to `colours` (AUVs,), -1 at first; `degrees` (AUVs,) are
    the numbers of conflicts.
    """
    used = np.zeros((heard.shape[1], len(heard) + 1), dtype=np.bool_)
    met = np.zeros(len(heard), dtype=np.int64)  # number of colours among neighbours
    for _ in range(len(heard)):
        best = -1
        for auv in range(len(heard)):
            if colours[auv] < 0 and (
                best < 0
                or met[auv] > met[best]
                or (met[auv] == met[best] and degrees[auv] > degrees[best])
            ):
                best = auv
        own = np.flatnonzero(heard[best])
        colours[best] = colour = _smallest(own, used, 0)
        for auv in range(len(heard)):
            if colours[auv] < 0 and _is_new(heard[auv], own, used, colour):
                met[auv] += 1
        for asv in own:
            used[asv, colour] = True


@compiled
def _is_new(heard: Flags, own: Ints, used: Flags, colour: int) -> bool:
    """Return whether a neighbour's `colour` is new to an AUV with hearing `heard` (ASVs,).

    It is, if an ASV of `own`, those that hear the neighbour, hears the AUV too, and none that hears
    the AUV has heard the colour before.
    """
    shared = False
    for asv in own:
        shared = shared or heard[asv]
    if not shared:
        return False
    for asv in range(len(heard)):  # noqa: SIM110 (compiled)
        if heard[asv] and used[asv, colour]:
            return False
    return True

"""Who hears whom, and so which AUVs must not ping at once: the conflict graph.

Schedules of one's own get the graph; those that ship need none (:mod:`.colouring`).
"""

from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..acoustics.propagation import within
from ..core.compiled import compiled
from ..core.handed import Handed, opened
from ..vehicles.motion import Motion, where

if TYPE_CHECKING:
    import networkx as nx

Array = NDArray[np.float64]
Hearing = NDArray[np.bool_]

# AUVs move a metre between rounds: conflicts recur, and so need not be worked out anew each time.
REMEMBERED = 256

# Those of more AUVs hardly ever recur, and are too large to keep.
SMALL_FLEET = 32


def hearing(auvs: Array, asvs: Array, reach: float, slant: bool) -> Hearing:
    """Return who is within a reach (m) of whom (:func:`.propagation.within`), shape (AUVs, ASVs).

    `auvs` (n, 3) and `asvs` (m, 3) are positions in m.
    """
    heard = np.empty((len(auvs), len(asvs)), dtype=np.bool_)
    _hearing(np.ascontiguousarray(auvs), np.ascontiguousarray(asvs), reach, slant, heard)
    return heard


@compiled
def _hearing(auvs: Array, asvs: Array, reach: float, slant: bool, heard: Hearing) -> None:
    for i in range(len(auvs)):
        here = auvs[i, 0], auvs[i, 1], auvs[i, 2], 0.0
        for j in range(len(asvs)):
            there = asvs[j, 0], asvs[j, 1], asvs[j, 2], 0.0
            heard[i, j] = within(here, there, slant, reach)


class Surveyed(NamedTuple):
    """Who is looked at: AUVs and ASVs, and the reach (m) of whom is told, as of :func:`hearing`."""

    auvs: Motion
    asvs: Motion
    reach: float
    slant: bool


class Survey:
    """Tells where all vehicles are, and who is within a reach of whom."""

    def __init__(self, surveyed: Surveyed) -> None:
        """Take who is looked at."""
        self._handed = Handed(surveyed)
        self._auvs, self._asvs = len(surveyed.auvs.first) - 1, len(surveyed.asvs.first) - 1

    def at(self, time: float) -> tuple[Array, Array, Hearing]:
        """Return where AUVs and ASVs are at an instant (s), (n, 3) and (m, 3) in m, and
        :func:`hearing` of these.
        """
        auvs, asvs = np.empty((self._auvs, 3)), np.empty((self._asvs, 3))
        heard = np.empty((self._auvs, self._asvs), dtype=np.bool_)
        _survey(self._handed.address, time, auvs, asvs, heard)
        return auvs, asvs, heard


@compiled
def _survey(handed: int, time: float, auvs: Array, asvs: Array, heard: Hearing) -> None:
    of = opened(handed, Surveyed)
    _place(of.auvs, time, auvs)
    _place(of.asvs, time, asvs)
    _hearing(auvs, asvs, of.reach, of.slant, heard)


@compiled
def _place(motion: Motion, time: float, out: Array) -> None:
    """Write where the vehicles of a fleet are at an instant (s)."""
    for vehicle in range(len(out)):
        x, y, z, _ = where(motion, vehicle, time)
        out[vehicle, 0], out[vehicle, 1], out[vehicle, 2] = x, y, z


def conflict_graph(heard: Hearing) -> "nx.Graph[int]":
    """Return the graph whose edges join AUVs that some ASV hears both of (eq. conflict_pred).

    >>> sorted(conflict_graph(np.array([[True, False], [True, True], [False, True]])).edges)
    [(0, 1), (1, 2)]
    """
    work_out = _remembered if len(heard) <= SMALL_FLEET else _graph
    return work_out(heard.tobytes(), *heard.shape)


def _graph(heard: bytes, auvs: int, asvs: int) -> "nx.Graph[int]":
    """Return the conflict graph, frozen because rounds share it."""
    import networkx as nx  # takes as long as a mission, and no schedule that ships asks for it

    hears = np.frombuffer(heard, dtype=np.bool_).reshape(auvs, asvs).astype(np.float32)
    graph: nx.Graph[int] = nx.Graph()
    graph.add_nodes_from(range(auvs))
    pairs = np.argwhere(np.triu(hears @ hears.T > 0, 1)).tolist()
    graph.add_edges_from((i, j) for i, j in pairs)
    frozen: nx.Graph[int] = nx.freeze(graph)
    return frozen


_remembered = lru_cache(maxsize=REMEMBERED)(_graph)

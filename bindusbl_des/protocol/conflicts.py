"""Who hears whom, and so which AUVs must not ping at once: the conflict graph.

Schedules of one's own get the graph; those that ship need none (:mod:`.colouring`).
"""

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..acoustics.propagation import within
from ..core.compiled import compiled, entry
from ..vehicles.motion import Ints, Motion, where

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
    _hearing(auvs, asvs, reach, slant, heard)
    return heard


@compiled
def _hearing(auvs: Array, asvs: Array, reach: float, slant: bool, heard: Hearing) -> None:
    for i in range(len(auvs)):
        here = auvs[i, 0], auvs[i, 1], auvs[i, 2], 0.0
        for j in range(len(asvs)):
            there = asvs[j, 0], asvs[j, 1], asvs[j, 2], 0.0
            heard[i, j] = within(here, there, slant, reach)


def survey(
    auvs: Motion, asvs: Motion, time: float, reach: float, slant: bool
) -> tuple[Array, Array, Hearing]:
    """Return where AUVs and ASVs are at an instant (s), (n, 3) and (m, 3) in m, and who is within
    a reach (m) of whom: :func:`hearing` of these, in one step.
    """
    count, vessels = len(auvs.first) - 1, len(asvs.first) - 1
    here, there = np.empty((count, 3)), np.empty((vessels, 3))
    heard = np.empty((count, vessels), dtype=np.bool_)
    _survey(*auvs, *asvs, time, reach, slant, here, there, heard)
    return here, there, heard


@entry
def _survey(
    auv_table: Array, auv_first: Ints, auv_step: float,
    asv_table: Array, asv_first: Ints, asv_step: float,
    time: float, reach: float, slant: bool, auvs: Array, asvs: Array, heard: Hearing,
) -> None:  # fmt: skip
    _place(Motion(auv_table, auv_first, auv_step), time, auvs)
    _place(Motion(asv_table, asv_first, asv_step), time, asvs)
    _hearing(auvs, asvs, reach, slant, heard)


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

"""Which AUVs must not ping at once: the conflict graph and its colourings."""

from collections.abc import Callable, Iterator, Mapping
from functools import lru_cache

import networkx as nx
import numpy as np
from numpy.typing import NDArray

from ..core.compiled import compiled
from ..vehicles.motion import Ints, Motion, where

Array = NDArray[np.float64]
Hearing = NDArray[np.bool_]
Colouring = Callable[["nx.Graph[int]"], Mapping[int, int]]
Groups = tuple[tuple[int, ...], ...]

# AUVs move a metre between rounds: conflicts recur, and so need not be worked out anew each time.
REMEMBERED = 256

# The graphs of more AUVs hardly ever recur, and are too large to keep.
SMALL_FLEET = 32


def hearing(auvs: Array, asvs: Array, hf_range: float, metric: str) -> Hearing:
    """Return who is within HF range of whom, shape (AUVs, ASVs); the edge of the range counts.

    `auvs` (n, 3) and `asvs` (m, 3) are positions in m; `metric` is "horizontal" or "slant".
    """
    heard = np.empty((len(auvs), len(asvs)), dtype=np.bool_)
    _hearing(auvs, asvs, hf_range, 2 if metric == "horizontal" else 3, heard)
    return heard


@compiled
def _hearing(auvs: Array, asvs: Array, hf_range: float, axes: int, heard: Hearing) -> None:
    for i in range(len(auvs)):
        for j in range(len(asvs)):
            square = 0.0
            for axis in range(axes):
                square += (auvs[i, axis] - asvs[j, axis]) ** 2
            heard[i, j] = square <= hf_range**2


def survey(
    auvs: Motion, asvs: Motion, time: float, hf_range: float, metric: str
) -> tuple[Array, Array, Hearing]:
    """Return where AUVs and ASVs are at an instant (s), (n, 3) and (m, 3) in m, and who is within
    HF range of whom: :func:`hearing` of these, in one step.
    """
    count, vessels = len(auvs.first) - 1, len(asvs.first) - 1
    here, there = np.empty((count, 3)), np.empty((vessels, 3))
    heard = np.empty((count, vessels), dtype=np.bool_)
    _survey(*auvs, *asvs, time, hf_range, 2 if metric == "horizontal" else 3, here, there, heard)
    return here, there, heard


@compiled
def _survey(
    auv_table: Array, auv_first: Ints, auv_step: float, asv_table: Array, asv_first: Ints,
    asv_step: float, time: float, hf_range: float, axes: int, auvs: Array, asvs: Array,
    heard: Hearing,
) -> None:  # fmt: skip
    for auv in range(len(auvs)):
        x, y, z, _ = where(auv_table, auv_first, auv_step, auv, time)
        auvs[auv, 0], auvs[auv, 1], auvs[auv, 2] = x, y, z
    for asv in range(len(asvs)):
        x, y, z, _ = where(asv_table, asv_first, asv_step, asv, time)
        asvs[asv, 0], asvs[asv, 1], asvs[asv, 2] = x, y, z
    _hearing(auvs, asvs, hf_range, axes, heard)


def conflict_graph(heard: Hearing) -> "nx.Graph[int]":
    """Return the graph whose edges join AUVs that some ASV hears both of (eq. conflict_pred).

    >>> sorted(conflict_graph(np.array([[True, False], [True, True], [False, True]])).edges)
    [(0, 1), (1, 2)]
    """
    work_out = _remembered if len(heard) <= SMALL_FLEET else _graph
    return work_out(heard.tobytes(), *heard.shape)


def _graph(heard: bytes, auvs: int, asvs: int) -> "nx.Graph[int]":
    """Return the conflict graph, frozen because rounds share it."""
    hears = np.frombuffer(heard, dtype=np.bool_).reshape(auvs, asvs).astype(np.float32)
    graph: nx.Graph[int] = nx.Graph()
    graph.add_nodes_from(range(auvs))
    pairs = np.argwhere(np.triu(hears @ hears.T > 0, 1)).tolist()
    graph.add_edges_from((i, j) for i, j in pairs)
    graph.graph["pairs"] = len(pairs)
    frozen: nx.Graph[int] = nx.freeze(graph)
    return frozen


_remembered = lru_cache(maxsize=REMEMBERED)(_graph)


def conflict_count(graph: "nx.Graph[int]") -> int:
    """Return the number of pairs of AUVs in conflict."""
    return int(graph.graph["pairs"])


def _index_order(graph: "nx.Graph[int]", _: Mapping[int, int]) -> Iterator[int]:
    return iter(sorted(graph))


def colour_greedily(graph: "nx.Graph[int]") -> dict[int, int]:
    """Give each AUV, in index order, the smallest colour no neighbour has (eq. greedy_colour).

    An AUV that no ASV hears has no neighbour, so it takes colour 0 and burns no slot of its own.
    """
    return dict(nx.greedy_color(graph, strategy=_index_order))


def colour_dsatur(graph: "nx.Graph[int]") -> dict[int, int]:
    """Colour the AUV with the most differently coloured neighbours first (DSATUR, Brelaz 1979)."""
    return dict(nx.greedy_color(graph, strategy="DSATUR"))


def ping_groups(graph: "nx.Graph[int]", colouring: Colouring) -> Groups:
    """Return the colour classes G_0, G_1, ... in order, each with its AUVs in index order.

    >>> graph = conflict_graph(np.array([[True], [True], [False]]))
    >>> ping_groups(graph, colour_greedily)
    ((0, 2), (1,))
    """
    if nx.is_frozen(graph) and len(graph) <= SMALL_FLEET:  # it stays as it is, so its groups do
        return _remembered_groups(graph, colouring)
    return _groups(graph, colouring)


def _groups(graph: "nx.Graph[int]", colouring: Colouring) -> Groups:
    colours = colouring(graph)
    groups: list[list[int]] = [[] for _ in range(max(colours.values(), default=-1) + 1)]
    for auv in sorted(colours):
        groups[colours[auv]].append(auv)
    return tuple(tuple(group) for group in groups)


_remembered_groups = lru_cache(maxsize=REMEMBERED)(_groups)

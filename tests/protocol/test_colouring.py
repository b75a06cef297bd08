"""Ping groups: those that networkx finds by the conflict graph, without the graph."""

import tracemalloc
from collections.abc import Iterator, Mapping
from typing import Any

import networkx as nx
import numpy as np
import pytest

from bindusbl_des import View
from bindusbl_des.core.protocol.conflicts import dsatur_groups, greedy_groups

Groups = tuple[tuple[int, ...], ...]
SMALL_FLEET = 32  # whose groups are remembered


def conflict_graph(heard: np.ndarray) -> "nx.Graph[int]":
    """Return the conflicts that a schedule is told of by who hears whom."""
    auvs, asvs = (np.zeros((count, 3)) for count in heard.shape)
    random = np.random.default_rng(0)
    return View(0, 0.0, auvs, asvs, heard, 50.0, "horizontal", random).conflicts


def in_index_order(graph: "nx.Graph[int]", _: Mapping[int, int]) -> Iterator[int]:
    return iter(sorted(graph))


def groups_of(graph: "nx.Graph[int]", strategy: Any) -> Groups:
    """Return the colour classes that networkx finds, each with its AUVs in index order."""
    colours = nx.greedy_color(graph, strategy=strategy)
    groups: list[list[int]] = [[] for _ in set(colours.values())]
    for auv in sorted(colours):
        groups[colours[auv]].append(auv)
    return tuple(tuple(group) for group in groups)


def test_the_papers_greedy_takes_auvs_in_index_order() -> None:
    """On the path of conflicts 0-2-3-1 index order needs three colours, DSATUR two."""
    heard = np.array(
        [[True, False, False], [False, False, True], [True, True, False], [False, True, True]]
    )
    assert sorted(conflict_graph(heard).edges) == [(0, 2), (1, 3), (2, 3)]
    assert greedy_groups(heard) == ((0, 1), (2,), (3,))
    assert len(dsatur_groups(heard)) == 2


@pytest.mark.parametrize("count", [SMALL_FLEET, SMALL_FLEET + 1])
def test_fleets_of_any_size_are_grouped_alike(count: int) -> None:
    """AUVs heard in pairs share no slot with their twin; what is remembered is no other."""
    heard = np.repeat(np.eye((count + 1) // 2, dtype=bool), 2, axis=0)[:count]
    evens, odds = tuple(range(0, count, 2)), tuple(range(1, count, 2))
    assert greedy_groups(heard) == (evens, odds)
    assert greedy_groups(heard.copy()) == (evens, odds)


@pytest.mark.parametrize("seed", range(60))
def test_groups_are_those_of_the_conflict_graph(seed: int) -> None:
    """At random and by distance, few and many ASVs, small fleets (remembered) and large."""
    draw = np.random.default_rng(seed)
    auvs, asvs = int(draw.integers(1, 3 * SMALL_FLEET)), int(draw.integers(1, 12))
    heard = draw.random((auvs, asvs)) < draw.choice([0.02, 0.1, 0.3, 0.7, 1.0])
    if seed % 2:
        apart = draw.random((auvs, 1, 2)) - draw.random((asvs, 2))
        heard = np.hypot(apart[..., 0], apart[..., 1]) < draw.choice([0.1, 0.3, 0.6])
    graph = conflict_graph(heard)
    assert greedy_groups(heard) == groups_of(graph, in_index_order)
    assert dsatur_groups(heard) == groups_of(graph, "DSATUR")


def test_a_large_fleet_needs_no_memory_for_its_conflicts() -> None:
    """5,000 AUVs that all conflict: 12 million pairs, in less than a byte each."""
    heard = np.ones((5000, 3), dtype=bool)
    greedy_groups(heard[:40])  # compiled beforehand
    tracemalloc.start()
    assert len(greedy_groups(heard)) == 5000
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 10e6

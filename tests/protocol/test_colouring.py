"""Ping groups of large fleets: those of the conflict graph, without the graph."""

import tracemalloc

import numpy as np
import pytest

from bindusbl_des.protocol.colouring import (
    SMALL_FLEET,
    conflict_count,
    dsatur_groups,
    greedy_groups,
)
from bindusbl_des.protocol.conflicts import (
    colour_dsatur,
    colour_greedily,
    conflict_graph,
    ping_groups,
)


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
    assert conflict_count(heard) == graph.number_of_edges()
    assert greedy_groups(heard) == ping_groups(graph, colour_greedily)
    assert dsatur_groups(heard) == ping_groups(graph, colour_dsatur)


def test_a_large_fleet_needs_no_memory_for_its_conflicts() -> None:
    """5,000 AUVs that all conflict: 12 million pairs, in less than a byte each."""
    heard = np.ones((5000, 3), dtype=bool)
    greedy_groups(heard[:40])  # compiled beforehand
    conflict_count(heard[:40])
    tracemalloc.start()
    assert conflict_count(heard) == 5000 * 4999 // 2
    assert len(greedy_groups(heard)) == 5000
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 10e6

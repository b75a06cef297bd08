"""Who must not ping at once: conflict graphs and colourings, worked by hand."""

import networkx as nx
import numpy as np
import pytest

from bindusbl_des.protocol.conflicts import (
    SMALL_FLEET,
    colour_dsatur,
    colour_greedily,
    conflict_count,
    conflict_graph,
    hearing,
    ping_groups,
)


def test_an_asv_hears_whom_the_metric_says() -> None:
    """At (30, 40) and 120 m depth an AUV is 50 m away from above and 130 m in all; edges count."""
    auv, asvs = np.array([[30.0, 40.0, 120.0]]), np.zeros((2, 3))
    asvs[1, 0] = 1e4
    for slant, reach in ((False, 50.0), (True, 130.0)):
        assert hearing(auv, asvs, reach, slant).tolist() == [[True, False]]
        assert hearing(auv, asvs, np.nextafter(reach, 0.0), slant).tolist() == [[False, False]]


def path_of_four() -> np.ndarray:
    """Return who hears whom so that AUVs 0-2, 2-3 and 3-1 are in conflict, a path."""
    return np.array(
        [[True, False, False], [False, False, True], [True, True, False], [False, True, True]]
    )


def test_the_papers_greedy_takes_auvs_in_index_order() -> None:
    """On the path 0-2-3-1 index order needs three colours, DSATUR two."""
    graph = conflict_graph(path_of_four())
    assert sorted(graph.edges) == [(0, 2), (1, 3), (2, 3)]
    assert conflict_count(graph) == 3
    assert colour_greedily(graph) == {0: 0, 1: 0, 2: 1, 3: 2}
    assert ping_groups(graph, colour_greedily) == ((0, 1), (2,), (3,))
    assert len(ping_groups(graph, colour_dsatur)) == 2


@pytest.mark.parametrize("count", [SMALL_FLEET, SMALL_FLEET + 1])
def test_fleets_of_any_size_are_grouped_alike(count: int) -> None:
    """AUVs heard in pairs make as many conflicts as pairs; graphs that recur are no others."""
    heard = np.repeat(np.eye((count + 1) // 2, dtype=bool), 2, axis=0)[:count]
    graph = conflict_graph(heard)
    assert conflict_count(graph) == count // 2
    evens, odds = ping_groups(graph, colour_greedily)
    assert evens == tuple(range(0, count, 2))
    assert odds == tuple(range(1, count, 2))
    assert conflict_count(conflict_graph(heard[:, ::-1] & False)) == 0
    assert ping_groups(conflict_graph(heard), colour_greedily) == (evens, odds)


def test_a_graph_of_ones_own_may_change() -> None:
    """A schedule that adds a conflict of its own to a graph gets other groups."""
    graph: nx.Graph[int] = nx.Graph(conflict_graph(path_of_four()))
    assert ping_groups(graph, colour_greedily) == ((0, 1), (2,), (3,))
    graph.add_edge(0, 1)
    assert ping_groups(graph, colour_greedily) == ((0, 3), (1, 2))

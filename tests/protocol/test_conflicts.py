"""Who must not ping at once, as a schedule of one's own is told."""

import networkx as nx
import numpy as np
import pytest

from bindusbl_des import View


def test_a_graph_is_shared_and_its_copy_may_change() -> None:
    """What recurs is one graph, which nobody can change; a schedule adds conflicts to a copy."""
    heard = np.array([[True, False], [True, True], [False, True]])

    def view() -> View:
        random = np.random.default_rng(0)
        return View(
            0, 0.0, np.zeros((3, 3)), np.zeros((2, 3)), heard.copy(), 50.0, "horizontal", random
        )

    graph = view().conflicts
    assert view().conflicts is graph
    assert sorted(graph.edges) == [(0, 1), (1, 2)]
    with pytest.raises(nx.NetworkXError, match="Frozen"):
        graph.add_edge(0, 2)
    own: nx.Graph[int] = nx.Graph(graph)
    own.add_edge(0, 2)
    assert (graph.number_of_edges(), own.number_of_edges()) == (2, 3)

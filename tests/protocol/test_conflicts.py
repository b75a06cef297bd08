"""Who hears whom and must not ping at once, worked by hand."""

import networkx as nx
import numpy as np
import pytest

from bindusbl_des.protocol.conflicts import conflict_graph, hearing


def test_an_asv_hears_whom_the_metric_says() -> None:
    """At (30, 40) and 120 m depth an AUV is 50 m away from above and 130 m in all; edges count."""
    auv, asvs = np.array([[30.0, 40.0, 120.0]]), np.zeros((2, 3))
    asvs[1, 0] = 1e4
    for slant, reach in ((False, 50.0), (True, 130.0)):
        assert hearing(auv, asvs, reach, slant).tolist() == [[True, False]]
        assert hearing(auv, asvs, np.nextafter(reach, 0.0), slant).tolist() == [[False, False]]


def test_a_graph_is_shared_and_its_copy_may_change() -> None:
    """What recurs is one graph, which nobody can change; a schedule adds conflicts to a copy."""
    heard = np.array([[True, False], [True, True], [False, True]])
    graph = conflict_graph(heard)
    assert conflict_graph(heard.copy()) is graph
    with pytest.raises(nx.NetworkXError, match="Frozen"):
        graph.add_edge(0, 2)
    own: nx.Graph[int] = nx.Graph(graph)
    own.add_edge(0, 2)
    assert (graph.number_of_edges(), own.number_of_edges()) == (2, 3)

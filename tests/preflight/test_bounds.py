"""What no protocol can do better: closed forms, small graphs, and graphs drawn at random."""

from itertools import combinations

import networkx as nx
import numpy as np
import pytest

from bindusbl_des import Setup, load_scenario
from bindusbl_des.apps.preflight.bounds import (
    aloha_capacity,
    clique_number,
    decode_bound,
    disjoint_senders,
    fewest_groups,
    latency_bound,
    most_heard,
    record_bound,
    reuse_bound,
    slotted_aloha_capacity,
)
from bindusbl_des.core.protocol.conflicts import conflict_graph, dsatur_groups, greedy_groups
from bindusbl_des.core.protocol.cycles import cycle

# Fixes per AUV and second if all share one ASV, sequential and pipelined over 60, 100 and 140 m,
# and with frame behind frame; worked out apart from this program.
RATES = {
    3: (1.250000, 2.000000, 0.857143, 1.500000, 0.612245, 1.071429, 2.232143),
    4: (0.967742, 1.578947, 0.750000, 1.500000, 0.535714, 1.071429, 1.736111),
    5: (0.789474, 1.304348, 0.612245, 1.200000, 0.476190, 0.857143, 1.420455),
    6: (0.666667, 1.111111, 0.517241, 1.000000, 0.422535, 0.714286, 1.201923),
    7: (0.576923, 0.967742, 0.447761, 0.857143, 0.365854, 0.612245, 1.041667),
    8: (0.508475, 0.857143, 0.394737, 0.750000, 0.322581, 0.535714, 0.919118),
    9: (0.461538, 0.789474, 0.357143, 0.666667, 0.291262, 0.476190, 0.822368),
    10: (0.416667, 0.714286, 0.322581, 0.600000, 0.263158, 0.428571, 0.744048),
}
SIDES = (60, 100, 140)


@pytest.mark.parametrize("auvs", RATES)
def test_rates_of_a_fleet_that_shares_one_asv(auvs: int) -> None:
    """Slots on ticks of 30 Hz: one for each AUV, then the frame with all their fixes."""
    plain = load_scenario("recovery_140m").model_dump()
    *expected, optimum = RATES[auvs]
    found = []
    for side in SIDES:
        plain["survey"]["side_m"] = side
        slots = Setup(type(load_scenario("recovery_140m")).model_validate(plain)).slots
        for downlink in ("sequential", "pipelined_round"):
            found.append(1 / cycle(downlink, slots, auvs, auvs).length_s)
    assert found == pytest.approx(expected, abs=5e-7)
    assert record_bound(slots.airtime, auvs, 1, auvs) == pytest.approx((auvs * optimum, auvs))
    for sequential, pipelined in zip(found[::2], found[1::2], strict=True):
        assert sequential < pipelined <= min(2 * sequential, optimum)


def test_limits_of_pings_records_and_latency() -> None:
    assert decode_bound(0.010) == pytest.approx(100 / 3)
    assert decode_bound(0.010, 0.0) == pytest.approx(100.0)
    assert record_bound(lambda fixes: 0.064 + 0.128 * fixes, 10**4, 1, 10**4)[0] < 7.8125
    assert latency_bound(50.0, 0.192, 100.0, 1500.0) == pytest.approx(0.292)


@pytest.mark.parametrize("auvs", [2, 3, 10, 100])
def test_capacity_of_random_access_is_the_best_of_all_loads(auvs: int) -> None:
    """No G yields more than the closed form: G exp(-2 G (N-1)/N), or half the exponent on slots."""
    load = np.linspace(0.001, 1.0, 1000) * auvs
    for capacity, vulnerable in ((aloha_capacity, 2), (slotted_aloha_capacity, 1)):
        through = load * np.exp(-vulnerable * load * (auvs - 1) / auvs)
        assert capacity(0.5, auvs) == pytest.approx(min(through.max(), 1.0) / 0.5, rel=1e-3)
    assert aloha_capacity(1.0, 10**6) == pytest.approx(1 / (2 * np.e), rel=1e-5)
    assert slotted_aloha_capacity(1.0, 10**6) == pytest.approx(1 / np.e, rel=1e-5)


def heard_by(*types: str) -> np.ndarray:
    """Return who hears whom of AUVs given by the ASVs that hear them, such as "12"."""
    asvs = max(int(letter) for kind in types for letter in kind)
    return np.array([[str(asv + 1) in kind for asv in range(asvs)] for kind in types])


def test_the_order_of_auvs_can_cost_a_slot() -> None:
    """A path of four: first fit needs three groups, DSATUR and the best two."""
    heard = heard_by("1", "3", "12", "23")
    assert (len(greedy_groups(heard)), len(dsatur_groups(heard))) == (3, 2)
    assert (most_heard(heard), clique_number(heard), fewest_groups(heard)) == (2, 2, (2, 2))
    assert reuse_bound(heard) == 2.0


def test_a_clique_may_be_larger_than_what_one_asv_hears() -> None:
    """Each pair of three AUVs has an ASV of its own, which hears two."""
    heard = heard_by("12", "13", "23")
    assert (most_heard(heard), clique_number(heard), fewest_groups(heard)) == (2, 3, (3, 3))


def test_groups_can_be_more_than_the_largest_clique() -> None:
    """A ring of five: no three are in conflict with each other, and two groups do not do."""
    heard = heard_by("12", "23", "34", "45", "51")
    assert (clique_number(heard), fewest_groups(heard)) == (2, (3, 3))


def test_the_search_for_groups_takes_back_what_led_nowhere() -> None:
    """Seven AUVs, ten pairs of them with an ASV of their own: three groups do, not at first."""
    pairs = [(0, 3), (0, 5), (0, 6), (1, 2), (1, 4), (1, 5), (2, 3), (2, 4), (3, 6), (4, 5)]
    heard = np.zeros((7, len(pairs)), dtype=np.bool_)
    for asv, pair in enumerate(pairs):
        heard[list(pair), asv] = True
    assert fewest_groups(heard) == (3, 3)
    assert disjoint_senders(heard_by("1", "2", "3", "3")) == 3


def test_nobody_in_range_takes_one_slot() -> None:
    heard = np.zeros((4, 2), dtype=np.bool_)
    assert (most_heard(heard), fewest_groups(heard), reuse_bound(heard)) == (0, (1, 1), 1.0)
    assert disjoint_senders(heard) == 1


def test_large_fleets_are_told_between_what() -> None:
    """Where DSATUR needs no more than one ASV hears, the number is known of any fleet."""
    one_asv = np.ones((60, 1), dtype=np.bool_)
    assert (fewest_groups(one_asv), clique_number(one_asv)) == ((60, 60), None)
    rings = np.kron(np.eye(5, dtype=np.bool_), heard_by("12", "23", "34", "45", "51"))
    assert fewest_groups(rings) == (2, 3)


@pytest.mark.parametrize("seed", range(60))
def test_graphs_drawn_at_random(seed: int) -> None:
    """The clique is that of networkx, the groups the fewest of an exhaustive search."""
    random = np.random.default_rng(seed)
    auvs, asvs = int(random.integers(1, 8)), int(random.integers(1, 6))
    heard = random.random((auvs, asvs)) < random.uniform(0.1, 0.8)
    graph = conflict_graph(heard)
    clique, (low, high) = clique_number(heard), fewest_groups(heard)
    assert clique == max(map(len, nx.find_cliques(graph)))
    assert low == high == least_colours(graph)
    assert max(most_heard(heard), 1) <= clique <= low <= len(dsatur_groups(heard))
    in_range = int(heard.any(axis=1).sum())
    assert in_range / low <= reuse_bound(heard) <= asvs
    assert disjoint_senders(heard) >= most_apart(heard)


def least_colours(graph: nx.Graph) -> int:
    def fits(auv: int, colours: list[int], most: int) -> bool:
        return auv == len(graph) or any(
            fits(auv + 1, [*colours, colour], most)
            for colour in range(most)
            if all(colours[other] != colour for other in graph[auv] if other < auv)
        )

    return next(most for most in range(1, len(graph) + 1) if fits(0, [], most))


def most_apart(heard: np.ndarray) -> int:
    """Return how many ASVs have listeners, and none in common, at most."""
    sending = np.flatnonzero(heard.any(axis=0))
    return max(
        size
        for size in range(len(sending) + 1)
        for chosen in combinations(sending, size)
        if size <= 1 or heard[:, list(chosen)].sum(axis=1).max() <= 1
    )

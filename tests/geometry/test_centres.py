"""Enclosing circles, k centres and assignments, against brute force and hand-worked cases."""

from collections.abc import Iterator
from itertools import combinations, permutations
from math import dist, sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from bindusbl_des.core.geometry import covering
from bindusbl_des.core.geometry.covering import circumscribed, diametral, enclosing_circle, k_centre
from bindusbl_des.core.geometry.placement import assignment, least_sum

Floats = NDArray[np.float64]
# On a lattice places coincide, lie in a row and four of them on one circle.
place = st.one_of(
    st.tuples(st.floats(-100.0, 100.0), st.floats(-100.0, 100.0)),
    st.tuples(st.integers(-3, 3).map(float), st.integers(-3, 3).map(float)),
)


def radius_by_trying(places: Floats) -> float:
    """Return the least radius of all circles by two or three places that enclose all."""
    different = np.unique(places, axis=0)
    if len(different) == 1:
        return 0.0
    circles = [diametral(np.array(it)) for it in combinations(different, 2)]
    circles += [circumscribed(np.array(it)) for it in combinations(different, 3)]
    return min(
        it.radius
        for it in circles
        if np.isfinite(it.radius)
        and max(dist((it.x, it.y), p) for p in different) <= it.radius * (1 + 1e-9)
    )


@given(st.lists(place, min_size=1, max_size=9))
def test_the_enclosing_circle_is_the_smallest_of_all(places: list[tuple[float, float]]) -> None:
    circle = enclosing_circle(places)
    assert max(dist((circle.x, circle.y), it) for it in places) <= circle.radius + 1e-9
    assert circle.radius == pytest.approx(radius_by_trying(np.array(places)), rel=1e-7, abs=1e-9)


def test_circles_around_many_and_around_far_away_places() -> None:
    """A thousand places on a circle, and a triangle of 1 m at 1,000 km, where digits are few."""
    angles = np.linspace(0.0, 2 * np.pi, 1000)
    ring = 70.0 * np.column_stack((np.cos(angles), np.sin(angles))) + (5.0, -3.0)
    assert enclosing_circle(ring) == pytest.approx((5.0, -3.0, 70.0), abs=1e-9)
    triangle = np.array([(0.0, 0.0), (1.0, 0.0), (0.5, sqrt(0.75))]) + 1e6
    assert enclosing_circle(triangle).radius == pytest.approx(1 / sqrt(3), abs=1e-8)


def partitions(numbers: list[int], most: int) -> Iterator[list[list[int]]]:
    """Yield all partitions of numbers into at most so many parts."""
    if not numbers:
        yield []
        return
    first, rest = numbers[0], numbers[1:]
    for parts in partitions(rest, most):
        for n in range(len(parts)):
            yield [*parts[:n], [first, *parts[n]], *parts[n + 1 :]]
        if len(parts) < most:
            yield [[first], *parts]


@settings(max_examples=40, deadline=None)
@given(st.lists(place, min_size=1, max_size=6), st.integers(1, 4))
def test_centres_are_the_best_of_all_partitions(
    places: list[tuple[float, float]], count: int
) -> None:
    points = np.array(places)
    found = k_centre(points, count)
    best = min(
        max(enclosing_circle(points[part]).radius for part in parts)
        for parts in partitions(list(range(len(points))), count)
    )
    assert found.places.shape == (count, 2)
    assert found.radius == pytest.approx(best, rel=1e-7, abs=1e-9)
    own = found.places[found.nearest]
    assert np.hypot(*(points - own).T).max() == found.radius


def test_a_place_by_itself_has_a_centre_of_its_own() -> None:
    """Two places side by side and one 100 m away: no circle through the far one is as small."""
    found = k_centre([(0.0, 0.0), (2.0, 0.0), (100.0, 0.0)], 2)
    assert found.places.tolist() == [[1.0, 0.0], [100.0, 0.0]]
    assert found.radius == 1.0


def test_many_places_have_centres_within_a_few_percent_of_the_best(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The same sixteen places, exactly and by farthest-first traversals: 30 draws."""
    generator = np.random.default_rng(4)
    excess = []
    for _ in range(30):
        places, count = generator.uniform(-70, 70, (14, 2)), int(generator.integers(1, 5))
        exact = k_centre(places, count).radius
        with monkeypatch.context() as patch:
            patch.setattr(covering, "EXACT_PLACES", 0)
            excess.append(k_centre(places, count).radius / exact)
    assert min(excess) >= 1.0 - 1e-9
    assert np.mean(excess) < 1.05
    assert max(excess) < 2.0  # what Gonzalez promises


@pytest.mark.parametrize(("count", "share"), [(1, 0.5**0.5), (2, 0.559017), (4, 0.5**0.5 / 2)])
def test_centres_of_a_filled_square_have_the_known_covering_radius(
    count: int, share: float
) -> None:
    """A grid of 21 x 21 places over a square of 100 m: 70.7, 55.9 and 35.4 m (physics 3.2)."""
    axis = np.linspace(-50.0, 50.0, 21)
    places = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    # A grid is not a square: what lies between its places, 5 m apart, is missed.
    assert 0.93 * 100 * share <= k_centre(places, count).radius <= 1.02 * 100 * share


@settings(deadline=None)
@given(st.lists(place, min_size=1, max_size=5), st.lists(place, min_size=1, max_size=5))
def test_vessels_move_no_more_than_they_must(
    vessels: list[tuple[float, float]], places: list[tuple[float, float]]
) -> None:
    chosen = assignment(vessels, places).tolist()
    gone = [(n, it) for n, it in enumerate(chosen) if it >= 0]
    moved = sum(dist(vessels[n], places[it]) ** 2 for n, it in gone)
    few, many = sorted((vessels, places), key=len)
    least = min(
        sum(dist(a, b) ** 2 for a, b in zip(few, order, strict=True))
        for order in permutations(many, len(few))
    )
    assert len({it for _, it in gone}) == len(gone) == len(few)
    assert moved == pytest.approx(least, rel=1e-9, abs=1e-9)


def test_ten_vessels_as_by_another_library() -> None:
    optimize = pytest.importorskip("scipy.optimize")
    generator = np.random.default_rng(3)
    for _ in range(20):
        cost = generator.uniform(0.0, 1.0, (10, 12))
        rows, columns = optimize.linear_sum_assignment(cost)
        assert cost[np.arange(10), least_sum(cost)].sum() == pytest.approx(
            cost[rows, columns].sum()
        )


def test_what_cannot_be_placed_is_told() -> None:
    with pytest.raises(ValueError, match=r"shape \(n, 2\)"):
        enclosing_circle(np.empty((0, 2)))
    with pytest.raises(ValueError, match="at least one centre is needed; met 0"):
        k_centre([(0.0, 0.0)], 0)
    with pytest.raises(ValueError, match="3 rows need as many columns; met 2"):
        least_sum(np.zeros((3, 2)))


def test_places_far_from_the_origin_have_a_centre() -> None:
    """Coordinates of 1000 km are rounded by more than circles of 2 cm may be off."""
    places = [(0.01, -1e6), (-0.01, -1e6), (0.0, -1e6 + 0.013)]
    found = k_centre(places, 1)
    assert np.abs(found.places - np.mean(places, axis=0)).max() < 0.01
    assert found.radius < 0.02

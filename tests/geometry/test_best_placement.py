"""Best formations and best covers, against known constants, first principles and brute force."""

import math
import tracemalloc
from itertools import combinations
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from bindusbl_des import covered_area, covering_radius, formation
from bindusbl_des.apps.planning.placement import least_ring
from bindusbl_des.core.geometry import covering, placement
from bindusbl_des.core.geometry.area import polygon
from bindusbl_des.core.geometry.covering import max_cover

Floats = NDArray[np.float64]


def least_covering_ring(
    survey: Any, count: int, widest: float, middle: tuple[float, float] = (0.0, 0.0)
) -> Any:
    """Return the regular formation that hears everywhere with the least range."""
    return least_ring(count, lambda places: covering_radius(survey, places), widest, middle)


@pytest.mark.parametrize(
    ("count", "radius", "covers_within", "degrees"),
    [
        (1, 0.0, 0.5**0.5, None),
        (2, 0.25, 5**0.5 / 4, 0.0),
        (3, (3 + 3**0.5) / 12, 0.511042610, 0.0),
        (4, 0.5**0.5 / 2, 0.5**0.5 / 2, 45.0),
        (5, None, 0.396802247, None),
        (6, None, 3**0.5 / 2 - 0.5, None),
    ],
)
def test_the_least_covering_rings_of_a_square(
    count: int, radius: float | None, covers_within: float, degrees: float | None
) -> None:
    """Shares of the side, and the angle but for those that look alike in a square."""
    ring = least_covering_ring(1.0, count, 1.0 / math.sqrt(2.0))
    assert ring.value == pytest.approx(covers_within, abs=1e-6)
    assert covering_radius(1.0, formation(count, ring.radius, ring.angle)) == ring.value
    if radius is not None:
        assert ring.radius == pytest.approx(radius, abs=1e-5)
    if degrees is not None:
        alike = math.gcd(360 // count, 90)
        off = (math.degrees(ring.angle) - degrees + alike / 2) % alike - alike / 2
        assert abs(off) < 1e-3


@pytest.mark.parametrize(
    ("side", "count", "percent"),
    [(100.0, 2, 95.66), (100.0, 3, 99.81), (140.0, 2, 69.93), (140.0, 3, 87.61), (60.0, 2, 100.0)],
)
def test_the_rings_that_hear_most_of_a_square(side: float, count: int, percent: float) -> None:
    """At a range of 50 m; a search over a grid of radii and angles found these, to 0.01 %."""
    ring = least_ring(count, lambda places: -covered_area(side, places, 50.0), side / 2**0.5)
    assert percent - 0.005 <= -100.0 * ring.value <= percent + 0.02


def test_a_ring_lies_about_the_middle_of_its_survey() -> None:
    """A square that begins at the origin has the ring of one about it, moved with it."""
    area = polygon([(0, 0), (100, 0), (100, 100), (0, 100)])
    ring = least_covering_ring(area, 2, 50.0 * 2**0.5, area.centroid)
    assert ring.value == pytest.approx(100 * 5**0.5 / 4, abs=1e-3)


def error(place: tuple[float, float], vessels: Floats, reach: float = math.inf) -> float:
    """Return the least error (m) of a fix by ranges of 2 cm and bearings of 1 deg."""
    away = np.hypot(*(np.array(place) - vessels).T)
    near = np.where(away <= reach, 1.0, np.inf)
    told = placement.information(
        place, vessels, 0.02**2 * near, (away * math.radians(1.0)) ** 2 * near
    )
    return float(np.sqrt(placement.trace_of_inverse(told)))


@pytest.mark.parametrize(
    ("count", "metres"),
    [(1, 0.872893779029), (2, 0.617229110407), (3, 0.023087948103), (4, 0.019994749578)],
)
def test_what_a_ring_tells_of_its_middle(count: int, metres: float) -> None:
    """50 m away; for three or more sqrt(4 / (N (1 / sd_r^2 + 1 / (R sd_theta)^2)))."""
    vessels = formation(count, 50.0) if count > 1 else np.array([[50.0, 0.0]])
    assert error((0.0, 0.0), vessels) == pytest.approx(metres, abs=1e-11)


def test_who_hears_decides_what_is_known() -> None:
    vessels = formation(3, 50.0)
    for place, all_heard, within in (
        ((10.0, 20.0), 0.024441863044, 0.210856401303),
        ((30.0, 30.0), 0.023383480889, 0.629605150648),
        ((-30.0, 30.0), 0.024442732385, 0.248816204237),
        ((70.0, 70.0), None, math.inf),
    ):
        assert error(place, vessels, 50.0) == pytest.approx(within, abs=1e-11)
        if all_heard is not None:
            assert error(place, vessels) == pytest.approx(all_heard, abs=1e-11)


@pytest.mark.parametrize("count", [3, 4])
def test_ranges_tell_most_from_equal_angles(count: int) -> None:
    """By ranges alone tr J^-1 is 4 sd^2 / N at best, when the sum of exp(2 i bearing) is 0."""
    bearings = np.radians(np.arange(0, 360, 15))
    best = math.inf
    for rest in combinations(bearings, count - 1):
        angles = np.array([0.0, *rest])
        vessels = 50.0 * np.column_stack((np.cos(angles), np.sin(angles)))
        told = placement.information(
            (0.0, 0.0), vessels, np.full(count, 0.01), np.full(count, np.inf)
        )
        trace = float(placement.trace_of_inverse(told))
        assert trace >= 4 * 0.01 / count * (1 - 1e-9)
        best = min(best, trace)
    assert best == pytest.approx(4 * 0.01 / count)
    ring = placement.information(
        (0.0, 0.0), formation(count, 50.0), np.full(count, 0.01), np.full(count, np.inf)
    )
    assert placement.trace_of_inverse(ring) == pytest.approx(best)
    assert placement.det(ring) == pytest.approx((count / 0.02) ** 2)


def test_surface_ranges_fix_a_deep_target_best_from_its_depth_times_sqrt_2() -> None:
    """Each direction cosine squared is then 1/3, on average over the ring, and det J the largest
    that its trace allows (Moreno-Salinas, Pascoal and Aranda 2013); the descent finds it.
    """
    depth = 40.0

    def loss(numbers: Floats) -> float:
        spots = np.column_stack((formation(4, abs(float(numbers[0]))), np.full(4, -depth)))
        rays = spots / np.linalg.norm(spots, axis=1)[:, None]
        return -float(np.linalg.det(rays.T @ rays))

    found, least = placement.descended(loss, np.array([10.0]), 20.0, 1e-6, 400)
    assert found[0] == pytest.approx(depth * math.sqrt(2.0), rel=1e-4)
    assert -least == pytest.approx((4 / 3) ** 3)


def test_a_descent_ends_in_a_bent_valley() -> None:
    """Rosenbrock's, from where it was first tried; the budget holds and nothing is by chance."""
    asked = []

    def valley(place: Floats) -> float:
        asked.append(place)
        return float((1 - place[0]) ** 2 + 100 * (place[1] - place[0] ** 2) ** 2)

    found, least = placement.descended(valley, np.array([-1.2, 1.0]), 0.5, 1e-8, 2000)
    assert found == pytest.approx([1.0, 1.0], abs=1e-6)
    assert least == valley(found)
    assert (
        placement.descended(valley, np.array([-1.2, 1.0]), 0.5, 1e-8, 2000)[0].tolist()
        == found.tolist()
    )
    asked.clear()
    placement.descended(valley, np.array([-1.2, 1.0]), 0.5, 1e-8, 50)
    assert len(asked) <= 55  # a step begun is ended


def covered_by_trying(places: Floats, count: int, reach: float) -> int:
    """Return how many places any circles cover whose edge holds two of them, or middle one."""
    middles = covering._middles(places, reach)
    within = np.hypot(*(places[None] - middles[:, None]).transpose(2, 0, 1)) <= reach * (1 + 1e-9)
    return max(
        int(within[list(chosen)].any(axis=0).sum())
        for chosen in combinations(range(len(middles)), min(count, len(middles)))
    )


lattice = st.tuples(st.integers(-6, 6).map(float), st.integers(-6, 6).map(float))


@settings(deadline=None, max_examples=40)
@given(st.lists(lattice, min_size=1, max_size=7), st.integers(1, 2), st.floats(0.5, 6.0))
def test_covers_are_nearly_the_best_of_all(
    places: list[tuple[float, float]], count: int, reach: float
) -> None:
    """One vessel covers as many as can be; two 1 - 1/e of that at least."""
    points = np.array(places)
    found = max_cover(points, count, reach)
    assert found.places.shape == (count, 2)
    away = np.hypot(*(points[:, None] - found.places).transpose(2, 0, 1)).min(axis=1)
    assert found.reached.tolist() == (away <= reach * (1 + 1e-9)).tolist()
    best = covered_by_trying(points, count, reach)
    assert found.reached.sum() <= len(points)
    assert found.reached.sum() >= (best if count == 1 else (1 - 1 / math.e) * best)


def test_two_covers_are_as_good_as_the_best_in_most_draws() -> None:
    generator = np.random.default_rng(8)
    found, best = [], []
    for _ in range(25):
        places = generator.uniform(-70, 70, (9, 2))
        found.append(max_cover(places, 2, 40.0).reached.sum())
        best.append(covered_by_trying(places, 2, 40.0))
    assert np.mean(np.array(found) / best) > 0.98


def test_weights_decide_and_a_vessel_with_nothing_to_do_goes_far_out() -> None:
    places = [(0.0, 0.0), (1.0, 0.0), (100.0, 0.0)]
    assert max_cover(places, 1, 5.0).reached.tolist() == [True, True, False]
    assert max_cover(places, 1, 5.0, weights=[1.0, 1.0, 3.0]).reached.tolist() == [
        False,
        False,
        True,
    ]
    spare = max_cover([(0.0, 0.0), (2.0, 0.0)], 2, 5.0)
    assert spare.reached.all()
    assert spare.places.shape == (2, 2)
    with pytest.raises(ValueError, match="at least one vessel is needed; met 0"):
        max_cover(places, 0, 5.0)
    with pytest.raises(ValueError, match="a reach must be positive and finite; met 0"):
        max_cover(places, 1, 0.0)


def test_ever_more_places_in_ever_larger_seas_need_no_more_memory() -> None:
    """Pairs of places are not all compared, nor has a grid so many cells of a part of the reach."""
    generator = np.random.default_rng(5)
    crowd = generator.normal(0.0, 10.0, (4000, 2))
    for sea in (1e4, 1e6):
        places = np.vstack((crowd, generator.uniform(-sea / 2, sea / 2, (2000, 2))))
        tracemalloc.start()
        found = max_cover(places, 1, 50.0)
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert peak < 300e6
        assert found.reached.shape == (6000,)
        away = np.hypot(*(places[:, None] - found.places).transpose(2, 0, 1)).min(axis=1)
        assert found.reached.tolist() == (away <= 50.0 * (1 + 1e-9)).tolist()
        assert found.reached[:4000].mean() > 0.99


def test_many_places_are_covered_from_a_grid() -> None:
    """Four hundred places in a square of 100 m: all of them at a reach beyond 71 m."""
    axis = np.linspace(-50.0, 50.0, 20)
    places = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    assert max_cover(places, 1, 75.0).reached.all()
    assert 0.55 < max_cover(places, 2, 40.0).reached.mean() <= 1.0


def test_a_ring_of_one_is_its_middle() -> None:
    ring = least_ring(1, lambda places: float(np.abs(places).sum()), 10.0, (3.0, 4.0))
    assert ring == (0.0, 0.0, 7.0)

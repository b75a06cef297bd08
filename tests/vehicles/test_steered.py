"""Vessels that are told where to go: straight, no faster than they can, and only from then on."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bindusbl_des.core.vehicles.vehicle import Steered


def test_a_vessel_goes_straight_and_rests() -> None:
    """50 m at 2.5 m/s from 10 s on: half way at 20 s, there at 30 s, with its last heading."""
    fleet = Steered(np.array([[0.0, 0.0], [7.0, 7.0]]), np.full(2, 2.5), 3, lead_s=1.0)
    fleet.go(10.0, np.array([[30.0, 40.0], [7.0, 7.0]]))
    vessel, other = fleet.vehicles
    yaw = np.arctan2(40.0, 30.0)
    times = np.array([0.0, 10.0, 20.0, 30.0, 1e6])
    assert vessel.sample(times) == pytest.approx(
        np.array([
            [0, 0, 0, 0], [0, 0, 0, yaw], [15, 20, 0, yaw], [30, 40, 0, yaw], [30, 40, 0, yaw],
        ])
    )  # fmt: skip
    assert [vessel.distance(time) for time in times] == pytest.approx([0, 0, 25, 50, 50])
    assert vessel.heading_integral(np.array([30.0]))[0] == pytest.approx([10 + 12, 16])
    assert other.sample(times)[:, :2].tolist() == [[7.0, 7.0]] * 5


def test_an_order_changes_nothing_before_it_holds() -> None:
    """Turned back half way: the way so far stays, what lay ahead of it is gone."""
    fleet = Steered(np.zeros((1, 2)), np.ones(1), 3, lead_s=1.0)
    fleet.go(0.0, np.array([[20.0, 0.0]]))
    before = fleet.vehicles[0].sample(np.linspace(0.0, 10.0, 50))
    fleet.go(10.0, np.array([[10.0, 5.0]]))
    assert (fleet.vehicles[0].sample(np.linspace(0.0, 10.0, 50))[:-1] == before[:-1]).all()
    assert fleet.places(15.0).tolist() == [[10.0, 5.0]]
    assert fleet.places(30.0).tolist() == [[10.0, 5.0]]
    assert fleet.vehicles[0].distance(30.0) == pytest.approx(15.0)


places = st.tuples(*[st.floats(-500.0, 500.0, width=32)] * 2)
orders = st.tuples(st.floats(0.0, 40.0), places)


@settings(max_examples=60, deadline=None)
@given(st.floats(0.05, 15.0), places, st.lists(orders, max_size=12))
def test_no_vessel_exceeds_its_speed(
    speed: float, start: tuple[float, float], told: list[tuple[float, tuple[float, float]]]
) -> None:
    """However it is told about: between any two instants it goes no farther than it can."""
    fleet, time = Steered(np.array([start]), np.array([speed]), len(told), lead_s=1.0), 0.0
    for later, target in told:
        time += later
        fleet.go(time, np.array([target]))
    times = np.sort(np.random.default_rng(0).uniform(0.0, time + 50.0, 400))
    way = fleet.vehicles[0].sample(times)[:, :2]
    steps = np.hypot(*np.diff(way, axis=0).T)
    assert (steps <= speed * np.diff(times) + 1e-9).all()
    travelled = [fleet.vehicles[0].distance(it) for it in times]
    assert (np.diff(travelled) >= steps - 1e-9).all()

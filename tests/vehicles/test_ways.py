"""Ways are worked out once where they are foreseen, and are the same as those of each instant."""

import numpy as np

from bindusbl_des.mission.trajectories import instants
from bindusbl_des.vehicles.fleet import MOST_BYTES, FleetTracksCache
from bindusbl_des.vehicles.motion import together
from bindusbl_des.vehicles.vehicle import recorded

CORNERS = np.array([[0.0, 0.0, 5.0], [10.0, 0.0, 5.0], [10.0, 20.0, 8.0], [0.0, 0.0, 5.0]])
VEHICLE = recorded(np.array([0.0, 10.0, 20.0, 40.0]), CORNERS)
MOTION = together([VEHICLE.legs, VEHICLE.legs])


def test_a_way_is_where_its_vehicle_is() -> None:
    """With the integrals of its heading, and that heading's cosine and sine."""
    times = np.linspace(0.0, 50.0, 101)
    way = FleetTracksCache(MOTION, foreseen=True).of(1, times)
    assert way.truth.tolist() == VEHICLE.sample(times).tolist()
    assert way.lines[:, 4:6].tolist() == VEHICLE.heading_integral(times).tolist()
    yaw = way.lines[:, 3]
    assert np.allclose(
        way.lines[:, 6:], np.column_stack((np.cos(yaw), np.sin(yaw))), rtol=0, atol=1e-15
    )


def test_what_missions_ask_for_again_is_kept() -> None:
    """Of each vehicle by itself, while it is foreseen and there is room; not what may change."""
    often, seldom = instants(50.0, 30.0), instants(50.0, 2.0)
    ways = FleetTracksCache(MOTION, foreseen=True)
    kept = [ways.of(vehicle, times) for vehicle in (0, 1) for times in (often, seldom)]
    again = [ways.of(vehicle, times) for vehicle in (0, 1) for times in (often, seldom)]
    assert all(one is other for one, other in zip(kept, again, strict=True))
    assert len({id(way.lines) for way in kept}) == 4
    late = [ways.of(0, instants(50.0, 30.0, 20.0)) for _ in range(2)]
    assert late[0] is late[1]
    assert np.array_equal(late[0].lines, kept[0].lines[600:])
    own = np.array(often)
    assert ways.of(0, own) is not ways.of(0, own)
    under_way = FleetTracksCache(MOTION, foreseen=False)
    assert under_way.of(0, often) is not under_way.of(0, often)
    many = instants(50.0, MOST_BYTES / 50.0 / 50.0)
    assert ways.of(0, many) is not ways.of(0, many)

"""The survey on Earth: WGS-84 against another implementation, and the turn from NED to ENU."""

import math

import numpy as np
import pytest

from bindusbl_des.core.geometry.geodesy import (
    ecef_from_geodetic,
    enu_covariance,
    enu_from_ned,
    enu_yaw,
    far_apart_m,
    geodetic_from_ned,
    ned_at_depth,
    ned_from_geodetic,
)

# Place, centre, and what pymap3d 3.2.0 has for ned2geodetic(*place, *centre, 0).
PYMAP3D = [
    ((60, -70, 10), (54.33, 10.18), (54.33053902562599, 10.17892398884203, -9.999334489753448)),
    ((10000, 0, 0), (54.33, 10.18), (54.4198375206246, 10.18, 7.839823805987634)),
    (
        (-5000, 8000, 300),
        (-33.85, 151.2),
        (-33.895049257080224, 151.28649212698554, -293.0208825669999),
    ),
    ((120, 40, 10), (78.2, 15.6), (78.20107481458675, 15.601751645255924, -9.998749425615957)),
    ((0, 500, 0), (0, 180), (0.0, -179.9955084235886, 0.01959819905459881)),
    ((70, 70, 6000), (89.0, -45), (89.00062710558853, -44.96403391178666, -5999.99923360599)),
]

# A billionth of a degree is a tenth of a millimetre.
DEGREES, METRES = 1e-11, 1e-6


@pytest.mark.parametrize(("place", "centre", "there"), PYMAP3D)
def test_places_on_earth_are_where_another_implementation_has_them(
    place: tuple[float, ...], centre: tuple[float, float], there: tuple[float, ...]
) -> None:
    """From the tropics to the pole, on the surface and in the deep, there and back."""
    lat, lon, height = geodetic_from_ned(place, *centre)
    assert (lat, lon) == pytest.approx(there[:2], abs=DEGREES)
    assert height == pytest.approx(there[2], abs=METRES)
    assert ned_from_geodetic(*there, *centre) == pytest.approx(place, abs=METRES)


@pytest.mark.parametrize(("place", "centre", "_there"), PYMAP3D)
def test_a_position_at_a_depth_is_where_it_was_seen_from(
    place: tuple[float, ...], centre: tuple[float, float], _there: object
) -> None:
    """Latitude and longitude of a place, and its depth, give it back to the micrometre."""
    lat, lon, _ = geodetic_from_ned(place, *centre)
    found = ned_at_depth([lat, lat], [lon, lon], [place[2], 0.0], centre)
    np.testing.assert_allclose(found[0], place, atol=METRES)
    assert geodetic_from_ned(found[1], *centre)[:2] == pytest.approx((lat, lon), abs=DEGREES)
    assert found[1, 2] == 0.0


def test_positions_are_as_far_apart_as_their_places_in_space() -> None:
    here, there = (54.33, 10.18), (-33.85, 151.2)
    straight = np.linalg.norm(ecef_from_geodetic(*here) - ecef_from_geodetic(*there))
    assert far_apart_m([there[0]], [there[1]], here)[0] == pytest.approx(straight, abs=METRES)


def test_the_earth_has_the_size_of_wgs_84() -> None:
    """Semi-axes, and a point that pymap3d 3.2.0 computed."""
    assert ecef_from_geodetic(0, 0)[0] == 6378137.0
    assert ecef_from_geodetic(-90, 0)[2] == pytest.approx(-6356752.314245, abs=METRES)
    expected = (3668751.099629362, 658790.5003716138, 5158240.34073497)
    assert ecef_from_geodetic(54.33, 10.18, -10) == pytest.approx(expected, abs=METRES)


def test_the_poles_are_ordinary_places() -> None:
    """Height and latitude hold where the parallels shrink to a point."""
    lat, _, height = geodetic_from_ned([0.0, 0.0, 3000.0], 90.0, 0.0)
    assert (lat, height) == pytest.approx((90.0, -3000.0), abs=METRES)


@pytest.mark.parametrize("yaw", np.linspace(-math.pi, math.pi, 25))
def test_a_heading_points_the_same_way_in_both_frames(yaw: float) -> None:
    """The unit vector along a heading in NED is that along its ENU angle; twice is nothing."""
    ahead = enu_from_ned([math.cos(yaw), math.sin(yaw), 0.0])
    turned = enu_yaw(yaw)
    assert ahead == pytest.approx([math.cos(turned), math.sin(turned), 0.0], abs=1e-12)
    assert -math.pi < turned <= math.pi
    assert math.remainder(enu_yaw(turned) - yaw, math.tau) == pytest.approx(0.0, abs=1e-12)


def test_uncertainty_turns_with_the_place() -> None:
    """The covariance of turned samples is the turned covariance."""
    samples = np.random.default_rng(3).normal(size=(50, 3)) @ np.array(
        [[2.0, 0.3, 0.1], [0.0, 1.0, -0.4], [0.0, 0.0, 0.5]]
    )
    turned = np.cov(enu_from_ned(samples).T)
    assert enu_covariance(np.cov(samples.T)) == pytest.approx(turned, abs=1e-12)

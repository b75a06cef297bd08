"""Vehicles under their controllers: do they go where they are told, in currents and in error?"""

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from voyages import drift, voyage, way
from worlds import lanes_over_square, scenario

from bindusbl_des import simulate
from bindusbl_des.core.vehicles.guidance.departure import smallest_turn
from bindusbl_des.core.vehicles.hulls.bluerov2 import share_thrust

Floats = NDArray[np.float64]
LINE = way((0.0, 300.0))
CURRENTS = {  # m/s, over lanes that run along x
    "still": (0.0, 0.0),
    "across": (0.0, 0.2),
    "along": (0.2, 0.0),
    "slanting": (0.2 * math.cos(math.pi / 4), 0.2 * math.sin(math.pi / 4)),
}


def rms(errors: Floats) -> float:
    """Return the root mean square."""
    return float(np.sqrt(np.mean(errors**2)))


def on_lanes(
    guided: Any, times: Floats, longer_than: float, after: float = 0.0
) -> NDArray[np.bool_]:
    """Return when the first vehicle is on a lane, `after` metres into it."""
    interval = np.minimum((times / guided.control_s).astype(int), guided.active.shape[1] - 1)
    row = guided.tracks.rows[guided.active[0][interval]]
    place = guided.vehicle(0).sample(times)
    into = (place[:, 0] - row["x"]) * np.cos(row["yaw"])
    into += (place[:, 1] - row["y"]) * np.sin(row["yaw"])
    lane = (row["curvature"] == 0.0) & (row["length"] > longer_than)
    return np.asarray(lane & (into > after))


def test_a_tour_goes_on_where_it_repeats() -> None:
    """A BlueROV2 that has done its lanes does them again, and is never beside them."""
    tour = scenario(
        duration_s=600.0, survey={"side_m": 30.0}, asvs={"count": 1},
        auvs={"count": 1, "vehicle": "bluerov2", "speed_m_per_s": 0.5},
    )  # fmt: skip
    result = simulate(tour)
    auv, track = result.auvs.iloc[0], result.tables["tracks"].query("vehicle == 'AUV0'")
    assert auv.lanes_flown_share == 1.0
    assert auv.distance_m == pytest.approx(0.5 * 600.0, rel=0.05)
    assert track.path_error_m.max() < 0.25
    half = track[track.time_s > 300.0]
    assert np.ptp(half.x_m) > 20.0 < np.ptp(half.y_m)


# ---------------------------------------------------------------- BlueROV2


@pytest.mark.parametrize(
    ("axis", "most"),
    [
        (0, 4.0 * math.cos(math.radians(45.0))),
        (1, 0.5 * 4.0 * math.cos(math.radians(45.0))),
        (2, 4.0),
        (3, 0.15 * 4.0 * 0.218),
        (4, 0.75 * 4.0 * 0.12),
        (5, 0.5 * 4.0 * 0.1888),
    ],
)
def test_one_axis_alone_gets_what_its_four_thrusters_give(axis: int, most: float) -> None:
    """By their arms (m) and angle, and the share that the axis may have; N or N m per newton."""
    wanted, given = np.zeros(6), np.zeros(6)
    wanted[axis] = 1e4
    share_thrust(wanted, 10.0, given)
    assert given[axis] == pytest.approx(10.0 * most, rel=1e-4)


def test_no_thruster_is_overloaded() -> None:
    """Whatever is wanted, eight thrusters at their places give it with 30.4 N each or less."""
    c, arm = math.sqrt(0.5), 0.18880
    lever = 0.085 * c
    thrusters = np.array([
        [c, c, -c, -c, 0, 0, 0, 0],
        [-c, c, -c, c, 0, 0, 0, 0],
        [0, 0, 0, 0, -1, 1, 1, -1],
        [lever, -lever, lever, -lever, -0.218, -0.218, 0.218, 0.218],
        [lever, lever, -lever, -lever, 0.12, -0.12, 0.12, -0.12],
        [-arm, arm, arm, -arm, 0, 0, 0, 0],
    ])  # fmt: skip
    allocation, given, random = np.linalg.pinv(thrusters), np.zeros(6), np.random.default_rng(1)
    hardest = []
    for _ in range(500):
        wanted = random.normal(size=6) * (80.0, 80.0, 80.0, 10.0, 10.0, 20.0)
        full = share_thrust(wanted, 30.4, given)
        hardest.append(np.abs(allocation @ given).max())
        assert any(full) == bool(np.any(np.abs(given - wanted) > 1e-12))
    assert max(hardest) <= 30.4 * 1.0001
    assert max(hardest) > 30.0  # and nothing is left unused that is wanted


@pytest.mark.parametrize("current", CURRENTS)
@pytest.mark.parametrize(("side", "strips"), [(60, 1), (140, 3)])
def test_bluerov2_flies_its_lanes(side: float, strips: int, current: str) -> None:
    """Lanes 10 m apart: within 5 cm RMS in still water, 20 cm in a current of 0.2 m/s."""
    radius = smallest_turn("bluerov2", 0.6)
    path = lanes_over_square(side, strips, 0, spacing=10, margin=5, radius=radius)
    duration = path.length / 0.6 * 0.98
    guided = voyage(
        "bluerov2", paths=[path], speed_m_per_s=0.6, depth_m=10.0,
        currents=[CURRENTS[current]], duration_s=duration,
    )  # fmt: skip
    times = np.arange(0.0, duration, 0.5)
    errors, lanes = guided.vehicle(0).path_error(times), on_lanes(guided, times, 20.0)
    assert lanes.mean() > 0.5
    assert rms(errors[lanes]) < (0.05 if current == "still" else 0.2)
    assert np.abs(guided.vehicle(0).sample(times)[:, 2] - 10.0).max() < 0.05
    assert (guided.vehicle(0).saturated(duration) == 0.0) == (current == "still")


def test_bluerov2_slows_down_where_its_thrusters_end() -> None:
    """Against 0.2 m/s it makes 0.534 m/s over ground instead of 0.6, as its thrust predicts."""
    guided = voyage(
        "bluerov2", paths=[LINE], speed_m_per_s=0.6, depth_m=5.0, currents=[(-0.2, 0.0)],
        duration_s=300.0,
    )  # fmt: skip
    vehicle = guided.vehicle(0)
    assert vehicle.distance(300.0) - vehicle.distance(299.0) == pytest.approx(0.534, abs=0.001)
    assert vehicle.saturated(300.0) > 0.9
    assert 0.5 < vehicle.distance(300.0) / 300.0 < 0.534


def test_a_share_of_a_mission_does_not_count_what_comes_later() -> None:
    """What happens to an AUV after an instant leaves the share until then as it was."""
    late, early = (
        voyage(
            "bluerov2", paths=[LINE], speed_m_per_s=0.6, depth_m=5.0, duration_s=90.0,
            currents=[(0.0, 0.0)] * 200 + [(-0.3, 0.0)],
        )
        for _ in range(2)
    )  # fmt: skip
    late.advance(90.0)
    early.advance(40.0)
    share = late.vehicle(0).saturated(40.0)
    assert 0.0 < share < 0.9 * late.vehicle(0).saturated(90.0)
    assert share == early.vehicle(0).saturated(40.0)
    assert early.vehicle(0).saturated(90.0) == late.vehicle(0).saturated(90.0)


def test_bluerov2_hovers_at_its_paths_end() -> None:
    """Having arrived it stays there, in a current from abeam."""
    path = way((0.0, 30.0), begin=(1.0, 2.0, 0.5))
    guided = voyage(
        "bluerov2", paths=[path], speed_m_per_s=0.6, depth_m=5.0, currents=[(0.1, 0.2)],
        duration_s=300.0,
    )  # fmt: skip
    assert np.allclose(guided.vehicle(0).at(300.0)[:2], path.end[:2], atol=1e-3)
    assert guided.vehicle(0).path_error(np.array([150.0, 300.0])).max() < 1e-3


# ---------------------------------------------------------------- REMUS


@pytest.mark.parametrize("current", CURRENTS)
@pytest.mark.parametrize("yaw_time_constant", [1.0, 5.0])
def test_remus_flies_its_lanes(yaw_time_constant: float, current: str) -> None:
    """Lanes 80 m apart at 1.5 m/s: within 20 cm RMS, in 0.2 m/s too, turns within 2.5 m."""
    changed = {"yaw_time_constant_s": yaw_time_constant}
    radius = smallest_turn("remus100", 1.5, changed)
    path = lanes_over_square(1000, 1, 0, spacing=80, margin=50, radius=radius)
    duration = path.length / 1.5 * 0.9
    guided = voyage(
        "remus100", changed, paths=[path], speed_m_per_s=1.5, depth_m=10.0,
        currents=[CURRENTS[current]], duration_s=duration,
    )  # fmt: skip
    times = np.arange(0.0, duration, 1.0)
    errors = guided.vehicle(0).path_error(times)
    assert rms(errors[on_lanes(guided, times, 200.0, after=40.0)]) < 0.05
    assert rms(errors[on_lanes(guided, times, 200.0)]) < 0.2
    assert errors.max() < 2.5
    assert np.abs(guided.vehicle(0).sample(times)[:, 2] - 10.0).max() < 0.1


@pytest.mark.parametrize("speed", [0.6, 1.0, 2.0])
@pytest.mark.parametrize("yaw_time_constant", [1.0, 10.0])
def test_remus_turns_at_any_speed(speed: float, yaw_time_constant: float) -> None:
    """Round a circle of its smallest turn it stays within 2 m, slow or fast, in still water."""
    changed = {"yaw_time_constant_s": yaw_time_constant}
    bend = 1.0 / smallest_turn("remus100", speed, changed)
    path = way((0, 50), (-bend, 7 / bend), (0, 200))
    guided = voyage(
        "remus100", changed, paths=[path], speed_m_per_s=speed, depth_m=4.0,
        duration_s=path.length / speed,
    )  # fmt: skip
    errors = guided.vehicle(0).path_error(np.arange(0.0, guided.duration_s, 0.5))
    assert errors.max() < 2.0
    mean = guided.vehicle(0).distance(guided.duration_s) / guided.duration_s
    assert mean == pytest.approx(speed, rel=0.02)


def test_remus_circles_at_its_paths_end() -> None:
    """Since it cannot stop it goes round to starboard, a few metres beside its circle at most."""
    path = way((0, 100))
    guided = voyage("remus100", paths=[path], speed_m_per_s=1.5, depth_m=4.0, duration_s=900.0)
    times = np.arange(100.0, 900.0)
    sea = guided.vehicle(0).sample(times)
    radius = smallest_turn("remus100", 1.5)
    away = np.hypot(sea[:, 0] - 100.0, sea[:, 1] - radius)
    assert np.abs(away - radius).max() < 2.0
    assert sea[-1, 3] > 4 * math.pi  # several times round


def test_turning_radii_follow_from_the_vehicles() -> None:
    """REMUS: 1.3 times its circle (29.9 m at 0.6 m/s, 17.9 m and 2 s at 1.5); BlueROV2: a metre."""
    assert smallest_turn("remus100", 0.6) == pytest.approx(1.3 * 29.9, rel=0.01)
    slow_yaw = smallest_turn("remus100", 1.49, {"yaw_time_constant_s": 2.0})
    assert slow_yaw == pytest.approx(1.3 * 17.9, rel=0.01)
    assert smallest_turn("bluerov2", 0.6) == pytest.approx(1.0, abs=0.05)
    with pytest.raises(ValueError, match="otter keeps a station"):
        smallest_turn("otter", 1.0)
    with pytest.raises(ValueError, match=r"0\.733 m/s"):
        smallest_turn("bluerov2", 0.8)


# ---------------------------------------------------------------- stations


@pytest.mark.parametrize("bearing", range(0, 360, 45))
@pytest.mark.parametrize(("model", "speed"), [("otter", 0.3), ("otter", 0.05), ("cybership2", 0.1)])
def test_asvs_keep_station(model: str, speed: float, bearing: int) -> None:
    """Half a metre RMS with GNSS noise of half a metre, though the current sets in from abeam."""
    angle = math.radians(bearing)
    current = [(0.0, 0.0), (speed * math.cos(angle), speed * math.sin(angle))]
    noise = np.random.default_rng(bearing).normal(scale=0.5, size=(2, 6000, 2))
    guided = voyage(
        model, stations=[(0.0, 0.0), (50.0, -20.0)], currents=current, duration_s=600.0,
        position_noise=noise,
    )  # fmt: skip
    for number in range(2):
        errors = guided.vehicle(number).path_error(np.arange(200.0, 600.0, 0.5))
        assert rms(errors) < 0.5
        assert 0.0 < errors.max() < 1.0
        assert guided.vehicle(number).saturated(600.0) < 0.2


def test_an_otter_does_not_turn_after_noise_in_still_water() -> None:
    """GNSS noise of half a metre leaves it within its watch circle of 2 m."""
    noise = np.random.default_rng(1).normal(scale=0.5, size=(1, 600, 2))
    guided = voyage("otter", stations=[(0.0, 0.0)], duration_s=60.0, position_noise=noise)
    assert {guided.vehicle(0).at(float(time)).yaw for time in range(61)} == {0.0}


def test_an_otter_lies_with_its_bow_against_the_current() -> None:
    """When the current turns by a right angle, the Otter turns after it."""
    currents = np.repeat([[0.0, -0.3], [0.3, 0.0]], 6000, axis=0)
    guided = voyage("otter", stations=[(5.0, 5.0)], currents=currents, duration_s=1200.0)
    before, after = guided.vehicle(0).at(600.0), guided.vehicle(0).at(1200.0)
    assert math.remainder(before.yaw - math.pi / 2, 2 * math.pi) == pytest.approx(0.0, abs=0.02)
    assert math.remainder(after.yaw - math.pi, 2 * math.pi) == pytest.approx(0.0, abs=0.02)
    assert math.hypot(after.x - 5.0, after.y - 5.0) < 0.1


def test_cybership_does_not_lie_with_its_stern_to_the_current() -> None:
    """Begun with a following current, it comes about and ends with its bow against it."""
    guided = voyage(
        "cybership2", stations=[(0.0, 0.0)], currents=[(0.0, 0.0), (0.15, 0.0)], duration_s=600.0
    )
    place = guided.vehicle(0).at(600.0)
    assert math.cos(place.yaw) == pytest.approx(-1.0, abs=0.01)
    assert math.hypot(place.x, place.y) < 0.1


# ---------------------------------------------------------------- time


def guided_fleets() -> list[tuple[str, Any]]:
    """Return a small voyage of each model, noise and changing current included."""
    random = np.random.default_rng(7)
    made = []
    for model in ("bluerov2", "remus100", "otter", "cybership2"):
        currents = 0.05 + 0.02 * np.random.default_rng(3).normal(size=(400, 2))
        noise = random.normal(scale=0.3, size=(2, 400, 2))
        if model in ("otter", "cybership2"):
            plan: dict[str, object] = {"stations": [(0.0, 0.0), (3.0, 4.0)]}
        else:
            bend = way((0, 8), (0.03, 20), (-0.03, 90), begin=(0, 0, 1))
            plan = {"paths": [LINE, bend], "speed_m_per_s": 0.55, "depth_m": (5.0, 7.0)}
        made.append((model, voyage(model, currents=currents, duration_s=40.0,
                                   position_noise=noise, **plan)))  # fmt: skip
    return made


@pytest.mark.parametrize("number", range(4))
def test_looking_changes_nothing(number: int) -> None:
    """Asked at random instants or once at the end, vehicles are in the same places bit for bit."""
    (_, once), (_, often) = guided_fleets()[number], guided_fleets()[number]
    once.advance(40.0)
    instants = np.sort(np.random.default_rng(number).uniform(0.0, 40.0, 60))
    seen = [often.vehicle(1).at(float(instant)) for instant in instants]
    assert np.array_equal(seen, once.vehicle(1).sample(instants))
    often.vehicle(0).at(40.0)
    assert np.array_equal(once.logs, often.logs)
    assert np.array_equal(once.at_limit, often.at_limit)
    times = np.random.default_rng(5).uniform(0.0, 40.0, 50)
    assert np.array_equal(
        once.vehicle(1).sample(times), np.array([often.vehicle(1).at(t) for t in times])
    )


@pytest.mark.parametrize("number", range(4))
def test_sums_of_heading_and_distance(number: int) -> None:
    """Integrals of the heading and distances agree with a fine sum over the track itself."""
    _, guided = guided_fleets()[number]
    vehicle = guided.vehicle(1)
    times = np.linspace(0.0, 40.0, 20001)
    track = vehicle.sample(times)
    middle = (track[1:, 3] + track[:-1, 3]) / 2
    fine = np.cumsum(np.column_stack((np.cos(middle), np.sin(middle))), axis=0) * 0.002
    assert np.abs(vehicle.heading_integral(times[1:]) - fine).max() < 2e-5
    steps = np.hypot(*np.diff(track[:, :2], axis=0).T)
    assert vehicle.distance(40.0) == pytest.approx(steps.sum(), rel=1e-4)
    assert vehicle.distance(0.0) == 0.0


@pytest.mark.parametrize("number", range(2))
def test_half_the_step_leads_to_the_same_place(number: int) -> None:
    """With steps of 0.05 s an AUV is where it is with ten times as many, to a millimetre."""
    model = ("bluerov2", "remus100")[number]
    plan = {"paths": [LINE], "speed_m_per_s": 0.55, "depth_m": 5.0, "duration_s": 40.0}
    coarse = voyage(model, currents=[(0.05, 0.1)], **plan)
    fine = voyage(model, currents=[(0.05, 0.1)], step_s=0.005, **plan)
    times = np.arange(0.0, 40.0, 0.37)
    apart = coarse.vehicle(0).sample(times) - fine.vehicle(0).sample(times)
    assert np.abs(apart).max() < 1e-3


# ---------------------------------------------------------------- belief


def offset(x: float, y: float, duration: float) -> Any:
    """Return the drift of one vehicle that believes to be (x, y) m from where it is."""
    return drift(np.tile([x, y], (1, math.ceil(duration) + 1, 1)))


def believing(model: str, wrong: Any, duration: float = 160.0, path: Any = LINE) -> Any:
    """Return a voyage of one vehicle along a line, along x unless given."""
    speed = 0.6 if model == "bluerov2" else 1.5
    return voyage(
        model, paths=[path], speed_m_per_s=speed, depth_m=5.0, duration_s=duration, drift=wrong
    )


@pytest.mark.parametrize("bearing", [0.0, 1.0])
@pytest.mark.parametrize("model", ["bluerov2", "remus100"])
def test_the_path_flown_is_off_by_what_is_believed(model: str, bearing: float) -> None:
    """Who believes to be 2 m to starboard flies 2 m to port, until a correction tells it so."""
    x, y = -math.sin(bearing), math.cos(bearing)  # starboard
    path = way((0.0, 300.0), begin=(0.0, 0.0, bearing))
    guided = believing(model, offset(2.0 * x, 2.0 * y, 160.0), path=path)
    vehicle = guided.vehicle(0)
    place = vehicle.at(80.0)
    assert place.x * x + place.y * y == pytest.approx(-2.0, abs=0.05)
    guided.corrections[0] = -2.0 * x, -2.0 * y
    place = vehicle.at(160.0)
    assert place.x * x + place.y * y == pytest.approx(0.0, abs=0.05)
    assert vehicle.path_error(np.array([80.0, 160.0])) == pytest.approx([2.0, 0.0], abs=0.05)


@pytest.mark.parametrize("in_body", [True, False])
def test_a_velocity_bias_carries_the_path_away(in_body: bool) -> None:
    """A bias of 5 cm/s to starboard: after 100 s the vehicle flies 5 m to port of its path."""
    wrong = drift(np.zeros((1, 161, 2)), bias=(0.0, 0.05), in_body=in_body)
    vehicle = believing("bluerov2", wrong).vehicle(0)
    assert vehicle.at(100.0).y == pytest.approx(-5.0, abs=0.05)


def test_corrections_count_from_the_next_control_instant() -> None:
    """Two runs with the same corrections between the same control instants agree bit for bit."""
    random = np.random.default_rng(11)
    walk = np.cumsum(random.normal(scale=0.02, size=(1, 401, 2)), axis=1)
    wrong = drift(walk, 10.0, (0.05, -0.02), True)
    runs = []
    for nudges in ((10.04, 20.01), (10.09, 20.07)):
        guided = believing("bluerov2", wrong, 40.0)
        for number, instant in enumerate(nudges):
            guided.vehicle(0).at(instant)
            guided.corrections[0] += (0.3 + number, -0.2)
        guided.advance(40.0)
        runs.append(guided.logs)
    assert np.array_equal(runs[0], runs[1])
    late = believing("bluerov2", wrong, 40.0)
    late.vehicle(0).at(10.11)
    late.corrections[0] += (0.3, -0.2)
    late.advance(20.0)
    assert not np.array_equal(late.logs[0, :400], runs[0][0, :400])


# ---------------------------------------------------------------- what cannot be done


def test_a_speed_above_the_vehicles_own_is_refused() -> None:
    """A BlueROV2 does not make 0.9 m/s, and says so before it starts."""
    with pytest.raises(
        RuntimeError, match=r"AUV2 at 0 s: asked for 0.9 m/s, .* reaches 0\.733"
    ) as e:
        voyage("bluerov2", paths=[LINE], speed_m_per_s=0.9, duration_s=10.0, names=["AUV2"])
    assert (e.value.vehicle, e.value.time_s) == ("AUV2", 0.0)


@pytest.mark.parametrize(
    ("model", "current"),
    [("otter", 3.5), ("cybership2", 0.7), ("remus100", 1.6), ("bluerov2", 0.8)],
)
def test_a_current_that_carries_everyone_away_is_refused(model: str, current: float) -> None:
    """Nobody sets out into a current faster than himself."""
    auv = model in ("remus100", "bluerov2")
    speed = 1.5 if model == "remus100" else 0.6
    plan = {"paths": [LINE], "speed_m_per_s": speed} if auv else {"stations": [(0.0, 0.0)]}
    with pytest.raises(RuntimeError, match="would carry it away"):
        voyage(model, currents=[(0.0, current)], duration_s=10.0, **plan)


def test_a_ship_adrift_is_reported() -> None:
    """CyberShip II is carried off by 0.9 m/s for minutes, and the voyage says who and when."""
    current = np.repeat([[0.0, 0.9], [0.0, -0.9]], 4000, axis=0)
    guided = voyage("cybership2", stations=[(0.0, 0.0)], currents=current, duration_s=900.0,
                    names=["ASV7"])  # fmt: skip
    with pytest.raises(RuntimeError, match=r"ASV7 .* off its station for 120 s") as error:
        guided.advance(900.0)
    assert 120.0 < error.value.time_s < 900.0


def test_an_auv_without_headway_is_reported() -> None:
    """A current that outruns a BlueROV2 for minutes, if not on average, is found out under way."""
    currents = np.repeat([[-0.9, 0.0], [0.9, 0.0]], 6000, axis=0)
    guided = voyage(
        "bluerov2", paths=[LINE], speed_m_per_s=0.6, depth_m=5.0, currents=currents,
        duration_s=1200.0,
    )  # fmt: skip
    with pytest.raises(RuntimeError, match="no headway along its path for 360 s"):
        guided.advance(1200.0)


def test_a_broken_state_is_reported_with_its_instant() -> None:
    """Integrated in steps of half a second a BlueROV2 tumbles or ends in no number, and says so."""
    guided = voyage(
        "bluerov2",
        paths=[LINE],
        speed_m_per_s=0.6,
        duration_s=10.0,
        control_s=1.0,
        step_s=0.5,
        names=["AUV1"],
    )
    with pytest.raises(RuntimeError, match=r"AUV1 at .* s: (its state|pitch)"):
        guided.advance(10.0)


@pytest.mark.parametrize("model", ["bluerov2", "remus100", "remus100_pvs"])
def test_company_changes_no_bit(model: str) -> None:
    """Seven AUVs, which are moved four at a time, go where each of them goes alone."""
    random, currents = np.random.default_rng(5), [(0.1, -0.05), (0.08, -0.02)]
    speeds = random.uniform(0.2, 0.6, 7) + (1.0 if model != "bluerov2" else 0.0)
    paths = [way((0.0, 5.0), (0.03, 90.0), begin=(9.0 * k, k, 0.4 * k)) for k in range(7)]
    plan = {"depth_m": 5.0, "duration_s": 20.0, "currents": currents}
    together = voyage(model, paths=paths, speed_m_per_s=speeds, **plan)
    for instant in (0.35, 7.0, 20.0):
        together.advance(instant)
    for k in range(7):
        alone = voyage(model, paths=paths[k : k + 1], speed_m_per_s=speeds[k], **plan)
        alone.advance(20.0)
        assert np.array_equal(alone.logs[0], together.logs[k])
        assert np.array_equal(alone.at_limit[0], together.at_limit[k])


def test_the_first_in_the_fleet_that_is_lost_is_named() -> None:
    """Whoever else is lost, and when; so it does not matter how many are moved at a time."""

    def fate(speeds: list[float]) -> tuple[str, float, str]:
        rough = voyage(
            "bluerov2", paths=[LINE] * len(speeds), speed_m_per_s=speeds, duration_s=60.0,
            control_s=1.0, step_s=0.5, names=[f"AUV{speed:g}" for speed in speeds],
        )  # fmt: skip
        with pytest.raises(RuntimeError) as error:
            rough.advance(60.0)
        return error.value.vehicle, error.value.time_s, error.value.reason

    early, late = fate([0.6]), fate([0.4])
    assert early[1] < late[1]
    assert fate([0.4, 0.6, 0.6, 0.6, 0.6]) == late
    assert fate([0.6, 0.4]) == early


def test_plans_that_do_not_fit_are_refused() -> None:
    """Wrong plans, steps and shapes are named with what would be right."""
    with pytest.raises(ValueError, match="give paths, and no stations"):
        voyage("otter", paths=[LINE], duration_s=10.0)
    with pytest.raises(ValueError, match="not a whole multiple of step_s"):
        voyage("otter", stations=[(0, 0)], duration_s=10.0, control_s=0.05)
    with pytest.raises(ValueError, match=r"currents has shape \(2,\)"):
        voyage("otter", stations=[(0, 0)], duration_s=10.0, currents=(0.1, 0.1))
    with pytest.raises(ValueError, match=r"position_noise has shape \(1, 3, 2\)"):
        voyage("otter", stations=[(0, 0)], duration_s=10.0, position_noise=np.zeros((1, 3, 2)))
    short = drift(np.zeros((1, 5, 2)))
    with pytest.raises(
        ValueError, match=r"drift.walks has shape \(1, 5, 2\), not \(1, 11 or more, 2\)"
    ):
        voyage("otter", stations=[(0, 0)], duration_s=10.0, drift=short)
    with pytest.raises(ValueError, match="beyond the trajectory of 10"):
        believing("bluerov2", None, 10.0).vehicle(0).at(10.5)


def test_kept_path_errors_are_those_of_the_instants_asked_for() -> None:
    """Read-only instants are known by identity: others, as many, get their own answer."""
    path = way((0.0, 20.0))
    fleet = {"paths": [path], "speed_m_per_s": 0.5, "depth_m": 5.0, "duration_s": 20.0}
    vehicle = voyage("bluerov2", currents=[(0.0, 0.2)], **fleet).vehicle(0)
    early, late = np.array([1.0, 2.0]), np.array([8.0, 9.0])
    expected = [vehicle.path_error(times).tolist() for times in (early, late)]
    early.setflags(write=False)
    late.setflags(write=False)
    assert expected[0] != expected[1]
    for _ in range(2):
        assert [vehicle.path_error(times).tolist() for times in (early, late)] == expected

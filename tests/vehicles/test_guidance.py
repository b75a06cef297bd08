"""Vehicles under their controllers: do they go where they are told, in currents and in error?"""

import math
import time

import numpy as np
import pytest
from numpy.typing import NDArray
from voyages import voyage
from worlds import lanes_over_square

from bindusbl_des.geometry.area import rectangle
from bindusbl_des.geometry.paths import Path, Pose, Segment
from bindusbl_des.geometry.routes import there_and_back
from bindusbl_des.vehicles import logs, motion
from bindusbl_des.vehicles.guidance import otter as autopilot
from bindusbl_des.vehicles.guidance import tracks
from bindusbl_des.vehicles.guidance.bluerov2 import share_thrust
from bindusbl_des.vehicles.guidance.departure import GuidanceError, smallest_turn, top_speed
from bindusbl_des.vehicles.guidance.guided_fleet import GuidedFleet, GuidedVehicle
from bindusbl_des.vehicles.guidance.sensing import Posture, Sensed, SteeringDrift
from bindusbl_des.vehicles.hulls import MODELS, Fleet, otter, parameters
from bindusbl_des.vehicles.motion import Motion, lines
from bindusbl_des.vehicles.reckoning import error, steady
from bindusbl_des.vehicles.vehicle import Vehicle

Floats = NDArray[np.float64]
LINE = Path(Pose(0.0, 0.0, 0.0), (Segment(0.0, 300.0),))
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
    guided: GuidedFleet, times: Floats, longer_than: float, after: float = 0.0
) -> NDArray[np.bool_]:
    """Return when the first vehicle is on a lane, `after` metres into it."""
    interval = np.minimum((times / guided.control_s).astype(int), guided.active.shape[1] - 1)
    row = guided.tracks.rows[guided.active[0][interval]]
    place = guided.vehicle(0).sample(times)
    into = (place[:, 0] - row["x"]) * np.cos(row["yaw"])
    into += (place[:, 1] - row["y"]) * np.sin(row["yaw"])
    lane = (row["curvature"] == 0.0) & (row["length"] > longer_than)
    return np.asarray(lane & (into > after))


# ---------------------------------------------------------------- paths


def locate(path: Path, place: tuple[float, float], start: float = 0.0) -> tuple[float, ...]:
    """Return what a vehicle finds that looks for its place on a path, having begun at `start`."""
    packed, progress = tracks.pack([path]), np.zeros(1, tracks.PROGRESS)[0]
    for along in np.arange(0.0, start, 0.5):
        tracks.locate(packed.rows, packed.bounds[0], progress, *path.at(along)[:2])
    found = tracks.locate(packed.rows, packed.bounds[0], progress, *place)
    return (*found, tracks.travelled(packed.rows, progress))


@pytest.mark.parametrize("bend", [0.0, 0.05, -0.05])
def test_starboard_of_the_path_is_positive(bend: float) -> None:
    """A vehicle 1.5 m to starboard of a line or a circle finds +1.5 m, heading and distance."""
    path = Path(Pose(3.0, -2.0, 0.7), (Segment(bend, 50.0),))
    for along in (0.5, 20.0, 49.0):
        x, y, yaw = path.at(along)
        place = (x - 1.5 * math.sin(yaw), y + 1.5 * math.cos(yaw))
        cross, heading, *direction, curvature, left, travelled = locate(path, place, along)
        assert direction == [math.cos(heading), math.sin(heading)]
        assert cross == pytest.approx(1.5, abs=1e-9)
        assert math.remainder(heading - yaw, 2 * math.pi) == pytest.approx(0.0, abs=1e-9)
        assert (curvature, left) == pytest.approx((bend, 50.0 - along), abs=1e-9)
        assert travelled == pytest.approx(along, abs=1e-9)


def test_a_tour_goes_on_where_it_repeats() -> None:
    """Along three rounds of a tour the distance grows evenly and the vehicle is never beside it."""
    tour = there_and_back(
        lanes_over_square(60, 1, 0, spacing=10, margin=5, radius=1),
        rectangle(60, 60).box,
        1,
        math.radians(20),
    )
    packed, progress = tracks.pack([tour]), np.zeros(1, tracks.PROGRESS)[0]
    for along in np.arange(0.0, 3 * tour.length, 0.06):
        x, y, yaw = tour.at(along)
        cross, heading, _, _, _, left = tracks.locate(packed.rows, packed.bounds[0], progress, x, y)
        assert abs(cross) < 1e-6
        assert abs(math.remainder(heading - yaw, 2 * math.pi)) < 1e-6
        assert left == math.inf
        assert tracks.travelled(packed.rows, progress) == pytest.approx(along, abs=1e-5)


def test_a_neighbouring_lane_is_not_mistaken_for_ones_own() -> None:
    """Carried 9 m sideways, next to the lane 10 m away, a vehicle still knows its own."""
    path = lanes_over_square(60, 1, 0, spacing=10, margin=5, radius=1, start="strip_corner")
    x, y, _ = path.at(25.0)
    cross, *_, travelled = locate(path, (x, y + 9.0), 25.0)
    assert cross == pytest.approx(9.0)
    assert travelled == pytest.approx(25.0)


def test_a_bend_is_seen_ahead() -> None:
    """One metre before an arc the curvature two metres ahead is the arc's."""
    packed = tracks.pack([Path(Pose(0, 0, 0), (Segment(0.0, 10.0), Segment(-0.5, 3.0)))])
    progress = np.array([(0, 9.0, 0.0)], tracks.PROGRESS)[0]
    ahead = [tracks.bend_ahead(packed.rows, packed.bounds[0], progress, m) for m in (0.5, 2.0, 9.0)]
    assert ahead == [0.0, -0.5, 0.0]


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


def test_a_vehicle_rests_where_its_log_ends() -> None:
    """Beyond its voyage a vehicle is where it ended: sound sent last may still be under way."""
    guided = voyage(
        "bluerov2", paths=[LINE], speed_m_per_s=0.6, depth_m=5.0, currents=[(0.0, 0.1)],
        duration_s=20.0,
    )  # fmt: skip
    guided.advance(20.0)
    end, beyond = lines(*guided.motion, 0, np.array([20.0, 500.0]))
    assert end.tolist() == beyond.tolist()
    assert end[:4] == pytest.approx(guided.logs[0, -1, :4], abs=1e-12)


def test_bluerov2_hovers_at_its_paths_end() -> None:
    """Having arrived it stays there, in a current from abeam."""
    path = Path(Pose(1.0, 2.0, 0.5), (Segment(0.0, 30.0),))
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
    path = Path(Pose(0, 0, 0), (Segment(0, 50), Segment(-bend, 7 / bend), Segment(0, 200)))
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
    path = Path(Pose(0, 0, 0), (Segment(0, 100),))
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


def guided_fleets() -> list[tuple[str, GuidedFleet]]:
    """Return a small voyage of each model, noise and changing current included."""
    random = np.random.default_rng(7)
    made = []
    for model in ("bluerov2", "remus100", "otter", "cybership2"):
        currents = 0.05 + 0.02 * np.random.default_rng(3).normal(size=(400, 2))
        noise = random.normal(scale=0.3, size=(2, 400, 2))
        if model in ("otter", "cybership2"):
            plan: dict[str, object] = {"stations": [(0.0, 0.0), (3.0, 4.0)]}
        else:
            bend = Path(Pose(0, 0, 1), (Segment(0, 8), Segment(0.03, 20), Segment(-0.03, 90)))
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


def note(log: Floats, line: int, step: float, moves: tuple[float, ...]) -> None:
    """Write a line of a log: place and rates, and what has summed up to it."""
    log[line, : logs.COS] = moves
    if line > 0:
        x, y, _, yaw, u, v, _, turning = moves
        sums = logs.headings(log, line - 1, step, yaw, turning)
        log[line, logs.COS], log[line, logs.SIN] = sums
        log[line, logs.DISTANCE] = logs.distance(log, line - 1, step, x, y, u, v)


@pytest.mark.parametrize("model", ["bluerov2", "remus100", "otter", "cybership2"])
def test_between_two_lines_of_the_log_lies_the_motion(model: str) -> None:
    """Any instant between two boundaries is within a micrometre of the integrated motion."""
    command, step = {
        "bluerov2": ([30.0, 10.0, 6.0, 0.0, 0.2, 0.5], 0.05),
        "remus100": ([0.26, 0.1, 1200.0], 0.05),
        "otter": ([60.0, -60.0], 0.02),
        "cybership2": ([2.0, 1.0, 1.0], 0.05),
    }[model]
    kind, rest = MODELS[model], np.zeros((1, len(MODELS[model].states)))
    columns = [kind.states.index(name) if name in kind.states else None for name in ("x", "y", "z")]

    def places(fleet: Fleet, times: Floats) -> Floats:
        rows = np.array([fleet.at(t)[0] for t in times])
        flat = np.zeros(len(rows))
        space = [flat if c is None else rows[:, c] for c in columns]
        return np.column_stack((*space, rows[:, kind.heading]))

    lines = np.arange(81) * step
    sea = {"commands": [command], "current_m_per_s": (0.1, -0.2), "step_s": step}
    log = np.zeros((len(lines), logs.COLUMNS))
    table = places(Fleet(model, rest, **sea), lines)  # type: ignore[arg-type]
    tiny = 1e-4
    fine = Fleet(model, rest, **sea)  # type: ignore[arg-type]
    for k, line in enumerate(lines):
        after = places(fine, np.array([line, line + tiny, line + 2 * tiny]))
        rates = (-3 * after[0] + 4 * after[1] - after[2]) / (2 * tiny)
        note(log, k, step, (*table[k], *rates))
    times = np.sort(np.random.default_rng(2).uniform(0.0, lines[-1], 300))
    read = motion.lines(*Motion(log, np.array([0, len(log)]), step), 0, times)
    truth = places(Fleet(model, rest, **sea), times)  # type: ignore[arg-type]
    assert np.abs(read[:, :3] - truth[:, :3]).max() < 1e-6
    assert np.abs(read[:, 3] - truth[:, 3]).max() < 3e-6


def test_headings_sum_up_exactly_on_a_circle() -> None:
    """Half a turn a second round a circle of 1 m: sums within 1e-6 s and metres."""
    rate, step = math.pi, 0.05
    log = np.zeros((21, logs.COLUMNS))
    for line in range(21):
        yaw = rate * line * step
        c, s = math.cos(yaw), math.sin(yaw)
        place, rates = (s, 1.0 - c, 5.0, yaw), (rate * c, rate * s, 0.0, rate)
        note(log, line, step, (*place, *rates))
    circle, instants = Motion(log, np.array([0, 21]), step), np.array([0.31, 1.0])
    for instant, row in zip(instants, motion.lines(*circle, 0, instants), strict=True):
        yaw = rate * instant
        sums = (math.sin(yaw) / rate, (1.0 - math.cos(yaw)) / rate)
        assert row[motion.HEADINGS] == pytest.approx(sums, abs=1e-6)
        assert motion.distance_at(*circle, 0, instant) == pytest.approx(yaw, abs=1e-6)


@pytest.mark.parametrize("number", range(4))
def test_sums_of_heading_and_distance(number: int) -> None:
    """Integrals of the heading and distances agree with a fine sum over the track itself."""
    _, guided = guided_fleets()[number]
    vehicle: Vehicle = guided.vehicle(1)
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


def offset(x: float, y: float, duration: float) -> SteeringDrift:
    """Return the drift of one vehicle that believes to be (x, y) m from where it is."""
    walk = np.tile([x, y], (1, math.ceil(duration) + 1, 1))
    return SteeringDrift(steady(walk, 1.0, (0.0, 0.0), False))


def believing(
    model: str, drift: SteeringDrift | None, duration: float = 160.0, path: Path = LINE
) -> GuidedFleet:
    """Return a voyage of one vehicle along a line, along x unless given."""
    speed = 0.6 if model == "bluerov2" else 1.5
    return voyage(
        model, paths=[path], speed_m_per_s=speed, depth_m=5.0, duration_s=duration, drift=drift
    )


@pytest.mark.parametrize("bearing", [0.0, 1.0])
@pytest.mark.parametrize("model", ["bluerov2", "remus100"])
def test_the_path_flown_is_off_by_what_is_believed(model: str, bearing: float) -> None:
    """Who believes to be 2 m to starboard flies 2 m to port, until a correction tells it so."""
    x, y = -math.sin(bearing), math.cos(bearing)  # starboard
    path = Path(Pose(0.0, 0.0, bearing), LINE.segments)
    guided = believing(model, offset(2.0 * x, 2.0 * y, 160.0), path=path)
    vehicle = guided.vehicle(0)
    place = vehicle.at(80.0)
    assert place.x * x + place.y * y == pytest.approx(-2.0, abs=0.05)
    guided.corrections[0] = -2.0 * x, -2.0 * y
    place = vehicle.at(160.0)
    assert place.x * x + place.y * y == pytest.approx(0.0, abs=0.05)
    assert vehicle.path_error(np.array([80.0, 160.0])) == pytest.approx([2.0, 0.0], abs=0.05)


def test_drift_is_straight_between_samples() -> None:
    """A quarter of the way between two samples a quarter of the step has been walked."""
    walk = np.array([[0.0, 0.0], [1.0, -2.0], [1.0, 6.0]])
    heading, way, bias = (3.0, 4.0), (0.0, 0.0), (0.1, 0.2)
    world = error(0.625, heading, way, steady(walk[None], 2.0, bias, False), 0)
    assert world == pytest.approx((0.0625 + 1.0, 0.125 - 2.0 + 0.25 * 8.0))
    body = error(0.5, heading, way, steady(walk[None], 2.0, bias, True), 0)
    assert body == pytest.approx((0.3 - 0.8 + 1.0, 0.4 + 0.6 - 2.0))


@pytest.mark.parametrize("in_body", [True, False])
def test_a_velocity_bias_carries_the_path_away(in_body: bool) -> None:
    """A bias of 5 cm/s to starboard: after 100 s the vehicle flies 5 m to port of its path."""
    drift = SteeringDrift(steady(np.zeros((1, 161, 2)), 1.0, (0.0, 0.05), in_body))
    vehicle = believing("bluerov2", drift).vehicle(0)
    assert vehicle.at(100.0).y == pytest.approx(-5.0, abs=0.05)


def test_corrections_count_from_the_next_control_instant() -> None:
    """Two runs with the same corrections between the same control instants agree bit for bit."""
    random = np.random.default_rng(11)
    walk = np.cumsum(random.normal(scale=0.02, size=(1, 401, 2)), axis=1)
    drift = SteeringDrift(steady(walk, 10.0, (0.05, -0.02), True))
    runs = []
    for nudges in ((10.04, 20.01), (10.09, 20.07)):
        guided = believing("bluerov2", drift, 40.0)
        for number, instant in enumerate(nudges):
            guided.vehicle(0).at(instant)
            guided.corrections[0] += (0.3 + number, -0.2)
        guided.advance(40.0)
        runs.append(guided.logs)
    assert np.array_equal(runs[0], runs[1])
    late = believing("bluerov2", drift, 40.0)
    late.vehicle(0).at(10.11)
    late.corrections[0] += (0.3, -0.2)
    late.advance(20.0)
    assert not np.array_equal(late.logs[0, :400], runs[0][0, :400])


# ---------------------------------------------------------------- what cannot be done


def test_a_speed_above_the_vehicles_own_is_refused() -> None:
    """A BlueROV2 does not make 0.9 m/s, and says so before it starts."""
    with pytest.raises(
        GuidanceError, match=r"AUV2 at 0 s: asked for 0.9 m/s, .* reaches 0\.733"
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
    with pytest.raises(GuidanceError, match="would carry it away"):
        voyage(model, currents=[(0.0, current)], duration_s=10.0, **plan)


def test_a_ship_adrift_is_reported() -> None:
    """CyberShip II is carried off by 0.9 m/s for minutes, and the voyage says who and when."""
    current = np.repeat([[0.0, 0.9], [0.0, -0.9]], 4000, axis=0)
    guided = voyage("cybership2", stations=[(0.0, 0.0)], currents=current, duration_s=900.0,
                    names=["ASV7"])  # fmt: skip
    with pytest.raises(GuidanceError, match=r"ASV7 .* off its station for 120 s") as error:
        guided.advance(900.0)
    assert 120.0 < error.value.time_s < 900.0


def test_an_auv_without_headway_is_reported() -> None:
    """A current that outruns a BlueROV2 for minutes, if not on average, is found out under way."""
    currents = np.repeat([[-0.9, 0.0], [0.9, 0.0]], 6000, axis=0)
    guided = voyage(
        "bluerov2", paths=[LINE], speed_m_per_s=0.6, depth_m=5.0, currents=currents,
        duration_s=1200.0,
    )  # fmt: skip
    with pytest.raises(GuidanceError, match="no headway along its path for 360 s"):
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
    with pytest.raises(GuidanceError, match=r"AUV1 at .* s: (its state|pitch)"):
        guided.advance(10.0)


@pytest.mark.parametrize("model", ["bluerov2", "remus100", "remus100_pvs"])
def test_company_changes_no_bit(model: str) -> None:
    """Seven AUVs, which are moved four at a time, go where each of them goes alone."""
    random, currents = np.random.default_rng(5), [(0.1, -0.05), (0.08, -0.02)]
    speeds = random.uniform(0.2, 0.6, 7) + (1.0 if model != "bluerov2" else 0.0)
    paths = [Path(Pose(9.0 * k, k, 0.4 * k), (Segment(0.0, 5.0), Segment(0.03, 90.0)))
             for k in range(7)]  # fmt: skip
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
        with pytest.raises(GuidanceError) as error:
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
    drift = SteeringDrift(steady(np.zeros((1, 5, 2)), 1.0, (0.0, 0.0), False))
    with pytest.raises(
        ValueError, match=r"drift.walks has shape \(1, 5, 2\), not \(1, 11 or more, 2\)"
    ):
        voyage("otter", stations=[(0, 0)], duration_s=10.0, drift=drift)
    with pytest.raises(ValueError, match="beyond the trajectory of 10"):
        believing("bluerov2", None, 10.0).vehicle(0).at(10.5)
    assert top_speed("otter") > 2.8


# ---------------------------------------------------------------- cost


@pytest.mark.parametrize(("model", "speed"), [("bluerov2", 0.6), ("remus100", 1.5)])
def test_ten_vehicles_cost_little(model: str, speed: float) -> None:
    """Five minutes of ten vehicles take a small part of a second of one core (measured: 0.07)."""

    def sail() -> float:
        guided = voyage(
            model, paths=[LINE] * 10, speed_m_per_s=speed, depth_m=5.0, duration_s=300.0
        )
        begin = time.process_time()
        guided.advance(300.0)
        assert isinstance(guided.vehicle(9), GuidedVehicle)
        return time.process_time() - begin

    sail()  # compiles
    assert sail() < 1.0


def test_kept_path_errors_are_those_of_the_instants_asked_for() -> None:
    """Read-only instants are known by identity: others, as many, get their own answer."""
    path = Path(Pose(0.0, 0.0, 0.0), (Segment(0.0, 20.0),))
    fleet = {"paths": [path], "speed_m_per_s": 0.5, "depth_m": 5.0, "duration_s": 20.0}
    vehicle = voyage("bluerov2", currents=[(0.0, 0.2)], **fleet).vehicle(0)
    early, late = np.array([1.0, 2.0]), np.array([8.0, 9.0])
    expected = [vehicle.path_error(times).tolist() for times in (early, late)]
    early.setflags(write=False)
    late.setflags(write=False)
    assert expected[0] != expected[1]
    for _ in range(2):
        assert [vehicle.path_error(times).tolist() for times in (early, late)] == expected


@pytest.mark.parametrize(("off", "turning"), [(0.02, 0.0), (0.0, 0.03), (-0.02, 0.01)])
def test_an_otter_turns_by_the_frequency_and_damping_that_are_stated(
    off: float, turning: float
) -> None:
    """Near its heading: the moment of its propellers, less the hull's damping, gives yaw as a
    spring and a damper would: -w^2 yaw - 2 d w r.
    """
    p = MODELS["otter"].pack(parameters("otter", {}))
    memory = np.zeros(1, autopilot.MEMORY)[0]
    memory["begun"], (memory["most_ahead"], memory["most_astern"]) = (
        True, autopilot.greatest_thrust(p),
    )  # fmt: skip
    calm = dict.fromkeys(Posture._fields, 0.0) | {"yaw": off, "turning": turning}
    calm |= {"c_yaw": math.cos(off), "s_yaw": math.sin(off)}
    still = dict.fromkeys(Sensed._fields, 0.0) | {"posture": Posture(**calm)}
    speeds = np.zeros(2)
    autopilot.steer(Sensed(**still), 0.1, p, memory, speeds)
    ahead = np.where(speeds > 0.0, p[otter.AHEAD], -p[otter.ASTERN])
    port, starboard = ahead * speeds**2
    moment = p[otter.LEVER] * (port - starboard)
    frequency, damping = autopilot.YAW_FREQUENCY, autopilot.YAW_DAMPING
    wanted = -(frequency**2) * off - 2.0 * damping * frequency * turning
    assert p[otter.I33] * (moment - p[otter.NR] * turning) == pytest.approx(wanted, rel=1e-9)

"""Missions whose vehicles an outside program moves: the same sound, the same fixes."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import simpy
from worlds import merged, scenario

from bindusbl_des import Mission, Result, Scenario, load_result, simulate

SOUND = 1500.0  # m/s
BOTH = ("auvs", "asvs")


def exact(**changes: Any) -> Scenario:
    """Return a mission of 40 s on the exact clock in which something of everything happens."""
    return scenario(**merged(
        {
            "duration_s": 40.0, "survey": {"side_m": 80.0}, "auvs": {"count": 4},
            "acoustics": {"mf": {"range_m": 70.0}, "loss": {"combine": "clamp_first"}},
            "protocol": {"tick_rate_hz": None},
        },
        changes,
    ))  # fmt: skip


class Replay:
    """A program that moves vehicles as a mission without it does."""

    def __init__(self, mission: Scenario, seed: int, kinds: tuple[str, ...] = BOTH) -> None:
        # somewhat longer, since sound of the last instant is still under way
        longer = mission.model_copy(update={"duration_s": mission.duration_s + 10.0})
        self.mission, self.kinds, self.time = Mission(longer, seed), kinds, -1.0

    def advance_to(self, time: float) -> Mapping[str, Any]:
        assert time > self.time
        self.time = time
        self.mission.advance(time)
        poses = {"auvs": self.mission.auvs().truth, "asvs": self.mission.asvs()}
        return {kind: poses[kind] for kind in self.kinds}


def same(one: Result, other: Result) -> bool:
    assert set(one.arrow) == set(other.arrow)
    return all(one.arrow[name].equals(other.arrow[name]) for name in one.arrow)


def apart(one: Any, other: Any, *columns: str) -> float:
    """Return the largest difference of two tables, which lack values in the same places."""
    ours, theirs = one[[*columns]].to_numpy(float), other[[*columns]].to_numpy(float)
    assert np.array_equal(np.isnan(ours), np.isnan(theirs))
    return float(np.nanmax(np.abs(ours - theirs)))


@pytest.mark.parametrize("kinds", [("auvs",), ("asvs",), BOTH])
@pytest.mark.parametrize(
    "protocol",
    [
        {},
        {"tick_rate_hz": 30.0, "downlink": "pipelined_round"},
        {"downlink": "direct_reply"},
        {"ranging": "twtt", "downlink": "pipelined_group"},
        {"ranging": "twtt", "downlink": "direct_reply"},
        {"ranging": "passive"},
    ],
    ids=lambda it: "_".join(map(str, it.values())),
)
def test_a_mission_replayed_is_the_mission(
    protocol: dict[str, Any], kinds: tuple[str, ...]
) -> None:
    """Poses each 0.1 s of AUVs that turn at 5 m: places within 0.06 mm, and all that follows."""
    mission = exact(protocol=protocol)
    plain = simulate(mission, 3).tables
    posed = Mission(mission, 3, poses=Replay(mission, 3, kinds)).result().tables
    assert (plain["fixes"].outcome == "delivered").sum() > 20
    for name in ("rounds", "pings", "receptions", "broadcasts", "fixes", "tracks"):
        assert len(posed[name]) == len(plain[name])
    assert (posed["receptions"].outcome == plain["receptions"].outcome).all()
    assert (posed["fixes"].outcome == plain["fixes"].outcome).all()
    assert apart(posed["receptions"], plain["receptions"], "arrived_at_s", "travel_time_s") < 1e-7
    assert apart(posed["fixes"], plain["fixes"], "delivered_at_s", "latency_s") < 2e-7
    assert apart(posed["fixes"], plain["fixes"], "x_m", "y_m", "innovation_m") < 2e-3
    assert apart(posed["tracks"], plain["tracks"], "x_m", "y_m", "z_m") < 6e-5
    metrics = ["fixes_delivered", "position_error_m", "imu_error_m", "distance_m", "latency_p95_s"]
    assert apart(posed["auvs"], plain["auvs"], *metrics) < 1e-3


class Circling:
    """Vehicles that circle at 2 m/s, and faster and faster aside: nobody foresees them."""

    def __init__(self, auvs: int, asvs: int) -> None:
        self.counts = {"auvs": auvs, "asvs": asvs}

    def pose(self, kind: str, number: int, time: float) -> tuple[float, float, float, float]:
        radius, turn = (8.0, 2.0 / 8.0) if kind == "auvs" else (15.0, -2.0 / 15.0)
        angle, depth = turn * time + 2.1 * number, 10.0 if kind == "auvs" else 0.0
        x, y = radius * np.cos(angle), radius * np.sin(angle) + 10.0 * number
        return x, y, depth, angle + np.pi / 2 * np.sign(turn)

    def advance_to(self, time: float) -> Mapping[str, Any]:
        return {
            kind: [self.pose(kind, number, time) for number in range(count)]
            for kind, count in self.counts.items()
        }


def number(names: Any) -> Any:
    return names.str.slice(3).astype(int)


@pytest.mark.parametrize("ranging", ["owtt_sync", "twtt"])
@pytest.mark.parametrize("downlink", ["sequential", "direct_reply"])
def test_sound_meets_vehicles_where_they_are_when_it_arrives(ranging: str, downlink: str) -> None:
    """Each way between two moving vehicles is as long as sound needed for it."""
    mission = exact(protocol={"ranging": ranging, "downlink": downlink})
    source = Circling(4, mission.asvs.count)
    tables = Mission(mission, 1, poses=source, pose_step_s=0.02).result().tables

    def distance(kinds: tuple[str, str], numbers: Any, times: Any) -> np.ndarray:
        ends = [
            [source.pose(kind, n, t)[:3] for n, t in zip(own, at, strict=True)]
            for kind, own, at in zip(kinds, numbers, times, strict=True)
        ]
        return np.asarray(np.linalg.norm(np.subtract(*ends), axis=1))

    found = tables["receptions"].merge(tables["pings"][["ping", "sent_at_s"]], on="ping")
    found = found[~found.arrived_at_s.isna() & (found.outcome != "in_flight")]
    ways = distance(
        ("auvs", "asvs"), (number(found.auv), number(found.asv)),
        (found.sent_at_s, found.arrived_at_s),
    )  # fmt: skip
    assert len(found) > 100
    assert (found.arrived_at_s - found.sent_at_s).to_numpy() == pytest.approx(
        ways / SOUND, abs=2e-8
    )
    assert found.slant_range_m.to_numpy() == pytest.approx(ways, abs=3e-5)

    fixes = tables["fixes"][tables["fixes"].outcome == "delivered"]
    frames = tables["broadcasts"].set_index("sent_at_s").airtime_s
    ends = (
        fixes.broadcast_at_s + frames[~frames.index.duplicated()].loc[fixes.broadcast_at_s].values
    )
    ways = distance(
        ("auvs", "asvs"), (number(fixes.auv), number(fixes.broadcast_by)),
        (fixes.delivered_at_s, ends),
    )  # fmt: skip
    assert len(fixes) > 30
    assert (fixes.delivered_at_s - ends).to_numpy() == pytest.approx(ways / SOUND, abs=2e-8)


@pytest.mark.parametrize("ranging", ["owtt_sync", "twtt"])
@pytest.mark.parametrize("downlink", ["sequential", "direct_reply"])
def test_stopping_and_looking_change_nothing(ranging: str, downlink: str) -> None:
    """Whenever one looks, the program is asked for the same instants, and tables are the same."""
    mission = exact(protocol={"ranging": ranging, "downlink": downlink})
    held = Mission(mission, 2, poses=Circling(4, mission.asvs.count))
    for instant in np.random.default_rng(5).uniform(0.0, 40.0, 60).cumsum() / 50:
        if instant < 40.0:
            held.advance(instant)
            assert held.auvs().truth.shape == (4, 4)
            assert held.asvs().shape == (3, 4)
            held.pings_under_way()
            held.broadcast_on_air()
    assert same(held.result(), Mission(mission, 2, poses=Circling(4, 3)).result())


def test_the_program_is_asked_no_further_than_a_step_ahead() -> None:
    """Who stops at an instant has the program at the next sample, but for a frame nearly there."""
    mission = exact()
    source = Replay(mission, 1)
    held = Mission(mission, 1, poses=source)
    for instant in np.arange(0.0, 40.0, 0.73):
        held.advance(instant)
        assert source.time <= instant + 0.1 + 0.02 * 80.0 / SOUND
    held.result()
    assert source.time == pytest.approx(40.0, abs=1e-9)


def test_results_say_that_an_outside_program_moved_vehicles(tmp_path: Path) -> None:
    """Scenario and seed alone do not give the mission again, so results and their folder say so."""
    mission = exact(duration_s=5.0)
    result = Mission(mission, 1, poses=Replay(mission, 1, ("asvs",)), pose_step_s=0.25).result()
    result.write(tmp_path / "out")
    for told in (result.warnings, load_result(tmp_path / "out").warnings):
        [warning] = [it for it in told if "outside program" in it.message]
        assert warning.key == "asvs.vehicle"
        assert "test_posed_missions:Replay, gave the poses each 0.25 s" in warning.message
    assert not any("outside program" in it.message for it in simulate(mission, 1).warnings)


def test_what_cannot_be_used_ends_the_mission_where_it_was() -> None:
    """A pose that is no number is told with its instant, and the mission cannot go on."""

    class Failing(Replay):
        def advance_to(self, time: float) -> Mapping[str, Any]:
            poses = super().advance_to(time)
            poses["auvs"][1, 0] = np.nan if time > 3.0 else 0.0
            return poses

    held = Mission(exact(), 1, poses=Failing(exact(), 1))
    held.advance(2.5)
    with pytest.raises(ValueError, match=r"answer at 3\.1 s has AUV1 at x = nan"):
        held.advance(10.0)
    assert 2.5 < held.time < 4.0
    with pytest.raises(RuntimeError, match="the mission has ended with an error"):
        held.advance(20.0)


@pytest.mark.parametrize(
    ("poses", "told"),
    [
        (np.full((4, 4), 1j), r"must have one row .* for each of the 4 AUVs"),
        ([["1", "2", "3", "4"]] * 4, r"must have one row .* for each of the 4 AUVs"),
        (np.full((4, 4), 1e300), r"has AUV0 at x = 1e\+300; places must be within 1e\+06 m"),
        ([[0, 0, 5, 0]] * 3 + [[0, 0, -12, 0]], r"has AUV3 at z = -12; .* z is down: positive"),
    ],
)
def test_poses_are_real_numbers_near_the_survey(poses: Any, told: str) -> None:
    """Texts and complex numbers are no poses, and nobody is in another solar system."""

    class Odd:
        def advance_to(self, time: float) -> Mapping[str, Any]:
            return {"auvs": poses}

    with pytest.raises(ValueError, match=told):
        Mission(Scenario(name="odd", auvs={"count": 4}), 1, poses=Odd())


def test_a_class_moves_nobody() -> None:
    with pytest.raises(ValueError, match=r"is a class; .* an object of it: poses=Replay\(...\)$"):
        Mission(exact(), 1, poses=Replay)  # type: ignore[arg-type]


class Steering(Circling):
    """AUVs as masses that are pulled to the middle by where they were last told to be."""

    def __init__(self, auvs: int, asvs: int) -> None:
        super().__init__(auvs, asvs)
        self.told = np.array([self.pose("auvs", n, 0.0)[:2] for n in range(auvs)])
        self.places, self.speeds, self.time = self.told.copy(), np.zeros((auvs, 2)), 0.0

    def advance_to(self, time: float) -> Mapping[str, Any]:
        step = time - self.time
        self.speeds = self.speeds * (1.0 - 0.1 * step) - 0.02 * step * self.told
        self.places, self.time = self.places + step * self.speeds, time
        poses = [(x, y, 10.0, 0.0) for x, y in self.places]
        return {"auvs": poses, "asvs": super().advance_to(time)["asvs"]}

    def steer(self, mission: Mission) -> Iterator[simpy.Event]:
        """Take in each fix at the instant at which it is delivered."""
        watch = mission._world.network.happenings("delivery")
        while True:
            happening = yield watch.next()  # type: ignore[misc]
            fix = happening.row
            self.told[fix.auv] = fix.x_m, fix.y_m


@pytest.mark.parametrize("ranging", ["owtt_sync", "twtt"])
@pytest.mark.parametrize("downlink", ["sequential", "direct_reply"])
def test_who_waits_changes_nothing_of_a_program_that_steers_by_fixes(
    ranging: str, downlink: str
) -> None:
    """Whoever else waits and looks, each sample has had the same fixes before it."""
    mission = exact(protocol={"ranging": ranging, "downlink": downlink})

    def flown(watched: bool) -> tuple[Result, list[Any]]:
        source = Steering(4, mission.asvs.count)
        held = Mission(mission, 1, poses=source)
        held.env.process(source.steer(held))
        told: list[Any] = []
        if watched:
            for happening in held.happenings("ping", "arrival", "reception", "delivery"):
                told.append(happening)
                held.auvs()
        return held.result(), told

    (alone, _), (watched, told) = flown(watched=False), flown(watched=True)
    assert same(alone, watched)
    receptions = alone.tables["receptions"]
    found = {(it.row.ping, it.row.asv): it.row for it in told if it.kind == "reception"}
    assert len(found) > 50
    for row in receptions[receptions.outcome.isin(["heard", "lost", "collided"])].itertuples():
        foretold = found.get((row.ping, int(row.asv[3:])))
        assert foretold is None or foretold.outcome == row.outcome
        assert foretold is None or foretold.arrived_at_s == row.arrived_at_s
    delivered = (alone.tables["fixes"].outcome == "delivered").sum()
    assert delivered == sum(it.kind == "delivery" for it in told) > 20
    assert alone.auvs.distance_m.min() > 5.0


def test_sound_meets_auvs_where_they_are_when_it_arrives() -> None:
    """An outside program moves all vehicles: each way is as long as sound needed for it."""
    mission = exact(protocol={"ranging": "passive"})
    source = Circling(4, mission.asvs.count)
    tables = Mission(mission, 1, poses=source, pose_step_s=0.02).result().tables
    found = tables["receptions"].merge(tables["pings"][["ping", "sent_at_s"]], on="ping")
    found = found[found.outcome != "in_flight"]
    ends = [
        [source.pose(kind, n, t)[:3] for n, t in zip(number(found[kind[:3]]), at, strict=True)]
        for kind, at in (("auvs", found.arrived_at_s), ("asvs", found.sent_at_s))
    ]
    ways = np.linalg.norm(np.subtract(*ends), axis=1)
    assert len(found) > 100
    took = (found.arrived_at_s - found.sent_at_s).to_numpy()
    assert took == pytest.approx(ways / SOUND, abs=2e-8)
    assert found.slant_range_m.to_numpy() == pytest.approx(ways, abs=3e-5)

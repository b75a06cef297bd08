"""Vessels that sail: polars, ways to windward, tacks, station keeping, and what is refused."""

import math
from pathlib import Path

import numpy as np
import pytest
import yaml

from bindusbl_des import Scenario, ScenarioError, load_scenario, simulate
from bindusbl_des.core.vehicles import motion, sailing, wind

STEP = 0.1


def rig(name: str = "dinghy", keeping: str = "figure_of_eight", **changes: float) -> sailing.Rig:
    """Return a rig without leeway, unless it is among the changes."""
    plain = {"leeway": 0.0, "turn": 0.5, "keeping": sailing.KEEPING[keeping]}
    settings = Scenario.model_validate(scenario_of(polar=name)).asvs.vehicle.sailing
    return sailing.rig_of(**settings.model_dump())._replace(**(plain | changes))


def flown(
    craft: sailing.Rig,
    station: tuple[float, float],
    lasts: float,
    air: tuple[float, float] = (-5.0, 0.0),
    current: tuple[float, float] = (0.0, 0.0),
    start: tuple[float, float, float, float] = (0.0, 0.0, math.pi / 2, 0.0),
) -> np.ndarray:
    """Return x, y, z, yaw of one vessel every 0.1 s; the wind blows from North unless given."""
    count = round(lasts / STEP)
    fields = [np.tile(value, (count, 1)) for value in (air, current)]
    moved = sailing.sailed(craft, np.array([station]), np.array([start]), *fields, STEP)
    return motion.lines(*moved, 0, np.arange(count + 1) * STEP)[:, :4]


def test_a_dinghy_makes_the_apparent_wind_that_drives_it() -> None:
    """At each angle off the true wind the speed is 0.4 of the apparent wind by its factor."""
    polar = wind.polar_of("dinghy", 10.0)
    for off in (60, 90, 120, 150, 180):
        blows = np.array((-4.0, 0.0))
        bow = np.array((math.cos(math.radians(off)), math.sin(math.radians(off))))
        speed = sailing.polar_speed(polar.winds, polar.speeds, 9.0, 4.0, math.radians(off))
        apparent = blows - speed * bow
        angle = math.degrees(math.acos(-apparent @ bow / np.linalg.norm(apparent)))
        factor = np.interp(angle, *wind.DINGHY)
        assert speed == pytest.approx(0.4 * factor * np.linalg.norm(apparent), rel=1e-3), off


@pytest.mark.parametrize("name", ["dinghy", "swarm"])
def test_it_beats_to_windward_as_fast_as_the_polar_allows(name: str) -> None:
    """300 m to windward at the best VMG of the polar, to 1 %, whatever wind there is."""
    for strength in (3.0, 6.0):
        craft = rig(name, within=5.0, tack_keeps=1.0, recovers=0.01, turn=100.0)
        off = np.radians(wind.DEGREES)
        best = max(
            sailing.polar_speed(craft.winds, craft.speeds, 1.5, strength, angle) * math.cos(angle)
            for angle in off
        )
        ways = flown(craft, (300.0, 0.0), 1.05 * 300.0 / best, (-strength, 0.0))
        arrives = np.flatnonzero(ways[:, 0] > 290.0)[0] * STEP
        assert arrives == pytest.approx(290.0 / best, rel=0.01)


def test_a_tack_costs_speed_and_time() -> None:
    """With a share of 0.2 left, back within 5 % after 3 s, a tack loses 0.8 s of way."""
    kept, lost = (
        flown(rig(tack_keeps=share, turn=100.0), (200.0, 0.0), 150.0) for share in (1.0, 0.2)
    )
    speeds = np.hypot(*np.diff(lost[:, :2], axis=0).T) / STEP
    tack = np.flatnonzero(np.diff(np.sign(np.sin(lost[:, 3]))))[0]
    settled = speeds[tack - 20]
    assert speeds[tack + 1] < 0.4 * settled
    assert speeds[tack + 40] > 0.94 * settled
    passed = [np.hypot(*np.diff(ways[: tack + 60, :2], axis=0).T).sum() for ways in (kept, lost)]
    assert passed[0] - passed[1] == pytest.approx(0.8 * settled, rel=0.15)


def test_no_way_is_gained_inside_the_no_go_zone() -> None:
    """Head to wind and without way on a vessel stays where it is, until it has turned out of it."""
    ways = flown(rig(turn=math.radians(10.0)), (100.0, 0.0), 20.0, start=(0.0, 0.0, 0.0, 0.0))
    inside = np.abs(ways[:, 3]) < math.radians(40.0)
    out = np.flatnonzero(~inside)[0]
    assert out > 50  # 40 deg at half of 10 deg/s
    assert np.abs(ways[:out, :2]).max() < 1e-9
    assert ways[-1, 0] > 0.5


@pytest.mark.parametrize("keeping", sorted(sailing.KEEPING))
@pytest.mark.parametrize("current", [(0.0, 0.0), (0.0, 0.3), (-0.3, 0.0)])
def test_it_keeps_station_in_a_current(keeping: str, current: tuple[float, float]) -> None:
    """In 5 m/s of wind and up to 0.3 m/s of current all ways stay within twice the radius."""
    ways = flown(rig(keeping=keeping, leeway=0.08), (0.0, 0.0), 600.0, current=current)
    far = np.hypot(*ways[:, :2].T)
    assert np.mean(far < 10.0) > 0.6
    assert far.max() < 20.0


def test_a_current_carries_all_of_it() -> None:
    """Seen from the water, wind and current together are wind alone (Galileo)."""
    still = flown(rig(), (0.0, 60.0), 30.0)
    moved = flown(rig(), (0.0, 60.0), 30.0, air=(-5.3, 0.4), current=(-0.3, 0.4))
    drift = np.outer(np.arange(len(still)) * STEP, (-0.3, 0.4))
    assert np.allclose(moved[:20, :2] - drift[:20], still[:20, :2], atol=0.3)
    leg = still[100:150, :2] - still[100, :2]
    assert np.hypot(*leg[-1]) / 4.9 == pytest.approx(
        sailing.polar_speed(rig().winds, rig().speeds, 1.5, 5.0, math.pi / 2), rel=0.02
    )


WIND = {"speed_m_per_s": 6.0, "gust_sd_m_per_s": 1.0, "veer_sd_deg": 10.0}


def scenario_of(**vessel: object) -> dict:
    """Return a scenario with vessels that sail."""
    return {
        "name": "sail",
        "duration_s": 60.0,
        "asvs": {"vehicle": {"model": "sailboat", **vessel}},
        "environment": {"wind": dict(WIND)},
    }


def test_a_mission_is_flown_by_vessels_that_sail() -> None:
    """Stations are kept within the radius, headings are the bow's, gusts differ by seed."""
    result = simulate(Scenario.model_validate(scenario_of(within_m=8.0)), seed=1)
    tracks = result.tables["tracks"]
    vessels = tracks[tracks["vehicle"].str.startswith("ASV")]
    stations = np.array(result.setup.stations_m)
    for number, (x, y) in enumerate(stations):
        own = vessels[vessels["vehicle"] == f"ASV{number}"]
        away = np.hypot(own["x_m"] - x, own["y_m"] - y)
        assert 1.0 < away.max() < 12.0
    again = simulate(Scenario.model_validate(scenario_of(within_m=8.0)), seed=1).tables["tracks"]
    other = simulate(Scenario.model_validate(scenario_of(within_m=8.0)), seed=2).tables["tracks"]
    assert tracks.equals(again)
    assert not tracks.equals(other)
    assert len(result.tables["fixes"]) > 20


def test_wind_and_polar_come_from_files(tmp_path: Path) -> None:
    """The wind turns on the short way between samples; a polar of one's own drives the hull."""
    (tmp_path / "wind.csv").write_text("time_s,speed_m_per_s,from_deg\n0,4,350\n60,4,10\n")
    samples = wind.read_wind(tmp_path / "wind.csv")
    speed, origin = wind.mean_wind(0.0, 0.0, samples, np.array([0.0, 30.0]))
    assert np.degrees(origin) == pytest.approx([-10.0, 0.0])
    assert speed == pytest.approx([4.0, 4.0 * math.cos(math.radians(10.0))])
    rows = ["angle_deg,wind_m_per_s,speed_m_per_s"]
    rows += [f"{a},{w},{0.25 * w}" for a in (0, 180) for w in (2, 8)]
    (tmp_path / "own.csv").write_text("\n".join(rows) + "\n")
    data = scenario_of(polar="own.csv")
    data["environment"]["wind"] = {"file": "wind.csv"}
    (tmp_path / "own.yaml").write_text(yaml.safe_dump(data))
    result = simulate(load_scenario(tmp_path / "own.yaml"), seed=1)
    tracks = result.tables["tracks"]
    own = tracks[tracks["vehicle"] == "ASV0"]
    speeds = np.hypot(own["x_m"].diff(), own["y_m"].diff()) / own["time_s"].diff()
    assert 0.9 < speeds.max() <= 1.01
    result.write(tmp_path / "out")
    assert [path.name[:4] for path in (tmp_path / "out" / "winds").iterdir()] == ["wind"]
    assert [path.name[:3] for path in (tmp_path / "out" / "polars").iterdir()] == ["own"]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"asvs": {"vehicle": "sailboat"}}, "sailboat has no wind; set environment.wind"),
        ({"asvs": {"vehicle": {"model": "sailboat", "no_go": 3}}}, "no_go"),
        (
            {"asvs": {"vehicle": {"model": "sailboat", "polar": "none.csv"}}},
            "no such file",
        ),
        (
            {"asvs": {"vehicle": {"model": "sailboat"}, "formation": {"model": "follow"}}},
            "keeps a station",
        ),
        ({"environment": {"wind": {"file": "bad.csv"}}}, "bad.csv:3: speed_m_per_s must be a"),
        ({"environment": {"wind": {"file": "few.csv"}}}, "lacks from_deg"),
        ({"environment": {"wind": {"file": "back.csv"}}}, "sort the rows by time"),
    ],
)
def test_mistakes_are_told_in_a_line(change: dict, message: str, tmp_path: Path) -> None:
    """Of file, line, key and remedy."""
    head = "time_s,speed_m_per_s,from_deg\n"
    (tmp_path / "bad.csv").write_text(head + "0,4,0\n10,-1,0\n")
    (tmp_path / "few.csv").write_text("time_s,speed_m_per_s\n0,4\n")
    (tmp_path / "back.csv").write_text(head + "20,4,0\n10,4,0\n0,4,0\n")
    if "environment" in change:
        change = {"asvs": {"vehicle": "sailboat"}, **change}
    (tmp_path / "x.yaml").write_text(yaml.safe_dump({"name": "x", "duration_s": 20.0, **change}))
    with pytest.raises(ScenarioError, match=message):
        load_scenario(tmp_path / "x.yaml")


def test_groups_of_vessels_sail_beside_others() -> None:
    """One moored, one motored, one under sail: each where it would be in a fleet of its own."""
    groups = [{"count": 1}, {"count": 1, "vehicle": "otter"}, {"count": 1, "vehicle": "sailboat"}]
    data = scenario_of()
    data["asvs"] = {"groups": groups}
    data["environment"]["current_m_per_s"] = 0.1
    tracks = simulate(Scenario.model_validate(data), seed=3).tables["tracks"]
    moved = {
        vessel: float(np.hypot(own["x_m"].diff(), own["y_m"].diff()).sum())
        for vessel, own in tracks.groupby("vehicle")
    }
    assert moved["ASV0"] == 0.0
    assert moved["ASV2"] > 30.0 > moved["ASV1"] > 0.01

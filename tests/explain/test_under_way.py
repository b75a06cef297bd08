"""Where vessels that move were going, and what is said where they keep no stations."""

from pathlib import Path

import numpy as np
import pytest
from commands_for_tests import call

from bindusbl_des import Result, Scenario, Setup, simulate
from bindusbl_des.acoustics.channel import between
from bindusbl_des.explain import chain_of_ping
from bindusbl_des.explain.hearing import on_its_way
from bindusbl_des.export.chart_files import drawn
from bindusbl_des.figures.coverage import without_stations


@pytest.fixture(scope="module")
def repeated(tmp_path_factory: pytest.TempPathFactory) -> Result:
    """Return a mission in which ASV0 goes 40 m north, 20 m east, and rests; it hears nobody."""
    file = tmp_path_factory.mktemp("tracks") / "asv.csv"
    file.write_text("time_s,x_m,y_m,depth_m\n0,-500,0,0\n20,-460,0,0\n30,-460,20,0\n60,-460,20,0\n")
    asvs = {"count": 1, "formation": {"model": "track", "files": [str(file)]}}
    place = {"origin": {"lat_deg": 54.0, "lon_deg": 10.0}}
    return simulate(Scenario(name="m", duration_s=60.0, asvs=asvs, environment=place), 1)


@pytest.mark.parametrize(
    ("time", "told"),
    [
        (0.0, "; ASV0 was on its way to x -460, y 0 m at 2 m/s"),
        (19.9, "; ASV0 was on its way to x -460, y 0 m at 2 m/s"),
        (20.1, "; ASV0 was on its way to x -460, y 20 m at 2 m/s"),
        (31.0, ""),
        (59.9, ""),
    ],
)
def test_the_track_tells_where_a_vessel_was_going(repeated: Result, time: float, told: str) -> None:
    assert on_its_way(repeated, "ASV0", time) == told


def test_a_ping_that_nobody_hears_tells_who_was_on_its_way(repeated: Result) -> None:
    met = repeated.tables["receptions"]
    ping = int(met[(met.arrived_at_s > 5.0) & (met.outcome == "out_of_range")].ping.iloc[0])
    told = "\n".join(step.why for step in chain_of_ping(repeated, ping).steps)
    assert "ASV0 was on its way to x -460, y 0 m" in told
    still = simulate(Scenario(name="m", duration_s=10.0, asvs={"count": 2}), 1)
    assert on_its_way(still, "ASV0", 3.0) == ""


def test_charts_show_the_way_of_a_vessel(repeated: Result) -> None:
    kinds = [(shape.kind, shape.name) for shape in drawn(repeated) if "ASV" in shape.name]
    assert kinds == [("Point", "ASV0"), ("LineString", "ASV0 (way)")]


def test_no_coverage_where_there_are_no_stations(repeated: Result, tmp_path: Path) -> None:
    assert "keep no stations" in without_stations(repeated)
    file = tmp_path / "m.yaml"
    file.write_text("name: m\nasvs: {formation: {model: follow}}\n")
    refused = call("coverage", file)
    assert refused.exit_code == 2
    assert "with follow ASVs move and keep no stations; use ring or positions" in refused.stderr


def test_a_loss_is_that_from_the_depth_of_the_ping() -> None:
    """Two AUVs over a flat bottom, 3 m and 30 m deep: each ping's loss is what the channel has for
    its own place, echoes and all.
    """
    channel = {"model": "sonar", "bottom_m": 40.0, "snr_threshold_db": 55.0}
    world = Scenario(
        name="m",
        duration_s=40.0,
        survey={"side_m": 200.0, "depths_m": [3.0, 30.0]},
        auvs={"count": 2},
        asvs={"count": 1, "formation": {"positions_m": [(0.0, 0.0)]}},
        acoustics={"hf": {"range_m": 200.0, "channel": channel}},
    )
    result, asked = simulate(world, 1), Setup(world).ping_channel
    assert asked is not None
    losses: dict[str, list[float]] = {"AUV0": [], "AUV1": []}
    for ping in result.tables["pings"].itertuples():
        auv, asv = np.array([[ping.x_m, ping.y_m, ping.z_m]]), np.zeros((1, 3))
        true = asked.prospects(between(0.0, auv, asv, 200.0, calling=False))["loss"][0, 0]
        told = [it.facts for it in chain_of_ping(result, ping.ping).steps if it.who == "ASV0"]
        [found] = [it["loss_probability"] for it in told if "loss_probability" in it]
        assert found == pytest.approx(true, abs=1e-6)
        losses[ping.auv].append(found)
    assert min(map(len, losses.values())) > 10
    assert max(losses["AUV0"]) > 0.05

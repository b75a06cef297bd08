"""Where vessels that move were going, and what is said where they keep no stations."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from commands_for_tests import call
from explain_for_tests import chain_of_ping

from bindusbl_des import Result, Scenario, Setup, simulate
from bindusbl_des.core.acoustics.channel import between


@pytest.fixture(scope="module")
def repeated(tmp_path_factory: pytest.TempPathFactory) -> Result:
    """Return a mission in which ASV0 goes 40 m north, 20 m east, and rests; it hears nobody."""
    file = tmp_path_factory.mktemp("tracks") / "asv.csv"
    file.write_text("time_s,x_m,y_m,depth_m\n0,-500,0,0\n20,-460,0,0\n30,-460,20,0\n60,-460,20,0\n")
    asvs = {"count": 1, "formation": {"model": "track", "files": [str(file)]}}
    place = {"origin": {"lat_deg": 54.0, "lon_deg": 10.0}}
    return simulate(Scenario(name="m", duration_s=60.0, asvs=asvs, environment=place), 1)


def test_a_ping_that_nobody_hears_tells_who_was_on_its_way(repeated: Result) -> None:
    """As the way was when the ping came by: east from 20 s on, and at rest from 30 s on."""
    met = repeated.tables["receptions"].query("outcome == 'out_of_range'")
    told = set()
    for ping, time in zip(met.ping, met.arrived_at_s, strict=True):
        why = "\n".join(step.why for step in chain_of_ping(repeated, int(ping)).steps)
        bound = re.findall(r"; ASV0 was on its way to x -460, y (\d+) m at 2 m/s", why)
        assert bound == ([] if time > 30.0 else ["0" if time < 20.0 else "20"])
        told.update(bound)
    assert told == {"0", "20"}
    still = simulate(Scenario(name="m", duration_s=10.0, asvs={"count": 2}), 1)
    assert "on its way" not in chain_of_ping(still, 0).text()


def test_charts_show_the_way_of_a_vessel(repeated: Result, tmp_path: Path) -> None:
    folder, chart = repeated.write(tmp_path / "run"), tmp_path / "chart.geojson"
    assert call("export", folder, "--to", "geojson", "--out", chart).exit_code == 0
    shapes = json.loads(chart.read_text())["features"]
    kinds = [(it["geometry"]["type"], it["properties"]["name"]) for it in shapes]
    found = [it for it in kinds if "ASV" in it[1]]
    assert found == [("Point", "ASV0"), ("LineString", "ASV0 (way)")]


def test_no_coverage_where_there_are_no_stations(repeated: Result, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="keep no stations"):
        repeated.plot("coverage")
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

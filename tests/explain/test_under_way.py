"""Where vessels that move were going, and what is said where they keep no stations."""

from pathlib import Path

import pytest
from click.testing import CliRunner

from bindusbl_des import Result, Scenario, simulate
from bindusbl_des.cli import main
from bindusbl_des.explain import chain_of_ping
from bindusbl_des.explain.overlapping import on_its_way
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
    refused = CliRunner().invoke(main, ["coverage", str(file)])
    assert refused.exit_code == 2
    assert "with follow ASVs move and keep no stations; use ring or positions" in refused.stderr

"""Commands where a scenario has no vessels, and places ashore: one line of each that is wrong."""

from pathlib import Path

import pytest
from commands_for_tests import call as told

ALONE = """
name: alone
duration_s: 20
survey: {side_m: 60}
environment: {origin: {lat_deg: -36.8, lon_deg: 174.9}}
auvs: {count: 1}
asvs: {count: 0}
"""


@pytest.fixture(autouse=True)
def _alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("alone.yaml").write_text(ALONE)


def test_coverage_and_verdict_say_nothing_of_what_there_is_not() -> None:
    covered, verified = told("coverage", "alone.yaml"), told("verify", "alone.yaml")
    assert covered.exit_code == verified.exit_code == 0, covered.output + verified.output
    assert "wasted" not in verified.stdout
    assert "wasted" in told("verify", "alone.yaml", "--set", "asvs.count=1").stdout


@pytest.mark.parametrize(
    ("output", "is_silent"),
    [("nmea:file:n", True), ("nmea/AUV0:file:n", False), ("json:file:n", False)],
)
def test_telegrams_of_vessels_that_there_are_none_of(output: str, is_silent: bool) -> None:
    found = told("live", "alone.yaml", "--speed", "max", "--to", output)
    assert found.exit_code == 0
    assert ("asvs.count is 0, and nmea tells of ASVs alone" in found.stderr) == is_silent


def test_a_launch_ashore_is_one_mistake() -> None:
    land = (
        "survey={polygon_m: [[-50,-50],[50,-50],[50,50],[-50,50]], "
        "land: [[[-10,-10],[10,-10],[10,10],[-10,10]]]}"
    )
    found = told("validate", "alone.yaml", "--set", land, "--set", "auvs.launch_m=[[0,0]]")
    assert "auvs.launch_m: AUV0 at (0, 0) m is on land, 10 m from open water" in found.stdout
    assert "leads over land" not in found.stdout
    assert "1 mistake" in found.stderr

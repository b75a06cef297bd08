"""What cannot be surveyed is told alike by each command, in a line, and nothing is left behind."""

import json
from pathlib import Path
from typing import Any

import pytest
from commands_for_tests import call

SQUARE = [[-50, -50], [50, -50], [50, 50], [-50, 50]]
WAYS = [[[0, 0], [40, 40]], [[0, 0], [40, 0]], [[0, 0], [0, 40]]]
GRID = [f"EPSG:99999 {east} {north}" for east, north in ((0, 0), (900, 0), (0, 900))]
ISLAND = {"polygon_m": SQUARE, "land": [[[10, 10], [20, 10], [20, 20], [10, 20]]]}
CROSSED = [[[0, 0], [10, 10], [10, 0], [0, 10]]]

# Sections of a scenario, and the key and words of the first mistake
BAD: list[tuple[dict[str, Any], str]] = [
    ({"survey": {"polygon_m": SQUARE, "land": [[[2 * x for x in place] for place in SQUARE]]}},
     "survey.land: land, and water where nobody goes, cover all of it; is their place right?"),
    ({"survey": {"polygon_m": SQUARE, "keep_out": CROSSED}},
     "survey.keep_out.0: crosses or touches itself at (5, 5); give its corners going round"),
    ({"survey": ISLAND, "auvs": {"route": {"kind": "waypoints", "points_m": WAYS}}},
     "auvs.route.points_m.0: the way of AUV0 leads over land, or where nobody goes, for 14.14 m"),
    ({"survey": ISLAND, "asvs": {"count": 1, "formation": {"positions_m": [[15, 12]]}}},
     "asvs.formation.positions_m.0: ASV0 at (15, 12) m is on land, 2 m from open water; move it"),
    ({"auvs": {"groups": [{"count": 0}]}}, "auvs.groups.0.count: must be >= 1; got 0"),
    ({"asvs": {"groups": [{"count": 0}]}}, "asvs.groups.0.count: must be >= 1; got 0"),
    ({"survey": {"polygon_deg": GRID}},
     "survey.polygon_deg.0: EPSG:99999 is no code of a coordinate system; write such as EPSG:3"),
    ({"survey": {"area": "bay.shp"}}, "bay.shp: needs bay.shx beside it: a shapefile is several"),
]  # fmt: skip


@pytest.mark.parametrize(("sections", "told"), BAD, ids=[told[:25] for _, told in BAD])
def test_a_bay_that_cannot_be_is_told_by_each_command(
    sections: dict[str, Any], told: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if "shp" in told:
        pytest.importorskip("pyogrio")
    if "EPSG" in told:
        pytest.importorskip("pyproj")
    monkeypatch.chdir(tmp_path)
    Path("bay.shp").write_bytes(b"x")
    lines = [f"{name}: {json.dumps(section)}" for name, section in sections.items()]
    Path("bad.yaml").write_text("\n".join(["name: bad", "duration_s: 20", *lines, ""]))
    before = sorted(tmp_path.rglob("*"))
    said = []
    for words in (
        ("validate", "bad.yaml"), ("run", "bad.yaml"), ("run", "bad.yaml", "--out", "made"),
        ("plan", "bad.yaml", "--below", "position_error_m=3"), ("coverage", "bad.yaml"),
    ):  # fmt: skip
        found = call(*words)
        assert found.exit_code == 2, words
        line = next(line for line in found.output.splitlines() if told in line)
        assert line.startswith("bad.yaml:3:") or line.startswith("bad.yaml:4:"), line
        assert "Traceback" not in found.output
        said.append(line)
    assert len(set(said)) == 1
    assert sorted(tmp_path.rglob("*")) == before


def test_a_place_of_an_option_is_told_at_the_option(tmp_path: Path) -> None:
    """And not at the land beside it, which is in the file."""
    (tmp_path / "bay.yaml").write_text(json.dumps({"name": "bay", "survey": ISLAND}))
    option = "asvs.formation={positions_m: [[15, 12]]}"
    found = call("validate", str(tmp_path / "bay.yaml"), "--set", option)
    assert f"--set {option}: asvs.formation.positions_m.0: ASV0 at (15, 12) m" in found.output

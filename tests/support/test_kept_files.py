"""Files that a scenario names, kept beside what came of them, by their contents."""

from pathlib import Path
from typing import Any

import pytest
import yaml
from commands_for_tests import call

from bindusbl_des import Scenario, load_scenario, simulate, sweep

AREA = """{"type": "Polygon", "coordinates":
[[[10.15, 54.40], [10.153, 54.40], [10.153, 54.402], [10.15, 54.402], [10.15, 54.40]]]}"""


@pytest.fixture
def named(tmp_path: Path) -> dict[str, Any]:
    """Write files of several kinds; return a mission that names them."""
    (tmp_path / "Kiel fjord.geojson").write_text(AREA)
    (tmp_path / "cast.csv").write_text("depth_m,sound_speed_m_per_s\n0,1480\n40,1490\n")
    (tmp_path / "way.csv").write_text("time_s,x_m,y_m,depth_m\n0,0,0,5\n100,50,0,5\n")
    return {
        "name": "kept", "duration_s": 4.0,
        "survey": {"area": str(tmp_path / "Kiel fjord.geojson")},
        "environment": {"ctd": str(tmp_path / "cast.csv")},
        "auvs": {"count": 2, "route": {"kind": "track", "files": [str(tmp_path / "way.csv")] * 2}},
    }  # fmt: skip


def files_in(folder: Path) -> set[str]:
    """Return the copies in a folder of results."""
    return {
        it.relative_to(folder).as_posix()
        for it in folder.rglob("*-*.*")
        if it.suffix in (".csv", ".geojson") and it.parent != folder
    }


def test_a_copy_is_named_by_folder_contents_and_ending(
    tmp_path: Path, named: dict[str, Any]
) -> None:
    """Each file once; the folder's own scenario has the same names again, and another content
    another one.
    """
    scenario = Scenario.model_validate(named)
    kept = files_in(simulate(scenario).write(tmp_path / "a"))
    assert len(kept) == 3
    [area] = [it for it in kept if it.endswith(".geojson")]
    assert Path(area).name.startswith("Kiel_fjord-")
    again = simulate(load_scenario(tmp_path / "a" / "scenario.yaml")).write(tmp_path / "b")
    assert files_in(again) == kept
    (tmp_path / "Kiel fjord.geojson").write_text(AREA + "\n")
    other = files_in(simulate(Scenario.model_validate(named)).write(tmp_path / "c"))
    assert len(kept & other) == 2


@pytest.mark.usefixtures("in_this_process")
def test_a_copy_that_was_changed_is_told(tmp_path: Path, named: dict[str, Any]) -> None:
    """A campaign does not go on with another file than it began with."""
    (tmp_path / "m.yaml").write_text(yaml.safe_dump(named))
    folder = tmp_path / "c"
    sweep(tmp_path / "m.yaml", folder, vary={"auvs.count": [2]}, workers=1)
    for file in (folder / "missions").iterdir():
        file.unlink()
    [cast] = [it for it in files_in(folder) if "cast" in it]
    (folder / cast).write_text("depth_m,sound_speed_m_per_s\n0,1500\n40,1490\n")
    told = call("resume", folder, "--workers", 1)
    assert told.exit_code != 0
    assert "has been changed since; put the file back" in told.output


@pytest.mark.parametrize("vary", ["environment.ctd", "environment"])
@pytest.mark.usefixtures("in_this_process")
def test_points_of_campaigns_name_files_on_every_level(
    tmp_path: Path, named: dict[str, Any], vary: str
) -> None:
    (tmp_path / "m.yaml").write_text(yaml.safe_dump(named))
    path = str(tmp_path / "cast.csv")
    value = path if vary == "environment.ctd" else {"ctd": path}
    campaign = sweep(tmp_path / "m.yaml", tmp_path / "c", vary={vary: [value]}, workers=1)
    assert campaign.state().done == 1
    [cast] = [it for it in files_in(tmp_path / "c") if "cast" in it]
    assert (tmp_path / "c" / cast).read_text() == (tmp_path / "cast.csv").read_text()
    assert path not in (tmp_path / "c" / "campaign.json").read_text()

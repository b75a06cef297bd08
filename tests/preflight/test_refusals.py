"""What a mission refuses as it is put together, `validate` has told before."""

from pathlib import Path

import pytest
from commands_for_tests import call

from bindusbl_des import Mission, Scenario

# What no mission can begin with, and of which key that is told
REFUSED = {
    "auvs: {vehicle: bluerov2, speed_m_per_s: 3}": "auvs.speed_m_per_s",
    "auvs: {vehicle: bluerov2, count: 2, speeds_m_per_s: [0.4, 3]}": "auvs.speeds_m_per_s",
    "auvs: {vehicle: bluerov2, speed_m_per_s: 0.4}\nenvironment: {current_m_per_s: 0.8}":
        "environment.current_m_per_s",
    "auvs: {vehicle: remus100, speed_m_per_s: 1.5}\nsurvey: {side_m: 400}\n"
    "environment: {current_m_per_s: 1.6}": "environment.current_m_per_s",
    "asvs: {vehicle: cybership2}\nenvironment: {current_m_per_s: 3}":
        "environment.current_m_per_s",
    "auvs: {vehicle: remus100, speed_m_per_s: 1.5}\nsurvey: {side_m: 40}": "auvs.vehicle",
    "auvs: {speed_m_per_s: 0.001, route: {kind: waypoints, surface_every_s: 30, "
    "points_m: [[[0, 0], [99, 0]], [[0, 5], [9000, 5]], [[0, 9], [50, 9]]]}}":
        "auvs.route.surface_every_s",
}  # fmt: skip
OWN = """
import numpy as np

def nowhere(view):
    return [[(0, 0)]]

def still(way):
    return np.zeros((3, 2))

def across(view):
    return [[(0, 0), (9, 0)]] * len(view.auvs)

def nobody(view):
    return [[99]]
"""


@pytest.fixture(autouse=True)
def in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Work where nothing is."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)


@pytest.mark.parametrize("asked", REFUSED, ids=range(len(REFUSED)))
def test_what_run_refuses_at_its_beginning_validate_tells(asked: str) -> None:
    """At its place; `run` and `sweep` say the same before anything is begun."""
    Path("m.yaml").write_text(f"name: m\nduration_s: 20\n{asked}\n")
    told = call("validate", "m.yaml")
    assert (told.exit_code, told.stderr) == (2, "1 mistake\n")
    place, key, _ = told.stdout.split(": ", 2)
    assert (place.startswith("m.yaml:"), key) == (True, REFUSED[asked])
    for words in (("run", "m.yaml"), ("sweep", "m.yaml", "--vary", "asvs.count=1,2")):
        refused = call(*words, "--out", "o")
        assert (refused.exit_code, told.stdout.strip() in refused.stderr) == (2, True)
    assert not Path("o").exists()


def test_a_current_that_only_some_seeds_draw_is_warned_of() -> None:
    """Of the others there are missions; a steady current so strong has none."""
    text = "name: m\nduration_s: 600\nasvs: {vehicle: cybership2}\nenvironment: "
    Path("m.yaml").write_text(f"{text}{{current_m_per_s: 0.5, current_variation_m_per_s: 0.2}}\n")
    warned = call("validate", "m.yaml")
    assert (warned.exit_code, warned.stderr) == (0, "1 warning\n")
    assert "environment.current_variation_m_per_s: is too much for ASV0 for" in warned.stdout
    Path("m.yaml").write_text(f"{text}{{current_m_per_s: 0.5}}\n")
    assert call("validate", "m.yaml").stdout == "m.yaml: ok\n"


def test_points_of_a_sweep_are_asked_the_same() -> None:
    """Before its first mission, at the value that is too much."""
    Path("m.yaml").write_text("name: m\nduration_s: 20\nauvs: {vehicle: bluerov2, count: 1}\n")
    vary = ("--vary", "auvs.speed_m_per_s=0.4,0.9")
    told = call("sweep", "m.yaml", *vary, "--out", "o")
    assert told.exit_code == 2
    assert "a speed of 0.9 m/s is not between 0 and the 0.733 m/s" in told.stderr
    assert not Path("o").exists()


@pytest.mark.parametrize(
    "part",
    [
        *("auvs.route.kind=own:nowhere", "auvs.vehicle=own:still", "asvs.vehicle=own:still"),
        "protocol.schedule=own:nobody",
    ],
)
def test_parts_of_ones_own_are_asked_where_they_may_be(part: str) -> None:
    """With --allow-plugins; a file of somebody else's is still only read without."""
    Path("own.py").write_text(OWN)
    Path("m.yaml").write_text("name: m\nduration_s: 20\nauvs: {count: 2}\n")
    told = call("validate", "m.yaml", "--allow-plugins", "--set", part)
    assert told.exit_code == 2, told.stdout
    assert " returned " in told.stdout
    assert call("validate", "m.yaml", "--set", part).exit_code == 0


def test_hulls_on_ways_of_ones_own_are_asked_too() -> None:
    """A speed that the hull does not reach is told as of any other route."""
    Path("own.py").write_text(OWN)
    Path("m.yaml").write_text(
        "name: m\nduration_s: 20\nauvs: {count: 2, vehicle: bluerov2, speed_m_per_s: 3}\n"
    )
    told = call("validate", "m.yaml", "--allow-plugins", "--set", "auvs.route.kind=own:across")
    assert (told.exit_code, "does not" in told.stdout or "not between" in told.stdout) == (2, True)


def test_what_is_said_beforehand_is_what_a_mission_says() -> None:
    """In Python, where nobody validates, the mission says it itself."""
    asked = {"vehicle": "bluerov2", "speed_m_per_s": 3}
    with pytest.raises(ValueError, match=r"a speed of 3\.0 m/s is not between 0 and the 0\.733"):
        Mission(Scenario.model_validate({"name": "m", "auvs": asked}))

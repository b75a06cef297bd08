"""The package is typed (`py.typed`): scripts written as its manual does pass strict checks."""

import subprocess
import sys
from pathlib import Path

import pytest

from bindusbl_des import Scenario
from bindusbl_des.core.scenario.scenario import GivenKeys

SCRIPT = """
import pandas as pd

from bindusbl_des import Mission, Result, Scenario, View, simulate, sweep


def in_turn(view: View, *, most: int = 1) -> list[list[int]]:
    return [[auv] for auv in range(min(most, len(view.auvs)))]


poor = Scenario(name="poor", duration_s=20, auvs={"count": 2}, protocol={"schedule": in_turn})
result: Result = simulate(poor, seed=1)
fixes: pd.DataFrame = result.tables["fixes"]
means = sweep(poor, vary={"auvs.count": [1, 2]}, seeds=2).missions.groupby("auvs.count").mean()
mission = Mission(poor, seed=0)
for happening in mission.happenings("delivery", auv=0):
    print(happening.time, mission.auvs().truth[0])
"""


def test_editors_know_every_key() -> None:
    """What a checker is told of `Scenario(...)` names all keys, in their order."""
    assert list(GivenKeys.__annotations__) == list(Scenario.model_fields)


@pytest.mark.slow
def test_a_users_script_is_strictly_typed(tmp_path: Path) -> None:
    pytest.importorskip("mypy")
    (tmp_path / "script.py").write_text(SCRIPT)
    cache = f"--cache-dir={tmp_path / 'cache'}"
    words = [sys.executable, "-m", "mypy", "--strict", cache, "script.py"]
    told = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert told.returncode == 0, told.stdout

"""Recipes of the manual: navigators by other libraries, as methods of the benchmark."""

import re
import sys
from pathlib import Path

import pandas as pd
import pytest
from commands_for_tests import call

PAGE = (Path(__file__).parents[2] / "docs" / "benchmark.md").read_text()
FILES = dict(re.findall(r'```python title="(\w+)\.py"\n(.*?)```', PAGE, re.DOTALL))
LIBRARIES = {"ukf": "filterpy", "tracker": "stonesoup", "graph": "gtsam"}


def test_recipes_are_files_of_fifty_lines() -> None:
    """One for each library."""
    assert set(FILES) == set(LIBRARIES)
    assert {name for name, text in FILES.items() if text.count("\n") > 50} == set()


@pytest.mark.parametrize(("name", "library"), LIBRARIES.items())
def test_a_recipe_errs_as_the_filter_that_knows_as_much(
    name: str, library: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Within a tenth of `replay_late`, and as sure of it."""
    pytest.importorskip(library, reason=f"the recipe is for {library}")
    (tmp_path / f"{name}.py").write_text(FILES[name])
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, name, raising=False)
    method = re.search(r"class (\w+)", FILES[name])
    assert method is not None
    asked = f"{name}:{method[1]}", "replay_late", "--task", "near", "--seeds", "2"
    ended = call("benchmark", *asked, "--allow-plugins", "--out", "scores")
    assert ended.exit_code == 0, ended.output
    table = pd.read_csv("scores/scores.csv").set_index(["method", "metric"])["mean"]
    own, other = (table[of] for of in (asked[0], "replay_late"))
    assert own["worst_error_m"] == pytest.approx(other["worst_error_m"], rel=0.1)
    assert own["nees"] == pytest.approx(other["nees"], rel=0.25)

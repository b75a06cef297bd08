"""What a result, a scenario and a campaign show of themselves in Python and in notebooks."""

from pathlib import Path

import pytest
from worlds import scenario

from bindusbl_des import Result, simulate, sweep
from bindusbl_des.report.run_page import run_page


@pytest.fixture(scope="module")
def result() -> Result:
    return simulate(scenario(name="<b>&", duration_s=5.0), 1)


def test_a_result_makes_its_report(result: Result, tmp_path: Path) -> None:
    """It is the page of `run`, and written where it is wanted."""
    text = result.report(tmp_path / "page.html")
    assert text == run_page(result) == (tmp_path / "page.html").read_text(encoding="utf-8")


@pytest.mark.parametrize("kind", ["trajectory", "latency"])
def test_a_result_draws_itself(result: Result, tmp_path: Path, kind: str) -> None:
    """As `plot` does; the ending chooses the format."""
    figure = result.plot(kind, tmp_path / "f.svg", width=3.5)
    assert figure.get_size_inches()[0] == pytest.approx(3.5)
    assert (tmp_path / "f.svg").read_text().startswith("<?xml")


def test_a_figure_that_cannot_be_drawn_is_told(result: Result) -> None:
    """The nearest name, or the tables that are missing."""
    with pytest.raises(ValueError, match=r"no figure 'trajectry' of a run; did you mean"):
        result.plot("trajectry")
    bare = simulate(scenario(duration_s=5.0, record={"detail": "summary"}))
    with pytest.raises(ValueError, match="needs the tables tracks"):
        bare.plot("trajectory")


def test_notebooks_show_what_is_held_and_run_nothing(result: Result, tmp_path: Path) -> None:
    """One line each, and a name from a file stays text."""
    assert repr(result) == "<Result of <b>&, seed 1: 3 AUVs, 3 ASVs, 5 s>"
    assert repr(result.scenario) == "<Scenario <b>&: 3 AUVs, 3 ASVs, 140 m, 5 s>"
    (tmp_path / "m.yaml").write_text("name: <b>&\nduration_s: 5\n")
    given = {"asvs.count": [1, 2]}
    campaign = sweep(tmp_path / "m.yaml", tmp_path / "c", vary=given, seeds=2, workers=1)
    assert repr(campaign).startswith("<Campaign <b>&: 2 points x 2 seeds, in ")
    for shown in (result, result.scenario, campaign):
        assert "&lt;b&gt;&amp;" in shown._repr_html_()
        assert "<b>" not in shown._repr_html_()

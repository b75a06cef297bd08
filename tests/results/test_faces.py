"""What a result, a scenario and a campaign show of themselves in Python and in notebooks."""

import copy
import pickle
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from worlds import scenario

import bindusbl_des
from bindusbl_des import Mission, Result, Scenario, load_campaign, load_result, simulate, sweep

pytestmark = pytest.mark.usefixtures("in_this_process")


@pytest.fixture(scope="module")
def result() -> Result:
    return simulate(scenario(name="<b>&", duration_s=5.0), 1)


def test_a_result_makes_its_report(result: Result, tmp_path: Path) -> None:
    """It is the page of `run`, and written where it is wanted."""
    text = result.report(tmp_path / "page.html")
    assert text == result.report() == (tmp_path / "page.html").read_text(encoding="utf-8")


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
    with pytest.raises(
        ValueError, match=r"f.gif: a figure is a file that ends in .png, .svg, .pdf"
    ):
        result.plot("trajectory", "f.gif")
    with pytest.raises(ValueError, match=r"round has no option 'nmber'; did you mean 'number'"):
        result.plot("round", nmber=3)
    rounds = len(result.tables["rounds"])
    with pytest.raises(ValueError, match=f"last needs a round, 0 to {rounds - 1}; got {rounds}"):
        result.plot("timeline", last=rounds)
    with pytest.raises(ValueError, match="first=3 comes after last=2"):
        result.plot("timeline", first=3, last=2)
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
    assert repr(Mission(result.scenario, 1)) == "<Mission <b>&, seed 1: 0 of 5 s>"
    assert repr(campaign).startswith("<Campaign <b>&: 2 points x 2 seeds, in ")
    for shown in (result, result.scenario, campaign):
        assert "&lt;b&gt;&amp;" in shown._repr_html_()
        assert "<b>" not in shown._repr_html_()
    assert "<pre>duration_s: 5</pre>" in result.scenario._repr_html_()
    assert "every key has its default" in Scenario(name="m")._repr_html_()
    assert "Smallest error of the worst AUV" in campaign._repr_html_()


def test_notebooks_show_figures(result: Result) -> None:
    """Whether or not pyplot has been imported, which teaches them what a figure is."""
    assert result.plot("trajectory", width=3.5)._repr_png_().startswith(b"\x89PNG")


def test_a_path_stands_for_its_scenario(tmp_path: Path) -> None:
    """As text and as path; anything else is told in one line."""
    (tmp_path / "m.yaml").write_text("name: m\nduration_s: 5\n")
    whole = simulate(scenario(name="m", duration_s=5.0), 1)
    for path in (tmp_path / "m.yaml", str(tmp_path / "m.yaml")):
        assert simulate(path, 1).auvs.equals(whole.auvs)
        assert Mission(path, 1).result().auvs.equals(whole.auvs)
    assert repr(Mission("quickstart")).startswith("<Mission quickstart, seed 0: 0 of ")
    with pytest.raises(TypeError, match="needs a Scenario or the path of a scenario file; got 3"):
        simulate(3)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="got keys and values; use Scenario"):
        simulate({"name": "m"})  # type: ignore[arg-type]


def test_a_path_gives_no_leave_to_run_code(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What a file names is loaded with leave only, as by `load_scenario`."""
    (tmp_path / "faces_part.py").write_text("def one(view): return [[auv] for auv in range(3)]\n")
    monkeypatch.syspath_prepend(tmp_path)
    path = tmp_path / "m.yaml"
    path.write_text("name: m\nduration_s: 5\nprotocol: {schedule: 'faces_part:one'}\n")
    with pytest.raises(ValueError, match="'faces_part:one' is a plug-in"):
        simulate(path)
    assert simulate(path, allow_plugins=True).mission.rounds[0] > 1


@pytest.mark.parametrize(
    ("keys", "told"),
    [
        ({"asv": {"count": 2}}, "asv\n  unknown key; did you mean 'asvs'?"),
        ({"asvs": {"cuont": 2}}, "asvs.cuont\n  unknown key; did you mean 'count'?"),
        ({"asvs": {"count": -1}}, "asvs.count\n  must be >= 0 and <= 10000; got -1"),
        ({"asvs": 3}, "asvs\n  needs keys and values (count, vehicle, failures, ...); got 3"),
        ({"auvs": {"route": {"kind": "hodl"}}}, "auvs.route.kind\n  must be one of lawnmower"),
        ({"acoustics": {"loss": {"law": "papr"}}}, "the text 'papr'; did you mean 'paper'?"),
    ],
)
def test_mistakes_in_python_are_told_in_the_words_of_the_file(
    keys: dict[str, object], told: str
) -> None:
    for make in (
        lambda: Scenario(name="m", **keys),
        lambda: Scenario.model_validate({"name": "m", **keys}),
    ):
        with pytest.raises(ValueError, match=re.escape(told)):
            make()


def test_names_of_python_are_told_with_those_that_were_meant(result: Result) -> None:
    with pytest.raises(KeyError, match="no table 'fixs'; did you mean 'fixes'"):
        result.tables["fixs"]
    with pytest.raises(KeyError, match="no table 'x'; there are rounds, pings, "):
        result.tables["x"]
    assert "x" not in result.tables
    with pytest.raises(AttributeError, match="no attribute 'simulat'; did you mean 'simulate'"):
        _ = bindusbl_des.simulat


@pytest.mark.parametrize("given", ["scenarios/quickstart.yaml", {"name": "m"}])
def test_a_scenario_is_made_of_keys(given: object) -> None:
    with pytest.raises(TypeError, match=r"made of keys: .* load_scenario\(path\) reads a file, Sc"):
        Scenario(given)  # type: ignore[misc]


def test_scenarios_are_copied_and_sent_to_workers() -> None:
    made = Scenario(name="m", asvs={"count": 2})
    assert pickle.loads(pickle.dumps(made)) == copy.deepcopy(made) == made.model_copy() == made


def test_numbers_of_numpy_are_numbers() -> None:
    places = np.array([[0, 1], [2, 3]])
    keys = {"count": np.int64(2), "formation": {"positions_m": places}}
    made = Scenario(name="m", duration_s=np.float32(2.5), asvs=keys)
    assert made == Scenario.model_validate(
        {
            "name": "m",
            "duration_s": 2.5,
            "asvs": {"count": 2, "formation": {"positions_m": places.tolist()}},
        }
    )
    with pytest.raises(ValueError, match="needs a whole number"):
        Scenario(name="m", asvs={"count": np.float64(2.0)})


def test_a_campaign_draws_reports_and_keeps_itself(tmp_path: Path) -> None:
    """Without a folder it lies in a temporary one, which goes with it; `write` keeps it."""
    varied = {"asvs.count": np.array([1, 2]), "asvs.formation.angle_deg": (0, 45.0)}
    campaign = sweep(scenario(name="m", duration_s=5.0), vary=varied, seeds=range(2), workers=1)
    assert len(campaign.missions) == 8
    assert campaign.report(tmp_path / "c.html") == (tmp_path / "c.html").read_text("utf-8")
    campaign.plot("curves", tmp_path / "c.svg")
    campaign.plot("heatmap", tmp_path / "h.png", metric="position_error_m")
    assert {"c.svg", "h.png"} <= {path.name for path in tmp_path.iterdir()}
    for wrong, told in (
        ({"kind": "curvs"}, "did you mean 'curves'"),
        ({"metric": "latency_mean"}, "did you mean 'latency_mean_s'"),
        ({"x": "asvs.cuont"}, "did you mean 'asvs.count'"),
    ):
        with pytest.raises(ValueError, match=told):
            campaign.plot(**wrong)  # type: ignore[arg-type]
    temporary = campaign.folder
    assert campaign.write(tmp_path / "kept") == tmp_path / "kept"
    with pytest.raises(FileExistsError, match="exists; name another folder"):
        campaign.write(tmp_path / "kept")
    del campaign
    assert not temporary.exists()
    assert len(load_campaign(tmp_path / "kept").missions) == 8
    with pytest.raises(FileNotFoundError, match="holds a campaign; give the folder of one run"):
        load_result(tmp_path / "kept")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ({"path": "nowhere/x.png"}, "no such folder: 'nowhere'"),
        ({"path": "folder.png"}, "is a folder; name a file in it: 'folder.png'"),
        ({"width": 0.0}, "a figure is 1 to 50 inches wide; got 0"),
    ],
)
def test_a_figure_that_cannot_be_written_says_where(
    result: Result,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    words: dict[str, Any],
    said: str,
) -> None:
    """No word of drafts, nor of what matplotlib makes of it."""
    monkeypatch.chdir(tmp_path)
    Path("folder.png").mkdir()
    with pytest.raises((OSError, ValueError), match=said):
        result.plot("trajectory", **words)
    assert [path.name for path in Path().iterdir()] == ["folder.png"]

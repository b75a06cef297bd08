"""What `sweep` says, in one line, when it is called in a way that it does not know."""

import re
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from worlds import scenario

from bindusbl_des import load_scenario, resume, sweep

pytestmark = pytest.mark.usefixtures("in_this_process")

M = scenario(name="m", duration_s=2.0)


@pytest.mark.parametrize(
    ("call", "kind", "told"),
    [
        ({"experiment": 3}, TypeError, "needs a Scenario, or the path of a scenario or experim"),
        ({"experiment": "no.yaml"}, ValueError, "no.yaml: no such file"),
        ({"out": {"asvs.count": [1]}}, TypeError, "what to vary is given as vary={...}"),
        ({"vary": ["asvs.count"]}, TypeError, "vary needs a mapping such as"),
        ({"vary": {1: [2]}}, TypeError, "vary needs text as keys"),
        ({"vary": {}}, ValueError, "vary={}: vary: needs dotted keys with lists of values"),
        ({"vary": {"asvs.cuont": [1]}}, ValueError, "unknown key; did you mean 'count'?"),
        ({"vary": {"asvs.count": []}}, ValueError, "is an empty list; give at least one value"),
        ({"vary": {"asvs.count": 3}}, ValueError, "needs a list of values or a range, such as"),
        ({"vary": {"protocol.schedule": "dsatur"}}, ValueError, "got the text 'dsatur'"),
        ({"vary": {"survey.side_m": [-1, 60]}}, ValueError, "must be >= 0.1 and <= 100000 m"),
        ({"vary": {"asvs.count": [1, 1]}}, ValueError, "the same scenario as point 0; keep one"),
        ({"points": {"asvs.count": [1]}}, TypeError, "points needs a list such as [{"),
        ({"points": "2:5"}, TypeError, "points needs a list such as [{"),
        ({"points": [3]}, TypeError, "points[0] needs a mapping such as [{"),
        ({"points": [{2: 3}]}, TypeError, "points[0] needs text as keys"),
        ({"points": []}, ValueError, "points=[]: points: needs a list of points"),
        (
            {"points": [{"asvs.cuont": 1}]},
            ValueError,
            "points[0]={'asvs.cuont': 1}: asvs.cuont: un",
        ),
        (
            {"points": [{}, {"asvs.count": -1}]},
            ValueError,
            "points[1]={'asvs.count': -1}: asvs.count",
        ),
        (
            {"points": [{}], "vary": {"asvs.count": [1]}},
            ValueError,
            "be combined with vary; keep one",
        ),
        ({"progress": True}, TypeError, "progress needs a function, which is called with how far"),
        ({"seeds": 0}, ValueError, "seeds=0: seeds: must be >= 1"),
        ({"seeds": []}, ValueError, "is an empty list; give a number of seeds or name some"),
        ({"seeds": "3"}, ValueError, "needs a whole number or a list of seeds; got the text '3'"),
        ({"seeds": [1, 1]}, ValueError, "seeds=[1, 1]: seeds.1: seed 1 is given twice"),
        ({"seed": 3}, TypeError, "sweep has no argument 'seed'; did you mean 'seeds'?"),
        ({"worker": 3}, TypeError, "sweep has no argument 'worker'; did you mean 'workers'?"),
        ({"workers": 0}, ValueError, "workers needs a whole number >= 1; got 0"),
        ({"out": "a\0b"}, ValueError, "a\\x00b: no folder can have that name; give another"),
        ({"shard": (3, 2)}, ValueError, "shard needs (i, N) with 1 <= i <= N"),
        ({"until_ci": {"worst_position_error": 1}}, ValueError, "mean 'worst_position_error_m'"),
    ],
)
def test_a_wrong_call_is_told_and_leaves_nothing(
    call: dict[str, Any],
    kind: type[Exception],
    told: str,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    with pytest.raises(kind, match=f"^[^\n]*{re.escape(told)}[^\n]*$"):
        sweep(**{"experiment": M, **call})
    assert not list(tmp_path.iterdir())


def test_resume_knows_the_same_settings(tmp_path: Path) -> None:
    with pytest.raises(TypeError, match="resume has no argument 'worker'; did you mean 'workers'"):
        resume(tmp_path, worker=2)  # type: ignore[call-arg]


@pytest.mark.parametrize(
    ("modem", "vary"),
    [
        ("s2c_instant", {"asvs.count": [1, 2]}),
        ("nanomodem_v3", {"acoustics.mf.modem": ["s2c_instant", "nanomodem_v3"]}),
    ],
)
def test_files_that_a_modem_brings_are_kept_and_change_no_plan(
    tmp_path: Path, modem: str, vary: dict[str, Any]
) -> None:
    """Nobody gave them, so that they are of no key that was given; a lost copy is told."""
    world = scenario(name="m", duration_s=2.0, acoustics={"mf": {"modem": modem}})
    whole = sweep(world, vary=vary, workers=1, out=tmp_path / "s")
    (part,) = (tmp_path / "s" / "missions").iterdir()
    part.unlink()
    again = resume(tmp_path / "s", workers=1)
    assert again.record["plan_sha256"] == whole.record["plan_sha256"]
    assert again.missions["mission_id"].equals(whole.missions["mission_id"])
    (copy,) = (tmp_path / "s" / "airtimes").iterdir()
    copy.unlink()
    with pytest.raises(ValueError, match=f"{copy.name}: is missing"):
        resume(tmp_path / "s", workers=1)


def test_a_scenario_its_file_and_its_text_make_one_plan(tmp_path: Path) -> None:
    """A range, an array or a list of seeds; the scenario as object or by its path."""
    path = tmp_path / "m.yaml"
    path.write_text("name: m\nduration_s: 2\nrecord: {detail: full}\n")
    varied: dict[str, Any] = {"asvs.count": range(1, 3)}
    given = load_scenario(path)
    plans = [
        sweep(experiment, vary=varied, seeds=seeds, workers=1).record["plan_sha256"]
        for experiment, seeds in (
            (path, 2),
            (str(path), [0, 1]),
            (given, range(2)),
            (given, np.arange(2)),
        )
    ]
    assert len(set(plans)) == 1
    assert plans[0] == sweep(path, vary={"asvs.count": "1:2"}, seeds=2).record["plan_sha256"]


def test_what_ships_has_a_name() -> None:
    assert sweep("quickstart", vary={"duration_s": [2.0]}, workers=1).record["missions"] == 1
    with pytest.raises(ValueError, match="did you mean 'quickstart'"):
        sweep("quikstart")

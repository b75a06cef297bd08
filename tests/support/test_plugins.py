"""A scenario file runs no code: plug-ins need leave, and answer for what they do."""

import json
import re
import sys
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import schedules_for_tests
from campaigns_for_tests import OneThread
from commands_for_tests import call
from families_for_tests import allow, forbid, forget, forget_objects, unknown

from bindusbl_des import (
    Odometry,
    Scenario,
    ScenarioError,
    View,
    load_result,
    load_scenario,
    plan,
    resume,
    simulate,
    sweep,
)
from bindusbl_des.apps.campaigns import running

# A module that says by a file that it was imported, with parts good and bad.
STRANGER = """
import os, sys
from pathlib import Path

open(Path(__file__).with_name("imported"), "a").close()

def fair(view):
    return [[auv] for auv in range(len(view.auvs))]

def leaves(view):
    sys.exit()

def raises(view):
    raise TypeError("no\\ngood")

def base(view):
    raise BaseException

def lazy(view):
    yield [0]
    raise TypeError("late")

def endless(view):
    while True:
        yield [0]


def fraction(view): return [[0.7]]
def truth(view): return [[True]]
def minus(view): return [[-1]]
def words(view): return "ab"
def two(view, more): return [[0]]
number = 5

class Framed:
    framed = True
    def __call__(self, view):
        return [[view.round % len(view.auvs)]]

framed = Framed()

class Navigator:
    place, spread = 0.0, (1.0, 1.0, 0.0)
    def __init__(self, reckoning, auvs): pass
    def correct(self, fixes, due): pass
    def estimate(self, auv, odometry): return odometry.position + self.place
    def covariance(self, auv, odometry): return [self.spread] * len(odometry.times)

class Lost(Navigator): place = float("nan")
class Worded(Navigator):
    def estimate(self, auv, odometry): return [["x", "y"]] * len(odometry.times)
class Imaginary(Navigator): place = 1j
class TooSure(Navigator): spread = (-1.0, 1.0, 0.0)
class Bound(Navigator): spread = (1.0, 1.0, 5.0)
class Leaving(Navigator):
    def correct(self, fixes, due): sys.exit(0)
class Halting(Navigator):
    def __init__(self, reckoning, auvs): sys.exit(0)
class Prickly:
    def __getattr__(self, name): raise RuntimeError("hands off")
    def __call__(self, view): return [[0]]
prickly = Prickly()
class Dumb:
    def __init__(self, reckoning, auvs): pass
"""

PERMISSION = "BINDUSBL_ALLOW_PLUGINS"
MISSION = "name: m\nduration_s: 2\nauvs: {count: 2}\n"


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder with a stranger's module and files; nothing has been allowed in this process."""
    (tmp_path / "stranger.py").write_text(STRANGER)
    (tmp_path / "leaving.py").write_text("import sys\nsys.exit()\n")
    (tmp_path / "unwell.py").write_text("raise BaseException('not\\ntoday')\n")
    (tmp_path / "m.yaml").write_text(f"{MISSION}protocol: {{schedule: 'stranger:fair'}}\n")
    (tmp_path / "plain.yaml").write_text(MISSION)
    (tmp_path / "e.yaml").write_text(
        "scenario: plain.yaml\nvary: {protocol.schedule: [dsatur, 'stranger:fair']}\nseeds: 2\n"
    )
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv(PERMISSION, raising=False)
    unknown(monkeypatch)
    yield tmp_path
    forgotten()


def forgotten() -> None:
    """Leave this process as one that has loaded none of it and has leave for nothing."""
    forbid()
    forget()
    for name in ("stranger", "leaving", "unwell"):
        sys.modules.pop(name, None)


def imported(home: Path) -> bool:
    return (home / "imported").exists()


def named(name: str, key: str = "protocol.schedule") -> Scenario:
    section, _, word = key.partition(".")
    data = {"name": "m", "duration_s": 2.0, "auvs": {"count": 2}, section: {word: name}}
    return Scenario.model_validate(data)


@pytest.mark.parametrize("words", [("run", "m.yaml"), ("sweep", "m.yaml"), ("sweep", "e.yaml")])
def test_a_file_loads_no_plug_in_without_leave(home: Path, words: tuple[str, ...]) -> None:
    """What would be loaded, where it is named, and how to allow it; nothing is written."""
    outcome = call(*words)
    assert outcome.exit_code == 2
    place = "m.yaml:4:22" if words[1] == "m.yaml" else "e.yaml:2:36"
    assert outcome.stderr.startswith(f"{place}: protocol.schedule: 'stranger:fair' is a plug-in: ")
    assert len(outcome.stderr.splitlines()) == 1
    for told in ("module stranger", "its fair called", "--allow-plugins", f"{PERMISSION}=1"):
        assert told in outcome.stderr
    assert not imported(home)
    assert not (home / "results").exists()


def test_the_leave_that_several_plug_ins_need_is_told_once(home: Path) -> None:
    (home / "m.yaml").write_text(f"{MISSION}protocol: {{schedule: 'a:b', downlink: 'c:d'}}\n")
    told = call("run", "m.yaml").stderr.splitlines()
    assert ["use --allow-plugins" in line for line in told] == [False, True]
    assert [line.split("'")[1] for line in told] == ["a:b", "c:d"]


@pytest.mark.parametrize("key", ["protocol.schedule", "navigation.filter"])
def test_python_loads_no_plug_in_without_leave(home: Path, key: str) -> None:
    """Neither a scenario from data nor one from a file imports anything, nor does `simulate`."""
    name = "stranger:fair" if key == "protocol.schedule" else "stranger:Navigator"
    scenario = named(name, key)
    with pytest.raises(ValueError, match=f"{key}: '{name}' is a plug-in"):
        simulate(scenario)
    with pytest.raises(ValueError, match="is a plug-in"):
        simulate(load_scenario(home / "m.yaml"))
    with pytest.raises(ValueError, match="is a plug-in"):
        sweep(home / "e.yaml", home / "out")
    assert not imported(home)
    assert not (home / "out").exists()


def test_with_leave_a_plug_in_is_loaded(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By the option, the environment, or Python; leave for one name is none for another."""
    assert call("run", "m.yaml", "--allow-plugins", "--no-advice", "--out", "a").exit_code == 0
    assert simulate(load_scenario(home / "m.yaml", allow_plugins=True)).mission.rounds[0] > 1
    still = named("stranger:Navigator", "navigation.filter")
    with pytest.raises(ValueError, match="is a plug-in"):
        simulate(still)
    assert simulate(still, allow_plugins=True).mission.rounds[0] > 1
    with pytest.raises(ValueError, match="has no"):
        simulate(named("stranger:nobody"), allow_plugins=True)
    with pytest.raises(ValueError, match="is a plug-in"):
        simulate(named("stranger:framed"))
    monkeypatch.setenv(PERMISSION, "0")
    with pytest.raises(ValueError, match="is a plug-in"):
        simulate(named("stranger:framed"))
    monkeypatch.setenv(PERMISSION, "1")
    assert simulate(named("stranger:framed")).mission.rounds[0] == 2  # frames of 1 s
    assert call("run", "m.yaml", "--no-advice", "--out", "b").exit_code == 0


def test_what_only_reads_never_imports(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Folders are made with leave; who reads them has none, and runs nothing of a stranger's."""
    monkeypatch.setattr(running, "pool_for", OneThread)
    for words in (
        ("run", "m.yaml", "--no-advice", "--out", "r"),
        ("sweep", "e.yaml", "--workers", "1", "--out", "c"),
    ):
        ran = call(*words, "--allow-plugins")
        assert ran.exit_code == 0, ran.output
    forgotten()
    (home / "imported").unlink()
    for words in (
        ("validate", "m.yaml"),
        ("validate", "e.yaml"),
        ("sweep", "e.yaml", "--dry-run"),
        ("sweep", "e.yaml", "--dry-run", "--allow-plugins"),
        ("timing", "m.yaml"),
        ("coverage", "m.yaml"),
        ("status", "c"),
        ("report", "r"),
        ("report", "c"),
        ("compare", "c", "--by", "protocol.schedule"),
        ("explain", "r", "--ping", "0"),
        ("export", "r", "--to", "csv", "--out", "x"),
        ("plot", "r", "timeline"),
    ):
        outcome = call(*words)
        assert outcome.exit_code == 0, (words, outcome.output)
        assert ("use --allow-plugins" in outcome.stderr) <= ("--allow-plugins" not in words), words
    assert load_result(home / "r").scenario.protocol.schedule == "stranger:fair"
    outcome = call("report", "r", "--advice-s", "1")
    assert outcome.exit_code == 2
    assert "'stranger:fair' is a plug-in" in outcome.stderr
    assert not imported(home)


def test_a_campaign_is_resumed_with_leave_only(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave is the command's: its workers have it, its folder has not."""
    with monkeypatch.context() as patch:
        patch.setattr(running, "pool_for", OneThread)
        sweep(home / "e.yaml", home / "c", allow_plugins=True)
    record = json.loads((home / "c" / "campaign.json").read_text())
    assert '"allow' not in json.dumps(record)
    for file in (home / "c" / "missions").iterdir():
        file.unlink()
    (home / "imported").unlink()
    forbid()
    outcome = call("resume", "c")
    assert (outcome.exit_code, "'stranger:fair' is a plug-in" in outcome.stderr) == (2, True)
    assert not imported(home)
    outcome = call("resume", "c", "--workers", 1, "--allow-plugins")
    assert outcome.exit_code == 0, outcome.stderr
    assert imported(home)
    forbid()
    with pytest.raises(ValueError, match="is a plug-in"):
        resume(home / "c")


def test_validate_checks_the_form_and_says_so(home: Path) -> None:
    """The place of each plug-in, that it was not loaded; with leave, what is wrong with it."""
    assert (
        "m.yaml:4:22: protocol.schedule: 'stranger:fair' is a plug-in"
        in call("validate", "m.yaml").stdout
    )
    (home / "m.yaml").write_text(f"{MISSION}protocol: {{schedule: 'stranger:two'}}\n")
    assert call("validate", "m.yaml").exit_code == 0
    outcome = call("validate", "m.yaml", "--allow-plugins")
    assert outcome.exit_code == 2
    assert "m.yaml:4:22: protocol.schedule: 'stranger:two' cannot be called" in outcome.stdout
    (home / "m.yaml").write_text(f"{MISSION}protocol: {{schedule: 'a b:c'}}\n")
    assert "'a b:c' is no schedule" in call("validate", "m.yaml").stdout


def test_a_plug_in_that_the_points_replace_needs_no_leave(
    home: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What no point keeps is not loaded."""
    monkeypatch.setattr(running, "pool_for", OneThread)
    (home / "m2.yaml").write_text("scenario: m.yaml\nvary: {protocol.schedule: [dsatur, random]}\n")
    assert call("sweep", "m2.yaml", "--out", "out", "--workers", 1).exit_code == 0
    assert not imported(home)


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("leaving:part", "cannot load 'leaving:part' (SystemExit, at leaving.py:2)"),
        ("unwell:part", "cannot load 'unwell:part' (BaseException: not today, at unwell.py:1)"),
        ("nowhere:part", "cannot load 'nowhere:part' (No module named 'nowhere')"),
        ("stranger:absent", "cannot load 'stranger:absent' (module 'stranger' has no attribute"),
        ("stranger:fractoin", "no attribute 'fractoin'); did you mean 'fraction'?"),
        ("stranger:Framed", "too many positional arguments; it is a class: name an object of it"),
        ("stranger.py:fair", "; write stranger:fair, the module without its file's ending"),
        ("stranger:number", "'stranger:number' is of the type int, which cannot be called"),
        ("stranger:prickly", "'stranger:prickly' raised RuntimeError as it was looked at: hands"),
        ("stranger:two", "cannot be called as a schedule is, with (view): missing a required"),
    ],
)
def test_a_plug_in_that_cannot_be_loaded_is_bad_input(home: Path, name: str, said: str) -> None:
    """Whatever its module does, one line names the place, the key and the part: exit code 2."""
    (home / "m.yaml").write_text(f"{MISSION}protocol: {{schedule: '{name}'}}\n")
    for words in (("run", "m.yaml"), ("sweep", "m.yaml"), ("validate", "m.yaml")):
        outcome = call(*words, "--allow-plugins")
        assert outcome.exit_code == 2, outcome.output
        told = outcome.output.splitlines()[0]
        assert told.startswith("m.yaml:4:22: protocol.schedule: ")
        assert said in told
    with pytest.raises(ScenarioError):
        load_scenario(home / "m.yaml", allow_plugins=True)


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("leaves", "raised SystemExit in round 0"),
        ("raises", "raised TypeError in round 0: no good"),
        ("base", "raised BaseException in round 0"),
        ("lazy", "raised TypeError in round 0: late"),
        ("endless", "raised ValueError in round 0: a round with more than 100,000 groups"),
        ("fraction", "returned [[0.7]] in round 0; a round is a list of groups"),
        ("truth", "returned [[True]] in round 0; a round is a list of groups"),
        ("words", "returned 'ab' in round 0; a round is a list of groups"),
        ("minus", "returned [[-1]] in round 0; a round needs at least one group"),
    ],
)
def test_what_a_schedule_does_wrong_fails_the_run(home: Path, name: str, said: str) -> None:
    """Exit code 1, one line; in a sweep a mission that failed."""
    (home / "m.yaml").write_text(f"{MISSION}protocol: {{schedule: 'stranger:{name}'}}\n")
    outcome = call("-q", "run", "m.yaml", "--allow-plugins")
    line = f"m: the run failed: protocol.schedule: 'stranger:{name}' {said}"
    assert (outcome.exit_code, len(outcome.stderr.splitlines())) == (1, 1)
    assert outcome.stderr.startswith(line)


@pytest.mark.parametrize(
    ("name", "said"),
    [
        (
            "Lost",
            r"answered estimate with an array of shape \(\d+, 2\) with nan or inf in it",
        ),
        ("Worded", "answered estimate with an array of no numbers"),
        ("Imaginary", "answered estimate with an array of no numbers"),
        ("TooSure", "answered covariance with a variance below 0"),
        ("Bound", "answered covariance with a covariance xy above the product"),
        ("Leaving", "raised SystemExit: 0"),
        ("Halting", "raised SystemExit: 0"),
        ("Dumb", "lacks correct, estimate, covariance"),
    ],
)
def test_what_a_navigator_does_wrong_fails_the_run(home: Path, name: str, said: str) -> None:
    """What it answers is finite, real and of its shape, or the mission ends and says why."""
    allow([f"stranger:{name}"])
    with pytest.raises(ValueError, match=f"navigation.filter: 'stranger:{name}' {said}"):
        simulate(named(f"stranger:{name}", "navigation.filter"))


def test_ctrl_c_is_nobodys_mistake(home: Path) -> None:
    """Whoever interrupts a part interrupts the program."""
    (home / "stranger.py").write_text("def part(view): raise KeyboardInterrupt\n")
    allow(["stranger:part"])
    with pytest.raises(KeyboardInterrupt):
        simulate(named("stranger:part"))


def test_a_request_to_end_is_nobodys_mistake(home: Path) -> None:
    """SIGTERM while a part is at work ends the program with 143, as elsewhere."""
    text = "import os, signal\ndef part(view): os.kill(os.getpid(), signal.SIGTERM)\n"
    (home / "stranger.py").write_text(text)
    (home / "m.yaml").write_text(f"{MISSION}protocol: {{schedule: 'stranger:part'}}\n")
    assert call("run", "m.yaml", "--allow-plugins").exit_code == 143


class Believing:
    """A navigator that believes its dead reckoning."""

    def __init__(self, reckoning: object, auvs: int) -> None:
        pass

    def correct(self, fixes: object, due: object) -> None:
        pass

    def estimate(self, auv: int, odometry: Odometry) -> np.ndarray:
        return odometry.position

    def covariance(self, auv: int, odometry: Odometry) -> np.ndarray:
        return np.ones((len(odometry.times), 3)) * (1.0, 1.0, 0.0)


def test_an_object_given_in_python_is_its_own_leave(
    home: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is written down by its name, which reads back to the same scenario."""
    monkeypatch.setattr(running, "pool_for", OneThread)
    scenario = Scenario(
        name="own",
        duration_s=2.0,
        protocol={"schedule": schedules_for_tests.all_at_once},
        navigation={"filter": Believing},
    )
    assert scenario.protocol.schedule == "schedules_for_tests:all_at_once"
    assert scenario.navigation.filter == f"{__name__}:Believing"
    simulate(scenario).write(home / "own")
    assert load_scenario(home / "own" / "scenario.yaml") == scenario
    varied = {"protocol.schedule": [schedules_for_tests.all_at_once, "dsatur"]}
    campaign = sweep(home / "plain.yaml", home / "c", vary=varied, workers=1)
    assert campaign.state().done == 2


def test_an_object_without_a_module_works_in_this_process(
    home: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A function within a function, or of a notebook's cell: nobody else would find it, so that no
    worker is given it; each has a name of its own, and one that was made anew another one.
    """

    def within(view: View, *, first: int = 0) -> list[list[int]]:
        return [[first]]

    def anew() -> Any:
        def within(view: View) -> list[list[int]]:
            return [[1], [2]]

        return within

    cell: dict[str, Any] = {"__name__": "__main__"}
    exec("class Cell:\n    def __call__(self, view): return [[2, 1]]", cell)
    found = []
    for part, pinged in (
        (within, {"AUV0"}), (anew(), {"AUV1", "AUV2"}), (lambda view: [[0, 1]], {"AUV0", "AUV1"}),
        (partial(within, first=2), {"AUV2"}), (cell["Cell"](), {"AUV1", "AUV2"}),
        ({"model": within, "first": 1}, {"AUV1"}),
    ):  # fmt: skip
        scenario = Scenario(name="m", duration_s=2.0, protocol={"schedule": part})
        result = simulate(scenario)
        assert set(result.tables["pings"].auv) == pinged
        again = Scenario.model_validate(scenario.model_dump(mode="json"))
        assert simulate(again).arrow["fixes"].equals(result.arrow["fixes"])
        found.append(str(scenario.protocol.schedule))
        with pytest.raises(ValueError, match="is known to this process alone, and workers"):
            sweep(scenario)
        with pytest.raises(ValueError, match="is known to this process alone, and workers"):
            plan(scenario, below={"position_error_m": 1.0})
    names = ["within", "within_2", "_lambda_", "partial", "Cell", "within"]
    assert [re.sub(r"(?<=Cell|tial|bda_)_\d+", "", name) for name in found] == [
        f"__main__:{name}" for name in names
    ]
    with pytest.raises(ValueError, match="is known to this process alone"):
        sweep(Scenario(name="m"), vary={"protocol.schedule": [within, "dsatur"]})
    simulate(Scenario(name="m", duration_s=2.0, protocol={"schedule": within})).write(home / "r")
    assert load_result(home / "r").scenario.protocol.schedule == "__main__:within"
    forget_objects(monkeypatch)  # as in another process
    told = call("run", home / "r" / "scenario.yaml", "--allow-plugins")
    assert told.exit_code == 2
    assert "it was of a notebook or script that has ended: put it into a modu" in told.stderr


def test_what_is_a_plug_in_by_its_form() -> None:
    """Two dotted Python names and one colon between."""
    for name in ("a:b", "a.b:c.d", "módulo:función"):
        assert named(name).plugins == {"protocol.schedule": name}
    for name in ("a", "a:", ":b", "a:b:c", ".a:b", "a b:c", "a/b:c", "a:b()"):
        with pytest.raises(ValueError, match="is no schedule"):
            named(name)


DECLARING = """
def ask(view): raise AssertionError("asked")

def declaring(**attributes):
    def part(view): return ask(view)
    part.__dict__.update(attributes)
    return part

poisson, slotted, sensing = (declaring(access=it) for it in ("poisson", "slotted", "sensing"))
wrong, odd = declaring(access="nonsense"), declaring(framed="yes")

def channel(signals): raise AssertionError("asked")
def instrument(sounding): raise AssertionError("asked")
class Navigator:
    ignores_fixes = "no"
    def __init__(self, reckoning, auvs): raise AssertionError("asked")

channel.ends_at_range, instrument.is_stated = 1, None
"""


@pytest.fixture
def declaring(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "declares.py").write_text(DECLARING)
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.delitem(sys.modules, "declares", raising=False)


@pytest.mark.parametrize(
    ("own", "shipped"),
    [("poisson", "aloha"), ("slotted", "slotted_aloha"), ("sensing", "csma")],
)
def test_auvs_ping_as_they_like_by_what_a_schedule_declares(
    declaring: None, own: str, shipped: str
) -> None:
    """They do as under the schedule that ships, and the function is not asked."""
    allow([f"declares:{own}"])
    mine, theirs = (
        simulate(Scenario(name="m", duration_s=30.0, protocol={"schedule": it}), 1).tables["pings"]
        for it in (f"declares:{own}", shipped)
    )
    assert len(mine) > 20
    assert mine.equals(theirs)


@pytest.mark.parametrize(
    ("key", "own", "told"),
    [
        (
            "protocol.schedule",
            "wrong",
            "access = 'nonsense'; give one of 'slots', 'poisson', 'slotted', 'sen",
        ),
        ("protocol.schedule", "odd", "framed = 'yes'; give one of False, True"),
        ("acoustics.hf.channel", "channel", "ends_at_range = 1; give one of False, True"),
        ("acoustics.mf.channel", "channel", "ends_at_range = 1; give one of False, True"),
        ("usbl.model", "instrument", "is_stated = None; give one of False, True"),
        ("navigation.filter", "Navigator", "ignores_fixes = 'no'; give one of False, True"),
    ],
)
def test_what_no_part_can_declare_is_refused(
    declaring: None, key: str, own: str, told: str
) -> None:
    for command in ("validate", "run", "timing"):
        words = [command, "quickstart", "--set", f"{key}=declares:{own}"]
        outcome = call(*words, "--allow-plugins")
        assert outcome.exit_code == 2
        assert f"declares {told}" in outcome.output

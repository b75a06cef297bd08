"""Parts have settings of their own: checked, varied, kept, and told, the same for all families."""

import json
import pickle
import re
from collections.abc import Iterator
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from campaigns_for_tests import OneThread
from commands_for_tests import call
from families_for_tests import (
    ACCESS,
    ASV,
    AUV,
    BROADCASTER,
    CHANNEL,
    DOWNLINK,
    INSTRUMENT,
    MF_CHANNEL,
    MISSION,
    NAVIGATOR,
    OPEN,
    PLACEMENT,
    RANGING,
    ROUTE,
    SCHEDULE,
    Family,
    allow,
    each_but_slow_ones,
    forbid,
    home_of,
    put,
)
from pydantic import ValidationError

from bindusbl_des import Scenario, ScenarioError, load_result, load_scenario, simulate, sweep
from bindusbl_des.apps.campaigns import running

# A part of each family, called by the family's noun, and others whose settings are special.
OWN = """
import numpy as np
from pydantic import BaseModel, Field
from bindusbl_des.core.protocol.tdma import broadcast, downlink_free, ping_group, until

open(__file__ + ".imported", "a").close()

def schedule(view, *, most: int = 9):
    return [[auv] for auv in range(len(view.auvs))][:most]

def access(node, *, every_s: float = 1.0):
    while not node.is_asv:
        yield node.wait(every_s)
        yield node.send("ping")
    yield node.wait(every_s)

def downlink(network, turn, time, *, pause_s: float = 0.25):
    for slot in range(len(turn.groups)):
        yield until(network, time + pause_s)
        time = yield from ping_group(network, turn, slot, time + pause_s)
    broadcast(network, turn, time)
    return (yield from downlink_free(network, time))

def ranging(slot, time, *, later_s: float = 0.01):
    yield slot.until(time + later_s)
    slot.ping(slot.group, time + later_s)

def channel(signals, *, chance: float = 0.5):
    return np.full(signals.ranges.shape, chance)

def mf_channel(signals, *, chance: float = 0.5):
    return channel(signals, chance=chance)

def instrument(sounding, *, sd_m: float = 1.0):
    count = len(sounding.asvs)
    off = sd_m * sounding.random.standard_normal((count, 3))
    return sounding.source + off, np.tile(sd_m**2 * np.eye(3), (count, 1, 1))

def broadcaster(view, *, copy: int = 0):  # named as a method of pydantic's models is
    return copy

class filter:
    class Settings(BaseModel):
        off_m: float = Field(1.0, ge=0)
    def __init__(self, reckoning, auvs, *, settings): self.off = settings.off_m
    def correct(self, fixes, due): pass
    def estimate(self, auv, odometry): return odometry.position + self.off
    def covariance(self, auv, odometry): return [(1.0, 1.0, 0.0)] * len(odometry.times)

def placement(plan, *, spacing_m: float = 10.0):
    return [(spacing_m * asv, 0.0) for asv in range(plan.asvs)]

def vehicle(way, *, lag_m: float = 0.0):
    times = np.arange(0.0, way.duration + 2.0, 0.5)
    places = way.planned(way.speed * times)
    places[:, 1] += lag_m
    return np.column_stack([times, places[:, :2], 0 * times + way.depth])

def vessel(way, *, drift_m: float = 0.0):
    (x, y, _), = way.planned([0.0])
    return [(0.0, x, y, 0.0), (way.duration, x + drift_m, y, 0.0)]

def route(plan, *, reach_m: float = 10.0, late_s: float | None = None):
    if late_s is not None:
        return [[(0, auv, 0, 5), (late_s, auv, reach_m, 5)] for auv in range(plan.auvs)]
    return [[(auv, -reach_m), (auv, reach_m)] for auv in range(plan.auvs)]

def needy(view, *, depth: int, weights: tuple[float, ...] = (), mode: bool = False):
    assert isinstance(weights, tuple)
    return [[0]] * min(depth, 1)
def bare(view): return [[0]]
def strange(view, *, depth: "Unheard"): return [[0]]
def under(view, *, _depth: int = 1): return [[0]]
class deaf:
    class Settings(BaseModel): pass
    def __new__(cls, view): return [[0]]
"""

OWN_PARTS = {family: f"set_parts:{family.noun}" for family in OPEN}

# Of each part of one's own: its setting, two values of it that tell, and one that is wrong.
SETTINGS: dict[Family, tuple[str, Any, Any, Any, str]] = {
    SCHEDULE: ("most", 1, 2, 1.5, "needs a whole number; got 1.5"),
    ACCESS: ("every_s", 0.5, 0.8, "often", "needs a number; got the text 'often'"),
    DOWNLINK: ("pause_s", 0.5, 1, "long", "needs a number; got the text 'long'"),
    BROADCASTER: ("copy", 0, 2, True, "needs a whole number; got true"),
    RANGING: ("later_s", 0.02, 0.03, "late", "needs a number; got the text 'late'"),
    CHANNEL: ("chance", 0.9, 0.2, True, "needs a number; got true"),
    MF_CHANNEL: ("chance", 0.9, 0.2, True, "needs a number; got true"),
    INSTRUMENT: ("sd_m", 2.0, 3.0, [], "needs a number; got a list"),
    NAVIGATOR: ("off_m", 2.0, 3.0, -1, "must be >= 0; got -1"),
    PLACEMENT: ("spacing_m", 5.0, 15, "far", "needs a number; got the text 'far'"),
    AUV: ("lag_m", 1.0, 3.0, "far", "needs a number; got the text 'far'"),
    ASV: ("drift_m", 2, 9.5, "far", "needs a number; got the text 'far'"),
    ROUTE: ("late_s", 3, 4.5, "now", "needs a number; got the text 'now'"),
}
EACH = pytest.mark.parametrize("family", SETTINGS, ids=lambda family: family.noun)


@pytest.fixture(autouse=True)
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder with parts of one's own; nothing has been allowed in this process."""
    (tmp_path / "m.yaml").write_text(yaml.safe_dump(MISSION))
    yield from home_of(tmp_path, monkeypatch, set_parts=OWN)


def written(family: Family, **settings: Any) -> dict[str, Any]:
    """Return the mission with a part of one's own, as plain data."""
    return with_part(family, {family.word or "model": OWN_PARTS[family], **settings})


def with_part(family: Family, part: Any) -> dict[str, Any]:
    """Return the mission with something at the key of a family, as plain data."""
    return put(MISSION, family.key, part)


def error_m(result: Any) -> list[float]:
    errors: list[float] = result.auvs.position_error_m.tolist()
    return errors


def test_every_family_is_tried_here() -> None:
    assert set(SETTINGS) == set(OPEN)


@EACH
def test_a_setting_decides_the_mission_and_is_kept(home: Path, family: Family) -> None:
    """It is in the hash, in run.json and scenario.yaml; the folder's own scenario runs the same."""
    word, one, other, _, _ = SETTINGS[family]
    allow([OWN_PARTS[family]])
    missions = [Scenario.model_validate(written(family, **{word: it})) for it in (one, other)]
    assert missions[0] != missions[1]
    first, second = [simulate(it, 1) for it in missions]
    told = ("rounds", "fixes", "broadcasts", "tracks")
    assert any(first.tables[it].to_csv() != second.tables[it].to_csv() for it in told)
    first.write(home / "r")
    again = load_result(home / "r")
    assert again.scenario == missions[0]
    kept = json.loads((home / "r" / "run.json").read_text())["scenario"]
    assert attrgetter(family.key)(again.scenario) == attrgetter(family.key)(missions[0])
    for name in family.key.split("."):
        kept = kept[name]
    assert kept == {family.word or "model": OWN_PARTS[family], word: one}
    forbid()
    ran = call(
        "run", "r/scenario.yaml", "--seed", 1, "--allow-plugins", "--no-advice", "--out", "s"
    )
    assert ran.exit_code == 0, ran.output
    assert error_m(load_result(home / "s")) == error_m(first)


@each_but_slow_ones(SETTINGS, NAVIGATOR)
@pytest.mark.slow
def test_a_campaign_varies_a_setting_on_a_worker(home: Path, family: Family) -> None:
    """Workers get the settings of their point, of a part that the file names alone."""
    word, one, other, _, _ = SETTINGS[family]
    key = f"{family.key}.{word}"
    bare = {family.word: OWN_PARTS[family]} if family.word else OWN_PARTS[family]
    (home / "m.yaml").write_text(yaml.safe_dump(with_part(family, bare)))
    campaign = sweep(
        home / "m.yaml", home / "c", vary={key: [one, other]}, workers=1, allow_plugins=True
    )
    assert (campaign.state().done, campaign.state().failed) == (2, 0)
    rows = campaign.auvs
    for value in (one, other):
        alone = load_scenario(home / "m.yaml", overrides=[f"{key}={value}"])
        mine = rows[rows[key] == value]
        assert error_m(simulate(alone, int(mine.seed.iloc[0]))) == mine.position_error_m.tolist()


@EACH
def test_wrong_settings_are_told_at_their_place(home: Path, family: Family) -> None:
    """Each with line, key, value and remedy; a campaign's in its own lines."""
    word, one, _, wrong, said = SETTINGS[family]
    key = f"{family.key}.{word}"
    (home / "m.yaml").write_text(yaml.safe_dump(written(family, **{word: wrong, "zz": 1})))
    outcome = call("validate", "m.yaml", "--allow-plugins")
    assert outcome.exit_code == 2
    lines = (home / "m.yaml").read_text().splitlines()
    for setting, fault in ((word, said), ("zz", "unknown setting; remove it, ")):
        line = next(n for n, text in enumerate(lines, 1) if f"{setting}: " in text)
        assert f"m.yaml:{line}:" in outcome.stdout
        assert f"{family.key}.{setting}: {fault}" in outcome.stdout
    misspelt = f"{word[:-2]}{word[-1]}"
    (home / "m.yaml").write_text(yaml.safe_dump(written(family)))
    outcome = call("run", "m.yaml", "--allow-plugins", "--set", f"{family.key}.{misspelt}=1")
    assert (outcome.exit_code, len(outcome.stderr.splitlines())) == (2, 1)
    assert f"{family.key}.{misspelt}: unknown setting; did you mean {word!r}?" in outcome.stderr
    values = f"{one},{json.dumps(wrong)}"
    outcome = call("sweep", "m.yaml", "--allow-plugins", "--vary", f"{key}={values}", "--out", "c")
    assert outcome.exit_code == 2
    assert f"{key}: {said}" in outcome.stderr
    assert not (home / "c").exists()


@EACH
def test_settings_are_kept_as_they_are_without_leave(home: Path, family: Family) -> None:
    """Whoever only reads imports nothing, and knows nothing of what is right there."""
    word, _, _, wrong, _ = SETTINGS[family]
    (home / "m.yaml").write_text(yaml.safe_dump(written(family, **{word: wrong, "zz": [1, "a"]})))
    kept = load_scenario(home / "m.yaml").model_dump(mode="json")
    for name in family.key.split("."):
        kept = kept[name]
    assert kept == {family.word or "model": OWN_PARTS[family], word: wrong, "zz": [1, "a"]}
    assert call("validate", "m.yaml").exit_code == 0
    varied = ("--vary", f"{family.key}.{word}=1,2", "--out", "c")
    for words in (("run", "m.yaml"), ("sweep", "m.yaml", *varied)):
        outcome = call(*words)
        assert (outcome.exit_code, len(outcome.stderr.splitlines())) == (2, 1), outcome.output
        assert "is a plug-in: " in outcome.stderr
    assert not (home / "set_parts.py.imported").exists()


@EACH
def test_in_python_the_model_is_the_object_itself(
    home: Path, family: Family, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same part, refused alike, and known to the workers of a campaign."""
    if family is not SCHEDULE:  # to start a process takes longer than all the rest
        monkeypatch.setattr(running, "pool_for", OneThread)
    import set_parts  # type: ignore[import-not-found]  # written by `home`

    word, one, _, wrong, said = SETTINGS[family]
    model, part = family.word or "model", getattr(set_parts, family.noun)
    given = Scenario.model_validate(with_part(family, {model: part, word: one}))
    assert given == Scenario.model_validate(written(family, **{word: one}))
    assert len(simulate(given).auvs) == 2
    bad = Scenario.model_validate(with_part(family, {model: part, word: wrong}))
    with pytest.raises(ValueError, match=f"^{re.escape(f'{family.key}.{word}: {said}')}$"):
        simulate(bad)
    campaign = sweep(
        home / "m.yaml",
        home / "c",
        vary={family.key: [{model: part, word: one}, {model: family.siblings[0]}]},
        workers=1,
    )
    assert campaign.state().done == 2


@pytest.mark.parametrize(
    "family", [SCHEDULE, DOWNLINK, BROADCASTER, NAVIGATOR], ids=lambda it: it.noun
)
def test_parts_that_ship_refuse_what_is_none_of_theirs(home: Path, family: Family) -> None:
    """One line: the setting, the part, and what it has."""
    for part in family.siblings:
        setting = f"{family.key}={{model: {part}, zz: 1}}"
        outcome = call("run", "m.yaml", "--set", setting)
        assert outcome.exit_code == 2
        assert f"{family.key}.zz: unknown setting; remove it, {part} has " in outcome.stderr
        theirs = family.settings.get(part)
        known = f"has {', '.join(theirs.model_fields) if theirs else 'none'}\n"
        assert outcome.stderr.endswith(known)


def test_explain_tells_the_settings_of_ones_own(home: Path) -> None:
    allow(OWN_PARTS.values())
    own = {"downlink": {"model": OWN_PARTS[DOWNLINK], "pause_s": 0.5}}
    scenario = Scenario.model_validate(
        MISSION | {"protocol": own, "navigation": {"filter": OWN_PARTS[NAVIGATOR]}}
    )
    simulate(scenario).write(home / "r")
    told = " ".join(call("explain", "r", "--ping", 1).stdout.split())
    assert "set_parts:downlink (pause_s 0.5): the plug-in decided to broadcast now" in told


@pytest.mark.parametrize(
    ("part", "said"),
    [
        ("{model: 'set_parts:needy'}", "depth: missing; add it"),
        ("{model: 'set_parts:needy', depth: 1, weights: [1, a]}", "weights.1: needs a number"),
        ("{model: 'set_parts:needy', depth: 1, mode: 1}", "mode: needs true or false; got 1"),
        ("{model: 'set_parts:needy', dept: 1}", "dept: unknown setting; did you mean 'depth'?"),
        (
            "{model: 'set_parts:bare', x: 1}",
            "x: unknown setting; remove it, set_parts:bare has non",
        ),
        ("set_parts:strange", "'set_parts:strange' raised NameError as its settings were read: "),
        ("{model: 'set_parts:under', depth: 1}", "remove it, set_parts:under has none"),
        ("set_parts:deaf", "it has Settings, but takes no `settings`"),
        ("{depth: 1}", "needs `model`, the part that its settings are for; got depth"),
        ("{model: 'set_parts:bare', 3: 1}", "names settings by words such as `depth`; got the"),
        ("{model: 'set_parts:bare', a: .nan}", "takes settings of numbers, texts, lists and mapp"),
        ("{model: [1]}", "must be one of spatial_reuse, "),
        ("3", "must be one of spatial_reuse, "),
    ],
)
def test_what_is_wrong_is_said_in_one_line(home: Path, part: str, said: str) -> None:
    """Bad input, whatever the part of somebody's own does as it is looked at."""
    outcome = call("run", "m.yaml", "--allow-plugins", "--set", f"protocol.schedule={part}")
    assert (outcome.exit_code, len(outcome.stderr.splitlines())) == (2, 1), outcome.output
    assert "protocol.schedule" in outcome.stderr
    assert said in outcome.stderr


def test_fixed_takes_the_asv_that_is_asked_for() -> None:
    """A setting of a part that ships: used, checked against the fleet, one word from a name."""

    def mission(broadcaster: Any) -> Scenario:
        return Scenario.model_validate(MISSION | {"protocol": {"broadcaster": broadcaster}})

    result = simulate(mission({"model": "fixed", "asv": 2}))
    assert set(result.tables["broadcasts"].asv) == {"ASV2"}
    assert set(simulate(mission("fixed")).tables["broadcasts"].asv) == {"ASV0"}
    with pytest.raises(ValidationError, match="there is no ASV3: the last is ASV2"):
        mission({"model": "fixed", "asv": 3})
    with pytest.raises(ScenarioError, match=r"asv: must be >= 0; got -1"):
        load_scenario(
            "m.yaml", overrides=["protocol.broadcaster=fixed", "protocol.broadcaster.asv=-1"]
        )


def test_a_choice_is_its_name_and_not_another_choice() -> None:
    """Compared, hashed, copied and sent to workers as what it is."""

    def chosen(part: Any) -> Any:
        scenario = Scenario.model_validate({"name": "m", "protocol": {"schedule": part}})
        return scenario.protocol.schedule

    bare = chosen("a:b")
    two, same = (chosen({"model": "a:b", "k": 2}) for _ in range(2))
    assert bare == "a:b" == two
    assert "a:b" in (two,)
    assert two == same
    assert bare != two
    assert len({bare, two, same, "a:b"}) in (2, 3)
    assert pickle.loads(pickle.dumps(two)) == two
    assert pickle.loads(pickle.dumps(two)).settings == {"k": 2}
    assert (bare.plain(), two.plain()) == ("a:b", {"model": "a:b", "k": 2})
    with pytest.raises(TypeError):
        two.settings["k"] = 3


def test_numbers_of_numpys_are_settings_too() -> None:
    """They are plain numbers and lists from then on, as a file would have them."""
    given = {
        "model": "a:b",
        "x": np.float64(2),
        "n": np.int64(3),
        "w": np.arange(2),
        "y": [np.True_],
    }
    choice = Scenario.model_validate(
        {"name": "m", "protocol": {"schedule": given}}
    ).protocol.schedule
    assert choice.words == "a:b (x 2, n 3, w [0, 1], y [true])"
    assert [type(it) for it in choice.settings.values()] == [float, int, list, list]
    assert yaml.safe_load(yaml.safe_dump(choice.plain())) == choice.plain()


def test_a_number_too_large_is_not_infinite(home: Path) -> None:
    """A whole number of Python's beyond all floating-point numbers is refused as it is read."""
    allow(["set_parts:needy"])
    given = {"model": "set_parts:needy", "depth": 1, "weights": [10**400]}
    with pytest.raises(ValueError, match=r"weights\.0: (must be a finite|needs a) number"):
        simulate(Scenario.model_validate({"name": "m", "protocol": {"schedule": given}}))


def test_settings_of_the_shipped_are_listed() -> None:
    """`params`, the schema and the reference have them."""
    assert "protocol.broadcaster.asv: 0" in call("params", "broadcaster").stdout
    schema = json.loads(call("schema").stdout)
    forms = schema["$defs"]["Protocol"]["properties"]["broadcaster"]["anyOf"]
    assert any("asv" in form.get("properties", {}) for form in forms)

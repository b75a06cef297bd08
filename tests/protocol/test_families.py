"""Every part of a mission can be exchanged, by one that ships or by one's own: the same for all."""

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml
from commands_for_tests import call
from families_for_tests import (
    ASV,
    AUV,
    BROADCASTER,
    CHANNEL,
    DOWNLINK,
    INSTRUMENT,
    MF_CHANNEL,
    MISSION,
    OPEN,
    SCHEDULE,
    Family,
    allow,
    each_but_slow_ones,
    forbid,
    home_of,
    put,
)

from bindusbl_des import Scenario, Setup, load_result, load_scenario, simulate, sweep, warnings_of

# A part of each family, called by the family's noun.
OWN = """
import numpy as np
from bindusbl_des import BroadcastView, View
from bindusbl_des.core.protocol.tdma import broadcast, downlink_free, ping_group, until

def schedule(view: View):
    return [[auv] for auv in reversed(range(len(view.auvs)))]

def access(node):
    while True:
        yield node.wait(0.05 + 0.3 * node.random.random())
        if node.is_asv:
            yield node.send("go", bytes=1)
        else:
            yield node.send("ping")

def downlink(network, turn, time):
    for slot in range(len(turn.groups)):
        yield until(network, time + 0.25)  # a pause before each slot
        time = yield from ping_group(network, turn, slot, time + 0.25)
    if turn.row.round % 2:
        broadcast(network, turn, time)
    return (yield from downlink_free(network, time))

def ranging(slot, time):
    yield slot.until(time + 0.01)
    slot.ping(slot.group, time + 0.01)

def channel(signals):
    return np.where(signals.ranges < 30.0, 0.9, 0.5)

def mf_channel(signals):
    return channel(signals)

def instrument(sounding):
    count = len(sounding.asvs)
    off = sounding.random.standard_normal((count, 3))
    return sounding.source + off, np.tile(np.eye(3), (count, 1, 1))

def broadcaster(view: BroadcastView):
    assert view.fixes.shape == (len(view.heard), 3)
    assert view.asvs.shape == (view.count, 3)
    return view.count - 1

class filter:
    def __init__(self, reckoning, auvs): pass
    def correct(self, fixes, due): pass
    def estimate(self, auv, odometry): return odometry.position + 1.0
    def covariance(self, auv, odometry): return [(1.0, 1.0, 0.0)] * len(odometry.times)

def placement(plan):
    return [(plan.side * (asv / plan.asvs - 0.5), 3.0) for asv in range(plan.asvs)]

def vehicle(way):
    times = np.arange(0.0, way.duration + 2.0)
    places = way.planned(0.5 * times)
    return np.column_stack([times, places[:, :2] + 0.1 * way.number, 0 * times + way.depth])

def vessel(way):
    (x, y, _), = way.planned([0.0])
    return [(0.0, x, y, 0.0), (way.duration, x + 2.0, y, 0.0)]

def route(plan):
    return [[(auv, -10.0), (auv, 10.0), (auv + 5.0, 0.0)] for auv in range(plan.auvs)]
"""

# What is wrong with others.
WRONG = """
import math
from bindusbl_des.core.protocol.tdma import broadcast, ping_group

def far(view): return 3
def minus(view): return -1
def half(view): return 0.5
def yes(view): return True
def nothing(view): pass
def breaks(view): return view.asvs["ASV0"]
def rude(view): raise SystemExit
class Unspeakable:
    def __repr__(self): raise TypeError("no words")
def silent(view): return Unspeakable()
def two(view, more): return 0

def plain(network, turn, time): return time + 1.0
def yields(network, turn, time): yield 3.0
def stands(network, turn, time):
    return time
    yield
def hurries(network, turn, time):
    return time + 1e-12
    yield
def ends(value):
    def downlink(network, turn, time):
        yield from ping_group(network, turn, 0, time)
        return value
    return downlink
no, nan, words, long = ends(None), ends(math.nan), ends("1.0"), ends(10**400)
early = ends(0.01)
def slot(network, turn, time): yield from ping_group(network, turn, 99, time)
def late(network, turn, time):
    yield from ping_group(network, turn, 0, time)
    raise ValueError("too\\nlate")
def fails(network, turn, time):
    def inner():
        yield network.env.timeout(0.1)
        raise KeyError("inner")
    yield network.env.process(inner())
def forever(network, turn, time): yield network.env.timeout(math.nan)
def few(network, turn): yield
def tells(network, turn, time):
    time = yield from ping_group(network, turn, 0, time)
    broadcast(network, turn, time)
    return time
"""

OWN_PARTS = {family: f"own_parts:{family.noun}" for family in OPEN}
# Other routes and placements that ship need keys beside their name; hulls have tests of their own.
FIRST = {family for family in OPEN if family.word or family in (AUV, ASV)}
SHIPPED = {family: family.siblings[: 1 if family in FIRST else None] for family in OPEN}
SHIPPED |= dict.fromkeys((CHANNEL, MF_CHANNEL), ("disc", "sonar"))  # a curve needs its file
SHIPPED[INSTRUMENT] = ("array",)  # a sheet needs its figures
PARTS = [(family, name) for family in OPEN for name in (*SHIPPED[family], OWN_PARTS[family])]


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder with parts of one's own; nothing has been allowed in this process."""
    (tmp_path / "m.yaml").write_text(yaml.safe_dump(MISSION))
    yield from home_of(tmp_path, monkeypatch, own_parts=OWN, wrong_parts=WRONG)


def with_parts(**names: object) -> Scenario:
    """Return the mission with parts of the protocol."""
    return Scenario.model_validate(MISSION | {"protocol": names})


def with_part(family: Family, part: object) -> dict[str, Any]:
    """Return the mission with a part, as plain data."""
    return put(MISSION, family.name_key, part)


def word(family: Family) -> str:
    return family.key.partition(".")[2]


@pytest.mark.parametrize(("family", "name"), PARTS)
def test_a_part_runs_and_is_explained(home: Path, family: Family, name: str) -> None:
    """Named with `--set`: run, timing and explain take whatever part it is, figures any slots."""
    setting = ("--set", f"{family.name_key}={name}")
    if name == "direct_reply":  # answers to AUVs that share a slot destroy each other
        setting += ("--set", "protocol.schedule=one_per_slot")
    ran = call("run", "m.yaml", *setting, "--allow-plugins", "--no-advice", "--out", "r")
    assert ran.exit_code == 0, ran.output
    fixes = load_result(home / "r").tables["fixes"]
    delivered = fixes[fixes.outcome == "delivered"]
    assert len(delivered) > 0
    forbid()
    reading: list[tuple[object, ...]] = [
        ("timing", "m.yaml", *setting),
        ("explain", "r", "--ping", delivered.ping.iloc[-1]),
    ]
    if family is DOWNLINK:
        reading += [("plot", "r", "timeline", "--out", "t.png"), ("plot", "r", "round")]
        reading += [("report", "r", "--out", "r.html", "--no-advice")]
    for words in reading:
        outcome = call(*words)
        assert outcome.exit_code == 0, (words, outcome.output)


def test_explain_says_that_ones_own_decided(home: Path) -> None:
    """When and by whom a fix is broadcast is the plug-ins' doing; nothing is imported for that."""
    own = {word(family): OWN_PARTS[family] for family in (SCHEDULE, DOWNLINK, BROADCASTER)}
    allow(own.values())
    simulate(with_parts(**own)).write(home / "r")
    (home / "own_parts.py").unlink()
    told = call("explain", "r", "--ping", 1)
    assert told.exit_code == 0, told.output
    assert "own_parts:downlink: the plug-in decided to broadcast now" in told.stdout
    assert "own_parts:broadcaster: the plug-in chose ASV2" in told.stdout
    timing = call("timing", "r/scenario.yaml")
    assert "the plug-in decides when fixes are broadcast and rounds end" in timing.stdout
    assert "rounds/s" not in timing.stdout


def test_no_round_length_is_claimed_for_ones_own() -> None:
    """Whether a round fits its frame follows from the slots of downlinks that ship only."""
    short = {"schedule": "round_robin", "frame_s": 0.01}
    for downlink, claims in (("sequential", True), (OWN_PARTS[DOWNLINK], False)):
        told = warnings_of(with_parts(**short, downlink=downlink))
        assert any(it.key == "protocol.frame_s" for it in told) is claims


def test_slots_are_told_where_the_downlink_put_them(home: Path) -> None:
    """Those of `own_parts:downlink` begin a quarter of a second late each."""
    allow(OWN_PARTS.values())
    for ranging in ("owtt_sync", "twtt"):
        own = {"downlink": OWN_PARTS[DOWNLINK], "schedule": "one_per_slot", "ranging": ranging}
        simulate(with_parts(**own)).write(home / ranging)
        pings = load_result(home / ranging).tables["pings"]
        begun = (pings.sent_at_s if ranging == "owtt_sync" else pings.called_at_s)[:2]
        slot_s = Setup(with_parts(**own)).slots.uplink_slot
        assert begun.tolist() == pytest.approx([0.25, 0.5 + slot_s])


@each_but_slow_ones(OPEN, SCHEDULE)
def test_a_campaign_varies_a_family_on_a_worker(home: Path, family: Family) -> None:
    """Workers load one's own with the command's leave, and get what this process gets."""
    names = [*SHIPPED[family], OWN_PARTS[family]]
    varied = {family.name_key: names}
    campaign = sweep(home / "m.yaml", home / "c", vary=varied, workers=1, allow_plugins=True)
    assert (campaign.state().done, campaign.state().failed) == (len(names), 0)
    alone = load_scenario(home / "m.yaml", overrides=[f"{family.name_key}={names[-1]}"])
    rows = campaign.auvs
    seed = int(rows.seed.iloc[0])
    own = rows[rows[family.name_key] == names[-1]]
    assert own.position_error_m.tolist() == simulate(alone, seed).auvs.position_error_m.tolist()


@pytest.mark.parametrize("family", OPEN, ids=lambda family: family.noun)
def test_ones_own_needs_leave(home: Path, family: Family) -> None:
    """A file loads nothing without leave, and says what it would; the object itself is leave."""
    setting = f"{family.name_key}={OWN_PARTS[family]}"
    (home / "own.yaml").write_text(yaml.safe_dump(with_part(family, OWN_PARTS[family])))
    for command in ("run", "sweep"):
        outcome = call(command, "own.yaml", "--out", "out")
        assert (outcome.exit_code, len(outcome.stderr.splitlines())) == (2, 1)
        assert f"{family.key}: 'own_parts:{family.noun}' is a plug-in: " in outcome.stderr
    with pytest.raises(ValueError, match="is a plug-in"):
        simulate(load_scenario(home / "m.yaml", overrides=[setting]))
    assert "own_parts" not in sys.modules
    import own_parts  # type: ignore[import-not-found]  # written by `home`

    given = Scenario.model_validate(with_part(family, getattr(own_parts, family.noun)))
    assert given.plugins[family.key] == OWN_PARTS[family]
    assert len(simulate(given).auvs) == 2


def test_a_campaign_knows_the_source_of_ones_own(home: Path) -> None:
    """With a plug-in that has changed it is not gone on with, whatever the family."""
    varied = {family.name_key: [OWN_PARTS[family]] for family in (SCHEDULE, CHANNEL)}
    sweep(home / "m.yaml", home / "c", vary=varied, workers=1, allow_plugins=True)
    (home / "own_parts.py").write_text(OWN + "\n")
    outcome = call("resume", "c", "--allow-plugins")
    assert outcome.exit_code != 0, outcome.output
    assert "own_parts" in outcome.output


NAMED = [family for family in OPEN if family not in FIRST]


@pytest.mark.parametrize("family", NAMED, ids=lambda family: family.noun)
def test_a_misspelt_part_is_told_with_the_one_that_was_meant(home: Path, family: Family) -> None:
    """One line names the file, the key, all that ship, and the nearest of them."""
    meant = family.siblings[0]
    outcome = call("run", "m.yaml", "--set", f"{family.key}={meant[:-2]}{meant[-1]}")
    assert outcome.exit_code == 2
    assert f"is no {family.noun}; did you mean {meant!r}? (one of " in outcome.stderr
    assert ", ".join(family.siblings) in outcome.stderr


INSTANT = "it must be the instant (s) at which the next round begins, 0.001 s after 0 or later"
ASV = "it must be the whole number of an ASV, 0..2"


@pytest.mark.parametrize(
    ("key", "name", "said"),
    [
        ("broadcaster", "far", f"returned 3 in broadcast 0; {ASV}"),
        ("broadcaster", "minus", f"returned -1 in broadcast 0; {ASV}"),
        ("broadcaster", "half", f"returned 0.5 in broadcast 0; {ASV}"),
        ("broadcaster", "yes", f"returned True in broadcast 0; {ASV}"),
        ("broadcaster", "nothing", f"returned None in broadcast 0; {ASV}"),
        ("broadcaster", "breaks", "raised IndexError in broadcast 0: "),
        ("broadcaster", "rude", "raised SystemExit in broadcast 0"),
        ("broadcaster", "silent", "raised TypeError in broadcast 0: no words"),
        ("downlink", "plain", "returned 1.0 in round 0; it must be a generator function"),
        ("downlink", "yields", "yielded 3.0 in round 0; it must be an event"),
        ("downlink", "stands", f"returned 0.0 in round 0; {INSTANT}"),
        ("downlink", "hurries", f"returned 1e-12 in round 0; {INSTANT}"),
        ("downlink", "no", f"returned None in round 0; {INSTANT}"),
        ("downlink", "nan", f"returned nan in round 0; {INSTANT}"),
        ("downlink", "words", f"returned '1.0' in round 0; {INSTANT}"),
        ("downlink", "long", "returned 1000000000"),
        ("downlink", "early", f"returned 0.01 in round 0; {INSTANT} and not before 0."),
        ("downlink", "slot", "raised IndexError in round 0: "),
        ("downlink", "late", "raised ValueError in round 0: too late"),
        (
            "downlink",
            "forever",
            "raised ValueError in round 0: a wait must last a number of seconds",
        ),
        ("downlink", "fails", "raised KeyError in round 0: 'inner'"),
    ],
)
def test_what_ones_own_does_wrong_fails_the_run(home: Path, key: str, name: str, said: str) -> None:
    """Exit code 1 and one line: the key, the part, what it returned, and what is needed."""
    setting = f"protocol.{key}=wrong_parts:{name}"
    outcome = call("-q", "run", "m.yaml", "--allow-plugins", "--no-advice", "--set", setting)
    assert (outcome.exit_code, len(outcome.stderr.splitlines())) == (1, 1), outcome.output
    assert f"m: the run failed: protocol.{key}: 'wrong_parts:{name}' {said}" in outcome.stderr


@pytest.mark.parametrize(
    ("key", "name", "needed"),
    [("broadcaster", "two", "(view)"), ("downlink", "few", "(network, turn, time)")],
)
def test_what_is_called_otherwise_is_bad_input(
    home: Path, key: str, name: str, needed: str
) -> None:
    """The form of the call is checked when the scenario is read: exit code 2."""
    setting = f"protocol.{key}=wrong_parts:{name}"
    outcome = call("run", "m.yaml", "--allow-plugins", "--set", setting)
    assert outcome.exit_code == 2
    assert f"cannot be called as a {key} is, with {needed}: " in outcome.stderr


def test_a_broadcasters_mistake_is_not_the_downlinks(home: Path) -> None:
    """The part that is told is the one that was wrong, be it called by another of one's own."""
    names = {"downlink": "wrong_parts:tells", "broadcaster": "wrong_parts:far"}
    allow(names.values())
    with pytest.raises(ValueError, match=r"^protocol.broadcaster: 'wrong_parts:far' returned 3"):
        simulate(with_parts(**names))


def test_a_round_that_ends_later_is_waited_for(home: Path) -> None:
    """A downlink may return an instant that is still to come: the next round begins then."""
    (home / "own_parts.py").write_text(
        "from bindusbl_des.core.protocol.tdma import broadcast, ping_group\n"
        "def downlink(network, turn, time):\n"
        "    ends = yield from ping_group(network, turn, 0, time)\n"
        "    broadcast(network, turn, ends)\n"
        "    return time + 2\n"
    )
    allow(["own_parts:downlink"])
    result = simulate(with_parts(downlink="own_parts:downlink", schedule="spatial_reuse"))
    assert result.tables["rounds"].started_at_s.tolist() == [0.0, 2.0, 4.0]

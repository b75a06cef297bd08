"""Campaign folders that somebody or something has damaged, and tracks and parts that changed."""

import fcntl
import json
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from campaigns_for_tests import cut_short, fly_with, parts, read_record, same, write_record
from commands_for_tests import call

from bindusbl_des import (
    CampaignInterrupted,
    CampaignState,
    Scenario,
    load_campaign,
    load_result,
    load_scenario,
    resume,
    sweep,
)

BASE = "name: tiny\nduration_s: 5\n"
SWEEP = ("--vary", "asvs.count=2,3", "--seeds", 4)
TRACK = "time_s,x_m,y_m,depth_m\n0,0,0,5\n5,{},0,5\n"
FOLLOWED = (
    "name: followed\nduration_s: 5\nsurvey: {side_m: 1000}\n"
    "auvs: {count: 1, route: {kind: track, files: [a.csv]}}\n"
)
OWN = """
def slots(view):
    return [[auv] for auv in range(len(view.auvs))]

def leaves(view):
    raise SystemExit(0)
"""


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each test runs in a folder of its own, its missions in this process."""
    monkeypatch.chdir(tmp_path)
    fly_with(monkeypatch)
    Path("base.yaml").write_text(BASE)


@pytest.fixture(scope="module")
def complete(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small campaign that is complete, with all events."""
    home = tmp_path_factory.mktemp("complete")
    (home / "base.yaml").write_text(BASE)
    words = ("--detail", "full", "--out", home / "c")
    with pytest.MonkeyPatch.context() as patch:
        fly_with(patch)
        assert call("sweep", home / "base.yaml", *SWEEP, *words).exit_code == 0
    return home / "c"


@pytest.fixture
def folder(complete: Path) -> Path:
    """A copy of that campaign for a test to damage."""
    return Path(shutil.copytree(complete, "c"))


def a_track(folder: Path, ends_at: float) -> Path:
    """Write a scenario with a track that ends there (m); return the scenario's file."""
    folder.mkdir(exist_ok=True)
    (folder / "a.csv").write_text(TRACK.format(ends_at))
    (folder / "s.yaml").write_text(FOLLOWED)
    return folder / "s.yaml"


# Tracks


def test_equal_scenarios_in_two_folders_are_equal(tmp_path: Path) -> None:
    """Tracks count by their contents: shards of two copies merge, another track is another plan."""
    one, two = a_track(tmp_path / "one", 30), a_track(tmp_path / "two", 30)
    other = a_track(tmp_path / "other", 40)
    for number, file in (("1", one), ("2", two)):
        shard = ("--seeds", 4, "--shard", f"{number}/2", "--out", number)
        assert call("sweep", file, *shard).exit_code == 0
    merged = call("merge", "1", "2", "--out", "whole")
    assert merged.exit_code == 0, merged.stderr
    assert call("sweep", other, "--seeds", 4, "--shard", "2/2", "--out", "3").exit_code == 0
    assert "is not of the same campaign" in call("merge", "1", "3", "--out", "no").stderr


def test_results_take_their_tracks_along(tmp_path: Path) -> None:
    """The scenario of a result, and of a campaign, runs where its first files are gone."""
    file = a_track(tmp_path / "one", 30)
    assert call("run", file, "--out", "r", "--no-advice").exit_code == 0
    assert call("sweep", file, "--seeds", 2, "--out", "c").exit_code == 0
    shutil.rmtree(tmp_path / "one")
    away = tmp_path / "away"
    for name in ("r", "c"):
        shutil.move(name, away / name)
        again = call("run", away / name / "scenario.yaml", "--out", f"{name}2", "--no-advice")
        assert again.exit_code == 0, again.stderr
    over = call("run", away / "r" / "scenario.yaml", "--out", "r2", "--no-advice", "--force")
    assert over.exit_code == 0, over.stderr
    first, second = load_result(away / "r"), load_result("r2")
    assert first.run_record()["scenario_sha256"] == second.run_record()["scenario_sha256"]
    assert first.arrow["tracks"] == second.arrow["tracks"]
    assert str(tmp_path) not in (away / "c" / "campaign.json").read_text()


def test_a_campaign_goes_on_with_the_tracks_it_began_with(tmp_path: Path) -> None:
    """What becomes of the first file changes nothing; a copy that was changed is refused."""
    file = a_track(tmp_path / "one", 31.6)
    undisturbed = sweep(file, "u", seeds=8)
    cut_short(file, "c", seeds=8)
    a_track(tmp_path / "one", 316.2)
    os.chdir("one")
    resume("../c")
    os.chdir("..")
    same(undisturbed, load_campaign("c"))
    (copy,) = Path("c/tracks").iterdir()
    copy.write_text(TRACK.format(316.2))
    refused = call("resume", "c")
    assert (refused.exit_code, refused.stderr.count("\n")) == (2, 1)
    assert refused.stderr.startswith(f"{copy}: has been changed since")
    copy.unlink()
    assert call("resume", "c").stderr.startswith(f"{copy}: is missing")


def test_varied_tracks_lie_in_the_folder(tmp_path: Path) -> None:
    """A route that is varied as a whole finds its files beside the scenario, and takes them."""
    file = a_track(tmp_path / "one", 30)
    (tmp_path / "one" / "b.csv").write_text(TRACK.format(40))
    route = "auvs.route={kind: track, files: [%s]}"
    varied = f"{route % 'a.csv'}, {{kind: track, files: [b.csv]}}"
    ran = call("sweep", file, "--vary", varied, "--out", "c")
    assert ran.exit_code == 0, ran.stderr
    assert len(list(Path("c/tracks").iterdir())) == 2
    ways = load_campaign("c").auvs["distance_m"].tolist()
    assert ways == pytest.approx([30.0, 40.0])


# Parts of one's own


@pytest.fixture
def own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A module with schedules of one's own."""
    module = tmp_path / "mine_for_a_test.py"
    module.write_text(OWN)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setenv("BINDUSBL_ALLOW_PLUGINS", "1")
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    monkeypatch.delitem(sys.modules, "mine_for_a_test", raising=False)
    Path("own.yaml").write_text(f"{BASE}protocol: {{schedule: 'mine_for_a_test:slots'}}\n")
    return module


def test_a_part_that_has_changed_is_refused(own: Path) -> None:
    """Missions of two sources are not mixed; the message names the file."""
    cut_short("own.yaml", "c", seeds=8)
    own.write_text(f"{OWN}# another\n")
    refused = call("resume", "c")
    assert refused.exit_code == 2
    assert refused.stderr.startswith(f"c: {own} has changed since the campaign began")
    with pytest.raises(ValueError, match="has changed since the campaign began"):
        sweep("own.yaml", "c", seeds=8)  # which `resume` would not continue
    own.write_text(OWN)
    assert call("resume", "c").exit_code == 0


def test_what_a_part_imports_from_beside_it_belongs_to_it(own: Path) -> None:
    """The message names all files, since any of them may have changed."""
    beside = own.with_name("beside_for_a_test.py")
    beside.write_text("")
    own.write_text(f"import beside_for_a_test\n{OWN}")
    cut_short("own.yaml", "c", seeds=8)
    beside.write_text("# another\n")
    refused = call("resume", "c")
    assert refused.exit_code == 2
    assert refused.stderr.startswith(f"c: {own} or {beside} has changed since the campaign began")


def test_a_part_that_leaves_is_a_failed_mission(own: Path) -> None:
    """`sys.exit` in a mission ends that mission alone, and a run says so."""
    Path("own.yaml").write_text(own.with_name("own.yaml").read_text().replace("slots", "leaves"))
    ran = call("sweep", "own.yaml", "--seeds", 2, "--out", "c")
    assert ran.exit_code == 3
    assert "\n2 missions failed: PluginError: protocol.schedule: 'mine" in ran.stderr
    alone = call("run", "own.yaml", "--out", "r", "--no-advice")
    assert (alone.exit_code, "raised SystemExit" in alone.stderr) == (1, True)


# Damaged parts


def empty(folder: Path, part: str) -> Path:
    path = folder / "missions" / f"part-{part}.parquet"
    path.write_bytes(b"")
    return path


def truncated(folder: Path, part: str) -> Path:
    path = folder / "auvs" / f"part-{part}.parquet"
    path.write_bytes(path.read_bytes()[:-100])
    return path


def lost_auvs(folder: Path, part: str) -> Path:
    path = folder / "auvs" / f"part-{part}.parquet"
    path.unlink()
    return path


def twice(folder: Path, part: str) -> Path:
    """Rows that stand twice."""
    path = folder / "missions" / f"part-{part}.parquet"
    table = pq.read_table(path)
    pq.write_table(pa.concat_tables([table, table]), path)
    return path


def a_record(folder: Path, part: str) -> Path:
    """Checksums that are none."""
    path = folder / "checksums" / f"part-{part}.json"
    path.write_text(path.read_text()[:-20])
    return path


def foreign(folder: Path, part: str) -> Path:
    """A table that is a campaign's, of another one."""
    assert call("sweep", "base.yaml", "--seeds", 3, "--detail", "full", "--out", "f").exit_code == 0
    (other,) = parts("f")
    path = folder / "missions" / f"part-{part}.parquet"
    shutil.copy(f"f/missions/part-{other}.parquet", path)
    return path


def a_stranger(folder: Path, part: str) -> Path:
    """A table that is none of a campaign's, beside the others."""
    path = folder / "missions" / "part-zz.parquet"
    table = pq.read_table(folder / "missions" / f"part-{part}.parquet")
    pq.write_table(table.replace_schema_metadata({}), path)
    return path


def another_name(folder: Path, part: str) -> Path:
    """A part that is there twice."""
    path = folder / "missions" / "part-00000000-0123abcd.parquet"
    shutil.copy(folder / "missions" / f"part-{part}.parquet", path)
    return path


DAMAGE = (empty, truncated, lost_auvs, twice, a_record, foreign, a_stranger, another_name)


@pytest.mark.parametrize("damage", DAMAGE, ids=lambda it: it.__name__)
def test_a_damaged_part_is_named_and_run_again(
    folder: Path, damage: Callable[[Path, str], Path]
) -> None:
    """Who reads is told the file and the remedy; `resume` sets it aside; nothing else changes."""
    shutil.copytree(folder, "sound")
    (part,) = parts(folder)
    path = damage(folder, part)
    readers = (
        ("status", "c"), ("report", "c"), ("compare", "c", "--by", "asvs.count"), ("plot", "c"),
        ("export", "c", "--to", "csv"), ("merge", "c", "--out", "m"),
    )  # fmt: skip
    for words in readers if damage is empty else readers[::5]:
        told = call(*words)
        assert (told.exit_code, told.stderr.count("\n")) == (2, 1), (words, told.stderr)
        assert str(path) in told.stderr, words
        assert "`bindusbl-des resume c`" in told.stderr, words
    assert not Path("m").exists()
    mended = call("resume", "c")
    assert mended.exit_code == 0, mended.stderr
    assert str(path) in mended.stderr
    assert "set aside as" in mended.stderr
    assert list(folder.glob("missions/_damaged*"))
    same(load_campaign("sound"), load_campaign(folder))
    for table in ("pings", "fixes"):
        rows = [pq.read_table(next(Path(it, table).glob("part-*"))) for it in ("sound", "c")]
        assert rows[0].equals(rows[1])


def flipped(path: Path, dice: random.Random) -> None:
    raw = bytearray(path.read_bytes())
    raw[dice.randrange(len(raw))] ^= 1 << dice.randrange(8)
    path.write_bytes(raw)


@pytest.mark.parametrize("count", [3, pytest.param(500, marks=pytest.mark.slow)])
def test_a_flipped_bit_of_any_file_is_named_and_repaired(count: int) -> None:
    """By `resume`, or by the same sweep where it is in the record (which is the first)."""
    words = ("base.yaml", "--vary", "asvs.count=2,3", "--seeds", 2, "--detail", "full", "--out")
    assert call("sweep", *words, "sound").exit_code == 0
    sound, dice, repaired = load_campaign("sound"), random.Random(count), 0
    files = [path.relative_to("sound") for path in sorted(Path("sound").rglob("*[0-9n].[jp]*"))]
    assert len(files) == 12
    for number in range(count):
        shutil.rmtree("c", ignore_errors=True)
        path = Path(shutil.copytree("sound", "c")) / files[(3 + number) % len(files)]
        flipped(path, dice)
        if path.suffix == ".json" and _says(path) == _says(Path("sound", *path.parts[1:])):
            continue  # what the checksum itself is called
        if path.name == "campaign.json":
            assert call("status", "c").stderr.startswith(f"{path} is damaged or was edited (")
            assert call("sweep", "base.yaml", "--seeds", 5, "--out", "c").exit_code == 2
            again = call("sweep", *words, "c")
        else:
            again = call("resume", "c")
            assert again.stderr.startswith(f"{path} is damaged")
        assert again.exit_code == 0, again.stderr
        mended = load_campaign("c")
        same(sound, mended)
        assert mended.state().missing == 0
        for table in ("fixes", "tracks"):
            rows = [pq.read_table(next(Path(it, table).glob("part-*"))) for it in ("sound", "c")]
            assert rows[0].equals(rows[1])
        repaired += 1
    assert repaired > 0.95 * count


def _says(path: Path) -> Any:
    """Return all that a file holds but the name of its checksum; None of what is no JSON."""
    try:
        *found, (_, checksum) = json.loads(path.read_text()).items()
    except ValueError:
        return None
    return found, checksum


def test_no_flipped_bit_is_parsed(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whoever reads rows compares first: Parquet's decoders would end the process at some bits."""
    monkeypatch.setattr(pq, "ParquetFile", None)
    dice, campaign = random.Random(35), load_campaign("c")
    written = sorted(folder.glob("*/part-*.parquet"))
    assert len(written) > 8
    for number in range(100):
        path = written[number % len(written)]
        whole = path.read_bytes()
        flipped(path, dice)
        with pytest.raises(ValueError, match=r"SHA-256 .*; `bindusbl-des resume c`") as caught:
            campaign.table(path.parent.name)
        assert str(caught.value).startswith(f"{path} is damaged or was edited")
        path.write_bytes(whole)


def test_a_merger_that_fails_leaves_nothing(folder: Path) -> None:
    """The next one is not blocked by what the first had written."""
    before, limits = sorted(os.listdir()), resource.getrlimit(resource.RLIMIT_FSIZE)
    largest = max(path.stat().st_size for path in folder.rglob("*.parquet"))
    resource.setrlimit(resource.RLIMIT_FSIZE, (largest // 2, limits[1]))
    try:
        assert call("merge", "c", "--out", "m").exit_code == 1
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert sorted(os.listdir()) == before
    Path("file").touch()
    beneath = call("merge", "c", "--out", "file/m")
    assert (beneath.exit_code, beneath.stderr.count("\n")) == (2, 1)
    assert "file is a file; name another" in beneath.stderr
    assert call("merge", "c", "--out", "m").exit_code == 0
    same(load_campaign(folder), load_campaign("m"))


def test_shards_are_kept_where_their_folder_came_to_exist(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whoever has taken the name meanwhile keeps it, and the message says where all is."""

    plain = os.fsync

    def sync(descriptor: int) -> None:
        Path("m").mkdir(exist_ok=True)
        Path("m/mine").touch()
        plain(descriptor)

    monkeypatch.setattr(os, "fsync", sync)
    told = call("merge", "c", "--out", "m")
    assert (told.exit_code, told.stderr.count("\n")) == (2, 1)
    assert "m: came to exist meanwhile; what was to be written there is in m-2" in told.stderr
    assert os.listdir("m") == ["mine"]
    same(load_campaign(folder), load_campaign("m-2"))


# Records of somebody else's

STRANGE = {
    "a list": "[]",
    "deep": "[" * 100_000,
    "deep within": '{"format": 2, "experiment": ' + '{"a":' * 400 + "1" + "}" * 401,
    "a huge number": "1" * 5000,
    "null": "null",
    "not JSON": "{",
    "not text": '{"format": 2, "name": "\\ud800"}',
}


@pytest.mark.parametrize("name", STRANGE)
def test_any_json_is_told_in_a_line(name: str) -> None:
    Path("c").mkdir()
    Path("c/campaign.json").write_text(STRANGE[name])
    for command in ("status", "resume", "report"):
        told = call(command, "c")
        assert (told.exit_code, told.stderr.count("\n")) == (2, 1), told.stderr
        assert told.stderr.startswith("c/campaign.json")
        assert len(told.stderr) < 500


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("name", 5), ("name", "\x1b[31mred"), ("status", None), ("shard", [2, 1]), ("shard", "1/2"),
        ("plan_sha256", "../../etc"), ("scenario_sha256", "A" * 64), ("own_parts", []),
        ("versions", ["1"]), ("versions", {"numpy": 2}), ("scenario", {"name": 5}),
        ("session", {"began_at": float("nan"), "rows_before": 0}), ("missions", -1),
        ("experiment.seeds", [0.5]), ("experiment.seeds", [True]), ("experiment.seeds", [10**30]),
        ("experiment.seeds", []), ("experiment.points", {}), ("experiment.detail", "most"),
        ("experiment.until_ci", {"position_error_m": "x%"}),
        ("experiment.points", [{"auvs.count": 10**400}]),
        ("experiment.points", [{"auvs.count.x.y": 1}]),
        ("experiment.scenario_as_given", {"name": "a", "duration_s": "long"}),
        ("experiment.scenario_as_given", {"name": "a", "auvs": {"count": 1, "route": {
            "kind": "track", "files": ["../../secret.csv"]}}}),
    ],
)  # fmt: skip
@pytest.mark.parametrize("command", ["status", "resume"])
def test_a_record_of_wrong_values_is_refused(
    folder: Path, key: str, value: object, command: str
) -> None:
    record = read_record(folder)
    section, _, last = key.rpartition(".")
    (record[section] if section else record)[last] = value
    write_record(folder, record)
    told = call(command, "c")
    assert (told.exit_code, told.stderr.count("\n")) == (2, 1), told.stderr
    assert told.stderr.startswith("c/campaign.json is damaged or was edited (")
    assert told.stderr[:-1].isprintable()


@pytest.mark.parametrize("command", ["status", "resume"])
def test_a_record_that_is_not_ours_to_read_is_not_called_damaged(
    folder: Path, command: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    read = Path.read_text

    def denied(path: Path, *args: Any, **more: Any) -> str:
        if path.name == "campaign.json":
            raise PermissionError(13, "Permission denied", str(path))
        return read(path, *args, **more)

    monkeypatch.setattr(Path, "read_text", denied)
    told = call(command, "c")
    assert told.exit_code == 2
    assert "c/campaign.json cannot be read (Permission denied); ask its owner" in told.stderr


def test_the_former_format_is_refused(folder: Path) -> None:
    write_record(folder, {**read_record(folder), "format": 1})
    told = call("resume", "c")
    assert told.exit_code == 2
    assert told.stderr.startswith("c/campaign.json has format 1, of another version")


# Links


@pytest.mark.parametrize(
    "name",
    ["campaign.lock", "stop", "missions", "auvs", ".campaign.json.tmp", "failures", "tracks/x"],
)
def test_no_link_is_followed(folder: Path, name: str) -> None:
    """A stranger's folder with a link makes `resume` overwrite nothing."""
    Path("away").mkdir()
    Path("away/victim").write_text("mine")
    target = Path("away" if (folder / name).is_dir() or name == "failures" else "away/victim")
    if (folder / name).is_dir():
        shutil.rmtree(folder / name)
    (folder / name).parent.mkdir(exist_ok=True)
    (folder / name).symlink_to(target.absolute())
    told = call("resume", "c")
    assert told.exit_code == 2
    assert told.stderr.startswith(f"c/{name}: is a symbolic link")
    assert os.listdir("away") == ["victim"]
    assert Path("away/victim").read_text() == "mine"


def test_a_lock_that_is_also_another_file_is_left(folder: Path) -> None:
    Path("victim").write_text("mine")
    os.link("victim", folder / "campaign.lock")
    assert "is a file of another folder" in call("resume", "c").stderr
    assert Path("victim").read_text() == "mine"


# What is asked of a campaign


@pytest.mark.parametrize("limit", ["nan", "1e300", "0", "-1", "-inf"])
@pytest.mark.parametrize("command", ["sweep", "resume"])
def test_a_limit_that_is_no_time_is_refused(command: str, limit: str, folder: Path) -> None:
    words = ["sweep", "base.yaml", "--out", "new"] if command == "sweep" else ["resume", "c"]
    told = call(*words, "--mission-timeout", limit)
    assert (told.exit_code, told.stderr.count("\n")) == (2, 1), told.stderr
    assert told.stderr.startswith(f"--mission-timeout {limit.replace('1e300', '1e+300')}: needs")
    assert not Path("new").exists()


def test_no_limit_may_be_written_as_infinite() -> None:
    assert call("sweep", "base.yaml", "--out", "c", "--mission-timeout", "inf").exit_code == 0


def test_a_running_campaign_is_seen_without_the_right_to_write(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The lock is looked at through a file that is open for reading."""
    opened = os.open

    def read_only(path: Path, flags: int, *mode: int) -> int:
        if flags & (os.O_RDWR | os.O_WRONLY):
            raise PermissionError(13, "Permission denied", str(path))
        return opened(path, flags, *mode)

    assert load_campaign(folder).state().status == "complete"
    with open(folder / "campaign.lock", "w") as file, monkeypatch.context() as patch:
        fcntl.flock(file, fcntl.LOCK_EX)
        patch.setattr(os, "open", read_only)
        assert load_campaign(folder).state().status == "running"


def test_points_are_laid_over_as_options_are() -> None:
    """A value put directly is what the same value means as an option."""
    text = f"{BASE}asvs: {{count: 2, formation: {{positions_m: [[0.0, 0.0], [50.0, 0.0]]}}}}\n"
    Path("base.yaml").write_text(text)
    points: list[dict[str, Any]] = [
        {"asvs.count": 2, "asvs.formation.positions_m.1.0": 7.5, "survey.depth_m": 1e-3},
        {"asvs.count": 2, "environment.origin": None, "protocol.tick_rate_hz": None},
        {"asvs.count": 2, "auvs.vehicle": {"model": "bluerov2"}, "navigation.filter": "kalman"},
    ]
    plan = sweep("base.yaml", points=points, detail="full").plan
    for point, planned in zip(points, plan.points, strict=True):
        overrides = [f"{key}={json.dumps(value)}" for key, value in point.items()]
        flown = Scenario.model_validate_json(planned.scenario)
        assert flown == load_scenario("base.yaml", overrides=overrides)
    with pytest.raises(ValueError, match="has no item 9"):
        sweep("base.yaml", points=[{"asvs.formation.positions_m.9": [0, 0]}])


def test_thousands_of_unknown_keys_are_all_told() -> None:
    """Those beyond the first hundreds without a guess at what was meant."""
    lines = "".join(f"durration_{number}: 1\n" for number in range(3000))
    Path("many.yaml").write_text(f"name: many\n{lines}")
    told = call("validate", "many.yaml").output.splitlines()
    unknown = [line for line in told if "unknown key" in line]
    assert len(unknown) == 3000
    assert 0 < sum("did you mean" in line for line in unknown) < 3000


SPINNING = """
import numpy as np
from bindusbl_des.support.compiled import compiled
from bindusbl_des.support.process import answered

@compiled
def spin(flags):
    turn = 0
    while flags[turn % 2] == 0.0:
        turn += 1
        flags[2 + turn % 3] = turn

def answer(count):
    print("answered", count, flush=True)
    flags[:2] = 1.0

flags = np.ones(5)
spin(flags)  # compiles it
flags[:] = 0.0
with answered(answer):
    print("ready", flush=True)
    spin(flags)
"""


def test_ctrl_c_is_answered_in_the_midst_of_compiled_code(tmp_path: Path) -> None:
    """Python obeys no signal before an equation returns, which this one does once answered."""
    script = tmp_path / "spinning.py"
    script.write_text(SPINNING)
    with subprocess.Popen(
        [sys.executable, script],
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])},
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    ) as process:
        try:
            assert process.stdout is not None
            assert process.stdout.readline() == "ready\n"
            time.sleep(0.5)
            process.send_signal(signal.SIGINT)
            said, _ = process.communicate(timeout=60)
        finally:
            process.kill()
    assert said == "answered 1\n"


def interrupted(_: CampaignState) -> None:
    """Send Ctrl-C once some missions are flown."""
    os.kill(os.getpid(), signal.SIGINT)


def test_the_first_ctrl_c_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    """A sweep says that it finishes what is under way, before that is finished."""
    said: list[str] = []

    def told(state: CampaignState) -> None:
        interrupted(state)
        said.append(capsys.readouterr().err)

    with pytest.raises(CampaignInterrupted):
        sweep("base.yaml", "c", seeds=2, quiet=False, progress=told)
    assert "stopping: the missions under way are finished; Ctrl-C again" in said[0]
    assert read_record("c")["status"] == "interrupted"


def test_an_interrupted_sweep_raises_and_goes_on() -> None:
    """However quiet: with the missions that it has, in a folder or not; the same call finishes."""

    def halved(out: str | None) -> CampaignInterrupted:
        with pytest.raises(CampaignInterrupted) as raised:
            sweep("base.yaml", out, seeds=5, quiet=True, progress=interrupted)
        return raised.value

    error = halved("c")
    assert error.folder == Path("c")
    assert str(error) == "2 of 5 missions are left; `resume('c')` or the same sweep goes on"
    assert len(error.campaign.missions) == 3
    with pytest.raises(ValueError, match=r"c: holds another campaign; name another folder"):
        sweep("base.yaml", "c", seeds=6)
    whole = sweep("base.yaml", "c", seeds=5, quiet=True)
    assert whole.record["status"] == "complete"
    same(whole, sweep("base.yaml", seeds=5))
    with pytest.raises(ValueError, match=r"c: holds this campaign, complete; name another"):
        sweep("base.yaml", "c", seeds=5)
    error = halved(None)
    assert "2 of 5 missions are left; `error.campaign.write(FOLDER)` keeps the others" in str(error)
    error.campaign.write("kept")
    assert resume("kept").state().missing == 0


def test_a_record_tells_what_is_checked(folder: Path) -> None:
    """What a sweep writes passes the check of what is read."""
    assert read_record(folder)["status"] == "complete"


def test_tables_without_any_row_are_whole() -> None:
    """Direct replies need no frames: a part whose table of them is empty lacks nothing."""
    Path("base.yaml").write_text(f"{BASE}protocol: {{downlink: direct_reply}}\n")
    done = call("sweep", "base.yaml", "--seeds", 2, "--detail", "full", "--out", "empty")
    assert done.exit_code == 0, done.output
    assert load_campaign("empty").missions.status.tolist() == ["ok"] * 2


# Names


def test_names_with_escape_sequences_never_reach_a_terminal(folder: Path) -> None:
    """What a folder is called is printed with its escapes written out, by whichever command."""
    odd = folder.rename("c\x1b[31mred\x9b1m")
    lines: list[tuple[object, ...]] = [
        ("status", odd), ("resume", odd), ("report", odd), ("report", odd, "--json"),
        ("plot", odd, "--force", "--out", "p\x1b[32m.svg"), ("plot", "error-vs-asvs", odd),
        ("compare", odd, odd), ("merge", odd, "--out", "m\x1b[33m"), ("export", odd, "--to", "csv"),
        ("sweep", "base.yaml", *SWEEP, "--out", odd), ("sweep", "base.yaml", "--out", "n\x1b[34m"),
    ]  # fmt: skip
    codes = []
    for line in (*lines, *((command, odd) for command in ("status", "resume", "report", "plot"))):
        if len(codes) == len(lines):
            (odd / "campaign.json").write_text("{")
        told = call(*line, color=True)
        assert "\x1b" not in told.output, line
        assert "\x9b" not in told.output, line
        codes.append(told.exit_code)
    assert codes[:4] == [0, 0, 0, 0]
    assert codes[len(lines) :] == [2, 2, 2, 2]

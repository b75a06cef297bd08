"""Result folders that were damaged, mixed up or made up: told in a line, never believed."""

import hashlib
import json
import random
import shutil
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from advice_for_tests import advised, effect
from campaigns_for_tests import sealed
from commands_for_tests import call
from damage_for_tests import changed, of_a_table, of_any_file, of_json, with_value
from results_for_tests import TABLES
from worlds import scenario

from bindusbl_des import Result, load_result, simulate
from bindusbl_des.support.wording import printable

HARM = {
    "auv": "AUV0", "with_m": 0.5, "without_m": 0.4, "mean_m": 0.1, "low_m": 0.05, "high_m": 0.15,
    "seeds": 4,
}  # fmt: skip
ADVICE = {
    "missions": 8, "error_m": 0.5, "effects": [effect("gain", "navigation.filter.gain=0.5")],
    "harms": [HARM], "harm_seeds": 4, "inert": ["more ASVs"],
}  # fmt: skip
COMMANDS: tuple[tuple[str, ...], ...] = (
    ("report", "--out", "page.html", "--force"),
    ("explain", "--ping", "0"),
    ("explain", "--fix", "1", "--json"),
    ("export", "--to", "csv", "--out", "csv", "--force"),
    ("export", "--to", "mcap", "--out", "m.mcap", "--force"),
    ("plot", "error", "--out", "error.png", "--force"),
    ("plot", "timeline", "--out", "timeline.png", "--force"),
)


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> Result:
    """A short mission with every table, and advice."""
    at_surface = {"survey": {"depth_m": 0.3}, "navigation": {"gnss_fix": {}}}
    short = {"duration_s": 20.0, "auvs": {"count": 2}, "record": {"tracks_hz": 1.0}}
    found = simulate(scenario(**short, **at_surface), 7)
    return advised(found, tmp_path_factory.mktemp("result") / "run", **ADVICE)


@pytest.fixture(scope="module")
def written(result: Result, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Its folder."""
    return result.write(tmp_path_factory.mktemp("written") / "run")


@pytest.fixture
def folder(written: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of its folder."""
    monkeypatch.chdir(tmp_path)
    return Path(shutil.copytree(written, tmp_path / "run"))


def ended(words: tuple[str, ...], folder: Path) -> tuple[int, str]:
    """Return how a command on a folder ended, and what it said if it refused."""
    done = call(words[0], folder, *words[1:])
    assert done.exception is None or isinstance(done.exception, SystemExit), done.exception
    return done.exit_code, done.stderr


@pytest.mark.parametrize("command", COMMANDS, ids=" ".join)
def test_a_sound_folder_is_read(folder: Path, command: tuple[str, ...]) -> None:
    """All commands that the damaged ones are tried on."""
    assert ended(command, folder)[0] == 0


@pytest.mark.parametrize("name", ["run.json", "advice.json"])
def test_a_record_that_is_not_ours_to_read_is_not_called_damaged(
    folder: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Chmod stops no administrator, who may be running the tests."""

    plain = open

    def denied(path: Any, *given: Any, **more: Any) -> Any:
        if Path(str(path)).name == name:
            raise PermissionError(13, "Permission denied", str(path))
        return plain(path, *given, **more)

    monkeypatch.setattr("builtins.open", denied)
    code, told = ended(("report", "--out", "page.html"), folder)
    assert code == 2
    assert f"{folder / name} cannot be read (Permission denied); ask its owner" in told


RUN_KEYS = [
    "status", "scenario", "scenario_sha256", "seed", "warnings", "versions", "wall_time_s",
    "sim_seconds_per_second",
]  # fmt: skip
ADVICE_KEYS = [
    "budget_missions", "missions", "error_m", "effects", "harms", "harm_seeds", "inert", "needless",
    "dropped", "untried", "shortage", "fixed_gain",
]  # fmt: skip


@pytest.mark.parametrize("every", [8, pytest.param(1, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", [*TABLES, "run.json", "advice.json"])
def test_whatever_happens_to_a_file_is_told(folder: Path, name: str, every: int) -> None:
    """Each damage is refused in a line that names the file and a remedy, or does no harm."""
    file = name if name.endswith(".json") else f"{name}.parquet"
    damages = list(of_any_file(file, seed=len(name)))
    if name == "run.json":
        damages += of_json(file, RUN_KEYS)
    elif name == "advice.json":
        damages += of_json(file, ADVICE_KEYS)
    else:
        damages += of_a_table(name, [other for other in TABLES if other != name])
    whole, told = (folder / file).read_bytes(), 0
    damages = damages[::every]
    for number, (what, damage) in enumerate(damages):
        damage(folder)
        refused = _refusal(folder)
        told += bool(refused)
        if refused:
            assert file in refused, what
            assert "bindusbl-des" in refused, what
            assert ended(COMMANDS[number % 5], folder) == (2, f"{refused}\n"), what
        else:
            for command in (COMMANDS[0], COMMANDS[1 + number % 4]):
                assert ended(command, folder)[0] in (0, 2), what
        if (folder / file).is_dir():
            (folder / file).rmdir()
        (folder / file).write_bytes(whole)
    assert told > 0.6 * len(damages), "hardly any damage was found"
    load_result(folder)


def _refusal(folder: Path) -> str:
    try:
        load_result(folder)
    except (ValueError, FileNotFoundError) as error:
        return printable(str(error))
    return ""


def flipped(whole: bytes, dice: random.Random) -> bytes:
    """Return bytes of which one bit is another."""
    at, bit = dice.randrange(len(whole)), 1 << dice.randrange(8)
    return whole[:at] + bytes([whole[at] ^ bit]) + whole[at + 1 :]


@pytest.mark.parametrize("count", [200, pytest.param(1000, marks=pytest.mark.slow)])
def test_no_flipped_bit_is_parsed(
    folder: Path, count: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Every table has its checksum in run.json, compared before Parquet's decoders see a byte."""
    monkeypatch.setattr(pq, "ParquetFile", None)
    dice = random.Random(count)
    for number in range(count):
        path = folder / f"{TABLES[number % len(TABLES)]}.parquet"
        whole = path.read_bytes()
        path.write_bytes(flipped(whole, dice))
        with pytest.raises(ValueError, match=r"its SHA-256 is not in run\.json") as caught:
            load_result(folder)
        assert str(caught.value).startswith(f"{path} is damaged")
        assert f"; run the mission again: bindusbl-des run {folder / 'scenario.yaml'}" in str(
            caught.value
        )
        path.write_bytes(whole)


@pytest.mark.parametrize("count", [30, pytest.param(500, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", ["run.json", "advice.json"])
def test_no_flipped_bit_of_a_record_is_believed(folder: Path, name: str, count: int) -> None:
    """Each record has its own checksum, which may lose its name: earlier versions have none."""
    path, dice, told = folder / name, random.Random(count), 0
    whole = path.read_bytes()
    for _ in range(count):
        path.write_bytes(flipped(whole, dice))
        if refused := _refusal(folder):
            assert refused.startswith(f"{path} is ")
            assert "bindusbl-des" in refused
            told += 1
        else:
            now, before = json.loads(path.read_bytes()), json.loads(whole)
            assert now.pop([*now][-1]) == before.pop("sha256")
            assert now == before
    assert told > 0.95 * count


def test_a_table_without_a_checksum_is_told(folder: Path) -> None:
    """Where run.json has checksums it has one for each table."""
    run = json.loads((folder / "run.json").read_text())
    assert set(run["tables_sha256"]) == set(TABLES)
    del run["tables_sha256"]["fixes"]
    (folder / "run.json").write_text(sealed(run))
    with pytest.raises(ValueError, match=r"fixes\.parquet has no checksum in run\.json; run"):
        load_result(folder)


def without_sums(folder: Path) -> None:
    """Have the record of an earlier version, which knew no checksums."""
    run = json.loads((folder / "run.json").read_text())
    del run["tables_sha256"], run["sha256"]
    (folder / "run.json").write_text(json.dumps(run))


def test_tables_of_another_mission_are_told(result: Result, folder: Path) -> None:
    """Another seed, another scenario, another version: the metadata says so."""
    without_sums(folder)
    for other, said in (
        (simulate(result.scenario, 8), "fixes.parquet is of another mission: its seed is 8, "),
        (simulate(scenario(duration_s=20.0, auvs={"count": 2}), 7), "its scenario_sha256 is "),
    ):
        there = other.write(folder.parent / "other", force=True)
        shutil.copy(there / "fixes.parquet", folder)
        with pytest.raises(ValueError, match=said):
            load_result(folder)
    newer = {**pq.read_schema(folder / "fixes.parquet").metadata, b"bindusbl.schema": b"fixes/2"}
    changed("fixes", lambda it: it.replace_schema_metadata(newer))(folder)
    with pytest.raises(ValueError, match="is of version 2; this package reads version 1"):
        load_result(folder)


@pytest.mark.parametrize("name", ["scenario.yaml", "data_dictionary.json"])
@pytest.mark.parametrize("damage", ["edited", "cut", "missing", "a folder"])
def test_what_says_what_tables_are_has_its_checksum(folder: Path, name: str, damage: str) -> None:
    """A scenario.yaml that was edited is not that of the tables beside it, and is refused."""
    path = folder / name
    whole = path.read_bytes()
    path.unlink()
    if damage == "a folder":
        path.mkdir()
    elif damage != "missing":
        path.write_bytes(whole + b"\n" if damage == "edited" else whole[:-9])
    try:
        with pytest.raises(ValueError, match="run the mission again: bindusbl-des run") as caught:
            load_result(folder)
        told, status = str(caught.value), ended(("report",), folder)
        assert status == (2, f"{printable(told)}\n")
    finally:
        if damage == "a folder":
            path.rmdir()
        path.write_bytes(whole)
    assert told.startswith(f"{path} is ")
    assert ("what was flown stands at scenario in" in told) == (name == "scenario.yaml")
    load_result(folder)


def test_an_edited_scenario_is_told(folder: Path) -> None:
    """The scenario in run.json is that of its fingerprint, or not believed."""
    run = json.loads((folder / "run.json").read_text())
    run["scenario"]["navigation"]["gain"] = 0.123
    (folder / "run.json").write_text(json.dumps(run))
    with pytest.raises(ValueError, match="scenario_sha256 is not that of its scenario"):
        load_result(folder)


def test_a_folder_of_an_older_version_is_read(folder: Path) -> None:
    """Its scenario lacks a key that came later: its fingerprint is of what was written then."""
    run = json.loads((folder / "run.json").read_text())
    before = run["scenario_sha256"]
    del run["scenario"]["usbl"]["quantum_s"], run["warnings"], run["tables_sha256"], run["sha256"]
    written = json.dumps(run["scenario"], sort_keys=True, separators=(",", ":"))
    after = run["scenario_sha256"] = hashlib.sha256(written.encode()).hexdigest()
    (folder / "run.json").write_text(json.dumps(run))
    for name in TABLES:
        metadata = pq.read_schema(folder / f"{name}.parquet").metadata
        assert metadata[b"bindusbl.scenario_sha256"].decode() == before
        signed = {**metadata, b"bindusbl.scenario_sha256": after.encode()}
        changed(name, lambda it, signed=signed: it.replace_schema_metadata(signed))(folder)
    assert load_result(folder).seed == 7


def test_units_are_the_packages_own(folder: Path, result: Result) -> None:
    """What a file calls its columns' units and meanings reaches nobody, nor do further columns."""
    without_sums(folder)

    def stranger(table: pa.Table) -> pa.Table:
        bare = pa.schema(
            [pa.field(it.name, it.type, metadata={"unit": "<b>"}) for it in table.schema]
        )
        table = pa.table(table.columns, schema=bare.with_metadata(table.schema.metadata))
        return table.append_column("more", pa.array(["x"] * len(table)))

    changed("pings", stranger)(folder)
    read, own = (it.arrow["pings"].schema for it in (load_result(folder), result))
    assert read.equals(own, check_metadata=True)


def test_what_would_fill_the_memory_is_not_read(folder: Path) -> None:
    """A large JSON file."""
    with open(folder / "run.json", "r+b") as file:
        file.truncate(10**12)  # with a hole: it takes no place on the disk
    with pytest.raises(ValueError, match=r"run\.json is damaged .*larger than 32,000,000 bytes"):
        load_result(folder)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[" * 100_000, "nested too deeply"), ('{"a": NaN}', "NaN is no number of JSON"),
        ('["\\ud800"]', "half a letter"), ("{", "Expecting"), ("1" * 5000, "digits"),
    ],
)  # fmt: skip
def test_json_that_is_none_is_told(folder: Path, text: str, said: str) -> None:
    """Depth, numbers and letters that Python would take, and what it would not."""
    (folder / "run.json").write_text(text)
    with pytest.raises(ValueError, match=rf"run\.json is damaged .*{said}"):
        load_result(folder)


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("harms", [{"auv": "AUV5"}], "harms: with_m is missing"),
        ("effects", [3], "effects holds no keys"),
        ("error_m", "<script>", "advice: error_m is not what it should be"),
        ("error_m", None, "error_m is null beside effects"),
        ("inert", [1], "inert is not what it should be"),
    ],
)
def test_advice_is_checked(folder: Path, key: str, value: Any, said: str) -> None:
    """Each field has its type; AUVs are those of the mission."""
    with_value("advice.json", key, value)(folder)
    with pytest.raises(ValueError, match=rf"advice\.json is damaged .*{said}.*--advice$"):
        load_result(folder)


def test_advice_of_strangers_is_told(folder: Path) -> None:
    """An AUV that the mission has not."""
    data = json.loads((folder / "advice.json").read_text())
    data["harms"][0]["auv"] = "AUV5"
    (folder / "advice.json").write_text(json.dumps(data))
    with pytest.raises(ValueError, match="harms: the mission has no 'AUV5'"):
        load_result(folder)


@pytest.mark.parametrize("name", ["~", "caf\udce9"])
def test_folders_whose_names_a_library_would_take_for_others(
    result: Result, tmp_path: Path, name: str
) -> None:
    """Neither a home nor what is no UTF-8: the folder that was named is read."""
    folder = result.write(tmp_path / name)
    assert folder.parent == tmp_path
    assert load_result(folder).auvs.equals(result.auvs)

"""Compiled code on disk: whatever lies there, functions give their results; damage is mended."""

import errno
import importlib.util
import os
import pickle
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from numba.core.caching import _CacheLocator
from numba.core.config import reload_config

from bindusbl_des import Scenario, simulate
from bindusbl_des.cli import main
from bindusbl_des.core.compiled import watch_compiling
from bindusbl_des.core.compiling import code_cache
from bindusbl_des.protocol import conflicts

TINY = """
from bindusbl_des.core.compiled import entry

@entry
def twice(number):
    return 2.0 * number
"""


class Bomb:
    """A pickle that does something when it is read."""

    def __reduce__(self) -> tuple[Any, tuple[str]]:
        return os.mkdir, ("exploded",)


@pytest.fixture(autouse=True)
def _untold(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    watch_compiling(None)  # what earlier commands wanted to be told
    monkeypatch.setenv(code_cache.TOLD, "")  # so that it is taken back
    monkeypatch.delenv(code_cache.TOLD)
    monkeypatch.setattr(code_cache, "troubles", [])
    monkeypatch.setattr(code_cache, "folders", set())
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "home"))
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    reload_config()  # or the first test would still keep code where that said
    monkeypatch.chdir(tmp_path)
    Path("tiny.py").write_text(TINY)


def hits() -> int:
    """Call the tiny function as a new process would; return how often its code was found kept."""
    found = importlib.util.spec_from_file_location("tiny", Path("tiny.py").absolute())
    assert found is not None
    assert found.loader is not None
    module = importlib.util.module_from_spec(found)
    found.loader.exec_module(module)
    assert module.twice(3.0) == 6.0
    return sum(module.twice.stats.cache_hits.values())


def kept() -> Path:
    """Return the file of the tiny function, which is made."""
    hits()
    (path,) = Path("__pycache__").glob("*.nbc")
    return path


def test_code_is_found_again(capsys: pytest.CaptureFixture[str]) -> None:
    """What one process compiled the next loads, unless the source has changed."""
    assert [hits(), hits()] == [0, 1]
    Path("tiny.py").write_text(TINY.replace("2.0 *", "number +"))
    assert [hits(), hits()] == [0, 1]
    assert len(list(Path("__pycache__").glob("*.nbc"))) == 1
    assert capsys.readouterr().err == ""


def test_code_that_is_kept_runs_without_what_compiles() -> None:
    """A new process runs kept code before numba has loaded its equations, and compiles after it.

    Nor does it load them for the code of numba's own that is part of ours.
    """
    Path("new.py").write_text("""
import sys
import numpy as np
from bindusbl_des.core.compiled import entry
from tiny import twice

@entry
def norm(vector):
    return np.sqrt((vector * vector).sum())

assert twice(3.0) == 6.0
before, result = "numba.np.npyimpl" in sys.modules, norm(np.array([3.0, 4.0]))
print(before, "numba.np.arraymath" in sys.modules, result, twice(4))
""")
    for loaded in ("True", "False"):
        run = subprocess.run([sys.executable, "new.py"], capture_output=True, text=True, check=True)
        assert run.stdout.split() == [loaded, loaded, "5.0", "8.0"]


def test_a_part_is_kept_in_what_calls_it() -> None:
    """Of what compiled code calls no code is kept but its caller's; Python may call it."""
    Path("tiny.py").write_text("""
from bindusbl_des.core.compiled import compiled, entry, inlined

@inlined
def sides(number):
    return number, 1.0 / number

@compiled
def doubled(number):
    return 2.0 * number

@entry
def twice(number):
    one, other = sides(number)
    return doubled(one) * one * other
""")
    assert [hits(), hits()] == [0, 1]
    assert [path.name.split("-")[0] for path in Path("__pycache__").glob("*.nbc")] == ["tiny.twice"]
    names: dict[str, Any] = {}
    exec(compile(Path("tiny.py").read_text(), str(Path("tiny.py").absolute()), "exec"), names)
    assert (names["doubled"](3.0), names["doubled"](3), names["sides"](2.0)) == (
        6.0,
        6.0,
        (2.0, 0.5),
    )
    assert names["twice"](0.0) != names["twice"](0.0), "0 / 0 is no number"
    assert (names["twice"](3.0), names["doubled"](4.0)) == (6.0, 8.0)


def test_compiled_code_does_not_call_what_python_enters() -> None:
    """It could where that was just compiled, and not where it was read from the disk."""
    Path("tiny.py").write_text(
        f"{TINY}\n@entry\ndef fourfold(number):\n    return twice(twice(number))"
    )
    names: dict[str, Any] = {}
    exec(compile(Path("tiny.py").read_text(), str(Path("tiny.py").absolute()), "exec"), names)
    with pytest.raises(AssertionError, match="twice is an entry"):
        names["fourfold"](2.0)


@pytest.mark.parametrize("damage", ["empty", "cut", "bit", "text", "foreign"])
def test_a_damaged_file_is_told_once_and_mended(
    damage: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """It is never unpickled: code is compiled anew, and the next process finds it sound."""
    path = kept()
    whole = path.read_bytes()
    flipped = whole[:-50] + bytes([whole[-50] ^ 1]) + whole[-49:]
    path.write_bytes(
        {"empty": b"", "cut": whole[:300], "bit": flipped, "text": b"no code",
         "foreign": pickle.dumps(Bomb())}[damage]
    )  # fmt: skip
    assert hits() == 0
    line = f"Compiled code in {path.parent.absolute()}: {path.name} is damaged"
    err = capsys.readouterr().err
    assert (err.startswith(line), err.count("\n")) == (True, 1)
    assert not Path("exploded").exists()
    assert (hits(), path.read_bytes()[:8]) == (1, b"bindusbl")


def test_a_full_disk_is_told_and_nothing_stays(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Code that cannot be written is used all the same."""

    def full(path: Path, data: bytes) -> int:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(Path, "write_bytes", full)
    assert [hits(), hits()] == [0, 0]
    told = capsys.readouterr().err.splitlines()
    assert len(told) == 1
    assert "__pycache__: cannot be written (No space left on device)" in told[0]
    left = {path.suffix for path in Path("__pycache__").iterdir()}
    assert left <= {".lock", ".pyc"}  # whose turn it was, and Python's own


def test_code_that_everybody_can_write_is_not_used(capsys: pytest.CaptureFixture[str]) -> None:
    """A folder open to all is passed over, its contents unread; another one serves."""
    folder = kept().parent.absolute()
    folder.chmod(0o777)
    assert [hits(), hits()] == [0, 1]
    assert capsys.readouterr().err.startswith(
        f"Compiled code in {folder}: not used, since it can be written by everybody; "
    )
    assert list(Path("home").rglob("*.nbc"))


def test_code_of_another_user_is_not_used(monkeypatch: pytest.MonkeyPatch) -> None:
    """Only the user, root, and the owner of the source may have written it."""
    monkeypatch.setattr(os, "geteuid", lambda: 1001)
    trusted = code_cache.trusted_beside("tiny.py")
    of = {uid: os.stat_result((0o40755, 1, 1, 1, uid, 0, 0, 0, 0, 0)) for uid in (0, 1001, 1002)}
    assert [trusted(of[0]), trusted(of[1001])] == ["", ""]
    assert trusted(of[1002]) == "belongs to another user"
    sticky = os.stat_result((0o41777, 1, 1, 1, 0, 0, 0, 0, 0, 0))
    assert trusted(sticky) == ""


def test_a_file_in_the_place_of_every_folder(capsys: pytest.CaptureFixture[str]) -> None:
    """Without any folder each process compiles for itself, and says why."""
    Path("__pycache__").touch()
    Path("home").touch()
    assert [hits(), hits()] == [0, 0]
    told = capsys.readouterr().err.splitlines()
    assert len(told) == 1
    assert str(Path.cwd()) in told[0]


def doctor() -> str:
    """Return what the doctor says of the cache."""
    lines = CliRunner().invoke(main, ["doctor"]).stdout.splitlines()
    return next(line for line in lines if "numba cache" in line)


def test_the_doctor_names_damaged_files(monkeypatch: pytest.MonkeyPatch) -> None:
    """Also files that no tiny mission would load; afterwards all is well."""
    assert doctor().startswith("ok ")
    path = kept()
    path.write_bytes(path.read_bytes()[:-1])
    assert doctor().startswith(f"broken  numba cache     {path.absolute()} is damaged; delete it")
    path.unlink()
    assert doctor().startswith("ok ")


def test_the_doctor_keeps_and_loads(monkeypatch: pytest.MonkeyPatch) -> None:
    """A folder that could be written to as its permissions say, and yet cannot."""

    @contextmanager
    def full(path: Path) -> Iterator[Path]:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        yield path

    monkeypatch.setattr(code_cache, "draft_of", full)
    said = doctor()
    assert said.startswith("broken")
    assert "No space left" in said


@pytest.mark.slow
def test_a_sweep_goes_on_with_a_damaged_cache(tmp_path: Path) -> None:
    """Missions of all workers succeed; one line tells of it."""
    source = Path(conflicts.__file__).parent
    simulate(Scenario(name="m", duration_s=5.0))  # compiles what is not kept yet
    place: Any = _CacheLocator
    folder = tmp_path / "cache" / place.get_suitable_cache_subpath(source / "x.py")
    shutil.copytree(source / "__pycache__", folder)
    for kept_one in folder.glob("conflicts._survey-*.nbc"):  # of other versions as well
        kept_one.write_bytes(b"")
    Path("f.yaml").write_text("name: m\nduration_s: 5\n")
    words = "sweep f.yaml --seeds 2 --workers 2 --out swept --json"
    done = subprocess.run(
        [sys.executable, "-m", "bindusbl_des.cli", *words.split()],
        env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache")},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr.count(f"Compiled code in {folder}: conflicts._survey-") == 1
    assert done.stderr.count("is damaged") == 1
    assert "Traceback" not in done.stderr

"""Compiled code on disk: whatever lies there, functions give their results, and never old ones."""

import ast
import builtins
import errno
import importlib.util
import os
import subprocess
import sys
import textwrap
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numba
import pytest
from commands_for_tests import call as command

from bindusbl_des.support import compiled as module

PACKAGE = module.PACKAGE
TINY = """
from bindusbl_des.support.compiled import compiled
from keel import FACTOR

@compiled
def scaled(number):
    return FACTOR * number
"""
DECORATORS = {"compiled", "inlined", "written_out"}


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Keep code in a folder that is taken for the package, where a tiny equation stands."""
    monkeypatch.setenv(module.TOLD, "")  # so that it is taken back
    monkeypatch.delenv(module.TOLD)
    monkeypatch.setattr(module, "troubles", [])
    monkeypatch.setattr(module, "PACKAGE", tmp_path)
    monkeypatch.setattr(module, "NUMBERS", ("keel.py",))
    monkeypatch.setattr(numba.config, "CACHE_DIR", "")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "home"))
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    Path("tiny.py").write_text(TINY)
    Path("keel.py").write_text("FACTOR = 2.0\n")
    forget()
    yield tmp_path
    monkeypatch.undo()
    forget()


def forget() -> None:
    """Know as little as a new process."""
    module.kept_in.cache_clear()
    module.stamp.cache_clear()
    sys.modules.pop("keel", None)


def call() -> tuple[float, int]:
    """Call the tiny equation as a new process would; return its answer, and how often its code was
    found kept.
    """
    forget()
    found = importlib.util.spec_from_file_location("tiny", Path("tiny.py").absolute())
    assert found is not None
    assert found.loader is not None
    tiny = importlib.util.module_from_spec(found)
    found.loader.exec_module(tiny)
    return tiny.scaled(3.0), sum(tiny.scaled.stats.cache_hits.values())


def kept(ending: str) -> list[Path]:
    return sorted(Path.cwd().rglob(f"*.{ending}"))


@pytest.mark.usefixtures("home")
def test_code_is_found_again_until_a_file_that_it_is_made_of_changes(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Also one that only gives it a number; what was compiled before then goes."""
    assert [call(), call()] == [(6.0, 0), (6.0, 1)]
    Path("keel.py").write_text("FACTOR = 5.00\n")
    assert [call(), call()] == [(15.0, 0), (15.0, 1)]
    Path("tiny.py").write_text(TINY.replace("FACTOR *", "1.0 * FACTOR +"))
    assert [call(), call()] == [(8.0, 0), (8.0, 1)]
    assert len(kept("nbc")) == 1
    assert capsys.readouterr().err == ""


@pytest.mark.usefixtures("home")
def test_a_page_makes_no_code_stale() -> None:
    before = module.stamp()
    Path("page.py").write_text("print('worth reading')\n")
    forget()
    assert module.stamp() == before


@pytest.mark.usefixtures("home")
@pytest.mark.parametrize("damaged", ["nbi", "nbc"])
@pytest.mark.parametrize("content", [b"", b"no code"])
def test_a_damaged_file_is_told_once_and_mended(
    damaged: str, content: bytes, capsys: pytest.CaptureFixture[str]
) -> None:
    call()
    (path,) = kept(damaged)
    path.write_bytes(content)
    assert [call(), call()] == [(6.0, 0), (6.0, 1)]
    (told,) = capsys.readouterr().err.splitlines()
    assert "is damaged, and begun anew" in told


@pytest.mark.usefixtures("home")
def test_a_full_disk_is_told_once_and_ends_nothing(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "replace", full)
    assert [call(), call()] == [(6.0, 0), (6.0, 0)]
    (told,) = capsys.readouterr().err.splitlines()
    assert "cannot be written to (No space left on device)" in told


@pytest.mark.usefixtures("home")
def test_code_that_others_could_write_is_not_used(capsys: pytest.CaptureFixture[str]) -> None:
    """Its folder is passed over; one of the user's own serves."""
    call()
    (folder,) = {path.parents[1] for path in kept("nbc")}
    folder.chmod(0o777)
    assert [call(), call()] == [(6.0, 0), (6.0, 1)]
    assert [path.is_relative_to(folder) for path in kept("nbc")] == [True, False]
    found = os.stat_result((0o40755, 1, 1, 1, 54321, *5 * [0]))
    of_another: Any = SimpleNamespace(stat=lambda: found)
    assert module._objection(of_another) == "belongs to another user"
    assert capsys.readouterr().err == ""


@pytest.mark.usefixtures("home")
def test_without_any_folder_each_process_compiles(capsys: pytest.CaptureFixture[str]) -> None:
    """As in a read-only installation of a user without a home; one line says why."""
    Path("__pycache__").touch()
    Path("home").touch()
    assert [call(), call()] == [(6.0, 0), (6.0, 0)]
    (told,) = capsys.readouterr().err.splitlines()
    assert str(Path("__pycache__/compiled").absolute()) in told
    assert str(Path("home").absolute()) in told


@pytest.mark.usefixtures("home")
def test_the_user_may_say_where_code_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(Path("there").absolute()))
    assert [call(), call()] == [(6.0, 0), (6.0, 1)]
    assert all(path.is_relative_to(Path("there").absolute()) for path in kept("nbc"))


def test_what_is_outside_the_package_is_not_kept(tmp_path: Path) -> None:
    """Nobody knows of what it is made."""
    source = tmp_path / "own.py"
    source.write_text("def half(number):\n    return number / 2.0\n")
    names: dict[str, Any] = {}
    exec(compile(source.read_text(), str(source), "exec"), names)
    assert module.compiled(names["half"])(3.0) == 1.5
    assert not list(tmp_path.rglob("*.nbc"))


@pytest.mark.usefixtures("home")
def test_of_two_processes_one_compiles_and_the_other_loads() -> None:
    """Both wanting code for integers and numbers at once: neither takes the other's."""
    program = """
        from pathlib import Path
        from bindusbl_des.support import compiled
        compiled.PACKAGE = Path.cwd()
        from tiny import scaled
        assert (scaled({}), scaled({})) == (8.0, 8.0)
        print(sum(scaled.stats.cache_hits.values()))
    """
    side_by_side = [
        subprocess.Popen(
            [sys.executable, "-c", textwrap.dedent(program.format(*numbers))],
            stdout=subprocess.PIPE, text=True, env={"PYTHONPATH": str(PACKAGE.parent)},
        )
        for numbers in (("4", "4.0"), ("4.0", "4"))
    ]  # fmt: skip
    assert sum(int(it.communicate(timeout=100)[0]) for it in side_by_side) == 2
    assert len(kept("nbc")) == 2


def test_the_doctor_says_where_code_is_kept(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def line() -> str:
        forget()
        told = command("doctor").stdout.splitlines()
        return next(it for it in told if "compiled code" in it)

    # Its tiny mission is not asked about: where no code is kept yet, that is compiled for minutes.
    monkeypatch.setitem(sys.modules, "bindusbl_des.core.mission.simulation", None)
    monkeypatch.setattr(module, "PACKAGE", PACKAGE)
    monkeypatch.setattr(module, "_roots", lambda: [home / "code"])
    assert line().startswith(f"ok      compiled code   {home / 'code'}")
    monkeypatch.setattr(module, "_roots", lambda: [home / "keel.py"])
    assert line().startswith(f"broken  compiled code   {home / 'keel.py'} cannot be written to")


def test_numba_is_used_by_its_public_face() -> None:
    """What is below that changes with each version of it."""
    private = [
        path
        for path in PACKAGE.rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text()))
        for name in _imported(node)
        if name.startswith("llvmlite")
        or (name.startswith("numba.") and not name.startswith("numba.extending"))
    ]
    assert private == []


def _imported(node: ast.AST) -> list[str]:
    if isinstance(node, ast.Import):
        return [it.name for it in node.names]
    if isinstance(node, ast.ImportFrom) and not node.level:
        return [f"{node.module}.{it.name}" for it in node.names if node.module != "numba"]
    return []


@cache
def _names(path: Path) -> tuple[dict[str, ast.AST], dict[str, tuple[Path, str]]]:
    """Return what a file defines, and whence it has each name that it imports from our own."""
    defined: dict[str, ast.AST] = {}
    imported: dict[str, tuple[Path, str]] = {}
    for node in ast.parse(path.read_text()).body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            defined[node.name] = node
        elif isinstance(node, ast.Assign | ast.AnnAssign):
            for target in ast.walk(node):
                if isinstance(target, ast.Name) and isinstance(target.ctx, ast.Store):
                    defined[target.id] = node
        elif isinstance(node, ast.ImportFrom) and node.level:
            folder = path.parents[node.level - 1].joinpath(*(node.module or "").split("."))
            for it in node.names:
                inside, beside = folder / f"{it.name}.py", folder.with_suffix(".py")
                package = folder / it.name / "__init__.py"
                whole = next((one for one in (inside, package) if one.is_file()), None)
                source = beside if beside.is_file() else folder / "__init__.py"
                imported[it.asname or it.name] = (whole, "") if whole else (source, it.name)
    return defined, imported


def _sources() -> set[Path]:
    """Return the files of all that equations are made of, by the names that they use."""
    due = [
        (path, name)
        for path in PACKAGE.rglob("*.py")
        for name, node in _names(path)[0].items()
        if isinstance(node, ast.FunctionDef)
        and any(isinstance(it, ast.Name) and it.id in DECORATORS for it in node.decorator_list)
    ]
    seen = set(due)
    while due:
        path, name = due.pop()
        defined, imported = _names(path)
        if name in imported:
            further = {imported[name]}
        elif name in defined:
            used = {it.id for it in ast.walk(defined[name]) if isinstance(it, ast.Name)}
            used -= set(dir(builtins)) | DECORATORS
            further = {(path, it) for it in used & (set(defined) | set(imported))}
        else:
            further = set()
        due += further - seen
        seen |= further
    return {path for path, name in seen if not name or name in _names(path)[0]}


def test_code_is_known_by_all_files_that_it_is_made_of() -> None:
    """Numbers, rows and tuples too: an event with one number more moves those behind it."""
    known = set(module.equation_files())
    lacking = [it.relative_to(PACKAGE).as_posix() for it in sorted(_sources() - known)]
    assert lacking == [], "name them in NUMBERS of support/compiled.py"
    assert {PACKAGE / it for it in module.NUMBERS} <= known

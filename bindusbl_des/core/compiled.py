"""Equations of the sea turned into machine code once, and kept on disk for the next mission.

numba knows a cached function to be stale only if the function's own file changed, so an edited
hull model would leave the old physics inside the integrator that calls it. `entry` stamps the
cache with every source file that the function is made of instead, and with no other.
"""

import hashlib
import re
from collections.abc import Callable
from functools import cache
from pathlib import Path
from time import monotonic
from typing import Any, TypeVar, cast

import numba
from numba.core import event

from .compiling.code_cache import CodeCache, trouble
from .compiling.compiler import WholeCompiler, equation

Function = TypeVar("Function", bound=Callable[..., object])

# Division by zero as in numpy; other threads run meanwhile, so that Ctrl-C is answered; and no C
# code calls it.
OPTIONS: dict[str, Any] = {"error_model": "numpy", "nogil": True, "no_cfunc_wrapper": True}

PACKAGE = Path(__file__).resolve().parents[1]

# How equations are compiled.
HOW = [Path(__file__).resolve(), *sorted((PACKAGE / "core/compiling").glob("*.py"))]

# What a file imports from files beside it: `from .motion import where`, `from . import logs`
IMPORT = re.compile(rb"^from (\.*)([\w.]*) import (\([^)]*\)|[^\n]*)", re.MULTILINE)
COMPILES = re.compile(
    rb"^from ((\.+(core\.)?|bindusbl_des\.core\.)compiled|numba\.extending) import", re.MULTILINE
)


@cache
def _text(source: Path) -> bytes:
    return source.read_bytes()


@cache
def _made_of(source: Path) -> frozenset[Path]:
    """Return the files that a file's equations take code or numbers from, itself included.

    Those are the files of equations that it imports, and so on; the files of numbers, where a name
    in capitals, or a module as a whole, comes from; and what these make them of: files beside them.
    """
    found, due = {source}, [source]
    while due:
        file = due.pop()
        for imported, names in _imports(file):
            named = any(map(str.isupper, names)) or not names
            beside = imported.parent == file.parent and not _compiles(file)
            if imported not in found and (named or beside or _compiles(imported)):
                found.add(imported)
                due.append(imported)
    return frozenset(found)


@cache
def _compiles(source: Path) -> bool:
    return COMPILES.search(_text(source)) is not None


@cache
def _imports(source: Path) -> list[tuple[Path, list[str]]]:
    """Return the files of its folders, or of ours, that a file imports, and the names that it takes
    of each.
    """
    found: list[tuple[Path, list[str]]] = []
    for dots, module, listed in IMPORT.findall(_text(source)):
        parts = module.decode().split(".")
        if not dots and parts[0] != PACKAGE.name:
            continue
        folder = (source.parents[len(dots) - 1] if dots else PACKAGE.parent).joinpath(*parts)
        names = re.findall(r"\w+", re.sub(r"#.*| as \w+", "", listed.decode()))
        if folder.with_suffix(".py").is_file():
            found.append((folder.with_suffix(".py"), names))
        for name in names:
            if (folder / f"{name}.py").is_file():
                found.append((folder / f"{name}.py", []))
    return found


@cache
def _digest(source: Path) -> str:
    """Return the fingerprint of all that a file's equations are made of.

    Files outside the package may import each other in any way: theirs are all of their folder.
    """
    outside = () if PACKAGE in source.parents else source.parent.glob("*.py")
    total = hashlib.sha256()
    for file in (*HOW, *sorted({*_made_of(source), *outside})):
        total.update(_text(file))
    return total.hexdigest()


def inlined(function: Function) -> Function:
    """Return a compiled equation that others contain wherever they call it.

    For short ones that return a tuple: handing that over takes longer than to work it out.
    """
    return compiled(function, forceinline=True)


def written_out(function: Function) -> Function:
    """Return a compiled equation whose lines take the place of each call of it.

    For those that return views of arrays: whoever calls one of another kind has to count who holds
    them (:mod:`.compiling.counting`).
    """
    return compiled(function, inline="always")


def compiled(function: Function, **options: Any) -> Function:
    """Return an equation for compiled code to call; its type stays what it was.

    It is compiled on its first use as a part of what calls it, and kept on disk as such only.
    Where Python calls it, as tests do, an :func:`entry` is made of it.
    """
    whole = cache(lambda: entry(function))
    return cast(Function, equation(function, whole, **OPTIONS, **options))


def entry(function: Function) -> Function:
    """Return an equation by which Python enters compiled code; its type stays what it was.

    It is compiled on its first use, and kept on disk.  Compiled code is IEEE arithmetic in the
    order written (no fastmath), so results repeat bit for bit on one machine.  Division by zero
    gives infinity as in numpy (`error_model="numpy"`): the integrator reports it with its time, and
    no division pays for a test.  Where no folder can be used (read-only installation without a
    home), the code is compiled anew by each process.

    numba takes a tuple of arrays apart ten times slower than the arrays by themselves, so what is
    called at every event may have arguments that stand flat.  What an equation is given again and
    again is handed over once instead, and opened inside (:mod:`.handing.handed`).
    """
    dispatcher: Any = numba.njit(pipeline_class=WholeCompiler, **OPTIONS)(function)
    source = _file(function)
    try:
        kept = dispatcher._cache = CodeCache(function, _digest(source))
        dispatcher.compile = kept.in_turn(dispatcher.compile)
    except (RuntimeError, AttributeError, OSError):  # no place to cache, another numba, a zip file
        if not source.name.startswith("<"):  # what was typed at a prompt has no place
            trouble(source.parent, "no folder can be written to keep it")
    return cast(Function, dispatcher)


def _probe(number: float) -> float:
    return number / 2.0


def kept_and_loaded() -> bool:
    """Tell whether code is found again on the disk after it was compiled and kept there.

    Raises:
        OSError: when what was kept before cannot be deleted.
    """
    first: Any = entry(_probe)
    first._cache.flush()
    first(1.0)
    again: Any = entry(_probe)
    again(1.0)
    return bool(again.stats.cache_hits)


# Hears, as each function is begun, how many were begun before it, and for how long (s) all took.
Told = Callable[[int, float], None]


class _Watch(event.Listener):
    """Sees functions being compiled that no cache holds; tells whoever asked last."""

    def __init__(self) -> None:
        self.functions = self._open = 0
        self._spent = self._began = 0.0
        self.tell: Told | None = None

    @property
    def seconds(self) -> float:
        """The time (s) that all compiling has taken so far."""
        return self._spent + (monotonic() - self._began if self._open else 0.0)

    def on_start(self, _: Any) -> None:
        if not self._open:
            self._began = monotonic()
        self._open += 1
        if self.tell is not None:
            self.tell(self.functions, self.seconds)
        self.functions += 1

    def on_end(self, _: Any) -> None:
        self._open -= 1  # one function is compiled in the midst of another that calls it
        if not self._open:
            self._spent += monotonic() - self._began


_WATCH = _Watch()
event.register("numba:compile", _WATCH)  # type: ignore[no-untyped-call]


def watch_compiling(tell: Told | None) -> None:
    """Have somebody told from now on, in the place of whoever asked before, how far it is."""
    functions, seconds = _WATCH.functions, _WATCH.seconds
    _WATCH.tell = tell and (lambda made, spent: tell(made - functions, spent - seconds))


def compiling_s() -> float:
    """Return the time (s) that compiling has taken in this process so far."""
    return _WATCH.seconds


def _file(function: Callable[..., object]) -> Path:
    return Path(function.__code__.co_filename).resolve()

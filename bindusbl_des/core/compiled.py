"""Equations of the sea turned into machine code once, and kept on disk for the next mission.

numba knows a cached function to be stale only if the function's own file changed, so an edited
hull model would leave the old physics inside the integrator that calls it. `compiled` stamps the
cache with every source file that the function is made of instead, and with no other.
"""

import hashlib
import re
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
from numba.core import event

from .code_cache import CodeCache, trouble

Function = TypeVar("Function", bound=Callable[..., object])

# Division by zero as in numpy; and other threads run meanwhile, so that Ctrl-C is answered.
OPTIONS: dict[str, Any] = {"error_model": "numpy", "nogil": True}

PACKAGE = Path(__file__).resolve().parents[1]

# What a file imports from files beside it: `from .motion import where`, `from . import logs`
IMPORT = re.compile(rb"^from (\.*)([\w.]*) import (\([^)]*\)|[^\n]*)", re.MULTILINE)
COMPILES = re.compile(rb"^from (\.+(core\.)?|bindusbl_des\.core\.)compiled import", re.MULTILINE)


@cache
def _text(source: Path) -> bytes:
    return source.read_bytes()


@cache
def _made_of(source: Path) -> frozenset[Path]:
    """Return the files that a file's equations take code or numbers from, itself included.

    Those are the files of equations that it imports, and so on, and the files of numbers: where a
    name in capitals, or a module as a whole, comes from.
    """
    found, due = {source}, [source]
    while due:
        for imported, names in _imports(due.pop()):
            compiles = COMPILES.search(_text(imported)) is not None
            if imported not in found and (compiles or any(map(str.isupper, names)) or not names):
                found.add(imported)
                if compiles:
                    due.append(imported)
    return frozenset(found)


def _imports(source: Path) -> Iterator[tuple[Path, list[str]]]:
    """Yield the files that a file imports relatively, and the names that it takes of each."""
    for dots, module, listed in IMPORT.findall(_text(source)):
        if not dots:
            continue
        folder = source.parents[len(dots) - 1].joinpath(*module.decode().split("."))
        names = re.findall(r"\w+", re.sub(r"#.*| as \w+", "", listed.decode()))
        if folder.with_suffix(".py").is_file():
            yield folder.with_suffix(".py"), names
        for name in names:
            if (folder / f"{name}.py").is_file():
                yield folder / f"{name}.py", []


@cache
def _digest(source: Path) -> str:
    """Return the fingerprint of all that a file's equations are made of.

    Files outside the package may import each other in any way: theirs are all of their folder.
    """
    outside = () if PACKAGE in source.parents else source.parent.glob("*.py")
    total = hashlib.sha256(repr(OPTIONS).encode())
    for file in sorted({*_made_of(source), *outside}):
        total.update(_text(file))
    return total.hexdigest()


def inlined(function: Function) -> Function:
    """Return a compiled equation that becomes a part of those that call it.

    For short ones that return a tuple: handing that over takes longer than to work it out.
    """
    return compiled(function, inline="always")


def entry(function: Function) -> Function:
    """Return a compiled equation by which Python enters compiled code, argument by argument.

    numba takes a tuple of arrays apart ten times slower than the arrays by themselves, so here, and
    only here, arguments stand flat however many they are; inside they are put together again.
    """
    return compiled(function)


def compiled(function: Function, **options: Any) -> Function:
    """Return the equation compiled by numba on its first use; its type stays what it was.

    Compiled code is IEEE arithmetic in the order written (no fastmath), so results repeat bit for
    bit on one machine. Division by zero gives infinity as in numpy (`error_model="numpy"`): the
    integrator reports it with its time, and no division pays for a test. Where no folder can be
    used (read-only installation without a home), the code is compiled anew by each process.
    """
    dispatcher: Any = numba.njit(**OPTIONS, **options)(function)
    source = _file(function)
    try:
        dispatcher._cache = CodeCache(function, _digest(source))
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
    first: Any = compiled(_probe)
    first._cache.flush()
    first(1.0)
    again: Any = compiled(_probe)
    again(1.0)
    return bool(again.stats.cache_hits)


class _Watch(event.Listener):
    """Sees functions being compiled that no cache holds; tells whoever asked last, once."""

    tell: Callable[[], None] | None = None

    def on_start(self, event: object) -> None:
        tell, self.tell = self.tell, None
        if tell is not None:
            tell()

    def on_end(self, event: object) -> None:
        pass


_WATCH = _Watch()
event.register("numba:compile", _WATCH)  # type: ignore[no-untyped-call]


def before_compiling(tell: Callable[[], None]) -> None:
    """Have somebody told, once, before the next function is compiled that no cache holds."""
    _WATCH.tell = tell


def _file(function: Callable[..., object]) -> Path:
    return Path(function.__code__.co_filename).resolve()

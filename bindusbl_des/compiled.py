"""Equations of the sea turned into machine code once, and kept on disk for the next mission.

numba knows a cached function to be stale only if the function's own file changed, so an edited
hull model would leave the old physics inside the integrator that calls it. `compiled` stamps the
cache with every source file that the function can be made of instead.
"""

import hashlib
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
from numba.core import event

Function = TypeVar("Function", bound=Callable[..., object])


PACKAGE = Path(__file__).resolve().parent

# Files whose numbers compiled equations take in.
NAMES = ("columns", "events")


@cache
def _digest(folder: Path) -> str:
    """Return the fingerprint of the sources that a function in a folder can be made of.

    Those are the folder's own, and the package's folders of equations; in the package's first
    folder, where few files are compiled, only those that are and those that name what they write.
    """
    total = hashlib.sha256()
    for source in sorted({*PACKAGE.rglob("*.py"), *folder.glob("*.py")}):
        text = source.read_bytes()
        if source.parent != PACKAGE or source.stem in NAMES or b".compiled import" in text:
            total.update(text)
    return total.hexdigest()


def inlined(function: Function) -> Function:
    """Return a compiled equation that becomes a part of those that call it.

    For short ones that return a tuple: handing that over takes longer than to work it out.
    """
    return compiled(function, inline="always")


def compiled(function: Function, **options: Any) -> Function:
    """Return the equation compiled by numba on its first use; its type stays what it was.

    Compiled code is IEEE arithmetic in the order written (no fastmath), so results repeat bit for
    bit on one machine. Division by zero gives infinity as in numpy (`error_model="numpy"`): the
    integrator reports it with its time, and no division pays for a test. Where no folder can be
    written (read-only installation without a home), the code is compiled anew by each process.
    """
    try:
        dispatcher: Any = numba.njit(cache=True, error_model="numpy", **options)(function)
        dispatcher._cache._cache_file._source_stamp = _digest(_folder(function))
    except (RuntimeError, AttributeError, OSError):  # no place to cache, another numba, a zip file
        dispatcher = numba.njit(error_model="numpy", **options)(function)
    return cast(Function, dispatcher)


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


def _folder(function: Callable[..., object]) -> Path:
    return Path(function.__code__.co_filename).resolve().parent

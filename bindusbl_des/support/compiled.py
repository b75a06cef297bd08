"""Equations turned into machine code once, and kept on disk for the next mission.

Theory of operation
-------------------
An equation is a function marked `@compiled`: numba compiles it when it is first called with
arguments of some types, and keeps the code on disk.  One marked `@inlined` becomes part of whatever
calls it.  Both are IEEE arithmetic in the order written, so that results repeat bit for bit.

numba knows kept code to be stale only if the function's own file changed; an edited hull would
leave its old physics inside the integrator that calls it.  So code is kept in a folder that is
named by one hash of all files that hold equations or numbers that these take (`NUMBERS`): an edit
of any of them begins a new folder, and the old one goes.  Of several processes that want the same
equation one compiles it, and the others wait and load it.  Trouble with the disk is told once and
ends no mission; code is then compiled anew by each process.

With NUMBA_DISABLE_JIT=1 equations run in Python (:mod:`.uncompiled`).
"""

import hashlib
import os
import pickle
import platform
import re
import shutil
import stat
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from threading import get_ident
from time import monotonic, sleep
from typing import Any, TypeVar, cast
from zlib import crc32

import numba

from .uncompiled import uncompiled

Function = TypeVar("Function", bound=Callable[..., object])

# Division by zero as in numpy; other threads run meanwhile, so that Ctrl-C is answered; and no C
# code calls it.
OPTIONS: dict[str, Any] = {"error_model": "numpy", "nogil": True, "no_cfunc_wrapper": True}

# numba's settings, whose types it does not tell.
CONFIG: Any = numba.config

PACKAGE = Path(__file__).resolve().parents[1]

# How one sees that a file holds equations.
MARKS = re.compile(rb"^@(compiled|inlined|written_out)$", re.MULTILINE)

# Files that hold no equations, from which equations take numbers and rows.
NUMBERS = (
    *(
        "support/arrays.py",
        "support/compiled.py",
        "support/facts.py",
        "support/packed.py",
        "support/uncompiled.py",
    ),
    "core/geometry/paths.py",
    "core/navigation/correcting.py",
    *("apps/planning/prediction/sights.py", "core/records/events.py"),
    *("core/records/rows.py", "core/scenario/own_sensors.py"),
)

#: Why compiled code is not kept, a line each.
troubles: list[str] = []
# Tells processes that are started by this one that the user has been told.
TOLD = "BINDUSBL_DES_CODE_CACHE_TOLD"

UNCOMPILED = "none, since NUMBA_DISABLE_JIT is set: missions take some 100 times as long; unset it"


def inlined(function: Function) -> Function:
    """Return a compiled equation that others contain wherever they call it.

    For short ones that return a tuple: handing that over takes longer than to work it out.
    """
    return compiled(function, forceinline=True)


def written_out(function: Function) -> Function:
    """Return a compiled equation whose lines take the place of each call of it.

    For those that return records, which numba does not hand over by value.
    """
    return compiled(function, inline="always")


def compiled(function: Function, **options: Any) -> Function:
    """Return an equation as machine code; its type stays what it was.

    It is compiled on its first use, and kept on disk.  Compiled code is IEEE arithmetic in the
    order written (no fastmath), so results repeat bit for bit on one machine.  Division by zero
    gives infinity as in numpy (`error_model="numpy"`): the integrator reports it with its time, and
    no division pays for a test.  Code is compiled anew by each process where no folder can be used
    (read-only installation without a home), and of functions outside this package.

    numba takes a tuple of arrays apart ten times slower than the arrays by themselves, so what is
    called at every event may have arguments that stand flat.  What an equation is given again and
    again is handed over once instead, and unpacked inside (:mod:`.packed`).

    Where the user's environment forbids numba to compile, Python runs it (:mod:`.uncompiled`).
    """
    if is_uncompiled():
        _say(UNCOMPILED)
        return cast(Function, uncompiled(function))
    dispatcher: Any = numba.njit(**OPTIONS, **options)(function)
    ours = PACKAGE in Path(function.__code__.co_filename).parents
    folder = kept_in() if ours else None
    if folder:
        asked, CONFIG.CACHE_DIR = CONFIG.CACHE_DIR, str(folder)
        try:
            dispatcher.enable_caching()
        except RuntimeError as error:
            trouble(f"{folder} cannot be written to ({error})")
        finally:
            CONFIG.CACHE_DIR = asked
    dispatcher.compile = _watched(dispatcher, folder)
    return cast(Function, dispatcher)


def _watched(dispatcher: Any, folder: Path | None) -> Callable[[Any], Any]:
    """Return how a function is compiled for arguments, or found: in turn, and counted.

    No trouble with the disk ends a mission.
    """
    compile_or_load = dispatcher.compile
    name = f"{dispatcher.__module__}.{dispatcher.__qualname__}"

    def watched(signature: Any) -> Any:
        with _WATCH.open(dispatcher), _turn(folder, name):
            try:
                return compile_or_load(signature)
            except OSError as error:  # it is compiled, but cannot be kept
                trouble(f"{folder} cannot be written to ({error.strerror})")
            except (EOFError, pickle.UnpicklingError):
                trouble(f"{folder} is damaged, and begun anew")
                for kept in folder.rglob("*.nb?") if folder else ():
                    kept.unlink(missing_ok=True)
            return compile_or_load(signature)

    return watched


@contextmanager
def _turn(folder: Path | None, name: str) -> Iterator[None]:
    """Wait while another process compiles the function of a name: it is found on the disk then."""
    if folder is None or (file := _locks(folder)) is None:
        yield
        return
    import fcntl

    byte = crc32(name.encode())
    with suppress(OSError):  # a file system without locks; two that wait for each other
        fcntl.lockf(file, fcntl.LOCK_EX, 1, byte)
    try:
        yield
    finally:
        with suppress(OSError):
            fcntl.lockf(file, fcntl.LOCK_UN, 1, byte)


@cache
def _locks(folder: Path) -> int | None:
    """Return a file of which a byte is locked for each function; None on machines without locks."""
    try:
        import fcntl  # noqa: F401 (of POSIX alone)

        return os.open(folder / "locks", os.O_CREAT | os.O_RDWR, 0o644)
    except (ImportError, OSError):
        return None


# Who waits for other threads to have compiled looks each so often (s).
WAIT_S = 0.01

# Hears, as each function is compiled, how many were before it, and how long (s) all took.
OnCompiling = Callable[[int, float], None]


class _Watch:
    """Counts functions that no disk holds, and the time to compile them; tells whoever asked last.

    One function is compiled in the midst of another that calls it, and those are done first.
    """

    def __init__(self) -> None:
        self.functions, self._spent, self._began = 0, 0.0, 0.0
        self._threads: list[int] = []  # which compile, one entry for each function
        self.tell: OnCompiling | None = None

    @property
    def seconds(self) -> float:
        """The time (s) that all compiling has taken so far."""
        return self._spent + (monotonic() - self._began if self._threads else 0.0)

    @contextmanager
    def open(self, dispatcher: Any) -> Iterator[None]:
        """Watch what is compiled of a function, unless it is found on the disk."""
        before = len(dispatcher.stats.cache_misses)
        if not self._threads:
            self._began = monotonic()
        self._threads.append(get_ident())
        try:
            yield
        finally:
            if len(dispatcher.stats.cache_misses) > before:
                self.functions += 1
                if self.tell is not None:
                    self.tell(self.functions, self.seconds)
            self._threads.remove(get_ident())
            if not self._threads:
                self._spent += monotonic() - self._began

    def wait_for_others(self) -> None:
        """Wait until no other thread compiles."""
        while any(thread != get_ident() for thread in self._threads):
            sleep(WAIT_S)

    def forget_others(self) -> None:
        """Forget threads that this process, which was forked, does not have."""
        self._threads = [thread for thread in self._threads if thread == get_ident()]


_WATCH = _Watch()

# numba compiles in one thread at a time: a process that is forked meanwhile, without that thread,
# would wait for it for ever.
if hasattr(os, "register_at_fork"):
    os.register_at_fork(before=_WATCH.wait_for_others, after_in_child=_WATCH.forget_others)


def watch_compiling(tell: OnCompiling | None) -> None:
    """Have somebody told from now on, in the place of whoever asked before, how far it is."""
    functions, seconds = _WATCH.functions, _WATCH.seconds
    _WATCH.tell = tell and (lambda made, spent: tell(made - functions, spent - seconds))


def compiling_s() -> float:
    """Return the time (s) that compiling has taken in this process so far."""
    return _WATCH.seconds


def _roots() -> Iterator[Path]:
    """Yield where code may be kept: where the user says, in the package, in the user's cache."""
    ours = Path(PACKAGE.name) / hashlib.sha256(bytes(PACKAGE)).hexdigest()[:16]
    if CONFIG.CACHE_DIR:  # NUMBA_CACHE_DIR
        yield Path(CONFIG.CACHE_DIR) / ours
    yield PACKAGE / "__pycache__" / "compiled"
    with suppress(RuntimeError):  # there is no home
        yield Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / ours


@cache
def kept_in() -> Path | None:
    """Return the folder in which this process keeps compiled code, if in any.

    It takes the place of those of earlier equations.
    """
    reasons = []
    version = f"{sys.implementation.cache_tag}-numba-{numba.__version__}"
    for root in _roots():
        folder = root / f"{version}-{stamp()}"
        try:
            if not folder.is_dir():
                folder.mkdir(parents=True, exist_ok=True)
                for other in root.glob(f"{version}-*"):
                    if other != folder:
                        shutil.rmtree(other, ignore_errors=True)
            if not (why := _objection(folder)):
                return folder
        except OSError as error:
            why = f"cannot be written to ({error.strerror})"
        reasons.append(f"{root} {why}")
    trouble("; ".join(reasons))
    return None


def warm_marker(folder: Path) -> Path:
    """Return the file that says that a folder holds what nearly all missions need on this machine.

    `doctor --warm` writes it.  Another machine may see the folder, too, and need code of its own.
    """
    machine = hashlib.sha256(f"{platform.node()} {platform.machine()}".encode())
    return folder / f"warm-{machine.hexdigest()[:16]}"


def _objection(folder: Path) -> str:
    """Return why a folder of code that will be run cannot be used, or ""."""
    found = folder.stat()
    if hasattr(os, "geteuid") and found.st_uid not in {0, os.geteuid(), PACKAGE.stat().st_uid}:
        return "belongs to another user"
    if hasattr(os, "geteuid") and found.st_mode & stat.S_IWOTH:
        return "can be written to by everybody"
    return "" if os.access(folder, os.W_OK) else "cannot be written to"


def trouble(what: str) -> None:
    """Note why code is not kept; tell the user the first time, in the first process."""
    if what not in troubles:
        troubles.append(what)
    _say(f"{what}; what it lacks is compiled anew; `bindusbl-des doctor` says more")


def is_uncompiled() -> bool:
    """Tell whether the user's environment has numba compile nothing."""
    return bool(CONFIG.DISABLE_JIT)


def _say(what: str) -> None:
    """Tell the user something the first time, in the first process."""
    if TOLD not in os.environ:
        os.environ[TOLD] = "1"
        print(f"Compiled code: {what}", file=sys.stderr, flush=True)


@cache
def stamp() -> str:
    """Return a fingerprint of all files that hold equations, or numbers that they take."""
    total = hashlib.sha256()
    for path in equation_files():
        total.update(path.read_bytes())
    return total.hexdigest()[:16]


def equation_files() -> list[Path]:
    """Return the files whose text is part of compiled code."""
    named = {PACKAGE / file for file in NUMBERS}
    files = sorted(PACKAGE.rglob("*.py"))
    return [file for file in files if file in named or MARKS.search(file.read_bytes())]


def _probe(number: float) -> float:
    return number / 2.0


def kept_and_loaded() -> bool:
    """Tell whether code is found again on the disk after it was compiled and kept there."""
    for _ in range(2):
        again: Any = compiled(_probe)
        again(1.0)
    return bool(again.stats.cache_hits)

"""Processes of this machine that work: how they are started, and what they begin with."""

import os
import signal
import sys
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from importlib import import_module
from multiprocessing import parent_process
from multiprocessing.context import SpawnContext, SpawnProcess
from multiprocessing.process import BaseProcess
from typing import Any

from ...core.garbage import collect_seldom

# Workers share the machine: a library that starts threads of its own would slow all of them.
LIBRARIES = ("OMP", "OPENBLAS", "MKL", "NUMEXPR", "NUMBA")
ONE_THREAD = {f"{library}_NUM_THREADS": "1" for library in LIBRARIES}

# Whoever clears away after a parent that was killed need not tell that there was something to
# clear: that is what it is for.
QUIETLY = {"PYTHONWARNINGS": "ignore:resource_tracker:UserWarning"}


@contextmanager
def environment(variables: Mapping[str, str]) -> Iterator[None]:
    """Have variables in the environment of processes that are begun meanwhile."""
    before = {name: os.environ.get(name) for name in variables}
    os.environ.update(variables)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


@contextmanager
def _ctrl_c_held_back() -> Iterator[None]:
    """Keep Ctrl-C from a new process, which would die of it before it leaves it to its parent."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def _script_hidden() -> Iterator[None]:
    """Hide the main script, so that one without `if __name__ == "__main__"` may start a sweep."""
    main = sys.modules["__main__"]
    hidden = {name: getattr(main, name) for name in ("__file__", "__spec__") if hasattr(main, name)}
    if "__file__" in hidden:
        del main.__file__
    main.__spec__ = None
    try:
        yield
    finally:
        for name, value in hidden.items():
            setattr(main, name, value)


class _Process(SpawnProcess):
    """A spawned process that does not run the user's own script again."""

    @staticmethod
    def _Popen(process_obj: BaseProcess) -> Any:
        with environment(ONE_THREAD), _script_hidden(), _ctrl_c_held_back():
            return SpawnProcess._Popen(process_obj)


class Spawn(SpawnContext):
    """How workers are started."""

    Process = _Process


def begin_work() -> None:
    """Make a worker go with its parent, and load what it needs.

    All of that is loaded here: whoever imports this file imports nothing large.
    """
    go_with_parent()
    for needed in ("campaigns.workers.batches", "mission.mission"):  # before the first batch comes
        import_module(f"bindusbl_des.{needed}")


def go_with_parent() -> None:
    """Make this process leave Ctrl-C to its parent, and end when its parent does."""
    collect_seldom()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)

"""How a command ends: as documented, or with what no user should see."""

import faulthandler
import json
import os
import resource
import signal
import sys
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from time import process_time
from typing import Any

from click.testing import CliRunner

from bindusbl_des import load_campaign, load_result
from bindusbl_des.cli import main

CODES = (0, 1, 2, 3)

# What one command may take: processor time (s), memory (bytes).  The clock on the wall (s) only
# ends what hangs, since other work may slow a machine.
LIMIT_S, LIMIT_BYTES, HANGS_S = 5.0, 10**9, 40.0

# Readers for Python, beside the commands.
READERS: dict[str, Callable[[str], Any]] = {
    "load_result": load_result,
    "load_campaign": load_campaign,
}
STATM = Path("/proc/self/statm")


class Hangs(BaseException):
    """A command does not end."""


def trouble(words: list[str]) -> str:
    """Run a command; return what was wrong with how it ended, "" if nothing was."""
    began = process_time()
    try:
        with _limits():
            found = _read(*words) if words[0] in READERS else _command(words)
    except Hangs:
        return f"hangs: not ended after {HANGS_S:g} s\n{traceback.format_exc()}"
    took = process_time() - began
    return found or (f"slow: took {took:.1f} s of processor time" if took > LIMIT_S else "")


def _command(words: list[str]) -> str:
    ended = CliRunner().invoke(main, words)
    if ended.exc_info and not isinstance(ended.exception, SystemExit | None):
        return "".join(traceback.format_exception(ended.exception))
    if any(isinstance(it, MemoryError) for it in _causes(ended.exception)):
        return f"memory: wants more than {LIMIT_BYTES:.0e} bytes\n{ended.output[-2000:]}"
    if ended.exit_code not in CODES:
        return f"exit code {ended.exit_code}\n{ended.output[-2000:]}"
    if "Traceback (most recent" in ended.output:
        return f"a traceback is printed:\n{ended.output[-4000:]}"
    return "" if ended.output or not ended.exit_code else f"silent: exit code {ended.exit_code}"


def _read(reader: str, folder: str) -> str:
    try:
        READERS[reader](folder)
    except (OSError, ValueError) as error:
        return "" if str(error) else f"silent: {error!r}"
    except Exception:
        return traceback.format_exc()
    return ""


def _causes(error: BaseException | None) -> Iterator[BaseException]:
    """Yield an exception, and those behind it."""
    while error is not None:
        yield error
        error = error.__cause__ or error.__context__


@contextmanager
def _limits() -> Iterator[None]:
    """End what hangs, with this process if need be, and let nothing take more memory."""
    faulthandler.dump_traceback_later(2 * HANGS_S, exit=True, file=sys.__stderr__)
    signal.signal(signal.SIGALRM, _alarm)
    signal.setitimer(signal.ITIMER_REAL, HANGS_S)
    most = resource.getrlimit(resource.RLIMIT_DATA)[1]
    resource.setrlimit(resource.RLIMIT_DATA, (_data() + LIMIT_BYTES if STATM.exists() else most, most))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_DATA, (most, most))
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        faulthandler.cancel_dump_traceback_later()


def _data() -> int:
    """Return the memory that this process has for its data (bytes)."""
    return int(STATM.read_text().split()[5]) * os.sysconf("SC_PAGE_SIZE")


def _alarm(*_: object) -> None:
    raise Hangs


def shown(folder: Path) -> str:
    """Return what lies in a folder, text and bytes as Python would write them."""
    lines = []
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder)
        if path.is_symlink():
            lines.append(f"{name} -> {os.readlink(path)}")
        elif path.is_file() and path.suffix in (".yaml", ".csv", ".json"):
            lines.append(f"{name}: {path.read_bytes()!r}")
        elif not path.is_dir():
            lines.append(f"{name}: {path.stat().st_size} bytes")
    return "\n".join(lines)


def as_line(kind: str, seed: int, words: list[str], why: str) -> str:
    """Return a line of JSON that tells of an input that ended as none may."""
    return json.dumps({"kind": kind, "seed": seed, "words": words, "why": why})

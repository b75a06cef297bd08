"""How a command ends: as documented, or with what no user should see."""

import faulthandler
import os
import resource
import signal
import sys
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from time import process_time
from typing import Any

from click.testing import Result
from commands_for_tests import call

from bindusbl_des import load_campaign, load_result

CODES = (0, 1, 2, 3)

# What one command may take: processor time (s), memory (bytes).  The clock on the wall (s) only
# ends what hangs, since other work may slow a machine.
LIMIT_S, LIMIT_BYTES, HANGS_S = 10.0, 10**9, 120.0

# Readers for Python, beside the commands.
READERS: dict[str, Callable[[str], Any]] = {
    "load_result": load_result,
    "load_campaign": load_campaign,
}
STATM = Path("/proc/self/statm")


class Hangs(BaseException):
    """A command does not end."""


@dataclass(frozen=True)
class Ending:
    """How a command line ended: its exit code, and what no user should have seen, or ""."""

    words: list[str]
    code: int
    why: str


def ending(words: list[str], told: Callable[[str], object] | None = None) -> Ending:
    """Run a command line, or a reader; `told` is given what it prints."""
    began = process_time()
    try:
        with _limits():
            code, why = _read(*words) if words[0] in READERS else _command(words, told)
    except Hangs:
        code, why = 1, f"hangs: not ended after {HANGS_S:g} s\n{traceback.format_exc()}"
    took = process_time() - began
    if not why and took > LIMIT_S:
        why = f"slow: took {took:.1f} s of processor time"
    return Ending(words, code, why)


def _command(words: list[str], told: Callable[[str], object] | None) -> tuple[int, str]:
    ended = call(*words, catch_exceptions=True)
    if told is not None:
        told(ended.output)
    return ended.exit_code, _wrong(ended)


def _wrong(ended: Result) -> str:
    """Return what is not as documented about how a command ended."""
    if not isinstance(ended.exception, SystemExit | None):
        return "".join(traceback.format_exception(ended.exception))
    last = ended.output[-2000:]
    if any(isinstance(it, MemoryError) for it in _causes(ended.exception)):
        return f"memory: wants more than {LIMIT_BYTES:.0e} bytes\n{last}"
    if ended.exit_code not in CODES:
        return f"code: {ended.exit_code} is not documented\n{last}"
    if "Traceback (most recent" in ended.output:
        return f"traceback: one is printed\n{last}"
    return "" if last or not ended.exit_code else f"silent: exit code {ended.exit_code}"


def _read(reader: str, folder: str) -> tuple[int, str]:
    """Read a folder in Python, where a mistake is an OSError or a ValueError with a message."""
    try:
        READERS[reader](folder)
    except (OSError, ValueError) as error:
        return 2, "" if str(error) else f"silent: {error!r}"
    except Exception:
        return 1, traceback.format_exc()
    return 0, ""


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
    resource.setrlimit(
        resource.RLIMIT_DATA, (_data() + LIMIT_BYTES if STATM.exists() else most, most)
    )
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

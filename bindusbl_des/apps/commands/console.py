"""What all commands share: results to stdout, talk to stderr, mistakes as exit code 2.

Where the program is asked to end, drafts of files and folders are removed first.
"""

import errno
import json
import os
import signal
import sys
import threading
from collections.abc import Collection, Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from time import monotonic
from types import FrameType
from typing import TYPE_CHECKING, Any, NoReturn

import click

from ...support.plugins import LEAVE, Ended
from ...support.wording import printable_json, printable_lines

# `timeout` and others send their request twice, to the process and to its group.
SAME_REQUEST_S = 1.0


@contextmanager
def ended_in_order() -> Iterator[None]:
    """Raise SystemExit(128 + signal) where SIGTERM or SIGHUP would end the process on the spot.

    Signals that are ignored (`nohup`) or have a receiver are left alone, and so are all of them
    outside the main thread, where none can be received.

    Python drops what is raised while it clears up or while C code imports a module.  A request that
    was dropped there is sent again.
    """
    asked_s = -SAME_REQUEST_S
    dropped_before = sys.unraisablehook

    def receive(number: int, _: FrameType | None) -> None:
        nonlocal asked_s
        now = monotonic()
        if now - asked_s >= SAME_REQUEST_S:
            asked_s = now
            raise Ended(128 + number)

    def dropped(what: "sys.UnraisableHookArgs") -> None:
        nonlocal asked_s
        if not isinstance(what.exc_value, Ended):
            dropped_before(what)
            return
        asked_s = -SAME_REQUEST_S
        number = int(what.exc_value.args[0]) - 128
        # From another thread: sent by this one, it would be received here, and dropped again.
        threading.Timer(0.01, os.kill, (os.getpid(), number)).start()

    if threading.current_thread() is not threading.main_thread():
        yield
        return
    requests = (signal.SIGTERM, signal.SIGHUP)
    ours = [number for number in requests if signal.getsignal(number) == signal.SIG_DFL]
    for number in ours:
        signal.signal(number, receive)
    sys.unraisablehook = dropped
    try:
        yield
    finally:
        sys.unraisablehook = dropped_before
        for number in ours:
            signal.signal(number, signal.SIG_DFL)


if TYPE_CHECKING:
    from ...core.results.result import Result
    from ...support.mistakes import Mistake
    from ..preflight.effort import Effort
    from ..preflight.warnings import Reading

BAD_INPUT = 2
FIGURES = (".png", ".svg", ".pdf")
# Notes in a command's context: what its user wants to hear.
QUIET, AS_JSON = "bindusbl_des.quiet", "bindusbl_des.json"

# About so many equations a first mission compiles.
EQUATIONS = 200


class BadInput(click.ClickException):
    """What the user asked for cannot be done; told without a traceback."""

    exit_code = BAD_INPUT

    def show(self, file: Any = None) -> None:
        """Print the message alone: it says where the mistake is by itself."""
        say(self.message, err=True)


class RunFailed(BadInput):
    """A run broke off although its input was in order."""

    exit_code = 1


def say(text: str, *, err: bool = False) -> None:
    """Print lines; what a terminal would obey is written as escapes."""
    click.echo(printable_lines(text), err=err)


def talk(text: str) -> None:
    """Tell the user something on stderr, unless asked to be quiet; no result is lost over it."""
    if not is_quiet():
        with suppress(OSError):  # stderr is on a full disk, or closed
            say(text, err=True)


def warn(text: str) -> None:
    """Tell the user on stderr, in amber, what is less than was asked for."""
    if not is_quiet():
        color = False if os.environ.get("NO_COLOR") else None
        with suppress(OSError):
            click.secho(printable_lines(text), fg="yellow", err=True, color=color)


def _noted(note: str) -> bool:
    context = click.get_current_context(silent=True)
    return bool(context and context.meta.get(note))


def is_quiet() -> bool:
    """Tell whether the user has asked to hear only what is wrong."""
    return _noted(QUIET)


def wants_json() -> bool:
    """Tell whether the user has asked for one JSON document on stdout."""
    return _noted(AS_JSON)


def answer(data: Any, text: str | Iterable[str]) -> None:
    """Print what a command was asked for: data with ``--json``, else its text or lines of text."""
    if wants_json():
        print_json(data)
    else:
        for line in [text] if isinstance(text, str) else text:
            say(line)


@contextmanager
def compiling_shown() -> Iterator[None]:
    """Tell the user why the first mission after an installation takes longer, if it does.

    On a terminal a line counts down the equations.
    """
    from ...support.compiled import watch_compiling
    from ...support.process import ProgressLine, duration

    line, has_begun = ProgressLine(quiet=is_quiet(), on_terminals=True), False

    def note(made: int, spent: float) -> None:
        nonlocal has_begun
        if not has_begun:
            has_begun = True
            talk(
                "Compiling the equations, once; this takes up to a minute "
                "(`bindusbl-des doctor --warm` does it beforehand) ..."
            )
        if made < EQUATIONS:
            left = duration(spent * (EQUATIONS - made) / made)
            line.tell(lambda: f"{made} of about {EQUATIONS} equations compiled, {left} left")

    watch_compiling(note)
    try:
        yield
    finally:
        watch_compiling(None)
        line.clear()


def print_json(data: Any) -> None:
    """Print data as JSON; what JSON cannot say (nan, infinity) is a mistake of ours."""
    text = json.dumps(data, indent=2, allow_nan=False, ensure_ascii=False)
    click.echo(printable_json(text))


def refuse(message: str) -> NoReturn:
    """End the command with exit code 2 and a message."""
    raise BadInput(message)


@contextmanager
def refusing(*kinds: type[Exception], before: str = "") -> Iterator[None]:
    """Have errors of some kinds end the command with exit code 2 and what they say."""
    try:
        yield
    except kinds as error:
        refuse(f"{before}{error}")


def reading_from(
    path: str, overrides: tuple[str, ...] = (), allow_plugins: bool = False
) -> "Reading":
    """Return a scenario and its warnings, or end the command with all its mistakes."""
    from ...support.mistakes import ScenarioError
    from ..preflight.warnings import read_scenario

    with refusing(ScenarioError):
        return read_scenario(path, overrides=overrides, allow_plugins=allow_plugins)


def talk_of(warnings: "Iterable[Mistake]") -> None:
    """Print warnings before the results are trusted, a line for each."""
    lines = [str(warning) for warning in warnings]
    if lines:
        talk("\n".join(["Warnings:", *lines]))


def refuse_plugins(unloaded: "Iterable[Mistake]") -> None:
    """End the command if a file names plug-ins that were not allowed."""
    mistakes = [str(mistake) for mistake in unloaded]
    if mistakes:
        refuse(
            "\n".join([*(line.removesuffix(f" {LEAVE}") for line in mistakes[:-1]), mistakes[-1]])
        )


def weigh(name: str, cost: "Effort", anyway: bool, at_once: int = 1) -> None:
    """Tell what a large mission takes; refuse what this machine should not begin unless asked."""
    excess = cost.excess(at_once)
    if excess and not anyway:
        fewer = "use fewer --workers; " if at_once > 1 and not cost.excess() else ""
        refuse(
            f"{name}: takes {cost}: {excess}. {cost.remedy}; {fewer}--anyway begins it nevertheless"
        )
    if cost.is_worth_telling:
        talk(f"{name}: takes {cost}")


def write_new(path: Path, text: str, force: bool) -> None:
    """Write a text file that the user named; an existing one only if forced."""
    from ...support.files import write_text

    check_file(path, force)
    with writing(path):
        write_text(path, text, replace=force)


def check_file(path: Path, force: bool, endings: Collection[str] = (), what: str = "file") -> None:
    """Refuse, before anything is computed, a name that cannot take a file.

    By force a file gives way, or a link, never a folder or a device.

    Raises:
        OSError: when no file can have that name.
    """
    if endings and path.suffix.lower() not in endings:
        refuse(f"{path}: a {what}'s name ends in one of {', '.join(endings)}")
    if path.is_dir():
        refuse(f"{path}: is a folder; name a file")
    if not path.absolute().parent.is_dir():
        refuse(f"{path}: the folder {path.parent} does not exist")
    try:
        os.lstat(path)
    except FileNotFoundError:
        return
    if not force:
        refuse(f"{path}: exists; use --force to replace it, or name another file")
    if path.exists() and not path.is_file():
        refuse(f"{path}: is no file that could be replaced; name another")


def check_figure(path: Path, force: bool) -> None:
    """Refuse, before anything is computed, a name that cannot take a figure."""
    check_file(path, force, FIGURES, "figure")


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """End the command with exit code 2 and one line where a file or folder cannot be written."""
    from ...support.files import FolderTaken

    try:
        yield
    except FolderTaken as error:
        refuse(str(error))
    except FileExistsError:
        refuse(f"{path}: came to exist meanwhile and is left as it is; name another file")
    except OSError as error:
        reason = error.strerror or (str(error).splitlines() or [type(error).__name__])[0]
        refuse(f"{path}: cannot be written ({reason})")


def result_in(folder: str | Path) -> "Result":
    """Return the result that a folder holds; refuse one that holds none, or a damaged one."""
    from ...core.results.loading import load_result

    with refusing(OSError, ValueError):
        return load_result(folder)


@contextmanager
def mistakes_text() -> Iterator[None]:
    """Tell what a user can mend as such: exit code 2, or 1 where a campaign broke off."""
    try:
        yield
    except Exception as error:
        _tell_mistake(error)
        raise


def _tell_mistake(error: Exception) -> None:
    """Raise what a user is told of a mistake; nothing where it is none of the user's.

    What runs campaigns, the machinery of missions with it, is loaded here: when something is wrong.
    """
    from ..campaigns.experiments.experiment_points import ScipyMissing
    from ..campaigns.workers.batches import NotWritten
    from ..campaigns.workers.pools import BackendMissing
    from ..campaigns.workers.supervisor import WorkersDie

    if isinstance(error, NotWritten):
        raise RunFailed(
            f"stopped, because results cannot be written: {error.strerror or error}. What was "
            f"written counts; {_remedy(error)}"
        ) from error
    if isinstance(error, BackendMissing | ScipyMissing | WorkersDie):
        raise RunFailed(str(error)) from error
    if isinstance(error, ValueError):  # as a CampaignError is
        refuse(str(error))
    if not isinstance(error, OSError) or error.errno == errno.ENAMETOOLONG:
        return  # bad input, which `cli` tells
    if isinstance(error, PermissionError):  # as bad input is, whatever was to be done there
        refuse(f"{error.filename}: {error.strerror}; ask its owner for the right, or name another")
    what = error.filename or "the output cannot be written"
    raise RunFailed(f"{what}: {error.strerror or error}") from error


def _remedy(error: OSError) -> str:
    """Return what to do about a folder that cannot be written."""
    if error.errno in (errno.ENOENT, errno.ENOTDIR):
        return (
            "the folder was moved or removed meanwhile: `bindusbl-des resume` it where it is now, "
            "or sweep anew"
        )
    if error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG):
        return "free some space, then `bindusbl-des resume` the folder"
    return "make the folder writable, then `bindusbl-des resume` it"

"""The command line `bindusbl-des`."""

import errno
import io
import os
import sys
from typing import Any, NoReturn, TextIO

import click

from .apps.commands.bench import bench
from .apps.commands.benchmark import benchmark
from .apps.commands.console import BAD_INPUT, ended_in_order
from .apps.commands.coverage import coverage
from .apps.commands.doctor import doctor
from .apps.commands.exports import export
from .apps.commands.files import init, params, presets, schema, validate
from .apps.commands.live import live
from .apps.commands.missions import explain, run
from .apps.commands.options import handed_on, quiet_option, shared_options
from .apps.commands.plan import plan
from .apps.commands.plot import plot
from .apps.commands.replaying import fit, replay
from .apps.commands.reports import compare, report
from .apps.commands.reproduction import reproduce
from .apps.commands.sweeps import merge, resume, status, sweep
from .apps.commands.timing import timing
from .apps.commands.verifying import verify
from .apps.commands.workbench import workbench
from .support.process import INTERRUPTED, collect_seldom, hand_back, leave_the_rest
from .support.wording import nearest, printable, shortened

# What people call commands that have another name here
OTHER_WORDS = {"simulate": "run", "check": "validate", "view": "report", "keys": "params"}
SETTINGS = {"help_option_names": ["-h", "--help"], "max_content_width": 100}


class Commands(click.Group):
    """A group of commands that ends with 130 when it is interrupted, and in the order given.

    Each has ``-q``, and what stands before its name is as if it stood behind.
    """

    def add_command(self, cmd: click.Command, name: str | None = None) -> None:
        super().add_command(quiet_option(cmd), name)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        try:
            name, command, rest = super().resolve_command(ctx, args)
        except click.UsageError as error:
            meant = OTHER_WORDS.get(args[0]) or nearest(args[0], self.commands)
            if not meant:
                raise
            message = f"No such command {args[0]!r}; did you mean {meant!r}?"
            raise click.UsageError(message, error.ctx) from None
        if command is None or ctx.resilient_parsing:  # a shell that completes
            return name, command, rest
        return name, command, [*handed_on(ctx.params, command), *rest]

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(self.commands)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        width = formatter.width - 6 - max(map(len, self.commands))
        for name, group in GROUPS.items():
            with formatter.section(name):
                formatter.write_dl(
                    [(str(command.name), command.get_short_help_str(width)) for command in group]
                )

    def invoke(self, ctx: click.Context) -> Any:
        try:
            return super().invoke(ctx)
        except (KeyboardInterrupt, click.Abort):
            click.echo("interrupted", err=True)
            ctx.exit(INTERRUPTED)

    def main(self, *args: Any, **kwargs: Any) -> Any:
        _open_closed_streams()
        # LLVM's further levels take a fifth more time to compile, and missions are no faster
        os.environ.setdefault("NUMBA_OPT", "1")
        collect_seldom()
        leave_the_rest()
        hand_back()
        if isinstance(sys.stdout, io.TextIOWrapper):  # names of files need not be of any encoding
            sys.stdout.reconfigure(errors="backslashreplace")
        try:
            with ended_in_order():
                return super().main(*args, **kwargs)
        except UnicodeEncodeError as error:
            if error.reason != "surrogates not allowed":
                raise
            name = printable(shortened(error.object))
            _end(f"{name}: not UTF-8, which a name must be here; rename it")
        except ValueError as error:
            if "Number of threads specified" in str(error):  # numba's, as it is imported
                threads = os.environ.get("NUMBA_NUM_THREADS")
                _end(f"NUMBA_NUM_THREADS: must be 1 or more; got {threads!r}; change or unset it")
            if "embedded null" not in str(error):  # byte, or character
                raise
            _end("a NUL character stands in a name of a file; no file has one")
        except OSError as error:
            if error.filename is not None:  # a name that no file can have, or a closed folder
                _end(f"{printable(str(error.filename))}: {error.strerror}")
            if error.errno not in (errno.ENOSPC, errno.EIO):
                raise
            click.echo(f"Error: the output cannot be written: {error.strerror}", err=True)
            # What is left of it would be tried again when Python ends, and fail with a code of 120.
            _let_go_of(sys.stdout)
            sys.exit(1)
        finally:
            if sys.stderr is not None and not sys.stderr.closed:
                try:
                    sys.stderr.flush()
                except OSError:  # work goes on without listeners
                    _let_go_of(sys.stderr)


def _end(problem: str) -> NoReturn:
    """End the program: what it was given is bad."""
    click.echo(problem, err=True)
    sys.exit(BAD_INPUT)


def _open_closed_streams() -> None:
    """Have what is written to a stream that was closed vanish, not reach a file that has its number
    now.
    """
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, os.fdopen(os.open(os.devnull, os.O_RDWR), mode))


def _let_go_of(stream: TextIO) -> None:
    """Have what a stream could not write vanish."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def _print_version(context: click.Context, _: click.Parameter, asked: bool) -> None:
    if not asked or context.resilient_parsing:
        return
    from importlib.metadata import version

    click.echo(f"bindusbl-des {version('bindusbl-des')}")
    context.exit()


@click.group(cls=Commands, context_settings=SETTINGS)
@click.option(
    "--version",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_print_version,
    help="Print the version and exit.",
)
@shared_options
def main(**_: Any) -> None:
    """Simulate underwater acoustic networks that keep AUVs on their way.

    --set, --json and -q mean the same before and after the name of a command.

    Exit codes: 0 ok, 1 the run failed, 2 bad input, 3 some missions of a campaign failed,
    130 interrupted, 143 ended by SIGTERM (129 by SIGHUP).
    """


# All commands, by what one wants of them, in the order of use
GROUPS: dict[str, tuple[click.Command, ...]] = {
    "On a page": (workbench,),
    "Write a scenario": (init, params, presets, validate, schema),
    "Fly": (run, live, sweep, resume, status, merge),
    "Ask what became of it": (report, explain, plot, compare, export),
    "Plan": (plan, coverage, timing, verify),
    "Recorded missions": (replay, fit),
    "The paper and this machine": (reproduce, benchmark, bench, doctor),
}
for _group in GROUPS.values():
    for _command in _group:
        main.add_command(_command)


if __name__ == "__main__":
    sys.exit(main())

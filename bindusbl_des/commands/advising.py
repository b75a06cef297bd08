"""What the commands share that say what would help a mission."""

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import click

from ..core.plugins import is_allowed, is_plugin, refusal
from ..core.progress import ProgressLine
from .console import is_quiet, refuse, talk

if TYPE_CHECKING:
    from ..results.effects import Advice
    from ..results.result import Result
    from ..scenario.scenario import Scenario

SECONDS = 3.0


def advice_options(seconds: float | None, meaning: str) -> Callable[[Any], Any]:
    """Give a command the options `--advice-s` and `--no-advice`."""

    def options(command: Any) -> Any:
        without = click.option("--no-advice", is_flag=True, help="Try no changes.")
        within = click.option(
            "--advice-s",
            metavar="SECONDS",
            type=click.FloatRange(min=0),
            default=seconds,
            callback=_finite,
            help=meaning,
        )
        return within(without(command))

    return options


def _finite(
    context: click.Context, parameter: click.Parameter, value: float | None
) -> float | None:
    if value is not None and not math.isfinite(value):
        raise click.BadParameter(f"{value} is no time; give seconds", context, parameter)
    return value


def advice_on(
    result: "Result", seconds: float, again: "Callable[[Sequence[str]], Scenario] | None"
) -> "Advice | None":
    """Return what would help a mission, as tried for so many seconds; None if that is 0.

    Whoever interrupts the trials keeps the mission.
    """
    if seconds == 0:
        return None
    from ..advice.advising import advise
    from ..scenario.families import parts_of

    for family, name in parts_of(result.scenario):
        if is_plugin(name) and not is_allowed(name):
            refuse(f"{family.key}: {refusal(name)}")

    line = ProgressLine(quiet=is_quiet())
    now = "trying changes"

    def told(missions: int, left: float) -> None:
        nonlocal now
        now = f"trying changes: {missions} missions, {max(left, 0):.0f} s left (--no-advice)"
        line.tell(lambda: now)

    try:
        return advise(result, seconds, again=again, progress=told)
    except KeyboardInterrupt:
        talk("Interrupted while changes were tried; the mission is written without advice.")
        return None
    finally:
        line.end(lambda: now)

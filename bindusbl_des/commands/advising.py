"""What the commands share that say what would help a mission."""

import math
from collections.abc import Callable, Sequence
from time import monotonic
from typing import TYPE_CHECKING, Any

import click

from ..core.plugins import is_allowed, is_plugin, refusal
from ..core.progress import ProgressLine, duration
from .console import is_quiet, refuse, talk, warn

if TYPE_CHECKING:
    from ..results.effects import Advice
    from ..results.result import Result
    from ..scenario.scenario import Scenario


def advice_options(meaning: str) -> Callable[[Any], Any]:
    """Give a command the options `--advice-missions`, `--advice-s` and `--no-advice`."""

    def options(command: Any) -> Any:
        without = click.option("--no-advice", is_flag=True, help="Try no changes.")
        missions = click.option(
            "--advice-missions", metavar="N", type=click.IntRange(min=0), help=meaning
        )
        within = click.option(
            "--advice-s",
            metavar="SECONDS",
            type=click.FloatRange(min=0),
            callback=_finite,
            help="Begin no further one after so long (default: all are flown).",
        )
        return missions(within(without(command)))

    return options


def _finite(
    context: click.Context, parameter: click.Parameter, value: float | None
) -> float | None:
    if value is not None and not math.isfinite(value):
        raise click.BadParameter(f"{value} is no time; give seconds", context, parameter)
    return value


def advice_on(
    result: "Result",
    missions: int | None,
    seconds: float | None,
    again: "Callable[[Sequence[str]], Scenario] | None",
) -> "Advice | None":
    """Return what would help a mission, as tried in so many others; None if these are 0.

    Whoever interrupts the trials keeps the mission.
    """
    if missions == 0 or seconds == 0:
        return None
    from ..advice.advising import advise
    from ..scenario.families import parts_of

    for family, name in parts_of(result.scenario):
        if is_plugin(name) and not is_allowed(name):
            refuse(f"{family.key}: {refusal(name)}")

    line, began = ProgressLine(quiet=is_quiet()), monotonic()
    now = "trying changes"

    def told(flown: int, left: int) -> None:
        nonlocal now
        seconds_left = (monotonic() - began) / max(flown, 1) * left
        now = (
            f"trying changes: {flown} missions, at most {duration(seconds_left)} left (--no-advice)"
        )
        line.tell(lambda: now)

    try:
        advice = advise(result, seconds, missions=missions, again=again, progress=told)
    except KeyboardInterrupt:
        talk("Interrupted while changes were tried; the mission is written without advice.")
        return None
    finally:
        line.end(lambda: now)
    if advice.is_cut:
        warn(
            f"Cut off by --advice-s after {advice.missions} of {advice.budget_missions} missions: "
            "other machines may advise otherwise; `report DIR --advice-missions N` tries anew."
        )
    return advice

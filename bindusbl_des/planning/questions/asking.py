"""What is asked of a plan besides its file: options of the command line, or arguments of Python."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from ...campaigns.experiments.experiment_file import NO_OPTIONS
from ...campaigns.experiments.options import Asked, Options
from ...core.wording import described
from ...scenario.files.mistakes import Mistake, Place, ScenarioError
from ..selection.goals import Goal, Of, goal_of, goals_in


@dataclass(frozen=True)
class Asking:
    """What is laid over a plan's file, or asked of a scenario; None and () leave it as it is.

    `of` is whose metrics the goals are of, also those of the file.
    """

    goals: tuple[Goal, ...] = ()
    of: Of | None = None
    options: Options | Asked = NO_OPTIONS
    confidence: float | None = None
    budget_s: float | None = None
    budget_missions: int | None = None
    seed: int | None = None
    allow_plugins: bool = False


def goals_of_options(below: Sequence[str], above: Sequence[str], of: Of | None) -> tuple[Goal, ...]:
    """Return the goals of the options `--below` and `--above`, each ``METRIC=VALUE``.

    Raises:
        ScenarioError: listing those that are none.
    """

    def read() -> Iterator[tuple[str, Callable[[], Any]]]:
        for name, texts in (("below", below), ("above", above)):
            for text in texts:
                yield f"--{name} {text}", partial(goal_of, text, name == "below", of or "worst")

    return _all_of(read())


def goals_of_arguments(
    below: Mapping[str, Any] | None, above: Mapping[str, Any] | None, of: Of | None
) -> tuple[Goal, ...]:
    """Return the goals of metrics with their limits.

    Raises:
        TypeError: when these are no mappings.
        ScenarioError: listing those that are no goals.
    """
    for name, limits in (("below", below), ("above", above)):
        if limits is not None and not isinstance(limits, Mapping):
            example = "{'position_error_p95_m': 1.0}"
            raise TypeError(f"{name} needs a mapping such as {example}; got {described(limits)}")

    def read() -> Iterator[tuple[str, Callable[[], Any]]]:
        for name, limits in (("below", below), ("above", above)):
            for metric, limit in (limits or {}).items():
                written = {"metric": metric, name: limit, "of": of or "worst"}
                yield f"{name}={{{metric!r}: {limit!r}}}", partial(goals_in, written)

    return _all_of(read())


def _all_of(asked: Iterator[tuple[str, Callable[[], Any]]]) -> tuple[Goal, ...]:
    goals: list[Goal] = []
    mistakes = []
    for place, read in asked:
        try:
            found = read()
            goals += [found] if isinstance(found, Goal) else found
        except ValueError as error:
            mistakes.append(Mistake.at(Place(place), "goal", without_key(error)))
    if mistakes:
        raise ScenarioError(mistakes)
    return tuple(goals)


def without_key(error: ValueError) -> str:
    """Return what is wrong with a goal, without the key at its beginning, which its place tells.

    >>> without_key(ValueError("goal: no metric 'x'"))
    "no metric 'x'"
    """
    return str(error).partition(": ")[2] or str(error)

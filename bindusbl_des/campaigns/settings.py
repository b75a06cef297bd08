"""How a campaign is run."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from inspect import signature
from typing import Any, TypedDict

from ..core.wording import described, did_you_mean

# The longest limit of a mission's time that the operating system can keep: thirty years.
LONGEST_LIMIT_S = 1e9


@dataclass(frozen=True)
class Settings:
    """How a campaign is run, which changes nothing of what it finds.

    Raises:
        ValueError: when the time that a mission may take is no time, or nobody is to work.
    """

    workers: int | None = None
    backend: str = "local"
    quiet: bool = True
    mission_timeout_s: float | None = None

    def __post_init__(self) -> None:
        workers = self.workers
        if workers is not None and (not isinstance(workers, int) or workers < 1):
            raise ValueError(f"workers needs a whole number >= 1; got {described(workers)}")
        limit = self.mission_timeout_s
        if limit is None or limit == math.inf:  # which means none
            object.__setattr__(self, "mission_timeout_s", None)
        elif not 0.0 < limit <= LONGEST_LIMIT_S:
            raise ValueError(
                f"--mission-timeout {limit:g}: needs a time (s) > 0 and <= {LONGEST_LIMIT_S:g}; "
                "leave it out for no limit"
            )


class HowToRun(TypedDict, total=False):
    """The settings of a campaign as keyword arguments, each with a default in `Settings`."""

    workers: int | None
    backend: str
    quiet: bool
    mission_timeout_s: float | None


def settings_of(given: Mapping[str, Any], function: Callable[..., Any]) -> Settings:
    """Return the settings that were given to a function by name.

    Raises:
        TypeError: when it takes none of that name, naming the nearest.
        ValueError: when the time that a mission may take is no time.
    """
    names = tuple(HowToRun.__annotations__)
    for name in given:
        if name not in names:
            hint = did_you_mean(name, (*signature(function).parameters, *names))
            raise TypeError(
                f"{function.__name__} has no argument {name!r}"
                f"{hint or '; its settings are ' + ', '.join(names)}"
            )
    return Settings(**given)

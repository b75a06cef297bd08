"""How sure a campaign must be of a metric before it runs no further seeds at a point."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from ...core.wording import described, did_you_mean
from ...scenario.files.mistakes import Place
from ...scenario.files.plain_yaml import Document, Path
from ..storage.parts import MISSIONS, metric_schema

# Fewer seeds tell too little of their own spread to stop on.
FEWEST_SEEDS = 8

# Where nobody says how many seeds a point may take.
MOST_SEEDS = 256


@dataclass(frozen=True)
class Target:
    """The largest half width of a metric's 95 % confidence interval: absolute, or ``5%``."""

    metric: str
    written: float | str

    def half_width(self, mean: float) -> float:
        """Return the half width that is narrow enough where the mean is this.

        >>> Target("position_error_m", "5%").half_width(-2.0)
        0.1
        """
        if isinstance(self.written, str):
            return float(self.written.rstrip("% ")) / 100 * abs(mean)
        return self.written


def checkpoints(most: int) -> Iterator[int]:
    """Yield the numbers of seeds at which a point may stop; they depend on nothing else.

    >>> list(checkpoints(40))
    [8, 12, 16, 24, 32, 40]
    """
    number = FEWEST_SEEDS
    while number < most:
        yield number
        number = number * 3 // 2 if number & (number - 1) == 0 else number * 4 // 3
    yield most


def targets_in(document: Document) -> tuple[Target, ...]:
    """Return the targets under `until_ci`; mistakes go to the document."""
    path: Path = ("until_ci",)
    if path[0] not in document.data:
        return ()
    section = document.data[path[0]]
    if not isinstance(section, dict) or not section:
        got = "an empty section" if section == {} else described(section)
        message = f"needs metrics with widths, such as {{position_error_m: 5%}}; got {got}"
        document.report(_place(document, path), path, message)
        return ()
    return tuple(_target(document, metric, value) for metric, value in section.items())


def _target(document: Document, metric: str, value: Any) -> Target:
    path, known = ("until_ci", metric), metric_schema(MISSIONS).names
    if metric not in known:
        hint = did_you_mean(metric, known) or "; the columns of missions/ are its metrics"
        document.report(document.keys[path], path, f"no such metric{hint}")
    number = isinstance(value, int | float) and not isinstance(value, bool) and value > 0
    share = isinstance(value, str) and re.fullmatch(r"(?=.*[1-9])[0-9]+(\.[0-9]+)? ?%", value)
    if not number and not share:
        message = (
            "needs half the width of the 95 % confidence interval: a share of the mean such as "
            f"5%, or a number > 0; got {described(value)}"
        )
        document.report(_place(document, path), path, message)
        return Target(metric, 1.0)
    return Target(metric, value)


def _place(document: Document, path: Path) -> Place:
    return document.values.get(path, Place(document.file, 1, 1))

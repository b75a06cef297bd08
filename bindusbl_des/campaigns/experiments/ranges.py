"""Ranges of values to vary, ends included: ``2:5`` in whole numbers, ``0:90:15`` in steps."""

import re
from fractions import Fraction
from typing import Any

from ...core.wording import plain

MOST_POINTS = 1_000_000

# More values of one key were hardly meant; grids of several keys may have more points.
MOST_VALUES = 10_000

NUMBER = r"[-+]?(?:[0-9]{1,30}(?:\.[0-9]{0,30})?|\.[0-9]{1,30})(?:[eE][-+]?[0-9]{1,2})?"
RANGE = re.compile(rf"\s*({NUMBER})\s*:\s*({NUMBER})\s*(?::\s*({NUMBER})\s*)?")
WHOLE = re.compile(r"[-+]?[0-9]+")

# What was meant as a range, right or wrong; module:object begins with a letter.
MEANT = re.compile(r"(?=.*[0-9])(?=.*:)[-+.:0-9][-+.:0-9eE\s]*")


def is_range(value: Any) -> bool:
    """Tell whether a value is meant as a range.

    >>> [is_range(it) for it in ("2:5", "0:90:0", ":5", "my_module:schedule", "dsatur", 2)]
    [True, True, True, False, False, False]
    """
    return isinstance(value, str) and MEANT.fullmatch(value) is not None


def spread(text: str) -> list[int] | list[float]:
    """Return the values of a range, both ends if its steps meet them.

    Steps are added as they are written, so that no rounding is: 0.3 is 0.3, not 0.1 + 0.1 + 0.1.

    >>> spread("2:5"), spread("0:90:45"), spread("0:0.3:0.1"), spread("3:1:-1"), spread("0:5:2")
    ([2, 3, 4, 5], [0, 45, 90], [0.0, 0.1, 0.2, 0.3], [3, 2, 1], [0, 2, 4])

    Raises:
        ValueError: when it is no range, leads nowhere or has too many values.
    """
    parts = RANGE.fullmatch(text)
    if not parts:
        raise ValueError("is no range; write first:last or first:last:step, as in 2:5 or 0:90:15")
    written = [part for part in parts.groups() if part]
    whole = all(map(WHOLE.fullmatch, written))
    first, last, *steps = map(Fraction, written)
    if not steps and not whole:
        raise ValueError(
            "counts in whole numbers without a step; write first:last:step, such as 0.5:2:0.5"
        )
    if not steps and last < first:
        raise ValueError(f"counts up; write {written[1]}:{written[0]}, or {text.strip()}:-1")
    step = steps[0] if steps else Fraction(1)
    if not step:
        raise ValueError(f"has a step of 0; write one that leads from {written[0]} to {written[1]}")
    if (last - first) * step < 0:
        other = plain(int(-step) if whole else float(-step))
        raise ValueError(f"leads away from {written[1]}; write {written[0]}:{written[1]}:{other}")
    count = (last - first) // step + 1
    if count > MOST_VALUES:
        raise ValueError(f"has {count:,} values, and at most {MOST_VALUES:,} may be; step wider")
    values = [first + number * step for number in range(count)]
    return [int(value) for value in values] if whole else [float(value) for value in values]

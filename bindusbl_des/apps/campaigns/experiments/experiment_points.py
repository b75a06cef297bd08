"""The points of an experiment: a grid (`vary`), a list (`points`) or a sample of ranges; and which
kind of file is which, by its keys.

Ranges of values to vary have their ends: ``2:5`` in whole numbers, ``0:90:15`` in steps.  Samples
are Latin hypercubes or Sobol' sequences.
"""

import math
import re
from collections.abc import Mapping, Sequence
from fractions import Fraction
from importlib import import_module
from itertools import product
from math import isfinite, prod
from typing import Any, Literal

from ....core.scenario import keys as table
from ....core.scenario.scenario import Scenario
from ....support.plain_data import Path
from ....support.plain_yaml import Document
from ....support.wording import described, did_you_mean, plain

KEYS = ("name", "scenario", "vary", "points", "sample", "seeds", "until_ci", "detail")

# What only a plan's file has
OF_PLANS = ("goal", "candidates", "confidence", "budget_s", "cost")


def is_plan(data: Any) -> bool:
    """Tell whether data have keys that only a plan's file has, valid or not."""
    return isinstance(data, dict) and any(key in data for key in OF_PLANS)


def is_experiment(data: Any) -> bool:
    """Tell whether data have keys of an experiment file, valid or not."""
    return isinstance(data, dict) and any(key in data for key in KEYS if key != "name")


def is_scenario(data: Any) -> bool:
    """Tell whether data are those of a scenario file, right or wrong, and of no experiment."""
    known = isinstance(data, dict) and any(key in data for key in Scenario.model_fields)
    return known and not is_experiment(data)


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

    >>> [is_range(value) for value in ("2:5", "0:90:0", ":5", "my_module:schedule", "dsatur", 2)]
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


Method = Literal["lhs", "sobol"]
METHODS = ("lhs", "sobol")
REMEDY = 'sampling needs scipy; install it with: python -m pip install "bindusbl-des[analysis]"'


class ScipyMissing(RuntimeError):
    """The extra `analysis` is not installed."""


def sampled(
    method: Method, count: int, seed: int, ranges: Mapping[str, Sequence[float]]
) -> list[dict[str, Any]]:
    """Return points that fill the ranges evenly; keys of whole numbers get whole numbers.

    Raises:
        ScipyMissing: when scipy is not installed.
    """
    try:
        qmc: Any = import_module("scipy.stats.qmc")
    except ImportError:
        raise ScipyMissing(REMEDY) from None
    if method == "lhs":
        unit = qmc.LatinHypercube(len(ranges), seed=seed).random(count)
    else:
        unit = qmc.Sobol(len(ranges), seed=seed).random_base2(int(math.log2(count)))
    whole = {row.key for row in table.settable() if row.kind.startswith("whole number")}
    return [
        {
            key: _between(float(share), *ranges[key], whole=key in whole)
            for key, share in zip(ranges, row, strict=True)
        }
        for row in unit
    ]


def _between(share: float, low: float, high: float, *, whole: bool) -> float | int:
    if whole:  # each whole number, both ends included, as often as the others
        return min(math.floor(low + share * (high - low + 1)), math.floor(high))
    return low + share * (high - low)


Points = list[dict[str, Any]]

# Where each value of each point stands in the file.
Places = list[dict[str, Path]]

SAMPLE_KEYS = ("method", "points", "seed", "ranges")


def points_in(document: Document) -> tuple[Points, Places]:
    """Return the points and where their values stand; mistakes go to the document.

    An experiment that varies nothing has one point.
    """
    data = document.data
    for name, read in (("vary", _grid), ("points", _list), ("sample", _sample)):
        if name in data:
            return read(document, data[name])
    return [{}], [{}]


def _is_unsettled(document: Document, section: str) -> bool:
    return any(path[:1] == (section,) for path in document.unsettled)


def _grid(document: Document, vary: Any) -> tuple[Points, Places]:
    """Return every combination of the values, the last key varying fastest."""
    if not is_section(document, ("vary",), vary, "dotted keys with lists of values"):
        return [], []
    axes = {key: _values(document, ("vary", key), values) for key, values in vary.items()}
    if _is_unsettled(document, "vary"):
        return [], []
    count = prod(map(len, axes.values()))
    if count > MOST_POINTS:
        document.note(("vary",), f"makes {count:,} points; at most {MOST_POINTS:,} can run")
        return [], []
    points: Points = []
    places: Places = []
    for row in product(*axes.values()):
        points.append({key: value for key, (value, _) in zip(axes, row, strict=True)})
        places.append({key: path for key, (_, path) in zip(axes, row, strict=True)})
    return points, places


def _values(document: Document, path: Path, given: Any) -> list[tuple[Any, Path]]:
    """Return the values of a key and where each stands; a range in a list is all of its values."""
    if is_range(given):
        return _spread(document, path, given)
    if not isinstance(given, list):
        message = (
            f"needs a list of values or a range, such as [1, 2] or 2:5; got {described(given)}"
        )
        document.note(path, message)
        return []
    if not given:
        document.note(path, "is an empty list; give at least one value")
    found: list[tuple[Any, Path]] = []
    for number, value in enumerate(given):
        place = (*path, number)
        found += _spread(document, place, value) if is_range(value) else [(value, place)]
    return found


def _spread(document: Document, path: Path, text: str) -> list[tuple[Any, Path]]:
    try:
        return [(value, path) for value in spread(text)]
    except ValueError as error:
        document.note(path, f"{text.strip()} {error}")
        return []


def is_section(document: Document, path: Path, data: Any, needs: str) -> bool:
    """Tell whether data is a section that is not empty; else the document notes what it needs."""
    if isinstance(data, dict) and data:
        return True
    got = "an empty section" if data == {} else described(data)
    document.note(path, f"needs {needs}; got {got}")
    return False


def _list(document: Document, points: Any) -> tuple[Points, Places]:
    if not isinstance(points, list) or not points:
        got = "an empty list" if points == [] else described(points)
        document.note(("points",), f"needs a list of points, {{key: value, ...}} each; got {got}")
        return [], []
    for number, point in enumerate(points):
        if not isinstance(point, dict):
            message = f"a point needs {{dotted.key: value, ...}}; got {described(point)}"
            document.note(("points", number), message)
    if _is_unsettled(document, "points"):
        return [], []
    return points, [
        {key: ("points", number, key) for key in point} for number, point in enumerate(points)
    ]


def _sample(document: Document, sample: Any) -> tuple[Points, Places]:
    if not is_section(document, ("sample",), sample, "method, points and ranges"):
        return [], []
    for key in sample:
        if key not in SAMPLE_KEYS:
            hint = did_you_mean(key, SAMPLE_KEYS) or f"; the keys are {', '.join(SAMPLE_KEYS)}"
            document.note(("sample", key), f"unknown key{hint}", at_key=True)
    method, count, seed = _method(document), _count(document), sample.get("seed", 0)
    if isinstance(seed, bool) or not isinstance(seed, int) or seed < 0:
        document.note(("sample", "seed"), f"needs a whole number >= 0; got {described(seed)}")
    _check_ranges(document, sample.get("ranges"))
    if _is_unsettled(document, "sample"):
        return [], []
    points = sampled(method, count, seed, sample["ranges"])
    return points, [{key: ("sample", "ranges", key) for key in point} for point in points]


def _method(document: Document) -> Any:
    method = document.data["sample"].get("method", "lhs")
    if method not in METHODS:
        hint = did_you_mean(str(method), METHODS)
        message = f"must be one of {', '.join(METHODS)}; got {described(method)}{hint}"
        document.note(("sample", "method"), message)
    return method


def _count(document: Document) -> int:
    sample = document.data["sample"]
    if "points" not in sample:
        document.note(("sample",), "points is missing; add it, such as `points: 64`")
        return 1
    count = sample["points"]
    path: Path = ("sample", "points")
    if isinstance(count, bool) or not isinstance(count, int) or not 1 <= count <= MOST_POINTS:
        message = f"needs a whole number (>= 1 and <= {MOST_POINTS}); got {described(count)}"
        document.note(path, message)
        return 1
    if sample.get("method") == "sobol" and count & (count - 1):
        near = 1 << count.bit_length()
        message = f"Sobol' points come in powers of two; write {near // 2} or {near}, not {count}"
        document.note(path, message)
    return count


def _check_ranges(document: Document, ranges: Any) -> None:
    path: Path = ("sample", "ranges")
    place = path if path in document.values else ("sample",)
    if not is_section(document, place, ranges, "ranges: {dotted.key: [low, high], ...}"):
        return
    for key, ends in ranges.items():
        pair = isinstance(ends, list) and len(ends) == 2 and all(map(is_number, ends))
        if not pair or not ends[0] < ends[1]:
            got = ends if isinstance(ends, list) else described(ends)
            document.note((*path, key), f"needs [low, high] with low < high; got {got}")


def is_number(value: Any) -> bool:
    """Tell whether a value of a file is a finite number; true is none."""
    return isinstance(value, int | float) and not isinstance(value, bool) and isfinite(value)

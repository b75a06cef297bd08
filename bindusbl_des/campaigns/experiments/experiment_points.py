"""The points of an experiment file: a grid (`vary`), a list (`points`) or a sample."""

from itertools import product
from math import isfinite, prod
from typing import Any

from ...core.wording import described, did_you_mean
from ...scenario.files.mistakes import Place
from ...scenario.files.plain_yaml import Document, Path
from .ranges import MOST_POINTS, is_range, spread
from .sampling import METHODS, sampled

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


def _note(document: Document, path: Path, message: str, at_key: bool = False) -> None:
    places = document.keys if at_key else document.values
    document.report(places.get(path, Place(document.file, 1, 1)), path, message)


def _is_unsettled(document: Document, section: str) -> bool:
    return any(path[:1] == (section,) for path in document.unsettled)


def _grid(document: Document, vary: Any) -> tuple[Points, Places]:
    """Return every combination of the values, the last key varying fastest."""
    if not _is_section(document, ("vary",), vary, "dotted keys with lists of values"):
        return [], []
    axes = {key: _values(document, ("vary", key), values) for key, values in vary.items()}
    if _is_unsettled(document, "vary"):
        return [], []
    count = prod(map(len, axes.values()))
    if count > MOST_POINTS:
        _note(document, ("vary",), f"makes {count:,} points; at most {MOST_POINTS:,} can run")
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
        _note(document, path, message)
        return []
    if not given:
        _note(document, path, "is an empty list; give at least one value")
    found: list[tuple[Any, Path]] = []
    for number, value in enumerate(given):
        place = (*path, number)
        found += _spread(document, place, value) if is_range(value) else [(value, place)]
    return found


def _spread(document: Document, path: Path, text: str) -> list[tuple[Any, Path]]:
    try:
        return [(value, path) for value in spread(text)]
    except ValueError as error:
        _note(document, path, f"{text.strip()} {error}")
        return []


def _is_section(document: Document, path: Path, data: Any, needs: str) -> bool:
    if isinstance(data, dict) and data:
        return True
    got = "an empty section" if data == {} else described(data)
    _note(document, path, f"needs {needs}; got {got}")
    return False


def _list(document: Document, points: Any) -> tuple[Points, Places]:
    if not isinstance(points, list) or not points:
        got = "an empty list" if points == [] else described(points)
        _note(document, ("points",), f"needs a list of points, {{key: value, ...}} each; got {got}")
        return [], []
    for number, point in enumerate(points):
        if not isinstance(point, dict):
            message = f"a point needs {{dotted.key: value, ...}}; got {described(point)}"
            _note(document, ("points", number), message)
    if _is_unsettled(document, "points"):
        return [], []
    return points, [
        {key: ("points", number, key) for key in point} for number, point in enumerate(points)
    ]


def _sample(document: Document, sample: Any) -> tuple[Points, Places]:
    if not _is_section(document, ("sample",), sample, "method, points and ranges"):
        return [], []
    for key in sample:
        if key not in SAMPLE_KEYS:
            hint = did_you_mean(key, SAMPLE_KEYS) or f"; the keys are {', '.join(SAMPLE_KEYS)}"
            _note(document, ("sample", key), f"unknown key{hint}", at_key=True)
    method, count, seed = _method(document), _count(document), sample.get("seed", 0)
    if isinstance(seed, bool) or not isinstance(seed, int) or seed < 0:
        _note(document, ("sample", "seed"), f"needs a whole number >= 0; got {described(seed)}")
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
        _note(document, ("sample", "method"), message)
    return method


def _count(document: Document) -> int:
    sample = document.data["sample"]
    if "points" not in sample:
        _note(document, ("sample",), "points is missing; add it, such as `points: 64`")
        return 1
    count = sample["points"]
    path: Path = ("sample", "points")
    if isinstance(count, bool) or not isinstance(count, int) or not 1 <= count <= MOST_POINTS:
        message = f"needs a whole number (>= 1 and <= {MOST_POINTS}); got {described(count)}"
        _note(document, path, message)
        return 1
    if sample.get("method") == "sobol" and count & (count - 1):
        near = 1 << count.bit_length()
        message = f"Sobol' points come in powers of two; write {near // 2} or {near}, not {count}"
        _note(document, path, message)
    return count


def _check_ranges(document: Document, ranges: Any) -> None:
    path: Path = ("sample", "ranges")
    place = path if path in document.values else ("sample",)
    if not _is_section(document, place, ranges, "ranges: {dotted.key: [low, high], ...}"):
        return
    for key, ends in ranges.items():
        pair = isinstance(ends, list) and len(ends) == 2 and all(map(_is_number, ends))
        if not pair or not ends[0] < ends[1]:
            got = ends if isinstance(ends, list) else described(ends)
            _note(document, (*path, key), f"needs [low, high] with low < high; got {got}")


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and isfinite(value)

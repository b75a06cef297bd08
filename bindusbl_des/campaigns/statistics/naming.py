"""How points of a campaign and their numbers are written: keys as short as they can be."""

import json
from collections.abc import Mapping, Sequence
from math import floor, isfinite, log10
from typing import Any

from ...core.wording import significant

# More decimals of a number, or digits of a mean, nobody reads.
MOST_DECIMALS = MOST_DIGITS = 4
# More values than this are named in a sentence by the first few.
MOST_NAMED = 6


def short_key(key: str, keys: Sequence[str]) -> str:
    """Return as many last words of a key as tell it from the others.

    >>> short_key("asvs.count", ["asvs.count"]), short_key("a.count", ["a.count", "b.count"])
    ('count', 'a.count')
    """
    words = key.split(".")
    for length in range(1, len(words)):
        tail = ".".join(words[-length:])
        if sum(other == tail or other.endswith(f".{tail}") for other in keys) == 1:
            return tail
    return key


def short_names(keys: Sequence[str]) -> dict[str, str]:
    """Return each key with its short name, which says what is counted.

    >>> short_names(["asvs.count", "acoustics.hf.range_m"])
    {'asvs.count': 'asvs.count', 'acoustics.hf.range_m': 'range_m'}
    """
    names = {key: short_key(key, keys) for key in keys}
    return {key: key if name == "count" else name for key, name in names.items()}


def written(value: Any) -> str:
    """Return one value of a key as text, numbers to six digits.

    >>> written(70.0), written(99.55962284528422), written("dsatur"), written([0, None])
    ('70', '99.5596', 'dsatur', '[0, null]')
    """
    if isinstance(value, int | float) and not isinstance(value, bool):
        return f"{value:.6g}"
    return value if isinstance(value, str) else json.dumps(value)


def point_name(point: int, varied: Mapping[str, Any]) -> str:
    """Return a point's number with what is particular to it.

    >>> point_name(3, {"asvs.count": 2, "navigation.filter.gain": 0.9})
    'point 3 (asvs.count=2, gain=0.9)'
    """
    names = short_names(list(varied))
    set_to = ", ".join(f"{names[key]}={written(value)}" for key, value in varied.items())
    return f"point {point} ({set_to})" if set_to else f"point {point}"


def points_named(points: Sequence[int]) -> str:
    """Return several points by their numbers, the first few of many.

    >>> points_named([1, 4, 5]), points_named(range(9))
    ('points 1, 4 and 5', 'points 0, 1, 2, 3, 4, 5 and 3 more')
    """
    if len(points) == 1:
        return f"point {points[0]}"
    if len(points) > MOST_NAMED:
        shown = ", ".join(map(str, points[:MOST_NAMED]))
        return f"points {shown} and {len(points) - MOST_NAMED} more"
    return "points " + listed([str(point) for point in points])


def listed(words: Sequence[str]) -> str:
    """Return words as one says them: a, b and c.

    >>> listed(["AUV0"]), listed(["AUV0", "AUV1", "AUV2"])
    ('AUV0', 'AUV0, AUV1 and AUV2')
    """
    return " and ".join(part for part in (", ".join(words[:-1]), words[-1]) if part)


def decimals(*scales: float) -> int:
    """Return the decimals that show two digits of the first scale that is known and not zero.

    >>> decimals(0.035), decimals(float("nan"), 12.0), decimals(0.0)
    (3, 0, 3)
    """
    known = [value for value in scales if isfinite(value) and value > 0]
    return min(max(1 - floor(log10(known[0])), 0), MOST_DECIMALS) if known else 3


def plus_minus(mean: float, half: float) -> str:
    """Return a mean with half its interval, as many digits as that bears, of the mean four.

    >>> plus_minus(0.9224, 0.0351), plus_minus(5.0, 0.0), plus_minus(264.43, 0.013)
    ('0.922 +- 0.035', '5.00 +- 0', '264.4 +- 0.0')
    """
    if not isfinite(half):
        return significant(mean)
    if half == 0:
        return f"{significant(mean)} +- 0"
    whole = max(floor(log10(abs(mean) or 1.0)) + 1, 1)
    places = max(min(decimals(half), MOST_DIGITS - whole), 0)
    return f"{mean:.{places}f} +- {half:.{places}f}"

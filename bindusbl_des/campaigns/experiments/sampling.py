"""Points spread over ranges: Latin hypercubes and Sobol' sequences."""

import math
from collections.abc import Mapping, Sequence
from importlib import import_module
from typing import Any, Literal

from ...scenario.keys import settable

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
    whole = {row.key for row in settable() if row.kind.startswith("whole number")}
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

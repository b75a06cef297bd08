"""Words for people who mistyped: the nearest right spelling."""

from collections.abc import Iterable
from difflib import get_close_matches


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """Return ``"; did you mean 'x'?"`` for the nearest known word, or an empty string.

    >>> did_you_mean("frequncy_khz", ["frequency_khz", "depth_m"])
    "; did you mean 'frequency_khz'?"
    """
    words = list(known)
    by_stem = [name for name in words if name.startswith(f"{word}_")]  # depth -> depth_m
    near = by_stem or get_close_matches(word, words, n=1, cutoff=0.6)
    return f"; did you mean {near[0]!r}?" if near else ""

"""Lifetimes of variables are worked out where they are asked for."""

from collections.abc import Iterator

import numpy as np
import pytest
from numba.core.errors import TypingError
from numba.core.postproc import PostProcessor

from bindusbl_des.core.compiled import compiled, entry


@compiled
def halves(length: int) -> Iterator[float]:
    table = np.arange(float(length))
    for row in range(length):
        half = table[row] / 2.0
        yield half


def total(length: int) -> float:
    found = 0.0
    for half in halves(length):
        found += half
    return found


def test_what_a_generator_remembers_is_known() -> None:
    assert entry(total)(5) == 5.0


def test_numba_is_left_as_it_was() -> None:
    """Also where a part was compiled in the midst, and where compiling failed."""
    before = PostProcessor.run
    entry(total)(5)
    assert PostProcessor.run is before
    with pytest.raises(TypingError, match="missing"):
        entry(lambda number: number.missing)(5)
    assert PostProcessor.run is before

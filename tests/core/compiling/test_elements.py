"""Elements of arrays are where numba finds them, however they are indexed and laid out."""

import operator
from typing import Any

import numpy as np
import pytest
from numba.core.base import OverloadSelector
from numba.core.registry import cpu_target

from bindusbl_des.core.compiled import entry

GRID = np.arange(24.0).reshape(4, 6)
PLACES = np.array([(1.5, 2), (3.5, 4)], [("x", "f8"), ("n", "i4")])


def read(array: Any, index: Any) -> Any:
    return array[index]


def write(array: Any, index: Any, value: Any) -> None:
    array[index] = value


def moved(places: Any, index: int) -> float:
    places[index].n = 7
    places[index]["x"] += 1.0
    return float(places[index].x)


ARRAYS = [
    pytest.param(GRID, id="rows"),
    pytest.param(np.asfortranarray(GRID), id="columns"),
    pytest.param(GRID[::-1, ::2], id="strided"),
    pytest.param(GRID.astype(np.int16), id="integers"),
]
INDICES = [(0, 0), (3, 1), (-1, -2), (np.uint8(2), 1), (2, np.int32(-1))]


@pytest.mark.parametrize("array", ARRAYS)
def test_elements_are_read_and_written_as_numpy_does(array: Any) -> None:
    reads, writes = entry(read), entry(write)
    for index in INDICES:
        plain = tuple(int(it) for it in index)
        assert reads(array, index) == array[plain]
        expected, found = array.copy("K"), array.copy("K")
        expected[plain] = 99
        writes(found, index, 99)
        np.testing.assert_array_equal(found, expected)


def test_rows_and_slices_are_left_to_numba() -> None:
    reads = entry(read)
    np.testing.assert_array_equal(reads(GRID, 1), GRID[1])
    np.testing.assert_array_equal(reads(GRID, (1, slice(2, 4))), GRID[1, 2:4])
    np.testing.assert_array_equal(reads(GRID, (np.array([2, 0]), 1)), GRID[[2, 0], 1])


def test_records_are_changed_where_they_stand() -> None:
    places = PLACES.copy()
    assert entry(moved)(places, -1) == 4.5
    assert places.tolist() == [(1.5, 2), (4.5, 7)]


def test_others_compile_with_numbas_own() -> None:
    entry(read)(GRID, (0, 0))
    assert type(cpu_target.target_context._defns[operator.getitem]) is OverloadSelector

"""Who holds an array is counted where that matters, and nowhere else."""

import sys
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
import pytest
from numba.core.runtime import _nrt_python, rtsys
from numpy.typing import NDArray

from bindusbl_des.core.compiled import compiled, entry

Table = NDArray[np.float64]


class Half(NamedTuple):
    """Rows of a table, and where they begin."""

    rows: Table
    first: int


@compiled
def later(table: Table) -> Table:
    return table[len(table) // 2 :]


@compiled
def half(table: Table) -> Half:
    return Half(later(table), len(table) // 2)


@compiled
def total(rows: Table) -> float:
    sums = 0.0
    for row in rows:
        sums += row[0]
    return sums


def sum_of_a_view(table: Table) -> float:
    return total(later(table))


def sum_of_a_tuple(table: Table) -> float:
    chosen = half(table)
    return total(chosen.rows) + total(Half(table, chosen.first).rows)


def sum_of_a_copy(table: Table) -> float:
    return total(table * 2.0)


def sum_of_chosen_rows(table: Table) -> float:
    return total(table[np.array([2, 0])])


def sum_of_either(table: Table) -> float:
    rows = table
    for _ in range(2):
        rows = later(rows) if len(rows) > 3 else rows.copy()
    return total(rows)


def sum_moved(table: Table) -> float:
    table[1:] = table[:-1]  # what is read overlaps what is written
    return total(table)


def handed_back(table: Table) -> Table:
    return table


CASES = [sum_of_a_view, sum_of_a_tuple, sum_of_a_copy, sum_of_chosen_rows, sum_of_either]
CASES += [pytest.param(sum_moved, marks=pytest.mark.slow), handed_back]


@pytest.fixture
def _counted() -> Iterator[None]:
    """Have the runtime count what it allocates."""
    _nrt_python.memsys_enable_stats()
    yield
    _nrt_python.memsys_disable_stats()


@pytest.mark.usefixtures("_counted")
@pytest.mark.parametrize("function", CASES)
def test_arrays_live_as_long_as_somebody_holds_them(function: Callable[[Table], object]) -> None:
    """Nothing is lost and nothing let go that is still held, however often it is called."""
    table = np.arange(8.0).reshape(8, 1)
    expected, compiled_ = function(table.copy()), entry(function)
    np.testing.assert_array_equal(compiled_(table.copy()), expected)  # type: ignore[call-overload]
    held, before = sys.getrefcount(table), rtsys.get_allocation_stats()
    for _ in range(50):
        compiled_(table)
    after = rtsys.get_allocation_stats()
    assert after.alloc - before.alloc == after.free - before.free
    assert after.mi_alloc - before.mi_alloc == after.mi_free - before.mi_free
    assert sys.getrefcount(table) == held


def names_row(table: Table) -> float:
    row = table[1]
    kept = Half(table[2:], 2)
    return row[0] + kept.rows[0, 0] + len(kept.rows)


def names_made_row(table: Table) -> float:
    row = table[1].copy()
    return row[0]


@pytest.mark.parametrize(("function", "counts"), [(names_row, False), (names_made_row, True)])
def test_only_functions_that_make_arrays_count(function: object, counts: bool) -> None:
    dispatcher: Any = entry(function)  # type: ignore[type-var]
    dispatcher._cache.flush()  # code that was kept lets go of its bytes
    dispatcher(np.ones((4, 1)))
    (code,) = dispatcher.overloads.values()
    assert (b"NRT_decref" in code.library._get_compiled_object()) is counts

"""What the compiler knows already is what numba would work out again."""

import gc
import operator
from collections.abc import Callable
from itertools import product
from typing import Any

import numba
import numpy as np
import pytest
from numba.core import types
from numba.core.compiler import Flags
from numba.core.registry import cpu_target

from bindusbl_des.core.compiled import compiled, entry
from bindusbl_des.core.compiling.compiler import _Flags, _types

NUMBERS = [types.int64, types.float64, types.boolean, types.literal(2), types.uint8]


@pytest.mark.parametrize("collects", [True, False])
def test_garbage_is_collected_after_compiling_as_before(collects: bool) -> None:
    def third(number: float) -> float:
        return number / 3.0

    before = gc.isenabled()
    (gc.enable if collects else gc.disable)()
    try:
        compiled = entry(third)
        compiled.compile("float64(float64)")  # type: ignore[attr-defined]
        assert gc.isenabled() is collects
        assert gc.get_freeze_count() == 0
    finally:
        (gc.enable if before else gc.disable)()


def test_flags_are_equal_where_numbas_are() -> None:
    """Also to numba's own, by which overloads that others compiled are found."""
    one, other = Flags(), Flags()
    one.nrt = other.nrt = True
    ours = [_Flags(it) for it in (one, other)]
    assert ours[0] == ours[1] == one
    assert len({one, other, *ours}) == 1
    other.error_model = "numpy"
    assert _Flags(other) != ours[0]
    assert _Flags(other) != one


def test_called_functions_inherit_what_concerns_all() -> None:
    flags = _Flags(Flags())
    flags.error_model, flags.nrt, flags.forceinline, flags.no_compile = "numpy", True, True, True
    inherited = flags.copy()
    assert (inherited.error_model, inherited.nrt) == ("numpy", True)
    assert not inherited.forceinline
    assert not inherited.no_compile


@pytest.mark.parametrize("by", [operator.add, operator.truediv, operator.mod, operator.lt])
def test_operators_have_the_types_that_numba_gives_them(by: Callable[..., object]) -> None:
    """Asked once and once more, and of another operator's name as well."""
    for args in product(NUMBERS, NUMBERS):
        expected = cpu_target.typing_context.resolve_function_type(by, args, {})
        assert _types().resolve_function_type(by, args, {}) == expected
        assert _types().resolve_function_type(by, args, {}) == expected


def room(count: int) -> float:
    return len(np.empty(count)) + min(count, 2.0)


def least(count: int) -> float:
    return np.sort(np.arange(count) + 6.0)[0]  # type: ignore[no-any-return]


def norm(count: int) -> float:
    return np.linalg.norm(np.full((2, 2), count / 4.0)) * 3.0  # type: ignore[return-value]


@pytest.mark.parametrize("function", [room, least, pytest.param(norm, marks=pytest.mark.slow)])
@pytest.mark.parametrize("ours_first", [True, False])
def test_numbas_own_functions_serve_us_and_others_in_any_order(
    function: Callable[[int], float], ours_first: bool
) -> None:
    """They are parts where ours call them, and whole where others do."""
    part: Any = compiled(function)

    def twice(count: int) -> float:
        return 2.0 * part(count)

    ours, theirs = entry(twice), numba.njit(function)
    ours._cache.flush()  # type: ignore[attr-defined]
    found = [(ours if ours_first else theirs)(4), (theirs if ours_first else ours)(4)]
    assert sorted(found) == [6.0, 12.0]
    assert numba.njit(function)(4) == 6.0

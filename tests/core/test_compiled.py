"""How equations are compiled: with garbage collected again afterwards, and flags as numba's are."""

import gc

import pytest
from numba.core.compiler import Flags

from bindusbl_des.core.compiled import entry
from bindusbl_des.core.compiling.compiler import _Flags


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

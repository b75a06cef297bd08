"""What compiled code is handed once: arrays by their addresses, in one record."""

from typing import Annotated, Any, NamedTuple, TypeVar

import numpy as np
import pytest
from numpy.typing import NDArray
from typing_extensions import TypeAliasType

from bindusbl_des.support.compiled import compiled
from bindusbl_des.support.packed import Packed, unpacked

FLAG = np.dtype([("number", "i8"), ("value", "f8")])


class Inner(NamedTuple):
    """What is inside another tuple."""

    plane: Annotated[NDArray[np.float64], 2]
    is_doubled: bool


class Outer(NamedTuple):
    """One of everything."""

    scale: float
    flags: Annotated[NDArray[np.void], FLAG]
    inner: Inner
    first: NDArray[np.int64]
    count: int
    grid: Annotated[NDArray[np.void], FLAG, 2]


@compiled
def work(packed: int, row: int) -> float:
    """Read each field, and write to a row."""
    it = unpacked(packed, Outer)
    factor = 2.0 if it.inner.is_doubled else 1.0
    it.flags[row].number = len(it.flags) + it.first[row] + it.count + it.grid[1, 0].number
    it.flags[row].value = it.scale * it.inner.plane[row, 1] * factor
    return float(it.inner.plane.shape[1] + it.inner.plane[-1, -1])


def everything(**changes: Any) -> Outer:
    """Return a tuple of everything, but for some fields."""
    plane = np.arange(6.0).reshape(3, 2)
    flags, grid = np.zeros(3, FLAG), np.zeros((2, 2), FLAG)
    grid["number"][1, 0] = 1000
    whole = Outer(0.5, flags, Inner(plane, True), np.array([7, 8, 9]), 100, grid)
    return whole._replace(**changes)


Of = TypeVar("Of", bound=np.generic)
Alias = TypeAliasType("Alias", np.ndarray[Any, np.dtype[Of]], type_params=(Of,))


class Aliased(NamedTuple):
    """An array as numpy 2.5 spells it from Python 3.12 on: by an alias that hides what it is of."""

    plane: Annotated[Alias[np.float64], 2]  # type: ignore[valid-type]


def test_an_alias_of_arrays_says_what_it_is_of() -> None:
    Packed(Aliased(np.zeros((2, 2))))
    for wrong in (np.zeros(2), np.zeros((2, 2), dtype="f4")):
        with pytest.raises(TypeError, match="is an array of"):
            Packed(Aliased(wrong))


@pytest.mark.parametrize("is_doubled", [False, True])
def test_every_field_is_what_was_handed_over(is_doubled: bool) -> None:
    whole = everything(inner=Inner(np.arange(6.0).reshape(3, 2), is_doubled))
    packed = Packed(whole)
    assert work(packed.address, 1) == 2 + 5.0
    assert whole.flags[1].item() == (3 + 8 + 100 + 1000, 0.5 * 3.0 * (1 + is_doubled))
    assert whole.flags[0].item() == whole.flags[2].item() == (0, 0.0)


def test_a_field_that_is_renewed_is_another_from_then_on() -> None:
    """The array before stays as it is, and all that was handed over is kept alive."""
    whole = everything()
    packed = Packed(whole)
    packed.renew("flags", np.zeros(1000, FLAG))
    packed.renew("inner", Inner(np.full((1000, 4), 3.0), False))
    packed.renew("first", np.arange(1000))
    work(packed.address, 999)
    again = np.zeros(1000, FLAG)
    packed.renew("flags", again)
    assert work(packed.address, 999) == 4 + 3.0
    assert again[999].item() == (1000 + 999 + 100 + 1000, 1.5)
    assert not whole.flags["number"].any()


@pytest.mark.parametrize(
    "change",
    [
        {"first": np.zeros(3)},
        {"first": np.zeros((3, 1), np.int64)},
        {"first": np.arange(6)[::2]},
        {"flags": np.zeros(3, [("number", "i8"), ("value", "f4")])},
        {"inner": Inner(np.zeros(4), True)},
    ],
)
def test_an_array_of_another_kind_is_refused(change: dict[str, Any]) -> None:
    """Compiled code would read what is not there."""
    with pytest.raises(TypeError, match="is an array of"):
        Packed(everything(**change))
    packed = Packed(everything())
    with pytest.raises(TypeError, match="is an array of"):
        packed.renew(*change.popitem())

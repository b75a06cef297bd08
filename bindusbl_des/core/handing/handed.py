"""What compiled code is handed once: numbers and arrays that it works with again and again.

Handing an array over takes as long as working out where a vehicle is, and a step of a mission works
with a dozen of them.  So their addresses are written to one record, and its own is handed over.
"""

from functools import cache
from typing import Annotated, Any, NamedTuple, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

# Each number stands in a word of eight bytes.
NUMBERS: dict[Any, str] = {float: "f8", int: "i8", bool: "i8"}


class Kind(NamedTuple):
    """An array that is handed over: of what, and with how many axes."""

    of: np.dtype[Any]
    axes: int


class Handed:
    """A named tuple of numbers, arrays and such tuples, for compiled code to open again
    (:func:`.opened.opened`).

    Its class says what it holds: ``Annotated[Rows, PING]`` are rows of records of a kind, and
    ``Annotated[Floats, 2]`` has two axes, where an array has not one; both can be said.  Arrays
    must stay where they are; one that is replaced is renewed.  Whoever calls compiled code keeps
    this meanwhile.
    """

    def __init__(self, whole: Any) -> None:
        """Take the tuple; its arrays live as long as this does."""
        kind: Any = type(whole)
        self._fields, self._held = fields_of(kind), whole._asdict()
        self._row: NDArray[np.void] = np.zeros(1, _layout(kind))
        self._row[0] = _written(kind, whole)
        #: What compiled code is handed: where the record is.
        self.address: int = self._row.ctypes.data

    def renew(self, name: str, value: Any) -> None:
        """Take another array, or tuple, in the place of one of its fields."""
        self._held[name] = value
        self._row[name] = _field(name, self._fields[name], value)


@cache
def fields_of(whole: Any) -> dict[str, Any]:
    """Return what the fields of a tuple are: classes of numbers or tuples, or the kind of array."""
    hints = get_type_hints(whole, include_extras=True)
    return {name: hint if isinstance(hint, type) else _kind(hint) for name, hint in hints.items()}


def _kind(hint: Any) -> Kind:
    """Return the kind of array that a hint such as Annotated[NDArray[np.float64], 2] means."""
    further: list[Any] = []
    if get_origin(hint) is Annotated:
        hint, *further = get_args(hint)
    of = [it for it in further if isinstance(it, np.dtype)]
    axes = [it for it in further if isinstance(it, int)]
    return Kind(of[0] if of else np.dtype(get_args(get_args(hint)[1])[0]), axes[0] if axes else 1)


@cache
def _layout(whole: Any) -> np.dtype[np.void]:
    """Return the record of a tuple, in which arrays stand as numba's compiled code has them."""

    def field(hint: Any) -> Any:
        if isinstance(hint, Kind):
            words = [(name, "i8") for name in ("holder", "parent", "size", "item", "address")]
            return [*words, ("shape", "i8", (hint.axes,)), ("strides", "i8", (hint.axes,))]
        return NUMBERS[hint] if hint in NUMBERS else _layout(hint)

    return np.dtype([(name, field(hint)) for name, hint in fields_of(whole).items()])


def _written(kind: Any, whole: Any) -> tuple[Any, ...]:
    """Return what stands in the record of a tuple of a class."""
    fields = zip(fields_of(kind).items(), whole, strict=True)
    return tuple([_field(name, hint, value) for (name, hint), value in fields])


def _field(name: str, hint: Any, value: Any) -> Any:
    """Return what stands in a record for one field of a tuple.

    Raises:
        TypeError: for an array that is not what the tuple's class says, or not in one piece.
    """
    if hint in NUMBERS:
        return value
    if not isinstance(hint, Kind):
        return _written(hint, value)
    if (value.dtype, value.ndim) != hint or not value.flags.c_contiguous:
        raise TypeError(f"{name} is an array of {value.dtype} {value.shape}, not {hint}")
    return 0, 0, value.size, value.itemsize, value.ctypes.data, value.shape, value.strides

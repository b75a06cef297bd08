"""What compiled code is handed once: numbers and arrays that it works with again and again.

Handing an array over takes as long as working out where a vehicle is, and a step of a mission works
with a dozen of them.  So their addresses are written to one record, and its own is handed over.
"""

from functools import cache
from itertools import takewhile
from struct import Struct
from typing import Annotated, Any, NamedTuple, get_args, get_origin, get_type_hints

import numpy as np

# Each number stands in a word of eight bytes.
NUMBERS: dict[Any, str] = {float: "d", int: "q", bool: "q"}


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
        self._kind, self._held = kind, whole._asdict()
        self._record = np.empty(_record(kind).size, dtype=np.uint8)
        self._put(0, "", kind, whole)
        #: What compiled code is handed: where the record is.
        self.address: int = self._record.ctypes.data

    def renew(self, name: str, value: Any) -> None:
        """Take another array, or tuple, in the place of one of its fields."""
        fields = fields_of(self._kind)
        before = takewhile(lambda field: field != name, fields)
        self._held[name] = value
        self._put(sum(_record(fields[it]).size for it in before), name, fields[name], value)

    def _put(self, place: int, name: str, hint: Any, value: Any) -> None:
        words: list[Any] = []
        _write(name, hint, value, words)
        _record(hint).pack_into(self._record.data, place, *words)


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
    while inner := get_args(hint):  # the element stands last, however numpy spells NDArray
        hint = inner[-1]
    of = [it for it in further if isinstance(it, np.dtype)]
    axes = [it for it in further if isinstance(it, int)]
    return Kind(of[0] if of else np.dtype(hint), axes[0] if axes else 1)


@cache
def _record(hint: Any) -> Struct:
    """Return the record of a field, in which arrays stand as numba's compiled code has them."""
    return Struct(_words(hint))


def _words(hint: Any) -> str:
    """Return the words of a field; of an array who counts its holders, who it is to Python (nobody,
    both), number and size of its elements, where they are, shape and strides.
    """
    if isinstance(hint, Kind):
        return "q" * (5 + 2 * hint.axes)
    return NUMBERS[hint] if hint in NUMBERS else "".join(map(_words, fields_of(hint).values()))


def _write(name: str, hint: Any, value: Any, words: list[Any]) -> None:
    """Add what stands in a record for one field of a tuple.

    Raises:
        TypeError: for an array that is not what the tuple's class says, or not in one piece.
    """
    if hint in NUMBERS:
        words.append(value)
    elif isinstance(hint, Kind):
        same = value.dtype is hint.of or value.dtype == hint.of  # to compare fields takes long
        if not same or value.ndim != hint.axes or not value.flags.c_contiguous:
            raise TypeError(f"{name} is an array of {value.dtype} {value.shape}, not {hint}")
        words += (0, 0, value.size, value.itemsize, value.ctypes.data)
        words += (*value.shape, *value.strides)
    else:
        for (part, of), its_own in zip(fields_of(hint).items(), value, strict=True):
            _write(part, of, its_own, words)

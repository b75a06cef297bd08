"""What compiled code is handed once: numbers and arrays that it works with again and again.

Theory of operation
-------------------
Handing an array over takes as long as working out where a vehicle is, and a step of a mission works
with a dozen of them.  So their addresses and shapes are written to one record, whose own address is
handed over; compiled code makes them again from there (:func:`unpacked`).  Arrays are not copied:
what either side writes to one the other sees.  Numbers are, as they were when the record was made.

What holds: a tuple's class alone says what is in the record, so that the code that opens it is
written from the class; an array stays where it is while its record is used, and one that had to
grow is replaced (:meth:`Packed.renew`) before compiled code is called again; whoever calls keeps
the :class:`Packed` alive meanwhile.
"""

from ctypes import addressof, c_char
from functools import cache
from itertools import takewhile
from struct import Struct
from typing import (
    Annotated,
    Any,
    NamedTuple,
    Protocol,
    TypeVar,
    get_args,
    get_origin,
    get_type_hints,
)  # fmt: skip
from weakref import WeakValueDictionary

import numba
import numpy as np
from numba.extending import intrinsic, overload

from .compiled import is_uncompiled
from .facts import cached_property
from .uncompiled import as_compiled

Whole = TypeVar("Whole")

# Each number stands in a word of eight bytes.
NUMBERS: dict[Any, str] = {float: "d", int: "q", bool: "q"}


class ArrayKind(NamedTuple):
    """An array that is handed over: of what, and with how many axes."""

    of: np.dtype[Any]
    axes: int


class Packed:
    """A named tuple of numbers, arrays and such tuples, for compiled code to open again
    (:func:`unpacked`).

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
        self.address: int = addressof(c_char.from_buffer(self._record.data))
        if IN_PYTHON is not None:
            IN_PYTHON[self.address] = self

    @cached_property
    def whole(self) -> Any:
        """The tuple as equations see it that are not compiled."""
        return as_compiled(self._kind(**self._held))

    def renew(self, name: str, value: Any) -> None:
        """Take another array, or tuple, in the place of one of its fields."""
        fields = fields_of(self._kind)
        before = takewhile(lambda field: field != name, fields)
        self._held[name] = value
        self.__dict__.pop("whole", None)
        self._put(sum(_record(fields[field]).size for field in before), name, fields[name], value)

    def _put(self, place: int, name: str, hint: Any, value: Any) -> None:
        words: list[Any] = []
        _write(name, hint, value, words)
        _record(hint).pack_into(self._record.data, place, *words)


@cache
def fields_of(whole: Any) -> dict[str, Any]:
    """Return what the fields of a tuple are: classes of numbers or tuples, or the kind of array."""
    hints = get_type_hints(whole, include_extras=True)
    return {name: hint if isinstance(hint, type) else _kind(hint) for name, hint in hints.items()}


def _kind(hint: Any) -> ArrayKind:
    """Return the kind of array that a hint such as Annotated[NDArray[np.float64], 2] means."""
    further: list[Any] = []
    if get_origin(hint) is Annotated:
        hint, *further = get_args(hint)
    while inner := get_args(hint):  # the element stands last, however numpy spells NDArray
        hint = inner[-1]
    of = [detail for detail in further if isinstance(detail, np.dtype)]
    axes = [detail for detail in further if isinstance(detail, int)]
    return ArrayKind(of[0] if of else np.dtype(hint), axes[0] if axes else 1)


@cache
def _record(hint: Any) -> Struct:
    """Return the record of a field."""
    return Struct(_words(hint))


def _words(hint: Any) -> str:
    """Return the words of a field; of an array its address and shape."""
    if isinstance(hint, ArrayKind):
        return "q" * (1 + hint.axes)
    return NUMBERS[hint] if hint in NUMBERS else "".join(map(_words, fields_of(hint).values()))


def _write(name: str, hint: Any, value: Any, words: list[Any]) -> None:
    """Add what stands in a record for one field of a tuple.

    Raises:
        TypeError: for an array that is not what the tuple's class says, or not in one piece.
    """
    if hint in NUMBERS:
        words.append(value)
    elif isinstance(hint, ArrayKind):
        same = value.dtype is hint.of or value.dtype == hint.of  # to compare fields takes long
        if not same or value.ndim != hint.axes or not value.flags.c_contiguous:
            raise TypeError(f"{name} is an array of {value.dtype} {value.shape}, not {hint}")
        if value.size and value.flags.writeable:  # a third of the time of `ctypes.data`
            words.append(addressof(c_char.from_buffer(value)))
        else:
            words.append(value.ctypes.data)
        words += value.shape
    else:
        for (part, of), its_own in zip(fields_of(hint).items(), value, strict=True):
            _write(part, of, its_own, words)


class _Unpacked(Protocol):
    """How :func:`unpacked` is called in compiled code, and nowhere else."""

    def __call__(self, packed: int, whole: type[Whole]) -> Whole:
        """Return the tuple, of a class, whose record was handed over, by its address."""


# What was handed over, by its address, where equations are not compiled.
IN_PYTHON: WeakValueDictionary[int, Packed] | None = (
    WeakValueDictionary() if is_uncompiled() else None
)


def _unpacked(packed: int, whole: type[Whole]) -> Whole:
    if IN_PYTHON is None:
        raise RuntimeError("only compiled code opens what it was handed")
    found: Whole = IN_PYTHON[packed].whole
    return found


unpacked: _Unpacked = _unpacked


@intrinsic
def _pointer(_: Any, address: Any) -> Any:
    """Return an address as `numba.carray` takes it."""

    def build(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        return builder.inttoptr(given[0], context.get_value_type(signature.return_type))

    return numba.types.voidptr(numba.types.int64), build


@overload(_unpacked, strict=False, jit_options={"forceinline": True})
def _open(_: Any, whole: Any) -> Any:
    """Write how a tuple of a class is made of the words of its record."""
    carray = numba.carray  # type: ignore[attr-defined]  # not in the stubs
    names: dict[str, Any] = {"carray": carray, "pointer": _pointer, "np": np}
    made, words = _made(whole.instance_class, 0, names)
    source = f"""def implementation(packed, whole):
    words = carray(pointer(packed), {words}, np.int64)
    numbers = carray(pointer(packed), {words}, np.float64)
    return {made}
"""
    exec(source, names)
    return names["implementation"]


def _made(hint: Any, place: int, names: dict[str, Any]) -> tuple[str, int]:
    """Return how a field is made of its words, and the place of the word behind them."""
    if hint in NUMBERS:
        word = f"numbers[{place}]" if hint is float else f"words[{place}]"
        return f"{word} != 0" if hint is bool else word, place + 1
    kind = f"kind{len(names)}"
    if isinstance(hint, ArrayKind):
        names[kind] = hint.of
        behind = place + 1 + hint.axes
        shape = ", ".join(f"words[{axis}]" for axis in range(place + 1, behind))
        return f"carray(pointer(words[{place}]), ({shape},), {kind})", behind
    names[kind] = hint
    parts = []
    for field in fields_of(hint).values():
        part, place = _made(field, place, names)
        parts.append(part)
    return f"{kind}({', '.join(parts)})", place

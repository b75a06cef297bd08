"""Compiled code opens what it was handed once (:mod:`.handed`): nothing is copied but addresses."""

from collections.abc import Callable
from typing import Any, Protocol, TypeVar, cast

from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic
from numba.np.numpy_support import from_dtype

from ..compiling.counting import lenders
from .handed import NUMBERS, Kind, fields_of

Whole = TypeVar("Whole")
WORD = ir.IntType(64)
TYPES = dict(zip(NUMBERS, (types.float64, types.int64, types.boolean), strict=True))

# What numba does not tell the type checker the types of
made_of: Any = types.BaseTuple.from_types
is_not_null: Any = cgutils.is_not_null


class Opened(Protocol):
    """How :func:`opened` is called in compiled code, and nowhere else."""

    def __call__(self, handed: int, whole: type[Whole]) -> Whole:
        """Return the tuple, of a class, whose record was handed over, by its address."""


def _type(hint: Any) -> Any:
    """Return what compiled code takes a field for."""
    if isinstance(hint, Kind):
        return types.Array(from_dtype(hint.of), hint.axes, "C")
    if hint in TYPES:
        return TYPES[hint]
    return made_of([_type(part) for part in fields_of(hint).values()], hint)


def _opened(_: Any, handed: Any, whole: Any) -> Any:
    made = _type(whole.instance_class)

    def build(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        words = builder.inttoptr(given[0], WORD.as_pointer())
        return _loaded(context, builder, words, made)[0]

    return made(types.int64, whole), build


opened = cast(Opened, intrinsic(_opened))
lenders.add(opened)


def _loaded(context: Any, builder: Any, words: Any, made: Any) -> tuple[Any, Any]:
    """Load a value of a type from words of a record; return it and the words behind it."""

    def word(number: int) -> Any:
        return builder.load(builder.gep(words, [WORD(number)]))

    def behind(number: int) -> Any:
        return builder.gep(words, [WORD(number)])

    if isinstance(made, types.BaseNamedTuple):
        parts = []
        for part in cast(Any, made).types:
            value, words = _loaded(context, builder, words, part)
            parts.append(value)
        return context.make_tuple(builder, made, parts), words
    if isinstance(made, types.Array):
        return _array(context, builder, word, made), behind(1 + made.ndim)
    if made == types.boolean:
        return is_not_null(builder, word(0)), behind(1)
    return builder.bitcast(word(0), context.get_value_type(made)), behind(1)


def _array(context: Any, builder: Any, word: Callable[[int], Any], made: Any) -> Any:
    """Return an array whose address and lengths are words of a record."""
    from numba.np import arrayobj  # which only who compiles has to load

    arrays: Any = arrayobj
    array = arrays.make_array(made)(context, builder)
    kind = context.get_data_type(made.dtype)
    size = context.get_abi_sizeof(kind)
    shape, strides = [word(1 + axis) for axis in range(made.ndim)], [WORD(size)]
    for length in reversed(shape[1:]):
        strides.insert(0, builder.mul(length, strides[0]))
    data = builder.inttoptr(word(0), kind.as_pointer())
    arrays.populate_array(array, data, shape, strides, WORD(size), None)
    return array._getvalue()

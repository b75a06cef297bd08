"""One element of an array, reached in a few of LLVM's instructions.

numba copies all that it knows of an array to memory for each element that is read or written, and
takes it apart there, twice: a sixth of what LLVM was given, none of it left when that is optimised.
"""

import operator
from collections import ChainMap, defaultdict
from typing import Any

from numba.core import cgutils, types
from numba.core.base import OverloadSelector
from numba.np import arrayobj

Signature = tuple[Any, ...]

# What numba does not tell the type checker the types of
Tuple: Any = types.BaseTuple
unpacked: Any = cgutils.unpack_tuple
get_item_pointer: Any = cgutils.get_item_pointer2
fix_integer_index: Any = arrayobj.fix_integer_index
load_item: Any = arrayobj.load_item
store_item: Any = arrayobj.store_item


def with_elements(functions: defaultdict[Any, OverloadSelector]) -> ChainMap[Any, OverloadSelector]:
    """Return what numba knows of making functions into code, with elements made by us."""
    made = {operator.getitem: _read, operator.setitem: _write}
    return ChainMap(
        {name: _Elements(ours, functions[name]) for name, ours in made.items()}, functions
    )


class _Elements(OverloadSelector):
    """Chooses how arrays are indexed: where all axes are by integers, as here, or else as numba."""

    def __init__(self, ours: Any, numbas: Any) -> None:
        self._ours, self._numbas = ours, numbas

    def find(self, sig: Signature) -> Any:
        return self._ours if _of_one(*sig[:2]) else self._numbas.find(sig)

    def append(self, value: Any, sig: Signature) -> None:
        self._numbas.append(value, sig)


def _indices(index: Any) -> Signature:
    """Return the types of an index, axis by axis."""
    return tuple(index) if isinstance(index, Tuple) else (index,)


def _of_one(array: Any, index: Any) -> bool:
    """Tell whether an index, of a type, is that of one element of an array."""
    indices = _indices(index)
    integers = all(isinstance(it, types.Integer) for it in indices)
    return isinstance(array, types.Array) and integers and len(indices) == array.ndim


def _place(context: Any, builder: Any, kinds: Signature, values: Signature) -> Any:
    """Return where an element of an array is in memory."""
    (kind, by), (array, index) = kinds[:2], values[:2]

    def known(field: str) -> Any:
        return context.data_model_manager[kind].get(builder, array, field)

    shape = unpacked(builder, known("shape"))
    strides = unpacked(builder, known("strides")) if kind.layout == "A" else ()
    given = unpacked(builder, index) if isinstance(by, Tuple) else (index,)
    each = zip(_indices(by), given, shape, strict=True)
    indices = [fix_integer_index(context, builder, *it) for it in each]
    where = known("data"), shape, strides, kind.layout, indices
    check = context.enable_boundscheck
    return get_item_pointer(context, builder, *where, boundscheck=check)


def _read(context: Any, builder: Any, signature: Any, values: Signature) -> Any:
    place = _place(context, builder, signature.args, values)
    return load_item(context, builder, signature.args[0], place)


def _write(context: Any, builder: Any, signature: Any, values: Signature) -> None:
    array, _, kind = signature.args
    value = context.cast(builder, values[2], kind, array.dtype)
    store_item(context, builder, array, value, _place(context, builder, signature.args, values))

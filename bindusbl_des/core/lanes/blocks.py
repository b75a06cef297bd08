"""Rows of lanes in memory: the columns of an array (rows, LANES) are four vehicles."""
# numba tells no types of what it is extended by:
# mypy: disable-error-code="no-untyped-call, untyped-decorator"

import operator
from collections.abc import Callable
from typing import Any, cast

import numpy as np
from llvmlite import ir
from numba.core import types
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin, models, register_model
from numpy.typing import NDArray

from .numbers import DOUBLE, LANES, VECTOR, Lanes, lanes

Floats = NDArray[np.float64]

BYTES = ir.IntType(64)
ALIGNED = 8  # bytes: numpy promises no more


class Block(types.Type):
    """The type of rows of lanes: where they begin, and nothing else.

    It does not keep the array alive: that has to be an argument of the function that Python enters.
    """

    def __init__(self) -> None:
        super().__init__(name="Block")


block_type = Block()


@register_model(Block)
class _BlockModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Block) -> None:
        super().__init__(manager, kind, ir.PointerType(DOUBLE))


def _block(_: Any, array: Any, first: Any) -> Any:
    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        data = context.make_array(sig.args[0])(context, builder, args[0]).data
        return _row(builder, data, args[1])

    fits = isinstance(array, types.Array) and array.layout == "C" and array.ndim == 2
    if not (fits and array.dtype == types.float64 and isinstance(first, types.Integer)):
        return None
    return block_type(array, types.int64), build


def _row(builder: Any, begin: Any, number: Any) -> Any:
    """Build the address of a row."""
    return builder.gep(begin, [builder.mul(number, ir.Constant(BYTES, LANES))])


@infer_global(operator.getitem)
class _Get(AbstractTemplate):
    def generic(self, args: Any, _: Any) -> Any:
        if args[0] is block_type and isinstance(args[1], types.Integer):
            return signature(lanes, block_type, types.int64)
        return None


@infer_global(operator.setitem)
class _Set(AbstractTemplate):
    def generic(self, args: Any, _: Any) -> Any:
        if args[0] is block_type and isinstance(args[1], types.Integer):
            return signature(types.none, block_type, types.int64, lanes)
        return None


@lower_builtin(operator.getitem, Block, types.Integer)
def _get(_context: Any, builder: Any, _sig: Any, args: Any) -> Any:
    row = builder.bitcast(_row(builder, *args), VECTOR.as_pointer())
    return builder.load(row, align=ALIGNED)


@lower_builtin(operator.setitem, Block, types.Integer, Lanes)
def _set(context: Any, builder: Any, _sig: Any, args: Any) -> Any:
    row = builder.bitcast(_row(builder, *args[:2]), VECTOR.as_pointer())
    builder.store(args[2], row, align=ALIGNED)
    return context.get_dummy_value()


#: Rows of lanes, from a row on, of an array (rows, LANES).
block = cast(Callable[[Floats, int], Floats], intrinsic(_block))

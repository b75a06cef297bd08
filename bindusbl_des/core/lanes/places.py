"""Tables that four lanes look up at once, each at a place of its own."""
# numba tells no types of what it is extended by:
# mypy: disable-error-code="no-untyped-call"

from collections.abc import Callable
from typing import Any, cast

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic
from numpy.typing import NDArray

from .numbers import LANES, PLACE, VECTOR, lanes

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

TABLE, WHOLE = types.Array(types.float64, 2, "C"), types.Array(types.int64, 1, "C")
FOUR = types.UniTuple(lanes, 4)

PLACES = 128  # rows of a table, as many as seven bits tell apart, so that none lead beyond it


def _transposed(builder: Any, rows: list[Any]) -> list[Any]:
    """Build the four columns of four rows of four."""
    for picked in ([0, 4, 2, 6], [1, 5, 3, 7]), ([0, 1, 4, 5], [2, 3, 6, 7]):
        rows = [
            builder.shuffle_vector(*pair, ir.Constant(ir.VectorType(PLACE, LANES), order))
            for order in picked
            for pair in (rows[:2], rows[2:])
        ]
    return rows


def _row_at(_: Any, table: Any, placed: Any) -> Any:
    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        data = context.make_array(sig.args[0])(context, builder, args[0]).data
        whole = ir.VectorType(ir.IntType(64), LANES)
        numbers = builder.and_(
            builder.bitcast(args[1], whole), ir.Constant(whole, [PLACES - 1] * LANES)
        )
        rows = []
        for lane in range(LANES):
            number = builder.extract_element(numbers, PLACE(lane))
            begin = builder.gep(data, [builder.mul(number, ir.Constant(whole.element, LANES))])
            rows.append(builder.load(builder.bitcast(begin, VECTOR.as_pointer()), align=8))
        return context.make_tuple(builder, sig.return_type, _transposed(builder, rows))

    return FOUR(table, lanes), build


def _begins(context: Any, builder: Any, sig: Any, args: Any) -> list[Any]:
    """Build the addresses of a column in those rows of a table at which lanes are."""
    table, places = (context.make_array(sig.args[k])(context, builder, args[k]) for k in (0, 1))
    width = builder.extract_value(table.shape, 1)
    begins = []
    for lane in range(LANES):
        row = builder.load(builder.gep(places.data, [PLACE(lane)]))
        begin = builder.gep(table.data, [builder.add(builder.mul(row, width), args[2])])
        begins.append(builder.bitcast(begin, VECTOR.as_pointer()))
    return begins


def _columns(_: Any, table: Any, places: Any, first: Any) -> Any:
    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        rows = [builder.load(it, align=8) for it in _begins(context, builder, sig, args)]
        return context.make_tuple(builder, sig.return_type, _transposed(builder, rows))

    return (FOUR(TABLE, WHOLE, types.int64), build) if (table, places) == (TABLE, WHOLE) else None


def _enter(_: Any, table: Any, places: Any, first: Any, written: Any) -> Any:
    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        rows = _transposed(builder, cgutils.unpack_tuple(builder, args[3]))
        for row, begin in zip(rows, _begins(context, builder, sig, args), strict=True):
            builder.store(row, begin, align=8)
        return context.get_dummy_value()

    fits = (table, places, written) == (TABLE, WHOLE, FOUR)
    return (types.none(TABLE, WHOLE, types.int64, FOUR), build) if fits else None


Four = tuple[float, float, float, float]

#: The row of a table (PLACES, 4) that each lane is at, as four columns: its number are the last
#: bits of a lane, which a sum with something large has rounded to places.
row_at = cast(Callable[[Floats, float], Four], intrinsic(_row_at))
#: Four columns, from one on, of the rows of a table at which lanes are (LANES,).
columns = cast(Callable[[Floats, Ints, int], Four], intrinsic(_columns))
#: Write four columns, from one on, of the rows of a table at which lanes are (LANES,), in order.
enter = cast(Callable[[Floats, Ints, int, Four], None], intrinsic(_enter))

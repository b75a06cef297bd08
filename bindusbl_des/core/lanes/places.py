"""Tables that four lanes look up at once, each at a place of its own."""
# numba tells no types of what it is extended by:
# mypy: disable-error-code="no-untyped-call"

from collections.abc import Callable
from typing import Any, cast

import numpy as np
from llvmlite import ir
from numba.core import types
from numba.extending import intrinsic
from numpy.typing import NDArray

from .numbers import LANES, PLACE, VECTOR, lanes

Floats = NDArray[np.float64]

PLACES = 128  # rows of a table, as many as seven bits tell apart, so that none lead beyond it


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
        for picked in ([0, 4, 2, 6], [1, 5, 3, 7]), ([0, 1, 4, 5], [2, 3, 6, 7]):
            rows = [
                builder.shuffle_vector(*pair, ir.Constant(ir.VectorType(PLACE, LANES), order))
                for order in picked
                for pair in (rows[:2], rows[2:])
            ]
        return context.make_tuple(builder, sig.return_type, rows)

    return types.UniTuple(lanes, 4)(table, lanes), build


#: The row of a table (PLACES, 4) that each lane is at, as four columns: its number are the last
#: bits of a lane, which a sum with something large has rounded to places.
row_at = cast(Callable[[Floats, float], tuple[float, ...]], intrinsic(_row_at))

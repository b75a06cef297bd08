"""One number for each of four vehicles, which compiled code works on as on a float.

Processors add four pairs of numbers as fast as one pair.  A formula of `+ - * /`, `abs`, `min`,
`max`, `sqrt`, `exp`, `atan2`, `hypot`, :func:`.sines.sincos` and :func:`if_positive` reads the same
for a float and for `Lanes`; each lane is worked out by the operations of the float, in their order,
so that it has the same bits.  A float among lanes stands for four equal ones.
"""
# numba tells no types of what it is extended by:
# mypy: disable-error-code="no-untyped-call, untyped-decorator"

import math
import operator
from collections.abc import Callable
from typing import Any, cast

from llvmlite import ir
from numba.core import cgutils, types
from numba.core.typeconv.castgraph import Conversion
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin, lower_cast, models, register_model

LANES = 4

DOUBLE = ir.DoubleType()
VECTOR = ir.VectorType(DOUBLE, LANES)
PLACE = ir.IntType(32)


class Lanes(types.Type):
    """The type of a number for each of four vehicles."""

    def __init__(self) -> None:
        super().__init__(name="Lanes")

    def unify(self, _: Any, other: types.Type) -> types.Type | None:
        return self if isinstance(other, types.Float) else None

    def can_convert_from(self, _: Any, other: types.Type) -> Conversion | None:
        return Conversion.safe if isinstance(other, types.Float) else None


lanes = Lanes()


@register_model(Lanes)
class _LanesModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Lanes) -> None:
        super().__init__(manager, kind, VECTOR)


def spread(builder: Any, number: Any) -> Any:
    """Return a vector of equal numbers."""
    first = builder.insert_element(ir.Constant(VECTOR, ir.Undefined), number, PLACE(0))
    return builder.shuffle_vector(
        first, first, ir.Constant(ir.VectorType(PLACE, LANES), [0] * LANES)
    )


@lower_cast(types.Float, Lanes)
def _from_float(context: Any, builder: Any, source: Any, _: Any, number: Any) -> Any:
    return spread(builder, context.cast(builder, number, source, types.float64))


def _lane_by_lane(function: Callable[..., float]) -> Callable[..., Any]:
    """Return what builds a call of a function of floats for each lane."""

    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        one = context.get_function(function, signature(*[types.float64] * (1 + len(sig.args))))
        result = ir.Constant(VECTOR, ir.Undefined)
        for lane in range(LANES):
            given = [builder.extract_element(it, PLACE(lane)) for it in args]
            result = builder.insert_element(result, one(builder, given), PLACE(lane))
        return result

    return build


def _at_once(instruction: str) -> Callable[..., Any]:
    """Return what builds an instruction that works on vectors as well."""
    return lambda _context, builder, _sig, args: getattr(builder, instruction)(*args)


def _intrinsic(name: str) -> Callable[..., Any]:
    """Return what builds a call of LLVM's own function of vectors."""

    def build(_context: Any, builder: Any, _sig: Any, args: Any) -> Any:
        kind = ir.FunctionType(VECTOR, [VECTOR] * len(args))
        known = f"llvm.{name}.v{LANES}f64"
        return builder.call(cgutils.get_or_insert_function(builder.module, kind, known), args)

    return build


def _whichever(order: str) -> Callable[..., Any]:
    """Return what builds Python's `min` or `max` of two: the second only if it is beyond."""

    def build(_context: Any, builder: Any, _sig: Any, args: Any) -> Any:
        first, second = args
        return builder.select(builder.fcmp_ordered(order, second, first), second, first)

    return build


def _learn(function: Any, count: int, build: Callable[..., Any]) -> None:
    """Have compiled code apply a function to `count` lanes (or floats among them)."""

    @infer_global(function)
    class _Applied(AbstractTemplate):
        def generic(self, args: Any, _: Any) -> Any:
            fits = all(isinstance(it, Lanes | types.Float) for it in args)
            if len(args) == count and fits and lanes in args:
                return signature(*[lanes] * (1 + count))
            return None

    lower_builtin(function, *[Lanes] * count)(build)


def fma(factor: float, other: float, added: float) -> float:
    """Return factor * other + added of lanes, rounded once."""
    raise NotImplementedError("of lanes only")


for _operators, _instruction in (
    ((operator.add, operator.iadd), "fadd"),
    ((operator.sub, operator.isub), "fsub"),
    ((operator.mul, operator.imul), "fmul"),
    ((operator.truediv, operator.itruediv), "fdiv"),
):
    for _operator in _operators:
        _learn(_operator, 2, _at_once(_instruction))
_learn(operator.neg, 1, _at_once("fneg"))
_learn(abs, 1, _intrinsic("fabs"))
_learn(math.sqrt, 1, _intrinsic("sqrt"))
_learn(math.copysign, 2, _intrinsic("copysign"))
_learn(fma, 3, _intrinsic("fma"))
_learn(min, 2, _whichever("<"))
_learn(max, 2, _whichever(">"))
_learn(math.exp, 1, _lane_by_lane(math.exp))
_learn(math.atan2, 2, _lane_by_lane(math.atan2))
_learn(math.hypot, 2, _lane_by_lane(math.hypot))


def _if_positive(_: Any, number: Any, then: Any, otherwise: Any) -> Any:
    kind = lanes if lanes in (number, then, otherwise) else types.float64

    def build(_context: Any, builder: Any, _sig: Any, args: Any) -> Any:
        zero = ir.Constant(args[0].type, None if kind is lanes else 0.0)
        return builder.select(builder.fcmp_ordered(">", args[0], zero), args[1], args[2])

    return kind(kind, kind, kind), build


def _all_at_least(_: Any, _number: Any, _bound: Any) -> Any:
    def build(_context: Any, builder: Any, _sig: Any, args: Any) -> Any:
        fits = builder.fcmp_ordered(">=", args[0], spread(builder, args[1]))
        together = builder.bitcast(fits, ir.IntType(LANES))
        return builder.icmp_unsigned("==", together, ir.Constant(ir.IntType(LANES), -1))

    return types.boolean(lanes, types.float64), build


#: The second number where the first is above zero, else the third; both are worked out.
if_positive = cast(Callable[[float, float, float], float], intrinsic(_if_positive))
#: Whether no lane is below a bound, or no number.
all_at_least = cast(Callable[[float, float], bool], intrinsic(_all_at_least))

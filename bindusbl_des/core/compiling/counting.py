"""Whether a function must count who holds the arrays that it works with.

numba counts at each name that an array is given, also where the caller holds it all the while.  A
function that makes no array and returns none needs nothing of that, which is a quarter of all that
there is to compile, and keeps loops from being optimised.  Nor does the end of a number's life mean
anything, which numba marks as it marks an array's.
"""

from typing import Any

from numba.core import ir, types
from numba.core.compiler_machinery import AnalysisPass, register_pass
from numba.core.postproc import PostProcessor
from numba.core.runtime.context import NRTContext

# What hands on arrays that somebody holds already, or views of them.
LENDING = {"cast", "exhaust_iter", "getattr", "getitem", "pair_first", "static_getitem"}
LENDING |= {"build_tuple", "getiter", "iternext", "null", "undef"}

# Functions whose arrays are held by whoever handed over where they are.
lenders: set[object] = set()


class Holders(NRTContext):
    """Has holders counted, and looks for what they hold only where there may be something."""

    def get_meminfos(self, builder: Any, ty: Any, val: Any) -> list[tuple[Any, Any]]:
        models = self._context.data_model_manager
        model = models[ty]
        held = [(ty, model.get_nrt_meminfo(builder, val))] if model.has_nrt_meminfo() else []
        for kind, part_of in model.traverse(builder):
            if models[kind].contains_nrt_meminfo():
                held += self.get_meminfos(builder, kind, part_of(val))
        return held


@register_pass(mutates_CFG=False, analysis_only=True)  # type: ignore[no-untyped-call]
class CountIfNeeded(AnalysisPass):
    """Leaves counting out of functions that make no arrays and return none, and ends of numbers."""

    _name = "count_if_needed"

    def __init__(self) -> None:
        AnalysisPass.__init__(self)  # type: ignore[no-untyped-call]

    def run_pass(self, state: Any) -> bool:
        """Look at a function whose types are known, and mark the ends of lives if need be."""
        counted = _counted(state)
        counts = _counts(state, counted)
        PostProcessor(state.func_ir).run(counts, state.flags.dbg_extend_lifetimes)  # type: ignore[no-untyped-call]
        if not counts:
            runtime = state.targetctx.nrt
            state.targetctx = state.targetctx.subtarget(enable_nrt=False)
            state.targetctx.nrt = runtime  # operations may take memory that they free themselves
            return False
        for block in state.func_ir.blocks.values():
            block.body = [
                line for line in block.body if not isinstance(line, ir.Del) or line.value in counted
            ]
        return False


def _counted(state: Any) -> set[str]:
    """Return the names that are given arrays, or what holds arrays."""
    models, kinds = state.targetctx.data_model_manager, state.typemap
    arrays = {kind for kind in set(kinds.values()) if models[kind].contains_nrt_meminfo()}
    return {name for name, kind in kinds.items() if kind in arrays}


def _counts(state: Any, counted: set[str]) -> bool:
    """Tell whether a function returns arrays, or gets any that nobody else holds."""
    kinds = state.typemap

    def lent(value: ir.Expr) -> bool:
        if value.op == "call":
            called = kinds[value.func.name]
            lends = getattr(called, "typing_key", None) in lenders
            return lends or isinstance(called, types.NamedTupleClass)
        chosen_by_array = value.op == "getitem" and value.index.name in counted
        return value.op in LENDING and not chosen_by_array

    lines = [it for block in state.func_ir.blocks.values() for it in block.body]
    return any(it.value.name in counted for it in lines if isinstance(it, ir.Return)) or any(
        it.target.name in counted and isinstance(it.value, ir.Expr) and not lent(it.value)
        for it in lines
        if isinstance(it, ir.Assign)
    )

"""Whether a function must count who holds the arrays that it works with.

numba counts at each name that an array is given, also where the caller holds it all the while.  A
function that makes no array and returns none needs nothing of that, which is a quarter of all that
there is to compile, and keeps loops from being optimised.
"""

from typing import Any

from numba.core import ir, types
from numba.core.compiler_machinery import AnalysisPass, register_pass

# What hands on arrays that somebody holds already, or views of them.
LENDING = {"cast", "exhaust_iter", "getattr", "getitem", "pair_first", "static_getitem"}
LENDING |= {"build_tuple", "getiter", "iternext", "null", "undef"}


@register_pass(mutates_CFG=False, analysis_only=True)  # type: ignore[no-untyped-call]
class CountIfNeeded(AnalysisPass):
    """Leaves counting out of functions that make no arrays and return none."""

    _name = "count_if_needed"

    def __init__(self) -> None:
        AnalysisPass.__init__(self)  # type: ignore[no-untyped-call]

    def run_pass(self, state: Any) -> bool:
        """Look at a function whose types are known."""
        if not _counts(state):
            runtime = state.targetctx.nrt
            state.targetctx = state.targetctx.subtarget(enable_nrt=False)
            state.targetctx.nrt = runtime  # operations may take memory that they free themselves
        return False


def _counts(state: Any) -> bool:
    """Tell whether a function returns arrays, or gets any that nobody else holds."""
    models, kinds = state.targetctx.data_model_manager, state.typemap

    def counted(kind: Any) -> bool:
        return bool(models[kind].contains_nrt_meminfo())

    def lent(value: ir.Expr) -> bool:
        if value.op == "call":
            return isinstance(kinds[value.func.name], types.NamedTupleClass)
        chosen_by_array = value.op == "getitem" and counted(kinds[value.index.name])
        return value.op in LENDING and not chosen_by_array

    return counted(state.return_type) or any(
        isinstance(line.value, ir.Expr)
        and counted(kinds[line.target.name])
        and not lent(line.value)
        for block in state.func_ir.blocks.values()
        for line in block.find_insts(ir.Assign)
    )

"""What machine code is made of: functions that Python enters, and parts that are linked into them.

numba makes of each function, by itself, machine code that Python and C could call.  Of one that
other compiled code calls nothing of that is ever used: it is linked into its caller, and optimised
and turned into machine code there, once more.  To leave it out saves a third of all compiling; and
to optimise what it has been linked into once, not twice, another tenth.
"""

from collections.abc import Sequence
from copy import copy
from functools import cache
from typing import Any

from numba.core.codegen import JITCodeLibrary
from numba.core.registry import cpu_target


class _Code(JITCodeLibrary):
    """Code that is not optimised by itself, since it will be with what it is linked with."""

    def _optimize_functions(self, ll_module: Any) -> None:
        ll_module.data_layout = self._codegen._data_layout


class Whole(_Code):
    """Code that Python enters: optimised when all its parts are in it."""

    def finalize(self) -> None:
        """Link every part that is called, and that those call, once."""
        self._linking_libraries = _with_parts(self._linking_libraries)
        super().finalize()  # type: ignore[no-untyped-call]

    def _verify_declare_only_symbols(self) -> None:
        """Refuse code in which something is missing, which would be jumped to all the same."""
        for function in self._final_module.functions:
            if function.is_declaration and function.name.startswith("_ZN"):
                raise AssertionError(f"{function.name} is missing in {self.name}")

    def _optimize_final_module(self) -> None:
        """Optimise, but do not look for numbers that could be worked out side by side.

        Where that pays, four vehicles are vectors already (:mod:`..lanes`), and to look takes an
        eighth of what optimising and machine code take.
        """
        codegen: Any = self._codegen
        passes, builder = codegen._module_pass_manager(loop_vectorize=False, slp_vectorize=False)
        passes.run(self._final_module, builder)


class Part(_Code):
    """Code for others to be linked with: no machine code, without what it calls."""

    def finalize(self) -> None:
        """Be ready to be linked."""
        self._finalize_dynamic_globals()  # type: ignore[no-untyped-call]
        self._finalized = True


def _with_parts(libraries: Sequence[Any]) -> list[JITCodeLibrary]:
    """Return libraries and all that their parts call, directly or not, callers first.

    LLVM links only what is wanted by then.
    """
    found: dict[JITCodeLibrary, None] = {}

    def add(library: JITCodeLibrary) -> None:
        if library not in found:
            for called in library._linking_libraries if isinstance(library, Part) else ():
                add(called)
            found[library] = None

    for library in reversed(libraries):
        add(library)
    return list(reversed(found))


@cache
def generator_of_parts() -> Any:
    """Return numba's generator of code for this machine, as one by which all code becomes parts."""
    generator = copy(cpu_target.target_context.codegen())
    generator._library_class = Part
    return generator

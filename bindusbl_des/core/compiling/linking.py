"""What machine code is made of: functions that Python enters, and parts that are linked into them.

numba makes of each function, by itself, machine code that Python and C could call.  Of one that
other compiled code calls nothing of that is ever used: it is linked into its caller, and optimised
and turned into machine code there, once more.  To leave it out saves a third of all compiling; and
to optimise what it has been linked into once, not twice, another tenth.
"""

from collections.abc import Sequence
from copy import copy
from functools import cache
from typing import Any, NoReturn

from numba.core.codegen import JITCodeLibrary
from numba.core.registry import cpu_target

# Name, machine code, names of what is in that.
Kept = tuple[str, bytes, list[str]]


class _Code(JITCodeLibrary):
    """Code that is not optimised by itself, since it will be with what it is linked with."""

    def _optimize_functions(self, ll_module: Any) -> None:
        ll_module.data_layout = self._codegen._data_layout


class Whole(_Code):
    """Code that Python enters: optimised when all its parts are in it; part of nothing itself."""

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
        """Optimise (-O2), but do not look for numbers that could be worked out side by side.

        To look takes an eighth of what optimising and machine code take, and brings nothing; with
        -O3 missions are no faster.
        """
        codegen: Any = self._codegen
        passes, builder = codegen._module_pass_manager(
            opt=2, loop_vectorize=False, slp_vectorize=False
        )
        passes.run(self._final_module, builder)

    def _get_module_for_linking(self) -> NoReturn:
        raise AssertionError(f"{self.name} is an entry, which compiled code cannot call")

    def serialize_using_object_code(self) -> Kept:
        """Return what is kept of it: its machine code, and the names of what is in that.

        numba keeps what other code could be linked with, too, which takes longer to load.
        """
        self._ensure_finalized()  # type: ignore[no-untyped-call]
        everything = (*self._final_module.functions, *self._final_module.global_variables)
        named = [it.name for it in everything if not it.is_declaration]
        return self.name, self._get_compiled_object(), named  # type: ignore[no-untyped-call]

    @classmethod
    def _unserialize(cls, codegen: Any, kept: Kept) -> "Whole":
        name, machine_code, named = kept
        library = cls(codegen, name)
        library.enable_object_caching()  # type: ignore[no-untyped-call]
        library._set_compiled_object(machine_code)  # type: ignore[no-untyped-call]
        library._finalize_final_module()  # type: ignore[no-untyped-call]
        codegen._engine._defined_symbols.update(named)
        return library


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
def generator_of(library: type[JITCodeLibrary]) -> Any:
    """Return numba's generator of code for this machine, as one whose code is of a kind."""
    generator = copy(cpu_target.target_context.codegen())
    generator._library_class = library
    return generator

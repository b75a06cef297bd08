"""numba's compiler, made quicker: with parts, and without what is looked up again and again."""

import gc
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

import numba
from numba.core.compiler import Compiler, Flags
from numba.core.registry import CPUDispatcher, cpu_target
from numba.core.target_extension import (
    CPU,
    dispatcher_registry,
    jit_registry,
    target_override,
    target_registry,
)
from numba.core.typed_passes import IRLegalization
from numba.core.types import Array, BaseTuple, Boolean, Number, unliteral
from numba.core.typing.context import Context
from numba.extending import overload

from .counting import CountIfNeeded, Holders
from .lifetimes import lifetimes_if_asked_for
from .linking import Part, Whole, generator_of

# What concerns a function by itself and none that it calls.
OWN_FLAGS = ("forceinline", "no_compile", "no_cfunc_wrapper", "no_cpython_wrapper")


class _Flags(Flags):
    """numba's, compared by what was set, and not by looking up each option that there is.

    They are part of the key by which each operator in each line is looked up.
    """

    __slots__ = ()

    def __eq__(self, other: object) -> bool:
        return bool(self._values == other._values) if isinstance(other, _Flags) else NotImplemented

    def __hash__(self) -> int:
        return _SAME_FOR_ALL  # as numba's are, which may be equal

    def copy(self) -> "_Flags":
        """Return what functions inherit that are called."""
        inherited = _Flags(self)  # type: ignore[no-untyped-call]
        for name in OWN_FLAGS:
            inherited.discard(name)  # type: ignore[no-untyped-call]
        return inherited


_SAME_FOR_ALL = hash(Flags())  # type: ignore[no-untyped-call]


# What an operator makes of these depends on nothing else.
PLAIN = Number | Boolean | Array | BaseTuple


class _Types(Context):
    """numba's knowledge of types, which works out once what operators make of what.

    It is not numba's own, by which others would find functions that were made parts for us.
    """

    def __init__(self) -> None:
        vars(self).update(vars(cpu_target.typing_context))
        self._known: dict[Any, Any] = {}

    def resolve_function_type(self, func: Any, args: Any, kws: Any) -> Any:
        name = getattr(func, "typing_key", func)
        if getattr(name, "__module__", "") != "_operator" or not all(
            isinstance(it, PLAIN) for it in args
        ):
            return super().resolve_function_type(func, args, kws)  # type: ignore[no-untyped-call]
        key = name, tuple(args)
        if key not in self._known:
            found = super().resolve_function_type(func, args, kws)  # type: ignore[no-untyped-call]
            self._known[key] = found
        return self._known[key]


_types = cache(_Types)


class _Linked(CPU):
    """The CPU, as a target whose functions are all linked into what Python enters."""


# Functions of numba's own that were turned into code in the course of others.
_internal: dict[Any, Any] = {}


@contextmanager
def _garbage_kept() -> Iterator[None]:
    """Leave garbage until Python looks through everything: a compiler makes much that lasts.

    What was made is handed to the oldest generation, unseen, or else Python would look through it
    as soon as it may.
    """
    collects = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collects:
            gc.freeze()
            gc.unfreeze()
            gc.enable()


@cache
def _size_of() -> Any:
    """Return how the size of a type is asked for, which LLVM works out by parsing a module."""
    return cache(cpu_target.target_context.get_abi_sizeof)


@cache
def _functions() -> Any:
    """Return what is known of making functions into code."""
    from .elements import with_elements  # loads what compiled code on the disk does without

    return with_elements(cpu_target.target_context._defns)


def _loaded_before() -> None:
    """Load nothing: numba looks again whenever it finds no function of a name."""


class WholeCompiler(Compiler):
    """Makes code that Python enters."""

    library: Any = Whole

    def __init__(self, _: Any, *given: Any) -> None:
        super().__init__(_types(), *given)  # type: ignore[no-untyped-call]
        state = self.state
        state.flags = _Flags(state.flags)  # type: ignore[no-untyped-call]
        state.targetctx = state.targetctx.subtarget(
            _internal_codegen=generator_of(Part),
            target=_Linked,
            typing_context=_types(),
            load_additional_registries=_loaded_before,
            get_abi_sizeof=_size_of(),
            _defns=_functions(),
        )
        state.targetctx.cached_internal_func = _internal
        holders: Any = Holders
        state.targetctx.nrt = holders(state.targetctx, state.targetctx.enable_nrt)

    def define_pipelines(self) -> Any:
        """Return numba's passes, one of which is ours: it marks ends of lives where they matter."""
        pipelines = super().define_pipelines()  # type: ignore[no-untyped-call]
        for passes in pipelines:
            passes.add_pass_after(CountIfNeeded, IRLegalization)
            passes.passes = [it for it in passes.passes if it[0] is not IRLegalization]
            passes.finalize()
        return pipelines

    def compile_extra(self, func: Callable[..., object]) -> Any:
        self.state.library = self.library(self.state.targetctx.codegen(), func.__qualname__)
        self.state.library.enable_object_caching()
        _check_shapes_silently()
        ours: Any = target_override(TARGET)  # type: ignore[no-untyped-call]
        with _garbage_kept(), lifetimes_if_asked_for(), ours:
            return super().compile_extra(func)  # type: ignore[no-untyped-call]


class _PartCompiler(WholeCompiler):
    """Makes code up to where it can be linked."""

    library = Part

    def compile_extra(self, func: Callable[..., object]) -> Any:
        self.state.flags.no_compile = True
        return super().compile_extra(func)


def part(function: Callable[..., object], **options: Any) -> Any:
    """Return a function for compiled code to call."""
    options |= {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    dispatcher: Any = numba.jit(pipeline_class=_PartCompiler, **options)(function)

    def add_overload(made: Any) -> None:
        found_by = object()  # numba looks functions up by what Python would call
        made = made._replace(entry_point=found_by)
        dispatcher.targetctx.insert_user_function(found_by, made.fndesc, [made.library])
        dispatcher.overloads[tuple(made.signature.args)] = made

    dispatcher.add_overload = add_overload
    return dispatcher


def equation(
    function: Callable[..., object], from_python: Callable[[], object], **options: Any
) -> Callable[..., object]:
    """Return a part of ours; Python that calls it is handed on to `from_python()`.

    That is asked, at each call, for a function to be called instead.
    """
    dispatcher = part(function, **options)
    template_of = dispatcher.get_call_template

    def template_of_any(args: tuple[Any, ...], kws: dict[str, Any]) -> Any:
        general = [unliteral(it) for it in args]  # type: ignore[no-untyped-call]
        return template_of(general, kws)  # one for all constants, not one for each

    dispatcher.get_call_template = template_of_any
    dispatcher._compile_for_args = lambda *_: from_python()
    result: Callable[..., object] = dispatcher
    return result


# Functions of numba's own, such as np.empty, are parts, too, where parts call them.
TARGET = "bindusbl_des"
target_registry[TARGET] = _Linked
dispatcher_registry[_Linked] = CPUDispatcher
jit_registry[_Linked] = lambda **options: lambda function: part(function, **options)


@cache
def _check_shapes_silently() -> None:
    """Have arrays of another shape refused without a word of them: that takes 3 s to compile."""
    from numba.np import arrayobj

    refused: Any = arrayobj.raise_with_shape_context
    overload(refused, target=TARGET)(arrayobj.ol_raise_with_shape_context_generic)

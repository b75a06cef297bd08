"""Where variables live, worked out where somebody asks for it.

numba works out anew, after each of nine passes over a function, which variables may be alive where
each block of it begins.  Object mode and generators ask for that, and nothing else.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from numba.core.postproc import PostProcessor, VariableLifetime
from numba.core.transforms import canonicalize_cfg

_post_processed: Any = PostProcessor.run


@contextmanager
def lifetimes_if_asked_for() -> Iterator[None]:
    """Compile meanwhile without what nobody asks for; whoever compiles has numba's lock."""
    processor: Any = PostProcessor
    before, processor.run = processor.run, _run
    try:
        yield
    finally:
        processor.run = before


def _run(processor: Any, emit_dels: bool = False, extend_lifetimes: bool = False) -> None:
    """Put a function's blocks in order, and mark the ends of lives if need be."""
    function = processor.func_ir
    if function.is_generator:
        _post_processed(processor, emit_dels, extend_lifetimes)
        return
    function.blocks = canonicalize_cfg(function.blocks)  # type: ignore[no-untyped-call]
    function.variable_lifetime = VariableLifetime(function.blocks)  # type: ignore[no-untyped-call]
    function.generator_info = None
    if emit_dels:
        processor._insert_var_dels(extend_lifetimes=extend_lifetimes)

"""Equations as Python runs them, where numba is asked not to compile (NUMBA_DISABLE_JIT=1).

A hundred times as slow, and line by line: for debuggers, for tools that measure coverage, and for
tests of broken lines, each of which would otherwise be compiled first.  What differs is made the
same where Python calls an equation: numbers, constants among them, have 64 bits, so that a division
by zero is infinite or no number and not an exception; the fields of a record are read and written
as attributes; the functions of `math` answer as C's do.  Sines and exponentials are those of the C
library in both, so results are mostly the same bit for bit; none is off by more than roundings.
"""

import math
from collections.abc import Callable
from functools import wraps
from threading import local
from types import BuiltinFunctionType, CodeType, SimpleNamespace
from typing import Any

import numpy as np


def uncompiled(function: Any) -> Callable[..., Any]:
    """Return an equation that computes in Python what its machine code would."""
    scope = function.__globals__
    for name, value in [*scope.items()]:
        if value is math:
            scope[name] = MATH
        elif isinstance(value, BuiltinFunctionType) and value.__module__ == "math":
            scope[name] = getattr(MATH, value.__name__)
    function.__code__ = _in_64_bits(function.__code__)

    @wraps(function)
    def plain(*given: Any, **named: Any) -> Any:
        if _THREAD.is_in_equation:
            return function(*given, **named)
        _THREAD.is_in_equation = True
        try:
            with np.errstate(all="ignore"):
                further = {name: as_compiled(value) for name, value in named.items()}
                return function(*map(as_compiled, given), **further)
        finally:
            _THREAD.is_in_equation = False

    return plain


def _in_64_bits(code: CodeType) -> CodeType:
    """Return code whose constants are numbers of 64 bits: of Python's own, 0.0 / 0 raises."""
    kinds: dict[type, Callable[[Any], Any]] = {float: np.float64, CodeType: _in_64_bits}
    constants = (kinds.get(type(const), lambda same: same)(const) for const in code.co_consts)
    return code.replace(co_consts=tuple(constants))


class _Thread(local):
    is_in_equation = False


_THREAD = _Thread()


def as_compiled(value: Any) -> Any:
    """Return a value as compiled code sees it: numbers of 64 bits, records with attributes."""
    kind = type(value)
    if kind is float:
        return np.float64(value)
    if kind is int:
        return np.int64(value)
    if isinstance(value, tuple):
        parts = map(as_compiled, value)
        return kind(*parts) if hasattr(value, "_fields") else tuple(parts)
    if isinstance(value, np.ndarray | np.void) and value.dtype.names:
        return value.view(np.dtype((PlainRecord, value.dtype)))
    return value


class PlainRecord(np.record):  # type: ignore[misc]  # numpy's stubs make its base final
    """A record whose fields come before the methods that numpy's have (`round`)."""

    def __getattribute__(self, name: str) -> Any:
        try:
            return as_compiled(np.void.__getitem__(self, name))
        except ValueError:  # no field
            return super().__getattribute__(name)

    def __setattr__(self, name: str, value: Any) -> None:
        self[name] = value


def _like_c(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function of the C library that answers as C does where Python raises."""

    @wraps(function)
    def quiet(*given: float) -> Any:
        try:
            return as_compiled(function(*given))
        except (OverflowError, ValueError):
            found = getattr(np, function.__name__)(*given)
            return found.astype(np.int64) if function in (math.ceil, math.floor) else found

    return quiet


# The module `math` of equations.
MATH = SimpleNamespace(
    **{
        name: _like_c(value) if isinstance(value, BuiltinFunctionType) else value
        for name, value in vars(math).items()
    }
)

"""Equations as Python runs them, where numba is asked not to compile (NUMBA_DISABLE_JIT=1).

A hundred times as slow, and line by line: for debuggers, for tools that measure coverage, and for
tests of broken lines, each of which would otherwise be compiled first.  Machine code and Python
differ in four things, which are made the same here: a division by zero and a root of a negative
number are infinite or no number and not an exception, whole numbers have 64 bits, and the fields of
a record are written as attributes.  Sines and exponentials are those of the C library in both, so
results are mostly the same bit for bit; none is off by more than roundings.
"""

import math
from collections.abc import Callable
from functools import cache, wraps
from operator import is_
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
        known = [
            argument if type(argument) in SETTLED else WAYS[type(argument)](argument)
            for argument in given
        ]
        further = (
            {name: as_compiled(argument) for name, argument in named.items()} if named else named
        )
        if _THREAD.is_quiet:  # called by another equation
            return function(*known, **further)
        _THREAD.is_quiet = True
        try:
            with np.errstate(all="ignore"):
                return function(*known, **further)
        finally:
            _THREAD.is_quiet = False

    return plain


class _Thread(local):
    """Whether a thread is in the midst of an equation, where numpy warns of nothing."""

    is_quiet = False


_THREAD = _Thread()


def _in_64_bits(code: CodeType) -> CodeType:
    """Return code in which 0.0 / 0 is no number: Python's own numbers raise."""
    kinds: dict[type, Callable[[Any], Any]] = {float: np.float64, CodeType: _in_64_bits}
    return code.replace(
        co_consts=tuple(kinds.get(type(const), _same)(const) for const in code.co_consts)
    )


def _same(value: Any) -> Any:
    return value


def as_compiled(value: Any) -> Any:
    """Return a value as compiled code sees it: numbers of 64 bits, records with attributes."""
    return WAYS[type(value)](value)


class _Ways(dict[type, Callable[[Any], Any]]):
    """What makes of a value of a class what compiled code sees."""

    def __missing__(self, kind: type) -> Callable[[Any], Any]:
        self[kind] = _same
        if kind in (float, int):
            self[kind] = np.float64 if kind is float else np.int64
        elif issubclass(kind, np.ndarray) or kind is np.void:
            self[kind] = _with_fields
        elif issubclass(kind, tuple):
            self[kind] = _each
        return self[kind]


WAYS = _Ways()


def _with_fields(value: Any) -> Any:
    kind = value.dtype
    return value.view(_with_attributes(kind)) if kind.type is np.void and kind.names else value


def _each(value: Any) -> Any:
    """Return a tuple of what compiled code sees: the same where that is nothing else."""
    parts = [part if type(part) in SETTLED else WAYS[type(part)](part) for part in value]
    if all(map(is_, parts, value)):
        return value
    return type(value)(*parts) if hasattr(value, "_fields") else tuple(parts)


class PlainRecord(np.record):  # type: ignore[misc]  # numpy's stubs make its base final
    """A record whose fields come before the methods that numpy's have (`round`)."""

    def __getattribute__(self, name: str) -> Any:
        try:
            found = np.void.__getitem__(self, name)
        except ValueError:  # no field
            return super().__getattribute__(name)
        return as_compiled(found) if type(found) is np.void else found

    def __setattr__(self, name: str, value: Any) -> None:
        self[name] = value


# What compiled code sees as it is: most of what equations hand to one another.
SETTLED = frozenset((np.float64, np.int64, np.bool_, bool, PlainRecord, type(None)))


@cache
def _with_attributes(kind: np.dtype[Any]) -> np.dtype[Any]:
    return np.dtype((PlainRecord, kind))


def _like_c(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function of the C library that answers as C does where Python raises."""
    into: Any = np.int64 if function in (math.ceil, math.floor) else np.float64
    if function in (math.isfinite, math.isinf, math.isnan):
        into = bool

    @wraps(function)
    def quiet(*given: float) -> Any:
        try:
            return into(function(*given))
        except (OverflowError, ValueError):
            with np.errstate(all="ignore"):
                return np.float64(getattr(np, function.__name__)(*given)).astype(into)

    return quiet


# The module `math` of equations.
MATH = SimpleNamespace(
    **{
        name: _like_c(value) if isinstance(value, BuiltinFunctionType) else value
        for name, value in vars(math).items()
    }
)

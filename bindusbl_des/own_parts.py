"""Parts of a mission that somebody has written: found as `module:object`."""

from collections.abc import Iterable
from importlib import import_module
from typing import Any


def own_part(key: str, name: str, siblings: Iterable[str]) -> Any:
    """Return the object that a scenario's key names as ``module:object``.

    Raises:
        ValueError: when there is no such module or object, or it cannot be called; naming the key,
            and the `siblings` that ship.
    """
    module, _, attribute = name.partition(":")
    try:
        found = getattr(import_module(module), attribute)
    except Exception as error:  # a module of somebody's own may raise anything
        raise ValueError(
            f"{key}: cannot load {name!r} ({error}); name an importable module:object "
            f"(is its folder on PYTHONPATH?) or one of {', '.join(siblings)}"
        ) from None
    if not callable(found):
        raise ValueError(f"{key}: {name!r} is a {type(found).__name__}, which cannot be called")
    return found

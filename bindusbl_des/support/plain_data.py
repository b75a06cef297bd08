"""Plain data of files: the paths of their keys, and which texts they may have."""

from collections.abc import Iterable, Iterator, Mapping
from functools import lru_cache
from typing import Any

from .wording import shortened

Path = tuple[str | int, ...]

# No control characters: names have none, and a terminal would obey them.  U+FFFE and U+FFFF are no
# characters, and not allowed in YAML.
PRINTABLE = r"^[^\u0000-\u001f\u007f-\u009f\u2028\u2029\ufffe\uffff]*$"
LONGEST_NAME = 100

# The dialect of JSON schemas of files.
DIALECT = "https://json-schema.org/draft/2020-12/schema"


def dotted(path: Path) -> str:
    """Return a path as a user types it: ``auvs.route.positions_m.0``; unusual keys are quoted."""
    return ".".join(
        part if isinstance(part, str) and part.isprintable() and part else shortened(repr(part))
        for part in path
    )


@lru_cache(maxsize=256)
def path_of(key: str) -> Path:
    """Return the path of a dotted key; items of lists are numbers."""
    parts = key.split(".")
    return tuple(int(part) if part.isascii() and part.isdigit() else part for part in parts)


def value_at(data: Any, path: Iterable[str | int]) -> Any:
    """Return the value at a path of keys and indices; None where there is none."""
    for part in path:
        is_item = isinstance(data, list) and isinstance(part, int) and part < len(data)
        data = data[part] if is_item else data.get(part) if isinstance(data, dict) else None
    return data


def leaves(data: Mapping[str, Any], section: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the dotted keys and values of a file's data."""
    for name, value in data.items():
        if isinstance(value, Mapping):
            yield from leaves(value, f"{section}{name}.")
        else:
            yield f"{section}{name}", value

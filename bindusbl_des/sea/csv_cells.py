"""CSV files as lines of cells, read again only when they have changed."""

import csv
import os
from functools import lru_cache
from pathlib import Path

from ..core.regular_files import regular


def cells_of(path: str | Path) -> tuple[tuple[str, ...], ...]:
    """Return the cells of each line of a CSV file, in UTF-8 with or without a mark.

    Raises:
        ValueError: naming the file, when it cannot be read as one.
    """
    try:
        found = os.stat(path)
        return _read(str(path), found.st_mtime_ns, found.st_size)
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise ValueError(f"{path}: cannot be read as a CSV file: {error}") from None


@lru_cache(maxsize=16)
def _read(path: str, _changed_at: int, _size: int) -> tuple[tuple[str, ...], ...]:
    with open(regular(path), newline="", encoding="utf-8-sig") as file:
        return tuple(map(tuple, csv.reader(file)))

"""Types of arrays; their memory, taken for rows that are written and kept for the next mission."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]


def real_numbers(answer: Any) -> Floats | None:
    """Return an answer as a new array; None for what is no array of real numbers.

    >>> real_numbers([[1, 2], [3]]) is None, real_numbers(["1"]) is None, real_numbers([1, 2])
    (True, True, array([1., 2.]))
    """
    try:
        found = np.asarray(answer)
        return np.array(found, dtype=np.float64, order="C") if found.dtype.kind in "fiu" else None
    except (TypeError, ValueError):
        return None


def lengthened(rows: NDArray[Any], length: int) -> NDArray[Any]:
    """Return an array of `length` rows that begins with these; what follows is yet to be written.

    >>> lengthened(np.ones((2, 3)), 4).shape
    (4, 3)
    """
    longer = np.empty((length, *rows.shape[1:]), dtype=rows.dtype)
    longer[: len(rows)] = rows
    return longer


def keep_memory(size: int) -> None:
    """Have the process keep up to twice so much memory (bytes) that is free, for what comes next.

    glibc hands free memory back beyond twice the largest block that it has ever seen freed
    (mallopt(3), M_MMAP_THRESHOLD), and whoever wants it again waits for every page to be cleared.
    """
    np.empty(size, dtype=np.uint8)  # and freed


def by_number(numbers: Ints, count: int) -> list[Ints]:
    """Return for each number from 0 to `count` - 1 the places (k,) in `numbers` (n,), ascending.

    >>> [places.tolist() for places in by_number(np.array([1, 0, 1]), 3)]
    [[1], [0, 2], []]
    """
    order = np.argsort(numbers, kind="stable")
    return np.split(order, np.searchsorted(numbers[order], np.arange(1, count)))

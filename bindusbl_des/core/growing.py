"""Arrays that grow: memory is taken for rows that are written, not for those there is room for."""

from typing import Any

import numpy as np
from numpy.typing import NDArray


def lengthened(rows: NDArray[Any], length: int) -> NDArray[Any]:
    """Return an array of `length` rows that begins with these; what follows is yet to be written.

    >>> lengthened(np.ones((2, 3)), 4).shape
    (4, 3)
    """
    longer = np.empty((length, *rows.shape[1:]), dtype=rows.dtype)
    longer[: len(rows)] = rows
    return longer

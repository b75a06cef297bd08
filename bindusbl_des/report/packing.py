"""Numbers packed for a page: quanta, differences, byte planes, deflate, base64."""

import base64
import zlib
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

# What stands for "no value"; a page reads it as NaN.
MISSING = -(2**31)
LARGEST = 2**31 - 1

# Differences of smooth columns are tiny; their own differences often are all zero.
ORDERS = (0, 1, 2)
COMPRESSION = 6


@dataclass
class Packer:
    """Columns of numbers on their way into a page, which gets them back as Float64Array.

    >>> packer = Packer()
    >>> packer.add([0.0, 0.5, 1.0], quantum=0.5)
    {'at': 0, 'length': 3, 'quantum': 0.5, 'order': 2}
    """

    _parts: list[bytes] = field(default_factory=list)
    _length: int = 0

    def add(self, values: ArrayLike, *, quantum: float = 1.0) -> dict[str, Any]:
        """Take a column, rounded to `quantum`; return what the page needs to unpack it.

        Values that are not finite are missing in the page.  Values too large for 31 bits of quanta
        are rounded to a coarser quantum.
        """
        array = np.asarray(values, dtype=np.float64).ravel()
        known = np.isfinite(array)
        largest = float(np.abs(array[known]).max()) if known.any() else 0.0
        quantum = max(quantum, largest / LARGEST)
        whole = np.full(len(array), MISSING, dtype=np.int64)
        whole[known] = np.rint(array[known] / quantum).astype(np.int64)
        steps = whole.astype(np.int32)  # differences wrap around, and back again in the page
        best = min((_planes(steps, order) for order in ORDERS), key=lambda it: it[0])
        place = {"at": self._length, "length": len(array), "quantum": quantum, "order": best[1]}
        self._parts.append(best[2])
        self._length += len(array)
        return place

    def text(self) -> str:
        """Return all columns as base64 of a raw deflate stream."""
        packer = zlib.compressobj(COMPRESSION, zlib.DEFLATED, -15)
        return base64.b64encode(packer.compress(b"".join(self._parts)) + packer.flush()).decode()


def _planes(steps: NDArray[np.int32], order: int) -> tuple[int, int, bytes]:
    """Return how large differences of an order are, the order, and their bytes in four planes."""
    differences = steps
    for _ in range(order):
        differences = np.diff(differences, prepend=np.int32(0))
    zigzag = (differences << 1) ^ (differences >> 31)  # small numbers of either sign: small bytes
    planes = zigzag.view(np.uint8).reshape(-1, 4).T
    return int(np.count_nonzero(planes)), order, planes.tobytes()

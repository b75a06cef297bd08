"""Standard normal numbers of numpy's streams, drawn in compiled code: bit for bit those of numpy.

It takes less than half the time: words are taken at once, and no branch depends on a number's sign.

Source: G. Marsaglia, W. W. Tsang, The ziggurat method for generating random variables, J. Stat.
Softw. 5 (8), 2000, with numpy's 256 layers.
"""

from math import exp, log1p
from typing import Any

import numpy as np
from numba.np.random import _constants as numpys
from numpy.typing import NDArray

from ..compiled import compiled, entry, inlined

Floats = NDArray[np.float64]
Words = NDArray[np.int64]

# A random word: eight bits choose a layer, one the sign, and these the place in the layer.
LAYER, SIGN, PLACE = 0xFF, 8, 9
PLACES = (1 << 52) - 1

# Of each layer how wide a place is, before which place all lies within the bell, and how high the
# bell is where the layer ends.  The lowest has a tail, beyond where it ends.
WIDTHS, WITHIN, HEIGHTS = numpys.wi_double, numpys.ki_double.astype(np.int64), numpys.fi_double
END, SHARE_OF_END = numpys.ziggurat_nor_r, numpys.ziggurat_nor_inv_r

# One number in 100 takes more than one word, and one in 10^30 so many.
ENOUGH = 64


def draw(stream: np.random.Generator, out: Floats) -> None:
    """Write the first standard normal numbers of a stream, which is used up by that, to `out` (n,).

    >>> numbers = np.empty(3)
    >>> draw(np.random.default_rng(5), numbers)
    >>> np.array_equal(numbers, np.random.default_rng(5).standard_normal(3))
    True
    """
    words = _words(stream, len(out))
    done, used = _draw(words, out)
    while done < len(out):
        words = np.concatenate((words[used:], _words(stream, len(out) - done)))
        drawn, used = _draw(words, out[done:])
        done += drawn


def _words(stream: np.random.Generator, numbers: int) -> Words:
    """Return the next words of a stream, nearly always as many as some numbers take."""
    words: Any = stream.bit_generator.random_raw(numbers + numbers // ENOUGH + 2 * ENOUGH)
    return np.asarray(words.view(np.int64))


@entry
def _draw(words: Words, out: Floats) -> tuple[int, int]:
    """Write numbers as long as there are enough words; return how many, and of how many words."""
    used = 0
    for k in range(out.size):
        if words.size - used < ENOUGH:
            return k, used
        out[k], used = _number(words, used)
    return out.size, used


@inlined
def _number(words: Words, used: int) -> tuple[float, int]:
    """Return a number, and how many words are used then."""
    while True:
        word = words[used]
        used += 1
        layer, place = word & LAYER, (word >> PLACE) & PLACES
        sign = 1.0 - 2.0 * ((word >> SIGN) & 1)
        number = sign * (place * WIDTHS[layer])
        if place < WITHIN[layer]:
            return number, used
        if layer == 0:
            return _tail(words, used, place)
        low, high = HEIGHTS[layer], HEIGHTS[layer - 1]
        used += 1
        if (high - low) * _uniform(words[used - 1]) + low < exp(-0.5 * number * number):
            return number, used


@compiled
def _tail(words: Words, used: int, place: int) -> tuple[float, int]:
    """Return a number in the tail of the bell, and how many words are used then."""
    while True:
        over = -SHARE_OF_END * log1p(-_uniform(words[used]))
        height = -log1p(-_uniform(words[used + 1]))
        used += 2
        if height + height > over * over:
            return -(END + over) if (place >> 8) & 1 else END + over, used


@inlined
def _uniform(word: int) -> float:
    """Return the number in [0, 1) that a word stands for."""
    return ((word >> 11) & ((1 << 53) - 1)) * 2.0**-53

"""Numbers drawn in compiled code are those of numpy."""

import numpy as np
import pytest

from bindusbl_des.core.drawing import normals
from bindusbl_des.core.drawing.normals import draw
from bindusbl_des.core.streams import Purpose, Streams


def drawn(seed: int, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the first numbers of a stream, by us and by numpy."""
    ours, stream = np.empty(count), Streams(seed).of(Purpose.DRIFT, 1)
    draw(Streams(seed).of(Purpose.DRIFT, 1), ours)
    return ours, stream.standard_normal(count)


def test_numbers_are_those_of_numpy_bit_for_bit() -> None:
    """A million of them, of which some lie in the tail on either side."""
    ours, numpys = drawn(3, 1_000_000)
    np.testing.assert_array_equal(ours.view(np.int64), numpys.view(np.int64))
    assert ours.min() < -normals.END
    assert ours.max() > normals.END


@pytest.mark.parametrize("count", [0, 1, 2, 7, 63, 64, 65, 1000])
def test_any_number_of_them(count: int) -> None:
    """As many as asked for."""
    ours, numpys = drawn(8, count)
    assert ours.tolist() == numpys.tolist()


def test_words_run_out_and_more_are_taken() -> None:
    """Numbers go on where they were, whatever was left of the words."""
    words = Streams(2).of(Purpose.DEPTH).bit_generator.random_raw(300).view(np.int64)
    whole, parts = np.empty(200), np.empty(200)
    assert normals._draw(words, whole)[0] == 200
    done, used = normals._draw(words[:150], parts)
    assert 150 - normals.ENOUGH - 10 < done <= 150 - normals.ENOUGH + 1
    assert normals._draw(words[used:], parts[done:])[0] == 200 - done
    assert parts.tolist() == whole.tolist()

"""Noise of pairs: what is drawn does not depend on who looks at it beforehand."""

import numpy as np
import pytest

from bindusbl_des.core.streams import ROWS, NoiseStore, Streams


def taken(store: NoiseStore, count: int, ahead: int | None = None) -> list[float]:
    """Take rows of a pair as compiled equations do; look at a later one before each, if told to."""
    found = []
    for _ in range(count):
        if ahead is not None:
            store.peek(1, 0, ahead)
        if store.is_spent(1, 0):
            store.refill(1, 0)
        found.append(float(store.blocks[store.shelf[1, 0], store.taken[1, 0], 0]))
        store.taken[1, 0] += 1
    return found


@pytest.mark.parametrize("ahead", [0, 1, 5, ROWS + 3])
def test_noise_can_be_looked_at_before_it_is_taken(ahead: int) -> None:
    """A row is the same whether it was looked at or not, be it of the next block of the pair."""
    rows = taken(NoiseStore(Streams(4), 2, 1, 3), 4 * ROWS)
    store = NoiseStore(Streams(4), 2, 1, 3)
    assert taken(store, 2 * ROWS - 2, ahead) == rows[: 2 * ROWS - 2]
    assert store.peek(1, 0, ahead)[0] == rows[2 * ROWS - 2 + ahead]


def test_pairs_without_noise_are_refilled_together() -> None:
    """Each pair that is asked for draws once, however often it is named; no other draws."""
    together, alone = NoiseStore(Streams(4), 2, 3, 3), NoiseStore(Streams(4), 2, 3, 3)
    together.refill_spent(np.array([1, 0, 1]), np.array([0, 2, 0]))
    assert [together.is_spent(*pair) for pair in ((1, 0), (0, 2), (0, 0))] == [False, False, True]
    assert taken(together, 2 * ROWS) == taken(alone, 2 * ROWS)
    left = together.taken.copy()
    together.refill_spent(np.array([0]), np.array([2]))
    assert (together.taken == left).all()

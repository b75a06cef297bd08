"""Noise of pairs: what is drawn does not depend on who looks at it beforehand."""

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

"""What the navigators of a fleet know and remember, as compiled code is handed it once."""

from typing import Annotated, NamedTuple

import numpy as np

from ..records.rows import LEARNT, RECEPTION, Rows
from ..vehicles.motion import Floats, Ints
from .belief import Belief, Beliefs, Growth, copies
from .dead_reckoning import Reckoned
from .weighing import Rule

# Fixes that a late one may be earlier than, and still be put in its place.
REMEMBERED = 16

# One of them: its row, and the row of what was believed before it
PAST = np.dtype([("fix", "i8"), ("before", "i8")])


class Memory(NamedTuple):
    """What each of n AUVs remembers: its latest belief, and its last `known` (n,) fixes, `past`
    (n, REMEMBERED), PAST, in the order in which they are taken in, with what was believed `before`.
    """

    latest: Beliefs
    before: Beliefs
    past: Annotated[Rows, PAST, 2]
    known: Ints


def memory_of(first: Belief, start: Beliefs) -> Memory:
    """Return what AUVs remember at the start."""
    count = len(start.moments)
    past = np.zeros((count, REMEMBERED), dtype=PAST)
    past["before"] = np.arange(past.size).reshape(past.shape)
    latest = Beliefs(start.moments.copy(), start.states.copy(), start.covariances.copy())
    return Memory(latest, copies(first, past.size), past, np.zeros(count, dtype=np.int64))


class Holding(NamedTuple):
    """Beliefs in the order in which they came about: by which AUV (n,), since when (n,), s, and
    what was believed.
    """

    holders: Ints
    since: Floats
    beliefs: Beliefs


class Desk(NamedTuple):
    """Room to work things out: two beliefs of k states, at one instant and further `ahead`; shares
    (k, 2) of what a fix says, and what the last m states add to it, `common` (2, m).
    """

    belief: Belief
    ahead: Belief
    shares: Annotated[Floats, 2]
    common: Annotated[Floats, 2]


def desk_for(first: Belief, common: int) -> Desk:
    """Return room for beliefs of as many states as the first, so many of them in common."""
    belief, ahead = [
        Belief(first.moment.copy(), first.state.copy(), first.covariance.copy()) for _ in range(2)
    ]
    return Desk(belief, ahead, np.zeros((len(first.state), 2)), np.zeros((2, common)))


class Known(NamedTuple):
    """What the navigators of n AUVs know: how fixes change beliefs, how these become less sure,
    dead reckoning, what is remembered, what has been believed since when, and the receptions that
    fixes are made of.  For autopilots,
    what to add to dead reckoning, `corrections` (n, 2), m, and which bias and current go on
    carrying it off since when, `learnt` (n,), :data:`.rows.LEARNT`.
    """

    rule: Rule
    growth: Growth
    reckoning: Reckoned
    memory: Memory
    held: Holding
    desk: Desk
    receptions: Annotated[Rows, RECEPTION]
    corrections: Annotated[Floats, 2]
    learnt: Annotated[Rows, LEARNT]

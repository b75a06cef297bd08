"""The broadcasters: each chooses the ASV that broadcasts fixes, from a
:class:`..core.protocol.network.BroadcastView`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ..core.scenario.families import BroadcasterTraits
from ..core.scenario.key_types import Whole, key
from ..core.scenario.part_choice import Settings

if TYPE_CHECKING:
    from ..core.protocol.network import BroadcastView, Share
    from ..support.arrays import Floats, Ints

# ASVs, or fixes, whose distances to all others are worked out at once
BLOCK = 64


@BroadcasterTraits("turn", advised=4)
def rotate(view: BroadcastView) -> int:
    """Let the ASVs broadcast in turn, counted by broadcasts."""
    able = _able(view)
    return able[view.number % len(able)]


@BroadcasterTraits("lot", advised=5)
def random(view: BroadcastView) -> int:
    """Choose a random ASV."""
    able = _able(view)
    return able[int(view.random.integers(len(able)))]


@BroadcasterTraits("hearing", advised=3)
def most_fixes(view: BroadcastView) -> int:
    """Choose the ASV that measured most fixes, the first among equals; without any, in turn."""
    if not len(view.heard):
        return rotate(view)
    return _largest(view, view.heard.sum(axis=0))


@BroadcasterTraits("distance", advised=1)
def nearest(view: BroadcastView) -> int:
    """Choose the ASV with the least mean horizontal distance to the fixes, the first among equals.

    Without any fix ASVs take turns: always the same one would never reach AUVs that have strayed
    from it and whose slots frames announce.
    """
    if not len(view.fixes):
        return rotate(view)
    import numpy as np

    goals, vessels = view.fixes[:, :2], view.asvs[:, :2]
    apart = [
        np.linalg.norm(vessels[k : k + BLOCK, None] - goals, axis=2).mean(axis=1)
        for k in range(0, len(vessels), BLOCK)
    ]
    return _largest(view, -np.concatenate(apart))


class Fixed(Settings):
    """Settings of the broadcaster `fixed`."""

    asv: Whole = key(0, "1", "number of the ASV that always broadcasts", ge=0, le=9_999)


@BroadcasterTraits("one", settings=Fixed)
def fixed(view: BroadcastView, *, settings: Fixed) -> int:
    """Always choose the same ASV; while it has failed, the next by number."""
    return min(_able(view), key=lambda other: (other - settings.asv) % view.count)


@BroadcasterTraits("distance", at_once=True, advised=2)
def parallel(view: BroadcastView) -> list[list[Share]]:
    """Let the nearest ASV send each fix; ASVs broadcast at once if no AUV hears two of them.

    ASVs that one AUV may hear both have slots of their own, chosen as ping groups are (eq.
    greedy_colour), the ASVs with most fixes first, so that long frames share a slot.  Without any
    fix one ASV sends a header, in turn.
    """
    import numpy as np

    from ..core.protocol.conflicts import greedy_groups

    able = np.array(_able(view))
    if not len(view.fixes):
        return [[(rotate(view), np.empty(0, dtype=np.int64))]]
    sender = able[_nearest_of(view.asvs[able], view.fixes)]
    fixes = np.bincount(sender, minlength=view.count)
    senders = np.argsort(-fixes, kind="stable")[: np.count_nonzero(fixes)]
    slots = greedy_groups(np.ascontiguousarray(view.listeners.T[senders]))
    return [
        [(int(asv), np.flatnonzero(sender == asv)) for asv in senders[list(slot)]] for slot in slots
    ]


def _nearest_of(asvs: Floats, fixes: Floats) -> Ints:
    """Return which of m ASVs (m, 3) is horizontally nearest to each of k fixes (k, 3), (k,)."""
    import numpy as np

    nearest = [
        np.linalg.norm(fixes[k : k + BLOCK, None, :2] - asvs[:, :2], axis=2).argmin(axis=1)
        for k in range(0, len(fixes), BLOCK)
    ]
    return np.concatenate(nearest)


def _able(view: BroadcastView) -> Sequence[int]:
    """Return the ASVs that can broadcast, in the order of their numbers."""
    every = range(view.count)
    return [asv for asv in every if asv not in view.failed] if view.failed else every


def _largest(view: BroadcastView, values: Floats) -> int:
    """Return the ASV with the largest of values (m,) among those that can broadcast."""
    import numpy as np

    able = _able(view)
    return able[int(np.argmax(values[able] if view.failed else values))]

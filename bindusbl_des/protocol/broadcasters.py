"""Which ASV broadcasts the fixes of a round; the paper does not say.

A broadcaster is a function from what the surface fleet knows as a broadcast begins
(:class:`BroadcastView`) to the number of the ASV that sends it, or to how several share it.  A
scenario can name one of one's own as ``module:object``.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..core.arrays import Flags, Floats, Ints
from ..core.facts import cached_property
from ..core.plugins import PluginError, asked, is_whole, shown
from ..records.events import HEARD
from ..records.rows import Recorder, Rows
from ..scenario.families import BROADCASTER
from ..scenario.part_choice import own_part, shipped_part
from ..vehicles.fleet import VehicleFleet
from ..vehicles.motion import places
from .acknowledged import Acknowledged, known_by
from .conflicts import greedy_groups

# What an ASV sends of a broadcast: its number, and which of the k fixes
Share = tuple[int, Ints]

# Fixes by their rows of the record: those that wait follow each other.
Fixes = range | Ints

# ASVs, or fixes, whose distances to all others are worked out at a time.
BLOCK = 64


class BroadcastView:
    """What the surface fleet knows when it broadcasts k fixes; k may be 0.

    `number` counts the broadcasts of the mission, `time` (s) is when this one begins, `count` is
    how many ASVs there are, and `random` a stream of the broadcaster's own.  `reached` tells whom
    it believes within MF range of whom.
    """

    def __init__(
        self,
        number: int,
        time: float,
        record: Recorder,
        rows: Fixes,
        fleet: VehicleFleet,
        random: np.random.Generator,
        reached: Callable[[float], Flags],
        acknowledged: Acknowledged | None = None,
    ) -> None:
        """Take the fixes, `rows` of the record; what AUVs have `acknowledged`, if they do."""
        self._acknowledged = acknowledged
        self.number, self.time, self.count, self.random = number, time, len(fleet.vehicles), random
        self._record, self._rows, self._fleet, self._reached = record, rows, fleet, reached

    @cached_property
    def fixes(self) -> Floats:
        """Where the fixes say that the AUVs were (m), shape (k, 3)."""
        fixes = rows_of(self._record, self._rows)
        return np.column_stack((fixes["x_m"], fixes["y_m"], fixes["z_m"]))

    @cached_property
    def asvs(self) -> Floats:
        """Where the m ASVs are (m), shape (m, 3)."""
        return places(self._fleet.motion, self.time)[:, :3]

    @property
    def failed(self) -> tuple[int, ...]:
        """The ASVs that have failed; one of the others broadcasts."""
        return self._fleet.failed(self.time)

    @cached_property
    def heard(self) -> Flags:
        """Whose measurements were fused for each fix, shape (k, m)."""
        return hearers(self._record, self._rows, self.count)

    @cached_property
    def listeners(self) -> Flags:
        """Which AUVs the fleet believes within MF range of each ASV, shape (n, m)."""
        return self._reached(self.time)

    @property
    def acknowledged_at_s(self) -> Floats:
        """Since when (s) the fleet knows of each AUV's newest fix that it knows to be delivered,
        (n,), NaN before the first.

        Raises:
            LookupError: where AUVs do not acknowledge (`protocol.acknowledge`).
        """
        return known_by(self._acknowledged).at_s


def rows_of(record: Recorder, rows: Fixes) -> Rows:
    """Return some fixes of a record."""
    if isinstance(rows, range):
        return record.fixes.array[rows.start : rows.stop]
    chosen: Rows = record.fixes.array[rows]
    return chosen


def hearers(record: Recorder, rows: Fixes, asvs: int) -> Flags:
    """Return whose measurements were fused for each of some fixes of a record, (k, `asvs`)."""
    fused = np.zeros((len(rows), asvs), dtype=np.bool_)
    if len(rows):
        fixes = rows_of(record, rows)
        begin = int(fixes["first"].min())
        receptions = record.receptions.array[begin : int(fixes["end"].max())]
        heard = np.flatnonzero(receptions["outcome"] == HEARD)
        first = np.searchsorted(heard, fixes["first"] - begin)
        end = np.searchsorted(heard, fixes["end"] - begin)
        before = np.repeat(np.cumsum(end - first) - end, end - first)
        hearing = heard[np.arange(len(before)) - before]
        fix = np.repeat(np.arange(len(fixes)), end - first)
        fused[fix, receptions["asv"][hearing]] = True
    return fused


#: Which ASV sends all, or slot after slot which ASVs share it.
Broadcaster = Callable[[BroadcastView], int | list[list[Share]]]


def rotate(view: BroadcastView) -> int:
    """Let the ASVs broadcast in turn, counted by broadcasts."""
    able = _able(view)
    return able[view.number % len(able)]


def random(view: BroadcastView) -> int:
    """Draw the ASV by lot."""
    able = _able(view)
    return able[int(view.random.integers(len(able)))]


def most_fixes(view: BroadcastView) -> int:
    """Take the ASV that measured most of the fixes; the first of equals.  Without any, in turn."""
    if not len(view.heard):
        return rotate(view)
    return _largest(view, view.heard.sum(axis=0))


def nearest(view: BroadcastView) -> int:
    """Take the ASV with the least mean horizontal distance to the fixes; the first of equals.

    Without any they take turns: always the same would never reach AUVs that frames tell their slots
    and that have strayed from it.
    """
    if not len(view.fixes):
        return rotate(view)
    goals, vessels = view.fixes[:, :2], view.asvs[:, :2]
    apart = [
        np.linalg.norm(vessels[k : k + BLOCK, None] - goals, axis=2).mean(axis=1)
        for k in range(0, len(vessels), BLOCK)
    ]
    return _largest(view, -np.concatenate(apart))


def fixed(view: BroadcastView, *, asv: int = 0) -> int:
    """Always take the same ASV; while it has failed, the next by number."""
    return min(_able(view), key=lambda other: (other - asv) % view.count)


def parallel(view: BroadcastView) -> list[list[Share]]:
    """Let each fix go by the ASV nearest to it; ASVs broadcast at once that no AUV hears two of.

    Those that some AUV may hear both of have slots of their own, found as ping groups are
    (eq. greedy_colour), the ASVs with most fixes first, so that long frames share a slot.  Without
    any fix one sends a header, in turn.
    """
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
    """Return the ASV that has the largest of values (m,) among those that can broadcast."""
    able = _able(view)
    return able[int(np.argmax(values[able] if view.failed else values))]


BROADCASTERS: dict[str, Broadcaster] = {
    "rotate": rotate,
    "random": random,
    "most_fixes": most_fixes,
    "nearest": nearest,
    "fixed": fixed,
    "parallel": parallel,
}


def broadcaster_named(name: str) -> Broadcaster:
    """Return a broadcaster by its name in the scenario; one's own is named ``module:object``.

    Raises:
        PluginError: when one's own is not allowed, or cannot be loaded or called.
    """
    if name in BROADCASTERS:
        return shipped_part(BROADCASTER, name, BROADCASTERS[name])
    return OwnBroadcaster(name, own_part(BROADCASTER, name))


@dataclass(frozen=True)
class OwnBroadcaster:
    """A broadcaster of somebody's own: each of its choices is checked."""

    name: str
    choose: Callable[[BroadcastView], int]

    def __call__(self, view: BroadcastView) -> int:
        """Return the number of the ASV that broadcasts.

        Raises:
            PluginError: when it raises anything, or what it returns is no number of an ASV.
        """
        when = f" in broadcast {view.number}"
        asv = asked(BROADCASTER.key, self.name, self.choose, view, when=when)
        if not is_whole(asv) or not 0 <= asv < view.count:
            said = shown(BROADCASTER.key, self.name, asv, when)
            raise PluginError(
                BROADCASTER.key,
                f"{self.name!r} returned {said}{when}; it must be the whole number of an ASV, "
                f"0..{view.count - 1}",
            )
        if asv in view.failed:
            raise PluginError(
                BROADCASTER.key,
                f"{self.name!r} returned {asv}{when}, but ASV{asv} has failed by {view.time:g} s; "
                "it must be one that is not among view.failed",
            )
        return int(asv)

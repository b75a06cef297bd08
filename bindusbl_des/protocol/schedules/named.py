"""The schedule of a scenario by its name: who pings when, the ping groups of a round.

A schedule is a function from what the fleet knows (:class:`.view.View`) to ping groups: lists of
AUV numbers that ping in the same slot, in the order of the slots; slots of other lengths than T_UL
come with them (:class:`.view.TimedGroups`).  A schedule whose attribute `framed` is true starts its
rounds on frames of `protocol.frame_s`.  A scenario can name one of one's own as ``module:object``.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from itertools import islice
from math import isfinite
from numbers import Real
from typing import Any

import numpy as np

from ...core.plugins import PluginError, asked, is_whole, shown
from ...core.wording import shortened
from ...scenario import declared
from ...scenario.families import SCHEDULE
from ...scenario.part_choice import own_part, shipped_part
from ..conflicts import dsatur_groups, greedy_groups
from .polling import polling
from .super_tdma import super_tdma
from .view import Groups, TimedGroups, View

Schedule = Callable[[View], Groups]

# Of `worst_first`: as long as the shortest downlink slot, which every round pays: 10 t_C of at
# least 2.5 t_C each.
WORST_FIRST_SLOTS = 4


def spatial_reuse(view: View) -> Groups:
    """Let AUVs without a common listener ping together, coloured greedily (the paper)."""
    return greedy_groups(view.heard)


def dsatur(view: View) -> Groups:
    """Let AUVs without a common listener ping together, coloured by DSATUR."""
    return dsatur_groups(view.heard)


def one_per_slot(view: View) -> Groups:
    """Give every AUV a slot of its own: TDMA without spatial reuse."""
    return [[auv] for auv in range(len(view.auvs))]


def round_robin(view: View) -> Groups:
    """Give every frame to one AUV, in turn."""
    return [[view.round % len(view.auvs)]]


def random(view: View) -> Groups:
    """Give every frame to an AUV drawn at random."""
    return [[int(view.random.integers(len(view.auvs)))]]


def worst_first(view: View, *, slots: int = WORST_FIRST_SLOTS) -> Groups:
    """Let those AUVs ping whose estimates are worst, in at most so many slots.

    In the order of their claims, each AUV joins the first group in which no ASV would hear it and
    another; those that have no room wait for a later round.  An AUV's claim is the error that is
    expected of it times the chance that a turn will mend it: after k turns in vain, 1 / (k + 2)
    (Laplace's rule of succession).  So an AUV that is not where it is believed to be cannot keep
    the others waiting, and one that drifts has its turn again after a number of rounds that is
    bounded by its turns in vain.  An AUV that no ASV is believed to hear pings in the first slot,
    where it disturbs nobody.  Where frames tell of a round first, who may come within range until
    it begins counts as heard.
    """
    heard = view.heard
    if view.ahead_s > 0.0:
        heard = view.may_hear(view.range_rates_m_per_s * view.ahead_s)
    claims = view.expected_error_m / (view.turns_in_vain + 2.0)
    groups: list[list[int]] = [[] for _ in range(slots)]
    met = np.zeros((slots, heard.shape[1]), dtype=np.bool_)  # ASVs that hear one of a group
    for auv in np.argsort(-claims, kind="stable").tolist():
        room = np.flatnonzero(~(met & heard[auv]).any(axis=1))
        if len(room):
            groups[room[0]].append(auv)
            met[room[0]] |= heard[auv]
    return [group for group in groups if group]


SCHEDULES: dict[str, Schedule] = {
    function.__name__: function
    for function in (
        *(spatial_reuse, dsatur, one_per_slot, round_robin, random),
        *(worst_first, polling, super_tdma),
    )
}


def nobody(view: View) -> Groups:
    """Give nobody a slot: with random access AUVs ping as they like (:mod:`..access`)."""
    return []


def schedule_named(name: str) -> Schedule:
    """Return a schedule by its name in the scenario; one's own is named ``module:object``.

    Raises:
        PluginError: when one's own is not allowed, or cannot be loaded or called.
    """
    if name in declared.SCHEDULES and name not in SCHEDULES:
        return nobody
    if name in SCHEDULES:
        return shipped_part(SCHEDULE, name, SCHEDULES[name])
    return OwnSchedule(name, own_part(SCHEDULE, name))


@dataclass(frozen=True)
class OwnSchedule:
    """A schedule of somebody's own: each of its rounds is checked."""

    name: str
    schedule: Schedule

    def __call__(self, view: View) -> Groups:
        """Return the ping groups of a round.

        Raises:
            PluginError: when it raises anything, or what it returns is no round.
        """
        when = f" in round {view.round}"
        seen = replace(
            view, auvs=view.auvs.copy(), asvs=view.asvs.copy(), heard=view.heard.copy()
        )  # its own to change: calls and the record go by what the fleet knows
        groups = asked(SCHEDULE.key, self.name, self.schedule, seen, when=when)
        # Lists may be made as they are read, so they are read as it is asked.
        plain = asked(SCHEDULE.key, self.name, _as_lists, groups, when=when)
        if plain is None:
            said = shown(SCHEDULE.key, self.name, groups, when)
            raise PluginError(
                SCHEDULE.key,
                f"{self.name!r} returned {said}{when}; a round is a list of groups, each a list "
                "of whole AUV numbers",
            )
        self._check(plain, len(view.auvs), when)
        if not isinstance(groups, TimedGroups):
            return plain
        self._check_lengths(groups, when)
        return TimedGroups(plain, map(float, groups.lengths_s))

    def _check(self, groups: list[list[int]], auvs: int, when: str) -> None:
        """Refuse groups that break the rules of a round."""
        flat = [auv for group in groups for auv in group]
        if not groups or len(set(flat)) != len(flat) or not set(flat) <= set(range(auvs)):
            raise PluginError(
                SCHEDULE.key,
                f"{self.name!r} returned {shortened(str(groups))}{when}; a round needs at least "
                f"one group, and each of the AUVs 0..{auvs - 1} at most once",
            )

    def _check_lengths(self, groups: TimedGroups, when: str) -> None:
        """Refuse slots that are no lengths of time, or not one for each group."""
        lengths = groups.lengths_s
        if len(lengths) != len(groups) or not all(map(_is_time, lengths)):
            raise PluginError(
                SCHEDULE.key,
                f"{self.name!r} returned slots of {shortened(str(list(lengths)))} s{when}; "
                f"lengths_s is one time above 0 for each of the {len(groups)} groups",
            )


def _is_time(length: Any) -> bool:
    is_number = isinstance(length, Real) and not isinstance(length, bool)
    return is_number and isfinite(length) and length > 0.0


# So many groups of a round, or AUVs of a group, are read: a generator may have no end.
MOST_READ = 100_000


def _first(parts: Iterable[Any]) -> list[Any]:
    """Return all parts of a round as a list.

    Raises:
        ValueError: when there are more than MOST_READ.
    """
    found = list(islice(parts, MOST_READ + 1))
    if len(found) > MOST_READ:
        raise ValueError(f"a round with more than {MOST_READ:,} groups, or AUVs of a group")
    return found


def _as_lists(groups: Any) -> list[list[int]] | None:
    """Return ping groups as lists of int; None for what is none, such as [[0.7]] or [[True]]."""
    if not isinstance(groups, Iterable):
        return None
    lists: list[list[Any]] = [
        _first(group) if isinstance(group, Iterable) else [None] for group in _first(groups)
    ]
    if not all(is_whole(auv) for group in lists for auv in group):
        return None
    return [[int(auv) for auv in group] for group in lists]

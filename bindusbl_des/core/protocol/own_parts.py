"""Checks what user-defined schedules, downlinks and broadcasters return."""

import math
from collections.abc import Iterable
from dataclasses import replace
from itertools import islice
from math import isfinite
from numbers import Real
from typing import Any

from ...support.plugins import OwnPart, is_whole
from ...support.wording import shortened
from .network import BroadcastView, Network, Steps, Turn
from .steps import SAME, checked_steps
from .view import Groups, TimedGroups, View


def checked_groups(part: OwnPart, view: View) -> Groups:
    """Return the ping groups of a round of a user-defined schedule.

    Raises:
        PluginError: when it raises anything, or returns no valid round.
    """
    when, auvs = f" in round {view.round}", len(view.auvs)
    seen = replace(
        view, auvs=view.auvs.copy(), asvs=view.asvs.copy(), heard=view.heard.copy()
    )  # copies, which it may change: calls and the record go by what the fleet knows
    groups = part(seen, when=when)
    # Groups may be generators, so errors raised as they are read are the part's, too.
    plain = part.ask(_as_lists, groups, when=when)
    if plain is None:
        needed = "a round is a list of groups, each a list of whole AUV numbers"
        part.refuse(groups, f"{when}; {needed}", when=when)
    flat = [auv for group in plain for auv in group]
    if not plain or len(set(flat)) != len(flat) or not set(flat) <= set(range(auvs)):
        part.fail(
            f"returned {shortened(str(plain))}{when}; a round needs at least one group, and each "
            f"of the AUVs 0..{auvs - 1} at most once"
        )
    if not isinstance(groups, TimedGroups):
        return plain
    lengths = groups.lengths_s
    if len(lengths) != len(groups) or not all(map(_is_time, lengths)):
        part.fail(
            f"returned slots of {shortened(str(list(lengths)))} s{when}; lengths_s is one time "
            f"above 0 for each of the {len(groups)} groups"
        )
    return TimedGroups(plain, map(float, lengths))


def _is_time(length: Any) -> bool:
    is_number = isinstance(length, Real) and not isinstance(length, bool)
    return is_number and isfinite(length) and length > 0.0


# Most groups of a round, or AUVs of a group, that are read: a generator may have no end.
MOST_READ = 100_000


def _read(parts: Iterable[Any]) -> list[Any]:
    """Return the groups of a round, or the AUVs of a group, as a list.

    Raises:
        ValueError: when there are more than MOST_READ.
    """
    found = list(islice(parts, MOST_READ + 1))
    if len(found) > MOST_READ:
        raise ValueError(f"a round with more than {MOST_READ:,} groups, or AUVs of a group")
    return found


def _as_lists(groups: Any) -> list[list[int]] | None:
    """Return ping groups as lists of int; None if they are not, such as [[0.7]] or [[True]]."""
    if not isinstance(groups, Iterable):
        return None
    lists: list[list[Any]] = [
        _read(group) if isinstance(group, Iterable) else [None] for group in _read(groups)
    ]
    if not all(is_whole(auv) for group in lists for auv in group):
        return None
    return [[int(auv) for auv in group] for group in lists]


# Shortest round (s) of a user-defined downlink, so that time goes on: sound travels 1.5 m in it.
SHORTEST_S = 1e-3


def checked_round(part: OwnPart, network: Network, turn: Turn, time: float) -> Steps:
    """Run a round of a user-defined downlink from an instant (s); return when (s) the next begins.
    The downlink sends the fixes that wait, unless it declares that each ping is answered by itself
    (`replies`).

    Raises:
        PluginError: when it raises anything, yields what is no event, or returns no instant after
            this one.
    """
    when = f" in round {turn.row.round}"
    steps = part(network, turn, time, when=when)
    answer = yield from checked_steps(part, steps, network.env, when)
    ends, now = _instant(answer), network.env.now
    if ends is None or ends < time + SHORTEST_S or ends < now - SAME:
        needed = (
            "it must be the instant (s) at which the next round begins, "
            f"{SHORTEST_S:g} s after {time:g} or later"
        )
        waited = f" and not before {now:g}, until when it has waited" if now > time else ""
        part.refuse(answer, f"{when}; {needed}{waited}", when=when)
    if ends > now:
        yield network.env.timeout(ends - now)
    return ends


def _instant(answer: Any) -> float | None:
    """Return an answer as a finite instant (s), or None if it is not one."""
    if not isinstance(answer, Real) or isinstance(answer, bool):
        return None
    try:
        return float(answer) if math.isfinite(answer) else None
    except OverflowError:  # a whole number of hundreds of digits
        return None


def checked_choice(part: OwnPart, view: BroadcastView) -> int:
    """Return the number of the ASV that a user-defined broadcaster has chosen.

    Raises:
        PluginError: when it raises anything, or returns no number of an ASV that works.
    """
    when = f" in broadcast {view.number}"
    asv = part(view, when=when)
    if not is_whole(asv) or not 0 <= asv < view.count:
        needed = f"it must be the whole number of an ASV, 0..{view.count - 1}"
        part.refuse(asv, f"{when}; {needed}", when=when)
    if asv in view.failed:
        part.fail(
            f"returned {asv}{when}, but ASV{asv} has failed by {view.time:g} s; it must be one "
            "that is not among view.failed"
        )
    return int(asv)

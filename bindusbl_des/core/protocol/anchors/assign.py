"""ASVs that each have AUVs of their own, and stay above the middle of these."""

import math

import numpy as np
from numpy.typing import NDArray

from ....support.arrays import Floats
from ...geometry.covering import Circle, enclosing_circle
from ...geometry.placement import least_sum
from .view import AnchorView

Numbers = NDArray[np.intp]


class VesselGroups:
    """The AUVs of each ASV, which keeps them until another split is better by a share.

    A split is better than another if the largest of the smallest circles around its groups is
    smaller.
    """

    def __init__(self, hysteresis: float) -> None:
        self._hysteresis = hysteresis
        self._of: dict[int, Numbers] = {}

    def of(self, view: AnchorView, fleet: Floats) -> dict[int, Numbers]:
        """Return the AUVs of each ASV that works and has any; `fleet` (n, 2), m, is believed."""
        working = np.flatnonzero(view.working)
        wanted = split(fleet, len(working))
        kept = list(self._of.values())
        same = set(self._of) <= set(working.tolist()) and len(kept) == len(wanted)
        if same and largest(fleet, wanted) >= (1.0 - self._hysteresis) * largest(fleet, kept):
            return self._of
        middles = np.array([circle(fleet, group)[:2] for group in wanted])
        owners = np.arange(len(wanted))
        if not view.is_first:
            apart = middles[:, None, :] - view.vessels[working]
            owners = least_sum((apart**2).sum(axis=-1))
        self._of = {int(working[owner]): own for owner, own in zip(owners, wanted, strict=True)}
        return self._of


def circle(fleet: Floats, group: Numbers) -> Circle:
    """Return the smallest circle (m) around the AUVs `group`, indices of `fleet` (n, 2), m."""
    return enclosing_circle(fleet[group])


def largest(fleet: Floats, groups: list[Numbers]) -> float:
    """Return the radius (m) of the largest :func:`circle` around groups, indices of `fleet`."""
    return max(circle(fleet, group).radius for group in groups)


def split(fleet: Floats, count: int) -> list[Numbers]:
    """Return AUVs (n, 2), m, in `count` groups, at most n, of sizes that differ by one at most:
    neighbours along the direction in which the fleet is longest, or across it.

    >>> fleet = np.array([(0.0, 0.0), (9.0, 1.0), (1.0, 2.0), (8.0, 0.0)])
    >>> [group.tolist() for group in split(fleet, 2)]
    [[0, 2], [3, 1]]
    """
    along = lengthwise(fleet)
    orders = [np.argsort((fleet @ axis).round(9), kind="stable") for axis in (along, across(along))]
    tried = [np.array_split(order, min(count, len(fleet))) for order in orders]
    return min(tried, key=lambda groups: largest(fleet, groups))


def lengthwise(fleet: Floats) -> Floats:
    """Return the direction (2,) in which AUVs (n, 2) are spread most; y if all are at one position.

    >>> lengthwise(np.array([(0.0, 0.0), (3.0, -4.0)])).round(9).tolist()
    [-0.6, 0.8]
    """
    offsets = fleet - fleet.mean(axis=0)
    (xx, xy), (_, yy) = (offsets.T @ offsets).tolist()
    yaw = math.atan2(2.0 * xy, xx - yy) / 2.0 if xx + yy > 0.0 else math.pi / 2.0
    line = np.array([math.cos(yaw), math.sin(yaw)])
    turned: Floats = line * np.sign(line[np.abs(line).argmax()])
    return turned  # a line has two directions; this one is unique


def across(line: Floats) -> Floats:
    """Return the direction (2,) at a right angle to another.

    >>> across(np.array([0.6, 0.8])).tolist()
    [-0.8, 0.6]
    """
    return np.array([-line[1], line[0]])


class AssignPlacement:
    """Puts each ASV above the middle of the smallest circle around its AUVs, a horizon (s) ahead.

    Groups are AUVs beside each other, as on neighbouring strips.
    """

    def __init__(self, *, horizon_s: float, hysteresis: float) -> None:
        self._horizon, self._groups = horizon_s, VesselGroups(hysteresis)

    def targets(self, view: AnchorView) -> Floats:
        """Return where ASVs are to go (m, 2), m; an ASV without AUVs keeps its target."""
        fleet = view.auvs(view.begins + self._horizon)[:, :2]
        targets = at_rest(view, fleet)
        for vessel, group in self._groups.of(view, fleet).items():
            targets[vessel] = circle(fleet, group)[:2]
        return targets


def at_rest(view: AnchorView, fleet: Floats) -> Floats:
    """Return the ASVs' present targets (m, 2), m; at first the middle of the AUVs (n, 2)."""
    if view.is_first:
        middle = circle(fleet, np.arange(len(fleet)))[:2]
        return np.tile(middle, (len(view.vessels), 1))
    return view.bound_for.copy()

"""How a survey is cut into parallel lanes, and these are shared out among a team of AUVs.

All of it in the frame of the lanes: they run along x, and follow one another along y (m).
"""

import math
from bisect import bisect_left
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

from .area import Area, Point, bounds

# Rounding that must not cost a strip its last lane (spacings).
LANE_TOLERANCE = 1e-9

# A vehicle cannot be said to go along anything shorter (m).  A lane that its margins leave nothing
# of is this short, in its middle, and is still passed.
SHORTEST_LANE = 0.001


class Lane(NamedTuple):
    """A straight line to be flown along x, from one end to the other (m)."""

    y: float
    x_min: float
    x_max: float


class Share(NamedTuple):
    """The lanes of one AUV, lowest first, and the centre of what it sweeps, x and y (m)."""

    lanes: tuple[Lane, ...]
    centre: Point


class Ruling(NamedTuple):
    """How lanes are drawn: how far apart (m), and how far within the survey's edge they end (m)."""

    spacing: float
    margin: float


def lane_ordinates(lower: float, height: float, spacing: float) -> list[float]:
    """Return the y (m) of the lanes of a strip of some height above its lower edge, lowest first.

    The first lane lies half a spacing above the strip's lower edge, the others one spacing apart;
    a strip narrower than the spacing has one lane along its middle.  What the strip has over a
    whole number of spacings is not swept.

    >>> lane_ordinates(-70.0, 140 / 3, 10)
    [-65.0, -55.0, -45.0, -35.0]
    """
    if height < spacing:
        return [lower + height / 2]
    count = math.floor((height - spacing) / spacing + LANE_TOLERANCE) + 1
    return [lower + spacing * (lane + 0.5) for lane in range(count)]


def strips(area: Area, ruling: Ruling, total: int) -> list[Share]:
    """Return the shares of `total` AUVs: a strip along x of the same height for each, lowest first.

    >>> from .area import polygon
    >>> strips(polygon([(0, 0), (60, 0), (60, 40), (0, 40)]), Ruling(10.0, 5.0), 2)[1].lanes
    (Lane(y=25.0, x_min=5.0, x_max=55.0), Lane(y=35.0, x_min=5.0, x_max=55.0))
    """
    box = area.box
    across = box.y_max - box.y_min
    height = across / total
    lowers = [box.y_min + number * height for number in range(total)]
    uppers = [*lowers[1:], box.y_max]
    widths = area.spans(list(zip(lowers, uppers, strict=True)))
    shares = []
    for number, (lower, (left, right)) in enumerate(zip(lowers, widths, strict=True)):
        ordinates = lane_ordinates(lower, height, ruling.spacing)
        lanes = _lanes(area, ordinates, min(ruling.spacing, height), ruling.margin)
        middle = box.y_min + (number + 0.5) * across / total
        shares.append(Share(tuple(lanes), ((left + right) / 2, middle)))
    return shares


def lane_count(across: float, spacing: float) -> int:
    """Return how many lanes at most a spacing apart sweep a survey, some metres across them.

    >>> lane_count(140.0, 10.0), lane_count(141.0, 10.0)
    (14, 15)
    """
    return max(1, math.ceil(across / spacing - LANE_TOLERANCE))


def equal_lengths(area: Area, ruling: Ruling, total: int) -> list[Share]:
    """Return the shares of `total` AUVs: neighbouring lanes of about the same length together.

    Lanes sweep the whole survey, evenly and at most a spacing apart.  Each goes to the AUV in whose
    part of the summed length its middle lies, so that no share is more than a lane off the mean,
    unless every AUV has to have one lane at least.  Ways between lanes count for nothing.

    Raises:
        ValueError: when there are fewer lanes than AUVs.
    """
    box = area.box
    across = box.y_max - box.y_min
    count = lane_count(across, ruling.spacing)
    if count < total:
        raise ValueError(
            f"makes {count} lane{'s' * (count > 1)} for {total} AUVs; narrow the spacing to "
            f"{across / total:.4g} m or less, or take fewer AUVs"
        )
    apart = across / count
    ordinates = [box.y_min + apart * (lane + 0.5) for lane in range(count)]
    lanes = _lanes(area, ordinates, apart, ruling.margin)
    shares = []
    for first, last in pairwise(_cuts([lane.x_max - lane.x_min for lane in lanes], total)):
        mine = lanes[first:last]
        around = bounds([(x, lane.y) for lane in mine for x in (lane.x_min, lane.x_max)])
        centre = (around.x_min + around.x_max) / 2, (around.y_min + around.y_max) / 2
        shares.append(Share(tuple(mine), centre))
    return shares


def _cuts(lengths: Sequence[float], total: int) -> list[int]:
    """Return where a row of lanes is cut into so many parts of about the same length (m).

    >>> _cuts([1.0, 1.0, 2.0, 4.0], 2), _cuts([9.0, 1.0, 1.0], 3)
    ([0, 3, 4], [0, 1, 2, 3])
    """
    part, before, middles = math.fsum(lengths) / total, 0.0, []
    for length in lengths:
        middles.append(before + length / 2)
        before += length
    cuts = [0]
    for number in range(1, total):
        wanted = bisect_left(middles, number * part)
        cuts.append(min(max(wanted, cuts[-1] + 1), len(lengths) - total + number))
    return [*cuts, len(lengths)]


def _lanes(area: Area, ordinates: Sequence[float], width: float, margin: float) -> list[Lane]:
    """Return the lanes along some y (m), each as long as what of the survey it sweeps.

    A lane reaches over all of the survey in its band of `width` (m), so that nothing is left out
    beside a slanting edge, and straight on where the survey leaves the band and comes back.
    """
    bands = [(y - width / 2, y + width / 2) for y in ordinates]
    lanes = []
    for y, (left, right) in zip(ordinates, area.spans(bands), strict=True):
        left, right = left + margin, right - margin
        if right - left < SHORTEST_LANE:
            middle = (left + right) / 2
            left, right = middle - SHORTEST_LANE / 2, middle + SHORTEST_LANE / 2
        lanes.append(Lane(y, left, right))
    return lanes

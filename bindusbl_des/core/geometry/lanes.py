"""How a survey is cut into parallel lanes, and how a team of AUVs shares them.

Everything is in the frame of the lanes: they run along x and lie side by side along y (m).
"""

import math
from bisect import bisect_left
from collections.abc import Sequence
from itertools import chain, pairwise
from typing import TYPE_CHECKING, NamedTuple

from .area import Area, Point, bounds

if TYPE_CHECKING:
    import shapely

# A strip too narrow by less than this (spacings) still has its last lane: rounding.
LANE_TOLERANCE = 1e-9

# The shortest lane (m).  A lane that its margins would consume is this short, about its middle.
SHORTEST_LANE = 0.001


class Lane(NamedTuple):
    """A straight survey line along x, at one y, between two ends (m)."""

    y: float
    x_min: float
    x_max: float


class Share(NamedTuple):
    """The lanes of one AUV, lowest y first, the centre x, y (m) of its part of the survey, and
    whether lanes must stay `inside` the survey.
    """

    lanes: tuple[Lane, ...]
    centre: Point
    inside: bool = False


class Ruling(NamedTuple):
    """How lanes are laid: spacing (m), and margin (m) between their ends and the survey's edge.

    If `inside`, a lane that leaves the survey and comes back is cut into several.
    """

    spacing: float
    margin: float
    inside: bool = False


def lane_ordinates(lower: float, height: float, spacing: float) -> list[float]:
    """Return the y (m) of the lanes of a strip that begins at `lower` and is `height` (m) wide.

    The first lane lies half a spacing above `lower`, the others one spacing apart; a strip narrower
    than the spacing has one lane along its middle.  What is left beyond a whole number of spacings
    is not swept.

    >>> lane_ordinates(-70.0, 140 / 3, 10)
    [-65.0, -55.0, -45.0, -35.0]
    """
    if height < spacing:
        return [lower + height / 2]
    count = math.floor((height - spacing) / spacing + LANE_TOLERANCE) + 1
    return [lower + spacing * (lane + 0.5) for lane in range(count)]


def strips(area: Area, ruling: Ruling, total: int) -> list[Share]:
    """Return the shares of `total` AUVs: strips along x of equal height, lowest y first.

    Raises:
        ValueError: when a strip has no lane on water.

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
        parts = _lanes(area, ordinates, min(ruling.spacing, height), ruling)
        lanes = list(chain(*parts))
        if not lanes:
            raise ValueError(f"leaves AUV{number} no lane: its strip holds too little water")
        middle = box.y_min + (number + 0.5) * across / total
        shares.append(Share(tuple(lanes), ((left + right) / 2, middle), ruling.inside))
    return shares


def lane_count(across: float, spacing: float) -> int:
    """Return how many lanes, at most a spacing (m) apart, sweep a survey `across` (m) wide.

    >>> lane_count(140.0, 10.0), lane_count(141.0, 10.0)
    (14, 15)
    """
    return max(1, math.ceil(across / spacing - LANE_TOLERANCE))


def equal_lengths(area: Area, ruling: Ruling, total: int) -> list[Share]:
    """Return the shares of `total` AUVs: neighbouring lanes of about equal total length.

    Lanes sweep the whole survey, evenly and at most a spacing apart.  A lane goes to the AUV whose
    part of the summed length holds the lane's middle, so that a share differs from the mean by at
    most one lane, unless each AUV must have at least one.  Turns between lanes are not counted.

    Raises:
        ValueError: when there are fewer lanes than AUVs, or a share has no lane on water.
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
    lanes = _lanes(area, ordinates, apart, ruling)
    shares = list[Share]()
    lengths = [sum(lane.x_max - lane.x_min for lane in parts) for parts in lanes]
    for first, last in pairwise(_cuts(lengths, total)):
        mine = list(chain(*lanes[first:last]))
        if not mine:
            raise ValueError(f"leaves AUV{len(shares)} no lane: its share holds too little water")
        around = bounds([(x, lane.y) for lane in mine for x in (lane.x_min, lane.x_max)])
        centre = (around.x_min + around.x_max) / 2, (around.y_min + around.y_max) / 2
        shares.append(Share(tuple(mine), centre, ruling.inside))
    return shares


def _cuts(lengths: Sequence[float], total: int) -> list[int]:
    """Return the indices that cut a row of lanes, of these lengths (m), into about equal parts.

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


def _lanes(
    area: Area, ordinates: Sequence[float], width: float, ruling: Ruling
) -> list[list[Lane]]:
    """Return the lanes along each y (m), each as long as the part of the survey that it sweeps.

    A lane spans the survey's extent in its band of `width` (m), so that nothing is left out beside
    a slanting edge, and goes straight on where the survey leaves the band and comes back.  Land and
    keep-outs cut it.  With `ruling.inside` it goes from edge to edge.
    """
    margin = ruling.margin
    if ruling.inside:
        wide = area.box.x_min - 1.0, area.box.x_max + 1.0
        return [_afloat(area.shape, y, wide, margin) for y in ordinates]
    if area.closed:
        whole = Area(area.corners, area.turn, area.is_rectangle)
        spans = chain(*_lanes(whole, ordinates, width, ruling))
        room = _room(area)
        return [_afloat(room, y, (left, right), margin) for y, left, right in spans]
    bands = [(y - width / 2, y + width / 2) for y in ordinates]
    lanes = list[list[Lane]]()
    for y, (left, right) in zip(ordinates, area.spans(bands), strict=True):
        left, right = left + margin, right - margin
        if right - left < SHORTEST_LANE:
            middle = (left + right) / 2
            left, right = middle - SHORTEST_LANE / 2, middle + SHORTEST_LANE / 2
        lanes.append([Lane(y, left, right)])
    return lanes


def _room(area: Area) -> "shapely.Geometry":
    """Return a box around an area, minus its closed polygons: where lanes may lie."""
    import shapely

    around, wide = bounds(area.outline), area.across
    box = shapely.box(
        around.x_min - wide, around.y_min - wide, around.x_max + wide, around.y_max + wide
    )
    return shapely.difference(box, area.closed_shape)


def _afloat(
    room: "shapely.Geometry", y: float, span: tuple[float, float], margin: float
) -> list[Lane]:
    """Return the parts of a lane along y (m), over an x interval (m), inside the region `room`.

    Each part ends `margin` (m) before an edge of the region.
    """
    import shapely

    line = shapely.intersection(room, shapely.LineString([(span[0], y), (span[1], y)]))
    found = []
    for part in shapely.get_parts(line):
        (left, _, right, _), (first, last) = shapely.bounds(part).tolist(), span
        left += margin * (left > first + LANE_TOLERANCE)
        right -= margin * (right < last - LANE_TOLERANCE)
        if right - left >= SHORTEST_LANE:
            found.append(Lane(y, left, right))
    return sorted(found)

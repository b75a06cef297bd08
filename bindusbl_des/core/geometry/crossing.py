"""Which straight paths cross land: the compiled inner loops of :mod:`.land`."""

import numpy as np

from ...support.arrays import Flags, Floats
from ...support.compiled import compiled


@compiled
def crossing(here: Floats, there: Floats, edges: Floats) -> Flags:
    """Tell whether the straight path between two positions crosses land, (n, m).

    `here` (n, 2 or more), `there` (m, 2 or more) and the `edges` of the land (k, 4) are in m.
    """
    found = np.empty((len(here), len(there)), np.bool_)
    for i in range(len(here)):
        for j in range(len(there)):
            found[i, j] = crosses(here[i, 0], here[i, 1], there[j, 0], there[j, 1], edges)
    return found


@compiled
def holding(points: Floats, edges: Floats) -> Flags:
    """Tell which points (n, 2 or more) are on the land with these edges (k, 4), in m; (n,)."""
    found = np.empty(len(points), np.bool_)
    for i in range(len(points)):
        x, y = points[i, 0], points[i, 1]
        found[i] = crosses(x, y, x, y, edges)
    return found


@compiled
def crosses(ax: float, ay: float, bx: float, by: float, edges: Floats) -> bool:
    """Tell whether the path from a to b crosses an edge, or begins on land.

    A corner that lies on the path counts as on one side of it, for both of its edges: a path
    through a corner into land crosses exactly one of them.
    """
    low_x, high_x, low_y, high_y = min(ax, bx), max(ax, bx), min(ay, by), max(ay, by)
    inside = False
    for k in range(len(edges)):
        cx, cy, dx, dy = edges[k, 0], edges[k, 1], edges[k, 2], edges[k, 3]
        if (cy > ay) != (dy > ay) and ax < cx + (dx - cx) * (ay - cy) / (dy - cy):
            inside = not inside
        if max(cx, dx) < low_x or min(cx, dx) > high_x:
            continue
        if max(cy, dy) < low_y or min(cy, dy) > high_y:
            continue
        one = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax) > 0.0
        other = (bx - ax) * (dy - ay) - (by - ay) * (dx - ax) > 0.0
        if one == other:
            continue
        begin = (dx - cx) * (ay - cy) - (dy - cy) * (ax - cx) > 0.0
        end = (dx - cx) * (by - cy) - (dy - cy) * (bx - cx) > 0.0
        if begin != end:
            return True
    return inside

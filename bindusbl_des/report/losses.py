"""What pings and fixes were lost to: the numbers behind the sentences of a report."""

import numpy as np
from numpy.typing import NDArray

from .recording import LOST, Recording

Floats = NDArray[np.float64]


def broadcast_distances(mission: Recording) -> tuple[Floats, Floats]:
    """Return of fixes beyond MF range how far (m) their broadcaster and the nearest ASV were."""
    fixes = mission.fixes
    rows = np.flatnonzero(fixes["outcome"] == "out_of_range")
    times = fixes["broadcast_at_s"][rows]
    column = np.clip(np.searchsorted(mission.times, times), 0, len(mission.times) - 1)
    x, y = mission.truth["x_m"][:, column], mission.truth["y_m"][:, column]
    auv, every = fixes["auv"][rows], np.arange(len(rows))
    away = np.hypot(x[mission.auvs :] - x[auv, every], y[mission.auvs :] - y[auv, every])
    return away[fixes["broadcast_by"][rows], every], away.min(axis=0)


def loss_by_listeners(mission: Recording) -> dict[int, tuple[int, int]]:
    """Return, by how many ASVs were in range of a ping, how many were lost, of how many."""
    pings = mission.pings
    return {
        int(listeners): (
            int(np.sum((pings["in_range_of"] == listeners) & (mission.fate == LOST))),
            int(np.sum(pings["in_range_of"] == listeners)),
        )
        for listeners in np.unique(pings["in_range_of"])
        if listeners > 0
    }

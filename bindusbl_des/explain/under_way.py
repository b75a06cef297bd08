"""Where a vessel that moves was going, as its track tells afterwards."""

from typing import TYPE_CHECKING

import numpy as np

from ..core.plugins import is_plugin
from ..scenario.sections.anchors import Moving
from .numbers import rows_where

if TYPE_CHECKING:
    from ..results.result import Result

# A vessel slower than this (m/s) rests; one that turns by less (rad) goes straight on.
RESTS, STRAIGHT = 1e-3, 1e-3


def on_its_way(result: "Result", vessel: str, time: float) -> str:
    """Return where a vessel was going at an instant (s), and how fast; "" where it did not move.

    It goes straight until it turns or rests: there it was bound for, as near as the rows of its
    track tell.
    """
    formation = result.scenario.asvs.formation
    if not isinstance(formation, Moving) and not is_plugin(formation.choice):
        return ""
    track = rows_where(result.tables["tracks"], vehicle=vessel)
    times, x, y = (track[name].to_numpy(float) for name in ("time_s", "x_m", "y_m"))
    steps, lasts = np.diff(x) + 1j * np.diff(y), np.diff(times)
    now = max(int(np.searchsorted(times, time, side="right")) - 1, 0)
    if now >= len(lasts) or abs(steps[now]) < RESTS * lasts[now]:
        return ""
    same = np.abs(np.angle(steps[now:] / steps[now])) < STRAIGHT
    same &= np.abs(steps[now:]) >= RESTS * lasts[now:]
    end = now + (int(same.argmin()) if not same.all() else len(same))
    speed = (np.abs(steps[now:end]) / lasts[now:end]).max()
    return f"; {vessel} was on its way to x {x[end]:.0f}, y {y[end]:.0f} m at {speed:.2g} m/s"

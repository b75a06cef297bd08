"""What the rules compare: distances and limits, in words that show the comparison."""

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..core.plugins import is_plugin
from ..scenario.declared import channel_named

if TYPE_CHECKING:
    from ..results.result import Result
    from ..scenario.sections.acoustics import Uplink

    Place = NDArray[np.float64] | tuple[float, float, float]

# A distance this near to a limit (m) is told with all its digits.
MOST_DIGITS = 6


def compared(value: float, limit: float) -> str:
    """Return a distance and its limit (m) with as many digits as show which is larger.

    >>> compared(63.24, 50.0), compared(50.0004, 50.0)
    ('63.2 m > 50 m', '50.0004 m > 50 m')
    """
    digits = 1
    while digits < MOST_DIGITS and (round(value, digits) > limit) != (value > limit):
        digits += 1
    sign = ">" if value > limit else "<="
    return f"{value:.{digits}f} m {sign} {limit:g} m"


def out_of_range(hf: "Uplink") -> str:
    """Return where nothing on the HF band is decoded, as ends "ASV0 is 60 m away, ..."."""
    if is_plugin(hf.channel):
        return f"where the channel {hf.channel.told} lets no sound through"
    if not channel_named(hf.channel).ends_at_range:
        return f"where the channel {hf.channel} lets nothing be decoded"
    return f"out of HF range ({hf.range_m:g} m {hf.range_metric})"


def apart(hf: "Uplink", here: "Place", there: "Place") -> float:
    """Return the distance (m) of two places (x, y, z in m) that is compared with the HF range."""
    axes = 3 if hf.range_metric == "slant" else 2
    return math.dist(here[:axes], there[:axes])


def rows_where(table: Any, **values: Any) -> Any:
    """Return the rows of a table that have the given values."""
    kept = np.ones(len(table), dtype=bool)
    for name, value in values.items():
        kept &= (table[name] == value).to_numpy()
    return table[kept]


def row_of(result: "Result", table: str, key: str, number: int) -> Any:
    """Return one row of an event table by its number.

    Raises:
        LookupError: when the result holds no events, or no such row.
    """
    if table not in result.arrow:
        raise LookupError("the run recorded no events (record.detail: summary); run it with 'full'")
    rows = result.tables[table]
    found = rows_where(rows, **{key: number})
    if not len(found):
        last = f"it has 0..{len(rows) - 1}" if len(rows) else "it has none"
        raise LookupError(f"the run has no {key} {number}; {last}")
    # whole numbers stay whole, and what is missing is None
    return found.astype(object).where(found.notna(), None).iloc[0]


def place(result: "Result", vehicle: str, time: float) -> NDArray[np.float64]:
    """Return where a vehicle was (x, y, z in m) at an instant (s), between rows of its track."""
    track = rows_where(result.tables["tracks"], vehicle=vehicle)
    times = track.time_s.to_numpy(float)
    return np.array([np.interp(time, times, track[name].to_numpy(float))
                     for name in ("x_m", "y_m", "z_m")])  # fmt: skip

"""A recorded mission: odometry of one vehicle, and what acoustics told of its position."""

from dataclasses import dataclass, replace
from math import cos, isfinite, isnan, sin
from typing import NamedTuple

import numpy as np

from ...core.navigation.dead_reckoning import Odometry
from ...models.charts.shapes import BadChart, check_seconds, unix_time
from ...support.arrays import Flags, Floats, Ints
from ...support.tables import Unmeasured
from ...support.wording import described


class BadLog(ValueError):
    """A log cannot be read; the message names file, place and remedy."""


class NothingLogged(BadLog, Unmeasured):
    """A row of a log in which nothing was measured."""


# Beyond this (m, s, rad, or their squares) nothing has been measured: it is a mistake, and squares
# of it are no numbers any more.
MOST = 1e10


def recorded(place: str, column: str, value: object) -> float:
    """Return a number that somebody has recorded.

    Raises:
        BadLog: naming the place of what is none, or none that can be computed with.
    """
    try:
        if column.endswith("_s") and isinstance(value, str) and ":" in value:  # a time of day
            return unix_time(place, value.strip())
        found = float(value)  # type: ignore[arg-type]  # whatever it is, float says
    except BadChart as error:
        raise BadLog(str(error)) from None
    except (TypeError, ValueError, OverflowError):
        raise BadLog(
            f"{place}: needs a number in the column {column}; met {described(value)}"
        ) from None
    if not isfinite(found):
        fault = NothingLogged if isnan(found) else BadLog
        raise fault(f"{place}: {column} is {found}; leave the row out if nothing was measured")
    if column.endswith("_s"):
        try:
            check_seconds(place, column, found)
        except BadChart as error:
            raise BadLog(str(error)) from None
    if abs(found) > MOST:
        raise BadLog(f"{place}: {column} is {found:g}; no log holds more than {MOST:g}")
    return found


class SurveyedBeacons(NamedTuple):
    """Beacons at surveyed places: their names, and where they are (k, 3), m, z down."""

    names: tuple[str, ...]
    places: Floats


class Ranges(NamedTuple):
    """Ranges (n,), m, to beacons (n,), by their number, at instants (n,), s."""

    times: Floats
    beacons: Ints
    metres: Floats


class LoggedFixes(NamedTuple):
    """Fixes: the instants at which they hold (n,), s, places (n, 2), m, and their covariances
    xx, yy, xy (n, 3), m2.
    """

    times: Floats
    places: Floats
    covariances: Floats


class Receptions(NamedTuple):
    """Signals that were heard or lost (n,), in the order of time: when (s), by which pair of
    vehicles (its number), whether it was lost, and over which range (m), NaN where nobody knows.
    """

    times: Floats
    pairs: Ints
    is_lost: Flags
    ranges: Floats


class Stated(NamedTuple):
    """What a log itself says of its noise: standard deviations of a range (m), and of a step of
    its odometry, along both axes (m) and in heading (rad), one for each step (n - 1,).
    """

    range_m: float
    step_m: Floats
    step_rad: Floats


class LoggedPose(NamedTuple):
    """A place in the plan (m), and a heading (rad) from x towards y."""

    x: float
    y: float
    heading: float


@dataclass(frozen=True)
class Log:
    """A recorded mission of one vehicle at n instants (n,), s, that rise from 0.

    `places` (n, 2), m, and `yaws` (n,), rad, are what its odometry has summed up to, `depths` (n,),
    m.  A log that is not `placed` has its odometry in a frame of its own, which begins anywhere and
    is turned by anything, until its start is found.  `has_clock` is False where nothing but the
    order was recorded: an instant is then the distance gone so far at a nominal speed.  What is to
    be said of rows that do not count is in `left_out`.  `origin_deg` is the latitude and longitude
    (deg) of x = y = 0 of a log in degrees.
    """

    name: str
    times: Floats
    places: Floats
    yaws: Floats
    depths: Floats
    beacons: SurveyedBeacons
    ranges: Ranges
    fixes: LoggedFixes
    placed: bool = True
    start_found: bool = False
    has_clock: bool = True
    stated: Stated | None = None
    receptions: Receptions | None = None
    left_out: tuple[str, ...] = ()
    origin_deg: tuple[float, float] | None = None

    def begun_at(self, start: LoggedPose) -> "Log":
        """Return the log with its odometry beginning at a pose in the frame of its beacons."""
        turn = start.heading - float(self.yaws[0])
        turned = rotated(self.places - self.places[0], turn)
        places = turned + np.array((start.x, start.y))
        return replace(self, places=places, yaws=self.yaws + turn, placed=True, start_found=True)

    def odometry(self, times: Floats) -> Odometry:
        """Return what the vehicle's own sensors had told it by instants (k,), s.

        Between two rows velocity and turn rate are constant.
        """
        return Odometry(times, self.at(self.places, times), self.at(self._headings(), times))

    def at(self, rows: Floats, times: Floats) -> Floats:
        """Return what rows (n,) or (n, m) were at instants (k,), s, between them linearly."""
        if rows.ndim == 1:
            return np.interp(times, self.times, rows)
        return np.column_stack([np.interp(times, self.times, column) for column in rows.T])

    def _headings(self) -> Floats:
        """Return the integrals of the cosine and sine of the heading (n, 2), s, by trapezoids."""
        steps = np.diff(self.times)
        both = np.column_stack((np.cos(self.yaws), np.sin(self.yaws)))
        grown = 0.5 * (both[1:] + both[:-1]) * steps[:, None]
        return np.vstack((np.zeros((1, 2)), np.cumsum(grown, axis=0)))

    @property
    def has_ranges(self) -> bool:
        """Whether there is any range in it."""
        return len(self.ranges.times) > 0

    @property
    def distance(self) -> float:
        """The way gone by its odometry (m)."""
        return float(np.hypot(*np.diff(self.places, axis=0).T).sum())


def rotated(places: Floats, angle: float) -> Floats:
    """Return places (n, 2) turned about the origin by an angle (rad) from x towards y."""
    c, s = cos(angle), sin(angle)
    turned: Floats = places @ np.array(((c, s), (-s, c)))
    return turned

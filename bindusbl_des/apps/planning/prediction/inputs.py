"""The inputs of a prediction: numbers and arrays, computed once for many placements.

They exclude the stations of ASVs, which :func:`.predicting.predict` takes as its own argument, so
that a placement takes milliseconds.  docs/planning.md (Predicted error) gives the measured
accuracy.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ....core.geometry.land import Land
from ....core.scenario import families
from ....support.arrays import Floats


class Off(NamedTuple):
    """The relative error of predictions, as a share of the smaller of both values.

    Half of all plans err by less than `median`, nine in ten by less than `p90`, 99 in 100 by less
    than `p99`.
    """

    median: float
    p90: float
    p99: float


# Prediction.worst against the mean over four missions, for 520 random plans
# (tests/predicted_for_tests.py) without those where either is 0.
STATED_ERROR = {
    "position_error_m": Off(0.064, 0.364, 1.093),
    "position_error_rms_m": Off(0.075, 0.400, 1.400),
    "position_error_p95_m": Off(0.107, 0.508, 2.137),
    "fix_rate_hz": Off(0.002, 0.153, 1.051),
    "fix_age_mean_s": Off(0.015, 0.241, 1.598),
    "fix_age_p95_s": Off(0.014, 0.434, 1.860),
    "fix_age_max_s": Off(0.132, 1.375, 3.136),
    "hf_coverage": Off(0.000, 0.015, 0.086),
}


@dataclass(frozen=True)
class PlannedWays:
    """The planned paths of n AUVs at k even instants `times_s` (k,), from start to end.

    `places_m` (n, k, 2) are positions, `headings_s` (n, k, 2) the integrals of cosine and sine of
    the heading (s), `depths_m` (n,) depths.
    """

    times_s: Floats
    places_m: Floats
    headings_s: Floats
    depths_m: Floats


@dataclass(frozen=True)
class Chances:
    """The probability that a signal is decoded, by slant range; 0 beyond `range_m` if it `is_cut`.

    `chances` (g,) belong to slant ranges 0, `step_m`, 2 `step_m`, ..., linear in between and
    constant beyond.  The range limits the slant distance if `by_slant`, else the horizontal one.
    """

    range_m: float
    is_cut: bool
    by_slant: bool
    step_m: float
    chances: Floats


@dataclass(frozen=True)
class FixNoise:
    """The error variances (n, m, g; m2) of a fix by one array, for n AUVs over horizontal distance.

    m is the number of ASVs, or 1 where all arrays are alike.  `along` and `across` the horizontal
    line of sight, `down`, and `leaning`, the covariance of along and down, at distances 0,
    `step_m`, 2 `step_m`, ... as in :class:`Chances`.  `slow` (n, m, g) is the share that changes
    slowly.
    """

    step_m: float
    along_m2: Floats
    across_m2: Floats
    down_m2: Floats
    leaning_m2: Floats
    slow: Floats

    def without(self, lost: Sequence[int]) -> "FixNoise":
        """Return the noise of the fleet without some ASVs."""
        if self.slow.shape[1] == 1:
            return self
        tables = self.along_m2, self.across_m2, self.down_m2, self.leaning_m2, self.slow
        return FixNoise(self.step_m, *(np.delete(table, lost, axis=1) for table in tables))


@dataclass(frozen=True)
class SystematicErrors:
    """Standard deviations of the errors that fixes have in common.

    Each array has a misalignment (rad) and a GNSS error per axis (m), a Gauss-Markov process; all
    ranges share a relative error of sound speed; each AUV has a clock error (s).  Slow acoustic
    errors last `slow_s` (s; 0 without).  `is_estimated`: the filter knows of all of them and
    estimates them.
    """

    misalignment_rad: float
    gnss_m: float
    gnss_time_constant_s: float
    sound_speed_share: float
    clock_s: float
    slow_s: float
    is_estimated: bool

    @property
    def is_none(self) -> bool:
        """Whether all these errors are zero."""
        of_all = self.sound_speed_share or self.clock_s or self.slow_s
        return not (self.misalignment_rad or self.gnss_m or of_all)


@dataclass(frozen=True)
class SlotLengths:
    """Lengths of slots (s), in whole ticks of `tick_rate_hz` (0: no ticks).

    An uplink slot holds `ways` times a ping of `ping_s` and the largest travel time, the turnaround
    and `uplink_guard_s`, at least `shortest_uplink_s`; then `answer_s`, a direct reply's frame and
    guard.  `fixed_uplink_s` replaces that for a user-defined ranging.  The largest distance is the
    HF range, to `deepest_m` if that is horizontal.  `downlink_s` and `frame_s`, from a frame's
    begin to its delivery, are those of 0 to n fixes (n + 1,).
    """

    ping_s: float
    ways: int
    turnaround_s: float
    uplink_guard_s: float
    shortest_uplink_s: float
    fixed_uplink_s: float | None
    deepest_m: float
    sound_speed_m_per_s: float
    tick_rate_hz: float
    answer_s: float
    downlink_s: Floats
    frame_s: Floats


@dataclass(frozen=True)
class AccessPlan:
    """Which vehicle pings when and which ASV answers how, as the protocol's parts declare it.

    `frame_s` is 0 without frames; `fixed_asv` broadcasts if the broadcaster is fixed.  A direct
    reply ends `reply_s` after the ping's front; it is a frame that others may overlap if
    `replies_in_frames`.
    """

    schedule: families.ScheduleTraits
    downlink: families.DownlinkTraits
    broadcaster: families.BroadcasterTraits
    ranging: families.RangingTraits
    fixed_asv: int
    frame_s: float
    reply_s: float
    replies_in_frames: bool


@dataclass(frozen=True)
class DriftSource:
    """A source of drift of dead reckoning: a pair of numbers that rotates with `frame`.

    `body`: velocity ahead and to starboard (m/s); `world`: velocity along x and y (m/s); `way`: the
    share by which the path is stretched, and rotated.  `mean` and `drawn_sd` are true, `assumed_sd`
    is the filter's.  The pair is constant, a Gauss-Markov process of `time_constant_s`, or a random
    walk of variance `wander_per_s`.
    """

    frame: str
    mean: tuple[float, float]
    drawn_sd: tuple[float, float]
    assumed_sd: tuple[float, float]
    time_constant_s: float | None = None
    wander_per_s: float = 0.0


@dataclass(frozen=True)
class PredictedNavigator:
    """How an AUV navigates: its `filter` by name, its declared `kind`, and its dead reckoning.

    A filter of fixed gain uses `gain`; it compares fixes with its estimate at the ping (`at_ping`)
    or at the delivery.  Initial positions and random walks (m2/s per axis) are true, and as the
    filter assumes.
    """

    filter: str
    kind: families.NavigatorTraits
    gain: float
    at_ping: bool
    start_sd_m: float
    assumed_start_sd_m: float
    walk_m2_per_s: float
    assumed_walk_m2_per_s: float
    sources: tuple[DriftSource, ...]


# The fields of a navigator's dead reckoning
DRIFTS = "walk_m2_per_s", "assumed_walk_m2_per_s", "sources"


@dataclass(frozen=True)
class OtherDrift:
    """The dead reckoning of AUVs (`members`, by number) whose errors differ from AUV0's.

    Fields are those of :class:`PredictedNavigator`.
    """

    members: tuple[int, ...]
    walk_m2_per_s: float
    assumed_walk_m2_per_s: float
    sources: tuple[DriftSource, ...]


@dataclass(frozen=True)
class Inputs:
    """All inputs of a prediction but the stations of the ASVs.

    `navigator` is that of all AUVs but the `others`.  `approximations` are sentences on what the
    prediction leaves out.
    """

    duration_s: float
    ways: PlannedWays
    hf: Chances
    mf: Chances
    noise: FixNoise
    systematic: SystematicErrors
    slots: SlotLengths
    access: AccessPlan
    navigator: PredictedNavigator
    approximations: tuple[str, ...] = ()
    others: tuple[OtherDrift, ...] = ()
    land: Land | None = None

    @property
    def navigators(self) -> list[tuple[list[int], PredictedNavigator]]:
        """Groups of AUVs, by their numbers, each with its navigator."""
        found = []
        for own in self.others:
            drift = {name: getattr(own, name) for name in DRIFTS}
            found.append((list(own.members), replace(self.navigator, **drift)))
        told = {auv for members, _ in found for auv in members}
        rest = [auv for auv in range(len(self.ways.depths_m)) if auv not in told]
        return [(rest, self.navigator), *found]

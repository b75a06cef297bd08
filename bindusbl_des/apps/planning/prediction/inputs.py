"""What a prediction is made of: plain numbers and arrays, worked out once for many placements.

Where the ASVs are is not among them: :func:`.predicting.predict` takes that beside them, so that a
placement can be tried in milliseconds.  How far predictions are from simulations was measured
(docs/planning.md, Predicted error).
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

from ....core.geometry.land import Land
from ....core.scenario import families
from ....support.arrays import Floats


class Off(NamedTuple):
    """How far predictions are off, as a share of what is simulated, or of what is predicted if that
    is less: of half of all plans less than `median`, of nine tenths less than `p90`, of 99 in a
    hundred less than `p99`.
    """

    median: float
    p90: float
    p99: float


# Of the worst AUV: Prediction.worst against the mean over four missions, of 520 plans drawn at
# random (tests/predicted_for_tests.py), but for those where either of the two is 0.
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
    """Where n AUVs are going to be at k even instants (k,), s, from the start to the end.

    Their places (n, k, 2), m, the integrals of the cosine and sine of their headings (n, k, 2), s,
    and their depths (n,), m.
    """

    times_s: Floats
    places_m: Floats
    headings_s: Floats
    depths_m: Floats


@dataclass(frozen=True)
class Chances:
    """How likely a signal is decoded: by slant range, and nothing beyond `range_m` if it `is_cut`.

    `chances` (g,) belong to slant ranges 0, `step_m`, 2 `step_m` and so on, straight in between and
    the last of them beyond.  `by_slant` tells which distance is compared with the range.
    """

    range_m: float
    is_cut: bool
    by_slant: bool
    step_m: float
    chances: Floats


@dataclass(frozen=True)
class FixNoise:
    """What a fix by one array errs by: variances (n, g), m2, of n AUVs by horizontal distance.

    Along the line of sight seen from above, across it, downwards, and the covariance of along and
    down.  They belong to distances 0, `step_m`, 2 `step_m` and so on, as those of :class:`Chances`;
    so does the share of it that changes slowly, `slow` (n, g).
    """

    step_m: float
    along_m2: Floats
    across_m2: Floats
    down_m2: Floats
    leaning_m2: Floats
    slow: Floats


@dataclass(frozen=True)
class SystematicErrors:
    """Errors that fixes have in common all the time, as standard deviations.

    Of each array's heading (rad) and GNSS position per axis (m), which wanders with a time constant
    (s); of all ranges the share by which they are too long, and how late (s) an AUV's clock is.
    Slow acoustic errors last for `slow_s` (s; 0: there are none).  Whether the filter is told of
    all of them (`is_estimated`), so that it estimates them.
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
        """Whether there are no such errors."""
        of_all = self.sound_speed_share or self.clock_s or self.slow_s
        return not (self.misalignment_rad or self.gnss_m or of_all)


@dataclass(frozen=True)
class SlotLengths:
    """How long slots last (s).

    An uplink slot holds `ways` times the ping of `ping_s` and the longest way, the turnaround and
    `uplink_guard_s`, and lasts `shortest_uplink_s` at least, and holds after that a direct reply's
    frame and guard, `answer_s`; `fixed_uplink_s` (None: there is none) is that of a ranging of
    one's own.  The longest way is the HF range, or reaches to `deepest_m`
    where that is horizontal, at `sound_speed_m_per_s`.  Downlink slots and what a frame's delivery
    takes after it begins are those of 0, 1, ... n fixes (n + 1,).  All are whole ticks of
    `tick_rate_hz`; 0: there are none.
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
    """Who pings when, and who answers how, as the parts of the protocol declare it.

    `frame_s` is 0 unless the schedule has frames; `fixed_asv` broadcasts if the broadcaster is
    fixed; the end of a direct reply, or all of it, sets out `reply_s` after a ping's front, in a
    frame that others may overlap if it `replies_in_frames`.
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
    """What makes dead reckoning drift: two numbers, constant but for what is said of them here.

    They turn with the `frame`: `body` (velocity ahead and to starboard, m/s), `world` (velocity
    along x and y, m/s), `way` (share by which the way is stretched, and turned).  Their true mean,
    the standard deviations with which they are drawn, and those which the filter is told.  They
    wander as a Gauss-Markov process of `time_constant_s` (None: they are constant), or as a random
    walk with the variance `wander_per_s`.
    """

    frame: str
    mean: tuple[float, float]
    drawn_sd: tuple[float, float]
    assumed_sd: tuple[float, float]
    time_constant_s: float | None = None
    wander_per_s: float = 0.0


@dataclass(frozen=True)
class PredictedNavigator:
    """How an AUV navigates: its `filter` by name, what that declares (`kind`), and how wrong its
    dead reckoning is.

    Filters of a fixed gain have this `gain`; fixes are compared with what is believed of their ping
    (`at_ping`), or of their delivery.  Positions at the start and the random walk (m2/s per axis)
    as they are, and as the filter is told.
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


# How wrong dead reckoning is, of a navigator
DRIFTS = "walk_m2_per_s", "assumed_walk_m2_per_s", "sources"


@dataclass(frozen=True)
class OtherDrift:
    """The dead reckoning of AUVs, by their numbers, that errs by something else than AUV0's, as of
    :class:`PredictedNavigator`.
    """

    members: tuple[int, ...]
    walk_m2_per_s: float
    assumed_walk_m2_per_s: float
    sources: tuple[DriftSource, ...]


@dataclass(frozen=True)
class Inputs:
    """All that a prediction is made of but for the stations of the ASVs.

    `navigator` is that of AUV0, and of all AUVs but the `others`.  `approximations` are sentences
    on what the prediction leaves out of the scenario.
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
        """How AUVs navigate, by their numbers."""
        found = []
        for own in self.others:
            drift = {name: getattr(own, name) for name in DRIFTS}
            found.append((list(own.members), replace(self.navigator, **drift)))
        told = {auv for members, _ in found for auv in members}
        rest = [auv for auv in range(len(self.ways.depths_m)) if auv not in told]
        return [(rest, self.navigator), *found]

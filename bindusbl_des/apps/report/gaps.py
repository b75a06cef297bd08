"""When an AUV got no fixes for too long, and what became of the pings it sent meanwhile."""

import math
from dataclasses import dataclass

import numpy as np

from ...core.setup import Setup
from ...support.arrays import Floats, Ints
from ...support.spreads import wandering_rms
from ...support.wording import LONG_S, significant, timed
from ..preflight.round_lengths import rounds_of
from .recording import FATES, Recording

# An AUV starves when dead reckoning alone would have drifted this far (m) since its last fix ...
TOLERATED_DRIFT_M = 1.0
# ... but a wait of a few rounds is how the protocol works, and no gap.
TOLERATED_ROUNDS = 3.0
# Where dead reckoning never drifts that far, only a wait of many rounds is a gap.
MANY_ROUNDS = 10.0


@dataclass(frozen=True)
class Patience:
    """How long (s) an AUV may be without a fix: before its first one, and after any other.

    Where the initial position is uncertain, the wait for the first fix is the shorter one.
    `reason` says what decides the later waits.
    """

    first: float
    later: float
    reason: str

    @property
    def rule(self) -> str:
        """Who counts as starved, in a sentence."""
        early = f" ({timed(self.first, 1)} before its first one)" if self.first < self.later else ""
        wait = f"{timed(self.later, 1)} without a fix{early}"
        return f"An AUV counts as starved after {wait}: {self.reason}."


@dataclass(frozen=True)
class Gap:
    """A time without any fix: from the ping of the fix before (or the start) to the next that the
    AUV takes (or the end), in s.
    """

    start: float
    end: float
    is_first: bool

    @property
    def length(self) -> float:
        """Duration (s)."""
        return self.end - self.start


@dataclass(frozen=True)
class Service:
    """How one AUV was served: its gaps, and its pings in them by what became of them.

    `furthest` and `median` are distances (m) to the nearest working ASV of pings in gaps that no
    ASV could hear, nan without any; errors (m) are time means inside and outside of the gaps.
    """

    auv: int
    gaps: tuple[Gap, ...]
    fates: dict[str, int]
    furthest: float
    median: float
    error_in_gaps: float
    error_otherwise: float

    @property
    def starved(self) -> float:
        """Time (s) in gaps."""
        ends = (0.0, *(gap.end for gap in self.gaps))
        return sum(gap.end - max(gap.start, end) for gap, end in zip(self.gaps, ends, strict=False))


def patience(mission: Recording) -> Patience:
    """Return after how long without a fix an AUV counts as starved."""
    starts, duration = mission.rounds["started_at_s"], mission.scenario.duration_s
    scenario, setup, turns = mission.scenario, mission.setup, "rounds"
    if scenario.protocol.random_access:  # whose rounds begin as MF is free
        length, turns = scenario.protocol.frame_s, "times the mean interval of its pings"
    elif len(starts) > 1:
        length = float(np.median(np.diff(starts)))
    else:  # none shows how long one takes
        planned = rounds_of(setup)
        length = planned.period(planned.most, planned.auvs)
    later = _patience(setup, length, 0.0)
    first = _patience(setup, length, scenario.navigation.initial_position_sd_m)
    if _drift(setup, duration, 0.0) <= TOLERATED_DRIFT_M:
        reason = f"{MANY_ROUNDS:g} {turns}, since dead reckoning alone drifts by less than"
    elif later > TOLERATED_ROUNDS * length:
        reason = "the time in which dead reckoning alone drifts by"
    else:
        reason = f"{TOLERATED_ROUNDS:g} {turns}, in which dead reckoning alone drifts by more than"
    return Patience(min(first, later), later, f"{reason} {TOLERATED_DRIFT_M:g} m")


def _patience(setup: Setup, length: float, initial_sd: float) -> float:
    """Return the time (s) in which the error reaches what is tolerated, or rounds' lengths (s)."""
    duration = setup.scenario.duration_s
    if _drift(setup, duration, initial_sd) <= TOLERATED_DRIFT_M:
        return MANY_ROUNDS * length
    low, high = 0.0, duration
    for _ in range(50):
        middle = (low + high) / 2
        drifted = _drift(setup, middle, initial_sd) >= TOLERATED_DRIFT_M
        low, high = (low, middle) if drifted else (middle, high)
    return max(high, TOLERATED_ROUNDS * length)


def _drift(setup: Setup, time: float, initial_sd: float) -> float:
    """Return the RMS (m) of the error after so long (s) without a fix, on a straight way; that of
    the position at first adds 2 sd^2.  A log of the way through the water misses the current.
    """
    missed = setup.missed
    speeds = zip(setup.sensors, setup.auvs, strict=True)
    drift = max(own.straight_drift_rms(time, auv.speed_m_per_s) for own, auv in speeds)
    if missed is not None:
        wandered = wandering_rms(time, missed.varies_m_per_s, missed.lasts_s)
        carried = math.hypot(missed.speed_m_per_s, missed.flow.rms_m_per_s) * time
        drift = math.hypot(drift, carried, math.sqrt(2) * wandered)
    return math.hypot(drift, math.sqrt(2) * initial_sd)


def latencies(mission: Recording) -> Floats:
    """Return from ping to delivery (s) of each delivered fix."""
    fixes = mission.fixes
    late: Floats = fixes["latency_s"][fixes["outcome"] == "delivered"].astype(np.float64)
    return late


def intervals(mission: Recording) -> Floats:
    """Return the times (s) between deliveries of all AUVs."""
    arrivals = mission.fixes["delivered_at_s"]
    own = [np.diff(arrivals[mission.delivered_to(auv)]) for auv in range(mission.auvs)]
    return np.concatenate(own).astype(np.float64)


def shown_until(values: Floats) -> float:
    """Return where a histogram (s) ends: a few values far beyond all others leave room for these.

    >>> shown_until(np.array([0.8] * 19 + [230.0])), shown_until(np.array([0.8, 0.9, 1.1]))
    (1.6, 1.1)
    """
    if not len(values):
        return 1.0
    largest = float(values.max())
    most = 2.0 * float(np.sort(values)[int(0.95 * (len(values) - 1))])
    return min(largest, most) if most > 0.0 else largest or 1.0


def spread_text(values: Floats) -> str:
    """Return mean, 95 % quantile and largest of values (s), and how many a histogram leaves out."""
    if not len(values):
        return "none"
    beyond = int(np.sum(values > shown_until(values)))
    more = f" (the last bar holds the {beyond} beyond)" if beyond else ""
    mean, most, largest = (
        f"{significant(value)} s" if value < LONG_S else timed(value)
        for value in map(float, (values.mean(), np.quantile(values, 0.95), values.max()))
    )
    return f"mean of all {mean}, 95 % below {most}, largest {largest}{more}"


def service(mission: Recording, auv: int, wait: Patience) -> Service:
    """Return how an AUV was served; gaps are waits for which it has no patience.

    The waits before the first fix and after the last count like any other: the longest of all is
    the metric `fix_age_max_s`.
    """
    waited = waits(mission, auv)
    gaps = tuple(gap for gap in waited if gap.length > (wait.first if gap.is_first else wait.later))
    sent = mission.pings["sent_at_s"]
    inside = (mission.pings["auv"] == auv) & _within(sent, gaps)
    fates = {name: int(np.sum(mission.fate[inside] == code)) for code, name in enumerate(FATES)}
    fates["refused"] = int(np.isin(mission.pings["ping"][inside], _refused(mission, auv)).sum())
    fates["delivered"] -= fates["refused"]
    unheard = mission.nearest[inside & (mission.pings["in_range_of"] == 0)]
    unheard = unheard[np.isfinite(unheard)]  # else no ASV worked
    error = mission.own["position_error_m"][auv]
    starved = _within(mission.times, gaps)
    return Service(
        auv=auv,
        gaps=gaps,
        fates=fates,
        furthest=float(unheard.max()) if len(unheard) else np.nan,
        median=float(np.median(unheard)) if len(unheard) else np.nan,
        error_in_gaps=float(error[starved].mean()) if starved.any() else np.nan,
        error_otherwise=float(error[~starved].mean()) if not starved.all() else np.nan,
    )


def _refused(mission: Recording, auv: int) -> Ints:
    """Return the pings whose fixes an AUV was told, compared with its estimate, and refused."""
    fixes = mission.fixes
    is_refused = np.isnan(fixes["correction_m"]) & ~np.isnan(fixes["innovation_m"])
    return np.asarray(fixes["ping"][is_refused & (fixes["auv"] == auv)], dtype=np.int64)


def waits(mission: Recording, auv: int) -> list[Gap]:
    """Return how long an AUV waited for each fix that it has taken, and after the last."""
    rows = mission.delivered_to(auv)
    rows = rows[~np.isnan(mission.fixes["correction_m"][rows])]
    newest = np.maximum.accumulate(mission.fixes["pinged_at_s"][rows])
    begins = (0.0, *newest.tolist())
    ends = (*mission.fixes["delivered_at_s"][rows].tolist(), mission.scenario.duration_s)
    return [Gap(*both, number == 0) for number, both in enumerate(zip(begins, ends, strict=True))]


def _within(instants: np.ndarray, gaps: tuple[Gap, ...]) -> np.ndarray:
    inside = np.zeros(len(instants), dtype=bool)
    for gap in gaps:
        inside |= ((instants > gap.start) | gap.is_first) & (instants < gap.end)
    return inside

"""When an AUV got no fixes for too long, and what became of the pings it sent meanwhile."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..dead_reckoning import drift_rms
from .recording import FATES, Recording

# An AUV starves when dead reckoning alone would have drifted this far (m) since its last fix ...
TOLERATED_DRIFT_M = 1.0
# ... but a wait of a few rounds is how the protocol works, and no gap.
TOLERATED_ROUNDS = 3.0
# Where dead reckoning never drifts that far, only a wait of many rounds is a gap.
MANY_ROUNDS = 10.0


@dataclass(frozen=True)
class Gap:
    """A time without any fix: from the fix before (or the start) to the next (or the end), in s."""

    start: float
    end: float

    @property
    def length(self) -> float:
        """Duration (s)."""
        return self.end - self.start


@dataclass(frozen=True)
class Service:
    """How one AUV was served: its gaps, and its pings in them by what became of them.

    `furthest` and `median` are distances (m) to the nearest ASV of the pings in gaps that no ASV
    could hear, nan without any; errors (m) are time means inside and outside of the gaps.
    """

    auv: int
    patience: float
    gaps: tuple[Gap, ...]
    fates: dict[str, int]
    furthest: float
    median: float
    error_in_gaps: float
    error_otherwise: float

    @property
    def starved(self) -> float:
        """Time (s) in gaps."""
        return sum(gap.length for gap in self.gaps)


def patience(mission: Recording) -> float:
    """Return after how long (s) without a fix an AUV counts as starved."""
    navigation, duration = mission.scenario.navigation, mission.scenario.duration_s
    starts = mission.rounds["started_at_s"]
    length = float(np.median(np.diff(starts))) if len(starts) > 1 else duration
    bias, walk = navigation.velocity_bias_m_per_s, navigation.random_walk_m_per_sqrt_s
    if drift_rms(duration, bias, walk) <= TOLERATED_DRIFT_M:
        return MANY_ROUNDS * length
    low, high = 0.0, duration
    for _ in range(50):
        middle = (low + high) / 2
        if drift_rms(middle, bias, walk) < TOLERATED_DRIFT_M:
            low = middle
        else:
            high = middle
    return max(high, TOLERATED_ROUNDS * length)


def service(mission: Recording, auv: int, longest_wait: float) -> Service:
    """Return how an AUV was served; gaps are waits above `longest_wait` (s)."""
    arrivals = mission.fixes["delivered_at_s"][mission.delivered_to(auv)]
    instants = [0.0, *arrivals.tolist(), mission.scenario.duration_s]
    gaps = tuple(Gap(a, b) for a, b in pairwise(instants) if b - a > longest_wait)
    sent = mission.pings["sent_at_s"]
    inside = (mission.pings["auv"] == auv) & _within(sent, gaps)
    fates = {name: int(np.sum(mission.fate[inside] == code)) for code, name in enumerate(FATES)}
    unheard = mission.nearest[inside & (mission.pings["in_range_of"] == 0)]
    error = mission.own["position_error_m"][auv]
    starved = _within(mission.times, gaps)
    return Service(
        auv=auv,
        patience=longest_wait,
        gaps=gaps,
        fates=fates,
        furthest=float(unheard.max()) if len(unheard) else np.nan,
        median=float(np.median(unheard)) if len(unheard) else np.nan,
        error_in_gaps=float(error[starved].mean()) if starved.any() else np.nan,
        error_otherwise=float(error[~starved].mean()) if not starved.all() else np.nan,
    )


def _within(instants: np.ndarray, gaps: tuple[Gap, ...]) -> np.ndarray:
    inside = np.zeros(len(instants), dtype=bool)
    for gap in gaps:
        inside |= (instants >= gap.start) & (instants < gap.end)
    return inside

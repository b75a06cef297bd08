"""The noise by which a log is navigated, as a scenario says it."""

from dataclasses import dataclass, replace
from math import hypot, inf, radians

import numpy as np

from ..navigation.belief import STATES, Belief, Growth, first_belief
from ..scenario.instruments.own_sensors import own_sensors
from ..scenario.scenario import Scenario
from ..scenario.water import assumed_sound_speed_of
from ..usbl.usbl import range_sd, sheet_of, stated_range_sd
from .sighting import Mixture

# How far off a start that was found may be, per axis (m), and its heading (rad): it was found from
# the very ranges that navigate, so they must be free to move it.
START_SD, HEADING_SD = 10.0, 0.1


@dataclass(frozen=True)
class Noise:
    """What is unsure in a log: of ranges (m), a share of outliers and their further error (m), dead
    reckoning's random walk (m/sqrt(s)) and velocity bias (m/s, ahead and to the side of y).

    `bias_sd` is what a bias may be beyond the one given (m/s), which wanders with a time constant
    `bias_lasts` (s) or, if that is infinite, is constant; the scale of the way is off by
    `scale_sd`, its heading by `heading_sd` (rad), both constant.  A sight that not even the
    variance of an outlier explains is refused: its normalised square is above `gate`; 0: none is.
    """

    range_sd: float
    outlier_share: float
    outlier_sd: float
    random_walk: float
    bias: tuple[float, float] = (0.0, 0.0)
    bias_sd: float = 0.0
    gate: float = 0.0
    start_sd: float = 0.0
    in_body: bool = True
    scale_sd: float = 0.0
    heading_sd: float = 0.0
    bias_lasts: float = inf

    def with_start_found(self) -> "Noise":
        """Return noise that leaves a start that was found free to move."""
        start_sd, heading_sd = max(self.start_sd, START_SD), max(self.heading_sd, HEADING_SD)
        return replace(self, start_sd=start_sd, heading_sd=heading_sd)

    @property
    def mixture(self) -> Mixture:
        """The noise of sights."""
        return Mixture(*map(float, (self.range_sd, self.outlier_share, self.outlier_sd, self.gate)))

    def first(self) -> Belief:
        """Return what is believed at the start."""
        constant = 0.0 if self.wanders else self.bias_sd
        ahead, aside = (hypot(bias, constant) for bias in self.bias)
        return first_belief(self.start_sd, (ahead, aside), 0.0, self._further[0])

    @property
    def wanders(self) -> bool:
        """Whether the bias beyond the one given changes with time."""
        return self.bias_sd > 0.0 and self.bias_lasts < inf

    @property
    def _further(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """The standard deviations and time constants (s) of states 6 and 7, which stretch and turn
        the way, and of 8 and 9, a bias that wanders, if it does.
        """
        sds, lasting = (self.scale_sd, self.heading_sd), (inf, inf)
        if not self.wanders:
            return sds, lasting
        return (*sds, self.bias_sd, self.bias_sd), (*lasting, self.bias_lasts, self.bias_lasts)

    def growth(self) -> Growth:
        """Return how beliefs become less sure."""
        sds, lasting = map(np.array, self._further)
        wandering = STATES + 2 if self.wanders else 0
        walk = float(self.random_walk) ** 2
        return Growth(walk, 0.0, self.in_body, STATES, wandering, sds, lasting)


def noise_of(scenario: Scenario) -> Noise:
    """Return the noise that a scenario tells AUVs of, as far as a log has any use for it."""
    navigation, usbl, sensors = scenario.navigation, scenario.usbl, own_sensors(scenario)
    speed, sheet = assumed_sound_speed_of(scenario), sheet_of(scenario)
    return Noise(
        range_sd(usbl.travel_time_sd_s, usbl.quantum_s, speed, ways=1)
        if sheet is None
        else stated_range_sd(sheet, scenario),
        usbl.outlier_share,
        usbl.outlier_sd_m if usbl.outlier_share > 0.0 else 0.0,
        sensors.random_walk_m_per_sqrt_s,
        sensors.bias_m_per_s,
        sensors.bias_sd_m_per_s,
        navigation.nis_gate or 0.0,
        navigation.initial_position_sd_m,
        navigation.bias_frame == "body",
        sensors.scale_factor_sd,
        radians(sensors.heading_sd_deg),
        inf if sensors.bias_time_constant_s is None else sensors.bias_time_constant_s,
    )

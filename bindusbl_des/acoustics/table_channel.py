"""The channel `table`: a sonar whose sound goes along bent rays."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..scenario.channel_settings import Table
from ..scenario.scenario import Scenario
from ..scenario.water import profile_of, sound_speed_of, water_of
from .channel import Prospects, Receiver, Signals
from .ray_tables import Floats, Grid, SoundTable, read_table, slant_range_m
from .ray_tracing import kept_table
from .sonar_channel import Listener, listener, reach_m
from .sonar_equation import LinkBudget, Message, link_budget

# Ranges (m) that are traced: nearer rays are straight, farther ones lose as the last.
NEAREST_M, LEAST_M, FARTHEST_M, RANGES = 5.0, 100.0, 5000.0, 40

# ASVs' transducers are traced at this depth (m), AUVs' from it to as much above the bottom, in
# steps of at most 2 m.
SHALLOWEST_M, STEP_M, MOST_DEPTHS = 0.5, 2.0, 60


@dataclass(frozen=True)
class TableChannel:
    """A sonar that asks a table what spreading takes, between true places.

    `sound_speed` (m/s) is that of straight ways, by which signals arrive in the water.
    """

    hears: Listener
    budget: LinkBudget
    table: SoundTable
    sound_speed: float

    @property
    def receiver(self) -> Receiver:
        """What decides at its receivers."""
        return self.hears.receiver(self.budget.noise_db)

    @cached_property
    def audible_m(self) -> float:
        """How far (m) signals may drown others: rays that are focused carry farther."""
        focused = min(float(self.table.beyond_db.min()), 0.0)
        return reach_m(self.budget, self.hears.faintest_db + focused)

    def prospects(self, signals: Signals) -> Prospects:
        """Return what becomes of each signal."""
        return self.hears.told(self.snr_db(signals))

    def late_s(self, signals: Signals) -> Floats:
        """Return how much later (s) each signal is there by the table than at the mean speed
        straight on (n, m); below 0: sooner.
        """
        places = _ends(signals)
        straight = slant_range_m(*places) / self.sound_speed
        return np.asarray(self.table.travel_time_s(*places) - straight)

    def snr_db(self, signals: Signals) -> Floats:
        """Return the SNR (dB) of each signal (n, m)."""
        places = _ends(signals)
        spread = self.table.loss_db(*places)
        absorbed = self.budget.absorption_db_per_km * slant_range_m(*places) / 1e3
        return np.asarray(self.budget.source_level_db - spread - absorbed - self.budget.noise_db)


def _ends(signals: Signals) -> tuple[Floats, Floats, Floats]:
    """Return how far apart (m) both ends of signals are, level, and how deep: ASVs', AUVs'."""
    apart = signals.auvs[:, None, :2] - signals.asvs[:, :2]
    return np.hypot(apart[..., 0], apart[..., 1]), signals.asvs[:, 2], signals.auvs[:, None, 2]


def table_channel(
    scenario: Scenario, settings: Table, message: Message, band_range_m: float
) -> TableChannel:
    """Return the channel of a band on which messages of one kind are sent.

    Where no threshold of SNR is given it is that of a straight way over the band's range.

    Raises:
        ValueError: when a file is no table, naming it.
        ImportError: without pelagic, where rays are to be traced.
    """
    budget = link_budget(settings, water_of(scenario))
    hears, profile = listener(settings, budget, message, band_range_m), profile_of(scenario)
    if settings.rays is None:
        reach = reach_m(budget, hears.faintest_db)
        table = kept_table(profile, grid_to(reach, settings.bottom_m), settings.bottom_m)
    else:
        table = read_table(settings.rays, profile)
    return TableChannel(hears, budget, table, sound_speed_of(scenario))


def grid_to(reach: float, bottom_m: float) -> Grid:
    """Return the places that are traced for signals that reach so far (m), to a bottom (m)."""
    farthest = min(max(reach, LEAST_M), FARTHEST_M)
    count = min(MOST_DEPTHS, int(np.ceil(bottom_m / STEP_M)) + 1)
    return Grid(
        np.geomspace(NEAREST_M, farthest, RANGES),
        np.array([SHALLOWEST_M]),
        np.linspace(SHALLOWEST_M, bottom_m - SHALLOWEST_M / 2.0, count),
    )

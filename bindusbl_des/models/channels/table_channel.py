"""The channel `table`: sound traced by BELLHOP, cached on disk under the hash of its inputs.

The tracer comes with the package pelagic (GPL-3.0-or-later), an extra that is imported only where a
table is asked for.
"""

import hashlib
import json
import os
import sys
import zipfile
from contextlib import suppress
from dataclasses import dataclass, replace
from importlib.metadata import PackageNotFoundError, version
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.acoustics.channel import Prospects, Receiver, Signals
from ...core.acoustics.sonar_channel import Listener, listener, reach_m
from ...core.acoustics.sonar_equation import LinkBudget, SoundMessage, link_budget
from ...core.acoustics.sound_settings import Table
from ...core.scenario.site import Site
from ...core.sea.water_column import Profile
from ...support.arrays import Floats
from ...support.facts import cached_property
from ...support.files import draft_of
from .ray_tables import SoundTable, TableAxes, read_table, slant_range_m, straight_time_s

MISSING = "tables of sound are traced by pelagic (GPL): pip install 'bindusbl-des[bellhop]'"

# Rays leave a source at angles up to this (deg) from level, so many of them: a 1/40 degree apart
# they meet receivers 1 km away within 0.5 m.
STEEPEST_DEG, RAYS = 89.0, 7121

# Arrivals within this time (s) are one: BELLHOP lists each ray beside a path.
ONE_ARRIVAL_S = 2e-6

# Number of a path: its surface reflections, plus MANY times its bottom reflections
MANY, NO_WAY = 1000, -1

# Fields of a table that are cached on disk
KEPT = ("longer_s", "beyond_db", "ways")

# Loss (dB) beyond spherical spreading where no ray arrives
SILENT_DB = 200.0

# The bottom is sand: speed of sound (m/s) and density (g/cm3).
SAND = 1650.0, 1.9

# Any frequency will do: BELLHOP's rays do not depend on it, and absorption is added elsewhere.
FREQUENCY_HZ = 25e3


def traced(profile: Profile, grid: TableAxes, bottom_m: float) -> SoundTable:
    """Return the table of a sea with a profile of sound speed and a flat bottom (m).

    Each pair of positions has the travel time of the ray that arrives first, and the loss of its
    kind: of rays without reflections, or if none of these arrives (a shadow), of the kind of the
    first reflected one.

    Raises:
        ImportError: without pelagic, with what to do.
        ValueError: when a depth lies below the bottom, or a range is not positive.
    """
    _check(grid, bottom_m)
    arrivals = _run(case_of(profile, grid, bottom_m))
    taken, loss, ways = _first(arrivals, grid)
    away, source, receiver = np.meshgrid(*grid, indexing="ij")
    straight = straight_time_s(profile, away, source, receiver)
    spherical = 20.0 * np.log10(slant_range_m(away, source, receiver))
    heard = np.isfinite(taken)
    longer = np.where(heard, np.where(heard, taken, 0.0) - straight, 0.0)
    beyond = np.where(heard, np.where(heard, loss, 0.0) - spherical, SILENT_DB)
    return SoundTable(profile, grid, longer, beyond, ways)


def case_of(profile: Profile, grid: TableAxes, bottom_m: float) -> dict[str, Any]:
    """Return the input of BELLHOP: pelagic's JSON case, version 2."""
    depths = np.unique(np.concatenate(([0.0, bottom_m], profile.depths_m)))
    depths = depths[depths <= bottom_m]
    speeds = profile.at(depths)
    farthest = float(grid.ranges_m[-1])
    return {
        "pelagic": 2,
        "model": "bellhop",
        "title": "table of sound",
        "frequency": FREQUENCY_HZ,
        "interpolation": "c_linear",
        "media": [{"to": bottom_m, "ssp": np.column_stack((depths, speeds)).tolist()}],
        "surface": "vacuum",
        "bottom": {"type": "halfspace", "cp": SAND[0], "rho": SAND[1]},
        "source": {"depth": grid.source_depths_m.tolist()},
        "receivers": {
            "depth": grid.receiver_depths_m.tolist(),
            "range": grid.ranges_m.tolist(),
        },
        "bellhop": {
            "run": "arrivals",
            "beam": "geometric_hat_cartesian",
            "angles": {"from": -STEEPEST_DEG, "to": STEEPEST_DEG, "count": RAYS},
            "box": {"depth": bottom_m + 1.0, "range": farthest * 1.01 + 1.0},
        },
    }


def _run(case: dict[str, Any]) -> Any:
    try:
        import pelagic
    except ImportError:
        raise ImportError(MISSING) from None
    return pelagic.bellhop.Case.from_dict(case).run().arrivals


def _check(grid: TableAxes, bottom_m: float) -> None:
    deepest = max(grid.source_depths_m[-1], grid.receiver_depths_m[-1])
    if deepest > bottom_m:
        raise ValueError(
            f"a depth of {deepest:g} m lies below the bottom at {bottom_m:g} m; give a deeper one"
        )
    if grid.ranges_m[0] <= 0.0:
        raise ValueError(f"ranges of a table must be positive; met {grid.ranges_m[0]:g} m")


def _first(arrivals: Any, grid: TableAxes) -> tuple[Floats, Floats, NDArray[np.int64]]:
    """Return travel times (s) and losses (dB) on a grid, NaN where nothing arrives; and the path's
    number: surface reflections plus MANY times bottom reflections (NO_WAY: nothing arrives).
    """
    shape = tuple(len(axis) for axis in grid)
    taken, loss, ways = np.full(shape, np.nan), np.full(shape, np.nan), np.full(shape, NO_WAY)
    bounces = np.asarray(arrivals.top_bounces) + np.asarray(arrivals.bottom_bounces)
    met = np.asarray(arrivals.top_bounces) + MANY * np.asarray(arrivals.bottom_bounces)
    per_source = np.asarray(arrivals.receiver_offset).astype(int)
    offsets = np.asarray(arrivals.arrival_offset).astype(int)
    for source, (begin, end) in enumerate(pairwise(per_source)):
        for place in range(begin, end):
            rays = slice(offsets[place], offsets[place + 1])
            if rays.start == rays.stop:
                continue
            at = (
                int(np.searchsorted(grid.ranges_m, arrivals.ranges_m[place] - 1e-6)),
                source,
                int(np.searchsorted(grid.receiver_depths_m, arrivals.depths_m[place] - 1e-6)),
            )
            found, times = bounces[rays], np.asarray(arrivals.travel_time_s[rays])
            least = found == found.min()
            ways[at] = met[rays][least][np.argmin(times[least])]
            taken[at], loss[at] = _of_one_kind(
                arrivals.travel_time_s[rays][least], arrivals.amplitude[rays][least]
            )
    return taken, loss, ways


def _of_one_kind(times: Floats, amplitudes: Floats) -> tuple[float, float]:
    """Return the first travel time (s), and the loss (dB) by the summed power of all arrivals.

    Rays on both sides of one path share its amplitude: these amplitudes add up.
    """
    order = np.argsort(times)
    times, amplitudes = times[order], np.abs(amplitudes[order])
    ways: NDArray[np.intp] = np.flatnonzero(np.diff(times, prepend=-1.0) > ONE_ARRIVAL_S)
    power = float((np.add.reduceat(amplitudes, ways) ** 2).sum())
    return float(times[0]), -10.0 * float(np.log10(power)) if power > 0.0 else np.inf


# Version of cached tables: another number has all traced again.
FORM = 2


def kept_table(profile: Profile, grid: TableAxes, bottom_m: float) -> SoundTable:
    """Return the table of :func:`traced`, from the cache if possible.

    A table that cannot be cached is traced each time, a damaged one again.  Errors are those of
    :func:`traced`.
    """
    path = cache_folder() / f"{_made_of(profile, grid, bottom_m)}.npz"
    with suppress(OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        with path.open("rb") as file, np.load(file, allow_pickle=False) as kept:
            longer, beyond, ways = kept["longer_s"], kept["beyond_db"], kept["ways"]
        if longer.shape == beyond.shape == ways.shape == tuple(map(len, grid)):
            return SoundTable(profile, grid, longer, beyond, ways)
    table = traced(profile, grid, bottom_m)
    with suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        with draft_of(path) as draft, draft.open("wb") as new:
            np.savez_compressed(new, **{name: getattr(table, name) for name in KEPT})
    return table


def cache_folder() -> Path:
    """Return the folder of the user's cache for tables."""
    if os.name == "nt":
        base = os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local"
    elif sys.platform == "darwin":
        base = Path.home() / "Library" / "Caches"
    else:
        base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "bindusbl-des" / "sound"


def _made_of(profile: Profile, grid: TableAxes, bottom_m: float) -> str:
    try:
        tracer = version("pelagic")
    except PackageNotFoundError:
        raise ImportError(MISSING) from None
    made_of = [FORM, tracer, ONE_ARRIVAL_S, SILENT_DB, case_of(profile, grid, bottom_m)]
    return hashlib.sha256(json.dumps(made_of).encode()).hexdigest()[:32]


# The channel `table`: a sonar whose sound goes along bent rays.


# Ranges (m) that are traced: nearer rays are straight, farther ones have the last one's values.
NEAREST_M, LEAST_M, FARTHEST_M, RANGES = 5.0, 100.0, 5000.0, 40

# ASVs' transducers are traced at this depth (m), AUVs' from it to as much above the bottom, in
# steps of at most 2 m.
SHALLOWEST_M, STEP_M, MOST_DEPTHS = 0.5, 2.0, 60


@dataclass(frozen=True)
class TableChannel:
    """A sonar whose travel time and spreading loss are a table's, between true positions.

    `sound_speed` (m/s) is that of straight rays, by which signals arrive in the water.
    """

    hears: Listener
    budget: LinkBudget
    table: SoundTable
    sound_speed: float

    @property
    def receiver(self) -> Receiver:
        """How its receivers tell signals from others."""
        return self.hears.receiver(self.budget.noise_db)

    @cached_property
    def audible_m(self) -> float:
        """How far (m) signals may drown others: focused rays carry farther."""
        focused = min(float(self.table.beyond_db.min()), 0.0)
        return reach_m(self.budget, self.hears.faintest_db + focused)

    @property
    def source_level_db(self) -> float:
        """The source level (dB re 1 uPa at 1 m)."""
        return self.budget.source_level_db

    def at_level(self, level_db: float) -> "TableChannel":
        """Return the channel of signals with another source level (dB)."""
        return replace(self, budget=replace(self.budget, source_level_db=level_db))

    def prospects(self, signals: Signals) -> Prospects:
        """Return the answer about each signal."""
        found = self.hears.prospects_at(self.snr_db(signals))
        found["late_s"] = self.late_s(signals)
        return found

    def late_s(self, signals: Signals) -> Floats:
        """Return how much later (s) each signal arrives by the table than on a straight ray at the
        mean speed (n, m); below 0: sooner.
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
    """Return the horizontal ranges (m) of signals, and the depths (m) of ASVs and AUVs."""
    apart = signals.auvs[:, None, :2] - signals.asvs[:, :2]
    return np.hypot(apart[..., 0], apart[..., 1]), signals.asvs[:, 2], signals.auvs[:, None, 2]


def table_channel(
    site: Site, settings: Table, message: SoundMessage, band_range_m: float
) -> TableChannel:
    """Return the channel of a band on which messages of one kind are sent.

    If no SNR threshold is given, it is that of a straight ray over the band's range.

    Raises:
        ValueError: when a file is not a table, naming it.
        ImportError: without pelagic, where rays are to be traced.
    """
    budget = link_budget(settings, site.water)
    hears, profile = listener(settings, budget, message, band_range_m), site.sound_profile
    if settings.rays is None:
        reach = reach_m(budget, hears.faintest_db)
        table = kept_table(profile, grid_to(reach, settings.bottom_m), settings.bottom_m)
    else:
        table = read_table(settings.rays, profile)
    return TableChannel(hears, budget, table, site.sound_speed_m_per_s)


def grid_to(reach: float, bottom_m: float) -> TableAxes:
    """Return the grid that is traced for signals with a reach (m), to a bottom (m)."""
    farthest = min(max(reach, LEAST_M), FARTHEST_M)
    count = min(MOST_DEPTHS, int(np.ceil(bottom_m / STEP_M)) + 1)
    return TableAxes(
        np.geomspace(NEAREST_M, farthest, RANGES),
        np.array([SHALLOWEST_M]),
        np.linspace(SHALLOWEST_M, bottom_m - SHALLOWEST_M / 2.0, count),
    )

"""A USBL's data sheet as a scenario gives it, in SI units and standard deviations."""

from math import hypot, nan, radians
from typing import cast

from ..core.spreads import per_axis_sd
from ..scenario.families import INSTRUMENT
from ..scenario.instruments.datasheet import Datasheet
from ..scenario.part_settings import settings_of
from ..scenario.scenario import Scenario
from .sheet import Sheet


def sheet_of(scenario: Scenario) -> Sheet | None:
    """Return what the data sheet of a scenario's instrument states; None if it has none.

    A stated range is that of who finds it by himself: of the path of a call and its answer he takes
    half, so that the path errs twice as much.
    """
    if scenario.usbl.model != "datasheet":
        return None
    stated = cast(Datasheet, settings_of(INSTRUMENT, scenario.usbl.model))
    if stated.bearing_sd_deg is None:
        return Sheet(
            spread_sd=per_axis_sd(stated.accuracy_m, stated.statistic),
            spread_share=per_axis_sd(stated.accuracy_percent / 100.0, stated.statistic),
        )
    bearing, elevation = stated.bearing_sd_deg, stated.elevation_sd_deg
    return Sheet(
        radians(bearing),
        radians(bearing if elevation is None else elevation),
        path_sd=_ways(scenario) * stated.range_sd_m,
        path_share=stated.range_sd_percent / 100.0,
        reference_snr_db=nan if stated.reference_snr_db is None else stated.reference_snr_db,
        angle_floor=radians(stated.angle_floor_deg),
    )


def stated_range_sd(sheet: Sheet, scenario: Scenario) -> float:
    """Return the noise (m) of a short range by a sheet, without what grows with the range."""
    return hypot(sheet.path_sd / _ways(scenario), sheet.spread_sd)


def _ways(scenario: Scenario) -> float:
    return 2.0 if scenario.protocol.ranging == "twtt" else 1.0

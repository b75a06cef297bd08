"""The currents that ship: what a current has beyond its uniform part, as a field."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from ..core.scenario.families import CurrentTraits
from ..core.scenario.key_types import Point, Real, Text, key
from ..core.scenario.part_choice import Settings
from ..core.scenario.shipped_settings import Shear

if TYPE_CHECKING:
    from ..core.scenario.site import Site
    from ..core.vehicles.currents import Field

# How far from the origin a file is read: a share of the survey's reach, and metres
BEYOND, AROUND_M = 1.2, 200.0


@CurrentTraits(settings=Shear)
def shear(site: Site, *, settings: Shear) -> Field:
    """Return a current that changes with depth alone."""
    import numpy as np

    from ..core.vehicles.currents import field

    towards = np.radians(settings.directions_deg)
    flow = np.array(settings.speeds_m_per_s) * np.array((np.cos(towards), np.sin(towards)))
    return field(axes=((0.0,), settings.depths_m, (0.0,), (0.0,)), values=flow.T)


class Tide(Settings):
    """Settings of the current `tide`."""

    speed_m_per_s: Real = key(..., "m/s", "its greatest speed", ge=0, le=10)
    direction_deg: Real = key(
        0.0, "deg", "direction it then flows to, from +x to +y", ge=-360, le=360
    )
    minor_m_per_s: Real = key(
        0.0,
        "m/s",
        "speed a quarter period later, across it: above 0 it turns from +x to +y, below 0 back",
        ge=-10,
        le=10,
    )
    period_h: Real = key(12.42, "h", "its period", "M2, 12.42 h", gt=0, le=1e4)
    peak_at_s: Real = key(
        0.0, "s", "instant of the greatest speed, before or during the mission", ge=-1e8, le=1e8
    )


@CurrentTraits(settings=Tide)
def tide(site: Site, *, settings: Tide) -> Field:
    """Return a current that turns with a tide, the same everywhere (an ellipse)."""
    import numpy as np

    from ..core.vehicles.currents import field

    towards, rate = math.radians(settings.direction_deg), math.tau / 3600.0 / settings.period_h
    main = settings.speed_m_per_s * np.array((math.cos(towards), math.sin(towards)))
    minor = settings.minor_m_per_s * np.array((-math.sin(towards), math.cos(towards)))
    cosine, sine = math.cos(rate * settings.peak_at_s), math.sin(rate * settings.peak_at_s)
    return field(tides=[(*(main * cosine - minor * sine), *(main * sine + minor * cosine), rate)])


class Vortex(Settings):
    """Settings of the current `vortex`."""

    centre_m: Point = key((0.0, 0.0), "m", "its centre [x, y]")
    radius_m: Real = key(..., "m", "distance from the centre where it is fastest", gt=0, le=1e6)
    speed_m_per_s: Real = key(
        ..., "m/s", "speed there: above 0 it turns from +x to +y, below 0 back", ge=-10, le=10
    )


@CurrentTraits(settings=Vortex)
def vortex(site: Site, *, settings: Vortex) -> Field:
    """Return an eddy: V r/R exp((1 - r^2/R^2) / 2) around its centre, at all depths."""
    from ..core.vehicles.currents import field

    return field(eddies=[(*settings.centre_m, settings.radius_m, settings.speed_m_per_s)])


class NetCdf(Settings):
    """Settings of the current `netcdf`."""

    file: Text = key(
        ..., "", "NetCDF of an ocean model (CMEMS, HYCOM, ROMS); relative to the scenario file"
    )
    start: Text | None = key(
        None, "", "instant of the file at which the mission begins (2026-06-01T08:00:00Z); null = "
        "its first",
    )  # fmt: skip


@CurrentTraits(settings=NetCdf, of_a_file=True)
def netcdf(site: Site, *, settings: NetCdf) -> Field:
    """Return the current of an ocean model around the survey."""
    from .ocean import Asked, read_currents

    where = "environment.current.file"
    if site.ground is None:
        raise ValueError(f"{where}: needs environment.origin.lat_deg and lon_deg; add them")
    corners = *site.area.outline, *site.kept_stations_m
    ends = [end for auv in site.auvs for end in auv[-2:] if end is not None]
    reach = max(math.hypot(*place) for place in (*corners, *ends))
    lasts = float(site.scenario.duration_s)
    asked = Asked(
        site.ground,
        BEYOND * reach + AROUND_M,
        site.deepest_m,
        settings.start,
        math.inf if math.isnan(lasts) else lasts,
    )
    try:
        return read_currents(settings.file, asked)
    except ValueError as error:
        raise ValueError(f"{where}: {error}") from None

"""Whether filters know how large their errors are: the figures of docs/navigation.md.

    python benchmarks/ellipses.py [--half-width 1.0] [--most 400] [CELL...]

For which share of the time the truth lies inside the 95 % ellipse of the estimate, from many
missions, each of which counts once: its instants, and its AUVs, are not independent of each other.
Missions are flown until the half-width of the 95 % interval of their mean is small enough (%), or
that many are flown.
"""

import argparse
from math import inf, log, sqrt
from statistics import fmean, stdev
from typing import Any, NamedTuple

import numpy as np

from bindusbl_des import Scenario, simulate

FILTERS = ("kalman", "smoother")

# e' P^-1 e of two dimensions is below this with 95 %.
INSIDE = -2.0 * log(0.05)

# An AUV is sure of where it starts; from then on (s) instants count.
SETTLED_S = 30.0

# One mission more or less decides nothing: so many are flown at a time, 1.96 as of the normal.
BATCH, QUANTILE = 20, 1.96

Changes = dict[str, Any]


def sheet(bearing_deg: float) -> Changes:
    """Return a USBL whose sheet states bearings and elevations like these, and 0.1 m of range."""
    model = {"model": "datasheet", "bearing_sd_deg": bearing_deg, "range_sd_m": 0.1}
    return {"usbl": {"model": model}}


def away(metres: float) -> Changes:
    """Return one ASV so far from the middle of the survey, for an hour."""
    return {
        "duration_s": 3600.0,
        "auvs": {"count": 1},
        "asvs": {"count": 1, "formation": {"positions_m": [[metres, 0.0]]}},
        "acoustics": {"hf": {"range_m": 1500}, "mf": {"range_m": 3000}, "loss": {"law": "none"}},
    }


def hold(depth_m: float, ranging: str) -> Changes:
    """Return AUVs that hover so deep about one moored ASV, and hardly drift."""
    places = [[2.6, 1.0], [5.0, -8.0], [-15.0, 3.0]]
    return {
        "duration_s": 600.0,
        "survey": {"side_m": 100, "depth_m": depth_m},
        "auvs": {"route": {"kind": "hold", "positions_m": places}},
        "asvs": {"count": 1},
        "protocol": {"ranging": ranging},
        "acoustics": {
            "hf": {"range_m": max(150.0, 2.0 * depth_m)}, "mf": {"range_m": 600},
            "loss": {"law": "none"},
        },
        "navigation": {
            "velocity_bias_m_per_s": [0.0, 0.0], "random_walk_m_per_sqrt_s": 0.005,
            "initial_position_sd_m": 1.0,
        },
    }  # fmt: skip


def start(sd_m: float) -> Changes:
    """Return AUVs that know where they start by so much along each axis."""
    return {"navigation": {"initial_position_sd_m": sd_m}}


def drift(**stated: float) -> Changes:
    """Return an inertial system by its sheet."""
    return {"navigation": {"drift": stated}}


def turnaround(seconds: float) -> Changes:
    """Return ranging by call and answer."""
    return {"protocol": {"ranging": {"model": "twtt", "turnaround_s": seconds}}}


def slow(correlation_s: float, share: float = 0.8) -> Changes:
    """Return acoustic errors of which a share of the variance lasts so long."""
    return {"usbl": {"slow_share": share, "correlation_s": correlation_s}}


def surfacing(every_s: float) -> Changes:
    """Return AUVs that come up to fix by GNSS each so many seconds."""
    route = {"kind": "lawnmower", "surface_every_s": every_s}
    return {"auvs": {"route": route}, "navigation": {"gnss_fix": {"sd_m": 2.0}}}


# The survey of `recovery_140m`, 300 s
BASE: Changes = {
    "name": "coverage",
    "duration_s": 300.0,
    "survey": {"side_m": 140, "depth_m": 10},
    "auvs": {
        "count": 3,
        "speed_m_per_s": 0.627,
        "route": {"kind": "lawnmower", "lane_spacing_m": 10, "end_margin_m": 5},
    },
    "asvs": {"count": 3},
    "acoustics": {"hf": {"range_m": 50}, "mf": {"range_m": 100}},
    "record": {"detail": "full", "tracks_hz": 0.1, "metrics_hz": 0.1},
}
MISALIGNED = {"usbl": {"misalignment_sd_deg": 3.0}}
HOUR, ONE = {"duration_s": 3600.0}, drift(percent_of_distance=1.0)
PASSIVE = {"protocol": {"ranging": "passive"}}
SILENT: Changes = {"asvs": {"formation": {"radius_m": 1e5}}}
LOST = {
    "navigation": {
        "velocity_bias_m_per_s": [0.0, 0.0],
        "velocity_bias_sd_m_per_s": 0.06,
        "initial_position_sd_m": 2.0,
        "heading_sd_deg": 3.0,
    }
}

CELLS: dict[str, tuple[Changes, ...]] = {
    "three ASVs, default drift": (),
    "three ASVs, 1 %, 1 h": (HOUR, ONE),
    "three ASVs, 0.3 %, 2 h": (drift(percent_of_distance=0.3), {"duration_s": 7200.0}),
    "three ASVs, 0.1 deg, 1 %, 1 h": (HOUR, ONE, sheet(0.1)),
    "three ASVs, 1 deg, 1 %, 1 h": (HOUR, ONE, sheet(1.0)),
    "three ASVs, 5 deg, 1 %, 1 h": (HOUR, ONE, sheet(5.0)),
    "three ASVs, 10 deg, 1 %, 1 h": (HOUR, ONE, sheet(10.0)),
    "500 m, 0.1 deg, 1 %, 1 h": (away(500.0), ONE, sheet(0.1)),
    "500 m, 1 deg, 1 %, 1 h": (away(500.0), ONE, sheet(1.0)),
    "500 m, 5 deg, 1 %, 1 h": (away(500.0), ONE, sheet(5.0)),
    "500 m, 10 deg, 1 %, 1 h": (away(500.0), ONE, sheet(10.0)),
    "500 m, 1 deg, 0.3 %, 1 h": (away(500.0), drift(percent_of_distance=0.3), sheet(1.0)),
    "500 m, 1 deg, 0.3 %, 2 h": (
        away(500.0), drift(percent_of_distance=0.3), sheet(1.0), {"duration_s": 7200.0},
    ),
    "500 m, 1 deg, 20 m/h, 1 h": (away(500.0), drift(m_per_hour=20.0), sheet(1.0)),
    "1 km, 1 deg, 1 %, 1 h": (away(1000.0), ONE, sheet(1.0)),
    "1 km, 1 deg, 20 m/h, 2 h": (
        away(1000.0), drift(m_per_hour=20.0), sheet(1.0), {"duration_s": 7200.0},
    ),
    "`twtt`, turnaround 0 s": (turnaround(0.0),),
    "`twtt`, turnaround 0.3 s": (turnaround(0.3),),
    "`twtt`, turnaround 1 s": (turnaround(1.0),),
    "`passive`": (PASSIVE,),
    "`passive`, start by 2 m and heading by 3 deg": (PASSIVE, LOST),
    "three ASVs, 1 deg, 1 %, 1 h, slow 1 s": (HOUR, ONE, sheet(1.0), slow(1.0)),
    "three ASVs, 1 deg, 1 %, 1 h, slow 60 s": (HOUR, ONE, sheet(1.0), slow(60.0)),
    "three ASVs, 1 deg, 1 %, 1 h, slow 600 s": (HOUR, ONE, sheet(1.0), slow(600.0)),
    "500 m, 1 deg, 1 %, 1 h, slow 60 s": (away(500.0), ONE, sheet(1.0), slow(60.0)),
    "500 m, 1 deg, 1 %, 1 h, slow 600 s": (away(500.0), ONE, sheet(1.0), slow(600.0)),
    "three ASVs, an array, slow 60 s": (slow(60.0),),
    "`twtt`, slow 60 s": (turnaround(0.3), slow(60.0)),
    "`twtt`, turnaround 1 s, slow 60 s": (turnaround(1.0), slow(60.0)),
    "`twtt`, turnaround 1 s, misalignment 3 deg": (turnaround(1.0), MISALIGNED),
    "`passive`, slow 60 s": (PASSIVE, slow(60.0)),
    "no ping is heard, 1 %, 1 h, GNSS each 300 s": (HOUR, ONE, SILENT, surfacing(300.0)),
    "500 m, 1 deg, 1 %, 1 h, GNSS each 300 s": (away(500.0), ONE, sheet(1.0), surfacing(300.0)),
    "`passive`, start by 2 m and heading by 3 deg, GNSS each 150 s": (
        PASSIVE, LOST, surfacing(150.0),
    ),
}  # fmt: skip


CELLS |= {
    f"hold, {depth} m below one ASV, `{ranging}`": (hold(depth, ranging),)
    for depth in (10, 80, 200)
    for ranging in ("owtt_sync", "twtt", "passive")
}
CELLS |= {
    f"500 m, 1 deg, 1 %, 1 h, slow 0.9 of 600 s, start by {metres:g} m": (
        away(500.0), ONE, sheet(1.0), slow(600.0, 0.9), start(metres),
    )
    for metres in (0.0, 2.0, 5.0, 10.0)
}  # fmt: skip


class Found(NamedTuple):
    """Shares of the time inside and their half-width (%), mean NEES, and error (m), of missions."""

    inside: float
    half_width: float
    nees: float
    error_m: float
    missions: int


def merged(base: Changes, *changes: Changes) -> Changes:
    """Return nested plain data with changes laid over it; another kind of route starts anew."""
    out = dict(base)
    for change in changes:
        for name, value in change.items():
            both = isinstance(value, dict) and isinstance(out.get(name), dict)
            both = both and value.get("kind") in (None, out[name].get("kind"))
            out[name] = merged(out[name], value) if both else value
    return out


def scenario_of(cell: str, navigator: str) -> Scenario:
    """Return the scenario of a cell with a navigator."""
    chosen = {"navigation": {"filter": navigator}}
    return Scenario.model_validate(merged(BASE, *CELLS[cell], chosen))


def flown(scenario: Scenario, seed: int) -> tuple[float, float, float]:
    """Return the share of instants at which the truth is inside, the mean NEES and error (m)."""
    rows = simulate(scenario, seed).tables["tracks"]
    rows = rows[rows.vehicle.str.startswith("AUV") & (rows.time_s > SETTLED_S)]
    x, y = rows.estimate_x_m - rows.x_m, rows.estimate_y_m - rows.y_m
    xx, yy, xy = rows.estimate_sd_x_m**2, rows.estimate_sd_y_m**2, rows.estimate_cov_xy_m2
    squares = (yy * x * x - 2.0 * xy * x * y + xx * y * y) / (xx * yy - xy * xy)
    return float((squares <= INSIDE).mean()), float(squares.mean()), float(np.hypot(x, y).mean())


def covered(scenario: Scenario, half_width: float, most: int) -> Found:
    """Fly missions until the share inside is known to a half-width (%), or so many at most."""
    found: list[tuple[float, float, float]] = []
    width = inf
    while width > half_width and len(found) < most:
        found += [flown(scenario, seed) for seed in range(len(found), len(found) + BATCH)]
        inside, nees, errors = zip(*found, strict=True)
        width = 100.0 * QUANTILE * stdev(inside) / sqrt(len(found))
    return Found(100.0 * fmean(inside), width, fmean(nees), fmean(errors), len(found))


def line(cell: str, found: dict[str, Found]) -> str:
    """Return a row of the table."""
    parts = [
        f"{it.inside:.1f} ± {it.half_width:.1f} | {it.nees:.2f} | {it.error_m:.2g}"
        for it in found.values()
    ]
    missions = ", ".join(str(it.missions) for it in found.values())
    return f"| {cell} | {' | '.join(parts)} | {missions} |"


HEAD = """| | `kalman`: inside 95 % (%) | NEES | error (m) | `smoother`: inside 95 % (%) | NEES | error (m) | missions |
|---|---|---|---|---|---|---|---|
"""  # noqa: E501


def main() -> None:
    """Print the table, row by row."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--half-width", type=float, default=1.0)
    options.add_argument("--most", type=int, default=400)
    options.add_argument("cells", nargs="*", default=list(CELLS), metavar="CELL")
    given = options.parse_args()
    print(HEAD, end="")
    for cell in given.cells:
        found = {
            navigator: covered(scenario_of(cell, navigator), given.half_width, given.most)
            for navigator in FILTERS
        }
        print(line(cell, found), flush=True)


if __name__ == "__main__":
    main()

"""Schedulers compared: what spatial reuse gains over one AUV per slot, and whether it collides."""

import json
from typing import TYPE_CHECKING

from ..claims import FAILS, HOLDS, Claimed
from ..verdicts import DIFFERS, REPRODUCED
from .measured import chosen
from .running import Runs

if TYPE_CHECKING:
    import pandas as pd

REUSE, DSATUR, ONE_PER_SLOT = "spatial_reuse", "dsatur", "one_per_slot"
STILL, MOVING = "schedulers_still", "schedulers"
DURATION_S = 300.0

# A fix more or less at the end of a mission says nothing about a schedule.
ROUNDS_OFF = 0.01

# Colourings are alike whose rates differ by less than this share.
NEARLY = 0.05


def compared(runs: Runs, campaign: str) -> "pd.DataFrame":
    """Return a row per side, number of ASVs and AUVs: rates, gains, rounds and collisions.

    Nothing is drawn by lot in these missions; what they differ in beside is the formation angle,
    over which gains have their mean, least and largest value.
    """
    import pandas as pd

    missions = runs[campaign].missions.copy()
    if "auvs.count" not in missions:
        missions["auvs.count"] = [json.loads(text)["count"] for text in missions["auvs"]]
    if "survey.side_m" not in missions:
        missions["survey.side_m"] = runs[campaign].plan.experiment.base().survey.side_m
    cells = missions.groupby(["survey.side_m", "asvs.count", "auvs.count"])
    return pd.DataFrame([_row(cell) for _, cell in cells])


def _row(cell: "pd.DataFrame") -> dict[str, float]:
    auvs = int(cell["auvs.count"].iloc[0])
    by = {
        name: chosen(cell, {"protocol.schedule": name}).set_index("asvs.formation.angle_deg")
        for name in (REUSE, DSATUR, ONE_PER_SLOT)
    }
    gain = by[REUSE].fix_rate_hz / by[ONE_PER_SLOT].fix_rate_hz
    dsatur = by[DSATUR].fix_rate_hz / by[REUSE].fix_rate_hz
    found: dict[str, float] = {
        "side_m": float(cell["survey.side_m"].iloc[0]),
        "asvs": int(cell["asvs.count"].iloc[0]),
        "auvs": auvs,
        "gain": gain.mean(),
        "gain_least": gain.min(),
        "gain_most": gain.max(),
        "dsatur_over_reuse": dsatur.mean(),
        "dsatur_least": dsatur.min(),
        "dsatur_most": dsatur.max(),
    }
    for name, rows in by.items():
        found[f"rate_{name}_hz"] = rows.fix_rate_hz.mean()
        found[f"round_{name}_s"] = (DURATION_S / rows.rounds).mean()
        found[f"collisions_{name}"] = rows.collisions.sum()
        found[f"pings_{name}"] = round(float((rows.pings * auvs).sum()))
    return found


def claims(runs: Runs) -> list[Claimed]:
    """Return what the abstract claims of spatial reuse, measured."""
    still, moving = compared(runs, STILL), compared(runs, MOVING)
    return [
        _gains(moving, "moving"),
        _gains(still, "holding still"),
        _collisions(still, "holding still"),
        _collisions(moving, "moving"),
        _dsatur(moving),
    ]


def _gains(table: "pd.DataFrame", how: str) -> Claimed:
    """Judge the gain of reuse: never below one, above it on average for every number of ASVs."""
    holds = table.gain_least.min() > 1 - ROUNDS_OFF and (
        table.groupby(["side_m", "asvs"]).gain.mean().min() > 1 + ROUNDS_OFF
    )
    shown = "; ".join(
        f"L = {side:.0f} m: "
        + ", ".join(
            f"{_span(rows.gain_least.min(), rows.gain_most.max())} with {asvs}"
            for asvs, rows in mine.groupby("asvs")
        )
        for side, mine in table.groupby("side_m")
    )
    return Claimed(
        f"spatial reuse improves the per-AUV fix rate ({how})",
        REPRODUCED if holds else DIFFERS,
        f"rate over that of one per slot, by ASVs: {shown}",
        "" if holds else "where one ASV hears all AUVs there is nothing to share",
    )


def _span(low: float, high: float) -> str:
    return f"{low:.2f}-{high:.2f}" if f"{low:.2f}" != f"{high:.2f}" else f"{low:.2f}"


def _collisions(table: "pd.DataFrame", how: str) -> Claimed:
    count, pings = int(table.collisions_spatial_reuse.sum()), int(table.pings_spatial_reuse.sum())
    return Claimed(
        f"spatial reuse keeps the no-collision constraint ({how})",
        DIFFERS if count else REPRODUCED,
        f"{count} receptions collided, {pings:,} pings",
        "AUVs move between the colouring and their slots (E18)" if count else "",
    )


def _dsatur(table: "pd.DataFrame") -> Claimed:
    low, high = table.dsatur_least.min(), table.dsatur_most.max()
    alike = low >= 1 - NEARLY and high <= 1 + NEARLY
    return Claimed(
        f"greedy colouring is within {100 * NEARLY:.0f} % of DSATUR (moving)",
        HOLDS if alike else FAILS,
        f"rate of DSATUR over greedy: {low:.3f}-{high:.3f}, {table.dsatur_over_reuse.mean():.4f} "
        "on average",
        "" if alike else "DSATUR saves a slot in some rounds",
    )

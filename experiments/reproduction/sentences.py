"""What the paper says in words of schedulers, downlinks and its results, judged."""

import json
from typing import TYPE_CHECKING

from bindusbl_des import Setup
from bindusbl_des.apps.campaigns.statistics.intervals import interval
from bindusbl_des.core.protocol.cycles import cycle
from bindusbl_des.core.protocol.slots import Slots
from bindusbl_des.core.scenario.scenario import Scenario

from .campaigns import Runs
from .measuring import READINGS
from .numbers import CANNOT_BE, DIFFERS, FAILS, HOLDS, REPRODUCED, Claimed, chosen, per_seed
from .readings import Reading

if TYPE_CHECKING:
    import pandas as pd

# Schedulers compared: what spatial reuse gains over one AUV per slot, and whether it collides.


REUSE, DSATUR, ONE_PER_SLOT = "spatial_reuse", "dsatur", "one_per_slot"
STILL, MOVING = "schedulers_still", "schedulers"
DURATION_S = 300.0

# A fix more or less at the end of a mission says nothing about a schedule.
ROUNDS_OFF = 0.01

# Colourings are alike whose rates differ by less than this share.
NEARLY = 0.05


def compared_schedulers(runs: Runs, campaign: str) -> "pd.DataFrame":
    """Return a row per side, number of ASVs and AUVs: rates, gains, rounds and collisions.

    Nothing is drawn at random in these missions; what they differ in beside is the formation angle,
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


def scheduler_claims(runs: Runs) -> list[Claimed]:
    """Return what the abstract claims of spatial reuse, measured."""
    still, moving = compared_schedulers(runs, STILL), compared_schedulers(runs, MOVING)
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


# Downlinks compared with what slots and airtime allow at best, one ASV that hears every AUV.


SEQUENTIAL, ROUND, GROUP = "sequential", "pipelined_round", "pipelined_group"
POLICIES = (SEQUENTIAL, ROUND, GROUP)

# The first round of a mission has no fixes to deliver yet, the last ends after the mission.
EDGE_ROUNDS = 2

# "... keeping end-to-end fix latency below 0.57 s across all tested configurations"
LATENCY_S = 0.57


def rate(slots: Slots, policy: str, auvs: int) -> float:
    """Return the fix rate (Hz) of each AUV when all conflict, all are heard and none is lost.

    A downlink's own round says it, of N groups and N fixes, without sound.
    """
    return 1.0 / cycle(policy, slots, auvs, auvs).length_s


def fastest(slots: Slots, auvs: int) -> float:
    """Return the fix rate (Hz) of each AUV when frames of N fixes follow without any gap."""
    return 1.0 / slots.airtime(auvs)


def shortest_latency(slots: Slots, policy: str, auvs: int) -> float:
    """Return a latency (s) that no fix can undercut: its slot is over, its frame has been sent."""
    return slots.uplink_slot + slots.airtime(1 if policy == GROUP else auvs)


def compared_downlinks(runs: Runs) -> "pd.DataFrame":
    """Return a row per side, team size and downlink: rates and latencies beside their bounds."""
    import pandas as pd

    campaign = runs["downlinks"]
    return pd.DataFrame(
        [
            _downlink_row(campaign.missions, campaign.plan.experiment.scenario(number), number)
            for number in range(len(campaign.plan.points))
        ]
    )


def _downlink_row(missions: "pd.DataFrame", scenario: Scenario, number: int) -> dict[str, object]:
    slots, auvs = Setup(scenario).slots, scenario.auvs.count
    policy = str(scenario.protocol.downlink)
    rows = chosen(missions, {"point": number})
    measured, latency = interval(list(rows.fix_rate_hz)), interval(list(rows.latency_mean_s))
    return {
        "side_m": scenario.survey.side_m,
        "auvs": auvs,
        "downlink": policy,
        "rate_hz": measured.mean,
        "rate_half_width_hz": measured.half_width,
        "expected_hz": rate(slots, policy, auvs),
        "bound_hz": fastest(slots, auvs),
        "latency_s": latency.mean,
        "latency_half_width_s": latency.half_width,
        "latency_bound_s": shortest_latency(slots, policy, auvs),
        "one_round_hz": EDGE_ROUNDS / scenario.duration_s,
    }


def downlink_claims(runs: Runs) -> list[Claimed]:
    """Return what the conclusion claims of pipelining, and whether bounds hold, measured."""
    table = compared_downlinks(runs)
    return [_as_computed(table), _within(table), _pipelined(table), _latency(table)]


def _as_computed(table: "pd.DataFrame") -> Claimed:
    gap = (table.rate_hz - table.expected_hz).abs()
    return Claimed(
        "the fix rate is that of the slots (eq. UL_slot, DL_slot)",
        HOLDS if bool((gap <= table.one_round_hz).all()) else FAILS,
        f"largest difference from the closed form {gap.max():.4f} Hz; "
        f"{EDGE_ROUNDS} rounds in 300 s are {table.one_round_hz.max():.4f} Hz",
    )


def _within(table: "pd.DataFrame") -> Claimed:
    share = table.rate_hz / table.bound_hz
    late = table.latency_s - table.latency_bound_s
    holds = bool((share <= 1).all() and (late >= 0).all())
    best = table.iloc[int(share.to_numpy().argmax())]
    return Claimed(
        "no protocol beats the bounds of the 2 kbit/s downlink",
        HOLDS if holds else FAILS,
        f"rates reach {100 * share.min():.0f} to {100 * share.max():.0f} % of the downlink's bound "
        f"({best.downlink}, L = {best.side_m:.0f} m, {best.auvs} AUVs); latencies are "
        f"{late.min():.3f} s or more above theirs",
    )


def _pipelined(table: "pd.DataFrame") -> Claimed:
    rates = table.pivot_table(index=["side_m", "auvs"], columns="downlink", values="rate_hz")
    gain = rates[ROUND] / rates[SEQUENTIAL]
    by_group = rates[GROUP] / rates[SEQUENTIAL]
    return Claimed(
        "pipelining the downlink raises the rate, at most twofold",
        HOLDS if gain.min() > 1 and gain.max() <= 2 else FAILS,
        f"by rounds {gain.min():.2f}-{gain.max():.2f} times the sequential rate, by ping groups "
        f"{by_group.min():.2f}-{by_group.max():.2f} times",
    )


def _latency(table: "pd.DataFrame") -> Claimed:
    lowest = table.groupby("downlink").latency_s.min()
    highest = table.groupby("downlink").latency_s.max()
    shown = ", ".join(
        f"{policy} {lowest[policy]:.2f}-{highest[policy]:.2f} s" for policy in POLICIES
    )
    return Claimed(
        "pipelining keeps the latency below 0.57 s in all configurations",
        REPRODUCED if min(highest) < LATENCY_S else CANNOT_BE,
        f"mean latencies: {shown}",
        "" if min(highest) < LATENCY_S else "four fixes take 0.576 s on the air alone (E24)",
    )


# What the paper says in words of its results, and whether it holds here.


# "Nearly identical" curves differ by no more than this share.
NEARLY_IDENTICAL = 0.10

SIDE, ASVS, AUVS, ANGLE = "survey.side_m", "asvs.count", "auvs.count", "asvs.formation.angle_deg"


def result_claims(runs: Runs) -> list[Claimed]:
    """Return the sentences about case study and sweep that are not single numbers."""
    sweep = runs["sweep"].missions
    return [
        _rotation(runs),
        *(_factor(runs, side, low, high) for side, low, high in ((100, 3, 6), (140, 4, 5))),
        _rate_falls(sweep),
        _same_rates(sweep),
        _collapse(sweep),
        _best_angle(sweep),
    ]


def _of(reading: Reading, runs: Runs, campaign: str) -> "pd.DataFrame":
    """Return the missions of the sweep in a reading."""
    missions = runs[campaign if reading.bias == "body" else "sweep_readings"].missions
    return missions if reading.bias == "body" else chosen(missions, reading.fusion)


def _rotation(runs: Runs) -> Claimed:
    """Judge the error of AUV0 at 0 deg over that at 30 deg."""
    found = []
    for reading in READINGS:
        means = [
            sum(values) / len(values)
            for angle in (0.0, 30.0)
            for values in [
                per_seed(
                    runs["two_asvs"].auvs,
                    reading.metric,
                    {**reading.fusion, "auv": "AUV0", ANGLE: angle},
                )
            ]
        ]
        found.append((reading.error_words, means[0] / means[1]))
    return _judged("turning two ASVs by 30 deg reduces AUV0's error 8-fold", found, 7.5, 8.5)


def _judged(sentence: str, found: list[tuple[str, float]], low: float, high: float) -> Claimed:
    holds = low <= found[0][1] <= high
    return Claimed(
        sentence,
        REPRODUCED if holds else DIFFERS,
        ", ".join(f"{value:.1f} as {name}" for name, value in found),
        "" if holds else "errors depend on the reading (E7, E8)",
    )


def _factor(runs: Runs, side: float, low: float, high: float) -> Claimed:
    """Judge the error with one ASV over that with three, over all team sizes."""
    found = []
    for reading in READINGS:
        missions = chosen(_of(reading, runs, "sweep"), {SIDE: float(side)})
        one, three = (chosen(missions, {ASVS: n})[reading.metric].mean() for n in (1, 3))
        found.append((reading.error_words, float(one / three)))
    sentence = f"at L = {side:.0f} m three ASVs have {low:.0f}-{high:.0f} times less error than one"
    return _judged(sentence, found, low - 0.5, high + 0.5)


def _rate_falls(sweep: "pd.DataFrame") -> Claimed:
    rates = sweep.pivot_table(index=[SIDE, ASVS, ANGLE], columns=AUVS, values="fix_rate_hz")
    steps = rates.diff(axis=1).iloc[:, 1:]
    rising = int((steps > 0).to_numpy().sum())
    return Claimed(
        "the fix rate per AUV falls monotonically with the team size",
        DIFFERS if rising else REPRODUCED,
        f"{rising} of {steps.size} steps from one team size to the next rise",
        "which strip an AUV gets, and so its coverage, depends on the team size" if rising else "",
    )


def _same_rates(sweep: "pd.DataFrame") -> Claimed:
    mine = chosen(sweep, {SIDE: 140.0})
    rates = mine.pivot_table(index=AUVS, columns=ASVS, values="fix_rate_hz")
    ratio = rates[3] / rates[1]
    holds = bool(((ratio - 1).abs() <= NEARLY_IDENTICAL).all())
    return Claimed(
        "fix rates are nearly identical across ASV counts (L = 140 m)",
        REPRODUCED if holds else CANNOT_BE,
        f"three ASVs give {ratio.min():.2f}-{ratio.max():.2f} times the rate of one",
        "" if holds else "Table I itself has 291 fixes with one ASV and 466 with three (E29)",
    )


def _collapse(sweep: "pd.DataFrame") -> Claimed:
    mine = chosen(sweep, {SIDE: 60.0})
    errors = mine.pivot_table(index=AUVS, columns=[ASVS, ANGLE], values="position_error_m")
    spread = errors.max(axis=1) / errors.min(axis=1)
    holds = bool((spread - 1 <= NEARLY_IDENTICAL).all())
    return Claimed(
        "at L = 60 m all curves collapse regardless of ASV count and angle",
        REPRODUCED if holds else DIFFERS,
        f"the largest mean position error is {spread.min():.1f}-{spread.max():.1f} times the "
        "smallest of the same team",
        "" if holds else "two ASVs at 50 m cover 83-89 % of the square (E30)",
    )


def _best_angle(sweep: "pd.DataFrame") -> Claimed:
    mine = chosen(sweep, {ASVS: 3, SIDE: 140.0})
    coverage = mine.groupby(ANGLE).hf_coverage.mean()
    holds = coverage.idxmax() == 0.0 and coverage.idxmin() == 90.0
    shown = ", ".join(f"{value:.3f} at {angle:.0f}" for angle, value in coverage.items())
    return Claimed(
        "of three ASVs 0 deg is the best angle, 90 deg the worst (140 m)",
        REPRODUCED if holds else DIFFERS,
        f"coverage {shown} deg",
        "" if holds else "the four are one formation up to symmetries of the square (E15)",
    )

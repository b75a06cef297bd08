"""Downlinks compared with what slots and airtime allow at best, one ASV that hears every AUV."""

from typing import TYPE_CHECKING

from ...campaigns.statistics.intervals import interval
from ...protocol.slots import Slots, slots_of
from ...scenario.scenario import Scenario
from ..claims import FAILS, HOLDS, Claimed
from ..verdicts import CANNOT_BE, REPRODUCED
from .measured import chosen
from .running import Runs

if TYPE_CHECKING:
    import pandas as pd

SEQUENTIAL, ROUND, GROUP = "sequential", "pipelined_round", "pipelined_group"
POLICIES = (SEQUENTIAL, ROUND, GROUP)

# The first round of a mission has no fixes to deliver yet, the last ends after the mission.
EDGE_ROUNDS = 2

# "... keeping end-to-end fix latency below 0.57 s across all tested configurations"
LATENCY_S = 0.57


def rate(slots: Slots, policy: str, auvs: int) -> float:
    """Return the fix rate (Hz) of each AUV when all conflict, all are heard and none is lost.

    A sequential round lasts N slots and the downlink slot of N fixes; pipelined, the longer of the
    two; by groups, each ping waits for the downlink slot of one fix.
    """
    if policy == SEQUENTIAL:
        return 1.0 / slots.round_length(auvs, auvs)
    slot = slots.clock.after(0.0, slots.uplink_slot)
    if policy == ROUND:
        return 1.0 / max(auvs * slot, slots.clock.after(0.0, slots.downlink_slot(auvs)))
    return 1.0 / (auvs * max(slot, slots.clock.after(0.0, slots.downlink_slot(1))))


def fastest(slots: Slots, auvs: int) -> float:
    """Return the fix rate (Hz) of each AUV when frames of N fixes follow without any gap."""
    return 1.0 / slots.airtime(auvs)


def shortest_latency(slots: Slots, policy: str, auvs: int) -> float:
    """Return a latency (s) that no fix can undercut: its slot is over, its frame has been sent."""
    return slots.uplink_slot + slots.airtime(1 if policy == GROUP else auvs)


def compared(runs: Runs) -> "pd.DataFrame":
    """Return a row per side, team size and downlink: rates and latencies beside their bounds."""
    import pandas as pd

    campaign = runs["downlinks"]
    return pd.DataFrame(
        [
            _row(campaign.missions, campaign.plan.experiment.scenario(number), number)
            for number in range(len(campaign.plan.points))
        ]
    )


def _row(missions: "pd.DataFrame", scenario: Scenario, number: int) -> dict[str, object]:
    slots, auvs = slots_of(scenario), scenario.auvs.count
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


def claims(runs: Runs) -> list[Claimed]:
    """Return what the conclusion claims of pipelining, and whether bounds hold, measured."""
    table = compared(runs)
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

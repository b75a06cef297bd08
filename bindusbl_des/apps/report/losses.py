"""Pings and fixes that were lost, and to what: sentences, and the numbers behind them."""

from html import escape

import numpy as np

from ...support.arrays import Floats
from ...support.wording import counted
from .recording import COLLIDED, DELIVERED, LOST, OUT_OF_MF, Metrics, Recording, works

# A reader takes in a few names; the rest is in the table.
MOST_OTHERS = 12


def lost(mission: Recording) -> tuple[str, ...]:
    """Return paragraphs of HTML about what was lost; none where nothing was."""
    broken = mission.metrics.broken
    text = [f"<b>Schedule:</b> {escape(broken)}"] if broken else []
    return (
        *_losses(mission), *_collisions(mission), *text, *_beyond_reach(mission),
        *_untold(mission.metrics), *_aground(mission.metrics),
    )  # fmt: skip


def _untold(metrics: Metrics) -> list[str]:
    """Return who did not know its slots (protocol.knowledge broadcast)."""
    missed = {row["auv"]: row["slots_missed"] for row in metrics.auvs if row["slots_missed"]}
    if not missed:
        return []
    most = sorted(missed, key=lambda auv: -missed[auv])[:MOST_OTHERS]
    named = ", ".join(f"{auv} ({missed[auv]})" for auv in most)
    slots = counted(sum(missed.values()), "slot")
    return [
        f"<b>Slots:</b> {slots} began before their AUV had decoded a frame that names it: {named}."
    ]


def _aground(metrics: Metrics) -> list[str]:
    """Return who went into the ground, which nothing stopped."""
    least = {row["auv"]: row["least_altitude_m"] for row in metrics.auvs}
    deep = {auv: -high for auv, high in least.items() if high is not None and high <= 0.0}
    if not deep:
        return []
    most = sorted(deep, key=lambda auv: -deep[auv])[:MOST_OTHERS]
    named = ", ".join(f"{auv} ({deep[auv]:.1f} m)" for auv in most)
    return [
        f"<b>Ground:</b> {counted(len(deep), 'AUV')} went into the bottom, which is not simulated: "
        f"{named}. Ask for a greater altitude, another speed or vehicle, or lanes along the slope."
    ]


def _losses(mission: Recording) -> list[str]:
    lost = int(np.sum(mission.fate == LOST))
    heard_of = int(np.sum(mission.pings["in_range_of"] > 0))
    if not heard_of or lost < 0.02 * heard_of:
        return []
    loss, passive = mission.scenario.acoustics.loss, mission.scenario.protocol.asvs_ping
    contention = ""
    if passive:
        share = 100 * lost / heard_of
        return [
            f"<b>Losses:</b> {lost} of {heard_of} receptions in range ({share:.0f} %) were not "
            "decoded by their AUV."
        ]
    shares = ", ".join(
        f"{100 * missed / sent:.0f} % with {counted(listeners, 'ASV')} in range"
        for listeners, (missed, sent) in _loss_by_listeners(mission).items()
    )
    if loss.combine != "off" and mission.auvs > 1:
        share = min(loss.contention_per_auv * (mission.auvs - 1), loss.cap)
        contention = (
            f" The scenario's contention term alone (acoustics.loss.contention_per_auv, "
            f"{mission.auvs} AUVs) is a loss of {100 * share:.3g} %."
        )
    return [
        f"<b>Losses:</b> {lost} of {heard_of} pings in range were decoded by no ASV: {shares}."
        f"{contention}"
    ]


def _collisions(mission: Recording) -> list[str]:
    hf, schedule = mission.metrics.mission["collisions"], mission.scenario.protocol.rule
    if not hf:
        return []
    met = f"<b>Collisions:</b> {counted(hf, 'reception')} on HF met another"
    if mission.scenario.protocol.asvs_ping:
        return [f"{met} at an AUV."]
    collided = int(np.sum(mission.fate == COLLIDED))
    why = f"under the schedule {escape(schedule)}"
    if mission.scenario.protocol.random_access:
        why = f"AUVs ping as they like ({escape(schedule)})"
    pings = counted(len(mission.fate), "ping")
    if not collided:
        return [f"{met}, {why}; no ping went undecoded because of that."]
    return [f"{met}, {why}; for that no ASV decoded {collided} of {pings}."]


def _beyond_reach(mission: Recording) -> list[str]:
    missed = int(np.sum(mission.fate == OUT_OF_MF))
    made = missed + int(np.sum(mission.fate == DELIVERED))
    if not missed:
        return []
    met, text = int(np.sum(mission.fixes["outcome"] == "collided")), []
    if met:
        other = "frame" if mission.scenario.protocol.duplex == "per_band" else "frame, or its ping,"
        text.append(
            f"<b>Frames that met:</b> {met} of {made} fixes ({100 * met / made:.0f} %) were in "
            f"frames that another {other} overlapped at their AUV."
        )
    if behind := int(np.sum(mission.fixes["outcome"] == "blocked")):
        text.append(
            f"<b>Land:</b> {behind} of {made} fixes ({100 * behind / made:.0f} %) were broadcast "
            "by an ASV that land hides from their AUV."
        )
    missed -= met + behind
    if not missed:
        return text
    if not mission.scenario.acoustics.mf.traits.ends_at_range:
        return [
            *text,
            f"<b>Downlink:</b> {missed} of {made} fixes ({100 * missed / made:.0f} %) were in "
            f"frames that their AUV did not decode (acoustics.mf.channel: "
            f"{escape(mission.scenario.acoustics.mf.channel)}).",
        ]
    away, nearest = broadcast_distances(mission)
    reach, cut = mission.scenario.acoustics.mf.range_m, missed - len(away)
    if cut:  # of the disc, only a failure loses frames that nothing met
        why = "on the air as their ASV failed"
        if (limit := mission.scenario.acoustics.mf.doppler_limit_m_per_s) is not None:
            why += f", or over ways that changed faster than {limit:g} m/s (doppler_limit_m_per_s)"
        text.append(f"<b>Downlink:</b> {cut} of {made} fixes were {why}.")
    if not len(away):
        return text
    missed = len(away)
    return [
        *text,
        f"<b>Downlink:</b> {missed} of {made} fixes ({100 * missed / made:.0f} %) were broadcast "
        f"beyond MF range ({reach:g} m) of their AUV, up to {away.max():.0f} m away; "
        f"{int(np.sum(nearest <= reach))} of them were within range of another ASV.",
    ]


def broadcast_distances(mission: Recording) -> tuple[Floats, Floats]:
    """Return of fixes beyond MF range how far (m) broadcaster and nearest working ASV were."""
    fixes = mission.fixes
    rows = np.flatnonzero(fixes["outcome"] == "out_of_range")
    times = fixes["broadcast_at_s"][rows]
    column = np.clip(np.searchsorted(mission.times, times), 0, len(mission.times) - 1)
    x, y = mission.truth["x_m"][:, column], mission.truth["y_m"][:, column]
    auv, every = fixes["auv"][rows], np.arange(len(rows))
    away = np.hypot(x[mission.auvs :] - x[auv, every], y[mission.auvs :] - y[auv, every])
    if mission.scenario.acoustics.mf.range_metric == "slant":
        away = np.hypot(away, mission.truth["z_m"][auv, column])  # ASVs float at the surface
    sent_from = away[fixes["broadcast_by"][rows], every]
    away[~works(mission.setup, np.arange(len(away))[:, None], times)] = np.inf
    return sent_from, away.min(axis=0)


def _loss_by_listeners(mission: Recording) -> dict[int, tuple[int, int]]:
    """Return, by how many ASVs were in range of a ping, how many were lost, of how many."""
    pings = mission.pings
    return {
        int(listeners): (
            int(np.sum((pings["in_range_of"] == listeners) & (mission.fate == LOST))),
            int(np.sum(pings["in_range_of"] == listeners)),
        )
        for listeners in np.unique(pings["in_range_of"])
        if listeners > 0
    }

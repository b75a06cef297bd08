"""What a channel other than the disc makes of a ping, in words: its level, margin and chance."""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..acoustics.channel import AskedChannel, Signals
from ..acoustics.named_channels import echoing, hf_channel
from ..core.plugins import is_plugin
from ..scenario.declared import channel_named
from .lasting import ping_lasting

if TYPE_CHECKING:
    from ..results.result import Result
    from ..scenario.scenario import Scenario

LEVELS = ("snr_db", "level_db", "margin_db")


def levels(reception: Any) -> dict[str, float]:
    """Return the levels (dB) of a reception, nothing where the channel knows of none."""
    found = {name: getattr(reception, name) for name in LEVELS}
    return {} if any(map(_missing, found.values())) else found


def audible(result: "Result", receptions: Any) -> NDArray[np.bool_]:
    """Tell which receptions are sounds that may drown others, decoded or not."""
    heard = (receptions.outcome != "out_of_range").to_numpy()
    channel = None
    if not is_plugin(result.scenario.acoustics.hf.channel):
        channel = hf_channel(result.scenario)
    if channel is None or channel.audible_m is None:
        return np.asarray(heard)
    return np.asarray(heard | (receptions.slant_range_m <= channel.audible_m).to_numpy())


def decided_by_channel(result: "Result", reception: Any, others: list[str]) -> tuple[str, str]:
    """Return what becomes of a ping by a curve or by its SNR, and why; `others` overlap it."""
    scenario, outcome = result.scenario, reception.outcome
    level, chance = _level(scenario, reception), _chance(scenario, reception)
    overlap = f"overlaps {', '.join(others)}" if others else "no other ping overlaps"
    if outcome == "collided" and not others:
        overlap = "overlaps the echo of another ping"
    if outcome == "out_of_range":
        return "cannot decode it", level or chance
    if outcome == "in_flight":
        ends = reception.arrived_at_s + scenario.acoustics.hf.ping_s
        return "would hear it, but the mission ends", (
            f"the ping ends at {ends:.4f} s, the mission at {scenario.duration_s:g} s; {chance}"
        )
    if outcome == "collided":
        return "hears pings mixed", "; ".join(filter(None, [level, overlap, _capture(scenario)]))
    survived = [overlap, _capture(scenario)] if others else [overlap]
    if outcome == "lost":
        drawn = "" if level else ", and the draw (not recorded) was below"
        loss = loss_by_channel(scenario, float(reception.slant_range_m))
        lasts = ping_lasting(result, reception, loss)
        return "loses it", "; ".join(filter(None, [level, *survived, f"{chance}{drawn}", lasts]))
    return "decodes it", "; ".join(filter(None, [level, *survived, chance]))


def loss_by_channel(scenario: "Scenario", slant_range_m: float) -> float:
    """Return the probability that a ping is lost over a range (m) if nothing overlaps it."""
    return float(_asked(scenario).prospects(_one_signal(scenario, slant_range_m))["loss"][0, 0])


def _level(scenario: "Scenario", reception: Any) -> str:
    """Tell how loud a ping arrived, "" where the channel knows of no levels."""
    found = levels(reception)
    if not found:
        return ""
    margin = found["margin_db"]
    needed = found["snr_db"] - margin
    side = "above" if margin >= 0.0 else "below"
    return (
        f"heard at {found['snr_db']:.1f} dB over the noise, {abs(margin):.1f} dB {side} the "
        f"{needed:.1f} dB at which half of all pings are decoded"
    )


def _chance(scenario: "Scenario", reception: Any) -> str:
    """Tell how likely a ping was lost on its way."""
    channel, away = scenario.acoustics.hf.channel, float(reception.slant_range_m)
    loss = loss_by_channel(scenario, away)
    if not channel_named(channel).has_levels:
        name = Path(channel.settings["file"]).name
        return f"loss probability {loss:.3f} by the curve {name} at {away:.1f} m"
    spread = _asked(scenario).receiver.shadowing_sd_db
    if echoing(scenario):
        return f"{spread:g} dB of shadowing about the level that echoes leave"
    return f"loss probability {loss:.3f}, with {spread:g} dB of shadowing about the level expected"


def _capture(scenario: "Scenario") -> str:
    capture = _asked(scenario).receiver.capture
    if math.isinf(capture):
        return ""
    return f"what is {10 * math.log10(capture):g} dB above noise and others together survives"


def _asked(scenario: "Scenario") -> AskedChannel:
    channel = hf_channel(scenario)
    assert channel is not None
    return channel


def _one_signal(scenario: "Scenario", slant_range_m: float) -> Signals:
    below = min(scenario.survey.deepest, slant_range_m)
    auv = np.array([[math.sqrt(slant_range_m**2 - below**2), 0.0, below]])
    ranges, asv = np.array([[slant_range_m]]), np.zeros((1, 3))
    return Signals(0.0, auv, asv, ranges, scenario.acoustics.hf.range_m, calling=False)


def _missing(value: Any) -> bool:
    return value is None or math.isnan(value)

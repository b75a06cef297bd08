"""Scenarios drawn for the verifier: small fleets under every protocol it knows, and bounds."""

import random
from typing import Any

Data = dict[str, Any]


def drawn_case(seed: int) -> tuple[Data, dict[str, float]]:
    """Return the plain data of a scenario and the bounds that it is to hold for."""
    draw = random.Random(seed)
    reach, asvs = draw.uniform(20.0, 80.0), draw.randint(1, 4)
    apart = draw.choice((0.3, 0.8, 1.2, 2.5)) * reach
    ranging = draw.choice(("owtt_sync", "owtt_sync", "twtt", "passive"))
    slant = draw.random() < 0.3
    depth = draw.choice((0.0, 5.0, 0.4 * reach))
    guard = draw.choice((None, 0.0, 0.001, 0.02))
    data: Data = {
        "name": f"case {seed}",
        "duration_s": 60.0,
        "survey": {"side_m": 140.0, "depth_m": depth},
        "auvs": {"count": draw.randint(1, 6), "speed_m_per_s": draw.choice((0.3, 1.0, 3.0))},
        "asvs": {
            "count": asvs,
            "formation": {
                "positions_m": [
                    [apart * k + draw.uniform(-3, 3), draw.uniform(-5.0, 5.0)] for k in range(asvs)
                ]
            },
        },
        "acoustics": {
            "hf": {
                "range_m": reach,
                "range_metric": "slant" if slant else "horizontal",
                "ping_s": draw.choice((0.002, 0.01, 0.03)),
            },
            "mf": {
                "range_m": draw.choice((60.0, 100.0, 300.0)),
                "range_metric": draw.choice(("horizontal", "slant")),
            },
        },
        "protocol": {
            "schedule": draw.choice(
                ("spatial_reuse", "worst_first", "dsatur", "one_per_slot", "round_robin")
            ),
            "downlink": draw.choice(
                ("sequential", "pipelined_round", "pipelined_group", "direct_reply")
            ),
            "ranging": {"model": ranging, "turnaround_s": draw.choice((0.0, 0.02))}
            if ranging == "twtt"
            else ranging,
            "frame_s": draw.choice((0.3, 2.5)),
            "uplink_guard_s": guard,
            "shortest_uplink_slot_s": None if guard is None else 0.0,
            "downlink_guard_s": draw.choice((None, 0.0)),
            "shortest_downlink_slot_s": draw.choice((None, 0.0)),
            "tick_rate_hz": draw.choice((None, None, 30.0)),
            "conflict_margin_m": draw.choice((0.0, 0.0, 0.5)),
        },
    }
    bounds = {
        "clock_error": draw.choice((0.0, 0.001, 0.02)),
        "sound_speed_error": draw.choice((0.0, 5.0, 30.0)),
    }
    return data, bounds

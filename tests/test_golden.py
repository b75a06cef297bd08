"""Tiny missions whose every row is in git: a change of any number is seen and meant.

After a change that is meant: ``BINDUSBL_GOLDEN=write ./scripts/test tests/test_golden.py``.
"""

import os
from pathlib import Path

import pandas as pd
import pytest
from worlds import merged, scenario

from bindusbl_des import simulate

GOLDEN = Path(__file__).parent / "golden"
MISSIONS = {
    "paper_clock": {
        "duration_s": 6.0,
        "acoustics": {"loss": {"combine": "clamp_first"}},
        "protocol": {"tick_rate_hz": 30.0},
    },
    "exact_clock": {"duration_s": 4.0, "protocol": {"downlink": "pipelined_group"}},
    "direct": {
        "duration_s": 5.0,
        "protocol": {
            "downlink": {"model": "direct_reply", "reply": "instant"},
            "schedule": "round_robin",
            "ranging": "twtt",
        },
    },
    "passive": {"duration_s": 1.0, "protocol": {"ranging": "passive"}},
}
BASE = {
    "survey": {"side_m": 60.0},
    "auvs": {
        "count": 2,
        "speed_m_per_s": 1.0,
        "vehicle": {"model": "kinematic", "turning_radius_m": 2.0},
    },
    "asvs": {"count": 2, "formation": {"radius_m": 15.0}},
    "navigation": {"filter": "fixed_gain"},
    "record": {"tracks_hz": 1.0},
}


@pytest.mark.parametrize("mission", MISSIONS)
@pytest.mark.parametrize("table", ["rounds", "receptions", "frame_receptions", "fixes", "tracks"])
def test_tiny_mission(mission: str, table: str) -> None:
    """Every row of a tiny mission is what it was."""
    found = simulate(scenario(**merged(BASE, MISSIONS[mission])), 1).tables[table]
    path = GOLDEN / f"{mission}.{table}.csv"
    if os.environ.get("BINDUSBL_GOLDEN") == "write":
        found.to_csv(path, index=False, float_format="%.9g")
    expected = pd.read_csv(path)
    assert list(found.columns) == list(expected.columns)
    for name in found.columns:
        if expected[name].dtype.kind in "fi":
            # another processor may round the last digits of sines differently
            assert found[name].to_numpy(float) == pytest.approx(
                expected[name].to_numpy(float), rel=1e-6, abs=1e-7, nan_ok=True
            )
        else:
            assert found[name].fillna("").tolist() == expected[name].fillna("").tolist()

"""How far off a fix may be: no drawn fix is farther."""

import math
from typing import Any

import numpy as np
import pytest

from bindusbl_des import Scenario, Setup
from bindusbl_des.apps.verification.bounds import Beside, farthest_off


@pytest.mark.parametrize(
    "usbl",
    [
        {}, {"preset": "cerulean_rovl"}, {"preset": "seatrac_x150"}, {"gnss_sd_m": 1.0},
        {"array": "cross5", "tdoa_sd_s": 1e-5}, {"quantum_s": 1e-5},
        {"tdoa_sd_s": 0.0, "heading_sd_deg": 0.0, "roll_sd_deg": 0.0, "pitch_sd_deg": 0.0},
    ],
)  # fmt: skip
@pytest.mark.parametrize("assumed", [1500.0, 1440.0])
def test_no_fix_is_farther_off_than_its_bound(usbl: dict[str, Any], assumed: float) -> None:
    """With all of a fix's noise in z, from anywhere in range; and the bound is no idle one."""
    water = {"sound_speed_m_per_s": 1500.0, "assumed_sound_speed_m_per_s": assumed}
    scenario = Scenario.model_validate({"name": "bound", "usbl": usbl, "environment": water})
    instrument, draw = Setup(scenario).usbl, np.random.default_rng(0)
    beside, shares = Beside(sound_speed_error=abs(1500.0 - assumed)), []
    for _ in range(1500):
        reach, noise = draw.uniform(0.05, 50.0), draw.choice((0.3, 1.0, 2.0)) * draw.normal(size=12)
        where = draw.normal(size=3)
        where *= reach / np.linalg.norm(where)
        fix, _ = instrument.locate(where, np.zeros(3), draw.uniform(0, 6), reach / 1500.0, noise)
        bound = farthest_off(instrument, reach, reach, beside, float(np.linalg.norm(noise)))
        shares.append(math.hypot(*(fix - where)[:2]) / bound)
    assert 0.02 < max(shares) <= 1.0

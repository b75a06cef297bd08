"""How far predictions are from simulations, as measured (docs/planning.md, Predicted error)."""

from typing import NamedTuple


class Off(NamedTuple):
    """How far a prediction is off, as a share of what is simulated: of half of all plans less than
    `median`, of nine tenths less than `p90`, of 99 in a hundred less than `p99`.
    """

    median: float
    p90: float
    p99: float


# Of the worst AUV: the mean over missions against Prediction.worst, over plans drawn at random
# (tests/predicted_for_tests.py).
STATED_ERROR = {
    "position_error_m": Off(0.070, 0.450, 1.216),
    "position_error_rms_m": Off(0.073, 0.414, 1.540),
    "position_error_p95_m": Off(0.094, 0.520, 1.980),
    "fix_rate_hz": Off(0.002, 0.161, 1.048),
    "fix_age_mean_s": Off(0.004, 0.214, 2.901),
    "fix_age_p95_s": Off(0.002, 0.352, 3.600),
    "fix_age_max_s": Off(0.018, 0.477, 2.925),
    "hf_coverage": Off(0.000, 0.126, 2.818),
}

"""How far predictions are from simulations, as measured (docs/planning.md, Predicted error)."""

from typing import NamedTuple


class Off(NamedTuple):
    """How far predictions are off, as a share of what is simulated, or of what is predicted if that
    is less: of half of all plans less than `median`, of nine tenths less than `p90`, of 99 in a
    hundred less than `p99`.
    """

    median: float
    p90: float
    p99: float


# Of the worst AUV: Prediction.worst against the mean over four missions, of 520 plans drawn at
# random (tests/predicted_for_tests.py), but for those where either of the two is 0.
STATED_ERROR = {
    "position_error_m": Off(0.063, 0.351, 1.093),
    "position_error_rms_m": Off(0.069, 0.398, 1.664),
    "position_error_p95_m": Off(0.094, 0.516, 2.311),
    "fix_rate_hz": Off(0.002, 0.161, 1.048),
    "fix_age_mean_s": Off(0.004, 0.220, 2.861),
    "fix_age_p95_s": Off(0.002, 0.325, 3.600),
    "fix_age_max_s": Off(0.017, 0.456, 2.908),
    "hf_coverage": Off(0.000, 0.015, 0.086),
}

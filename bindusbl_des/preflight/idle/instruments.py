"""Keys of instruments and navigation that do nothing in a mode; see :mod:`.keys`."""

from ...scenario.sections.usbl import Usbl
from .rule import OWN, Idle

# Files from before filters weighed by default have keys that belong to the paper's gain.
FIXED = "remove it, or set navigation.filter: fixed_gain"

CLOCKS = ("navigation.clock_offset_sd_s", "navigation.clock_drift_sd")

# Vessels keep their stations by GNSS, too.
BESIDES = ("preset", "model", "gnss_sd_m", "gnss_correlated_sd_m", "gnss_time_constant_s")
ARRAY = tuple(f"usbl.{name}" for name in Usbl.model_fields if name not in BESIDES)

INSTRUMENTS = (
    Idle(
        {"auvs.route.kind": ("hold",), "navigation.heading_sd_deg": (0.0,)},
        ("navigation.bias_frame",),
        "AUVs that hold still head along +x, so that both frames are one",
    ),
    Idle(
        {"navigation.velocity_bias_sd_m_per_s": (0.0,)},
        ("navigation.velocity_bias_time_constant_s",),
        "no velocity bias is drawn, the constant one does not wander",
    ),
    Idle(
        {"protocol.ranging": ("twtt",)},
        CLOCKS,
        "AUVs answer calls, whatever their clocks say",
    ),
    Idle(
        {"usbl.gnss_correlated_sd_m": (0.0,)},
        ("usbl.gnss_time_constant_s",),
        "GNSS has no slow error",
    ),
    Idle({"usbl.outlier_share": (0.0,)}, ("usbl.outlier_sd_m",), "there are no outliers"),
    Idle(
        {"usbl.model": ("datasheet",)},
        tuple(f"usbl.{name}" for name in ("array", "tdoa_sd_s", "travel_time_sd_s", "quantum_s")),
        "the sheet says what all of them make together",
        remedy="remove it, or set usbl.model: array",
    ),
    Idle({"usbl.model": OWN}, ARRAY + CLOCKS, "how well fixes are measured only the plug-in says"),
    Idle(
        {
            "environment.current_m_per_s": (0.0,),
            "environment.current_variation_m_per_s": (0.0,),
            "auvs.feedback": ("truth",),
        },
        ("navigation.velocity",),
        "through still water is over ground",
    ),
    Idle(
        {"navigation.filter": ("kalman", "smoother")},
        ("navigation.gain",),
        "each fix is weighed by its covariance",
        remedy=FIXED,
    ),
    Idle(
        {"navigation.filter": ("dead_reckoning",)},
        ("navigation.gain",),
        "no fix is taken in",
        remedy=FIXED,
    ),
    Idle(
        {"navigation.filter": ("kalman", "smoother")},
        ("navigation.delay_compensation",),
        "a fix always speaks of the instant at which it holds",
        remedy=FIXED,
    ),
    Idle(
        {"navigation.filter": ("fixed_gain", "dead_reckoning")},
        ("navigation.nis_gate",),
        "only a filter that weighs refuses fixes",
    ),
    Idle(
        {
            "navigation.velocity_bias_m_per_s": ((0.0, 0.0),),
            "navigation.velocity_bias_sd_m_per_s": (0.0,),
            "navigation.drift.m_per_hour": (None,),
            "navigation.drift.line_m": (None,),
        },
        ("navigation.bias_frame",),
        "there is no bias",
    ),
    Idle(
        {
            "navigation.drift.percent_of_distance": (None,),
            "navigation.drift.m_per_hour": (None,),
        },
        tuple(f"navigation.drift.{name}" for name in ("statistic", "line_m", "time_constant_s")),
        "no drift is stated",
        remedy="remove it, or set navigation.drift.percent_of_distance or m_per_hour",
    ),
    Idle(
        {"navigation.drift.line_m": (None,)},
        ("navigation.drift.time_constant_s",),
        "the drift holds at any distance, its errors do not wander",
        remedy="remove it, or set navigation.drift.line_m",
    ),
)

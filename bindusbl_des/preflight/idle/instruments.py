"""Keys of instruments and navigation that do nothing in a mode; see :mod:`.keys`."""

from ...scenario.instruments.own_sensors import wanders_over_m
from ...scenario.scenario import Scenario
from ...scenario.sections.usbl import Usbl
from .rule import GIVEN, OWN, Idle

CLOCKS = ("navigation.clock_offset_sd_s", "navigation.clock_drift_sd")

# Vessels keep their stations by GNSS, too.
BESIDES = ("preset", "model", "gnss_sd_m", "gnss_correlated_sd_m", "gnss_time_constant_s")
ARRAY = tuple(f"usbl.{name}" for name in Usbl.model_fields if name not in BESIDES)


def wanders(scenario: Scenario) -> bool:
    """Tell whether the errors of a sheet of drift wander, as biases that have a frame."""
    return wanders_over_m(scenario) is not None


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
        {"navigation.filter": ("fixed_gain", "dead_reckoning")},
        ("navigation.nis_gate",),
        "only a filter that weighs refuses fixes",
    ),
    Idle(
        {
            "navigation.velocity_bias_m_per_s": ((0.0, 0.0),),
            "navigation.velocity_bias_sd_m_per_s": (0.0,),
            "navigation.drift.m_per_hour": (None,),
        },
        ("navigation.bias_frame",),
        "there is no bias",
        but=wanders,
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
    *(
        Idle(
            mode, ("navigation.drift.line_m", "navigation.drift.time_constant_s"), why, but=wanders
        )
        for mode, why in (
            (
                {"auvs.route.kind": ("hold", "track")},
                "no speed is planned at which they would wander, the drift's errors are constant",
            ),
            (
                {"protocol.ranging": ("passive",)},
                "the error of the heading turns the array as well, and is constant",
            ),
            (
                {"auvs.speeds_m_per_s": GIVEN},
                "AUVs that differ in speed have constant errors of scale and heading",
            ),
        )
    ),
    Idle(
        {"navigation.drift.line_m": (None,)},
        ("navigation.drift.time_constant_s",),
        "the drift's errors are constant",
        remedy="remove it, or set navigation.drift.line_m",
    ),
)

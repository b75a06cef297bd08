"""In which mode of a scenario which keys do nothing, and why; each rule was found by experiment."""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from ..core.plugins import is_plugin
from ..scenario.consistency import FRAMED_SCHEDULES
from ..scenario.families import SCHEDULES
from ..scenario.places.on_earth import lacks_depths
from ..scenario.scenario import Scenario
from ..scenario.sections.usbl import Usbl
from ..scenario.vehicle_choice import WITHOUT_DYNAMICS, AuvVehicle

UNFRAMED = tuple(name for name in SCHEDULES if name not in FRAMED_SCHEDULES)
WITH_DYNAMICS = tuple(name for name in AuvVehicle.MODELS if name not in WITHOUT_DYNAMICS)
BROADCASTS = (
    "acoustics.mf.range_m", "acoustics.mf.channel", "acoustics.mf.bit_rate_bps",
    "acoustics.mf.overhead", "acoustics.mf.header_bytes", "acoustics.mf.fix_bytes",
    "protocol.broadcaster",
    "acoustics.mf.airtimes", "acoustics.mf.processing_s", "acoustics.mf.payload_bytes",
    "acoustics.mf.overfull", "acoustics.mf.modem", "acoustics.mf.transmit_w",
    "acoustics.mf.receive_w", "acoustics.mf.idle_w",
    "protocol.downlink_guard_s", "protocol.shortest_downlink_slot_s",
)  # fmt: skip
# Files from before filters weighed by default have keys that belong to the paper's gain.
FIXED = "remove it, or set navigation.filter: fixed_gain"
STEERING = tuple(
    f"auvs.{name}"
    for name in (
        "turning_radius_m", "join_angle_deg", "launch_m", "recovery_m",
    )
)  # fmt: skip


CLOCKS = ("navigation.clock_offset_sd_s", "navigation.clock_drift_sd")

# Vessels keep their stations by GNSS, too.
BESIDES = ("preset", "model", "gnss_sd_m", "gnss_correlated_sd_m", "gnss_time_constant_s")
ARRAY = tuple(f"usbl.{name}" for name in Usbl.model_fields if name not in BESIDES)


class _Own(tuple[str, ...]):
    """The names of all parts of somebody's own."""

    def __contains__(self, name: object) -> bool:
        return isinstance(name, str) and is_plugin(name)


class _Given(tuple[str, ...]):
    """Whatever somebody may give at a key that is null if nobody does."""

    def __contains__(self, value: object) -> bool:
        return value is not None


OWN, GIVEN = _Own(), _Given()


class Idle(NamedTuple):
    """Keys without effect where other keys have one of these values, why, and what to do.

    `but` tells of a scenario whether they have one all the same.
    """

    mode: Mapping[str, tuple[Any, ...]]
    keys: tuple[str, ...]
    why: str
    effect: str = "has no effect"
    remedy: str = "remove it"
    but: Callable[[Scenario], bool] = lambda _: False


RULES = (
    Idle(
        {"protocol.ranging": ("passive",)},
        (
            *BROADCASTS,
            *(f"protocol.{name}" for name in ("schedule", "downlink", "positions", "frame_s")),
            *("protocol.reply_at", "protocol.turnaround_s"),
        ),
        "ASVs ping in turn and AUVs fix themselves; nobody calls, answers or broadcasts",
    ),
    Idle(
        {"protocol.ranging": ("passive",)},
        ("acoustics.loss.contention_per_auv", "acoustics.loss.combine"),
        "no AUV pings, so none contends",
    ),
    Idle(
        {"protocol.downlink": ("direct_reply",)},
        BROADCASTS,
        "the ASV that hears a ping first answers it at once, nothing is broadcast",
    ),
    Idle(
        {"protocol.downlink": ("sequential", "pipelined_round", "pipelined_group")},
        ("protocol.reply_at",),
        "no ping is answered at once, fixes are broadcast",
    ),
    Idle({"auvs.route.kind": ("hold",)}, STEERING, "the AUVs lie still"),
    Idle({"auvs.route.kind": ("track",)}, STEERING, "the AUVs repeat their tracks"),
    Idle(
        {
            "auvs.route.kind": ("track",),
            "environment.temperature_c": (None,),
            "environment.ctd": (None,),
        },
        ("survey.depth_m", "survey.depths_m"),
        "the tracks say how deep they are",
        but=lacks_depths,
    ),
    Idle(
        {"auvs.route.kind": ("hold", "waypoints", "track")},
        ("survey.rotation_deg",),
        "the AUVs go where their route says, whichever way the survey is turned",
        "changes only what counts as survey",
    ),
    Idle({"survey.depths_m": GIVEN}, ("survey.depth_m",), "each AUV has a depth of its own"),
    Idle({"auvs.speeds_m_per_s": GIVEN}, ("auvs.speed_m_per_s",), "each AUV has its own speed"),
    Idle({"auvs.launch_m": GIVEN}, ("auvs.route.start",), "the AUVs begin where they are launched"),
    Idle(
        {"auvs.route.kind": ("hold", "track"), "navigation.drift.line_m": (None,)},
        ("auvs.speed_m_per_s", "auvs.speeds_m_per_s"),
        "the AUVs lie still, or repeat their tracks",
    ),
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
        {"auvs.vehicle": WITH_DYNAMICS},
        ("auvs.turning_radius_m",),
        "the model's own turning radius is planned with",
    ),
    Idle(
        {"protocol.ranging": ("owtt_sync",)},
        ("protocol.turnaround_s",),
        "AUVs ping on their own clocks, without being called",
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
        {"protocol.schedule": UNFRAMED},
        ("protocol.frame_s",),
        "a round begins as soon as the one before it has ended",
    ),
    Idle(
        {
            "protocol.schedule": ("one_per_slot", *FRAMED_SCHEDULES),
            "protocol.ranging": ("owtt_sync",),
        },
        ("protocol.positions",),
        "an AUV has its slot to itself wherever it is believed to be",
        "changes only the conflicts that are counted in `rounds`",
    ),
    Idle(
        {"acoustics.mf.airtimes": GIVEN},
        ("acoustics.mf.bit_rate_bps", "acoustics.mf.overhead"),
        "airtimes are those of the table",
    ),
    Idle(
        {"acoustics.mf.payload_bytes": (None,), "acoustics.mf.airtimes": (None,)},
        ("acoustics.mf.overfull",),
        "a message holds any number of fixes",
    ),
    *(
        Idle(
            mode,
            ("acoustics.mf.payload_bytes", "acoustics.mf.overfull"),
            "no broadcast has more than one fix",
        )
        for mode in ({"protocol.schedule": FRAMED_SCHEDULES}, {"auvs.count": (1,)})
    ),
    *(
        Idle(
            {f"acoustics.{band}.transmit_w": (None,)},
            (f"acoustics.{band}.receive_w", f"acoustics.{band}.idle_w"),
            "the energy of this band is told where all its powers are known",
        )
        for band in ("hf", "mf")
    ),
    Idle(
        {"acoustics.hf.channel": OWN},
        tuple(f"acoustics.loss.{name}" for name in ("law", "combine", "contention_per_auv", "cap")),
        "how likely signals are lost only the plug-in says",
    ),
    Idle(
        {"acoustics.hf.channel": ("curve", "sonar", "table")},
        tuple(f"acoustics.loss.{name}" for name in ("law", "combine", "contention_per_auv", "cap")),
        "the law of the disc's loss; this channel says itself how likely signals are lost",
    ),
    Idle(
        {"acoustics.mf.channel": ("curve",)},
        ("acoustics.mf.range_m",),
        "the curve says how far frames are decoded",
    ),
    Idle(
        {"usbl.model": ("datasheet",)},
        tuple(f"usbl.{name}" for name in ("array", "tdoa_sd_s", "travel_time_sd_s", "quantum_s")),
        "the sheet says what all of them make together",
        remedy="remove it, or set usbl.model: array",
    ),
    Idle({"usbl.model": OWN}, ARRAY + CLOCKS, "how well fixes are measured only the plug-in says"),
    Idle(
        {"acoustics.loss.combine": ("off",)},
        ("acoustics.loss.contention_per_auv",),
        "the loss is that of the range alone",
    ),
    Idle(
        {"acoustics.loss.combine": ("off",), "protocol.ranging": ("owtt_sync",)},
        ("acoustics.loss.cap",),
        "the loss is that of the range alone",
    ),
    Idle(
        {"record.detail": ("summary",)},
        ("record.tracks_hz", "navigation.depth_sd_m"),
        "no tracks are kept, and depths are told by tracks alone",
    ),
    Idle(
        {"asvs.count": (1,)},
        tuple(f"asvs.formation.{name}" for name in ("angle_deg", "clearance_m", "radius_m")),
        "a single ASV lies at the centre",
    ),
    Idle({"asvs.count": (1,)}, ("protocol.broadcaster",), "there is no other ASV"),
    Idle(
        {"auvs.count": (1,)},
        ("acoustics.loss.contention_per_auv", "acoustics.loss.combine"),
        "there is no other AUV",
    ),
    Idle(
        {"auvs.count": (1,), "protocol.ranging": ("owtt_sync",)},
        ("protocol.positions",),
        "there is no other AUV",
    ),
    Idle(
        {"environment.temperature_c": (None,)},
        ("environment.salinity_psu",),
        "only with a temperature does the speed of sound follow from it",
    ),
    Idle(
        {"environment.temperature_c": (None,), "environment.ctd": (None,)},
        ("environment.sound_speed_law",),
        "the speed of sound is given",
    ),
    Idle(
        {"environment.current_m_per_s": (0.0,)},
        ("environment.current_direction_deg",),
        "there is no mean current",
    ),
    Idle(
        {"environment.current_variation_m_per_s": (0.0,)},
        ("environment.current_variation_time_s",),
        "the current does not vary",
    ),
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
    Idle(
        {
            "survey.depth_m": (0.0,),
            "auvs.route.kind": ("lawnmower", "waypoints", "hold"),
        },
        ("acoustics.hf.range_metric",),
        "AUVs at the surface are as far as they look from above",
    ),
)

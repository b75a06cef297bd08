"""Rules about keys that have no effect: of a ranging, a downlink or a schedule, of what AUVs are
told, of instruments and navigation.
"""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from ..core.plugins import is_plugin
from ..scenario import declared
from ..scenario.sections.usbl import UsblSection
from ..setup import Setup


class _Own(tuple[str, ...]):
    """The names of all parts of somebody's own."""

    def __contains__(self, name: object) -> bool:
        return isinstance(name, str) and is_plugin(name)


class _Given(tuple[str, ...]):
    """Whatever somebody may give at a key that is null if nobody does."""

    def __contains__(self, value: object) -> bool:
        return value is not None


OWN, GIVEN = _Own(), _Given()


def names(table: Mapping[str, Any], has: Callable[[Any], bool]) -> tuple[str, ...]:
    """Return the names of the parts that ship of which something is true that they declare."""
    return tuple(name for name, traits in table.items() if has(traits))


def _arrive_late(setup: Setup) -> bool:
    """Tell whether frames may still arrive when their slot has ended."""

    slots = setup.slots
    return setup.scenario.acoustics.mf.range_m > slots.downlink_guard * slots.sound_speed


ASVS_PING = names(declared.RANGINGS, lambda traits: traits.asvs_ping)
CALLS = names(declared.RANGINGS, lambda traits: traits.calls)
OWN_CLOCKS = names(declared.RANGINGS, lambda traits: traits.own_clocks)
REPLIES = names(declared.DOWNLINKS, lambda traits: traits.replies)
FRAMED = names(declared.SCHEDULES, lambda traits: traits.framed)
PROGRAMS = names(declared.ACCESSES, lambda traits: traits.law != "slots")
SCHEDULED = names(declared.ACCESSES, lambda traits: traits.law == "slots")
SLOTLESS = names(declared.ACCESSES, lambda traits: traits.law not in ("slots", "slotted"))
RANDOM = names(declared.SCHEDULES, lambda traits: traits.random_access)
UNSLOTTED = names(declared.SCHEDULES, lambda traits: traits.access in ("poisson", "sensing"))
POLLED = names(declared.SCHEDULES, lambda traits: traits.calls)
ALONE = names(
    declared.SCHEDULES, lambda traits: traits.groups in ("each", "frame") and not traits.calls
)


class Idle(NamedTuple):
    """Keys without effect where other keys have one of these values, why, and what to do.

    `but` tells of a scenario whether they have one all the same.
    """

    mode: Mapping[str, tuple[Any, ...]]
    keys: tuple[str, ...]
    why: str
    effect: str = "has no effect"
    remedy: str = "remove it"
    but: Callable[[Setup], bool] = lambda _: False


TOLD = tuple(
    f"protocol.{name}" for name in ("contention_chance", "forget_after_s", "recall_rounds")
)

KNOWLEDGE = (
    Idle(
        {"protocol.ranging": ASVS_PING + CALLS},
        ("protocol.knowledge", *TOLD),
        "AUVs are called, or do not ping: they need no slot",
    ),
    Idle(
        {"protocol.schedule": RANDOM + POLLED},
        ("protocol.knowledge", *TOLD),
        "AUVs ping as they like, or are called: they need no slot",
    ),
    Idle(
        {"protocol.access": PROGRAMS},
        ("protocol.schedule", "protocol.knowledge", *TOLD),
        "AUVs ping as they like: they need no slot",
    ),
    Idle(
        {"protocol.knowledge": names(declared.KNOWLEDGES, lambda traits: not traits.by_frames)},
        TOLD,
        "all AUVs know the schedule at once",
    ),
    Idle(
        {"protocol.knowledge.missed": ("silent", "last_slot")},
        ("protocol.contention_chance",),
        "there is no contention slot",
    ),
    Idle(
        {"protocol.knowledge.missed": ("contention",)},
        ("protocol.recall_rounds",),
        "lost AUVs come back by the contention slot",
    ),
    Idle(
        {"protocol.forget_after_s": (None,)},
        ("protocol.recall_rounds",),
        "no AUV is ever lost",
    ),
)


UNFRAMED = names(declared.SCHEDULES, lambda traits: not traits.framed and not traits.random_access)
BROADCASTS = (
    "acoustics.mf.range_m", "acoustics.mf.range_metric", "acoustics.mf.channel",
    "acoustics.mf.bit_rate_bps", "acoustics.mf.overhead",
    "acoustics.mf.header_bytes", "acoustics.mf.fix_bytes", "protocol.broadcaster",
    "acoustics.mf.airtimes", "acoustics.mf.processing_s", "acoustics.mf.payload_bytes",
    "acoustics.mf.overfull", "acoustics.mf.modem", "acoustics.mf.transmit_w",
    "acoustics.mf.receive_w", "acoustics.mf.idle_w",
    "protocol.downlink_guard_s", "protocol.shortest_downlink_slot_s", "protocol.duplex",
)  # fmt: skip


def calls(setup: Setup) -> bool:
    """Tell whether ASVs call AUVs."""
    scenario = setup.scenario
    return scenario.protocol.calls


def passive(setup: Setup) -> bool:
    """Tell whether ASVs ping."""
    scenario = setup.scenario
    return scenario.protocol.asvs_ping


def times_by_place(setup: Setup) -> bool:
    """Tell whether slots are as long as it takes from where AUVs are, or are believed to be."""
    return setup.schedule.pace != ""


PROTOCOL = (
    Idle(
        {"protocol.ranging": ASVS_PING},
        (
            *BROADCASTS,
            *(f"protocol.{name}" for name in ("schedule", "downlink", "positions", "frame_s")),
            "protocol.conflict_margin_m",
        ),
        "ASVs ping in turn and AUVs fix themselves; nobody calls, answers or broadcasts",
    ),
    Idle(
        {"protocol.ranging": ASVS_PING},
        ("acoustics.loss.contention_per_auv", "acoustics.loss.combine"),
        "no AUV pings, so none contends",
    ),
    Idle(
        {"protocol.downlink": REPLIES, "protocol.downlink.reply": ("instant",)},
        BROADCASTS,
        "the ASV that hears a ping first answers it at once, without airtime",
    ),
    Idle(
        {"protocol.downlink": REPLIES, "protocol.downlink.reply": ("frame",)},
        (
            "protocol.broadcaster",
            "protocol.shortest_downlink_slot_s",
            "acoustics.mf.payload_bytes",
            "acoustics.mf.overfull",
        ),
        "the ASV that hears a ping first answers it, once it is decoded, in a frame of one fix",
    ),
    Idle(
        {"protocol.downlink": REPLIES, "protocol.downlink.reply": ("frame",)},
        ("protocol.downlink.reply_at",),
        "answers are frames, sent once a ping is decoded",
        remedy="remove it, or set protocol.downlink.reply: instant, answers without airtime as in "
        "0.1",
    ),
    Idle(
        {"protocol.downlink": REPLIES, "protocol.schedule": UNSLOTTED},
        ("protocol.downlink_guard_s",),
        "pings are answered as they come, in no slots",
    ),
    Idle(
        {
            "protocol.downlink": names(
                declared.DOWNLINKS, lambda traits: traits.waits or traits.replies
            )
        },
        ("protocol.duplex",),
        "nobody pings while a frame is on the air or arriving",
        but=lambda setup: setup.scenario.protocol.random_access or _arrive_late(setup),
    ),
    Idle(
        {"protocol.schedule": names(declared.SCHEDULES, lambda traits: traits.pace == "packed")},
        ("protocol.uplink_guard_s", "protocol.shortest_uplink_slot_s"),
        "arrivals are packed, there are no slots of T_UL",
        but=passive,
    ),
    Idle(
        {"protocol.schedule": UNFRAMED, "protocol.access": SCHEDULED},
        ("protocol.frame_s",),
        "a round begins as soon as the one before it has ended",
    ),
    Idle(
        {
            "protocol.schedule": ALONE,
            "protocol.ranging": OWN_CLOCKS,
        },
        ("protocol.positions",),
        "an AUV has its slot to itself wherever it is believed to be",
        "changes only the conflicts that are counted in `rounds`",
    ),
    Idle(
        {"protocol.schedule": RANDOM},
        ("protocol.positions",),
        "AUVs ping as they like, wherever they are believed to be",
        "changes only the conflicts that are counted in `rounds`",
    ),
    Idle(
        {"protocol.access": PROGRAMS},
        ("protocol.positions", "protocol.conflict_margin_m"),
        "AUVs ping as they like, wherever they are believed to be",
        "changes only the conflicts that are counted in `rounds`",
    ),
    Idle(
        {"protocol.access": PROGRAMS},
        ("auvs.ping_late_s",),
        "AUVs ping as they like",
    ),
    Idle(
        {"protocol.access": SLOTLESS},
        ("protocol.uplink_guard_s", "protocol.shortest_uplink_slot_s"),
        "AUVs ping as they like, in no slots",
    ),
    Idle(
        {"protocol.schedule": UNSLOTTED},
        ("protocol.uplink_guard_s", "protocol.shortest_uplink_slot_s"),
        "AUVs ping as they like, in no slots",
    ),
    Idle(
        {"protocol.schedule": ALONE + RANDOM},
        ("protocol.conflict_margin_m",),
        "an AUV has its slot to itself wherever it is believed to be",
        "changes only the conflicts that are counted in `rounds`",
    ),
    Idle(
        {"protocol.ranging": CALLS + ASVS_PING},
        ("auvs.ping_late_s",),
        "no AUV pings by its own clock",
    ),
    Idle(
        {"protocol.schedule": POLLED},
        ("auvs.ping_late_s",),
        "AUVs ping when they are called",
    ),
    Idle(
        {"protocol.schedule": RANDOM},
        ("auvs.ping_late_s",),
        "AUVs ping as they like",
    ),
)


CLOCKS = ("navigation.clock_offset_sd_s", "navigation.clock_drift_sd")

PEERS = tuple(
    f"navigation.peers.{name}"
    for name in ("every_s", "kind", "bearing", "message_bytes", "share", "fusion")
)

# Vessels keep their stations by GNSS, too.
BESIDES = (
    *("preset", "model", "gnss_sd_m", "gnss_correlated_sd_m", "gnss_time_constant_s"),
    "range_rate_sd_m_per_s",
)
ARRAY = tuple(f"usbl.{name}" for name in UsblSection.model_fields if name not in BESIDES)


def peers_by_clock(setup: Setup) -> bool:
    """Tell whether AUVs range each other by their clocks."""
    peers = setup.scenario.navigation.peers
    return peers is not None and peers.traits.ranges and not peers.traits.asks


def wanders(setup: Setup) -> bool:
    """Tell whether the errors of a sheet of drift wander, as biases that have a frame."""
    return setup.drift_line_m is not None


MEASURING = (
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
        {"protocol.ranging": CALLS},
        CLOCKS,
        "AUVs answer calls, whatever their clocks say",
        but=peers_by_clock,
    ),
    Idle(
        {"auvs.count": (1,)},
        PEERS,
        "there is no other AUV",
    ),
    Idle(
        {"navigation.peers.share": ("raw",)},
        ("navigation.peers.fusion",),
        "each AUV works out all from the measurements that have come to it, and fuses no estimates",
    ),
    Idle(
        {"usbl.gnss_correlated_sd_m": (0.0,)},
        ("usbl.gnss_time_constant_s",),
        "GNSS has no slow error",
    ),
    Idle({"usbl.slow_share": (0.0,)}, ("usbl.correlation_s",), "no acoustic error is slow"),
    Idle({"usbl.outlier_share": (0.0,)}, ("usbl.outlier_sd_m",), "there are no outliers"),
    Idle(
        {"usbl.model": names(declared.INSTRUMENTS, lambda traits: traits.is_stated)},
        tuple(f"usbl.{name}" for name in ("array", "tdoa_sd_s", "travel_time_sd_s", "quantum_s")),
        "the data sheet says what all of them make together",
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
        {"navigation.filter": names(declared.NAVIGATORS, lambda traits: not traits.weighs)},
        ("navigation.nis_gate",),
        "only a filter that weighs refuses fixes",
    ),
    Idle(
        {"navigation.filter": OWN},
        ("navigation.nis_gate",),
        "the plug-in is given every fix, and refuses which it likes",
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
                {"protocol.ranging": ASVS_PING},
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

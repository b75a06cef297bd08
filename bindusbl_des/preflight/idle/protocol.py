"""Keys that do nothing with a ranging, a downlink or a schedule."""

from ...scenario.families import (
    FRAMED_SCHEDULES,
    RANDOM_ACCESS,
    SCHEDULES,
    UNEQUAL_SLOTS,
    is_random,
)
from ...scenario.scenario import Scenario
from .rule import Idle

UNFRAMED = tuple(name for name in SCHEDULES if name not in (*FRAMED_SCHEDULES, *RANDOM_ACCESS))
BROADCASTS = (
    "acoustics.mf.range_m", "acoustics.mf.channel", "acoustics.mf.bit_rate_bps",
    "acoustics.mf.overhead",
    "acoustics.mf.header_bytes", "acoustics.mf.fix_bytes", "protocol.broadcaster",
    "acoustics.mf.airtimes", "acoustics.mf.processing_s", "acoustics.mf.payload_bytes",
    "acoustics.mf.overfull", "acoustics.mf.modem", "acoustics.mf.transmit_w",
    "acoustics.mf.receive_w", "acoustics.mf.idle_w",
    "protocol.downlink_guard_s", "protocol.shortest_downlink_slot_s", "protocol.duplex",
)  # fmt: skip


def calls(scenario: Scenario) -> bool:
    """Tell whether ASVs call AUVs."""
    return scenario.protocol.calls


def passive(scenario: Scenario) -> bool:
    """Tell whether ASVs ping."""
    return scenario.protocol.is_passive


def times_by_place(scenario: Scenario) -> bool:
    """Tell whether slots are as long as it takes from where AUVs are, or are believed to be."""
    return scenario.protocol.schedule in UNEQUAL_SLOTS


PROTOCOL = (
    Idle(
        {"protocol.ranging": ("passive",)},
        (
            *BROADCASTS,
            *(f"protocol.{name}" for name in ("schedule", "downlink", "positions", "frame_s")),
            "protocol.conflict_margin_m",
        ),
        "ASVs ping in turn and AUVs fix themselves; nobody calls, answers or broadcasts",
    ),
    Idle(
        {"protocol.ranging": ("passive",)},
        ("acoustics.loss.contention_per_auv", "acoustics.loss.combine"),
        "no AUV pings, so none contends",
    ),
    Idle(
        {"protocol.downlink": ("direct_reply",), "protocol.downlink.reply": ("instant",)},
        BROADCASTS,
        "the ASV that hears a ping first answers it at once, without airtime",
    ),
    Idle(
        {"protocol.downlink": ("direct_reply",), "protocol.downlink.reply": ("frame",)},
        (
            "protocol.broadcaster",
            "protocol.shortest_downlink_slot_s",
            "protocol.downlink.reply_at",
            "acoustics.mf.payload_bytes",
            "acoustics.mf.overfull",
        ),
        "the ASV that hears a ping first answers it, once it is decoded, in a frame of one fix",
    ),
    Idle(
        {"protocol.downlink": ("direct_reply",), "protocol.schedule": ("aloha", "csma")},
        ("protocol.downlink_guard_s",),
        "pings are answered as they come, in no slots",
    ),
    Idle(
        {"protocol.downlink": ("sequential", "direct_reply")},
        ("protocol.duplex",),
        "nobody pings while a frame is on the air or arriving",
        but=lambda it: is_random(it) or it.protocol.downlink_guard_s is not None,
    ),
    Idle(
        {"protocol.schedule": ("super_tdma",)},
        ("protocol.uplink_guard_s", "protocol.shortest_uplink_slot_s"),
        "arrivals are packed, there are no slots of T_UL",
        but=passive,
    ),
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
        {"protocol.schedule": RANDOM_ACCESS},
        ("protocol.positions",),
        "AUVs ping as they like, wherever they are believed to be",
        "changes only the conflicts that are counted in `rounds`",
    ),
    Idle(
        {"protocol.schedule": ("aloha", "csma")},
        ("protocol.uplink_guard_s", "protocol.shortest_uplink_slot_s"),
        "AUVs ping as they like, in no slots",
    ),
    Idle(
        {"protocol.schedule": ("one_per_slot", *FRAMED_SCHEDULES, *RANDOM_ACCESS)},
        ("protocol.conflict_margin_m",),
        "an AUV has its slot to itself wherever it is believed to be",
        "changes only the conflicts that are counted in `rounds`",
    ),
    Idle(
        {"protocol.ranging": ("twtt", "passive")},
        ("auvs.ping_late_s",),
        "no AUV pings by its own clock",
    ),
    Idle(
        {"protocol.schedule": ("polling",)},
        ("auvs.ping_late_s",),
        "AUVs ping when they are called",
    ),
    Idle(
        {"protocol.schedule": RANDOM_ACCESS},
        ("auvs.ping_late_s",),
        "AUVs ping as they like",
    ),
)

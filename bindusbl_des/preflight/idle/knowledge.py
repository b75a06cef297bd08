"""Keys of what AUVs are told that do nothing: rules as those of :mod:`.keys`."""

from ...scenario.families import RANDOM_ACCESS
from .rule import Idle

TOLD = tuple(
    f"protocol.{name}" for name in ("contention_chance", "forget_after_s", "recall_rounds")
)

KNOWLEDGE = (
    Idle(
        {"protocol.ranging": ("passive", "twtt")},
        ("protocol.knowledge", *TOLD),
        "AUVs are called, or do not ping: they need no slot",
    ),
    Idle(
        {"protocol.schedule": (*RANDOM_ACCESS, "polling")},
        ("protocol.knowledge", *TOLD),
        "AUVs ping as they like, or are called: they need no slot",
    ),
    Idle({"protocol.knowledge": ("shared",)}, TOLD, "all AUVs know the schedule at once"),
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

"""Settings of the knowledge `broadcast`, with which frames announce slots
(:mod:`.dissemination`).
"""

from typing import Literal

from ..scenario.families import KnowledgeTraits
from ..scenario.key_types import Whole, key
from ..scenario.part_choice import Settings


class BroadcastSettings(Settings):
    """The settings of the knowledge `broadcast`."""

    assignment_bytes: Whole = key(
        2, "B", "bytes in a frame that assign one AUV its slot", ge=0, le=64
    )
    missed: Literal["silent", "last_slot", "contention"] = key(
        "silent",
        "",
        "what an AUV does that received no slot: it stays silent, pings in its last known "
        "slot, or pings at random in a contention slot at the end of the round, at the times "
        "that it estimates",
    )


BROADCAST = KnowledgeTraits(settings=BroadcastSettings, by_frames=True)

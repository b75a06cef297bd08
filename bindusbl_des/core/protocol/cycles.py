"""Timelines of rounds: a downlink runs on a dry network of slots and airtimes, without sound.

The downlinks of :mod:`.downlinks` are generators that read as their rounds go.  Here the same
generators run where no AUV pings and nothing is heard: whatever must know how long a round lasts
(`timing`, `limits`, warnings, the verifier, the planner) asks them, and no formula.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, cast

import simpy

from ...support.arrays import Ints
from ..acoustics.messages import Message
from ..records.events import Round
from ..scenario.families import DOWNLINK
from .downlinks import direct_reply, sequential
from .network import Network, Turn
from .slots import Slots

# Downlink whose timeline stands in for that of a user-defined one, which is unknown
STAND_IN = sequential.__name__


@dataclass(frozen=True)
class Cycle:
    """The timeline of a round among others like it, in s since its beginning: when each of its
    slots begins, when each of its broadcasts does, and when the next round does.
    """

    slots_s: tuple[float, ...]
    broadcasts_s: tuple[float, ...]
    length_s: float


@dataclass
class _Bands:
    """Stand-in for both bands: each slot `brings` so many fixes, and a broadcast takes all."""

    brings: Sequence[int]
    env: simpy.Environment
    waiting: int = 0
    slots_s: list[float] = field(default_factory=list)
    broadcasts_s: list[float] = field(default_factory=list)

    def ping(self, number: int, slot: int, group: Sequence[int], time: float, view: Any) -> None:
        self.slots_s.append(time)
        self.waiting += self.brings[slot]

    def send(self, number: int, fixes: Any, asv: int, time: float, message: Any, part: int) -> None:
        """Send a frame that no AUV hears."""


@dataclass
class _Dissemination:
    """Stand-in for dissemination: each broadcast names `named` AUVs; all know their slots."""

    named: int

    def known(self, row: Round, slot: int, time: float) -> Sequence[int]:
        return (0,)

    def assign(self, number: int, time: float, asvs: Sequence[int]) -> dict[int, Sequence[int]]:
        return {0: range(self.named)}

    def foretell(self, number: int, ends: float) -> None:
        """Announce the next round's start to no AUV."""

    def send(self, number: int, frame: int, part: int, names: Sequence[int]) -> None:
        """Announce slots to no AUV."""


class _Nobody:
    """Stand-in for fleet and record: no ASV fails, and nothing is recorded."""

    failures, vehicles, broadcasts = None, (), ()


class _SilentNetwork:
    """Stand-in for a downlink's network: slots, airtimes, and one ASV that broadcasts."""

    def __init__(self, slots: Slots, brings: Sequence[int], named: int, busy_s: float) -> None:
        self.env, self.slots = simpy.Environment(), slots
        self.bands = self.ranging = self.deliveries = _Bands(brings, self.env)
        self.dissemination = _Dissemination(named) if named else None
        self.answers = self.broadcaster_draw = self.listeners = self.acknowledged = None
        self.asv_fleet = self.record = _Nobody()
        self.broadcasts, self.downlink_free_at = 0, busy_s

    def broadcaster(self, view: Any) -> int:
        return 0

    def behind_s(self, asv: int, time: float, messages: Sequence[Message], fixes: Ints) -> float:
        assert self.slots.behind is not None
        return self.slots.behind.lasts_s(messages, (1,) * len(fixes))

    def take_fixes(self, time: float) -> range:
        bands, messages = self.bands, self.slots.messages
        bands.broadcasts_s.append(time)
        taken = bands.waiting
        if messages.most is not None and not messages.splits:
            taken = min(taken, messages.most)  # the others, which wait for rounds, are dropped
        bands.waiting = 0
        return range(taken)


@lru_cache(maxsize=4096)
def cycle(downlink: str | None, slots: Slots, groups: int, fixes: int, named: int = 0) -> Cycle:
    """Return a downlink's timeline of a round once it repeats; `downlink` None: no broadcasts.

    The round has so many ping `groups` in slots T_UL, which bring so many `fixes`, as evenly as
    possible; each of its broadcasts tells `named` AUVs their slots.

    >>> from bindusbl_des import Setup, load_scenario
    >>> slots = Setup(load_scenario("baseline_60m")).slots
    >>> one = cycle("sequential", slots, 3, 3)
    >>> len(one.slots_s), len(one.broadcasts_s), round(one.length_s, 3) > 0.4
    (3, 1, True)
    """
    each, more = divmod(fixes, groups) if groups else (0, 0)
    brings = [each + (slot < more) for slot in range(groups)]
    busy_s = 0.0
    while True:
        dry = _SilentNetwork(slots, brings, named, busy_s)
        if not groups:
            dry.bands.waiting = fixes
        ends = _run(downlink, dry, groups)
        found = Cycle(tuple(dry.bands.slots_s), tuple(dry.bands.broadcasts_s), ends)
        left = max(dry.downlink_free_at - ends, 0.0)
        if abs(left - busy_s) < 1e-9:
            return found
        busy_s = left


def _run(downlink: str | None, dry: _SilentNetwork, groups: int) -> float:
    """Return the end (s) of a round of so many ping groups that begins at 0 s.  A user-defined
    downlink runs as `sequential`, no downlink (None) as `direct_reply`.
    """
    rounds = direct_reply if downlink is None else sequential
    if downlink is not None and downlink in DOWNLINK.parts:
        rounds = DOWNLINK.part(downlink)
    slot = dry.slots.uplink_slot
    turn = Turn(Round(0, 0.0, groups, 0), [[0]] * groups, [slot] * groups, cast(Any, None))

    process = dry.env.process(rounds(cast(Network, dry), turn, 0.0))
    return float(cast(float, dry.env.run(until=process)))

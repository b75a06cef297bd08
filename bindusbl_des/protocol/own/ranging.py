"""A ranging that somebody has written: how the AUVs of a slot come to ping, step by step."""

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import simpy

from ...core.plugins import asked
from ...records.events import HEARD
from ...records.rows import CALLED, Rows
from ...scenario.families import RANGING
from ..hf.handed import NO_CALL
from ..hf.uplink import Uplink
from ..schedules.view import View
from .steps import SAME, check_now, checked_steps, event_of

Way = Callable[["Slot", float], Generator[simpy.Event, Any, None]]


class Slot:
    """The slot of a ping group: who is in it, what the fleet knows, and what can be done in it.

    `round` and `number` count rounds, and slots in a round; `group` are the AUVs; `view` is what
    the schedule knew; `random` a stream of the ranging's own.
    """

    def __init__(
        self,
        ranging: "OwnRanging",
        round_number: int,
        number: int,
        group: Sequence[int],
        view: View,
    ) -> None:
        self.round, self.number, self.group, self.view = round_number, number, list(group), view
        self.random = ranging.random
        self._ranging, self._members = ranging, frozenset(group)
        self._calls: set[tuple[int, bytes]] = set()  # whom ASVs have called, and what became of it

    def ping(self, auvs: Sequence[int], time: float, called: Rows = NO_CALL) -> None:
        """Let AUVs ping now, at an instant (s): on their own clocks, or one by its call (1,)."""
        self._check(auvs, time)
        if called is not NO_CALL:
            self._check_call(auvs, called)
        if called is NO_CALL or called[0]["call"] == HEARD:  # who hears no call does not ping
            self._check_silence(auvs, time)
        self._ranging.uplink.send(self.round, self.number, list(auvs), time, called)

    def call(self, auvs: Sequence[int], asvs: Sequence[int], time: float) -> Any:
        """Let ASVs call AUVs now, at an instant (s), one for each.

        Return what becomes of the calls, records of :data:`.rows.CALLED` (n,); who hears its call,
        `.call == HEARD`, does so `.call_time_s` (s) later.
        """
        self._check(auvs, time)
        vessels = range(len(self.view.asvs))
        if len(asvs) != len(auvs) or any(asv not in vessels for asv in asvs):
            raise ValueError(f"one ASV of 0..{vessels[-1]} calls each AUV; got {list(asvs)}")
        failed = sorted(set(asvs) & set(self._ranging.uplink.failed(time)))
        if failed:
            raise ValueError(f"ASV{failed[0]} has failed by {time:g} s; let another one call")
        callers = np.array(asvs, dtype=np.int64)
        answers = self._ranging.uplink.call(list(auvs), callers, time)
        self._calls |= {(auv, it.tobytes()) for auv, it in zip(auvs, answers, strict=True)}
        return answers.view(np.recarray)

    def _check(self, auvs: Sequence[int], time: float) -> None:
        """Refuse AUVs that are not in the slot, and instants that are not now."""
        if len(set(auvs)) != len(auvs) or not self._members.issuperset(auvs):
            members = sorted(self._members)
            raise ValueError(f"the AUVs of the slot are {members}, each once; got {list(auvs)}")
        check_now(self._ranging.env, time, "wait with `yield slot.until(time)`")

    def _check_silence(self, auvs: Sequence[int], time: float) -> None:
        """Refuse AUVs that ping already, and note until when these do."""
        busy = self._ranging.pinging_until
        for auv in auvs:
            if time < busy.get(auv, 0.0) - SAME:
                raise ValueError(f"AUV{auv} is still pinging, until {busy[auv]:g} s")
            busy[auv] = time + self._ranging.uplink.band.duration

    def _check_call(self, auvs: Sequence[int], called: Rows) -> None:
        """Refuse what is not the call of one AUV, as it was returned."""
        is_record = getattr(called, "dtype", None) == CALLED and called.shape == (1,)
        if not is_record or len(auvs) != 1 or (auvs[0], called.tobytes()) not in self._calls:
            raise ValueError(
                "called is one record of those that call() returns, as it is, and of the one AUV "
                "that pings: calls[k : k + 1] for auvs[k]"
            )

    def until(self, time: float) -> simpy.Event:
        """Return the event of an instant (s) that is not past."""
        return event_of(self._ranging.env, time)


@dataclass(frozen=True)
class OwnRanging:
    """A ranging of somebody's own, by its name in the scenario; its steps are checked.

    `pinging_until` is when (s) the last ping of each AUV is over.
    """

    name: str
    way: Way
    env: simpy.Environment
    uplink: Uplink
    random: np.random.Generator
    pinging_until: dict[int, float] = field(default_factory=dict)

    def ping(
        self, round_number: int, slot: int, group: Sequence[int], time: float, view: View
    ) -> None:
        """Let a group have its slot, from an instant (s) on."""
        here = Slot(self, round_number, slot, group, view)
        self.env.process(self._steps(here, time))

    def _steps(self, slot: Slot, time: float) -> Generator[simpy.Event, Any, None]:
        when = f" in slot {slot.number} of round {slot.round}"
        steps = asked(RANGING.key, self.name, self.way, slot, time, when=when)
        yield from checked_steps(RANGING.key, self.name, steps, self.env, when)

    def close(self) -> None:
        """End the mission; what is still to come of its slots is not recorded."""

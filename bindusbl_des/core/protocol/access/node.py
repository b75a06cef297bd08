"""A vehicle as its own program of access sees it: what it hears, when it sends, how it waits.

A program is a generator of steps, one for each vehicle, beside the others in the mission's events:

    def my_access(node):
        for packet in node.packets:        # instants at which it has something to send
            yield node.until(packet)
            if not node.busy():
                yield node.send("ping")

It knows what its vehicle knows: what it hears, its own clock and its own chance.  What it sends is
on the HF band, where it costs airtime and may drown what others hear (:mod:`.air`).  All instants
that it is told of, or names, are those of its clock.
"""

from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass
from math import inf, isfinite
from typing import Any, NamedTuple, Protocol

import simpy
from numpy.random import Generator as RandomStream

from ....support.arrays import Floats
from ....support.wording import refuse
from ...acoustics.signals import ROUNDING
from ..slots import Slots
from ..steps import moment

Steps = Generator[simpy.Event, Any, None]

# So often a program may ask its node for clock, sounds or packets at one instant.
MOST_QUESTIONS = 100_000

Program = Callable[["Node"], Steps]


class _Questions:
    """How often a program has asked its node since it last waited.

    They are not the node's own, since the node's packets count here as well: it would refer to
    itself, and outlive its mission.
    """

    def __init__(self, env: simpy.Environment) -> None:
        self._env, self._last, self._times = env, -1.0, 0

    def counted(self, answer: float) -> float:
        """Return `answer`, and count that the program has asked.

        Raises:
            ValueError: when the program asks on and on without a step.
        """
        now = self._env.now
        self._last, self._times = now, self._times + 1 if now == self._last else 1
        if self._times > MOST_QUESTIONS:
            raise ValueError(
                f"it asks for clock, sounds or packets {MOST_QUESTIONS:,} times while no time goes "
                "by; it must `yield` a wait meanwhile"
            )
        return answer


class HeardSignal(NamedTuple):
    """A signal that a vehicle has decoded: its kind, sender and receiver (None: all); when (s) it
    began and ended there, by the vehicle's clock; its size and content; its level (dB re 1 uPa),
    None where the channel has no levels; the number of a ping.
    """

    kind: str
    sender: str
    to: str | None
    began_at_s: float
    ended_at_s: float
    bytes: int
    data: Any
    level_db: float | None = None
    ping: int | None = None


@dataclass(eq=False)
class Node:
    """A vehicle for its access program: its `name`, the mission's `slots`, a random stream of its
    own (`random`), and the instants (s) at which it has something to send (`packets`), a Poisson
    process with mean interval `protocol.frame_s`.  `clock_error` is how many seconds its clock is
    ahead at first, and how many more each second.
    """

    name: str
    slots: Slots
    random: RandomStream
    packets: Iterator[float]
    air: "Medium"
    number: int  # among all vehicles: AUVs come first, then ASVs
    clock_error: tuple[float, float] = (0.0, 0.0)
    _woken: float = -1.0
    _says: float = 0.0

    def __post_init__(self) -> None:
        """Count the packets that the program takes."""
        self._counted = _Questions(self.air.env).counted
        self.packets = map(self._counted, self.packets)

    @property
    def is_asv(self) -> bool:
        """Whether it is an ASV, which sends no pings."""
        return self.number >= self.air.auvs

    @property
    def clock(self) -> float:
        """The reading of the vehicle's clock (s), exactly what the program waited for if it did."""
        return self._says if self._woken == self.now else self.reads(self.now)

    @property
    def now(self) -> float:
        """The mission's time (s)."""
        now = self.air.env.now
        return self._counted(self._woken if abs(self._woken - now) < ROUNDING else now)

    def reads(self, time: float) -> float:
        """Return the reading of the vehicle's clock (s) at an instant of the mission (s)."""
        offset, drift = self.clock_error
        return time + (offset + drift * time)

    def when(self, reading: float) -> float:
        """Return the mission's instant (s) at which the vehicle's clock shows `reading` (s)."""
        offset, drift = self.clock_error
        return (reading - offset) / (1.0 + drift)

    @property
    def asvs(self) -> list[str]:
        """The names of all ASVs."""
        return self.air.names[self.air.auvs :]

    def lasts_s(self, bytes: int) -> float:
        """Return how long (s) a signal of so many bytes lasts."""
        return 8 * bytes / self.air.bit_rate_bps

    def until(self, instant: float) -> simpy.Event:
        """Return the event of an instant (s) of its clock, now if that is past.

        Raises:
            ValueError: when the instant is not finite.
        """
        if not isfinite(instant):
            refuse("instant (s) to wait for", instant, "be finite", "end the program with `return`")
        return self._event(self.when(instant), instant)

    def at(self, time: float) -> simpy.Event:
        """Return the event that occurs at a mission time (s)."""
        return self._event(time, self.reads(time))

    def _event(self, time: float, reading: float) -> simpy.Event:
        event = moment(self.air.env, time)
        event.callbacks.append(lambda _: self._wake(time, reading))
        return event

    def _wake(self, time: float, reading: float) -> None:
        self._woken, self._says = time, reading

    def wait(self, duration: float) -> simpy.Event:
        """Return the event of an instant so much later (s).

        Raises:
            ValueError: when the duration is negative or not finite.
        """
        if not 0.0 <= duration < inf:
            refuse("wait (s)", duration, "be finite and not below 0", "give seconds from now on")
        return self.until(self.clock + duration)

    def busy(self) -> bool:
        """Return whether the vehicle hears something now, or sends."""
        return bool(self.heard(self.clock))

    def heard(self, since: float) -> list[tuple[float, float]]:
        """Return the intervals (s) of all sounds at the vehicle between `since` (s) and now, its
        own among them, in order of their beginning.

        A sound that begins as another ends counts; a signal that begins at this very instant is not
        known yet.
        """
        spans = self.air.heard(self, self.when(since))
        offset, drift = self.clock_error
        return [(begins, ends) for begins, ends in (spans + (offset + drift * spans)).tolist()]

    def hears(self, within_s: float | None = None) -> simpy.Event:
        """Return the event of the next signal that the vehicle decodes: its value is a
        :class:`HeardSignal`, or None if none comes within `within_s` (s).

        Signals decoded since the last call come first; the first time, all since the launch.  An
        ASV hears pings of AUVs, too.

        Raises:
            ValueError: when the time is negative or no number.
        """
        event = self.air.hears(self)
        if within_s is not None:
            self.wait(within_s).callbacks.append(lambda _: self.air.give_up(event))
        return event

    def send(
        self,
        kind: str,
        *,
        to: str | None = None,
        bytes: int = 0,
        lasts_s: float | None = None,
        data: Any = None,
        waited_s: float | None = None,
        level_db: float | None = None,
        ping: int | None = None,
    ) -> simpy.Event:
        """Send a signal that begins now; return the event of its end.

        A `ping` lasts `acoustics.hf.ping_s`, and is of AUVs alone; any other kind `lasts_s`, or as
        long as its bytes take at `acoustics.hf.bit_rate_bps`.  How long (s) a ping was held back,
        `waited_s`, is put on record.  Where the channel has levels a signal may be sent at a lower
        one than the channel's `source_level_db`: `level_db` (dB re 1 uPa at 1 m), with as much less
        power.  The number of the `ping` that a signal acknowledges is put on record.

        Raises:
            ValueError: when an ASV is to ping, the vehicle still sends, no vehicle is named `to`,
                the signal does not last a finite time above 0, or there is no such level.
        """
        message = ToSend(kind, to, bytes, lasts_s, data, level_db, ping)
        return self.air.send(self, message, waited_s)

    def sight(self, heard: HeardSignal) -> Any:
        """Return what an ASV has measured of a ping, as that ends there, with the noise that its
        fix will be made with (:class:`..outcomes.Sight`: place, covariance); None later, of other
        signals, at AUVs, and with a user-defined instrument.
        """
        is_now = abs(self.when(heard.ended_at_s) - self.now) < ROUNDING
        if not self.is_asv or heard.ping is None or not is_now:
            return None
        return self.air.sight_of(heard.ping, self.number - self.air.auvs)


class Medium(Protocol):
    """What carries the signals of nodes (:class:`.air.SharedAir`): `names` are all vehicles, AUVs
    first, of which so many are `auvs`.
    """

    env: simpy.Environment
    names: list[str]
    auvs: int
    bit_rate_bps: float

    @property
    def sight_of(self) -> Callable[[int, int], Any]:
        """A function of a ping's and an ASV's number that returns the ASV's measurement."""

    def send(self, node: Node, message: "ToSend", waited_s: float | None) -> simpy.Event:
        """Let a node send a signal; return the event of its end."""

    def heard(self, node: Node, since: float) -> Floats:
        """Return the intervals (n, 2), s, of sounds at a node."""

    def hears(self, node: Node) -> simpy.Event:
        """Return the event of the next signal that a node decodes."""

    def give_up(self, event: simpy.Event) -> None:
        """End the wait for a signal that has not come: succeed its event with None."""


class ToSend(NamedTuple):
    """A signal to send, as of :meth:`Node.send`."""

    kind: str
    to: str | None
    bytes: int
    lasts_s: float | None
    data: Any
    level_db: float | None = None
    ping: int | None = None

"""A mission flown against the clock: each reading is sent when it is due.

The mission runs a little ahead of the clock, which nobody can tell, since nothing that listens acts
on it; where an outside program moves vehicles, or speaks with modems, it follows the clock instead.
"""

import math
import selectors
from collections import Counter, deque
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from functools import partial
from time import monotonic
from typing import Protocol

from ...core.protocol.access.hosted import Modem
from .readings import Earth, Instruments, Reading
from .sinks import Say, Sink
from .wire import Wire

# The mission is advanced by so much at a time (s), and so far ahead of the clock (s); where modems
# are on a wire it follows the clock by so much of real time (s).
STEP_S, AHEAD_S, WIRE_S = 0.1, 1.0, 0.002

# So long (s) a step of the mission may take while nothing is due.
WORK_S = 0.02

# Nobody is deaf for longer (s): to Ctrl-C, or to clients.
PATIENCE_S = 0.05

# Lateness is counted in classes of so many seconds, the last of which has all that is later.
CLASS_S, CLASSES = 1e-4, 20_000


class Encoder(Protocol):
    """A format: telegrams (bytes) of a reading, none if it has no words for it."""

    def __call__(self, reading: Reading, earth: Earth, /) -> Sequence[bytes]: ...


@dataclass
class Output:
    """Readings of `only` some vehicles (of all, if none is named) in a format, to a sink."""

    encode: Encoder
    sink: Sink
    only: Collection[str] = ()
    sent: int = 0

    def tell(self, reading: Reading, earth: Earth) -> None:
        """Send what this format says of a reading.

        Raises:
            OSError: when the sink cannot go on.
        """
        if self.only and reading.vehicle not in self.only:
            return
        for telegram in self.encode(reading, earth):
            self.send(telegram)

    def send(self, telegram: bytes) -> None:
        """Send a telegram, and count it.

        Raises:
            OSError: when the sink cannot go on.
        """
        self.sink.send(telegram)
        self.sent += 1


@dataclass
class Lateness:
    """How late telegrams were: a histogram, which does not grow."""

    counts: Counter[int] = field(default_factory=Counter)

    def note(self, late_s: float) -> None:
        self.counts[min(max(int(late_s / CLASS_S), 0), CLASSES)] += 1

    def quantile(self, share: float) -> float:
        """Return the lateness (s) that so large a share of telegrams does not exceed."""
        left = share * sum(self.counts.values())
        for late in sorted(self.counts):
            left -= self.counts[late]
            if left <= 0:
                return (late + 1) * CLASS_S
        return 0.0


class Session:
    """A mission, its outputs and its clock; `speed` times real time, infinite for at once.

    Where it `follows` the clock, what happens in a step of the mission is sent at its end; the
    steps are short where hosts speak with modems by `wires`.
    """

    def __init__(
        self,
        instruments: Instruments,
        earth: Earth,
        outputs: Sequence[Output],
        selector: selectors.BaseSelector,
        say: Say,
        *,
        speed: float = 1.0,
        follows: bool = False,
        wires: bool = False,
    ) -> None:
        self.outputs, self.lateness, self.time = list(outputs), Lateness(), 0.0
        self._instruments, self._earth, self._selector = instruments, earth, selector
        self._say, self._speed, self._follows = say, speed, follows or wires
        self._follow_s = WIRE_S * speed if wires else STEP_S
        #: Whether the mission begins when the clock starts, whatever `earth` says.
        self.starts_now = False
        self._due: deque[Reading] = deque()
        self._is_stopped, self._began = False, monotonic()

    def connect(self, modems: Mapping[str, Modem]) -> None:
        """Join the wires among the outputs to modems of the mission, by their vehicles' names."""
        for output in self.outputs:
            if isinstance(output.encode, Wire):
                modem = modems[output.encode.vehicle]
                output.encode.connect(modem, partial(self._pass_on, output), self.catch_up)

    def _pass_on(self, output: Output, telegram: bytes, at_s: float) -> None:
        """Send what a modem says at an instant (s) of the mission, now."""
        if output in self.outputs and not self._is_stopped:
            self.time = at_s
            self.lateness.note((self._now - at_s) / self._speed)
            self._try(output, lambda: output.send(telegram))

    def _try(self, output: Output, send: Callable[[], None]) -> None:
        """Send by an output; one that cannot go on is told of, and left."""
        try:
            send()
        except OSError as error:
            self._say(f"{output.sink.name}: {error.strerror or error}; the mission goes on")
            self.outputs.remove(output)
            output.sink.close()

    def stop(self) -> None:
        """Send nothing more, from wherever this is called."""
        self._is_stopped = True

    def fly(self, progress: Callable[["Session"], None]) -> None:
        """Send all readings of the mission when they are due, until its end or :meth:`stop`."""
        # What is compiled or set up once is so before the clock starts.
        ahead = 0.0 if self._follows else AHEAD_S * min(self._speed, 1.0)
        steps = 0 if self._follows else 1
        self._due.extend(self._instruments.advance(steps * self._step))
        if self.starts_now:
            self._earth = self._earth._replace(start=datetime.now(UTC))
        self._began = monotonic()
        ahead *= max(self._speed, 1.0)
        while not self._is_stopped:
            while self._due and self._due[0].at_s <= self._now and not self._is_stopped:
                self._send(self._due.popleft(), self._now)
            known, instant = self._instruments.time, self._now
            if self._instruments.is_over and not self._due:
                break
            idle_s = 0.0
            if self._speed < math.inf:
                following = known + self._step if self._follows else known
                if self._due:
                    following = self._due[0].at_s
                idle_s = max(following - instant, 0.0) / self._speed
            if not self._instruments.is_over and self._is_due(known, instant, ahead, idle_s):
                self._listen(0.0)
                while steps * self._step <= self._instruments.time:
                    steps += 1
                self._due.extend(self._instruments.advance(steps * self._step))
            else:
                self._listen(min(idle_s, PATIENCE_S))
            progress(self)
        self.time = self._instruments.time

    @property
    def _now(self) -> float:
        """The instant (s) of the mission that the clock shows."""
        since = monotonic() - self._began
        return since * self._speed if self._speed < math.inf else math.inf

    def catch_up(self) -> None:
        """Let everything happen that has happened by now: somebody outside acts on it."""
        if self._now > self._instruments.time:
            self._due.extend(self._instruments.advance(self._now))

    def _is_due(self, known: float, now: float, ahead: float, idle_s: float) -> bool:
        """Tell whether the mission is to be advanced now: at its instant, or ahead of the clock
        while there is time (s) for it.
        """
        if self._follows or self._speed == math.inf:
            return now >= known + (self._step if self._follows else 0.0)
        is_short = known - now < ahead / 2
        return known <= now + ahead and (is_short or idle_s > WORK_S)

    @property
    def _step(self) -> float:
        """How far (s) the mission is advanced at a time."""
        return self._follow_s if self._follows else STEP_S * min(max(self._speed, 1.0), 10.0)

    def _send(self, reading: Reading, now: float) -> None:
        self.time = reading.at_s
        if self._speed < math.inf:
            self.lateness.note((now - reading.at_s) / self._speed)
        for output in list(self.outputs):
            self._try(output, partial(output.tell, reading, self._earth))

    def _listen(self, seconds: float) -> None:
        """Serve those that are connected, and wait so long (s) at most."""
        for key, mask in self._selector.select(seconds):
            key.data(mask)

    @property
    def sent(self) -> int:
        """How many telegrams have been sent."""
        return sum(output.sent for output in self.outputs)

    @property
    def rate(self) -> float:
        """How many telegrams have been sent in a second."""
        return self.sent / max(monotonic() - self._began, 1e-3)

    @property
    def clients(self) -> int:
        """How many are connected."""
        return sum(output.sink.clients for output in self.outputs)

"""Modems on a wire: what a host says over a serial port or a socket becomes signals.

A host is a program outside the simulation, or a recording of one; its modem is a `seatrac` or
`evologics`.  Each line of the host goes to :meth:`Modem.hear`, at an instant of the mission; the
modem's lines go to `on_say`.  On the air there is one exchange, whatever the modem's make:

    tells     a message to one modem or to all; nothing comes back
    asks      a message to one modem, which answers by itself `turnaround_s` after its end
    answers   half the round trip is the range of the modem that asked; an array also measures
              the answer's direction

A modem does one thing at a time: while it sends, or waits for an answer, it is busy.  It gives an
answer up that does not come within the travel time to `timeout_m` and back.
"""

import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from math import sqrt
from typing import Any, NamedTuple, Protocol

from ...records.events import ModemLine
from .node import HeardSignal, Node

# The address of all modems at once
ALL = 0

LINE_END = rb"[\r\n]+"


class ModemMessage(NamedTuple):
    """A message between modems: addresses of receiver and sender, its role (tells, asks, answers),
    and its content.
    """

    to: int
    sender: int
    role: str
    content: Any


class SeenDirection(NamedTuple):
    """The direction of a signal measured by an array: azimuth and elevation in the vessel's frame
    (rad, from ahead to starboard, and up), and a unit vector: north, east, down.
    """

    azimuth: float
    elevation: float
    direction: tuple[float, float, float]


class SensedPose(NamedTuple):
    """A vehicle's pose by its own sensors: depth (m), yaw, pitch and roll (rad)."""

    depth_m: float
    yaw: float
    pitch: float
    roll: float


class Senses(Protocol):
    """The sensors of all vehicles, with the error of one-way travel times (s, 1 sigma) of each."""

    sound_speed: float
    travel_time_sds_s: Sequence[float]

    def pose(self, node: Node) -> SensedPose:
        """Return a vehicle's pose by its own sensors now."""

    def sight(self, node: Node, heard: HeardSignal) -> SeenDirection | None:
        """Return the measured direction of a signal; None without an array."""


class Request(NamedTuple):
    """A request that waits for its answer: the address asked, when (s) it ended, its content."""

    to: int
    over_at_s: float
    content: Any


class Modem(ABC):
    """A vehicle's modem; makes differ in the lines on the wire, and in the bytes of a message.

    Args:
        node: the vehicle as its program of access has it.
        senses: the sensors of all vehicles.
        address: its address, from 1.
        lines: the record of what modem and host say.
    """

    timeout_m = 1000.0
    turnaround_s = 0.01
    most_bytes: int

    def __init__(self, node: Node, senses: Senses, address: int, lines: list[ModemLine]) -> None:
        self.node, self.senses, self.address, self._lines = node, senses, address, lines
        #: Called with each line to the host.
        self.on_say: Callable[[bytes], None] = lambda text: None
        self._asked: Request | None = None
        self._until = 0.0  # s

    # The wire

    @staticmethod
    def lines_of(text: bytes) -> tuple[list[bytes], bytes]:
        """Return the lines of a host that have ended, CR, LF or both, and what is behind them."""
        *lines, rest = re.split(LINE_END, text)
        return lines, rest

    def hear(self, text: bytes) -> None:
        """Take a line of the host, now."""
        self._note("host", text)
        self.obey(text)

    def say(self, text: bytes) -> None:
        """Send a line to the host, now, and add the line's end."""
        self._note("modem", text)
        self.on_say(text + b"\r\n")

    def _note(self, said_by: str, text: bytes) -> None:
        written = text.decode("latin-1").encode("unicode_escape").decode("ascii")
        self._lines.append(ModemLine(self.node.clock, self.node.name, said_by, written))

    @abstractmethod
    def obey(self, text: bytes) -> None:
        """Execute a line of the host, now; ignore what is no command."""

    @staticmethod
    @abstractmethod
    def ping(to: int) -> bytes:
        """Return the line by which a host requests an answer of another modem, by its address."""

    # The air

    @property
    def is_busy(self) -> bool:
        """Whether it sends, or waits for an answer."""
        return self.is_asking or self.node.clock < self._until

    @property
    def is_asking(self) -> bool:
        """Whether it waits for an answer."""
        return self._asked is not None

    def send(self, message: ModemMessage, bytes: int) -> None:
        """Send a message of so many bytes now; if it asks, wait for its answer."""
        lasts = self.node.lasts_s(bytes)
        self._until = self.node.clock + lasts
        self.node.send(type(self).__name__.lower(), bytes=bytes, data=message)
        if message.role == "asks":
            request = self._asked = Request(message.to, self._until, message.content)
            way = 2.0 * self.timeout_m / self.senses.sound_speed
            answer = self.node.lasts_s(self.most_bytes)
            later = self.node.wait(lasts + way + self.turnaround_s + answer)
            later.callbacks.append(lambda _: self._give_up(request))

    def _give_up(self, request: Request) -> None:
        if self._asked is request:
            self._asked = None
            self.unanswered(request)

    def receive(self, heard: HeardSignal) -> None:
        """Take a signal that has been decoded now."""
        message: ModemMessage = heard.data
        if not isinstance(message, ModemMessage) or message.to not in (ALL, self.address):
            return
        if message.role == "answers":
            asked = self._asked
            if asked is not None and message.sender == asked.to:
                self._asked = None
                self.answered(heard, message, self._way_s(heard, asked))
            return
        self.told(heard, message)
        if message.role == "asks":
            self.node.wait(self.turnaround_s).callbacks.append(lambda _: self._answer(message))

    def _answer(self, asked: ModemMessage) -> None:
        """Answer a request, unless this modem is busy."""
        if not self.is_busy:
            content, size = self.answer(asked)
            self.send(ModemMessage(asked.sender, self.address, "answers", content), size)

    def _way_s(self, heard: HeardSignal, asked: Request) -> float:
        """Return the one-way travel time (s) from an answer: half the measured round trip."""
        took = heard.began_at_s - asked.over_at_s - self.turnaround_s
        sd = self.senses.travel_time_sds_s[self.node.number]
        error = sqrt(2.0) * sd * self.node.random.standard_normal()
        return max(0.5 * (took + error), 0.0)

    @abstractmethod
    def told(self, heard: HeardSignal, message: ModemMessage) -> None:
        """Report to the host a message, or a request that will be answered."""

    @abstractmethod
    def answer(self, asked: ModemMessage) -> tuple[Any, int]:
        """Return the content of the answer to a request, and its size (bytes)."""

    @abstractmethod
    def answered(self, heard: HeardSignal, message: ModemMessage, way_s: float) -> None:
        """Report an answer to the host, with the travel time (s) of its sender."""

    @abstractmethod
    def unanswered(self, asked: Request) -> None:
        """Report to the host that no answer has come."""

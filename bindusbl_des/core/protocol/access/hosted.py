"""Modems on a wire: what a host says over a serial port or a socket becomes signals.

A host is a program outside the simulation (or a record of what it once said); its modem is a
`seatrac` or `evologics`.  Each line that comes over the wire goes to :meth:`Modem.hear`, at an
instant of the mission; what the modem says goes to `on_say`.  On the air there is one exchange,
whatever the modem's make:

    tells     a message to one modem or to all; nothing comes back
    asks      a message to one modem, which answers by itself `turnaround_s` after its end
    answers   half of the way there and back is the range of who asked; an array also sees from
              where the answer came

A modem does one thing at a time: who sends, or waits for an answer, is busy.  An answer that does
not come within the time that sound takes to `timeout_m` and back is given up.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from math import sqrt
from typing import Any, NamedTuple, Protocol

from ...records.events import ModemLine
from .node import HeardSignal, Node

# An address that all modems have.
ALL = 0


class ModemMessage(NamedTuple):
    """What one modem says to another: to and from which address, whether it tells, asks or
    answers, and what."""

    to: int
    sender: int
    role: str
    content: Any


class SeenDirection(NamedTuple):
    """What an array measures of a signal: azimuth and elevation in the frame of its vessel (rad,
    from ahead to starboard, and up), and a vector of length 1 in that direction: north, east, down.
    """

    azimuth: float
    elevation: float
    direction: tuple[float, float, float]


class SensedPose(NamedTuple):
    """What a vehicle's own sensors say: depth (m), yaw, pitch and roll (rad)."""

    depth_m: float
    yaw: float
    pitch: float
    roll: float


class Senses(Protocol):
    """The sensors of all vehicles; travel times have an error (s, 1 sigma) each way."""

    sound_speed: float
    travel_time_sd_s: float

    def pose(self, node: Node) -> SensedPose:
        """Return what a vehicle's own sensors say now."""

    def sight(self, node: Node, heard: HeardSignal) -> SeenDirection | None:
        """Return in which direction a vehicle has seen a signal; None of those without array."""


class Request(NamedTuple):
    """A request that waits for its answer: to which address, when (s) it was over, and what of."""

    to: int
    over_at_s: float
    content: Any


class Modem(ABC):
    """A vehicle's modem; makers differ in what is said on the wire, and in the bytes of a message.

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
        #: Whom to tell what it says to its host.
        self.on_say: Callable[[bytes], None] = lambda text: None
        self._asked: Request | None = None
        self._until = 0.0  # s

    # The wire

    def hear(self, text: bytes) -> None:
        """Take a line of the host, now."""
        self._note("host", text)
        self.obey(text)

    def say(self, text: bytes) -> None:
        """Say a line to the host, now; its end is put to it."""
        self._note("modem", text)
        self.on_say(text + b"\r\n")

    def _note(self, said_by: str, text: bytes) -> None:
        written = text.decode("latin-1").encode("unicode_escape").decode("ascii")
        self._lines.append(ModemLine(self.node.clock, self.node.name, said_by, written))

    @abstractmethod
    def obey(self, text: bytes) -> None:
        """Do what a line of the host asks for, now; leave out what is no command."""

    @staticmethod
    @abstractmethod
    def ping(to: int) -> bytes:
        """Return the line by which a host asks another modem, by its address, for an answer."""

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
        """Send a message of a size now; one that asks waits for its answer."""
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
        """Take a signal that has been decoded, now."""
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
        """Answer a request, unless it is busy."""
        if not self.is_busy:
            content, size = self.answer(asked)
            self.send(ModemMessage(asked.sender, self.address, "answers", content), size)

    def _way_s(self, heard: HeardSignal, asked: Request) -> float:
        """Return how long (s) sound took to who answered, as measured there and back."""
        took = heard.began_at_s - asked.over_at_s - self.turnaround_s
        error = sqrt(2.0) * self.senses.travel_time_sd_s * self.node.random.standard_normal()
        return max(0.5 * (took + error), 0.0)

    @abstractmethod
    def told(self, heard: HeardSignal, message: ModemMessage) -> None:
        """Tell the host of a message, or of a request that will be answered."""

    @abstractmethod
    def answer(self, asked: ModemMessage) -> tuple[Any, int]:
        """Return the content of the answer to a request, and its size (bytes)."""

    @abstractmethod
    def answered(self, heard: HeardSignal, message: ModemMessage, way_s: float) -> None:
        """Tell the host of an answer, and how far (s) away its sender is."""

    @abstractmethod
    def unanswered(self, asked: Request) -> None:
        """Tell the host that no answer has come."""

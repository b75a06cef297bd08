"""EvoLogics S2C modems and the AT commands that their hosts speak.

Each vehicle is a modem, its address its number from 1 (AUVs first, then ASVs); those of ASVs have a
USBL array.  A host sends instant messages, of 64 bytes at most, which are delivered, or fail:

    AT*SENDIM,5,2,ack,hello      to address 2, which acknowledges
    OK
    DELIVEREDIM,2                or FAILEDIM,2 where no acknowledgement has come
    USBLLONG,...                 of a modem with an array: where the other is

and, at the other modem,

    RECVIM,5,1,2,ack,53125,-60,150,0.0,hello

The bytes of a message may be any, line ends among them; where fewer than said have come, the modem
waits for more.  A line that begins with `+++AT` (as of a host that leaves the modem in data mode)
is answered as `+++AT*SENDIM:2:OK`, and what happens is told as `+++AT:9:RECVSTART` from then on.
`AT?AL` and `AT!AL` are the address, `AT?AR` and `AT!AR` (reported as `RADDR,2`) the other's, `AT?T`
is the last travel time (us), `AT?CA` the sound speed (m/s), `AT?S` the state, `ATI` the make.

`USBLLONG` has the times of report and measurement (s), the other's address, where it is (m): to
starboard, ahead, up; east, north, up; roll, pitch and yaw (rad, anticlockwise from north), the
travel time (us), strength, integrity, accuracy; `USBLANGLES` bearing and elevation (rad) in the
modem's frame, clockwise from ahead, and from north.

Commands and reports are those of the maker's S2C guides, as public drivers read them.  Assumptions:
the bytes that a message needs on the air beside its content (`header_bytes`), signal strength,
integrity and the accuracy of USBL reports.
"""

import re
from math import asin, atan2, cos, pi, remainder, sin
from typing import Any

from .hosted import ALL, LINE_END, Modem, ModemMessage, Request
from .node import HeardSignal

# The address of all modems on the wire, and the highest of one modem.
BROADCAST, HIGHEST = 255, 254

# The longest instant message (bytes)
LONGEST = 64

# The beginning of a command that sends one, up to its content, with that one's length
MESSAGE = re.compile(rb"(?:\+\+\+)?AT\*SENDIM,(?:p\d+,)?(\d{1,2}),\d+,\w+,")

# Not simulated: strength (dB) and integrity of signals, accuracy of USBL (rad).
STRENGTH_DB, INTEGRITY, ACCURACY = -60, 150, 0.01


class Evologics(Modem):
    """A vehicle's S2C modem."""

    timeout_m, turnaround_s = 3500.0, 0.05
    header_bytes = 8
    most_bytes = LONGEST + header_bytes
    is_prefixed = False
    way_s, remote = 0.0, 1

    # The wire

    @staticmethod
    def lines_of(text: bytes) -> tuple[list[bytes], bytes]:
        """As of any modem, but line ends among the bytes of an instant message are content."""
        lines: list[bytes] = []
        while True:
            message = MESSAGE.match(text)
            content_ends = 0 if message is None else message.end() + int(message[1])
            end = re.compile(LINE_END).search(text, content_ends)
            if end is None:
                return lines, text
            lines.append(text[: end.start()])
            text = text[end.end() :]

    @staticmethod
    def ping(to: int) -> bytes:
        return b"AT*SENDIM,1,%d,ack,." % to

    def obey(self, text: bytes) -> None:
        """Execute a command, and report its status to the host."""
        is_prefixed = text.startswith(b"+++")
        text = text.removeprefix(b"+++")
        if not text.startswith(b"AT"):
            return
        self.is_prefixed = is_prefixed
        name, _, rest = text[2:].partition(b",")
        answer = self._sent(rest) if name == b"*SENDIM" else self._asked_for(text[2:])
        prefix = b"+++AT%s:%d:" % (name[:16], len(answer)) if is_prefixed else b""
        self.say(prefix + answer)

    def _sent(self, rest: bytes) -> bytes:
        """Send an instant message; return the reply to the host."""
        pool, _, others = rest.partition(b",")
        rest = others if pool[:1] == b"p" else rest
        size, to, flag, content = (*rest.split(b",", 3), b"", b"", b"")[:4]
        if not (size.isdigit() and to.isdigit() and flag in (b"ack", b"noack", b"force")):
            return b"ERROR WRONG FORMAT"
        address, length = int(to[:4]), int(size[:4])
        if length != len(content) or not 1 <= length <= LONGEST:
            return b"ERROR WRONG LENGTH"
        asks = flag == b"ack"
        is_known = 1 <= address <= HIGHEST or (address == BROADCAST and not asks)
        if not is_known or address == self.address:
            return b"ERROR WRONG DESTINATION ADDRESS"
        if self.is_busy:
            return b"BUSY DELIVERING INSTANT MESSAGE"
        role = "asks" if asks else "tells"
        receiver = ALL if address == BROADCAST else address
        self.send(ModemMessage(receiver, self.address, role, content), self.header_bytes + length)
        lasts = round(1e6 * self.node.lasts_s(self.header_bytes + length))
        begins, over = self.node.wait(0.0), self.node.wait(1e-6 * lasts)  # after the OK
        begins.callbacks.append(lambda _: self._report(f"SENDSTART,{address},im,{lasts},0"))
        over.callbacks.append(lambda _: self._report(f"SENDEND,{address},im,{self._us},{lasts}"))
        return b"OK"

    def _asked_for(self, command: bytes) -> bytes:
        """Return the reply to a command that sends nothing."""
        if command.startswith(b"!AL"):
            new = command[3:]
            if not (new.isdigit() and 1 <= int(new[:4]) <= HIGHEST):
                return b"ERROR OUT OF RANGE"
            self.address = int(new)
            return b"OK"
        if command.startswith(b"!AR"):
            if not command[3:].isdigit():
                return b"ERROR OUT OF RANGE"
            self.remote = int(command[3:][:4])
            self.node.wait(0.0).callbacks.append(lambda _: self._report(f"RADDR,{self.remote}"))
            return b"OK"
        answers = {
            b"?AR": str(self.remote),
            b"?AL": str(self.address),
            b"?T": str(round(1e6 * self.way_s)),
            b"?CA": str(round(self.senses.sound_speed)),
            b"?S": "INITIATION LISTEN",
            b"I": "S2C (bindusbl-des)",
        }
        if command in answers:
            return answers[command].encode("ascii")
        is_setting = (command[:1] in b"!@&Z" and len(command) > 1) or command in (b"C", b"O", b"")
        return b"OK" if is_setting else b"ERROR WRONG COMMAND"

    @property
    def _us(self) -> int:
        """The modem's clock (us)."""
        return round(1e6 * self.node.clock)

    def _report(self, event: str | bytes) -> None:
        """Report an event to the host."""
        told = event.encode("ascii") if isinstance(event, str) else event
        self.say(b"+++AT:%d:%s" % (len(told), told) if self.is_prefixed else told)

    # The air

    def told(self, heard: HeardSignal, message: ModemMessage) -> None:
        lasts = round(1e6 * (heard.ended_at_s - heard.began_at_s))
        self._report("RECVSTART")
        self._report(f"RECVEND,{self._us},{lasts},{STRENGTH_DB},{INTEGRITY}")
        flag = "ack" if message.role == "asks" else "noack"
        to = BROADCAST if message.to == ALL else message.to
        begins = f"RECVIM,{len(message.content)},{message.sender},{to},{flag},{lasts}"
        self._report(f"{begins},{STRENGTH_DB},{INTEGRITY},0.0,".encode("ascii") + message.content)

    def answer(self, asked: ModemMessage) -> tuple[Any, int]:
        return b"", self.header_bytes

    def answered(self, heard: HeardSignal, message: ModemMessage, way_s: float) -> None:
        self.way_s = way_s
        self._report(f"DELIVEREDIM,{message.sender}")
        sight = self.senses.sight(self.node, heard)
        if sight is None:
            return
        pose, away = self.senses.pose(self.node), way_s * self.senses.sound_speed
        north, east, down = (away * part for part in sight.direction)
        level = away * cos(sight.elevation)
        right, ahead = level * sin(sight.azimuth), level * cos(sight.azimuth)
        places = (right, ahead, away * sin(sight.elevation), east, north, -down)
        angles = (pose.roll, pose.pitch, -remainder(pose.yaw, 2.0 * pi))
        numbers = ",".join(f"{value:.4f}" for value in (*places, *angles))
        times = f"{self.node.clock:.6f},{heard.began_at_s:.6f},{message.sender}"
        way, quality = round(1e6 * way_s), f"{STRENGTH_DB},{INTEGRITY},{ACCURACY:.4f}"
        self._report(f"USBLLONG,{times},{numbers},{way},{quality}")
        bearing, elevation = atan2(east, north), -asin(sight.direction[2])
        seen = (sight.azimuth, sight.elevation, bearing, elevation, *angles)
        numbers = ",".join(f"{value:.4f}" for value in seen)
        self._report(f"USBLANGLES,{times},{numbers},{quality}")

    def unanswered(self, asked: Request) -> None:
        self._report(f"FAILEDIM,{asked.to}")

"""SeaTrac beacons (X150, X110 by Blueprint Subsea) and the serial protocol that their hosts speak.

Each vehicle is a beacon, numbered from 1 as vehicles are (AUVs first, then ASVs); ASVs are X150,
which have a USBL array, AUVs X110.  A host sends lines over a serial port, `#`, and gets lines,
`$`; each has a command's code (CID), its fields (little endian) and a checksum, in hexadecimal
digits:

    #400202xxxx   PING_SEND to beacon 2, as a request (REQ)
    $400002xxxx   taken (OK): beacon 2 will be asked
    $42....xxxx   PING_RESP: its answer has come, with a range

A host's command becomes a signal on the HF band.  A beacon that hears a request for itself answers
`turnaround_s` later, by itself, and reports to its own host.  The beacon that asked measures half
the round trip as its range; an X150 also measures a direction if that was asked for (REQU), and the
answer may have its sender's depth (REQX).  An answer that does not come within `timeout_m` is an
error, as at sea.

Codes, fields and units are those of the SeaTrac Developer Guide (firmware 3.7).  Assumptions: the
bytes that a message needs on the air beside its content (`header_bytes`), and the values of what is
not simulated: supply voltage, temperature, magnetometer, signal strength.
"""

import struct
from math import degrees
from typing import Any, NamedTuple

from ...records.events import ModemLine
from .hosted import ALL, Modem, ModemMessage, Request, SensedPose, Senses
from .node import HeardSignal, Node

# Most bytes that a message carries, and the highest address of a beacon.
MOST_BYTES, MOST_BEACONS = 31, 15

# Types of messages: one way, requests and their answers; U with USBL, X with depth as well.
OWAY, OWAYU, REQ, RESP, REQU, RESPU, REQX, RESPX = range(8)
ANSWER_TO = {REQ: RESP, REQU: RESPU, REQX: RESPX}

# Commands and events
ALIVE, INFO, REBOOT = 0x01, 0x02, 0x03
STATUS, STATUS_GET, STATUS_SET = 0x10, 0x11, 0x12
SETTINGS_GET, SETTINGS_SET, SETTINGS_LOAD, SETTINGS_SAVE, SETTINGS_RESET = range(0x15, 0x1A)
XCVR_FIX, XCVR_STATUS = 0x39, 0x3A
PING_SEND, PING_REQ, PING_RESP, PING_ERROR = range(0x40, 0x44)
ECHO_SEND, ECHO_REQ, ECHO_RESP, ECHO_ERROR = range(0x48, 0x4C)
NAV_SEND, NAV_REQ, NAV_RESP, NAV_ERROR = range(0x50, 0x54)
NAV_QUEUE_SET, NAV_QUEUE_CLEAR, NAV_QUEUE_STATUS, NAV_STATUS_SEND, NAV_STATUS = range(0x58, 0x5D)
DAT_SEND, DAT_RECEIVE, DAT_ERROR = 0x60, 0x61, 0x63
DAT_QUEUE_SET, DAT_QUEUE_CLEAR, DAT_QUEUE_STATUS = range(0x64, 0x67)

# Status of a command
OK, FAIL, MISSING, INVALID, BUSY, TIMEOUT = 0x00, 0x01, 0x04, 0x05, 0x30, 0x34
IDLE, SENDING, REQUESTING = 0x3B, 0x3C, 0x3D
REBOOT_CHECK = 0x6A95

# Fields of a status (STATUS_BITS), and intervals (s) at which it is sent unasked.
ENVIRONMENT, ATTITUDE = 1, 2
EVERY_S = {0: None, 1: 1.0, 2: 0.4, 3: 0.2, 4: 0.1, 5: 0.04}

# What NAV_QUERY asks a remote beacon for
DEPTH, SUPPLY, TEMPERATURE, POSE, DATA = 1, 2, 4, 8, 128
NAV_SIZES = {DEPTH: 4, SUPPLY: 2, TEMPERATURE: 2, POSE: 6}  # bytes

# Flags of a fix (ACOFIX), and of settings
HAS_RANGE, HAS_USBL, HAS_POSITION, IS_ENHANCED = 1, 2, 4, 8
FIX_MESSAGES = 0x40

# Not simulated: supply (mV), water (0.1 deg C), signal (0.1 dB); counts of the range timer (Hz).
SUPPLY_MV, WATER_DC, STRENGTH_CB, TIMER_HZ = 12_000, 150, 1_200, 16_000


def crc16(data: bytes) -> int:
    """Return the checksum of a line's bytes: CRC-16 with polynomial 0xA001, from 0.

    >>> hex(crc16(b"\\x15"))
    '0xcfc1'
    """
    crc = 0
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0xA001 if crc & 1 else 0)
    return crc


def line(mark: str, code: int, content: bytes = b"") -> bytes:
    """Return a line of the serial port, checksum included, without its end (CR LF): `mark` is `#`
    for a host's, `$` for a beacon's.

    >>> line("#", SETTINGS_GET)
    b'#15C1CF'
    """
    data = bytes((code,)) + content
    return f"{mark}{(data + struct.pack('<H', crc16(data))).hex().upper()}".encode("ascii")


def parsed(text: bytes, mark: str = "#") -> tuple[int, bytes]:
    """Return the code and the content of a line that begins with `mark` (`#` of a host, `$` of a
    beacon) and ends with its checksum; its end (CR LF) is already cut off.

    Raises:
        ValueError: when it is not such a line, or its checksum is wrong.
    """
    if not text.startswith(mark.encode("ascii")):
        raise ValueError(f"it does not begin with {mark}")
    data = bytes.fromhex(text[1:].decode("ascii"))
    if len(data) < 3:
        raise ValueError("it is too short")
    if struct.unpack("<H", data[-2:])[0] != crc16(data[:-2]):
        raise ValueError("its checksum is wrong")
    return data[0], data[1:-2]


class Settings(NamedTuple):
    """What a host may set (SETTINGS_T); most of it is stored without effect."""

    status_flags: int = 1
    status_output: int = ENVIRONMENT | ATTITUDE
    main_baud: int = 0x0D
    aux_baud: int = 0x0D
    mac: bytes = bytes(6)
    ip: bytes = bytes(16)
    tcp_port: int = 0
    env_flags: int = 2
    pressure_offset: int = 0
    salinity: int = 350
    sound_speed_dm_per_s: int = 15_000
    ahrs_flags: int = 0
    accelerometers: bytes = struct.pack("<6h", *3 * (-270,), *3 * (270,))
    magnetometers: bytes = struct.pack("<B8f", 1, 0, 0, 0, 1, 1, 1, 50, 0)
    gyroscopes: bytes = bytes(6)
    ahrs_yaw: int = 0
    ahrs_pitch: int = 0
    ahrs_roll: int = 0
    xcvr_flags: int = 1
    beacon: int = 1
    timeout_m: int = 1000
    turnaround_ms: int = 10
    attitude: bytes = bytes(6)
    position_filter: bytes = bytes((3, 10, 60))

    @property
    def every_s(self) -> float | None:
        """Interval (s) at which the status is sent unasked."""
        return EVERY_S[self.status_flags & 7]


SETTINGS = struct.Struct("<4B6s16sHBiHHB12s33s6s3HBBHH6s3s")


class Content(NamedTuple):
    """Content of a message: its type (OWAY to RESPX), the command that it came of (`about`, a key
    of SENDS), its bytes, and its sender's depth (m).
    """

    type: int
    about: int
    data: bytes = b""
    depth_m: float = 0.0


class Code(NamedTuple):
    """Codes of a command that becomes a message: of the event at the other host, of its answer, of
    its error.
    """

    heard: int
    answered: int
    error: int


SENDS = {
    PING_SEND: Code(PING_REQ, PING_RESP, PING_ERROR),
    ECHO_SEND: Code(ECHO_REQ, ECHO_RESP, ECHO_ERROR),
    DAT_SEND: Code(DAT_RECEIVE, DAT_RECEIVE, DAT_ERROR),
    NAV_SEND: Code(NAV_REQ, NAV_RESP, NAV_ERROR),
    NAV_STATUS_SEND: Code(NAV_STATUS, 0, 0),
}

# Commands that set, clear and report a queue of answers, and the command that is answered from it.
QUEUES = {
    DAT_QUEUE_SET: DAT_SEND, DAT_QUEUE_CLEAR: DAT_SEND, DAT_QUEUE_STATUS: DAT_SEND,
    NAV_QUEUE_SET: NAV_SEND, NAV_QUEUE_CLEAR: NAV_SEND, NAV_QUEUE_STATUS: NAV_SEND,
}  # fmt: skip


class Seatrac(Modem):
    """A vehicle's beacon."""

    header_bytes = 8
    most_bytes = MOST_BYTES + header_bytes

    def __init__(self, node: Node, senses: Senses, address: int, lines: list[ModemLine]) -> None:
        super().__init__(node, senses, address, lines)
        self.settings = self._defaults = Settings(beacon=address)
        self._queues: dict[tuple[int, int], bytes] = {}
        self._modes = 0  # times that the status mode was set
        self._tell_statuses()

    # The wire

    @staticmethod
    def ping(to: int) -> bytes:
        return line("#", PING_SEND, bytes((to, REQU)))

    def obey(self, text: bytes) -> None:
        """Execute a command, and report its status to the host."""
        begins = max(text.rfind(b"#"), 0)  # half a line may stand before it
        try:
            code, content = parsed(text[begins:].strip())
        except ValueError:
            return
        try:
            if code in SENDS:
                self._tell(code, self._ordered(code, content))
            elif code in QUEUES:
                self._tell(code, self._queued(code, content))
            else:
                self._tell(code, self._answered(code, content))
        except (struct.error, IndexError):  # too few fields
            self._tell(code, bytes((MISSING, *content[:1])))

    def _ordered(self, code: int, content: bytes) -> bytes:
        """Send the message of a command (code and content); return the reply to the host."""
        if code == NAV_STATUS_SEND:
            to, kind, data = ALL, OWAY, content[:1] + _counted(content[1:])
        elif code == NAV_SEND:
            to, kind, data = content[0], REQU, content[1:2] + _counted(content[2:])
        else:
            to, kind = content[0], content[1]
            data = b"" if code == PING_SEND else _counted(content[2:])
        asks, named = kind in ANSWER_TO, content[0]  # whom the host names in its command
        is_right = (
            (asks or (kind in (OWAY, OWAYU) and code in (DAT_SEND, NAV_STATUS_SEND)))
            and named <= MOST_BEACONS and to != self.address and not (asks and to == ALL)
            and len(data) <= MOST_BYTES
        )  # fmt: skip
        status = INVALID if not is_right else BUSY if self.is_busy else OK
        if status == OK:
            said = ModemMessage(
                to, self.address, "asks" if asks else "tells", Content(kind, code, data)
            )
            self.send(said, self.header_bytes + len(data))
        return bytes((status, named))

    def _queued(self, code: int, content: bytes) -> bytes:
        """Change or report the content of answers to a beacon; return the reply to the host."""
        about = QUEUES[code]
        if code in (DAT_QUEUE_STATUS, NAV_QUEUE_STATUS):
            sizes = [len(self._queues.get((about, to), b"")) for to in range(MOST_BEACONS + 1)]
            return bytes(sizes)
        to = content[0]
        if code in (DAT_QUEUE_CLEAR, NAV_QUEUE_CLEAR):
            self._queues.pop((about, to), None)
            return bytes((OK, to))
        data = _counted(content[1:])
        is_right = to <= MOST_BEACONS and len(data) < MOST_BYTES
        if is_right:
            self._queues[about, to] = data
        return bytes((OK if is_right else INVALID, to, len(data)))

    def _answered(self, code: int, content: bytes) -> bytes:
        """Return the reply to a command (code and content) that sends nothing on the air."""
        seconds = int(self.node.clock)
        if code == ALIVE:
            return struct.pack("<I", seconds)
        if code == INFO:
            part = 795 if self.node.is_asv else 843
            hardware = struct.pack("<HBIHH", part, 1, self.node.number + 1, 0, 0)
            firmware = [struct.pack("<BHBBHI", 1, number, 3, 7, 0, 0) for number in (943, 795)]
            return struct.pack("<IB", seconds, 1) + hardware + b"".join(firmware) + bytes(1)
        if code == STATUS:
            return self._status(content[0] if content else self.settings.status_output)
        if code == STATUS_GET:
            return bytes((self.settings.status_output, self.settings.status_flags & 7))
        if code == STATUS_SET:
            output, mode = content[0], content[1]
            return self._set(self.settings._replace(status_output=output, status_flags=mode))
        if code == SETTINGS_GET:
            return SETTINGS.pack(*self.settings)
        if code == SETTINGS_SET:
            return self._set(Settings(*SETTINGS.unpack(content[: SETTINGS.size])))
        if code in (SETTINGS_LOAD, SETTINGS_SAVE):
            return bytes((OK,))
        if code == SETTINGS_RESET:
            return self._set(self._defaults)
        if code == XCVR_STATUS:
            return bytes((REQUESTING if self.is_asking else SENDING if self.is_busy else IDLE,))
        if code == REBOOT:
            return bytes((OK if struct.unpack("<H", content[:2])[0] == REBOOT_CHECK else FAIL,))
        return bytes((FAIL,))

    def _set(self, settings: Settings) -> bytes:
        """Take settings, if they are valid; return the reply to the host."""
        is_right = (
            settings.status_flags & 7 in EVERY_S
            and 1 <= settings.beacon <= MOST_BEACONS
            and 100 <= settings.timeout_m <= 3000
            and 10 <= settings.turnaround_ms <= 1000
        )
        if is_right:
            is_new = settings.every_s != self.settings.every_s
            self.settings, self.address = settings, settings.beacon
            self.timeout_m, self.turnaround_s = settings.timeout_m, 1e-3 * settings.turnaround_ms
            if is_new:
                self._tell_statuses()
        return bytes((OK if is_right else INVALID,))

    # Lines to the host

    def _tell(self, code: int, content: bytes) -> None:
        self.say(line("$", code, content))

    def _tell_statuses(self) -> None:
        """Send the status at the interval that is set, from now on."""
        self._modes += 1
        mode, every_s = self._modes, self.settings.every_s

        def tell(_: object) -> None:
            if mode == self._modes and every_s is not None:
                self._tell(STATUS, self._status(self.settings.status_output))
                self.node.wait(every_s).callbacks.append(tell)

        if every_s is not None:
            self.node.wait(every_s).callbacks.append(tell)

    def _status(self, output: int) -> bytes:
        """Return the fields of a status that `output` asks for."""
        pose = self.senses.pose(self.node)
        told = struct.pack("<BQ", output & (ENVIRONMENT | ATTITUDE), int(1e3 * self.node.clock))
        if output & ENVIRONMENT:
            pressure, speed = round(100.5 * pose.depth_m), round(10 * self.senses.sound_speed)
            told += struct.pack(
                "<HhiiH", SUPPLY_MV, WATER_DC, pressure, round(10 * pose.depth_m), speed
            )
        if output & ATTITUDE:
            told += struct.pack("<3h", *_attitude(pose))
        return told

    # The air

    def told(self, heard: HeardSignal, message: ModemMessage) -> None:
        content: Content = message.content
        fix, data = self._fix(heard, message), content.data
        if content.about == NAV_SEND:
            fix, data = fix + data[:1], data[1:]
        self._tell(SENDS[content.about].heard, self._event(message, fix, data, is_answer=False))

    def answer(self, asked: ModemMessage) -> tuple[Any, int]:
        pose, content, data = self.senses.pose(self.node), asked.content, b""
        if content.about == ECHO_SEND:
            data = content.data
        elif content.about == DAT_SEND:
            data = self._queues.pop((DAT_SEND, asked.sender), b"")
        elif content.about == NAV_SEND:
            flags = content.data[0]
            data = content.data[:1] + self._navigation(flags, pose)
            queued = self._queues.pop((NAV_SEND, asked.sender), b"") if flags & DATA else b""
            data += queued[: MOST_BYTES - len(data)]
        kind, depth = ANSWER_TO[content.type], round(2 * pose.depth_m) / 2
        return Content(kind, content.about, data, depth), self.header_bytes + len(data)

    def answered(self, heard: HeardSignal, message: ModemMessage, way_s: float) -> None:
        content: Content = message.content
        fix, data = self._fix(heard, message, way_s), content.data
        if content.about == NAV_SEND:
            known = 1 + sum(size for flag, size in NAV_SIZES.items() if data[0] & flag)
            fix, data = fix + data[:known], data[known:]
        self._tell(SENDS[content.about].answered, self._event(message, fix, data, is_answer=True))
        if self.settings.xcvr_flags & FIX_MESSAGES:
            self._tell(XCVR_FIX, self._fix(heard, message, way_s))

    def unanswered(self, asked: Request) -> None:
        self._tell(SENDS[asked.content.about].error, bytes((TIMEOUT, asked.to)))

    def _event(self, message: ModemMessage, fix: bytes, data: bytes, *, is_answer: bool) -> bytes:
        """Return the report of a message to the host: the fix, and its data."""
        about = message.content.about
        if about == PING_SEND:
            return fix
        if about == NAV_STATUS_SEND:
            fix, data = fix + data[:1], data[1:]
        fix += bytes((255 * is_answer,)) if about == DAT_SEND else b""
        return fix + bytes((len(data),)) + data + (b"" if about == ECHO_SEND else b"\xff")

    @staticmethod
    def _navigation(flags: int, pose: SensedPose) -> bytes:
        """Return the data that the `flags` of a NAV_QUERY ask for."""
        told = struct.pack("<i", round(10 * pose.depth_m)) if flags & DEPTH else b""
        told += struct.pack("<H", SUPPLY_MV) if flags & SUPPLY else b""
        told += struct.pack("<h", WATER_DC) if flags & TEMPERATURE else b""
        return told + (struct.pack("<3h", *_attitude(pose)) if flags & POSE else b"")

    def _fix(self, heard: HeardSignal, message: ModemMessage, way_s: float | None = None) -> bytes:
        """Return what this beacon measures of a message's sender (ACOFIX): a range from the travel
        time `way_s` (s) if known, a direction if it has an array and the type of message allows it.
        """
        pose, speed = self.senses.pose(self.node), self.senses.sound_speed
        content, flags, told, range_m = message.content, 0, b"", None
        if way_s is not None:
            range_m, flags = speed * way_s, HAS_RANGE
            counts = round(TIMER_HZ * (2.0 * way_s + self.turnaround_s))
            told += struct.pack(
                "<IiH", counts, round(1e7 * way_s), min(round(10 * range_m), 65_535)
            )
        sight = None
        if content.type in (OWAYU, REQU, RESPU, REQX, RESPX):
            sight = self.senses.sight(self.node, heard)
        if sight is not None:
            flags |= HAS_USBL
            azimuth, elevation = degrees(sight.azimuth) % 360.0, degrees(sight.elevation)
            told += struct.pack("<B4h", 4, *4 * (STRENGTH_CB,))
            told += struct.pack("<hhh", round(10 * azimuth) % 3600, round(10 * elevation), 0)
            if range_m is not None:
                flags |= HAS_POSITION
                north, east, down = (range_m * part for part in sight.direction)
                depth = pose.depth_m + down
                if content.type == RESPX:
                    depth, flags = content.depth_m, flags | IS_ENHANCED
                told += struct.pack("<3h", *map(_decimetres, (east, north, depth)))
        begins = struct.pack(
            "<4B3hHHh", message.to, message.sender, flags, content.type, *_attitude(pose),
            max(round(10 * pose.depth_m), 0), round(10 * speed), STRENGTH_CB,
        )  # fmt: skip
        return begins + told


def _counted(content: bytes) -> bytes:
    """Return the data behind a first byte with their length; ignore what follows them.

    Raises:
        IndexError: when there are fewer.
    """
    size = content[0]
    if len(content) <= size:
        raise IndexError
    return content[1 : size + 1]


def _attitude(pose: SensedPose) -> tuple[int, int, int]:
    """Return yaw, pitch and roll in tenths of degrees."""
    yaw = round(10 * (degrees(pose.yaw) % 360.0)) % 3600
    return yaw, round(10 * degrees(pose.pitch)), round(10 * degrees(pose.roll))


def _decimetres(length: float) -> int:
    """Return a length (m) in decimetres, limited to 16 bits."""
    return min(max(round(10 * length), -32_768), 32_767)

"""Rows of the record: numpy records made from the event classes, filled during the mission.

Vehicles and outcomes are numbers.  A value whose event has not happened is NaN, or NONE for
integers.
"""

import types
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any, get_args, get_type_hints

import numpy as np
from numpy.typing import NDArray

from ...support.arrays import lengthened
from ...support.compiled import compiled
from ...support.packed import Packed
from .events import (
    HEARD,
    LASTING_ERRORS,
    WORDS,
    Assignment,
    AuvFrame,
    AuvFrameReception,
    Broadcast,
    Fix,
    FixService,
    FrameReception,
    ModemLine,
    Packet,
    PeerRange,
    Ping,
    Reception,
    Round,
    Signal,
    SignalReception,
)
from .events import NONE as NONE

Rows = NDArray[np.void]
Row = Any  # one of them: the type checker knows no fields


def row_type(
    event: type, further: Mapping[str, type] | None = None, without: tuple[str, ...] = ()
) -> np.dtype[np.void]:
    """Return the record type of an event class: a field for each of its own, then `further` ones
    that only missions need.  Fields of text hold numbers.

    >>> row_type(Reception, {"answered_s": float}).names[-2:]
    ('clock_late_s', 'answered_s')
    """
    hints = get_type_hints(event)
    columns = {
        field.name: hints[field.name] for field in fields(event) if field.name not in without
    }
    return np.dtype([(name, _kind(hint)) for name, hint in {**columns, **(further or {})}.items()])


@compiled
def fix_numbered(fixes: Rows, gnss: Rows, number: int) -> Row:
    """Return a fix of the buffers `fixes` and `gnss`, by its number: -1 - k is row k of `gnss`."""
    return fixes[number] if number >= 0 else gnss[-1 - number]


def _kind(hint: Any) -> str:
    if isinstance(hint, types.UnionType):
        hint = next(arg for arg in get_args(hint) if arg is not type(None))
    return "f8" if hint is float else "i8"


# The call before a ping: when and by which ASV, its outcome and why, its travel time (s)
CALLED = np.dtype(
    [
        *(("called_at_s", "f8"), ("called_by", "i8")),
        *(("call", "i8"), ("call_why", "i8"), ("call_time_s", "f8")),
    ]
)

PING = row_type(
    Ping,
    {
        "call_time_s": float,  # how long its call was under way; NaN where ranges are one-way
        "first": int,  # its receptions,
        "end": int,  # up to but not this one
        "passed_at_s": float,  # when it has passed all ASVs in range; infinite once it is decided
        "longest_s": float,  # longest travel time of any ping up to this one
        "calls": int,  # sounds of calls on record when it was sent
    },
)

# One array's measurement of a ping: the array's own position (m), the measured offset to the AUV
# (m); variances of the range, of the array's position along each axis (m2), of a rotation of all
# directions about the vertical, and of the direction beside that: horizontal, vertical, and their
# covariance (rad2).  `range_m2` NaN: not known apart from other ASVs' measurements.  For an answer
# to a call the offset is as long as the whole path of both, and `range_m2` its variance; then the
# caller's own position (m; NaN: no call), how long (s) before its ping the AUV had heard the call,
# and whether the ASV that has heard the answer is the caller (1 or 0).
SIGHT = dict.fromkeys(
    (
        *("from_x_m", "from_y_m", "from_z_m", "ahead_x_m", "ahead_y_m", "ahead_z_m"),
        *("range_m2", "from_m2", "turn_rad2", "level_rad2", "steep_rad2", "both_rad2"),
        *("caller_x_m", "caller_y_m", "caller_z_m", "called_before_s", "is_caller"),
    ),
    float,
)

# Velocity (m/s) of a reception's ASV as it heard, or pinged, where range rates are measured; else
# NaN.
OWN_WAY = dict.fromkeys(("own_x_m_per_s", "own_y_m_per_s", "own_z_m_per_s"), float)

RECEPTION = row_type(
    Reception,
    {
        "listener": int,  # the listener's number in its fleet
        "sent_at_s": float,
        "ended_at_s": float,
        "loss": float,  # probability that it is lost if nothing overlaps it
        "slow_range": float,  # slow error of its range, a standard normal; NaN where there is none
        "sound": float,  # its strength where it overlaps others (see `acoustics.propagation`)
        "bent_s": float,  # how much later it arrives than on a straight ray, where rays bend
        "late_s": float,  # how much later than that it seems to arrive by echoes that blend into it
        "lowered": float,  # and how much the sine of its angle downwards grows; NaN without echoes
        **SIGHT,
        **OWN_WAY,
    },
    without=("level_db", "margin_db", "loss_probability", *LASTING_ERRORS),
)

FRAME_RECEPTION = row_type(
    FrameReception,
    {"ended_at_s": float},  # when the end of the frame arrives; infinite while unknown
)

SIGNAL_RECEPTION = row_type(
    SignalReception,
    {"vehicle": int},  # the listener's number among all vehicles: AUVs first, then ASVs
    without=("listener",),
)

AUV_FRAME_RECEPTION = row_type(
    AuvFrameReception,
    {"vehicle": int},
    without=("listener",),  # as in SIGNAL_RECEPTION
)

FIX = row_type(
    Fix,
    {
        "first": int,  # the receptions that it may be made of,
        "end": int,  # up to but not this one
        "arrives_at_s": float,  # when it reaches its AUV
        "frame": int,  # the frame that carries it
        "said_x_m": float,  # the fix expanded about an estimate (:mod:`..navigation.turning`)
        "said_y_m": float,
        "said_xx_m2": float,  # and its covariance
        "said_yy_m2": float,
        "said_xy_m2": float,
        "said_polar": int,  # 1: a range and a direction, in which common errors are linear
    },
    without=("asvs",),
)

# A fix as a user-defined navigator is given it: the columns of table `fixes`, and no others.  Texts
# are texts, vehicles their numbers; what has not happened is NaN, or NONE.
FIX_IN_WORDS = np.dtype(
    [(name, "O" if hint is str else _kind(hint)) for name, hint in get_type_hints(Fix).items()]
)


def in_words(fix: Row, receptions: Rows) -> Any:
    """Return a row of the buffer of fixes as a record array (1,), :data:`FIX_IN_WORDS`."""
    told = np.recarray(1, FIX_IN_WORDS)
    for name in {*(FIX_IN_WORDS.names or ())} - {"outcome", "asvs"}:
        told[name] = fix[name]
    told["outcome"], told["asvs"] = WORDS[fix["outcome"]], fused(fix, receptions)
    return told


def fused(fix: Row, receptions: Rows) -> str:
    """Return the names of the ASVs whose measurements a fix was fused from."""
    own = receptions[fix["first"] : fix["end"]]
    return " ".join(f"ASV{asv}" for asv in own["asv"][own["outcome"] == HEARD])


# A navigator's belief for the AUV's autopilot: the instant of the last correction, the integrals of
# the heading (s) and dead reckoning (m) up to it, the velocity bias and the current (m/s), scale
# and rotation of the path, and the wandering bias (m/s) with its time constant (s).
LEARNT = np.dtype(
    [
        ("at_s", "f8"),
        ("cosine_s", "f8"),
        ("sine_s", "f8"),
        ("x_m", "f8"),
        ("y_m", "f8"),
        ("bias", "f8", (2,)),
        ("current", "f8", (2,)),
        ("stretch", "f8"),
        ("turn", "f8"),
        ("roaming", "f8", (2,)),
        ("time_constant_s", "f8"),
    ]
)


# Rows of a new buffer; it doubles when it is full.
ROOM = 2048


class EventBuffer:
    """Records of one kind in one array, to which compiled equations write.

    The array begins with the rows so far; when it has to grow, a new array replaces it.
    """

    def __init__(self, kind: np.dtype[Any]) -> None:
        self.array: Rows = np.empty(ROOM, dtype=kind)
        self.count = 0
        self._packed: list[tuple[Packed, str]] = []

    def hand_on(self, to: Packed, name: str) -> None:
        """Renew a field of a packed tuple whenever the array is replaced."""
        self._packed.append((to, name))

    @property
    def rows(self) -> Rows:
        """The rows so far, shape (count,)."""
        return self.array[: self.count]

    def room_for(self, count: int) -> Rows:
        """Return the array with space for so many further rows."""
        if self.count + count > len(self.array):
            length = len(self.array)
            while self.count + count > length:
                length *= 2
            self.array = lengthened(self.rows, length)
            for packed, name in self._packed:
                packed.renew(name, self.array)
        return self.array


class Jacobians:
    """Jacobians of fixes, row by row, by k estimated errors that they have in common.

    `of` (n, 2, 4 k + 2): J along x and y, its derivatives along x, along y and by each error, and
    the derivatives by the displacement along x and y (m) back to where a call was heard; `left` (n,
    3): the remaining covariance xx, yy, xy, m2, without these errors.
    """

    def __init__(self, columns: int) -> None:
        """Take the number k of errors."""
        self.columns = columns
        self.of, self.left = np.empty((0, 2, 4 * columns + 2)), np.empty((0, 3))
        self._packed: list[Packed] = []

    def hand_on(self, to: Packed) -> None:
        """Renew the fields `jacobians` and `left` of a packed tuple whenever both are replaced."""
        self._packed.append(to)

    def make_room(self, rows: int) -> None:
        """Reserve space for so many rows."""
        if rows > len(self.of):
            self.of, self.left = lengthened(self.of, rows), lengthened(self.left, rows)
            for packed in self._packed:
                packed.renew("jacobians", self.of)
                packed.renew("left", self.left)


@dataclass
class Recorder:
    """The event rows of one mission.

    Pings, receptions and fixes are many, and stored as numpy records (:mod:`.rows`).  Without
    `everything` receptions out of range are not stored, and of frames only destroyed ones.
    """

    everything: bool = True
    rounds: list[Round] = field(default_factory=list)
    pings: EventBuffer = field(default_factory=lambda: EventBuffer(PING))
    receptions: EventBuffer = field(default_factory=lambda: EventBuffer(RECEPTION))
    broadcasts: list[Broadcast] = field(default_factory=list)
    frame_receptions: EventBuffer = field(default_factory=lambda: EventBuffer(FRAME_RECEPTION))
    assignments: list[Assignment] = field(default_factory=list)
    signals: list[Signal] = field(default_factory=list)
    signal_receptions: EventBuffer = field(default_factory=lambda: EventBuffer(SIGNAL_RECEPTION))
    auv_frames: list[AuvFrame] = field(default_factory=list)
    auv_frame_receptions: Rows = field(default_factory=lambda: np.empty(0, AUV_FRAME_RECEPTION))
    packets: list[Packet] = field(default_factory=list)
    services: list[FixService] = field(default_factory=list)  # of the first so many fixes
    fixes: EventBuffer = field(default_factory=lambda: EventBuffer(FIX))
    jacobians: Jacobians = field(default_factory=lambda: Jacobians(0))
    gnss_fixes: EventBuffer = field(default_factory=lambda: EventBuffer(FIX))  # AUVs' own
    peer_ranges: list[PeerRange] = field(default_factory=list)
    modem_lines: list[ModemLine] = field(default_factory=list)

    @property
    def frames(self) -> list[Broadcast | AuvFrame]:
        """All frames on MF, of ASVs and AUVs, in the order in which they began."""
        if not self.auv_frames:
            return list(self.broadcasts)
        return sorted([*self.broadcasts, *self.auv_frames], key=lambda frame: frame.sent_at_s)

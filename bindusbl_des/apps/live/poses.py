"""Poses of AUVs that another simulator or an autopilot moves, as datagrams of whoever sends them.

Each is NMEA (GGA and HDT: of AUV0), MAVLink (GLOBAL_POSITION_INT and ATTITUDE: system 1 is AUV0),
or lines of JSON.  What cannot be is counted and told, and the AUV stays where it was last.  Depths
of MAVLink are below home, where an autopilot takes the surface to be: its `alt` counts from the
sea, above which a lake may be.
"""

import json
import math
import re
import socket
from codecs import BOM_UTF8
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from time import monotonic
from typing import Any

import numpy as np

from ...core.geometry.geodesy import ned_at_depth
from ...core.vehicles.tracks import FARTHEST
from ...models.charts.shapes import HIGHEST, BadChart, position
from ...support.arrays import Floats
from . import mavlink
from .mavlink import ATTITUDE, messages
from .nmea import checksum

# Faster (m/s) is no vehicle under water.
FASTEST = 50.0

# Whose poses are missing for so long (s) is said.
SILENCE_S = 2.0

# How a datagram of MAVLink begins.
MAGIC = tuple(bytes([byte]) for byte in (mavlink.MAGIC, mavlink.MAGIC_1))

# Datagrams are at most so long (bytes): some 30 lines of JSON.
LONGEST = 4096

# At each look so many lines are read, and more for each AUV; what else has come waits.
LINES, LINES_EACH = 64, 32

# A message of MAVLink has so many bytes at least.
SHORTEST = 32

# What a sentence of NMEA begins with: who talks, and of what.
ADDRESS = re.compile(r"[A-Z0-9]{4,}")

# What is said of a vehicle: some of x, y, z (m), latitude, longitude (deg), yaw (rad).
Said = dict[str, float]

# Keys of JSON: what they are called here, and the factor to these units.
KEYS = {
    "x_m": ("x", 1.0), "y_m": ("y", 1.0), "z_m": ("z", 1.0), "depth_m": ("z", 1.0),
    "lat_deg": ("lat", 1.0), "lon_deg": ("lon", 1.0), "heading_deg": ("yaw", math.pi / 180.0),
}  # fmt: skip


class Nonsense(ValueError):
    """A datagram, or a part of it, that says no pose."""


class Received:
    """The poses that have been received: a :class:`...core.vehicles.poses.PoseSource`.

    Until each AUV has been heard of, a mission cannot begin (:attr:`missing`).
    """

    def __init__(
        self,
        host: str,
        port: int,
        auvs: int,
        origin: Sequence[float] | None,
        depths_m: Sequence[float] = (),
    ) -> None:
        """Listen to datagrams on a port; AUVs of which no depth is said are at `depths_m` (at the
        surface without), or as deep as before.

        Raises:
            OSError: when it is taken.
        """
        self._socket = socket.socket(
            socket.AF_INET6 if ":" in host else socket.AF_INET, socket.SOCK_DGRAM
        )
        try:
            self._socket.bind((host, port))
        except OSError:
            self._socket.close()
            raise
        self._socket.setblocking(False)
        #: The port that it listens on; of port 0 the one that was free.
        self.port = self._socket.getsockname()[1]
        self._origin = origin
        self._surface_m = 0.0 if origin is None else (*origin, 0.0)[2]
        self._said: list[Said] = [{"z": depth} for depth in depths_m or [0.0] * auvs]
        self._goals, self._given = np.full((auvs, 4), np.nan), np.full((auvs, 4), np.nan)
        self._placed_at = [math.nan] * auvs  # a heading alone says nothing of a place
        self._given_at: float | None = None
        #: How many poses were taken, and how many not, by why.
        self.counts: Counter[str] = Counter()
        self.longest_silence_s = 0.0

    @property
    def missing(self) -> tuple[str, ...]:
        """The AUVs of which nothing has been heard yet."""
        return tuple(f"AUV{auv}" for auv in np.flatnonzero(np.isnan(self._goals).any(axis=1)))

    def advance_to(self, time: float) -> Mapping[str, Floats]:
        """Return where AUVs are at an instant (s): where they were heard of last.

        Who has been silent comes back no faster than anybody goes.
        """
        self.listen()
        if self._given_at is None:
            self._given = self._goals.copy()
        else:
            away = self._goals - self._given
            way = np.linalg.norm(away[:, :3], axis=1)
            most = 0.9 * FASTEST * max(time - self._given_at, 0.0)
            share = np.minimum(1.0, most / np.maximum(way, 1e-9))
            self._given[:, :3] += share[:, None] * away[:, :3]
            self._given[:, 3] = self._goals[:, 3]
        self._given_at = time
        silence = monotonic() - min(self._placed_at)
        self.longest_silence_s = max(self.longest_silence_s, silence)
        return {"auvs": self._given.copy()}

    def listen(self) -> None:
        """Take in datagrams that have come, as many as a look has time for."""
        left = LINES + LINES_EACH * len(self._said)
        while left > 0:
            try:
                text = self._socket.recv(LONGEST + 1)
            except BlockingIOError:
                return
            except OSError:
                text = b""
            left -= self.take(text)

    def take(self, text: bytes) -> int:
        """Take in a datagram; return how many lines that is, or messages that may be in it."""
        if len(text) > LONGEST:
            self.counts[f"longer than {LONGEST} bytes"] += 1
            return 1
        # In MAVLink a byte may look like a space
        parts = [text] if _is_mavlink(text) else list(map(bytes.strip, text.splitlines()))
        for part in parts:
            with self._counting():
                for auv, said in _read(part):
                    with self._counting():  # what else a datagram says holds
                        self._note(auv, said)
        return max(len(parts), len(text) // SHORTEST, 1)

    @contextmanager
    def _counting(self) -> Iterator[None]:
        try:
            yield
        except Nonsense as error:
            self.counts[str(error)] += 1

    def _note(self, auv: int, said: Said) -> None:
        if auv not in range(len(self._said)):
            raise Nonsense("of no AUV that there is")
        if not all(math.isfinite(number) for number in said.values()):
            raise Nonsense("not finite")
        if "height" in said:
            where = {name: value for name, value in said.items() if name != "height"}
            said = {**where, "z": self._surface_m - said["height"]}
        if {"lat", "x"} & set(said):  # a place of one frame takes the place of the other's
            before = self._said[auv]
            known = {"yaw": before.get("yaw", 0.0), "z": before["z"]} | said
        else:
            known = self._said[auv] | said
        place = self._place(known)
        if place is None:  # more is to come
            self._said[auv] = known
            return
        pose, now = np.array([*place, known.get("yaw", 0.0)]), monotonic()
        was, since = self._goals[auv], now - self._placed_at[auv]
        if not np.abs(pose).max() <= FARTHEST:
            raise Nonsense("far from the survey")
        if pose[2] < -HIGHEST:
            raise Nonsense("out of the water: depths are positive, heights (GGA) negative below it")
        if not np.isnan(was).any() and math.dist(pose[:3], was[:3]) > FASTEST * (since + 1.0):
            raise Nonsense("farther than anybody goes")
        self._said[auv], self._goals[auv] = known, pose
        if set(said) - {"yaw"}:
            self._placed_at[auv] = now
        self.counts["taken"] += 1

    def _place(self, known: Said) -> tuple[float, float, float] | None:
        """Return x, y, z (m) of what is known of a vehicle; None while too little is."""
        if {"x", "y", "z"} <= set(known):
            return known["x"], known["y"], known["z"]
        if not {"lat", "lon", "z"} <= set(known):
            return None
        if self._origin is None:
            raise Nonsense("in degrees, and the scenario has no environment.origin")
        try:
            lat, lon = position(known["lat"], known["lon"], "", "")
        except BadChart:
            raise Nonsense("nowhere on Earth") from None
        found = ned_at_depth([lat], [lon], [known["z"]], self._origin)[0]
        return float(found[0]), float(found[1]), float(found[2])

    def words(self) -> str:
        """Return what has become of poses, in a line."""
        refused = [f"{count} {why}" for why, count in self.counts.items() if why != "taken"]
        silent = ""
        if self.longest_silence_s > SILENCE_S:
            silent = f"; an AUV was silent for {self.longest_silence_s:.1f} s"
        return f"poses: {self.counts['taken']} taken; refused: {', '.join(refused) or 0}{silent}"

    def close(self) -> None:
        self._socket.close()


def _read(text: bytes) -> Iterator[tuple[int, Said]]:
    """Yield which AUV a line or a datagram tells of, and what."""
    if _is_mavlink(text):
        yield from _of_mavlink(text)
    elif text:
        _, mark, sentence = text.partition(b"$")
        text = text.removeprefix(BOM_UTF8)
        is_json = not mark or text.startswith((b"{", b"["))
        found = _of_json(text) if is_json else _of_sentence(sentence)
        if found is not None:
            yield found


def _is_mavlink(text: bytes) -> bool:
    """Tell whether it begins as MAVLink, or a message is somewhere in it."""
    return text[:1] in MAGIC or any(messages(text))


def _of_mavlink(text: bytes) -> Iterator[tuple[int, Said]]:
    is_damaged = False
    for message in messages(text):
        if message is None:
            is_damaged = True
        elif message.number == ATTITUDE:
            yield message.system - 1, {"yaw": message.fields[3]}
        else:
            _, lat, lon, _, above_home, *_, heading = message.fields
            said = {"lat": lat / 1e7, "lon": lon / 1e7, "z": -above_home / 1e3}
            if heading != 65535:
                said["yaw"] = math.radians(heading / 100.0)
            yield message.system - 1, said
    if is_damaged:
        raise Nonsense("damaged")


def _of_sentence(text: bytes) -> tuple[int, Said] | None:
    """Return what a sentence says, behind its `$`; None of one that says no pose.

    What is before that is a TAG block (NMEA 0183, 4.10), or the end of something else.
    """
    body, _, total = text.decode("latin-1").partition("*")
    try:
        if total and int(total, 16) != checksum(body.encode("latin-1")):
            raise Nonsense("damaged")
        kind, *fields = body.split(",")
        if not ADDRESS.fullmatch(kind):
            raise Nonsense("not understood")
        if kind.endswith(("HDT", "THS")):
            if fields[1:2] == ["V"]:
                raise Nonsense("of a compass without a heading")
            return 0, {"yaw": math.radians(float(fields[0]))}
        if not kind.endswith("GGA"):
            return None
        if fields[5] in ("", "0"):
            raise Nonsense("of a receiver without a fix")
        lat, lon = _angle(fields[1], fields[2], "NS"), _angle(fields[3], fields[4], "EW")
        said = {"lat": lat, "lon": lon}
        if len(fields) > 8 and fields[8]:  # without it nothing is said of the depth
            if fields[9] != "M":
                raise Nonsense("of a height that is not in metres")
            said["height"] = float(fields[8])
        return 0, said
    except (ValueError, IndexError) as error:
        raise Nonsense(str(error) if isinstance(error, Nonsense) else "not understood") from None


def _angle(text: str, side: str, sides: str) -> float:
    """Return an angle (deg) of degrees and minutes, on one of two sides."""
    degrees, minutes = divmod(float(text), 100.0)
    if side not in tuple(sides) or not 0.0 <= minutes < 60.0 or degrees < 0.0:
        raise Nonsense("of no latitude and longitude")
    return (degrees + minutes / 60.0) * (-1.0 if side == sides[1] else 1.0)


def _of_json(line: bytes) -> tuple[int, Said]:
    try:
        telegram: Any = json.loads(line)
        name = telegram["vehicle"]
        number = int(name.removeprefix("AUV")) if name.startswith("AUV") else -1
        said = {
            KEYS[key][0]: KEYS[key][1] * float(telegram[key])
            for key in KEYS
            if telegram.get(key) is not None
        }
    except (ValueError, TypeError, KeyError, AttributeError, OverflowError, RecursionError):
        raise Nonsense("not understood") from None
    return number, said


def missing_text(missing: Sequence[str], port: int) -> str:
    """Return what is waited for, in a line."""
    return f"waiting for poses of {', '.join(missing)} on UDP port {port} (Ctrl-C ends)"

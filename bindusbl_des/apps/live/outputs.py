"""What `--to FORMAT[/VEHICLES]:SINK` means: formats and sinks by their names; among them a line of
JSON for each reading, which has what an instrument has, with units in the names.
"""

import json
import math
import re
import selectors
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, NamedTuple

from .mavlink import Mavlink, mavproxy
from .nmea import sentences
from .readings import (
    Compass,
    Earth,
    EstimateReading,
    FixReading,
    FrameReading,
    Gnss,
    Pinged,
    Reading,
    Truth,
    UsblReading,
)
from .session import Encoder, Output
from .sinks import LOOPBACK, Datagrams, Ear, File, Port, Say, Sink, Terminal, check_room, deaf
from .ugps import Topside
from .wire import Wire

# What of a fix nobody at sea knows.
UNKNOWN = ("error_m",)


def line(reading: Reading, earth: Earth) -> str:
    """Return a reading as a line of JSON; of what there is not, nothing is said, but that nobody
    broadcast a fix (null).
    """
    when = earth.utc(reading.at_s).isoformat(timespec="microseconds")
    said = {
        "time_s": reading.at_s,
        "utc": when.replace("+00:00", "Z"),
        "vehicle": reading.vehicle,
        **_content(reading, earth),
    }
    return json.dumps(said, separators=(",", ":")) + "\n"


def _content(reading: Reading, earth: Earth) -> dict[str, Any]:
    """Return the kind of a reading and its values."""
    match reading:
        case Gnss(place=place, velocity=velocity, sd_m=sd_m):
            speeds = _named(("v_north_m_per_s", "v_east_m_per_s"), velocity or ())
            return {"kind": "gnss", **_place(place, earth), **speeds, "sd_m": sd_m}
        case Compass(yaw=yaw):
            return {"kind": "compass", **_heading(yaw)}
        case UsblReading(auv=auv, ping=ping):
            return {"kind": "usbl", "auv": auv, "ping": ping, **_seen(reading, earth)}
        case FixReading(fix=fix):
            # a vehicle's number in the record is a name to others, as in the tables
            by = None if fix.broadcast_by is None else f"ASV{fix.broadcast_by}"
            at = _place((fix.x_m, fix.y_m, fix.z_m), earth)
            return {"kind": "fix", **_known(fix, "auv", *UNKNOWN), "broadcast_by": by, **at}
        case EstimateReading(place=place, covariance=((xx, xy), (_, yy)), altitude_m=high):
            spread = {"sd_x_m": math.sqrt(max(xx, 0.0)), "sd_y_m": math.sqrt(max(yy, 0.0))}
            above = {} if high is None else {"altitude_m": high}
            return {"kind": "estimate", **_place(place, earth), **spread, "cov_xy_m2": xy, **above}
        case Pinged(ping=ping):
            return {"kind": "ping", "ping": ping}
        case FrameReading(frame=frame):
            return {"kind": "broadcast", **_known(frame, "asv")}
        case Truth(place=place, yaw=yaw):
            return {"kind": "truth", **_place(place, earth), **_heading(yaw)}


def _known(record: Any, *without: str) -> dict[str, Any]:
    """Return what is known of a record, without some fields."""
    fields = asdict(record).items()
    return {name: value for name, value in fields if value is not None and name not in without}


def _heading(yaw: float) -> dict[str, float]:
    return {"heading_deg": math.degrees(yaw) % 360.0}


def _seen(reading: UsblReading, earth: Earth) -> dict[str, Any]:
    """Return what a vessel has measured: where the AUV is, and how far north, east and below."""
    sight = reading.sight
    offset = [float(sight.place[axis]) - sight.own[axis] for axis in range(3)]
    spread = [math.sqrt(max(float(sight.covariance[axis, axis]), 0.0)) for axis in range(3)]
    return {
        **_place(sight.place.tolist(), earth),
        **_named(("north_m", "east_m", "down_m"), offset),
        **_named(("sd_x_m", "sd_y_m", "sd_z_m"), spread),
        **_heading(sight.yaw),
    }


def _place(place: Any, earth: Earth) -> dict[str, float]:
    """Return a place in the survey frame, and on Earth if it is there."""
    found = _named(("x_m", "y_m", "z_m"), place)
    if earth.origin is not None:
        found["lat_deg"], found["lon_deg"], _ = earth.geodetic(place)
    return found


def _named(names: tuple[str, ...], values: Any) -> dict[str, float]:
    return {name: float(value) for name, value in zip(names, values, strict=False)}


PORTS = range(65536)


class Format(NamedTuple):
    """A format: what it sends, whether it needs a place on Earth, and to which sinks it goes.
    Each output has an encoder of its own.
    """

    meaning: str
    make: Callable[[], Encoder]
    on_earth: bool
    sinks: tuple[str, ...] = ("udp", "tcp", "pty", "file")


class AskedOutput(NamedTuple):
    """An output as somebody has asked for it."""

    text: str
    format: str
    only: tuple[str, ...]
    sink: str
    where: str


def _nmea(reading: Reading, earth: Earth) -> Sequence[bytes]:
    return [sentence.encode("ascii") for sentence in sentences(reading, earth)]


def _json(reading: Reading, earth: Earth) -> Sequence[bytes]:
    return [line(reading, earth).encode("utf-8")]


def _nothing(reading: Reading, earth: Earth) -> Sequence[bytes]:
    return ()


FORMATS: dict[str, Format] = {
    "nmea": Format("GGA, RMC, ZDA, HDT and $PSIMSSB of ASVs", lambda: _nmea, on_earth=True),
    "json": Format("a line for each reading of all instruments", lambda: _json, on_earth=False),
    "ugps": Format("the API of a UGPS topside", lambda: _nothing, on_earth=True, sinks=("http",)),
    "mavlink": Format("GPS_INPUT of AUVs", Mavlink, on_earth=True),
    "ros2": Format("a bag", lambda: _nothing, on_earth=False, sinks=("file",)),
    "mavproxy": Format("GPS inputs of AUVs for MAVProxy", mavproxy, on_earth=True),
    "seatrac": Format("a SeaTrac beacon", lambda: _nothing, on_earth=False, sinks=("pty", "tcp")),
    "evologics": Format("an S2C modem", lambda: _nothing, on_earth=False, sinks=("pty", "tcp")),
}

# Formats that also listen: they are the wire of a vehicle's modem (`modems.make`).
WIRED = ("seatrac", "evologics")

# How each sink is written behind its name.
SINKS = {
    "udp": "udp:HOST:PORT",
    "tcp": "tcp:PORT",
    "pty": "pty",
    "file": "file:PATH",
    "http": "http:PORT",
}


def asked(text: str, vehicles: Sequence[str]) -> AskedOutput:
    """Return an output as it is written; `vehicles` are those that there are.

    Raises:
        ValueError: naming what is wrong with it.
    """
    form, _, rest = text.partition(":")
    form, _, named = form.partition("/")
    sink, _, where = rest.partition(":")
    if form not in FORMATS:
        raise ValueError(f"{text}: there is no format {form!r}; it is one of {', '.join(FORMATS)}")
    if sink not in FORMATS[form].sinks:
        wrong = f"{form} does not go to {sink}" if sink in SINKS else f"there is no sink {sink!r}"
        spelt = ", ".join(f"{form}:{SINKS[name]}" for name in FORMATS[form].sinks)
        raise ValueError(f"{text}: {wrong}; write {spelt}")
    only = chosen(named or ("ASV0" if form in WIRED else ""), vehicles, text)
    return AskedOutput(text, form, only, sink, where)


def makes_of(texts: Sequence[str]) -> str | None:
    """Return whose modems outputs, as they are written, are the wires of; None of no modems.

    Raises:
        ValueError: when they are of several makes.
    """
    makes = {text.partition(":")[0].partition("/")[0] for text in texts} & {*WIRED}
    if len(makes) > 1:
        raise ValueError(
            f"{' and '.join(sorted(makes))}: all vehicles of a mission have modems of one make; "
            "ask for one of them"
        )
    return makes.pop() if makes else None


def each(wanted: AskedOutput) -> list[AskedOutput]:
    """Return an output, that of modems for each vehicle: ports count on from the given one."""
    if wanted.format not in WIRED:
        return [wanted]
    given = [wanted._replace(only=(vehicle,)) for vehicle in wanted.only]
    if wanted.sink != "tcp":
        return given
    first = _port(wanted.where, wanted.text)
    ports = [first + number if first else 0 for number in range(len(given))]
    return [one._replace(where=str(port)) for one, port in zip(given, ports, strict=True)]


def chosen(named: str, vehicles: Sequence[str], text: str) -> tuple[str, ...]:
    """Return the vehicles that are named, `ASV0,AUV1`; none if nothing is.

    Raises:
        ValueError: for a vehicle that there is not.
    """
    only = tuple(filter(None, named.split(",")))
    for name in only:
        if name not in vehicles:
            raise ValueError(f"{text}: there is no {name}; there are {', '.join(vehicles)}")
    return only


def encoder(wanted: AskedOutput, only: Sequence[str]) -> Encoder:
    """Return what encodes readings for an output.

    NMEA has no names of vehicles: estimates and GNSS of AUVs are in it only where AUVs are named.
    """
    encode = FORMATS[wanted.format].make()
    if wanted.format != "nmea":
        return encode
    named = {*wanted.only, *only}

    def vessels(reading: Reading, earth: Earth) -> Sequence[bytes]:
        if reading.vehicle.startswith("AUV") and reading.vehicle not in named:
            return ()
        return encode(reading, earth)

    return vessels


def _topside(wanted: AskedOutput, by: "Opening") -> Output:
    """Open the topside of the first vessel that is named, which locates the first AUV that is."""
    named = [*wanted.only, "ASV0", "AUV0"]
    vessel, auv = (next(name for name in named if name.startswith(kind)) for kind in ("ASV", "AUV"))
    topside = Topside(wanted.text, by.bind, _port(wanted.where, wanted.text), vessel, auv)
    by.say(f"{wanted.text}: {vessel} locates {auv}: http://{by.bind}:{topside.port}/api/v1")
    return Output(topside, topside)


def _bag(wanted: AskedOutput, by: "Opening") -> Output:
    """Begin a bag; what writes it is an extra."""
    if not wanted.where.endswith(".mcap"):
        raise ValueError(f"{wanted.text}: a bag's name ends in .mcap; write ros2:file:PATH.mcap")
    try:
        from .ros2 import Bag
    except ModuleNotFoundError as error:
        if error.name != "foxglove":
            raise
        raise ValueError(
            f"{wanted.text}: bags are written by the package foxglove-sdk, which is not installed "
            "here; install it with: python -m pip install 'bindusbl-des[mcap]'"
        ) from None
    bag = Bag(wanted.text, Path(wanted.where), replace=by.replace)
    return Output(bag, bag, wanted.only)


# Formats that are their own sinks.
WHOLE: dict[str, Callable[[AskedOutput, "Opening"], Output]] = {"ugps": _topside, "ros2": _bag}


class Opening(NamedTuple):
    """What sinks need to be opened: who serves clients, whom to tell where a sink is found and whom
    what is wrong, where ports listen, and whether files may be replaced.
    """

    selector: selectors.BaseSelector
    say: Say
    warn: Say
    bind: str = LOOPBACK
    replace: bool = False


def opened(wanted: AskedOutput, only: Sequence[str], by: Opening) -> Output:
    """Open an output.

    Raises:
        ValueError: when the sink is not written as it must be.
        OSError: when it cannot be opened.
    """
    check_room()
    if wanted.format in WHOLE:
        return WHOLE[wanted.format](wanted, by)
    if wanted.format in WIRED:
        wire = Wire(wanted.only[0])
        return Output(wire, OPENERS[wanted.sink](wanted, by, wire.ear))
    return Output(encoder(wanted, only), OPENERS[wanted.sink](wanted, by), wanted.only)


def _udp(wanted: AskedOutput, by: Opening, ears: Callable[[], Ear] = deaf) -> Sink:
    host, _, port = wanted.where.rpartition(":")
    if not host:
        raise ValueError(f"{wanted.text}: write {wanted.format}:{SINKS['udp']}")
    return Datagrams(wanted.text, host.strip("[]"), _port(port, wanted.text))


def _tcp(wanted: AskedOutput, by: Opening, ears: Callable[[], Ear] = deaf) -> Sink:
    number = _port(wanted.where, wanted.text)
    port = Port(wanted.text, by.bind, number, by.selector, by.warn, ears)
    by.say(f"{_named_wire(wanted)}: listens on {by.bind}:{port.port}")
    return port


def _pty(wanted: AskedOutput, by: Opening, ears: Callable[[], Ear] = deaf) -> Sink:
    terminal = Terminal(wanted.text, by.selector, ears)
    by.say(f"{_named_wire(wanted)}: {terminal.path}")
    return terminal


def _named_wire(wanted: AskedOutput) -> str:
    """Return an output as it was written, and whose modem it is."""
    return wanted.text + (f", {wanted.only[0]}" if wanted.format in WIRED else "")


def _file(wanted: AskedOutput, by: Opening, ears: Callable[[], Ear] = deaf) -> Sink:
    if not wanted.where:
        raise ValueError(f"{wanted.text}: write {wanted.format}:{SINKS['file']}")
    return File(wanted.text, Path(wanted.where), replace=by.replace)


OPENERS: dict[str, Callable[..., Sink]] = {
    "udp": _udp,
    "tcp": _tcp,
    "pty": _pty,
    "file": _file,
}


def _port(text: str, whole: str) -> int:
    if not re.fullmatch(r"[0-9]{1,5}", text) or int(text) not in PORTS:
        raise ValueError(f"{whole}: {text!r} is no port; give a number from 0 to 65535")
    return int(text)

"""Modems on a wire in a mission: which vehicles have one, their sensors, recorded lines of
hosts.
"""

import csv
import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from operator import attrgetter
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pyarrow.parquet as pq

from ...support.arrays import Floats
from ...support.streams import Purpose, Streams
from ..protocol.access.air import LATE, SharedAir
from ..protocol.access.evologics import Evologics
from ..protocol.access.hosted import Modem, SeenDirection, SensedPose
from ..protocol.access.node import HeardSignal, Node, Steps
from ..protocol.access.seatrac import Seatrac
from ..protocol.network import Network
from ..records.rows import Recorder
from ..setup import Setup
from ..usbl.measuring import NOISE_WIDTH
from ..vehicles.fleet import VehicleFleet
from .sensor_errors import pressure_errors

MAKES: dict[str, type[Modem]] = {"seatrac": Seatrac, "evologics": Evologics}


class HostLine(NamedTuple):
    """A line of a host to the modem of a vehicle, at an instant (s)."""

    time_s: float
    vehicle: str
    line: bytes


def begin_modems(
    setup: Setup, network: Network, record: Recorder, streams: Streams
) -> dict[str, Modem]:
    """Give each vehicle a modem, which listens from now on; return them by their vehicles' names.

    Raises:
        ValueError: when the file of the hosts' lines cannot be read.
    """
    asked, env = setup.scenario.modems, network.env
    assert asked is not None
    rate = setup.scenario.acoustics.hf.bit_rate_bps
    air = SharedAir(env, network.uplink, record, streams, bit_rate_bps=rate, hearing=True)
    network.air, modems = air, {}
    fleets = (network.auv_fleet, network.asv_fleet)
    senses = Sensors(setup, fleets, streams)
    for number, name in enumerate(air.names):
        chance = streams.of(Purpose.MODEM, number)
        node = Node(name, network.slots, chance, iter(()), air, number)
        modem = modems[name] = MAKES[asked.make](node, senses, number + 1, record.modem_lines)
        env.process(_listen(modem))
    if asked.lines is not None:
        env.process(_repeat(modems, _said(asked.lines, modems)))
    return modems


def _listen(modem: Modem) -> Steps:
    """Let a modem take each signal that its vehicle decodes."""
    while True:
        modem.receive((yield modem.node.hears()))


def _repeat(modems: Mapping[str, Modem], lines: Iterable[HostLine]) -> Steps:
    """Let hosts send their recorded lines, each at its instant, after all other events of that
    instant, as when they were recorded.
    """
    for line in lines:
        modem = modems[line.vehicle]
        yield modem.node.until(line.time_s)
        last = modem.node.air.env.event()
        last._ok, last._value = True, None
        modem.node.air.env.schedule(last, LATE)
        yield last
        modem.hear(line.line)


def _said(file: str, modems: Collection[str]) -> list[HostLine]:
    """Read the lines of hosts, in order of time.

    Raises:
        ValueError: naming file, row and mistake.
    """
    path, found = Path(file), []
    try:
        if path.suffix == ".parquet":
            rows = pq.read_table(path).to_pylist()
        else:
            with path.open(newline="", encoding="latin-1") as text:
                rows = list(csv.DictReader(text))
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or error
        raise ValueError(f"modems.lines: {file}: cannot be read: {why}") from None
    for number, row in enumerate(rows, start=1):
        if row.get("said_by") == "modem":
            continue
        try:
            text = row["line"].encode("ascii").decode("unicode_escape").encode("latin-1")
            line = HostLine(float(row["time_s"]), row["vehicle"], text)
        except (AttributeError, KeyError, TypeError, ValueError):
            raise ValueError(
                f"modems.lines: {file}: row {number} needs time_s (s), vehicle and line"
            ) from None
        if line.vehicle not in modems or not 0.0 <= line.time_s < math.inf:
            raise ValueError(
                f"modems.lines: {file}: row {number}: {line.vehicle} at {line.time_s} s: give a "
                f"vehicle ({', '.join(modems)}) and an instant from 0 s on"
            )
        found.append(line)
    return sorted(found, key=attrgetter("time_s"))


class Sensors:
    """What modems measure: depth, attitude and, at ASVs, directions of signals, with the errors
    that `usbl` and `navigation` state (:class:`..protocol.access.hosted.Senses`).
    """

    def __init__(self, setup: Setup, fleets: Sequence[VehicleFleet], streams: Streams) -> None:
        usbl, asvs = setup.scenario.usbl, setup.vessels
        self.sound_speed = setup.usbl.sound_speed
        instruments = [setup.usbl] * len(fleets[0]) + list(setup.usbls)
        self.travel_time_sds_s: Sequence[float] = [
            own.range_sd(1) / self.sound_speed for own in instruments
        ]
        self._setup, self._streams, self._auvs = setup, streams, len(fleets[0])
        self._vehicles = [*fleets[0].vehicles, *fleets[1].vehicles]
        self._fleets = fleets
        self._usbls = [replace(usbl, gnss_sd=0.0) for usbl in setup.usbls]
        carried = [usbl] * self._auvs + [group.usbl for group in asvs for _ in group.members]
        self._tilts = np.radians(
            [(own.heading_sd_deg, own.pitch_sd_deg, own.roll_sd_deg) for own in carried]
        )
        self._sees = not usbl.model.is_own

    def _true(self, vehicle: int, time: float) -> Floats:
        for fleet in self._fleets:
            fleet.advance(time)
        return np.array(self._vehicles[vehicle].at(time))

    def pose(self, node: Node) -> SensedPose:
        """Return the pose that a vehicle's own sensors measure now."""
        time, vehicle = node.clock, node.number
        _, _, depth, yaw = self._true(vehicle, time)
        turned, pitch, roll = self._tilts[vehicle] * node.random.standard_normal(3)
        if vehicle < self._auvs:
            depth += pressure_errors(self._setup, self._streams, vehicle, np.array([time]))[0]
        return SensedPose(float(depth), float(yaw + turned), float(pitch), float(roll))

    def sight(self, node: Node, heard: HeardSignal) -> SeenDirection | None:
        """Return the measured direction of a signal; None without an array."""
        if node.number < self._auvs or not self._sees:
            return None
        here = self._true(node.number, heard.began_at_s)
        there = self._true(node.air.names.index(heard.sender), heard.began_at_s)
        away = float(np.linalg.norm(here[:3] - there[:3]))
        noise = node.random.standard_normal(NOISE_WIDTH)
        came, yaw = away / self.sound_speed, float(here[3])
        place, _ = self._usbls[node.number - self._auvs].locate(
            there[:3], here[:3], yaw, came, noise
        )
        north, east, down = (place - here[:3]) / max(float(np.linalg.norm(place - here[:3])), 1e-9)
        azimuth, elevation = math.atan2(east, north) - yaw, -math.asin(down)
        return SeenDirection(azimuth, elevation, (float(north), float(east), float(down)))

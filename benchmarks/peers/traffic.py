"""The acoustic traffic of a mission as plain text, for simulators of networks to repeat.

First line: AUVs, ASVs, sound speed.  Then a line for each band (name, range, bytes per second), for
each vehicle (its place at the start; ASVs after AUVs), and for each transmission: band, number,
instant, sender, bytes, and the places of the vehicles that matter then.  Metres and seconds.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bindusbl_des import Result, Scenario, simulate

Place = tuple[float, float, float]
Heard = set[tuple[str, int, int]]

# Any length will do: a ping carries nothing, its band is as fast as gives it its duration.
PING_BYTES = 10

# Rate (Hz) of the tracks from which places at broadcasts are interpolated, to 0.1 mm.
TRACKS_HZ = 20.0

ASKED = {"downlink": "sequential", "ranging": "owtt_sync"}


@dataclass(frozen=True)
class Band:
    """One acoustic band: how far signals reach (m, horizontally), how many bytes a second."""

    name: str
    range_m: float
    bytes_per_s: float


@dataclass(frozen=True)
class Transmission:
    """A ping or a frame: band, number, instant, sender, bytes, and vehicles' places."""

    band: str
    number: int
    sent_at_s: float
    sender: int
    bytes: int
    places: tuple[tuple[int, Place], ...]


@dataclass(frozen=True)
class Traffic:
    """Who sends what when, in a mission of AUVs (numbered first) and ASVs."""

    auvs: int
    asvs: int
    sound_speed_m_per_s: float
    bands: tuple[Band, ...]
    places: tuple[Place, ...]
    transmissions: tuple[Transmission, ...]

    def write(self, path: Path) -> None:
        """Write the traffic as text; floats in full, so that reading gives the same."""
        lines = [f"vehicles {self.auvs} {self.asvs} {self.sound_speed_m_per_s!r}"]
        lines += [f"{band.name} {band.range_m!r} {band.bytes_per_s!r}" for band in self.bands]
        lines += [f"at {_text(place)}" for place in self.places]
        for sent in self.transmissions:
            moved = "".join(f" {vehicle} {_text(place)}" for vehicle, place in sent.places)
            lines.append(
                f"{sent.band} {sent.number} {sent.sent_at_s!r} {sent.sender} {sent.bytes} "
                f"{len(sent.places)}{moved}"
            )
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def read_traffic(path: Path) -> Traffic:
    """Read traffic back from its text."""
    lines = [line.split() for line in path.read_text(encoding="utf-8").splitlines()]
    auvs, asvs = int(lines[0][1]), int(lines[0][2])
    vehicles = 3 + auvs + asvs
    return Traffic(
        auvs,
        asvs,
        float(lines[0][3]),
        tuple(Band(name, float(reach), float(rate)) for name, reach, rate in lines[1:3]),
        tuple(_place(words[1:]) for words in lines[3:vehicles]),
        tuple(_transmission(words) for words in lines[vehicles:]),
    )


def traffic_of(scenario: Scenario, seed: int = 0) -> tuple[Traffic, Heard, Heard]:
    """Return a mission's traffic, who heard what in it, and who was meant to.

    Heard is (band, number, who): an ASV that decoded a ping, an AUV that had a frame with a fix of
    its own.  Pings still under way at the end of the mission are left out.

    Raises:
        ValueError: when the scenario has what the text cannot say.
    """
    _check(scenario)
    exported = scenario.model_dump(mode="json")
    exported["record"] = {**exported["record"], "tracks_hz": TRACKS_HZ, "detail": "full"}
    result = simulate(Scenario.model_validate(exported), seed)
    hf, mf = scenario.acoustics.hf, scenario.acoustics.mf
    frames = _frames(result)
    traffic = Traffic(
        scenario.auvs.count,
        scenario.asvs.count,
        scenario.environment.sound_speed_m_per_s,
        (
            Band("hf", hf.range_m, PING_BYTES / hf.ping_s),
            Band("mf", mf.range_m, mf.bit_rate_bps / mf.overhead / 8),
        ),
        _places(result, 0.0),
        tuple(sorted((*_pings(result), *frames), key=lambda sent: sent.sent_at_s)),
    )
    meant = {
        ("mf", frame.number, vehicle)
        for frame in frames
        for vehicle, _ in frame.places
        if vehicle < traffic.auvs
    }
    return traffic, _heard(result), meant


def _check(scenario: Scenario) -> None:
    asked = {key: getattr(scenario.protocol, key) for key in ASKED}
    loss = scenario.acoustics.loss
    if asked != ASKED or loss.law != "none" or scenario.asvs.vehicle.has_dynamics:
        raise ValueError(
            f"{scenario.name}: traffic is exported of missions with moored ASVs, a sequential "
            "downlink, one-way ranging and loss.law none"
        )
    if loss.combine != "off" or scenario.acoustics.hf.range_metric == "slant":
        raise ValueError(f"{scenario.name}: needs loss.combine off and a horizontal HF range")


def _pings(result: Result) -> list[Transmission]:
    receptions = result.tables["receptions"]
    unfinished = set(receptions.ping[receptions.outcome == "in_flight"])
    return [
        Transmission(
            "hf", row.ping, row.sent_at_s, _index(row.auv), PING_BYTES,
            ((_index(row.auv), (row.x_m, row.y_m, row.z_m)),),
        )
        for row in result.tables["pings"].itertuples()
        if row.ping not in unfinished
    ]  # fmt: skip


def _frames(result: Result) -> list[Transmission]:
    """Return the broadcasts with the places of the AUVs they have fixes for."""
    fixes, first_asv = result.tables["fixes"], result.scenario.auvs.count
    frames = []
    for number, row in enumerate(result.tables["broadcasts"].itertuples()):
        addressed = sorted({_index(a) for a in fixes.auv[fixes.broadcast_at_s == row.sent_at_s]})
        places = _places(result, row.sent_at_s, addressed)
        frames.append(
            Transmission(
                "mf", number, row.sent_at_s, first_asv + _index(row.asv), row.payload_bytes,
                tuple(zip(addressed, places, strict=True)),
            )
        )  # fmt: skip
    return frames


def _heard(result: Result) -> Heard:
    receptions, fixes = result.tables["receptions"], result.tables["fixes"]
    decoded = receptions[receptions.outcome == "heard"]
    pings = {("hf", ping, _index(asv)) for ping, asv in zip(decoded.ping, decoded.asv, strict=True)}
    sent = fixes[fixes.broadcast_at_s.notna() & (fixes.outcome != "out_of_range")]
    number = {time: n for n, time in enumerate(result.tables["broadcasts"].sent_at_s)}
    reached = zip(sent.broadcast_at_s, sent.auv, strict=True)
    return pings | {("mf", number[time], _index(auv)) for time, auv in reached}


def _places(result: Result, time: float, auvs: list[int] | None = None) -> tuple[Place, ...]:
    """Return where vehicles are at an instant: these AUVs, or all AUVs and then all ASVs."""
    tracks = _tracks(result)
    names = list(tracks) if auvs is None else [f"AUV{auv}" for auv in auvs]
    places = []
    for name in names:
        times, *axes = tracks[name]
        x, y, z = (float(np.interp(time, times, axis)) for axis in axes)
        places.append((x, y, z))
    return tuple(places)


def _tracks(result: Result) -> dict[str, np.ndarray]:
    kept: dict[str, np.ndarray] | None = result.__dict__.get("_tracks_by_vehicle")
    if kept is None:
        columns = ["time_s", "x_m", "y_m", "z_m"]
        groups = result.tables["tracks"].groupby("vehicle", sort=False, observed=True)
        kept = {str(name): rows[columns].to_numpy().T for name, rows in groups}
        result.__dict__["_tracks_by_vehicle"] = kept
    return kept


def _index(name: str) -> int:
    return int(name[3:])  # AUV7, ASV2


def _text(place: Place) -> str:
    return " ".join(map(repr, place))


def _place(words: list[str]) -> Place:
    x, y, z = map(float, words)
    return x, y, z


def _transmission(words: list[str]) -> Transmission:
    moved = [words[n : n + 4] for n in range(6, len(words), 4)]
    places = tuple((int(vehicle), _place(place)) for vehicle, *place in moved)
    return Transmission(
        words[0], int(words[1]), float(words[2]), int(words[3]), int(words[4]), places
    )

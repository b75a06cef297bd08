"""Vehicles, clock and sound of the second implementation, written from docs/model.md alone.

What a vehicle hears is found by comparing all intervals at it. This medium is the disc without
loss; ASVs are at rest and AUVs on straight legs.
"""

import csv
import math
from collections import defaultdict
from dataclasses import dataclass, field
from itertools import pairwise

Row = dict[str, object]
Place = tuple[float, float, float]
AN_INSTANT = 1e-9  # s: what lies closer together is at the same time


@dataclass(eq=False)
class Sound:
    """A ping, a call or a frame: its row, when it is where, and who is within its reach.

    It is whole if its sender works on until its end; `in_vain` says why a turn brought no ping.
    """

    band: str
    row: Row
    at: dict[str, tuple[float, float]] = field(default_factory=dict)
    reached: list[str] = field(default_factory=list)
    whole: bool = True
    in_vain: str | None = None
    fixes: list[Row] = field(default_factory=list)


class Medium:
    """Vehicles, called as in the tables, and what they hear of each other."""

    def __init__(self, keys: Row) -> None:
        """Take a scenario's keys, of which all that matter here are given."""
        self.keys, self.end = keys["protocol"], keys["duration_s"]
        self.hf, self.mf = keys["acoustics"]["hf"], keys["acoustics"]["mf"]
        self.ping_s, self.speed = self.hf["ping_s"], keys["environment"]["sound_speed_m_per_s"]
        self.auvs = [f"AUV{i}" for i in range(keys["auvs"]["count"])]
        self.asvs = [f"ASV{j}" for j in range(keys["asvs"]["count"])]
        self.legs = dict(zip(self.auvs, legs(keys), strict=True))
        stations = keys["asvs"]["formation"]["positions_m"]
        self.legs |= {j: [(0.0, x, y, 0.0)] for j, (x, y) in zip(self.asvs, stations, strict=True)}
        self.failures = [
            (f"ASV{f['asv']}", f["at_s"], f["until_s"] or math.inf)
            for f in keys["asvs"]["failures"]
        ]
        self.instant = named(self.keys["downlink"])[1].get("reply") == "instant"
        # When sounds begin and end at a vehicle, on a band
        self.ears: dict[tuple[str, str], list[tuple[float, float, object]]] = defaultdict(list)

    def after(self, start: float, duration: float) -> float:
        """Return the instant so much later, on a tick where there are ticks."""
        rate = self.keys["tick_rate_hz"]
        if rate is None or duration == math.inf:
            return start + duration
        return math.ceil((start + duration) * rate - 1e-7) / rate

    def where(self, vehicle: str, time: float) -> Place:
        """Return where a vehicle is: on one of its legs, or at rest."""
        points = self.legs[vehicle]
        for (begin, *a), (end, *b) in pairwise(points):
            if time <= end:
                share = (time - begin) / (end - begin)
                return tuple(p + share * (q - p) for p, q in zip(a, b, strict=True))
        return points[-1][1:]

    def fastest(self, vehicle: str) -> float:
        """Return the horizontal speed of a vehicle on its fastest leg."""
        return max(
            (math.dist(a[1:3], b[1:3]) / (b[0] - a[0]) for a, b in pairwise(self.legs[vehicle])),
            default=0.0,
        )

    def works(self, vehicle: str, begin: float, end: float | None = None) -> bool:
        """Tell whether a vehicle works at an instant, or all the time from one to another."""
        return not any(
            asv == vehicle and at <= (begin if end is None else end) and begin < until
            for asv, at, until in self.failures
        )

    def working(self, time: float) -> list[str]:
        """Return the ASVs that work at an instant."""
        return [j for j in self.asvs if self.works(j, time)]

    def reaches(self, a: Place, b: Place, margin: float = 0.0) -> bool:
        """Tell whether two places are within HF range of each other."""
        distance = math.dist(a, b) if self.hf["range_metric"] == "slant" else horizontal(a, b)
        return distance <= self.hf["range_m"] + margin

    def arrival(self, source: Place, vehicle: str, time: float) -> float:
        """Return when what is sent somewhere reaches a vehicle: the light-time equation."""
        late = 0.0
        for _ in range(8 if len(self.legs[vehicle]) > 1 else 1):
            late = math.dist(source, self.where(vehicle, time + late)) / self.speed
        return time + late

    def spread(self, sound: Sound, sender: str, time: float, lasts: float, to: list[str]) -> Sound:
        """Let a sound go to vehicles: a ping or call on HF, a frame on MF."""
        place = self.where(sender, time)
        for it in to:
            begin, at = self.arrival(place, it, time), self.where(it, time)
            if sound.band == "hf":
                sound.at[it], near = (begin, begin + lasts), self.reaches(place, at)
            else:
                sound.at[it] = (begin, self.arrival(place, it, time + lasts))
                near = self.instant or horizontal(place, at) <= self.mf["range_m"]
            if near:
                sound.reached.append(it)
                if sound.in_vain is None:
                    self.ears[sound.band, it].append((*sound.at[it], sound))
        return sound

    def in_range(self, sound: Sound) -> list[str]:
        """Return who is in range of a sound: whom it reaches, and who works then."""
        return [it for it in sound.reached if self.works(it, sound.at[it][0])]

    def outcome(self, sound: Sound, at: str, end: float | None = None) -> str:
        """Return what becomes of a sound at a vehicle, the first that holds, once all is known."""
        begin, until = sound.at[at]
        if at not in self.in_range(sound):
            return "out_of_range"
        if sound.in_vain is not None:
            return sound.in_vain
        if until > (self.end if end is None else end):
            return "in_flight"
        if not sound.whole or not self.works(at, begin, until):
            return "lost"
        others = ((a, b) for a, b, other in self.ears[sound.band, at] if other is not sound)
        early, late = until - AN_INSTANT, begin + AN_INSTANT
        return "collided" if any(a < early and late < b for a, b in others) else "heard"


def named(part: object) -> tuple[str, Row]:
    """Return the name of a part and its settings."""
    return (part["model"], part) if isinstance(part, dict) else (str(part), {})


def horizontal(a: Place, b: Place) -> float:
    """Return the horizontal distance of two places."""
    return math.hypot(a[0] - b[0], a[1] - b[1])


def legs(keys: Row) -> list[list[tuple[float, ...]]]:
    """Return of each AUV when it is where (time, x, y, depth): its track, its leg or its place."""
    route, depth = keys["auvs"]["route"], keys["survey"]["depth_m"]
    if route["kind"] == "hold":
        return [[(0.0, x, y, depth)] for x, y in route["positions_m"]]
    found = []
    for path in route.get("files", ()):
        with open(path, newline="") as file:
            rows = list(csv.DictReader(file))
        found.append(
            [tuple(float(r[k]) for k in ("time_s", "x_m", "y_m", "depth_m")) for r in rows]
        )
    for a, b in route.get("points_m", ()):
        way = math.dist(a, b) / keys["auvs"]["speed_m_per_s"]
        found.append([(0.0, *a, depth), (way, *b, depth)])
    return found

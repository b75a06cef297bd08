"""Vehicles, clock and sound of the second implementation, written from docs/model.md alone.

What a vehicle hears is found by comparing all intervals at it. This medium is the disc without
loss; ASVs are at rest and AUVs on straight legs.
"""

import math

import numpy as np
import shapely

AN_INSTANT = 1e-9  # s: what lies closer together is at the same time


class Row:
    """A row of a table, or a sound, and what else is known of it."""

    in_vain = None  # why a turn brought no ping

    def __init__(self, **values: object) -> None:
        """Take values by the names of their columns."""
        vars(self).update(values)


class Medium:
    """Vehicles, called as in the tables, and what they hear of each other."""

    def __init__(self, keys: dict) -> None:
        """Take a scenario's keys, of which all that matter here are given."""
        self.keys, self.end = dict(keys["protocol"]), keys["duration_s"] - AN_INSTANT
        for part, value in keys["protocol"].items():
            if isinstance(value, dict) and "model" in value:  # a part with settings
                own = {} if part == "access" else value  # whose `repeat` is of pings
                self.keys |= own | {part: value["model"]}
        self.hf, self.mf = keys["acoustics"]["hf"], keys["acoustics"]["mf"]
        self.replies = self.keys["downlink"] == "direct_reply"
        self.instant = self.keys.get("reply") == "instant"  # and reaches any distance
        self.ping_s, self.speed = self.hf["ping_s"], keys["environment"]["sound_speed_m_per_s"]
        self.auvs = [f"AUV{i}" for i in range(keys["auvs"]["count"])]
        self.asvs = [f"ASV{j}" for j in range(keys["asvs"]["count"])]
        stations = [[(0.0, x, y, 0.0)] for x, y in keys["asvs"]["formation"]["positions_m"]]
        ways = map(np.array, [*tracks(keys), *stations])
        self.tracks = dict(zip(self.auvs + self.asvs, ways, strict=True))
        self.station = {j: self.where(j, 0.0) for j in self.asvs}
        fails = keys["asvs"]["failures"]
        self.failures = [(f"ASV{f['asv']}", f["at_s"], f["until_s"] or math.inf) for f in fails]
        self.islands = [shapely.Polygon(ring) for ring in keys["survey"].get("land") or ()]
        # Sounds at a vehicle on a band: when they begin and end there
        self.ears = {(band, i): [] for band in ("hf", "mf") for i in self.tracks}

    def behind(self, a: np.ndarray, b: np.ndarray, shore: float = 0.0) -> bool:
        """Tell whether land without its outer metres is between two places."""
        way = shapely.LineString([a[:2], b[:2]])
        lands = [shapely.buffer(land, -shore, join_style="mitre") for land in self.islands]
        return any(way.intersection(land).length > 1e-6 for land in lands)

    def after(self, start: float, duration: float) -> float:
        """Return the instant so much later, on a tick where there are ticks."""
        rate = self.keys["tick_rate_hz"]
        if rate is None or duration == math.inf:
            return start + duration
        return math.ceil((start + duration) * rate - 1e-7) / rate

    def where(self, vehicle: str, time: float) -> np.ndarray:
        """Return where a vehicle is: on one of its legs, or at rest."""
        times, *axes = self.tracks[vehicle].T
        return np.array([np.interp(time, times, axis) for axis in axes])

    def fails(self, vehicle: str, time: float) -> float:
        """Return when a vehicle does not work, from an instant on."""
        ends = [max(at, time) for j, at, until in self.failures if j == vehicle and time < until]
        return min(ends, default=math.inf)

    def working(self, time: float) -> list[str]:
        """Return the ASVs that work at an instant."""
        return [j for j in self.asvs if self.fails(j, time) > time]

    def nearest(self, place: np.ndarray, asvs: list[str]) -> str:
        """Return the nearest of some ASVs."""
        return min(asvs, key=lambda j: horizontal(place, self.station[j]))

    def arrival(self, source: np.ndarray, vehicle: str, time: float) -> float:
        """Return when what is sent somewhere reaches a vehicle: the light-time equation."""
        late = 0.0
        for _ in range(5):
            late = math.dist(source, self.where(vehicle, time + late)) / self.speed
        return time + late

    def spread(self, band: str, sender: str, time: float, lasts: float, to: list, **row) -> Row:
        """Let a sound go to vehicles; who sends on one band may be deaf on the other."""
        place, fails, other = self.where(sender, time), self.fails(sender, time), "mf"
        sound = Row(band=band, sender=sender, sent_at_s=time, at={}, in_range=[], behind=[], **row)
        sound.whole, limits = fails > time + lasts, self.hf
        if band == "mf":
            lasts, limits, other = min(lasts, fails - time), self.mf, "hf"
        sound.airtime_s = lasts
        for i in to:
            begin = self.arrival(place, i, time)
            until = begin + lasts
            if band == "mf":
                until = self.arrival(self.where(sender, time + lasts), i, time + lasts)
            sound.at[i] = begin, until
            near, here = within(limits, place, self.where(i, time)), self.where(i, time)
            if near and self.behind(place, here):
                sound.behind.append(i)
            elif near or (self.instant and band == "mf"):
                if sound.in_vain is None:
                    self.ears[band, i].append((begin, until, sound))
                if self.fails(i, begin) > begin:
                    sound.in_range.append(i)
        deaf = self.keys["duplex"] == "per_node" or (self.replies and band == "mf")
        if deaf and lasts and sound.in_vain is None and not self.instant:
            self.ears[other, sender].append((time, time + lasts, sound))
        return sound

    def outcome(self, sound: Row, at: str, end: float | None = None) -> str:
        """Return what becomes of a sound at a vehicle, the first that holds, once all is known."""
        begin, until = sound.at[at]
        if at in sound.behind:
            return "blocked"
        if at not in sound.in_range:
            return "out_of_range"
        if sound.in_vain is not None:
            return sound.in_vain
        if until > (self.end if end is None else end):
            return "in_flight"
        if not sound.whole or self.fails(at, begin) <= until:
            return "lost"
        others = ((a, b) for a, b, other in self.ears[sound.band, at] if other is not sound)
        early, late = until - AN_INSTANT, begin + AN_INSTANT
        return "collided" if any(a < early and late < b for a, b in others) else "heard"


def horizontal(a: np.ndarray, b: np.ndarray) -> float:
    """Return the horizontal distance of two places."""
    return math.dist(a[:2], b[:2])


def within(band: dict, a: np.ndarray, b: np.ndarray, margin: float = 0.0) -> bool:
    """Tell whether two places are within the range of a band of each other."""
    distance = math.dist(a, b) if band.get("range_metric") == "slant" else horizontal(a, b)
    return distance <= band["range_m"] + margin


def groups(keys: dict) -> list[dict]:
    """Return what is said of each group of AUVs, which all have routes of their own."""
    usual = {**keys["auvs"], "depth_m": keys["survey"]["depth_m"]}
    return [{**usual, **own} for own in keys["auvs"].get("groups", [{}])]


def deepest(keys: dict) -> float:
    """Return how deep (m) the deepest AUV goes."""
    return max(own["depth_m"] for own in groups(keys))


def tracks(keys: dict) -> list:
    """Return of each AUV when it is where (time, x, y, depth): its track, its leg or its place."""
    return [way for own in groups(keys) for way in ways(own)]


def ways(own: dict) -> list:
    """Return the same of the AUVs of a group."""
    route, depth = own["route"], own["depth_m"]
    if route["kind"] == "track":
        return [np.loadtxt(path, delimiter=",", skiprows=1) for path in route["files"]]
    if route["kind"] == "hold":
        return [[(0.0, x, y, depth)] for x, y in route["positions_m"]]
    speed = own["speed_m_per_s"]
    return [[(0.0, *a, depth), (math.dist(a, b) / speed, *b, depth)] for a, b in route["points_m"]]

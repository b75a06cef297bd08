"""A second implementation of the protocols, written from docs/model.md and docs/protocols.md alone.

Plain Python: no numba, no SimPy, nothing of the package, whose source its author had not read. Time
goes on in the loops of `fly`; what a vehicle hears is found by comparing all intervals at it. It
knows the disc without loss, ASVs at rest, AUVs at rest or on a straight leg, and instruments
without noise. What the simulator draws by lot it is given (`Drawn`).
"""

import math
from dataclasses import dataclass, field

Row = dict[str, object]
Place = tuple[float, float, float]


@dataclass
class Drawn:
    """What is drawn at random: turns of `random`, broadcasters of `random`."""

    turns: list[int] = field(default_factory=list)
    broadcasters: list[int] = field(default_factory=list)


@dataclass
class Ping:
    """A ping of an AUV, or a turn whose call got no answer (`call` is not heard)."""

    round: int
    slot: int
    auv: int
    sent: float
    in_range: list[int]
    arrivals: dict[int, float]
    ready: float = math.inf
    outcomes: dict[int, str] = field(default_factory=dict)
    called: float | None = None
    caller: int | None = None
    call: str | None = None


@dataclass
class Fix:
    """A fix of a ping, and what becomes of it."""

    ping: Ping
    asvs: list[int]
    place: Place
    sent: float | None = None
    by: int | None = None
    delivered: float | None = None
    outcome: str = "in_flight"


def horizontal(a: Place, b: Place) -> float:
    """Return the horizontal distance of two places."""
    return math.hypot(a[0] - b[0], a[1] - b[1])


class Second:
    """A mission, flown by `fly`; its events are in `rounds`, `broadcasts`, `pings` and `fixes`."""

    def __init__(self, keys: Row, drawn: Drawn) -> None:
        """Take a scenario's keys, of which all that matter here are given."""
        self.drawn = drawn
        self.end: float = keys["duration_s"]
        hf, mf, self.protocol = keys["acoustics"]["hf"], keys["acoustics"]["mf"], keys["protocol"]
        self.mf = mf
        self.speed = keys["environment"]["sound_speed_m_per_s"]
        believed = keys["environment"].get("assumed_sound_speed_m_per_s") or self.speed
        self.reach, self.metric, self.ping_s = hf["range_m"], hf["range_metric"], hf["ping_s"]
        self.depth = keys["survey"]["depth_m"]
        route, count = keys["auvs"]["route"], keys["auvs"]["count"]
        self.legs = route.get("points_m") or [[at, at] for at in route["positions_m"]]
        self.way_speed = keys["auvs"]["speed_m_per_s"]
        self.asvs = [(x, y, 0.0) for x, y in keys["asvs"]["formation"]["positions_m"]]
        self.failures = keys["asvs"].get("failures", [])
        self.auvs, self.all_asvs = range(count), range(len(self.asvs))
        p = self.protocol
        crossing = keys["survey"]["side_m"] / believed
        guard = p.get("uplink_guard_s")
        guard = 0.5 * crossing if guard is None else guard
        shortest = p.get("shortest_uplink_slot_s")
        shortest = 2.5 * crossing if shortest is None else shortest
        longest = self.reach if self.metric == "slant" else math.hypot(self.reach, self.depth)
        longest /= believed
        self.down_guard = p.get("downlink_guard_s")
        if self.down_guard is None:
            self.down_guard = 1.25 * crossing
        self.down_shortest = p.get("shortest_downlink_slot_s")
        if self.down_shortest is None:
            self.down_shortest = 10 * crossing
        self.schedule, self.schedule_keys = named(p["schedule"])
        self.downlink, self.downlink_keys = named(p["downlink"])
        self.broadcaster, self.broadcaster_keys = named(p["broadcaster"])
        self.ranging, self.ranging_keys = named(p["ranging"])
        self.turnaround = self.ranging_keys.get("turnaround_s", 0.0)
        self.reply = self.downlink_keys.get("reply", "frame")
        called = self.ranging == "twtt" or self.schedule == "polling"
        self.reply_s = 0.0
        if self.downlink == "direct_reply" and self.reply == "frame":
            self.reply_s = self.airtime(1) + self.down_guard
        slot = self.ping_s + longest + guard
        if called:
            slot = 2 * self.ping_s + self.turnaround + 2 * longest + guard
        self.slot_s = max(slot, shortest) + self.reply_s
        self.called = called
        self.rounds: list[Row] = []
        self.pings: list[Ping] = []
        self.undecided: list[Ping] = []
        self.fixes: list[Fix] = []
        self.waiting: list[Fix] = []
        self.broadcasts: list[Row] = []
        self.frames: list[Row] = []
        self.receptions: list[Row] = []
        self.at_asv: list[list] = [[] for _ in self.asvs]
        self.calls_at: list[list] = [[] for _ in self.auvs]
        self.frames_at: list[list] = [[] for _ in self.auvs]
        self.known: list[Place] = [self.where(i, 0.0) for i in self.auvs]
        self.free = self.waited = 0.0

    # Vehicles, sound and clock

    def where(self, auv: int, time: float) -> Place:
        """Return where an AUV is: on its leg, or at rest."""
        (x, y), (to_x, to_y) = self.legs[auv]
        way = math.hypot(to_x - x, to_y - y)
        share = self.way_speed * time / way if way > 0 else 0.0
        return (x + share * (to_x - x), y + share * (to_y - y), self.depth)

    def reaches_auv(self, source: Place, auv: int, time: float) -> float:
        """Return when what sets out at a place reaches an AUV: the light-time equation."""
        late = 0.0
        for _ in range(60):
            late = math.dist(source, self.where(auv, time + late)) / self.speed
        return time + late

    def works(self, asv: int, begin: float, end: float | None = None) -> bool:
        """Tell whether an ASV works at an instant, or all the time from one to another."""
        return not any(f["asv"] == asv and self.fails(f, begin, end) for f in self.failures)

    def fails(self, failure: Row, begin: float, end: float | None = None) -> bool:
        """Tell whether a failure is there at some time between two instants."""
        until = math.inf if failure["until_s"] is None else failure["until_s"]
        return failure["at_s"] <= (begin if end is None else end) and begin < until

    def heard(self, a: Place, b: Place, margin: float = 0.0) -> bool:
        """Tell whether two places are within HF range of each other."""
        distance = math.dist(a, b) if self.metric == "slant" else horizontal(a, b)
        return distance <= self.reach + margin

    def after(self, start: float, duration: float) -> float:
        """Return the instant so much later, on a tick where there are ticks."""
        rate = self.protocol.get("tick_rate_hz")
        if rate is None:
            return start + duration
        return math.ceil(min(start + duration, 1e9) * rate - 1e-7) / rate

    def airtime(self, fixes: int) -> float:
        """Return how long a frame of so many fixes is on the air."""
        payload = self.mf["header_bytes"] + fixes * self.mf["fix_bytes"]
        return 8 * payload * self.mf["overhead"] / self.mf["bit_rate_bps"]

    def frame_slot(self, airtime: float) -> float:
        """Return the downlink slot of a frame."""
        return max(airtime + self.down_guard, self.down_shortest)

    # Who pings when

    def hearing(self, time: float) -> list[list[bool]]:
        """Return by which ASV the fleet believes each AUV to be heard."""
        margin = self.protocol.get("conflict_margin_m", 0.0)
        return [
            [
                self.works(j, time) and self.heard(place, asv, margin)
                for j, asv in enumerate(self.asvs)
            ]
            for place in self.believed(time)
        ]

    def believed(self, time: float) -> list[Place]:
        """Return where the fleet believes its AUVs."""
        if self.protocol["positions"] == "last_fix":
            return list(self.known)
        return [self.where(i, time) for i in self.auvs]

    def conflicts(self, time: float) -> list[set[int]]:
        """Return of each AUV those that some ASV hears as well."""
        by = self.hearing(time)
        return [
            {
                k
                for k in self.auvs
                if k != i and any(a and b for a, b in zip(by[i], by[k], strict=True))
            }
            for i in self.auvs
        ]

    def groups(self, number: int, time: float) -> list[list[int]]:
        """Return the ping groups of a round."""
        rivals = self.conflicts(time)
        everybody = list(self.auvs)
        if self.schedule in ("one_per_slot", "polling") and not self.schedule_keys.get(
            "side_by_side"
        ):
            return [[i] for i in everybody]
        if self.schedule == "round_robin":
            return [[number % len(everybody)]]
        if self.schedule == "random":
            return [[self.drawn.turns[number]]]
        colours: dict[int, int] = {}
        while len(colours) < len(everybody):
            free = [i for i in everybody if i not in colours]
            if self.schedule == "dsatur":
                free.sort(
                    key=lambda i: (
                        -len({colours[k] for k in rivals[i] if k in colours}),
                        -len(rivals[i]),
                        i,
                    )
                )
            taken = {colours[k] for k in rivals[free[0]] if k in colours}
            colours[free[0]] = next(k for k in range(len(everybody)) if k not in taken)
        return [[i for i in everybody if colours[i] == k] for k in range(max(colours.values()) + 1)]

    # Uplink

    def send(self, ping: Ping) -> None:
        """Let an AUV ping: all ASVs in range are reached."""
        place = self.where(ping.auv, ping.sent)
        for j in self.all_asvs:
            front = ping.arrivals[j] = ping.sent + math.dist(place, self.asvs[j]) / self.speed
            if self.heard(place, self.asvs[j]):
                self.at_asv[j].append((front, front + self.ping_s, ping))
                if self.works(j, front):
                    ping.in_range.append(j)
        ping.ready = max((ping.arrivals[j] + self.ping_s for j in ping.in_range), default=ping.sent)
        if self.protocol["duplex"] == "per_node":
            self.frames_at[ping.auv].append((ping.sent, ping.sent + self.ping_s, ping))
        self.pings.append(ping)
        self.undecided.append(ping)

    def outcome(self, ping: Ping, asv: int) -> str:
        """Return what becomes of a ping at an ASV, once all that overlaps it is known."""
        if asv not in ping.in_range:
            return "out_of_range"
        begin = ping.arrivals[asv]
        if begin + self.ping_s > self.end:
            return "in_flight"
        if not self.works(asv, begin, begin + self.ping_s):
            return "lost"
        return (
            "collided"
            if overlapped(self.at_asv[asv], begin, begin + self.ping_s, ping)
            else "heard"
        )

    def decide(self, until: float) -> None:
        """Decide all pings that have passed by an instant; what was heard becomes fixes."""
        for ping in sorted((p for p in self.undecided if p.ready <= until), key=lambda p: p.ready):
            self.undecided.remove(ping)
            ping.outcomes = {j: self.outcome(ping, j) for j in self.all_asvs}
            by = [j for j in self.all_asvs if ping.outcomes[j] == "heard"]
            if by and ping.ready <= self.end:
                self.learn(Fix(ping, by, self.where(ping.auv, ping.sent)))

    def learn(self, fix: Fix) -> None:
        """Take a fix: it waits for the downlink, and the fleet knows where the AUV was."""
        self.fixes.append(fix)
        self.waiting.append(fix)
        self.known[fix.ping.auv] = fix.place

    def ping_group(self, number: int, slot: int, group: list[int], start: float) -> float:
        """Let a group ping in its slot; return when the next slot begins."""
        if self.called:
            return self.call_group(number, slot, group, start)
        for i in group:
            if start < self.end:
                self.send(Ping(number, slot, i, start, [], {}))
        if self.reply_s or self.downlink == "direct_reply":
            self.answer(self.after(start, self.slot_s))
        return self.after(start, self.slot_s)

    def call_group(self, number: int, slot: int, group: list[int], start: float) -> float:
        """Call the AUVs of a group, each by the nearest ASV; those that hear it answer."""
        following = self.after(start, self.slot_s)
        callers: dict[int, int | None] = {}
        for i in group:
            working = [j for j in self.all_asvs if self.works(j, start)]
            callers[i] = min(
                working, key=lambda j: (math.dist(self.places[i], self.asvs[j]), j), default=None
            )
        calls: dict[int, object] = {}
        for j in sorted({j for j in callers.values() if j is not None}):
            call = calls[j] = object()
            self.at_asv[j].append((start, start + self.ping_s, call))
            for k in self.all_asvs:
                if k != j and self.heard(self.asvs[j], self.asvs[k]):
                    reached = start + math.dist(self.asvs[j], self.asvs[k]) / self.speed
                    self.at_asv[k].append((reached, reached + self.ping_s, call))
            for i in self.auvs:
                if self.heard(self.where(i, start), self.asvs[j]):
                    front = self.reaches_auv(self.asvs[j], i, start)
                    self.calls_at[i].append((front, front + self.ping_s, call))
        ends = []
        for i in group:
            ping = Ping(number, slot, i, start, [], {}, called=start, caller=callers[i])
            if callers[i] is None:
                continue
            mine = calls[callers[i]]
            at = next(((a, b) for a, b, call in self.calls_at[i] if call is mine), None)
            if at is None:
                ping.call = "out_of_range"
            elif not self.works(callers[i], start, start + self.ping_s):
                ping.call = "lost"
            elif overlapped(self.calls_at[i], *at, mine):
                ping.call = "collided"
            elif at[1] > self.end:
                ping.call = "in_flight"
            else:
                ping.call = "heard"
                ping.sent = at[0] + self.ping_s + self.turnaround
                if ping.sent >= self.end:
                    ping.call, ping.sent = "in_flight", start
            if ping.call == "heard":
                self.send(ping)
                ends.append((ping, callers[i]))
            else:
                place = self.where(i, start)
                ping.in_range = [
                    j
                    for j in self.all_asvs
                    if self.heard(place, self.asvs[j])
                    and self.works(j, start + math.dist(place, self.asvs[j]) / self.speed)
                ]
                ping.outcomes = {
                    j: ping.call if j in ping.in_range else "out_of_range" for j in self.all_asvs
                }
                self.pings.append(ping)
        if self.downlink == "direct_reply":
            self.answer(following)
        if self.schedule != "polling":
            return following
        answered = [p.arrivals[j] + self.ping_s for p, j in ends if self.outcome(p, j) == "heard"]
        if len(answered) < len(group):
            return following
        return self.after(start, max(answered) + self.reply_s - start)

    # Downlink

    def choose(self, number: int, time: float, fixes: list[Fix]) -> int | None:
        """Return which ASV broadcasts."""
        working = [j for j in self.all_asvs if self.works(j, time)]
        if not working:
            return None
        if self.broadcaster == "random":
            return self.drawn.broadcasters[len(self.broadcasts)]
        if self.broadcaster == "most_fixes":
            return max(working, key=lambda j: (sum(j in f.asvs for f in fixes), -j))
        if self.broadcaster == "nearest":
            return min(
                working, key=lambda j: (sum(horizontal(f.place, self.asvs[j]) for f in fixes), j)
            )
        if self.broadcaster == "fixed":
            first = self.broadcaster_keys.get("asv", 0)
            return min(working, key=lambda j: (j - first) % len(self.asvs))
        return working[len(self.broadcasts) % len(working)]

    def broadcast(self, row: Row, start: float) -> float:
        """Broadcast what waits, as of a round; return when the downlink slot ends."""
        if start >= self.end:
            return start
        self.decide(start)
        sender = self.choose(row["round"], start, self.waiting)
        row["downlink_s"] = row["downlink_s"] or 0.0
        if sender is None:
            return start
        fixes, self.waiting = self.waiting, []
        self.frame(row["round"], sender, start, fixes)
        end = self.after(start, self.frame_slot(self.airtime(len(fixes))))
        row["fixes"] += len(fixes)
        row["downlink_s"] += end - start
        return end

    def frame(self, number: int, asv: int, start: float, fixes: list[Fix], part: int = 0) -> None:
        """Send a frame: what becomes of it at each AUV is worked out at the end (`listen`)."""
        whole = self.airtime(len(fixes))
        stops = min(
            (f["at_s"] for f in self.failures if f["asv"] == asv and f["at_s"] > start),
            default=math.inf,
        )
        airtime = min(whole, stops - start)
        payload = self.mf["header_bytes"] + len(fixes) * self.mf["fix_bytes"]
        row: Row = {
            "round": number,
            "asv": asv,
            "sent_at_s": start,
            "airtime_s": airtime,
            "payload_bytes": payload,
            "fixes": len(fixes),
            "part": part,
        }
        self.broadcasts.append(row)
        if self.protocol["duplex"] == "per_node" or self.downlink == "direct_reply":
            self.at_asv[asv].append((start, start + airtime, row))
        for fix in fixes:
            fix.sent, fix.by = start, asv
        at = {}
        for i in self.auvs:
            front = self.reaches_auv(self.asvs[asv], i, start)
            back = self.reaches_auv(self.asvs[asv], i, start + airtime)
            near = horizontal(self.where(i, start), self.asvs[asv]) <= self.mf["range_m"]
            if near:
                self.frames_at[i].append((front, back, row))
            at[i] = (front, back, near)
        self.frames.append({"row": row, "at": at, "fixes": fixes, "whole": airtime == whole})

    def listen(self) -> list[Row]:
        """Return what becomes of each frame at each AUV, and of the fixes that it carries."""
        rows = []
        for number, frame in enumerate(self.frames):
            for i, (front, back, near) in frame["at"].items():
                if not near:
                    outcome = "out_of_range"
                elif back > self.end:
                    outcome = "in_flight"
                elif not frame["whole"]:
                    outcome = "lost"
                elif overlapped(self.frames_at[i], front, back, frame["row"]):
                    outcome = "collided"
                else:
                    outcome = "heard"
                rows.append(
                    {
                        "broadcast": number,
                        "auv": i,
                        "outcome": outcome,
                        "arrived_at_s": front if front < self.end else None,
                    }
                )
                for fix in frame["fixes"]:
                    if fix.ping.auv == i:
                        fix.outcome = "delivered" if outcome == "heard" else outcome
                        late = self.after(fix.sent, back - fix.sent)
                        if outcome == "heard":
                            fix.delivered = late if late < self.end else None
                            fix.outcome = "delivered" if late < self.end else "in_flight"
        return rows

    def answer(self, until: float) -> None:
        """Let the first ASV that decodes a ping reply, ping by ping as they are decoded."""
        ends = sorted(
            (p.arrivals[j] + self.ping_s, n, j)
            for n, p in enumerate(self.undecided)
            for j in p.in_range
        )
        pings = list(self.undecided)
        replied = set()
        for end, n, j in ends:
            ping = pings[n]
            ping.outcomes[j] = self.outcome(ping, j)
            if ping.outcomes[j] == "heard" and n not in replied:
                replied.add(n)
                fix = Fix(ping, [j], self.where(ping.auv, ping.sent))
                self.learn(fix)
                self.waiting.remove(fix)
                self.rounds[-1]["fixes"] += 1
                self.frame(ping.round, j, end, [fix])
        for ping in pings:
            for j in self.all_asvs:
                ping.outcomes.setdefault(j, self.outcome(ping, j))
        self.undecided.clear()

    # Rounds

    def fly(self) -> None:
        """Fly the mission."""
        number, start = 0, 0.0
        while start < self.end:
            start = self.one_round(number, start)
            number += 1
        self.decide(math.inf)

    def one_round(self, number: int, start: float) -> float:
        """Play a round; return when the next begins."""
        self.places = self.believed(start)
        conflicts = sum(map(len, self.conflicts(start))) // 2
        groups = self.groups(number, start)
        row: Row = {
            "round": number,
            "started_at_s": start,
            "colours": len(groups),
            "conflicts": conflicts,
            "uplink_s": None,
            "downlink_s": None,
            "fixes": 0,
        }
        self.rounds.append(row)
        time = start
        for slot, group in enumerate(groups):
            if time >= self.end:
                return time
            time = self.ping_group(number, slot, group, time)
            if time <= self.end:
                row["uplink_s"] = time - start
            if self.downlink == "pipelined_group":
                time = max(time, self.free)
                self.free = self.broadcast(row, time)
        if self.downlink == "sequential":
            time = self.broadcast(row, time)
        elif self.downlink == "pipelined_round":
            time = max(time, self.free)
            self.free = self.broadcast(row, time)
        elif self.downlink == "direct_reply" and time <= self.end:
            row["downlink_s"] = 0.0
        if self.schedule in ("round_robin", "random"):
            frame = self.protocol["frame_s"]
            time = max(time, self.after(0.0, (number + 1) * frame) + self.waited)
        while time < self.end and not any(self.works(j, time) for j in self.all_asvs):
            back = min(f["until_s"] or math.inf for f in self.failures if self.fails(f, time))
            self.waited, time = self.waited + self.after(0.0, back) - time, self.after(0.0, back)
        return time


def named(part: object) -> tuple[str, Row]:
    """Return the name of a part and its settings."""
    return (part["model"], part) if isinstance(part, dict) else (str(part), {})


def overlapped(sounds: list, begin: float, end: float, own: object) -> bool:
    """Tell whether another sound is there between two instants."""
    return any(a < end and begin < b for a, b, sound in sounds if sound is not own)

"""A second implementation of the protocols, written from docs/model.md and docs/protocols.md alone.

Plain Python: no numba, no SimPy, nothing of the package, whose source its author had not read. Time
goes on in the loops of `fly`; what a vehicle hears is found by comparing all intervals at it. It
knows the disc without loss, ASVs at rest, AUVs at rest or on a straight leg, and instruments
without noise. What the simulator draws by lot it is given (`Drawn`).
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass, field

Row = dict[str, object]
Place = tuple[float, float, float]


@dataclass
class Drawn:
    """What is drawn at random.

    Turns and broadcasters of `random`; of random access each ping's AUV, when it wanted to ping and
    about when it did.
    """

    turns: list[int] = field(default_factory=list)
    broadcasters: list[int] = field(default_factory=list)
    pings: list[tuple[int, float, float]] = field(default_factory=list)


@dataclass(eq=False)
class Ping:
    """A ping of an AUV or (passive) an ASV, or a turn whose call was in vain (not heard)."""

    round: int
    slot: int
    auv: int | None
    sent: float
    asv: int | None = None
    called: float | None = None
    caller: int | None = None
    call: str | None = None
    waited: float | None = None
    place: Place = (0.0, 0.0, 0.0)
    in_range: list[int] = field(default_factory=list)
    arrivals: dict[int, float] = field(default_factory=dict)
    passed: float = math.inf


@dataclass(eq=False)
class Fix:
    """A fix of a ping, and what becomes of it."""

    ping: Ping
    auv: int
    asvs: list[int]
    sent: float | None = None
    by: int | None = None
    delivered: float | None = None
    outcome: str = "in_flight"


@dataclass(eq=False)
class Frame:
    """A frame: its row, its fixes, whether its ASV works on, and when it is at each AUV."""

    row: Row
    fixes: list[Fix]
    whole: bool
    at: list[tuple[float, float]]
    in_range: list[int]


class Second:
    """A mission, flown by `fly`; its events are in `rounds`, `pings`, `frames` and `fixes`."""

    def __init__(self, keys: Row, drawn: Drawn) -> None:
        """Take a scenario's keys, of which all that matter here are given."""
        self.drawn, self.end = drawn, keys["duration_s"]
        hf, self.mf, self.keys = keys["acoustics"]["hf"], keys["acoustics"]["mf"], keys["protocol"]
        self.reach, self.metric, self.ping_s = hf["range_m"], hf["range_metric"], hf["ping_s"]
        self.speed = keys["environment"]["sound_speed_m_per_s"]
        self.depth, route = keys["survey"]["depth_m"], keys["auvs"]["route"]
        self.legs = route.get("points_m") or [[at, at] for at in route["positions_m"]]
        self.auv_speed = keys["auvs"]["speed_m_per_s"]
        self.places = [(x, y, 0.0) for x, y in keys["asvs"]["formation"]["positions_m"]]
        self.failures = keys["asvs"]["failures"]
        self.auvs, self.asvs = range(keys["auvs"]["count"]), range(len(self.places))
        self.schedule, self.schedule_keys = named(self.keys["schedule"])
        self.downlink, self.downlink_keys = named(self.keys["downlink"])
        self.broadcaster, self.broadcaster_keys = named(self.keys["broadcaster"])
        self.ranging, self.ranging_keys = named(self.keys["ranging"])
        own = keys["navigation"]
        self.drift = math.hypot(*own["velocity_bias_m_per_s"]), own["random_walk_m_per_sqrt_s"]
        self.processing = self.mf["processing_s"] or 0.0
        self.capacity = ((self.mf["payload_bytes"] or 10**9) - self.mf["header_bytes"]) // self.mf[
            "fix_bytes"
        ]
        self.random_access = self.schedule in ("aloha", "slotted_aloha", "csma")
        self.plan_slots(keys)
        self.rounds: list[Row] = []
        self.pings: list[Ping] = []
        self.frames: list[Frame] = []
        self.fixes: list[Fix] = []
        self.passing: list[Ping] = []  # pings whose fate is open
        self.waiting: list[Fix] = []  # fixes that wait for the downlink
        self.known = [self.where(i, 0.0) for i in self.auvs]  # where fixes put the AUVs
        self.turns: list[list[int]] = [[] for _ in self.auvs]  # rounds, if somebody hears the AUV
        self.free = self.waited = 0.0  # end of the last downlink slot; time without ASVs
        # What arrives, as (begin, end, sound)
        self.hf_at_asv: list[list] = [[] for _ in self.asvs]
        self.hf_at_auv: list[list] = [[] for _ in self.auvs]
        self.mf_at_auv: list[list] = [[] for _ in self.auvs]

    def plan_slots(self, keys: Row) -> None:
        """Work out how long slots last."""
        believed = keys["environment"]["assumed_sound_speed_m_per_s"] or self.speed
        crossing = keys["survey"]["side_m"] / believed
        longest = self.reach if self.metric == "slant" else math.hypot(self.reach, self.depth)
        self.longest_s = longest / believed

        def given(key: str, crossings: float) -> float:
            return crossings * crossing if self.keys[key] is None else self.keys[key]

        self.down_guard = given("downlink_guard_s", 1.25)
        self.down_shortest = given("shortest_downlink_slot_s", 10.0)
        self.called = self.ranging == "twtt" or self.schedule == "polling"
        self.turnaround = self.ranging_keys.get("turnaround_s", 0.0)
        slot = self.ping_s + self.longest_s + given("uplink_guard_s", 0.5)
        if self.called:
            slot += self.ping_s + self.turnaround + self.longest_s
        self.replies = self.downlink == "direct_reply"
        self.reply_s = self.airtime(1) + self.down_guard if self.replies else 0.0
        self.slot_s = max(slot, given("shortest_uplink_slot_s", 2.5)) + self.reply_s

    # Vehicles, sound and clock

    def where(self, auv: int, time: float) -> Place:
        """Return where an AUV is: on its leg, or at rest."""
        (x, y), (to_x, to_y) = self.legs[auv]
        way = math.hypot(to_x - x, to_y - y)
        share = self.auv_speed * time / way if way > 0 else 0.0
        return (x + share * (to_x - x), y + share * (to_y - y), self.depth)

    def works(self, asv: int, begin: float, end: float | None = None) -> bool:
        """Tell whether an ASV works at an instant, or all the time from one to another."""
        end = begin if end is None else end
        return not any(
            f["asv"] == asv and f["at_s"] <= end and begin < (f["until_s"] or math.inf)
            for f in self.failures
        )

    def working(self, time: float) -> list[int]:
        """Return the ASVs that work at an instant."""
        return [j for j in self.asvs if self.works(j, time)]

    def reaches(self, a: Place, b: Place, margin: float = 0.0) -> bool:
        """Tell whether two places are within HF range of each other."""
        distance = math.dist(a, b) if self.metric == "slant" else horizontal(a, b)
        return distance <= self.reach + margin

    def arrival(self, source: Place, auv: int, time: float) -> float:
        """Return when what is sent somewhere reaches an AUV: the light-time equation."""
        late = 0.0
        for _ in range(10):
            late = math.dist(source, self.where(auv, time + late)) / self.speed
        return time + late

    def after(self, start: float, duration: float) -> float:
        """Return the instant so much later, on a tick where there are ticks."""
        rate = self.keys["tick_rate_hz"]
        if rate is None or duration == math.inf:
            return start + duration
        return math.ceil((start + duration) * rate - 1e-7) / rate

    # Who pings when

    def believed(self, time: float) -> list[Place]:
        """Return where the fleet believes its AUVs."""
        if self.keys["positions"] == "last_fix":
            return list(self.known)
        return [self.where(i, time) for i in self.auvs]

    def hearers(self, time: float) -> list[set[int]]:
        """Return of each AUV the ASVs that hear it, as the fleet believes."""
        margin, working = self.keys["conflict_margin_m"], self.working(time)
        return [
            {j for j in working if self.reaches(place, self.places[j], margin)}
            for place in self.believed(time)
        ]

    def groups(self, start: float, by: list[set[int]], rivals: list[set[int]]) -> list[list[int]]:
        """Return the ping groups of a round, by who hears whom and who conflicts with whom."""
        if self.schedule in ("one_per_slot", "polling"):
            return [[i] for i in self.auvs]
        if self.schedule == "round_robin":
            return [[len(self.rounds) % len(self.auvs)]]
        if self.schedule == "random":
            return [[self.drawn.turns[len(self.rounds)]]]
        if self.schedule == "worst_first":
            return self.worst_first(start, by, rivals)
        return coloured(rivals, by_saturation=self.schedule == "dsatur")

    def worst_first(
        self, start: float, by: list[set[int]], rivals: list[set[int]]
    ) -> list[list[int]]:
        """Return groups of the AUVs with the largest claims; the others wait."""
        bias, walk = self.drift
        claims = []
        for i in self.auvs:
            sent = [f for f in self.fixes if f.auv == i and (f.sent or math.inf) <= start]
            age = start - max((f.ping.sent for f in sent), default=0.0)
            last = max((f.ping.round for f in sent), default=-1)
            in_vain = sum(number > last for number in self.turns[i])
            claims.append(math.sqrt((bias * age) ** 2 + 2 * walk**2 * age) / (in_vain + 2))
        groups: list[list[int]] = [[] for _ in range(self.schedule_keys.get("slots", 4))]
        for i in sorted(self.auvs, key=lambda i: -claims[i]):
            free = [group for group in groups if not rivals[i] & set(group)]
            if free:
                free[0].append(i)
                self.turns[i] += [len(self.rounds)] if by[i] else []
        return [sorted(group) for group in groups if group]

    # Uplink

    def ping_group(self, slot: int, group: list[int], start: float) -> float:
        """Let a group ping in its slot; return when the next slot begins."""
        number = len(self.rounds) - 1
        following = self.after(start, self.slot_s)
        if self.called:
            calls = self.call(group, start)
            turns = [Ping(number, slot, i, start, None, start, j) for i, j in calls.items()]
        else:
            turns = [Ping(number, slot, i, start) for i in group]
        for ping in turns:
            self.take_turn(ping)
        if self.replies:
            self.reply()
        if self.schedule == "polling":
            heard = [p for p in turns if p.arrivals and self.outcome(p, p.caller) == "heard"]
            if len(heard) == len(group):
                end = max(p.arrivals[p.caller] for p in heard) + self.ping_s
                return self.after(end, self.reply_s)
        return following

    def call(self, group: list[int], time: float) -> dict[int, int]:
        """Call the AUVs of a group, each by the nearest ASV; return who is called by whom."""
        callers = {}
        for i in group:
            near = sorted(
                self.working(time), key=lambda j: math.dist(self.launch[i], self.places[j])
            )
            callers.update({i: near[0]} if near else {})
        for j in sorted(set(callers.values())):
            call = (time, j)
            for k in self.asvs:
                if self.reaches(self.places[j], self.places[k]):
                    at = time + math.dist(self.places[j], self.places[k]) / self.speed
                    self.hf_at_asv[k].append((at, at + self.ping_s, call))
            for i in self.auvs:
                if self.reaches(self.where(i, time), self.places[j]):
                    at = self.arrival(self.places[j], i, time)
                    self.hf_at_auv[i].append((at, at + self.ping_s, call))
        return callers

    def take_turn(self, ping: Ping) -> None:
        """Let an AUV ping, if it has its call, where it needs one."""
        if ping.caller is not None:
            self.await_call(ping)
        if ping.sent >= self.end:
            return
        ping.place = self.where(ping.auv, ping.sent)
        at = [ping.sent + math.dist(ping.place, asv) / self.speed for asv in self.places]
        near = [j for j in self.asvs if self.reaches(ping.place, self.places[j])]
        ping.in_range = [j for j in near if self.works(j, at[j])]
        self.pings.append(ping)
        if ping.call not in (None, "heard"):
            return
        ping.arrivals = dict(enumerate(at))
        ping.passed = max((at[j] + self.ping_s for j in ping.in_range), default=ping.sent)
        for j in near:
            self.hf_at_asv[j].append((at[j], at[j] + self.ping_s, ping))
        if self.keys["duplex"] == "per_node":
            self.mf_at_auv[ping.auv].append((ping.sent, ping.sent + self.ping_s, ping))
        self.passing.append(ping)

    def await_call(self, ping: Ping) -> None:
        """Decide what becomes of a ping's call, and when its AUV answers it."""
        call = (ping.called, ping.caller)
        at = [(begin, end) for begin, end, sound in self.hf_at_auv[ping.auv] if sound == call]
        answer = at[0][1] + self.turnaround if at else math.inf
        if not at:
            ping.call = "out_of_range"
        elif not self.works(ping.caller, ping.called, ping.called + self.ping_s):
            ping.call = "lost"
        elif overlapped(self.hf_at_auv[ping.auv], *at[0], call):
            ping.call = "collided"
        elif answer >= self.end:
            ping.call = "in_flight"
        else:
            ping.call, ping.sent = "heard", answer

    def listeners(self, ping: Ping) -> range:
        """Return who may hear a ping: the ASVs, or (passive) the AUVs."""
        return self.asvs if ping.asv is None else self.auvs

    def outcome(self, ping: Ping, at: int) -> str:
        """Return what becomes of a ping at an ASV (passive: AUV), once all sounds are known."""
        if at not in ping.in_range:
            return "out_of_range"
        if not ping.arrivals:
            return ping.call
        begin, end = ping.arrivals[at], ping.arrivals[at] + self.ping_s
        if ping.asv is not None:
            whole = self.works(ping.asv, ping.sent, ping.sent + self.ping_s)
            return self.fate(self.hf_at_auv[at], begin, end, ping, whole)
        return self.fate(self.hf_at_asv[at], begin, end, ping, self.works(at, begin, end))

    def fate(self, sounds: list, begin: float, end: float, own: object, whole: bool) -> str:
        """Return what becomes of a sound that arrives, the first that holds."""
        if end > self.end:
            return "in_flight"
        if not whole:
            return "lost"
        return "collided" if overlapped(sounds, begin, end, own) else "heard"

    def decide(self, until: float) -> None:
        """Decide all pings that have passed by an instant; what was heard becomes fixes."""
        for ping in sorted(self.passing, key=lambda p: p.passed):
            if ping.passed <= until:
                self.passing.remove(ping)
                by = [j for j in self.asvs if self.outcome(ping, j) == "heard"]
                if by and ping.passed <= self.end:
                    self.waiting.append(self.fix(ping, by))

    def fix(self, ping: Ping, asvs: list[int]) -> Fix:
        """Make a fix of a ping: the fleet knows where its AUV was."""
        self.fixes.append(Fix(ping, ping.auv, asvs))
        self.known[ping.auv] = ping.place
        return self.fixes[-1]

    # Downlink

    def airtime(self, fixes: int) -> float:
        """Return how long a frame of so many fixes is on the air."""
        return 8 * self.payload(fixes) * self.mf["overhead"] / self.mf["bit_rate_bps"]

    def payload(self, fixes: int) -> int:
        """Return how many bytes a frame of so many fixes has."""
        return self.mf["header_bytes"] + fixes * self.mf["fix_bytes"]

    def chosen(self, working: list[int], fixes: list[Fix]) -> int:
        """Return which of the ASVs that work broadcasts fixes."""
        if self.broadcaster == "random":
            return self.drawn.broadcasters[len(self.frames)]
        if self.broadcaster == "fixed":
            first = self.broadcaster_keys["asv"]
            return min(working, key=lambda j: (j - first) % len(self.asvs))
        if self.broadcaster == "most_fixes":
            return max(working, key=lambda j: (sum(j in f.asvs for f in fixes), -j))
        if self.broadcaster == "nearest":
            far = [sum(horizontal(f.ping.place, at) for f in fixes) for at in self.places]
            return min(working, key=lambda j: far[j])
        number = sum(frame.row["part"] == 0 for frame in self.frames)
        return working[number % len(working)]

    def broadcast(self, start: float) -> float:
        """Broadcast what waits, as of the last round; return when the downlink slot ends."""
        if start >= self.end:
            return start
        self.decide(start)
        row = self.rounds[-1]
        row["downlink_s"] = row["downlink_s"] or 0.0
        working = self.working(start)
        if not working:
            return start
        end = start
        for shares in self.senders(start, working):
            begun = end
            ends = [self.send(row["round"], asv, begun, fixes) for asv, fixes in shares.items()]
            end = self.after(max(ends), self.down_guard)
        end = max(end, self.after(start, self.down_shortest))
        row["downlink_s"] += end - start
        return end

    def senders(self, start: float, working: list[int]) -> list[dict[int, list[Fix]]]:
        """Return who sends what: fixes of each ASV, of those that broadcast at once."""
        if self.broadcaster != "parallel":
            fixes, self.waiting = self.waiting, []
            if self.mf["overfull"] == "oldest_first":
                fixes, self.waiting = fixes[: self.capacity], fixes[self.capacity :]
            return [{self.chosen(working, fixes): fixes}]
        shares: dict[int, list[Fix]] = {}
        for fix in self.waiting:
            far = {j: horizontal(fix.ping.place, self.places[j]) for j in working}
            shares.setdefault(min(working, key=lambda j: far[j]), []).append(fix)
        self.waiting, shares = (
            [],
            dict(sorted(shares.items(), key=lambda x: (-len(x[1]), x[0]))) or {working[0]: []},
        )
        listeners = {
            j: {
                i
                for i, place in enumerate(self.believed(start))
                if horizontal(place, self.places[j]) <= self.mf["range_m"]
            }
            for j in shares
        }
        asvs = list(shares)
        rivals = [
            {n for n, k in enumerate(asvs) if k != j and listeners[j] & listeners[k]} for j in asvs
        ]
        return [{asvs[n]: shares[asvs[n]] for n in group} for group in coloured(rivals)]

    def send(self, number: int, asv: int, start: float, fixes: list[Fix]) -> float:
        """Send fixes, in several frames if one does not hold them; return when that ends."""
        for part in range(max(1, math.ceil(len(fixes) / self.capacity))):
            share = fixes[part * self.capacity : (part + 1) * self.capacity]
            if start < self.end:
                self.send_frame(number, asv, start, share, part)
            start += self.airtime(len(share))
        return start

    def send_frame(self, number: int, asv: int, start: float, fixes: list[Fix], part: int) -> None:
        """Send a frame, until its ASV fails; the end of `fly` tells what becomes of it."""
        planned = self.airtime(len(fixes))
        fails = [
            max(0.0, f["at_s"] - start)
            for f in self.failures
            if f["asv"] == asv and start < (f["until_s"] or math.inf)
        ]
        airtime = min([planned, *fails])
        row: Row = {
            "round": number,
            "asv": asv,
            "sent_at_s": start,
            "airtime_s": airtime,
            "payload_bytes": self.payload(len(fixes)),
            "fixes": len(fixes),
            "part": part,
        }
        at = [
            (
                self.arrival(self.places[asv], i, start),
                self.arrival(self.places[asv], i, start + airtime),
            )
            for i in self.auvs
        ]
        far = [horizontal(self.where(i, start), self.places[asv]) for i in self.auvs]
        near = [i for i in self.auvs if far[i] <= self.mf["range_m"]]
        frame = Frame(row, fixes, airtime == planned, at, near)
        self.frames.append(frame)
        self.rounds[number]["fixes"] += len(fixes)
        if self.keys["duplex"] == "per_node" or self.replies:
            self.hf_at_asv[asv].append((start, start + airtime, frame))
        for fix in fixes:
            fix.sent, fix.by = start, asv
        for i in near:
            self.mf_at_auv[i].append((*at[i], frame))

    def reception(self, frame: Frame, auv: int) -> str:
        """Return what becomes of a frame at an AUV, once all that overlaps it is known."""
        if auv not in frame.in_range:
            return "out_of_range"
        return self.fate(self.mf_at_auv[auv], *frame.at[auv], frame, frame.whole)

    def deliver(self, fix: Fix, frame: Frame) -> None:
        """Tell what becomes of a fix, as of its frame."""
        outcome = self.reception(frame, fix.auv)
        at = self.after(frame.at[fix.auv][1], self.processing)
        if at >= self.end and outcome != "out_of_range":
            outcome = "in_flight"
        fix.outcome, fix.delivered = ("delivered", at) if outcome == "heard" else (outcome, None)

    def reply(self) -> None:
        """Let the first ASV that decodes a ping reply, ping by ping as they are decoded."""
        ends = [
            (ping.arrivals[j] + self.ping_s, n, j)
            for n, ping in enumerate(self.passing)
            for j in ping.in_range
        ]
        replied = set()
        for end, n, j in sorted(ends):
            ping = self.passing[n]
            if n not in replied and self.outcome(ping, j) == "heard":
                replied.add(n)
                self.send(ping.round, j, end, [self.fix(ping, [j])])
        self.passing = []

    # Passive ranging

    def passive_round(self, start: float) -> float:
        """Let the ASVs ping in turn; each AUV that hears one fixes itself."""
        row, _ = self.begin_round(start)
        working = self.working(start)
        row["colours"], row["conflicts"] = len(working), 0
        time = start
        for slot, j in enumerate(working):
            if time >= self.end:
                break
            if self.works(j, time):
                ping = Ping(row["round"], slot, None, time, asv=j, place=self.places[j])
                ping.arrivals = {i: self.arrival(ping.place, i, time) for i in self.auvs}
                near = [i for i in self.auvs if self.reaches(ping.place, self.where(i, time))]
                ping.in_range = near
                for i in near:
                    at = ping.arrivals[i]
                    self.hf_at_auv[i].append((at, at + self.ping_s, ping))
                self.pings.append(ping)
            time = self.after(time, self.slot_s)
            row["uplink_s"] = time - start if time <= self.end else row["uplink_s"]
        row["downlink_s"] = 0.0
        return self.await_asv(time)

    def fix_themselves(self) -> None:
        """Make the fixes of AUVs that have heard ASVs."""
        for ping in self.pings:
            for i in self.auvs:
                if self.outcome(ping, i) == "heard":
                    delivered = ping.arrivals[i] + self.ping_s
                    fix = Fix(ping, i, [ping.asv], None, None, delivered, "delivered")
                    self.fixes.append(fix)
                    self.rounds[ping.round]["fixes"] += 1

    # Random access

    def ping_at_random(self) -> None:
        """Let the AUVs ping, each when it wants to, at the next slot, or after its backoff."""
        for auv, wanted, about in self.drawn.pings:
            ping = Ping(0, 0, auv, wanted)
            if self.schedule == "slotted_aloha":
                slot = self.after(0.0, self.slot_s)
                ping.sent = round(about / slot) * slot
            elif self.schedule == "csma":
                ping.sent = self.hold_back(auv, wanted, about)
                ping.waited = ping.sent - wanted
            self.take_turn(ping)
            for i in self.auvs if self.schedule == "csma" else ():
                if self.reaches(ping.place, self.where(i, ping.sent)):
                    at = ping.sent if i == auv else self.arrival(ping.place, i, ping.sent)
                    self.hf_at_auv[i].append((at, at + self.ping_s, ping))

    def hold_back(self, auv: int, wanted: float, about: float) -> float:
        """Return when an AUV pings, which counts slots of quiet if it hears a ping at first."""
        heard = sorted((a, b) for a, b, _ in self.hf_at_auv[auv] if wanted < b)
        if not heard or heard[0][0] > wanted:
            return wanted
        slot = self.schedule_keys["slot_s"] or self.ping_s + self.longest_s
        gaps, until = [], wanted  # of quiet
        for a, b in heard:
            if a > until:
                gaps.append((until, a))
            until = max(b, until)
        gaps.append((until, math.inf))
        quiet = sum(min(b, about) - min(a, about) for a, b in gaps)
        left = round(quiet / slot) * slot  # as many slots as it has drawn
        for a, b in gaps:
            if left <= b - a:
                return a + left
            left -= b - a
        return math.inf

    def broadcast_at_once(self) -> None:
        """Broadcast fixes as soon as MF is free; each broadcast ends a round."""
        start = 0.0
        while start < self.end:
            row, _ = self.begin_round(start)
            self.decide(start)
            time = start
            if self.replies:
                row["downlink_s"] = 0.0
                self.reply()
                break
            while not self.waiting and self.passing:
                time = min(p.passed for p in self.passing)
                self.decide(time)
            time = self.await_asv(self.after(0.0, time))
            if not self.waiting or time >= self.end:
                break
            row["uplink_s"] = time - start
            start = self.broadcast(time)
        for ping in self.pings:
            began = [row["round"] for row in self.rounds if row["started_at_s"] < ping.sent + 1e-9]
            ping.round = max(began)

    # Rounds

    def fly(self) -> None:
        """Fly the mission."""
        start = 0.0
        if self.random_access:
            self.ping_at_random()
            self.broadcast_at_once()
        while start < self.end and not self.random_access:
            start = (self.passive_round if self.ranging == "passive" else self.one_round)(start)
        if self.ranging == "passive":
            self.fix_themselves()
        self.decide(math.inf)
        for frame in self.frames:
            for fix in frame.fixes:
                self.deliver(fix, frame)

    def begin_round(self, start: float) -> tuple[Row, list[list[int]]]:
        """Return the row and the ping groups of a round."""
        by, number = self.hearers(start), len(self.rounds)
        rivals = [{k for k in self.auvs if k != i and by[i] & by[k]} for i in self.auvs]
        groups = [] if self.random_access else self.groups(start, by, rivals)
        self.launch = self.believed(start)
        row: Row = {
            "round": number,
            "started_at_s": start,
            "colours": len(groups),
            "conflicts": sum(map(len, rivals)) // 2,
            "uplink_s": None,
            "downlink_s": None,
            "fixes": 0,
        }
        self.rounds.append(row)
        return row, groups

    def one_round(self, start: float) -> float:
        """Play a round; return when the next begins."""
        self.decide(start)
        row, groups = self.begin_round(start)
        time = start
        for slot, group in enumerate(groups):
            if time >= self.end:
                return time
            time = self.ping_group(slot, group, time)
            row["uplink_s"] = time - start if time <= self.end else row["uplink_s"]
            if self.downlink == "pipelined_group":
                time = max(time, self.free)
                self.free = self.broadcast(time)
        if self.downlink == "sequential":
            time = self.broadcast(time)
        elif self.downlink == "pipelined_round":
            time = max(time, self.free)
            self.free = self.broadcast(time)
        elif self.replies and time <= self.end:
            row["downlink_s"] = 0.0
        if self.schedule in ("round_robin", "random"):
            time = max(time, self.after(0.0, len(self.rounds) * self.keys["frame_s"]) + self.waited)
        return self.await_asv(time)

    def await_asv(self, time: float) -> float:
        """Return when an ASV works."""
        while time < self.end and not self.working(time):
            back = min(
                self.after(0.0, f["until_s"] or math.inf)
                for f in self.failures
                if f["at_s"] <= time < (f["until_s"] or math.inf)
            )
            self.waited, time = self.waited + back - time, back
        return time


def coloured(rivals: list[set[int]], by_saturation: bool = False) -> list[list[int]]:
    """Colour a conflict graph greedily, by number or (DSATUR) by colours and rivals around."""
    colours: dict[int, int] = {}

    def around(i: int) -> set[int]:
        return {colours[k] for k in rivals[i] if k in colours}

    while len(colours) < len(rivals):
        free = [i for i in range(len(rivals)) if i not in colours]
        if by_saturation:
            free.sort(key=lambda i: (-len(around(i)), -len(rivals[i]), i))
        colours[free[0]] = min(set(range(len(rivals))) - around(free[0]))
    groups: Iterable[int] = range(max(colours.values()) + 1)
    return [[i for i in range(len(rivals)) if colours[i] == k] for k in groups]


def named(part: object) -> tuple[str, Row]:
    """Return the name of a part and its settings."""
    return (part["model"], part) if isinstance(part, dict) else (str(part), {})


def horizontal(a: Place, b: Place) -> float:
    """Return the horizontal distance of two places."""
    return math.hypot(a[0] - b[0], a[1] - b[1])


def overlapped(sounds: list, begin: float, end: float, own: object) -> bool:
    """Tell whether another sound is there between two instants."""
    return any(a < end and begin < b for a, b, sound in sounds if sound != own)

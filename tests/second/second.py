"""A second implementation of the protocols, written from docs/model.md and docs/protocols.md alone.

Plain Python: no numba, no SimPy, nothing of the package, whose source its author had not read. Time
goes on in the loops of `fly`, which makes the rows of the tables. What the simulator draws by lot
or measures it is given (`Given`).
"""

import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

from dissemination import Dissemination, Groups
from medium import AN_INSTANT, Place, Row, Sound, horizontal, named


@dataclass
class Given:
    """What is drawn or measured: turns and broadcasters of `random`, random access and places.

    Of random access, each ping's AUV, when it wanted to ping and about when it did; of places,
    where each AUV was measured, when (to 1 us) and with what horizontal variance (m2).
    """

    turns: list[str]
    broadcasters: list[str]
    pings: list[tuple[str, float, float]]
    measured: dict[tuple[str, float], tuple[float, ...]]


class Second(Dissemination):
    """A mission, flown by `fly`; its events are in `rounds`, `pings`, `frames` and `fixes`."""

    def __init__(self, keys: Row, given: Given) -> None:
        """Take a scenario's keys, of which all that matter here are given."""
        super().__init__(keys)
        self.given = given
        self.schedule, self.schedule_keys = named(self.keys["schedule"])
        self.downlink, self.downlink_keys = named(self.keys["downlink"])
        self.broadcaster, self.broadcaster_keys = named(self.keys["broadcaster"])
        self.ranging, self.ranging_keys = named(self.keys["ranging"])
        own = keys["navigation"]
        self.drift = math.hypot(*own["velocity_bias_m_per_s"]), own["random_walk_m_per_sqrt_s"]
        self.random_access = self.schedule in ("aloha", "slotted_aloha", "csma")
        self.replies, self.passive = self.downlink == "direct_reply", self.ranging == "passive"
        self.called = self.ranging == "twtt" or self.schedule == "polling"
        self.told &= not (self.called or self.passive or self.random_access)
        self.on_legs = keys["auvs"]["route"]["kind"] == "waypoints"
        self.deaf = self.keys["duplex"] == "per_node"
        self.plan_slots(keys)
        self.rounds: list[Row] = []
        self.pings: list[Sound] = []
        self.frames: list[Sound] = []
        self.fixes: list[Row] = []
        self.passing: list[Sound] = []  # pings whose fate is open
        self.waiting: list[Row] = []  # fixes that wait for the downlink
        # Where fixes put the AUVs, and when; when slots of `super_tdma` end in rounds
        self.known = {i: self.where(i, 0.0) for i in self.auvs}
        self.known_at = dict.fromkeys(self.auvs, 0.0)
        self.ends: dict[int, list[float]] = {}
        self.turns: dict[str, list[int]] = defaultdict(list)  # rounds, if somebody hears the AUV
        self.free = self.waited = 0.0  # end of the last downlink slot; time without ASVs
        self.broadcasts = 0

    # Time slots

    def plan_slots(self, keys: Row) -> None:
        """Work out how long slots last."""
        believed = keys["environment"]["assumed_sound_speed_m_per_s"] or self.speed
        crossing, longest = keys["survey"]["side_m"] / believed, self.hf["range_m"]
        if self.hf["range_metric"] == "horizontal":
            longest = math.hypot(longest, keys["survey"]["depth_m"])
        self.believed_speed, self.longest_s = believed, longest / believed

        def given(key: str, crossings: float) -> float:
            return crossings * crossing if self.keys[key] is None else self.keys[key]

        self.down_guard = given("downlink_guard_s", 1.25)
        self.down_shortest = given("shortest_downlink_slot_s", 10.0)
        self.turnaround = self.ranging_keys.get("turnaround_s", 0.0)
        slot = self.ping_s + self.longest_s + given("uplink_guard_s", 0.5)
        if self.called:
            slot += self.ping_s + self.turnaround + self.longest_s
        in_frames = self.replies and not self.instant
        self.reply_s = self.airtime(1) + self.down_guard if in_frames else 0.0
        self.slot_s = max(slot, given("shortest_uplink_slot_s", 2.5)) + self.reply_s

    # Who pings when

    def believed(self, time: float) -> dict[str, Place]:
        """Return where the fleet believes its AUVs."""
        if self.keys["positions"] == "truth" and not self.told:
            return {i: self.where(i, time) for i in self.auvs}
        if self.keys["positions"] == "last_fix":
            return dict(self.known)
        return {i: self.carried_forward(i, time) for i in self.auvs}

    def carried_forward(self, auv: str, time: float) -> Place:
        """Return where an AUV should be, by its last fix and the way that is planned since.

        A fix moves a track or a place as a whole; of a leg it says how far along it the AUV is.
        """
        (x, y, depth), (a, b, _) = self.known[auv], self.where(auv, self.known_at[auv])
        now_x, now_y, _ = self.where(auv, time)
        off_x, off_y = x - a, y - b
        if self.on_legs:
            (_, *p, _), (_, *q, _) = self.legs[auv]
            way_x, way_y = ((k - j) / math.dist(p, q) for j, k in zip(p, q, strict=True))
            along = off_x * way_x + off_y * way_y
            off_x, off_y = along * way_x, along * way_y
        return now_x + off_x, now_y + off_y, depth

    def downlink_slot(self, fixes: int, slots: int) -> float:
        """Return how long a downlink slot of so many fixes and slots is."""
        first, *others = self.frames_of(fixes, slots)
        airtime = self.airtime(first, slots) + sum(map(self.airtime, others))
        return max(airtime + self.down_guard, self.down_shortest)

    def opens(self, number: int) -> float:
        """Return when a round begins at the earliest: with its frame."""
        framed = self.schedule in ("round_robin", "random")
        return self.after(0.0, number * self.keys["frame_s"]) + self.waited if framed else 0.0

    def plan(self, number: int, time: float, ahead: float = 0.0) -> tuple[Groups, int]:
        """Return the ping groups of a round and how many AUVs conflict, by what is known.

        The round begins at most so much later (s).
        """
        self.launch, margin = self.believed(time), self.keys["conflict_margin_m"]
        lost = self.lost(time)
        at = {j: self.where(j, time) for j in self.working(time)}

        def hearers(later: float) -> dict[str, set[str]]:
            found: dict[str, set[str]] = {}
            for i, place in self.launch.items():
                extra = max(margin, later * self.fastest(i))
                near = {j for j in at if self.reaches(place, at[j], extra)}
                found[i] = set() if i in lost else near
            return found

        by = hearers(0.0)
        rivals = rivals_of(by)
        if self.schedule == "worst_first":
            near = rivals_of(hearers(ahead))
            groups = self.worst_first(number, time, by, near)
        else:
            groups = [] if self.random_access else self.groups(number, time, by, rivals)
        if self.told:
            groups = self.without(lost, groups, number)
        return groups, 0 if self.passive else sum(map(len, rivals.values())) // 2

    def begin_round(self, start: float) -> list[list[str]]:
        """Begin a round; return its ping groups."""
        number = len(self.rounds)
        self.guess(start)
        if self.told and number == 0:
            self.agree()
        if number not in self.plans:
            self.plans[number] = self.plan(number, start)
        if number not in self.starts or abs(self.starts[number] - start) > AN_INSTANT:
            self.informed[number], self.tellers[number] = set(), []  # nobody was told this
        groups, conflicts = self.plans[number]
        row = {"round": number, "started_at_s": start, "colours": len(groups), "fixes": 0}
        row |= {"downlink_s": 0.0 if self.passive else None}
        self.rounds.append(row | {"conflicts": conflicts, "uplink_s": None})
        return groups

    def groups(self, number: int, start: float, by: dict, rivals: dict) -> list[list[str]]:
        """Return the ping groups of a round, by who hears whom and who conflicts with whom."""
        if self.passive:
            return [[j] for j in self.working(start)]
        if self.schedule in ("one_per_slot", "polling"):
            return [[i] for i in self.auvs]
        if self.schedule == "round_robin":
            return [[self.auvs[number % len(self.auvs)]]]
        if self.schedule == "random":
            return [[self.given.turns[number]]]
        if self.schedule == "super_tdma":
            return self.packed(number, start, by)
        return coloured(rivals, by_saturation=self.schedule == "dsatur")

    def worst_first(self, number: int, start: float, by: dict, rivals: dict) -> list[list[str]]:
        """Return groups of the AUVs with the largest claims; the others wait."""

        def drift(age: float) -> float:
            return (self.drift[0] * age) ** 2 + 2 * self.drift[1] ** 2 * age

        claims = {}
        for i in self.auvs:
            sent = [f for f in self.fixes if f["auv"] == i and f["broadcast_at_s"] is not None]
            sent = [f for f in sent if f["broadcast_at_s"] <= start]
            variance, at = 0.0, 0.0
            for fix in sorted(sent, key=lambda f: f["pinged_at_s"]):
                variance += drift(fix["pinged_at_s"] - at)
                at = fix["pinged_at_s"]
                variance = variance and variance * fix["variance"] / (variance + fix["variance"])
            last = max((f["round"] for f in sent), default=-1)
            in_vain = sum(turn > last for turn in self.turns[i])
            claims[i] = math.sqrt(variance + drift(start - at)) / (in_vain + 2)
        groups: list[list[str]] = [[] for _ in range(self.schedule_keys.get("slots", 4))]
        for i in sorted(self.auvs, key=lambda i: -claims[i]):
            free = [group for group in groups if not rivals[i] & set(group)]
            if free:
                free[0].append(i)
                self.turns[i] += [number] if by[i] else []
        return [sorted(group, key=self.auvs.index) for group in groups if group]

    def packed(self, number: int, start: float, by: dict) -> list[list[str]]:
        """Plan pings so that they arrive apart, the farthest first; return who pings together."""
        c, gap = self.believed_speed, self.ping_s + self.schedule_keys["clear_s"] + self.reply_s
        arrivals: list[tuple[str, float]] = []
        sends, last = {}, 0.0
        ways: dict[str, dict[str, float]] = {i: {} for i in self.auvs}
        for i, own in ways.items():
            for j in by[i]:
                own[j] = min(self.longest_s, math.dist(self.launch[i], self.where(j, start)) / c)
        for i in sorted(self.auvs, key=lambda i: -max(ways[i].values(), default=0.0)):
            taken = [at - ways[i][j] for j, at in arrivals if j in ways[i]]
            tries = [0.0, *(self.after(start, at + gap) - start for at in taken)]
            apart = gap - AN_INSTANT
            send = min(t for t in tries if t >= 0 and all(abs(t - at) > apart for at in taken))
            arrivals += [(j, send + way) for j, way in ways[i].items()]
            sends[i] = send
            last = max(last, send + max(ways[i].values(), default=self.longest_s))
        times = sorted(set(sends.values()))
        self.ends[number] = [*times[1:], self.after(start, last + gap) - start]
        return [[i for i in self.auvs if sends[i] == time] for time in times]

    # Uplink

    def ping_group(self, slot: int, group: list[str], start: float) -> float:
        """Let a group ping in its slot; return when the next slot begins."""
        self.guess(start)
        if self.called:
            turns = self.call(slot, group, start)
        else:
            able = self.who_knows(slot, start) if self.told else group
            turns = [self.ping(i, start, slot) for i in able if self.works(i, start)]
        if self.replies and self.schedule != "super_tdma":  # whose later pings may yet overlap
            self.reply()
        if self.schedule == "polling":  # one by one
            for ping in turns:
                caller = ping.row["called_by"]
                if ping in self.pings and self.outcome(ping, caller) == "heard":
                    return self.after(ping.at[caller][1], self.reply_s)
        if self.schedule == "super_tdma":
            return self.rounds[-1]["started_at_s"] + self.ends[len(self.rounds) - 1][slot]
        return self.after(start, self.slot_s)

    def ping(self, sender: str, time: float, slot: int = 0, **more: object) -> Sound:
        """Let a vehicle ping, or note the turn in which it could not."""
        x, y, _ = self.where(sender, time)
        row = dict.fromkeys(("auv", "asv", "called_at_s", "called_by", "call", "waited_s"))
        row |= {sender[:3].lower(): sender, "round": max(0, len(self.rounds) - 1), "slot": slot}
        row |= {"sent_at_s": time, "x_m": x, "y_m": y} | more
        ping = Sound("hf", row, in_vain=None if row["call"] in (None, "heard") else row["call"])
        ping.whole = self.works(sender, time, time + self.ping_s)
        if time < self.end:
            self.pings.append(ping)
            if sender in self.minds:
                self.minds[sender].pinged = time
            to = self.auvs if self.passive else self.asvs
            self.spread(ping, sender, time, self.ping_s, to)
            if ping.in_vain is None and not self.passive:
                self.passing.append(ping)
                if self.deaf and not self.instant:
                    self.ears["mf", sender].append((time, time + self.ping_s, ping))
        return ping

    def call(self, slot: int, group: list[str], time: float) -> list[Sound]:
        """Call the AUVs of a group, each by the nearest ASV; return their answers."""
        callers = {}
        for i in group:
            far = {j: math.dist(self.launch[i], self.where(j, time)) for j in self.working(time)}
            callers.update({i: min(far, key=far.get)} if far else {})
        calls = {
            j: Sound("hf", {}, whole=self.works(j, time, time + self.ping_s))
            for j in sorted(set(callers.values()))
        }
        for j, call in calls.items():
            self.spread(call, j, time, self.ping_s, self.auvs + self.asvs)
        answers = []
        for i, j in callers.items():
            outcome, sent = self.outcome(calls[j], i, end=math.inf), time
            answer = calls[j].at[i][1] + self.turnaround
            if outcome == "heard" and answer >= self.end:
                outcome = "in_flight"
            elif outcome == "heard":
                sent = answer
            answers.append(self.ping(i, sent, slot, called_at_s=time, called_by=j, call=outcome))
        return answers

    def decide(self, until: float) -> None:
        """Decide all pings that have passed by an instant; what was heard becomes fixes."""
        self.guess(until)
        for ping in sorted(self.passing, key=self.passed):
            if self.passed(ping) <= until:
                self.passing.remove(ping)
                by = [j for j in self.asvs if self.outcome(ping, j) == "heard"]
                if by and self.passed(ping) <= self.end:
                    self.waiting.append(self.fix(ping, ping.row["auv"], by))

    def passed(self, ping: Sound) -> float:
        """Return when a ping has passed all ASVs in range."""
        ends = [ping.at[j][1] for j in self.in_range(ping)]
        return max(ends, default=ping.row["sent_at_s"])

    def fix(self, ping: Sound, auv: str, asvs: list[str]) -> Row:
        """Make a fix of a ping: the fleet knows where its AUV was."""
        time = ping.row["sent_at_s"]
        exact = (*self.where(auv, time), 0.0)
        *place, variance = self.given.measured.get((auv, round(time, 6)), exact)
        row = {"auv": auv, "round": ping.row["round"], "asvs": " ".join(asvs), "pinged_at_s": time}
        row |= dict.fromkeys(("broadcast_at_s", "broadcast_by", "delivered_at_s"))
        row |= {"outcome": "in_flight", "place": place, "variance": variance, "ping": ping}
        self.fixes.append(row)
        self.known_at[auv] = time
        self.known[auv] = (*place[:2], self.where(auv, 0.0)[2])
        return self.fixes[-1]

    # Downlink

    def payload(self, fixes: int, slots: int = 0) -> int:
        """Return how many bytes a frame of so many fixes and slots has."""
        size = self.knowledge_keys.get("assignment_bytes", 2)
        return self.mf["header_bytes"] + slots * size + fixes * self.mf["fix_bytes"]

    def airtime(self, fixes: int, slots: int = 0) -> float:
        """Return how long a frame of so many fixes and slots is on the air."""
        return 8 * self.payload(fixes, slots) * self.mf["overhead"] / self.mf["bit_rate_bps"]

    def capacity(self, slots: int = 0) -> int:
        """Return how many fixes a frame holds beside slots."""
        most = self.mf["payload_bytes"] or 10**9
        return max(0, most - self.payload(0, slots)) // self.mf["fix_bytes"]

    def frames_of(self, fixes: int, slots: int) -> list[int]:
        """Return how many fixes each frame of a broadcast holds, the first beside slots."""
        first, size = min(fixes, self.capacity(slots)), self.capacity()
        full, rest = divmod(fixes - first, size)
        return [first] + [size] * full + [rest] * (rest > 0)

    def broadcast(self, start: float) -> float:
        """Broadcast what waits, as of the last round; return when the downlink slot ends."""
        working = self.working(start)
        if start >= self.end:
            return start
        self.decide(start)
        row = self.rounds[-1]
        row["downlink_s"] = row["downlink_s"] or 0.0
        if not working:
            return start
        shares, end = self.senders(start, working), start
        names = self.announce(start, [j for own in shares for j in own]) if self.told else {}
        for own in shares:
            ends = [self.send(row["round"], j, end, own[j], names.get(j, ())) for j in own]
            end = self.after(max(ends), self.down_guard)
        end = max(end, self.after(start, self.down_shortest))
        row["downlink_s"] += end - start
        if self.told:
            number = row["round"] + self.ahead
            slots_end = self.slots_end(number - 1, start) if self.ahead == 2 else 0.0
            self.starts[number] = max(end, self.opens(number), slots_end)
        return end

    def senders(self, start: float, working: list[str]) -> list[dict[str, list[Row]]]:
        """Return who sends what: fixes of each ASV, of those that broadcast at once."""
        at = {j: self.where(j, start) for j in working}
        fixes, self.waiting = self.waiting, []
        self.broadcasts += 1
        if self.broadcaster != "parallel":
            if self.mf["overfull"] == "oldest_first":
                fixes, self.waiting = fixes[: self.capacity()], fixes[self.capacity() :]
            return [{self.chosen(at, fixes): fixes}]
        shares: dict[str, list[Row]] = {}
        for fix in fixes:
            nearest = min(working, key=lambda j: horizontal(fix["place"], at[j]))
            shares.setdefault(nearest, []).append(fix)
        order = sorted(shares, key=lambda j: (-len(shares[j]), working.index(j)))
        order = order or [self.chosen(at, [])]
        places = self.believed(start)
        hear = {
            j: {i for i in self.auvs if horizontal(places[i], at[j]) <= self.mf["range_m"]}
            for j in order
        }
        return [{j: shares.get(j, []) for j in group} for group in coloured(rivals_of(hear))]

    def chosen(self, at: dict[str, Place], fixes: list[Row]) -> str:
        """Return which of the ASVs that work broadcasts fixes; without any, which has its turn."""
        if self.broadcaster == "random":
            return self.given.broadcasters[len(self.frames)]
        if self.broadcaster == "fixed":
            first = self.broadcaster_keys["asv"]
            return min(at, key=lambda j: (self.asvs.index(j) - first) % len(self.asvs))
        if self.broadcaster == "most_fixes" and fixes:
            return max(at, key=lambda j: sum(j in f["asvs"].split() for f in fixes))
        if self.broadcaster == "nearest" and fixes:
            return min(at, key=lambda j: sum(horizontal(f["place"], at[j]) for f in fixes))
        return list(at)[(self.broadcasts - 1) % len(at)]

    def send(
        self, number: int, asv: str, start: float, fixes: list[Row], names: Sequence[str] = ()
    ) -> float:
        """Send slots and fixes, in several frames if need be; return when that ends."""
        for part, count in enumerate(self.frames_of(len(fixes), len(names))):
            share, fixes = fixes[:count], fixes[count:]
            if start < self.end:
                frame = self.send_frame(number, asv, start, share, part, len(names))
                if self.told and part == 0:
                    self.tellers[number + self.ahead].append((frame, list(names)))
            start, names = start + self.airtime(len(share), len(names)), ()
        return start

    def send_frame(
        self, number: int, asv: str, start: float, fixes: list[Row], part: int, slots: int
    ) -> Sound:
        """Send a frame, until its ASV fails; the end of `fly` tells what becomes of it."""
        planned = 0.0 if self.instant else self.airtime(len(fixes), slots)
        fails = [
            max(0.0, at - start) for j, at, until in self.failures if j == asv and start < until
        ]
        airtime = min([planned, *fails])
        row = {"round": number, "asv": asv, "sent_at_s": start, "airtime_s": airtime, "part": part}
        row |= {"payload_bytes": 0 if self.instant else self.payload(len(fixes), slots)}
        row |= {"fixes": len(fixes)}
        frame = Sound("mf", row, whole=airtime == planned, fixes=fixes)
        self.frames.append(self.spread(frame, asv, start, airtime, self.auvs))
        self.rounds[number]["fixes"] += len(fixes)
        if airtime and (self.deaf or self.replies):
            self.ears["hf", asv].append((start, start + airtime, frame))
        for fix in fixes:
            fix |= {"broadcast_at_s": start, "broadcast_by": asv}
        return frame

    def decoded(self, frame: Sound, auv: str) -> float:
        """Return when an AUV has decoded a frame."""
        return self.after(frame.at[auv][1], self.mf["processing_s"] or 0.0)

    def deliver(self, fix: Row, frame: Sound) -> None:
        """Tell what becomes of a fix, as of its frame."""
        fix["outcome"] = self.outcome(frame, fix["auv"])
        at = self.decoded(frame, fix["auv"])
        if self.instant:  # however near the AUV is, not before the ping is decoded
            decoded = fix["ping"].at[frame.row["asv"]][1]
            at = self.after(max(frame.at[fix["auv"]][1], decoded), 0.0)
        if at >= self.end and fix["outcome"] != "out_of_range":
            fix["outcome"] = "in_flight"
        if fix["outcome"] == "heard":
            fix |= {"outcome": "delivered", "delivered_at_s": at}

    def reply(self) -> None:
        """Let the first ASV that decodes a ping reply, ping by ping as they are decoded."""
        decoded = [(p.at[j][1], n, j) for n, p in enumerate(self.passing) for j in p.reached]
        replied, early = set(), self.downlink_keys.get("reply_at") == "ping_front"
        for end, n, j in sorted(decoded):
            ping = self.passing[n]
            if n not in replied and self.outcome(ping, j) == "heard":
                replied.add(n)
                start = end - self.ping_s if early else end
                self.send(ping.row["round"], j, start, [self.fix(ping, ping.row["auv"], [j])])
        self.passing = []

    # Random access

    def ping_at_random(self) -> None:
        """Let the AUVs ping, each when it wants to, at the next slot, or after its backoff."""
        slot = self.after(0.0, self.slot_s)
        for auv, wanted, about in self.given.pings:
            if self.schedule == "csma":
                sent = self.hold_back(auv, wanted, about)
                self.ping(auv, sent, waited_s=sent - wanted)
                self.spread(Sound("hf", {}), auv, sent, self.ping_s, self.auvs)
            else:
                self.ping(auv, round(about / slot) * slot if self.schedule != "aloha" else wanted)

    def hold_back(self, auv: str, wanted: float, about: float) -> float:
        """Return when an AUV pings, which counts slots of quiet if it hears a ping at first."""
        heard = sorted((a, b) for a, b, _ in self.ears["hf", auv] if wanted < b)
        if not heard or heard[0][0] > wanted:
            return wanted
        slot = self.schedule_keys["slot_s"] or self.ping_s + self.longest_s
        gaps, until = [], wanted  # of quiet
        for a, b in [*heard, (math.inf, math.inf)]:
            if a > until + AN_INSTANT:
                gaps.append((until, a))
            until = max(b, until)
        quiet = sum(min(b, about) - min(a, about) for a, b in gaps)
        left = round(quiet / slot) * slot  # as many slots as it has drawn
        for a, b in gaps:
            if left + AN_INSTANT < b - a:
                return a + left
            left -= b - a
        return math.inf

    def broadcast_at_once(self) -> None:
        """Broadcast fixes as soon as MF is free; each broadcast ends a round."""
        start = 0.0
        while start < self.end:
            self.decide(start)
            self.begin_round(start)
            row, time = self.rounds[-1], start
            if self.replies:
                row["downlink_s"] = 0.0
                self.reply()
                break
            while not self.waiting and self.passing:
                time = min(map(self.passed, self.passing))
                self.decide(time)
            time = self.await_asv(self.after(0.0, time))
            if not self.waiting or time >= self.end:
                break
            row["uplink_s"] = time - start
            start = self.broadcast(time)
        for ping in self.pings:
            sent = ping.row["sent_at_s"] + AN_INSTANT
            ping.row["round"] = max(r["round"] for r in self.rounds if r["started_at_s"] < sent)
        for fix in self.fixes:
            fix["round"] = fix["ping"].row["round"]

    # Rounds

    def fly(self) -> None:
        """Fly the mission."""
        start = 0.0
        if self.random_access:
            self.ping_at_random()
            self.broadcast_at_once()
        while start < self.end and not self.random_access:
            start = self.one_round(start)
        self.decide(math.inf)
        for ping in self.pings if self.passive else ():
            for i in self.auvs:
                if self.outcome(ping, i) == "heard":
                    fix = self.fix(ping, i, [ping.row["asv"]])
                    fix |= {"outcome": "delivered", "delivered_at_s": ping.at[i][1]}
                    self.rounds[ping.row["round"]]["fixes"] += 1
        for frame in self.frames:
            for fix in frame.fixes:
                self.deliver(fix, frame)

    def one_round(self, start: float) -> float:
        """Play a round; return when the next begins."""
        self.decide(start)
        groups = self.begin_round(start)
        row, time = self.rounds[-1], start
        for slot, group in enumerate(groups):
            if time >= self.end:
                break
            time = self.ping_group(slot, group, time)
            if time < self.end - AN_INSTANT:
                row["uplink_s"] = time - start
            if self.downlink == "pipelined_group":
                time = max(time, self.free)
                self.free = self.broadcast(time)
        if self.replies:
            self.reply()
            row["downlink_s"] = 0.0 if time < self.end else None
        elif self.downlink == "pipelined_round":
            time = max(time, self.free)
            self.free = self.broadcast(time)
        elif self.downlink == "sequential" and not self.passive:
            time = self.broadcast(time)
        return self.await_asv(max(time, self.opens(len(self.rounds))))

    def await_asv(self, time: float) -> float:
        """Return when an ASV works."""
        while time < self.end and not self.working(time):
            back = min(
                self.after(0.0, until) for _, at, until in self.failures if at <= time < until
            )
            self.waited, time = self.waited + back - time, back
        return time


def rivals_of(listeners: dict[str, set[str]]) -> dict[str, set[str]]:
    """Return with whom each sender has a listener in common."""
    return {i: {k for k in listeners if k != i and listeners[i] & listeners[k]} for i in listeners}


def coloured(rivals: dict[str, set[str]], by_saturation: bool = False) -> list[list[str]]:
    """Colour a conflict graph greedily, in order or (DSATUR) by colours and rivals around."""
    colours: dict[str, int] = {}

    def around(i: str) -> set[int]:
        return {colours[k] for k in rivals[i] if k in colours}

    while len(colours) < len(rivals):
        free = [i for i in rivals if i not in colours]
        if by_saturation:
            free.sort(key=lambda i: (-len(around(i)), -len(rivals[i])))
        colours[free[0]] = min(set(range(len(rivals))) - around(free[0]))
    return [[i for i in rivals if colours[i] == k] for k in range(max(colours.values()) + 1)]

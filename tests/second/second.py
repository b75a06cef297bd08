"""A second implementation of the protocols, written from docs/model.md and docs/protocols.md alone.

Plain Python and NumPy: no numba, no SimPy, nothing of the package, whose source its author had not
read. What the simulator draws by lot or measures it is given (`given` in comparing.py).
"""

import math
from itertools import pairwise

import numpy as np
from contention import Contention
from medium import AN_INSTANT, Row, deepest, horizontal, within


class Second(Contention):
    """A mission, flown by `fly`; its events are in `rounds`, `pings`, `frames` and `fixes`."""

    def __init__(self, keys: dict, given: Row) -> None:
        """Take a scenario's keys, of which all that matter here are given, and what was drawn."""
        super().__init__(keys)
        self.given = given
        self.schedule, self.broadcaster = self.keys["schedule"], self.keys["broadcaster"]
        own = keys["navigation"]
        bias, walk = math.hypot(*own["velocity_bias_m_per_s"]), own["random_walk_m_per_sqrt_s"]
        self.drift = lambda age: (bias * age) ** 2 + 2 * walk**2 * age  # variance after some time
        self.random_access = self.schedule in ("aloha", "slotted_aloha", "csma")
        self.passive, self.downlink = self.keys["ranging"] == "passive", self.keys["downlink"]
        if self.random_access and not self.replies:  # all others mean the same
            self.downlink = "sequential"
        self.called = self.keys["ranging"] == "twtt" or self.schedule == "polling"
        self.plan_slots(keys)
        self.rounds, self.pings, self.frames, self.fixes = [], [], [], []
        self.passing, self.waiting = [], []  # pings on their way; fixes that wait for the downlink
        self.fixed = {i: (0.0, self.where(i, 0.0)) for i in self.auvs}  # when and where, at last
        self.free = self.waited = 0.0  # end of the last downlink slot; time without ASVs
        self.pinged, self.broadcasts = dict.fromkeys(self.tracks, -math.inf), 0

    def plan_slots(self, keys: dict) -> None:
        """Work out how long slots last."""
        self.believed_speed = keys["environment"]["assumed_sound_speed_m_per_s"] or self.speed
        crossing, longest = keys["survey"]["side_m"] / self.believed_speed, self.hf["range_m"]
        if self.hf["range_metric"] == "horizontal":
            longest = math.hypot(longest, deepest(keys))
        self.longest_s = longest / self.believed_speed

        def given(key: str, crossings: float) -> float:
            return crossings * crossing if self.keys[key] is None else self.keys[key]

        self.byte_s = 8 * self.mf["overhead"] / self.mf["bit_rate_bps"]
        self.down_guard = given("downlink_guard_s", 1.25)
        self.down_shortest = given("shortest_downlink_slot_s", 10.0)
        self.turnaround = self.keys.get("turnaround_s", 0.0)
        slot = self.ping_s + self.longest_s + given("uplink_guard_s", 0.5)
        if self.called:
            slot += self.ping_s + self.turnaround + self.longest_s
        in_frames = self.replies and not self.instant
        self.reply_s = self.byte_s * self.payload(1) + self.down_guard if in_frames else 0.0
        shortest = given("shortest_uplink_slot_s", 2.5)
        self.slot_s = self.after(0.0, max(slot, shortest) + self.reply_s)
        self.plan_turns(keys)

    def payload(self, fixes: int, slots: int = 0) -> int:
        """Return how many bytes a frame of so many fixes and slots has."""
        size = self.keys.get("assignment_bytes", 0)
        return self.mf["header_bytes"] + slots * size + fixes * self.mf["fix_bytes"]

    def frames_of(self, fixes: int, slots: int = 0) -> list[tuple[int, int]]:
        """Return how many fixes and slots each frame of a broadcast holds."""
        frames, most = [], self.mf["payload_bytes"] or 10**9
        while fixes or not frames:
            room = max(0, most - self.payload(0, slots)) // self.mf["fix_bytes"]
            frames.append((min(fixes, room), slots))
            fixes, slots = fixes - frames[-1][0], 0
        return frames

    def downlink_slot(self, fixes: int, slots: int) -> float:
        """Return how long a downlink slot of so many fixes and slots is."""
        airtimes = [self.byte_s * self.payload(*frame) for frame in self.frames_of(fixes, slots)]
        behind = self.turns(airtimes, [1] * fixes).all_s
        return max(sum(airtimes) + behind + self.down_guard, self.down_shortest)

    def opens(self, number: int) -> float:
        """Return when a round begins at the earliest: with its frame."""
        framed = self.schedule in ("round_robin", "random")
        return self.after(0.0, number * self.keys["frame_s"]) + self.waited if framed else 0.0

    def believed(self, auv: str, time: float) -> np.ndarray:
        """Return where the fleet believes an AUV: by its last fix and the way planned since."""
        at, place = self.fixed[auv]
        if self.keys["positions"] == "truth" and not self.told:
            return self.where(auv, time)
        if self.keys["positions"] == "last_fix":
            return place
        off = place - self.where(auv, at)
        if len(self.tracks[auv]) == 2:  # a leg: the fix only says how far along it the AUV is
            way = np.diff(self.tracks[auv][:, 1:], axis=0)[0]
            off = off @ way / (way @ way) * way
        x, y, _ = self.where(auv, time) + off
        return np.array([x, y, place[2]])

    def plan(self, number: int, time: float, ahead: float = 0.0) -> Row:
        """Plan a round by what is known; it begins at most so much later (s)."""
        longest = self.keys.get("forget_after_s") or math.inf
        self.lost = {i for i, (heard, _) in self.fixed.items() if time - heard > longest}
        self.launch = {i: self.believed(i, time) for i in self.auvs}
        hearers = self.hearers(time)
        groups = self.groups(number, time, ahead, hearers)
        if self.told:
            groups = self.without(groups, number)
        conflicts = 0 if self.passive else sum(map(len, rivals_of(hearers).values())) // 2
        plan = Row(round=number, groups=groups, colours=len(groups), conflicts=conflicts)
        plan.said, plan.hearers = time, hearers
        return plan

    def hearers(self, time: float, later: float | None = None) -> dict[str, set[str]]:
        """Return which ASVs hear each AUV, or may hear it until so much later; lost ones none."""
        hearers = {}
        for i, place in self.launch.items():
            steps = np.diff(self.tracks[i], axis=0)
            fastest = max(np.hypot(steps[:, 1], steps[:, 2]) / steps[:, 0], default=0.0)
            margin = self.keys["conflict_margin_m"]
            extra = max(margin, (later or 0.0) * fastest)
            asvs = [] if i in self.lost else self.working(time)
            hearers[i] = {j for j in asvs if within(self.hf, place, self.station[j], extra)}
            if later is None:  # who may come around land may be heard
                hidden = {j for j in hearers[i] if self.behind(place, self.station[j], margin)}
                hearers[i] -= hidden
        return hearers

    def groups(self, number: int, time: float, ahead: float, hearers: dict) -> list[list[str]]:
        """Return the ping groups of a round, by which ASVs hear each AUV."""
        turn = self.auvs[number % len(self.auvs)]
        alone = {"one_per_slot": self.auvs, "polling": self.auvs, "round_robin": [turn]}
        alone["random"] = self.given.turns[number : number + 1]
        if self.passive:
            alone[self.schedule] = self.working(time)
        if self.random_access or self.schedule in alone:
            return [[i] for i in alone.get(self.schedule, [])]
        if self.schedule == "super_tdma":
            return self.packed(time, hearers)
        if self.schedule == "worst_first":
            order = sorted(self.auvs, key=lambda i: -self.claim(i, time))
            return grouped(order, rivals_of(self.hearers(time, ahead)), self.keys["slots"])
        return grouped(self.auvs, rivals_of(hearers), dsatur=self.schedule == "dsatur")

    def claim(self, auv: str, time: float) -> float:
        """Return the error that is expected of an AUV, less after turns in vain."""
        variance, at = 0.0, 0.0
        frames = [frame for frame in self.frames if frame.sent_at_s <= time]
        fixes = dict.fromkeys(fix for frame in frames for fix in frame.holds if fix.auv == auv)
        for fix in sorted(fixes, key=lambda fix: fix.pinged_at_s):
            age, at = fix.pinged_at_s - at, fix.pinged_at_s
            variance += self.drift(age)
            variance = variance and variance * fix.variance / (variance + fix.variance)
        last = max((fix.ping.round for fix in fixes), default=-1)
        later = [plan for plan in self.plans.values() if plan.round > last and plan.hearers[auv]]
        in_vain = sum(auv in group for plan in later for group in plan.groups)
        return math.sqrt(variance + self.drift(time - at)) / (in_vain + 2)

    def packed(self, start: float, hearers: dict) -> list[list[str]]:
        """Plan pings so that they arrive apart, the farthest first; return who pings together."""
        gap, ways = self.ping_s + self.keys["clear_s"] + self.reply_s, {}
        for i in self.auvs:
            exact = {j: math.dist(self.launch[i], self.station[j]) for j in hearers[i]}
            ways[i] = {j: min(exact[j] / self.believed_speed, self.longest_s) for j in exact}
        arrivals, sends, last = [], {}, 0.0
        for i in sorted(self.auvs, key=lambda i: -max(ways[i].values(), default=0.0)):
            taken = [at - ways[i][j] for j, at in arrivals if j in ways[i]]
            tries = [0.0, *(self.after(start, at + gap) - start for at in taken)]
            apart = gap - AN_INSTANT
            sends[i] = min(t for t in tries if t >= 0 and all(abs(t - at) > apart for at in taken))
            arrivals += [(j, sends[i] + way) for j, way in ways[i].items()]
            last = max(last, sends[i] + max(ways[i].values(), default=self.longest_s))
        times = sorted(set(sends.values()))
        self.ends = [start + time for time in times[1:]] + [self.after(start, last + gap)]
        return [[i for i in self.auvs if sends[i] == time] for time in times]

    def ping_group(self, slot: int, group: list[str], start: float) -> float:
        """Let a group ping in its slot; return when the next slot begins."""
        self.guess(start)
        if self.random_access:
            return self.end if self.replies else self.await_fixes(start)
        before = len(self.pings)
        if self.called:
            self.call(slot, group, start)
        else:
            for i in self.who_knows(slot, start) if self.told else group:
                self.ping(i, start, slot)
        if self.schedule == "super_tdma":
            return self.ends[slot]
        for ping in self.pings[before:] if self.schedule == "polling" else ():
            if self.outcome(ping, ping.called_by) == "heard":
                return self.after(ping.at[ping.called_by][1], self.reply_s)
        return self.after(start, self.slot_s)

    def ping(self, sender: str, time: float, slot: int = 0, **more: object) -> None:
        """Let a vehicle ping if it can, or note the turn in which nobody called it."""
        free = self.pinged[sender] + self.ping_s - AN_INSTANT
        if not free <= time < min(self.end, self.fails(sender, time)):
            return
        call, to = more.get("call", "heard"), self.auvs if self.passive else self.asvs
        more |= {sender[:3].lower(): sender, "in_vain": None if call == "heard" else call}
        ping = self.spread("hf", sender, time, self.ping_s, to, slot=slot, **more)
        ping.x_m, ping.y_m, _ = self.where(sender, time)
        ping.round = len(self.rounds) - 1
        ping.passed_at = max((ping.at[j][1] for j in ping.in_range), default=time)
        self.pings.append(ping)
        self.pinged[sender] = time
        if ping.in_vain is None and not self.passive:
            self.passing.append(ping)

    def call(self, slot: int, group: list[str], time: float) -> None:
        """Call the AUVs of a group, each by the nearest ASV, and let them answer."""
        working = self.working(time)
        callers = {i: self.nearest(self.launch[i], working) for i in group if working}
        to = self.auvs + self.asvs
        calls = {j: self.spread("hf", j, time, self.ping_s, to) for j in set(callers.values())}
        for i, j in callers.items():
            outcome = self.outcome(calls[j], i, end=math.inf)
            answer = calls[j].at[i][1] + self.turnaround
            if outcome == "heard" and answer >= self.end:
                outcome = "in_flight"
            sent = answer if outcome == "heard" else time
            self.ping(i, sent, slot, called_at_s=time, called_by=j, call=outcome)

    def decide(self, until: float) -> None:
        """Decide all pings that have passed by an instant; what was heard becomes fixes."""
        self.guess(until)
        self.run(until)
        for ping in sorted(self.passing, key=lambda ping: ping.passed_at):
            if ping.passed_at <= until:
                self.passing.remove(ping)
                by = [j for j in self.asvs if self.outcome(ping, j) == "heard"]
                if ping.passed_at <= self.end:
                    self.told_by_ping(ping, bool(by))
                if by and ping.passed_at <= self.end:
                    self.waiting.append(self.fix(ping, ping.auv, by))

    def fix(self, ping: Row, auv: str, asvs: list[str]) -> Row:
        """Make a fix of a ping: the fleet knows where its AUV was."""
        time = ping.sent_at_s
        exact = (*self.where(auv, time), 0.0)
        *place, variance = self.given.measured.get((auv, round(time, 6)), exact)
        fix = Row(auv=auv, ping=ping, place=place, variance=variance)
        fix.asvs, fix.pinged_at_s, fix.outcome = " ".join(asvs), time, "in_flight"
        fix.hops, fix.acknowledged_at_s, fix.repeats, fix.duplicates = None, None, 0, 0
        self.fixes.append(fix)
        self.fixed[auv] = time, np.array([*place[:2], self.where(auv, 0.0)[2]])
        return fix

    def broadcast(self, time: float) -> float:
        """Broadcast what waits as soon as MF is free; return when the next slots begin."""
        start = self.free = max(time, self.free)
        self.decide(start)
        row, working = self.rounds[-1], self.working(start)
        if start < self.end:
            row.downlink_s = row.downlink_s or 0.0
        if start >= self.end or not working:
            return start
        shares = self.senders(working, start)
        names = self.announce(start, [j for own in shares for j in own]) if self.told else {}
        for own in shares:
            ends = [self.send(j, self.free, own[j], names.get(j, ())) for j in own]
            self.free = self.after(max(ends), self.down_guard)
        self.free = max(self.free, self.after(start, self.down_shortest))
        row.downlink_s += self.free - start
        if self.told:
            plan = self.plans[row.round + self.ahead]
            plan.said = max(self.free, plan.said)
        return self.free if self.downlink == "sequential" else start

    def senders(self, working: list[str], start: float) -> list[dict[str, list[Row]]]:
        """Return who sends what: fixes of each ASV, of those that broadcast at once."""
        fixes, self.waiting = self.waiting, []
        self.broadcasts += 1
        left = None
        if self.mf["overfull"] == "oldest_first":
            room, _ = self.frames_of(10**6)[0]
            fixes, self.waiting = fixes[:room], fixes[room:]
            left = room - len(fixes)
        fixes = fixes + self.again(fixes, self.fixes, left)
        if self.broadcaster != "parallel":
            return [{self.chosen(working, fixes): fixes}]
        shares = {}
        for fix in fixes:
            shares.setdefault(self.nearest(fix.place, working), []).append(fix)
        order = sorted(shares, key=lambda j: (-len(shares[j]), j)) or [self.chosen(working, [])]
        at = {i: self.believed(i, start) for i in self.auvs}
        hear = {j: {i for i in at if within(self.mf, at[i], self.station[j])} for j in order}
        groups = grouped(order, rivals_of(hear))
        return [{j: shares.get(j, []) for j in group} for group in groups]

    def chosen(self, working: list[str], fixes: list[Row]) -> str:
        """Return which of the ASVs that work broadcasts fixes; without any, which has its turn."""
        if self.broadcaster == "random":
            return self.given.broadcasters[len(self.frames)]
        if self.broadcaster == "fixed":
            return min(working, key=lambda j: (j < f"ASV{self.keys['asv']}", j))
        if self.broadcaster == "most_fixes" and fixes:
            return max(working, key=lambda j: sum(j in f.asvs.split() for f in fixes))
        if self.broadcaster == "nearest" and fixes:
            at = self.station
            return min(working, key=lambda j: sum(horizontal(f.place, at[j]) for f in fixes))
        return working[(self.broadcasts - 1) % len(working)]

    def send(self, asv: str, start: float, fixes: list[Row], names: list | tuple = ()) -> float:
        """Send slots and fixes, in several frames if need be; return when that ends."""
        frames, carried = [], fixes
        for part, (count, slots) in enumerate(self.frames_of(len(fixes), len(names))):
            size = 0 if self.instant else self.payload(count, slots)
            airtime = self.byte_s * size
            if start < self.end:
                frame = self.spread("mf", asv, start, airtime, self.auvs, asv=asv, part=part)
                frame.round, frame.payload_bytes = len(self.rounds) - 1, size
                frame.fixes, frame.holds, frame.names = count, fixes[:count], names
                self.frames.append(frame)
                if self.exchanges:
                    self.ears["mf", asv].append((start, start + airtime, frame))
            else:
                frame = Row(sent_at_s=start)
            frame.meant_s = airtime
            frames.append(frame)
            start, fixes = start + airtime, fixes[count:]
        return start + (self.follow(frames, carried) if self.exchanges else 0.0)

    def decoded(self, frame: Row, auv: str) -> float:
        """Return when an AUV has decoded a frame."""
        return self.after(frame.at[auv][1], self.mf["processing_s"] or 0.0)

    def reply(self) -> None:
        """Let the first ASV that decodes a ping reply, ping by ping as they are decoded."""
        early = self.ping_s if self.keys.get("reply_at") == "ping_front" else 0.0
        decoded = [(ping.at[j][1], ping, j) for ping in self.passing for j in ping.in_range]
        for end, ping, j in sorted(decoded, key=lambda one: one[0]):
            if ping in self.passing and self.outcome(ping, j) == "heard":
                self.passing.remove(ping)
                self.send(j, end - early, [self.fix(ping, ping.auv, [j])])
        self.passing = []

    def ping_at_random(self) -> None:
        """Let the AUVs ping, each when it wants to, at the next slot, or after its backoff."""
        for auv, wanted, about in self.given.pings:
            if self.schedule == "csma":
                sent = self.hold_back(auv, wanted, about)
                self.ping(auv, sent, waited_s=sent - wanted)
                self.spread("hf", auv, sent, self.ping_s, self.auvs)  # who senses it
            else:
                slotted = round(about / self.slot_s) * self.slot_s
                self.ping(auv, wanted if self.schedule == "aloha" else slotted)

    def hold_back(self, auv: str, wanted: float, about: float) -> float:
        """Return when an AUV pings, which counts slots of quiet if it hears a ping at first."""
        heard = sorted((a, b) for a, b, _ in self.ears["hf", auv] if wanted < b)
        if not heard or heard[0][0] > wanted:
            return wanted
        slot = self.keys["slot_s"] or self.ping_s + self.longest_s
        edges = [*sorted(edge for ping in heard for edge in ping if edge > wanted), math.inf]
        quiet = [(a, b) for a, b in pairwise(edges) if not any(c <= a < d for c, d in heard)]
        # As many slots as it has drawn
        left = slot * round(sum(min(b, about) - min(a, about) for a, b in quiet) / slot)
        for a, b in quiet:
            if left + AN_INSTANT < b - a:
                break
            left -= b - a
        return a + left

    def await_fixes(self, time: float) -> float:
        """Return when there is something to broadcast and an ASV works, or the mission's end."""
        while not self.waiting and (self.passing or self.to_come):
            time = min([it.passed_at for it in self.passing] + [at for at, *_ in self.to_come])
            self.decide(time)
        time = self.await_asv(self.after(0.0, time))
        return time if self.waiting else self.end

    def fly(self) -> None:
        """Fly the mission."""
        start = 0.0
        if self.access:
            self.contend()
        elif self.random_access:
            self.ping_at_random()
        if self.told:
            self.agree()
        while start < self.end:
            start = self.one_round(start)
        self.decide(math.inf)
        self.settle()

    def settle(self) -> None:
        """Tell what becomes of all fixes, and of which round each ping is."""
        for ping in self.pings:
            sent = ping.sent_at_s + AN_INSTANT
            ping.round = max(row.round for row in self.rounds if row.started_at_s < sent)
            for i in self.auvs if self.passive else ():
                if self.outcome(ping, i) == "heard":
                    fix = self.fix(ping, i, [ping.asv])
                    fix.outcome, fix.delivered_at_s = "delivered", ping.at[i][1]
                    self.rounds[ping.round].fixes += 1
        for frame in self.frames:
            self.rounds[frame.round].fixes += frame.fixes
            for fix in frame.holds:
                if "broadcast_at_s" in vars(fix):
                    fix.repeats += 1
                    continue
                fix.broadcast_at_s, fix.broadcast_by = frame.sent_at_s, frame.asv
                fix.outcome, at = self.outcome(frame, fix.auv), self.decoded(frame, fix.auv)
                if self.instant:  # however near the AUV is, not before the ping is decoded
                    at = self.after(max(frame.at[fix.auv][1], fix.ping.at[frame.asv][1]), 0.0)
                if at >= self.end and fix.outcome not in ("out_of_range", "blocked"):
                    fix.outcome = "in_flight"
                if fix.outcome == "heard":
                    fix.outcome, fix.delivered_at_s = "delivered", at
                if self.exchanges:
                    self.settle_fix(fix, frame)

    def one_round(self, start: float) -> float:
        """Play a round; return when the next begins."""
        self.decide(start)
        number, time = len(self.rounds), start
        row = self.plans.get(number) or self.plan(number, start)
        row.started_at_s, row.fixes, row.downlink_s = start, 0, 0.0 if self.passive else None
        self.plans[number] = row
        self.rounds.append(row)
        for slot, group in enumerate(row.groups or [[]]):
            if time >= self.end:
                break
            time = self.ping_group(slot, group, time)
            if time < self.end:
                row.uplink_s = time - start
            if self.downlink == "pipelined_group":
                time = self.broadcast(time)
        if self.replies:
            self.reply()
            row.downlink_s = 0.0 if self.random_access or time < self.end else None
        elif self.downlink != "pipelined_group" and not self.passive:
            time = self.broadcast(time)
        if self.random_access:
            return time
        return self.await_asv(max(time, self.opens(len(self.rounds))))

    def await_asv(self, time: float) -> float:
        """Return when an ASV works."""
        while time < self.end and not self.working(time):
            back = min(until for _, at, until in self.failures if at <= time < until)
            gone, time = time, self.after(0.0, back)
            self.waited += time - gone
        return time


def rivals_of(listeners: dict[str, set[str]]) -> dict[str, set[str]]:
    """Return with whom each sender has a listener in common."""
    return {i: {k for k in listeners if k != i and listeners[i] & listeners[k]} for i in listeners}


def grouped(order: list, rivals: dict, most: int | None = None, dsatur: bool = False) -> list:
    """Let senders join, in order or as DSATUR does, the first of so many groups without rivals."""
    groups, left = [[] for _ in range(most or len(order))], list(order)
    while left:
        free = {i: [group for group in groups if not rivals[i] & set(group)] for i in left}
        i = min(left, key=lambda i: (len(free[i]), -len(rivals[i]))) if dsatur else left[0]
        left.remove(i)
        if free[i]:
            free[i][0].append(i)
    return [group for group in groups if group]

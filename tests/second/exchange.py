"""What AUVs send on MF, and what ASVs repeat, written from docs/protocols.md alone.

Sections "Acknowledged, repeated, relayed" and "Turns".
"""

import math
from collections import Counter
from collections.abc import Callable
from functools import partial

from dissemination import Dissemination
from medium import AN_INSTANT, Row, deepest


class Exchange(Dissemination):
    """Frames of AUVs, and fixes that are broadcast again."""

    def __init__(self, keys: dict) -> None:
        """Take a scenario's keys."""
        super().__init__(keys)
        self.acknowledge = self.keys.get("acknowledge", "none")
        self.repeat, relay = self.keys.get("repeat", "none"), self.keys.get("relay")
        self.hops = relay["hops"] if relay else 0
        who = relay["who"] if relay else []
        self.relays = self.auvs if who == "all" else [f"AUV{i}" for i in sorted(who)]
        self.exchanges = bool(relay) or (self.acknowledge, self.repeat) != ("none", "none")
        self.to_come: list[tuple[float, int, Callable]] = []
        self.auv_frames: list[Row] = []
        self.has: set[tuple[int, str]] = set()  # who has decoded which frame
        self.owed = {i: [] for i in self.auvs}  # what each AUV is to acknowledge, since when
        self.left: dict[Row, float] = {}  # how often fixes are to be sent again

    def plan_turns(self, keys: dict) -> None:
        """Work out the longest way of a frame."""
        longest = self.mf["range_m"]
        if self.mf["range_metric"] == "horizontal":
            longest = math.hypot(longest, deepest(keys))
        self.way_s, self.delay_s = longest / self.believed_speed, self.mf["processing_s"] or 0.0

    def turns(self, airtimes: list[float], counts: list[int]) -> Row:
        """Return the turns behind frames so long, in which AUVs have so many fixes each."""
        found, parts = Row(relay_s=max(airtimes) + (self.hops + 1) * self.way_s), len(airtimes)
        found.pause_s = self.way_s if parts > 1 else 0.0
        found.relays = self.hops * len(self.relays) * parts
        found.all_s = found.pause_s + found.relays * found.relay_s + self.hops * self.delay_s
        found.own_s, begins = [], 0.0
        for count in counts if self.acknowledge == "frame" else ():
            found.own_s.append(begins)
            begins += self.acknowledgement_s(count) + (self.hops + 2) * self.way_s
        if found.own_s:
            found.all_s += begins + 2 * self.delay_s
        if not counts or not (self.relays or self.acknowledge == "frame"):
            found.all_s = 0.0
        return found

    def acknowledgement_s(self, fixes: int) -> float:
        """Return how long a frame lasts that acknowledges so many fixes."""
        return self.byte_s * (self.mf["header_bytes"] + fixes * self.keys["acknowledgement_bytes"])

    def at(self, time: float, verb: Callable) -> None:
        """Have something happen at an instant."""
        self.to_come.append((time, len(self.to_come), verb))

    def run(self, until: float) -> None:
        """Let happen what is to come by an instant, in order."""
        while due := [one for one in self.to_come if one[0] <= until + AN_INSTANT]:
            first = min(due, key=lambda one: one[0])
            self.to_come.remove(first)
            if first[0] < self.end:
                first[2]()

    def follow(self, frames: list[Row], fixes: list[Row]) -> float:
        """Have AUVs hear the frames of a broadcast, and send behind it; return for how long."""
        counts = Counter(fix.auv for fix in fixes)
        airtimes = [frame.meant_s for frame in frames]
        turns = self.turns(airtimes, list(counts.values()))
        turns.auvs, turns.parts = list(counts), len(frames)
        tail = sum(airtimes)
        for frame in frames:
            tail -= frame.meant_s
            frame.turns, frame.tail_s = turns, tail
            if frame.sent_at_s < self.end and frame.holds:
                self.listen(frame, frame, 0, -1)
        return turns.all_s

    def listen(self, frame: Row, copy: Row, hops: int, turn: int) -> None:
        """Have AUVs that need a frame hear a copy of it, forwarded so often, in some turn."""
        for i in self.auvs:
            needs = i in self.relays or frame.names or i in [fix.auv for fix in frame.holds]
            if needs and (id(frame), i) not in self.has and i != copy.sender:
                self.at(copy.at[i][1], partial(self.take, frame, copy, i, hops, turn))

    def take(self, frame: Row, copy: Row, auv: str, hops: int, turn: int) -> None:
        """Let an AUV have a copy that has ended, if it is decoded and the first."""
        ended = copy.at[auv][1]
        if self.outcome(copy, auv, math.inf) != "heard":
            return
        time = ended + self.delay_s
        had = self.after(copy.sent_at_s, ended + self.delay_s - copy.sent_at_s)
        self.at(time, partial(self.have, frame, copy, auv, hops, turn, time, had))

    def have(
        self, frame: Row, copy: Row, auv: str, hops: int, turn: int, time: float, had: float
    ) -> None:
        """Let an AUV have a frame since an instant, and had on the clock; plan what it sends."""
        if (id(frame), auv) in self.has:
            return
        self.has.add((id(frame), auv))
        own = [fix for fix in frame.holds if fix.auv == auv]
        for fix in own:
            self.owed[auv].append((had, fix))
            if fix.hops is None:
                fix.hops, fix.had_at = hops, had
            else:
                fix.duplicates += 1
        turns = frame.turns
        begin = time + frame.tail_s + turns.pause_s
        if turn >= 0:
            begin = time - frame.meant_s - (turn * turns.parts + frame.part) * turns.relay_s
        if hops < self.hops and auv in self.relays:
            place = hops * len(self.relays) + self.relays.index(auv)
            later = (place * turns.parts + frame.part) * turns.relay_s
            self.at(
                begin + later, partial(self.forward, frame, auv, hops + 1, place, begin + later)
            )
        if own and turns.own_s:
            later = turns.relays * turns.relay_s + (self.hops - hops) * self.delay_s
            later += turns.own_s[turns.auvs.index(auv)]
            self.at(begin + later, partial(self.tell, auv, hops, begin + later))

    def sound(self, auv: str, time: float, lasts: float, **more: object) -> Row:
        """Let an AUV send a frame; it hears none meanwhile."""
        others = [i for i in self.auvs + self.asvs if i != auv]
        sent = self.spread("mf", auv, time, lasts, others, auv=auv, **more)
        self.ears["mf", auv].append((time, time + lasts, sent))
        self.auv_frames.append(sent)
        return sent

    def forward(self, frame: Row, auv: str, hops: int, place: int, time: float) -> None:
        """Let an AUV forward a frame."""
        copy = self.sound(auv, time, frame.meant_s, kind="relay", hops=hops, fixes=frame.fixes)
        self.listen(frame, copy, hops, place)

    def tell(self, auv: str, hops: int, time: float) -> None:
        """Let an AUV acknowledge what it owes."""
        fixes, self.owed[auv] = {id(fix): fix for _, fix in self.owed[auv]}, []
        if fixes:
            lasts, kind = self.acknowledgement_s(len(fixes)), "acknowledgement"
            sent = self.sound(auv, time, lasts, kind=kind, hops=hops, fixes=len(fixes))
            for j in self.asvs:
                self.at(sent.at[j][1], partial(self.told_of, sent, j, list(fixes.values())))

    def told_of(self, sent: Row, asv: str, fixes: list[Row]) -> None:
        """Let the fleet know of fixes once an ASV has decoded their acknowledgement."""
        if self.outcome(sent, asv, math.inf) == "heard":
            time = sent.at[asv][1] + self.delay_s
            self.at(time, partial(self.know, fixes, time))

    def know(self, fixes: list[Row], time: float) -> None:
        """Let the fleet know that AUVs have fixes."""
        for fix in fixes:
            if fix.acknowledged_at_s is None:
                fix.acknowledged_at_s = time

    def told_by_ping(self, ping: Row, is_heard: bool) -> None:
        """Let the fleet know of what an AUV has had since its ping before, if one is heard."""
        if self.acknowledge == "ping":
            told = [fix for had, fix in self.owed[ping.auv] if had <= ping.sent_at_s]
            self.owed[ping.auv] = [one for one in self.owed[ping.auv] if one[0] > ping.sent_at_s]
            self.know(told if is_heard else [], ping.passed_at)

    def again(self, fixes: list[Row], made: list[Row], room: int | None) -> list[Row]:
        """Return what is broadcast behind new fixes once more: the newest of their AUVs."""
        if self.repeat == "none":
            return []
        newest = {fix.auv: fix for fix in sorted(made, key=lambda fix: fix.pinged_at_s)}
        due = [
            fix
            for fix, left in self.left.items()
            if left > 0 and newest[fix.auv] is fix and fix.acknowledged_at_s is None
        ][:room]
        for fix in due:
            self.left[fix] -= 1
        most = math.inf if self.repeat == "until_acknowledged" else self.repeat
        self.left |= dict.fromkeys(fixes, most)
        return due

    def settle_fix(self, fix: Row, first: Row) -> None:
        """Tell what becomes of a fix: it comes by any copy, or not for the reason of the first."""
        fix.delivered_at_s, fix.outcome = None, self.outcome(first, fix.auv)
        if fix.outcome == "heard":
            fix.outcome = "in_flight"
        if fix.hops is not None and fix.had_at < self.end:
            fix.outcome, fix.delivered_at_s = "delivered", fix.had_at
        else:
            fix.hops = None

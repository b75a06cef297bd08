"""Schedules that frames carry, written from docs/protocols.md ("What the fleet knows") alone.

Which AUVs know a round, who is lost, and when an AUV pings that does not know its slot.
"""

import math
from dataclasses import dataclass

from medium import AN_INSTANT, Medium, Sound, horizontal, named

Groups = list[list[str]]


@dataclass
class Known:
    """What an AUV knows: the last round it was told, its start, its turn and how long rounds last.

    `turn` is when in the round its slot begins (None: it has none); `ahead` counts rounds since.
    """

    round: int = -1
    start: float = 0.0
    period: float = 0.0
    turn: float | None = None
    slot: int = 0
    ahead: int = 1
    pinged: float = -math.inf


class Dissemination(Medium):
    """What AUVs know of the rounds that are planned for them."""

    def __init__(self, keys: dict) -> None:
        """Take a scenario's keys; nobody has been told anything."""
        super().__init__(keys)
        knowledge, self.knowledge_keys = named(self.keys.get("knowledge", "shared"))
        self.told = knowledge == "broadcast"
        self.missed = self.knowledge_keys.get("missed", "silent")
        self.ahead = 2 if self.keys["downlink"] == "pipelined_round" else 1
        self.plans: dict[int, tuple[Groups, int]] = {}
        self.starts: dict[int, float] = {}  # of rounds, as they were announced
        self.informed: dict[int, set[str]] = {}
        self.tellers: dict[int, list[tuple[Sound, list[str]]]] = {}  # frames and whom they name
        self.minds = {i: Known() for i in self.auvs}
        self.recalled = dict.fromkeys(self.auvs, -1)

    def agree(self) -> None:
        """Agree before the launch on the rounds of which no frame can tell."""
        start = 0.0
        for number in range(self.ahead):
            start = max(start, self.opens(number))
            self.plans[number] = self.plan(number, 0.0, start)
            self.starts[number], self.informed[number] = start, set(self.auvs)
            for i in self.auvs:
                self.learn(i, number, 0.0)
            start = self.slots_end(number, start)
        slots = sum(map(len, self.plans[self.ahead - 1][0]))
        uplink, downlink = start - self.starts[self.ahead - 1], self.downlink_slot(slots, slots)
        for it in self.minds.values():
            it.period = uplink + downlink if self.ahead == 1 else max(uplink, downlink)

    def announce(self, start: float, senders: list[str]) -> dict[str, list[str]]:
        """Plan the round that a broadcast tells of; return whom each of its senders names."""
        number, count = len(self.rounds) - 1 + self.ahead, len(self.auvs)
        lasts = len(senders) * self.downlink_slot(count, count)
        if self.ahead == 2:  # the round before it begins with the broadcast
            if number - 1 not in self.plans:
                self.plans[number - 1] = self.plan(number - 1, start)
            lasts = max(lasts, self.slots_end(number - 1, start) - start)
        lasts = max(lasts, self.opens(number) - start)
        self.plans[number] = self.plan(number, start, lasts)
        self.informed[number], self.tellers[number] = set(), []
        names: dict[str, list[str]] = {j: [] for j in senders}
        for i in (i for group in self.plans[number][0] for i in group):
            far = [horizontal(self.launch[i], self.where(j, start)) for j in senders]
            names[senders[far.index(min(far))]].append(i)
        return names

    def slots_end(self, number: int, start: float, count: int | None = None) -> float:
        """Return when the first slots of a planned round end, or all, if that begins then."""
        for _ in self.plans[number][0][:count]:
            start = self.after(start, self.slot_s)
        return start

    def lost(self, time: float) -> set[str]:
        """Return the AUVs that have not been heard for too long."""
        after = self.keys.get("forget_after_s", 60.0) if self.told else None
        heard = dict.fromkeys(self.auvs, 0.0)
        for fix in self.fixes:
            heard[fix["auv"]] = max(heard[fix["auv"]], fix["pinged_at_s"])
        return {i for i in self.auvs if after is not None and time - heard[i] > after}

    def without(self, lost: set[str], groups: Groups, number: int) -> Groups:
        """Return groups without AUVs that are lost, with a contention slot or one for recalling."""
        groups = [[i for i in group if i not in lost] for group in groups]
        groups = [group for group in groups if group] or [[]]
        if self.missed == "contention":
            groups.append([])
        elif lost and number % self.keys.get("recall_rounds", 5) == 0:
            auv = min((i for i in self.auvs if i in lost), key=self.recalled.get)
            self.recalled[auv] = number
            groups.append([auv])
        return groups

    def hear(self, time: float) -> None:
        """Let AUVs know the rounds of which they have decoded frames by an instant.

        An AUV needs the frame that names it; one that has no slot needs all of them.
        """
        for number in [n for n in self.tellers if n >= len(self.rounds) - 1]:
            for i in self.auvs:
                frames = self.tellers[number]
                needed = [f for f, names in frames if i in names] or [f for f, _ in frames]
                has = (self.outcome(f, i) == "heard" and self.decoded(f, i) <= time for f in needed)
                if needed and i not in self.informed[number] and all(has):
                    self.informed[number].add(i)
                    self.learn(i, number, time)

    def learn(self, auv: str, number: int, time: float) -> None:
        """Let an AUV know a round; by its start it knows how long rounds last."""
        it, groups = self.minds[auv], self.plans[number][0]
        if number <= it.round:
            return
        if it.round >= 0:
            it.period = (self.starts[number] - it.start) / (number - it.round)
        it.round, it.start, it.ahead = number, self.starts[number], 1
        own = [slot for slot, group in enumerate(groups) if auv in group]
        own = [len(groups) - 1] if self.missed == "contention" else own
        it.turn = self.slots_end(number, it.start, own[0]) - it.start if own else None
        it.slot = own[0] if own else 0
        while it.turn is not None and it.period and self.reckoned(it) < time:
            it.ahead += 1

    def reckoned(self, it: Known) -> float:
        """Return when an AUV reckons its next turn to be."""
        return self.after(it.start, it.ahead * it.period + it.turn)

    def guess(self, until: float) -> None:
        """Let AUVs that do not know their slot ping before an instant when they reckon it to be."""
        able = [] if not self.told or self.missed == "silent" else self.auvs
        while able:
            expect = [i for i in able if self.minds[i].turn is not None]
            turns = [(self.reckoned(self.minds[i]), i) for i in expect]
            time, auv = min(turns, default=(math.inf, ""))
            if time >= min(until, self.end) - AN_INSTANT:
                return
            it = self.minds[auv]
            known = it.round
            self.hear(time)
            if it.round == known:
                if self.dares(auv, time) and time - it.pinged >= self.ping_s:
                    self.ping(auv, time, it.slot)
                it.ahead += 1

    def dares(self, auv: str, time: float) -> bool:
        """Tell whether an AUV tries its luck, which the simulator draws."""
        if self.missed == "last_slot" or self.keys.get("contention_chance", 0.5) == 1.0:
            return True
        return any(i == auv and abs(at - time) < 1e-6 for i, _, at in self.given.pings)

    def who_knows(self, slot: int, start: float) -> list[str]:
        """Return the AUVs that ping in a slot of the round under way."""
        number = len(self.rounds) - 1
        groups = self.plans[number][0]
        if not self.told:
            return groups[slot]
        self.hear(start)
        informed = [i for i in self.auvs if i in self.informed[number]]
        if self.missed == "contention" and slot == len(groups) - 1:
            began = self.rounds[-1]["started_at_s"]
            late = [i for i in informed if self.minds[i].pinged < began]
            group = [i for i in late if self.dares(i, start)]
        else:
            group = [i for i in groups[slot] if i in informed]
        return [i for i in group if start - self.minds[i].pinged >= self.ping_s]

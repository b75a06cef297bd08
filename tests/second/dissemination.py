"""Schedules that frames carry, written from docs/protocols.md ("What the fleet knows") alone.

Which AUVs know a round, who is lost, and when an AUV pings that does not know its slot.
"""

import math

from medium import AN_INSTANT, Medium, Row


class Dissemination(Medium):
    """What AUVs know of the rounds that are planned for them."""

    def __init__(self, keys: dict) -> None:
        """Take a scenario's keys; nobody has been told anything."""
        super().__init__(keys)
        self.told, self.missed = "knowledge" in self.keys, self.keys.get("missed")
        self.ahead = 2 if self.keys["downlink"] == "pipelined_round" else 1
        self.plans: dict[int, Row] = {}  # of rounds: groups, and start as it was said
        self.known: dict[str, list[Row]] = {}  # the plans that each AUV knows
        self.later = dict.fromkeys(self.auvs, 1)  # in how many rounds an AUV reckons its turn
        self.recalled = dict.fromkeys(self.auvs, -1)

    def agree(self) -> None:
        """Agree before the launch on the rounds of which no frame can tell."""
        end = 0.0
        for number in range(self.ahead):
            start = max(end, self.opens(number))
            plan = self.plans[number] = self.plan(number, 0.0, start)
            plan.said, end = start, self.slots_end(start, len(plan.groups))
        slots = sum(map(len, plan.groups))
        both = end - start, self.downlink_slot(slots, slots)
        # As if the round before had begun as long before as rounds are planned to last
        period = sum(both) if self.ahead == 1 else max(both)
        before = Row(round=number - 1, said=start - period)
        self.known = {i: [*self.plans.values(), before, plan] for i in self.auvs}

    def announce(self, start: float, senders: list[str]) -> dict[str, list[str]]:
        """Plan the round that a broadcast tells of; return whom each of its senders names."""
        number, count = len(self.rounds) - 1 + self.ahead, len(self.auvs)
        opens, lasts = self.opens(number), len(senders) * self.downlink_slot(count, count)
        if self.ahead == 2:  # the round before it begins with the broadcast
            if number - 1 not in self.plans:
                self.plans[number - 1] = self.plan(number - 1, start)
            opens = max(opens, self.slots_end(start, len(self.plans[number - 1].groups)))
        plan = self.plans[number] = self.plan(number, start, max(lasts, opens - start))
        plan.said = opens  # or later: as the broadcast ends
        names = {j: [] for j in senders}
        for i in (i for group in plan.groups for i in group):
            names[self.nearest(self.launch[i], senders)].append(i)
        return names

    def slots_end(self, start: float, count: int) -> float:
        """Return when so many slots have passed, one by one as in a round."""
        for _ in range(count):
            start = self.after(start, self.slot_s)
        return start

    def without(self, groups: list[list[str]], number: int) -> list[list[str]]:
        """Return groups without AUVs that are lost, with a contention slot or one for recalling."""
        groups = [[i for i in group if i not in self.lost] for group in groups]
        groups = [group for group in groups if group] or [[]]
        if self.missed == "contention":
            groups.append([])
        elif self.lost and number % self.keys["recall_rounds"] == 0:
            auv = min(sorted(self.lost), key=self.recalled.get)
            self.recalled[auv] = number
            groups.append([auv])
        return groups

    def hear(self, time: float) -> None:
        """Let AUVs know the rounds of which they have decoded frames by an instant."""
        for plan in [p for p in self.plans.values() if p.round >= len(self.rounds) - 1]:
            told = [f for f in self.frames if f.part == 0 and f.round + self.ahead == plan.round]
            for i in [i for i in self.auvs if plan not in self.known[i]]:
                # The frame that names the AUV; without a slot all frames
                needed = [f for f in told if i in f.names] or told
                heard = [f for f in needed if self.outcome(f, i) == "heard"]
                if needed and needed == [f for f in heard if self.decoded(f, i) <= time]:
                    self.known[i].append(plan)
                    self.later[i] = 1
                    while self.reckoned(i)[0] < time:
                        self.later[i] += 1

    def reckoned(self, auv: str) -> tuple[float, int]:
        """Return when and in which slot an AUV reckons its next turn, by what it knows last."""
        *_, before, last = self.known[auv]
        slots = [slot for slot, group in enumerate(last.groups) if auv in group]
        if self.missed == "contention":
            slots = [len(last.groups) - 1]
        if not slots:
            return math.inf, 0
        period = (last.said - before.said) / (last.round - before.round)
        turn = self.slots_end(last.said, slots[0]) - last.said
        return self.after(last.said, self.later[auv] * period + turn), slots[0]

    def guess(self, until: float) -> None:
        """Let AUVs that do not know their slot ping before an instant when they reckon it to be."""
        while self.known and self.missed != "silent":
            time, slot, auv = min((*self.reckoned(i), i) for i in self.auvs)
            if time >= min(until, self.end) - AN_INSTANT:
                return
            self.hear(time)
            if self.reckoned(auv) == (time, slot):  # it has heard of no later round
                if self.dares(auv, time):
                    self.ping(auv, time, slot)
                self.later[auv] += 1

    def dares(self, auv: str, time: float) -> bool:
        """Tell whether an AUV tries its luck, which the simulator draws."""
        if self.missed == "last_slot" or self.keys["contention_chance"] == 1.0:
            return True
        return any(i == auv and abs(at - time) < 1e-6 for i, _, at in self.given.pings)

    def who_knows(self, slot: int, start: float) -> list[str]:
        """Return the AUVs that ping in a slot of the round under way."""
        self.hear(start)
        plan = self.rounds[-1]
        on_time = abs(plan.said - plan.started_at_s) <= AN_INSTANT  # else nobody was told this
        able = [i for i in self.auvs if on_time and plan in self.known[i]]
        if self.missed != "contention" or slot < len(plan.groups) - 1:
            return [i for i in able if i in plan.groups[slot]]
        return [i for i in able if self.pinged[i] < plan.started_at_s and self.dares(i, start)]

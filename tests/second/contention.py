"""ALOHA whose pings are acknowledged and repeated, written from docs/protocols.md alone.

Sections "Random access" and "Reservation": who acknowledges when, and who tries again.
"""

import math
from functools import partial

from exchange import Exchange
from medium import AN_INSTANT, Row


class Contention(Exchange):
    """AUVs that ping as they like, until an ASV says that it has heard them."""

    given: Row

    def __init__(self, keys: dict) -> None:
        """Take a scenario's keys; `signals` holds what is sent beside pings, `sensed` all on HF."""
        super().__init__(keys)
        self.access = keys["protocol"].get("access")
        self.signals: list[Row] = []
        self.sensed: list[Row] = []
        self.tries = dict.fromkeys(self.auvs, 0)  # pings of the packet that an AUV is about
        self.awaits = dict.fromkeys(self.auvs, False)
        self.due: dict[str, list] = {j: [] for j in self.asvs}  # when an ASV tells whom
        self.speaks_until = dict.fromkeys(self.asvs, 0.0)

    def contend(self) -> None:
        """Have AUVs want to ping at the instants of their packets."""
        self.answer_s = 8 * self.access["acknowledgement_bytes"] / self.hf["bit_rate_bps"]
        self.turn_s = self.answer_s + 2 * self.longest_s
        self.all_turns_s = len(self.asvs) * self.turn_s
        for auv, time in self.given.packets:
            self.at(time, partial(self.want, auv, time))

    def want(self, auv: str, time: float) -> None:
        """Let an AUV ping that has something to send, unless it is about something else."""
        if not self.tries[auv]:
            self.attempt(auv, time)

    def attempt(self, auv: str, time: float) -> None:
        """Let an AUV ping, and wait for an acknowledgement until all turns are over."""
        self.tries[auv] += 1
        self.ping(auv, time)
        ping = self.pings[-1]
        self.emit(auv, time, self.ping_s, self.auvs)
        for j, (_, ended) in ping.at.items():
            self.at(ended, partial(self.decode, ping, j, ended))
        self.at(time + self.ping_s, partial(self.await_answer, auv))
        self.at(time + self.ping_s + self.all_turns_s, partial(self.give_up, auv, time))

    def await_answer(self, auv: str) -> None:
        """Let an AUV listen, whose ping is over."""
        self.awaits[auv] = True

    def emit(self, sender: str, time: float, lasts: float, who: list[str]) -> Row:
        """Let a sound go out on HF, whose sender hears none meanwhile."""
        sound = self.spread("hf", sender, time, lasts, [i for i in who if i != sender])
        self.ears["hf", sender].append((time, time + lasts, sound))
        self.sensed.append(sound)
        return sound

    def decode(self, ping: Row, asv: str, ended: float) -> None:
        """Let an ASV that has decoded a ping acknowledge it in its turn."""
        if self.outcome(ping, asv) == "heard":
            turn = ended + self.asvs.index(asv) * self.turn_s
            self.due[asv].append((turn, ping.auv))
            self.at(turn, partial(self.acknowledge_due, asv, turn))

    def acknowledge_due(self, asv: str, time: float) -> None:
        """Let an ASV acknowledge the first ping whose turn has come, once it is silent."""
        due = [one for one in self.due[asv] if one[0] <= time + AN_INSTANT]
        if not due or time < self.speaks_until[asv] - AN_INSTANT:
            return
        turn, auv = due[0]
        self.due[asv].remove(due[0])
        if time - turn >= self.turn_s:
            self.acknowledge_due(asv, time)
            return
        sound = self.emit(asv, time, self.answer_s, self.auvs + self.asvs)
        sound.to, sound.kind, sound.lasts_s = auv, "acknowledgement", self.answer_s
        sound.size_bytes = self.access["acknowledgement_bytes"]
        self.signals.append(sound)
        self.speaks_until[asv] = time + self.answer_s
        self.at(time + self.answer_s, partial(self.acknowledge_due, asv, time + self.answer_s))
        for listener in (auv, *(j for j in self.asvs if j != asv)):
            self.at(sound.at[listener][1], partial(self.overhear, sound, listener))

    def overhear(self, sound: Row, listener: str) -> None:
        """Let an ASV leave it to another; let an AUV that waits for this be about nothing more."""
        if self.outcome(sound, listener) != "heard":
            return
        if listener in self.due:
            self.due[listener] = [one for one in self.due[listener] if one[1] != sound.to]
        elif self.awaits[listener]:
            self.awaits[listener], self.tries[listener] = False, 0

    def give_up(self, auv: str, since: float) -> None:
        """Let an AUV ping again whose last ping no ASV acknowledges, or be about nothing more."""
        if self.pinged[auv] != since or not self.awaits[auv]:
            return
        self.awaits[auv] = False
        if self.tries[auv] > self.access["repeat"]:
            self.tries[auv] = 0
            return
        most = 2 ** min(self.tries[auv], 10) * (self.ping_s + 2 * self.longest_s + self.all_turns_s)
        over = since + self.ping_s + self.all_turns_s
        # When it is drawn to be, if that can be
        drawn = [at for i, _, at in self.given.pings if i == auv and at > since + AN_INSTANT]
        again = min(max(min(drawn, default=math.inf), over), over + most)
        self.at(again, partial(self.attempt, auv, again))

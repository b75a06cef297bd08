"""Candidates of one cost, looked at together until one is the best that meets the goals."""

from collections.abc import Sequence

from .evidence import Evidence
from .selection import Verdict


class Group:
    """Candidates of one cost.  Who cannot be the best that meets the goals is flown no further."""

    def __init__(self, evidence: Evidence, members: Sequence[int]) -> None:
        self.members = members
        self._evidence = evidence
        self._next_look = 0
        self._outdone: set[int] = set()

    def having(self, verdict: Verdict | None) -> list[int]:
        """Return the candidates with a verdict, or without any."""
        return [it for it in self.members if self._evidence.verdicts[it] == verdict]

    @property
    def meets(self) -> bool:
        """Whether one is shown to meet the goals."""
        return bool(self.having("met"))

    @property
    def running(self) -> list[int]:
        """Return who may still be the best of those that meet the goals."""
        either = self.having("met") + self.having(None)
        return [it for it in either if it not in self._outdone]

    @property
    def leader(self) -> int:
        """Return the best of those that are shown to meet the goals."""
        met = [it for it in self.having("met") if it not in self._outdone]
        return min(met, key=self._evidence.mean)

    @property
    def is_flown(self) -> bool:
        """Whether no more seeds are allowed."""
        return self._next_look == len(self._evidence.looks)

    @property
    def next_seeds(self) -> int:
        """Return how many seeds the next look takes."""
        return self._evidence.looks[self._next_look].seeds

    def look(self) -> None:
        """Fly those that run at more seeds; see who meets the goals, who does not, who is outdone.

        Raises:
            CutOff: when not all of them were flown.
        """
        look, verdicts = self._next_look, self._evidence.verdicts
        self._evidence.fly(self.running, look)
        self._next_look += 1
        for it in self.having(None):
            self._evidence.judge(it, look)
        if not self.meets:
            return
        leader = self.leader
        for it in self.running:
            if it != leader and self._evidence.outdoes(leader, it, look):
                self._outdone.add(it)
                verdicts[it] = verdicts[it] or "outdone"

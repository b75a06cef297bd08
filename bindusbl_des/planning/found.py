"""What was found out for a plan, before it is told or written."""

from collections.abc import Sequence
from dataclasses import dataclass

from .binding import Relief
from .candidates import Candidate, LeftOut, Predictor, excess
from .doubting import Doubted
from .question import Question
from .selection.goals import Goal
from .selection.selection import Selection


@dataclass(frozen=True)
class Found:
    """All that was found out for a plan.

    `missions` is how many were flown, those of doubts included; `cut` is the option that cut the
    plan off, empty if none did.
    """

    question: Question
    candidates: Sequence[Candidate]
    selection: Selection
    predictor: Predictor
    left_out: Sequence[LeftOut]
    reliefs: Sequence[Relief]
    further: str
    doubted: Sequence[Doubted]
    missions: int
    cut: str

    @property
    def team(self) -> Candidate | None:
        """The least team that is shown to meet the goals."""
        answer = self.selection.answer
        return None if answer is None else self.candidates[answer]

    @property
    def ranked(self) -> list[int]:
        """The candidates that were flown by how good they are: met ones by cost, then the rest."""
        return ranked(self.question.goals, self.candidates, self.selection)


def ranked(
    goals: Sequence[Goal], candidates: Sequence[Candidate], selection: Selection
) -> list[int]:
    """Return the numbers of candidates that were flown: those that meet the goals by their cost and
    then by their means, and after them those that do not, the nearest first.
    """

    def far(number: int) -> tuple[float, float]:
        """By how much its goals are missed, and by how much where the ratio to one is infinite."""
        means = [it.mean for it in selection.estimates[number]]
        apart = [abs(it - goal.limit) for goal, it in zip(goals, means, strict=True)]
        return max(map(excess, goals, means)), max(apart)

    flown = [n for n, missions in enumerate(selection.missions) if missions]
    meets = {n: far(n)[0] < 0 for n in flown}
    return sorted(flown, key=lambda n: (not meets[n], meets[n] * candidates[n].cost, far(n)))

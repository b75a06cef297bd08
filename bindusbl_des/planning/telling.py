"""What a plan says: its answer, its doubts, and what would help."""

from collections.abc import Iterator, Mapping, Sequence
from textwrap import fill
from typing import Any

from ..core.wording import counted, significant
from .found import Found
from .wording import limits, said, team_told

WIDEST = 80


def reached(found: Found, number: int) -> str:
    """Return what a candidate's missions came to, a goal after the other."""
    estimates = found.selection.estimates[number]
    return ", ".join(
        f"{goal.metric} {said(goal, it.mean)} (95 % interval {significant(it.low)} to "
        f"{significant(it.high)})"
        for goal, it in zip(found.question.goals, estimates, strict=True)
    )


def answer_told(found: Found) -> str:
    """Return the answer in one sentence."""
    question, answer = found.question, found.selection.answer
    goals = limits(question.goals)
    flown = counted(found.missions, "mission")
    if answer is None:
        return f"No team that was flown is shown to keep {goals} ({flown})."
    team = found.candidates[answer]
    sure = f"{100 * question.confidence:g} % confidence"
    return f"{team_told(team)}: {reached(found, answer)}; {goals}, with {sure} ({flown})."


def _candidate_told(candidate: Mapping[str, Any]) -> str:
    """Return a team and what it came to."""
    return f"{candidate['team']}: {candidate['told']}"


def _doubt_told(doubted: Mapping[str, Any]) -> str:
    """Return what becomes of the goals in a condition."""
    met = {True: "still met", False: "not met", None: "too close to tell"}[doubted["met"]]
    means = ", ".join("-" if it is None else significant(it) for it in doubted["mean"])
    return f"{doubted['told']}: {means}, {met}"


def caveats(found: Found) -> Iterator[str]:
    """Yield what the answer lacks: what could not be told, and what the time was too short for."""
    _, _, doubts = found.selection.why.partition(". ")  # its first sentence is the answer
    if doubts and not found.selection.is_settled:
        yield doubts
    if found.cut:
        yield f"{found.cut}; the same command goes on from here."
    yield from _unvaried(found)


def _unvaried(found: Found) -> Iterator[str]:
    """Yield which goals' metrics never differed, and how rare what was not seen may be.

    What happens in a share p of missions is not seen in n of them with a probability (1 - p)^n.
    """
    answer, question = found.selection.answer, found.question
    if answer is None:
        return
    estimates, missions = found.selection.estimates[answer], found.selection.missions[answer]
    pairs = zip(question.goals, estimates, strict=True)
    same = [goal.metric for goal, it in pairs if it.low == it.high]
    if same:
        unseen = 100 * (1 - (1 - question.confidence) ** (1 / missions))
        yield (
            f"{' and '.join(same)} did not differ in {missions} missions of the answer, by which "
            f"nothing is told of what happens in fewer than {unseen:.0f} % of missions."
        )


def would_told(found: Found) -> str | None:
    """Return what would meet the goals, where no team does; None where one does."""
    if found.team is not None:
        return None
    if not found.ranked:
        return "No team was flown in that time; give it more with --budget-s."
    nearest = found.ranked[0]
    said_first = (
        f"The nearest is {team_told(found.candidates[nearest])}: {reached(found, nearest)}."
    )
    helping = [it.told for it in found.reliefs if it.meets]
    if helping:
        return f"{said_first} It is predicted to meet the goal with: {'; '.join(helping)}."
    rest = f" Most would help {found.reliefs[0].told}." if found.reliefs else ""
    return f"{said_first} {found.further}{rest}".replace("  ", " ").strip()


def summary(record: Mapping[str, Any], folder: str) -> str:
    """Return a plan as a planner reads it in the terminal, from what `plan.json` holds."""
    lines = [_filled(record["told"][0])]
    if record["would"]:
        lines.append(_filled(record["would"]))
    lines += _section(
        "runners-up", [_candidate_told(record["candidates"][n]) for n in record["runners_up"]]
    )
    lines += _section("what binds", [it["told"] for it in record["binding"]][:2])
    lines += _section("and if", [_doubt_told(it) for it in record["sensitivity"]])
    lines += map(_filled, record["told"][1:])
    lines += ["", f"Results: {folder}"]
    if record["answer"] is not None:
        lines.append(record["run"])
    return "\n".join(lines)


def _section(name: str, items: Sequence[str]) -> Iterator[str]:
    for number, item in enumerate(items):
        yield _filled(f"{name if number == 0 else '':<12}{item}", " " * 12)


def _filled(text: str, indent: str = "") -> str:
    return fill(
        text, WIDEST, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False
    )

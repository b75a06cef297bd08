"""Whether more ASVs than were tried would meet the goals, as predicted."""

from collections.abc import Sequence

from ...advice.stations import Ways
from ...core.wording import counted
from ...scenario.sections.vehicles import Formation
from ..questions.question import Question
from .candidates import COUNT, Candidate
from .foresight import Foresight
from .placing import placed, ring_keys

# Nobody is asked to send more.
MOST_ASVS = 12


def further(question: Question, tried: Sequence[Candidate], foresight: Foresight) -> str:
    """Return in a sentence how many more ASVs are predicted to be enough; empty if that is unknown.

    They are those of the nearest team, in the regular formation that covers best.
    """
    nearest = min(tried, key=foresight.rank)
    if not isinstance(nearest.scenario.asvs.formation, Formation):
        return ""
    if foresight.prediction(nearest) is None:
        return ""
    most = max(it.asvs for it in tried)
    for count in range(most + 1, MOST_ASVS + 1):
        radius, angle = Ways(nearest.scenario).best(count)
        ring = ring_keys(question, radius, angle)
        team = placed(question, {**nearest.keys, COUNT: count}, ring)
        if team is not None and foresight.rank(team) < 0:
            return (
                f"{counted(count, 'ASV')} on a ring of {radius:g} m, the first at {angle:g} deg, "
                "are predicted to meet the goal."
            )
    return f"Not even {MOST_ASVS} ASVs are predicted to meet the goal." if most < MOST_ASVS else ""

"""What the paper says in words, what theory says, and whether it holds here."""

from dataclasses import dataclass

# The verdicts on what is no sentence of the paper
HOLDS, FAILS = "holds", "fails"


@dataclass(frozen=True)
class Claimed:
    """One sentence, its verdict, the numbers it rests on, and why it is not borne out."""

    sentence: str
    verdict: str
    evidence: str
    why: str = ""

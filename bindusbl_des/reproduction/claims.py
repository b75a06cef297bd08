"""What the paper says in words, and whether it holds here."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Claimed:
    """One sentence of the paper, its verdict, the numbers it rests on, and why it differs."""

    sentence: str
    verdict: str
    evidence: str
    why: str = ""

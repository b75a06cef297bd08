"""Violations of a mission's schedule: how many of its signals were destroyed, and the first."""

import json
from dataclasses import asdict, dataclass
from typing import Annotated, Any, Literal

from pydantic import Field, TypeAdapter

from ...support.wording import counted

Number = Annotated[int, Field(ge=0)]


@dataclass(frozen=True)
class Violation:
    """A signal that others destroyed at its receiver, at an instant (s): a ping of a slot, a call
    for one, or a frame of fixes (no slot: None).

    `others` are the senders of the signals that overlapped it; empty where it was an echo, or they
    are not known.
    """

    kind: Literal["ping", "call", "frame"]
    at_s: float
    sender: str
    receiver: str
    round: Number
    slot: Number | None
    others: tuple[str, ...]

    @property
    def text(self) -> str:
        """The violation in words."""
        turn = f"round {self.round}" + ("" if self.slot is None else f", slot {self.slot}")
        met = f"met {' and '.join(self.others)}" if self.others else "was overlapped"
        return (
            f"at {self.at_s:.4f} s a {self.kind} of {self.sender} ({turn}) {met} at {self.receiver}"
        )


@dataclass(frozen=True)
class Violations:
    """The number of signals of a schedule that others destroyed, and the first of them, if any."""

    count: Number
    first: Violation | None

    @property
    def text(self) -> str:
        """The violations in a sentence; empty if there is none."""
        if self.first is None:
            return ""
        often = f"{counted(self.count, 'time')}, first" if self.count > 1 else "once,"
        return f"The schedule was violated {often} {self.first.text}."

    def data(self) -> dict[str, Any]:
        """Return them as plain data."""
        return {"count": self.count, "first": None if self.first is None else asdict(self.first)}


def violations_in(data: Any) -> Violations | None:
    """Return the violations in plain data; None where that is None: the mission had no schedule.

    Raises:
        ValueError: when the data are something else.
    """
    return TypeAdapter(Violations | None).validate_json(json.dumps(data), strict=True)


def is_violations(data: Any) -> bool:
    """Return whether plain data are violations as they are written."""
    try:
        violations_in(data)
    except ValueError:
        return False
    return True

"""What broke a schedule in a mission: how often signals of it overlapped, and where first."""

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

    `others` are who sent what overlapped it; empty where it was an echo, or is not known.
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
    """How many signals of a schedule others destroyed, and the first; None where none were."""

    count: Number
    first: Violation | None

    @property
    def text(self) -> str:
        """The violations in a sentence, empty where there are none."""
        if self.first is None:
            return ""
        often = f"{counted(self.count, 'time')}, first" if self.count > 1 else "once,"
        return f"The schedule was violated {often} {self.first.text}."

    def data(self) -> dict[str, Any]:
        """Return them as plain data."""
        return {"count": self.count, "first": None if self.first is None else asdict(self.first)}


def violations_in(data: Any) -> Violations | None:
    """Return the violations of plain data, None where it is None: the mission had no schedule.

    Raises:
        ValueError: when it is something else.
    """
    return TypeAdapter(Violations | None).validate_json(json.dumps(data), strict=True)


def is_violations(data: Any) -> bool:
    """Tell whether plain data is what violations are written as."""
    try:
        violations_in(data)
    except ValueError:
        return False
    return True

"""What broke a schedule in a mission: how often signals of it overlapped, and where first."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from ..core.wording import counted

KINDS = ("ping", "call", "frame")


@dataclass(frozen=True)
class Violation:
    """A signal that others destroyed at its receiver, at an instant (s): a ping of a slot, a call
    for one, or a frame of fixes (no slot: None).

    `others` are who sent what overlapped it; empty where it was an echo, or is not known.
    """

    kind: str
    at_s: float
    sender: str
    receiver: str
    round: int
    slot: int | None
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

    count: int
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
    """Return the violations of plain data, None where it is None: nobody kept to a schedule.

    Raises:
        ValueError: when it is something else.
    """
    if data is None:
        return None
    try:
        first = data["first"]
        found = None if first is None else Violation(**{**first, "others": tuple(first["others"])})
        return Violations(_count(data["count"]), found if found is None else _checked(found))
    except (TypeError, LookupError) as error:
        raise ValueError(str(error)) from None


def is_violations(data: Any) -> bool:
    """Tell whether plain data is what violations are written as."""
    try:
        violations_in(data)
    except ValueError:
        return False
    return data is None or isinstance(data, Mapping)


def _count(value: Any) -> int:
    if type(value) is not int or value < 0:
        raise ValueError(f"count is {value!r}")
    return value


def _checked(found: Violation) -> Violation:
    words = (found.sender, found.receiver, *found.others)
    numbers = [found.round] + ([] if found.slot is None else [found.slot])
    if (
        found.kind not in KINDS
        or not all(isinstance(word, str) for word in words)
        or not all(type(number) is int and number >= 0 for number in numbers)
        or type(found.at_s) not in (int, float)
    ):
        raise ValueError("the first violation is none")
    return found

"""What can be waited for in a mission, and who waits for it."""

from collections import deque
from collections.abc import Callable, Iterable, Mapping
from numbers import Real
from typing import Any, NamedTuple, get_args, get_type_hints

import simpy

from ..core.wording import did_you_mean
from ..records.events import OUTCOMES, Broadcast, Fix, Ping, Reception

# What can be waited for, what its row is, and which column says when it happens.
KINDS: dict[str, type] = {
    "ping": Ping,
    "arrival": Reception,
    "reception": Reception,
    "broadcast": Broadcast,
    "delivery": Fix,
}


class Happening(NamedTuple):
    """Something that has happened at an instant (s): its kind, and its row as it stands then.

    `ping`: an AUV begins to ping (:class:`.records.events.Ping`), with passive ranging an ASV.
    `arrival`: its front reaches an ASV in range (Reception), or an AUV.  `reception`: it has ended
    there, and was `heard`, `lost` or `collided` (Reception).  `broadcast`: an ASV begins a frame or
    an answer (Broadcast).  `delivery`: an AUV has a fix, and has made of it what it makes of it
    (Fix).

    A row has the columns of the table of its name; vehicles are numbers, and what there is not is
    None.
    """

    kind: str
    time: float
    row: Any


class Watch:
    """Happenings that somebody waits for: none is missed, each is had once, in order."""

    def __init__(
        self,
        env: simpy.Environment,
        kinds: Iterable[str],
        which: dict[str, Any],
        close: Callable[["Watch"], None],
    ) -> None:
        self.kinds, self._which, self._env, self._close = frozenset(kinds), which, env, close
        self._seen, self._waiting = deque[Happening](), deque[simpy.Event]()

    def next(self) -> simpy.Event:
        """Return the event of the next happening; its value is that :class:`Happening`."""
        event = self._env.event()
        if self._seen:
            event.succeed(self._seen.popleft())
        else:
            self._waiting.append(event)
        return event

    def tell(self, happening: Happening) -> None:
        """Take in a happening of one of the kinds, if it is one that is waited for."""
        if any(getattr(happening.row, name) != value for name, value in self._which.items()):
            return
        if self._waiting:
            self._waiting.popleft().succeed(happening)
        else:
            self._seen.append(happening)

    def close(self) -> None:
        """Wait for nothing any more."""
        self._close(self)


def refuse_unknown(
    kinds: Iterable[str], which: Mapping[str, Any], counts: Mapping[str, int]
) -> None:
    """Refuse kinds and columns that there are not, and values that a column never has.

    `counts` are how many AUVs and ASVs there are, by their columns.

    Raises:
        ValueError: naming what there is instead.
    """
    if not kinds:
        raise ValueError(f"nothing is waited for; wait for one or more of {', '.join(KINDS)}")
    for kind in kinds:
        if kind not in KINDS:
            raise ValueError(
                f"nothing of the kind {kind!r} happens{did_you_mean(kind, KINDS)}; wait for "
                f"one of {', '.join(KINDS)}"
            )
        columns = get_type_hints(KINDS[kind])
        for name, value in which.items():
            if name not in columns:
                raise ValueError(
                    f"a {kind} has no column {name!r}{did_you_mean(name, columns)}; it has "
                    f"{', '.join(columns)}"
                )
            _refuse_value(kind, name, value, columns[name], counts)


def _refuse_value(kind: str, name: str, value: Any, hint: Any, counts: Mapping[str, int]) -> None:
    """Refuse a value that is none of a column with a type hint."""
    types = get_args(hint) or (hint,)
    needed = "a number; vehicles are numbers, too"
    fits = isinstance(value, Real)
    if str in types:
        known = () if name == "asvs" else OUTCOMES
        needed = f"one of {', '.join(known)}" if known else "a text such as 'ASV0 ASV2'"
        fits = isinstance(value, str) and (not known or value in known)
    if not (fits or (value is None and type(None) in types)):
        raise ValueError(f"{name} of a {kind} is never {value!r}; it is {needed}")
    count = counts.get(name)
    if count is not None and value is not None and value not in range(count):
        raise ValueError(
            f"{name} of a {kind} is never {value!r}; there are {count}, of numbers from 0 on"
        )

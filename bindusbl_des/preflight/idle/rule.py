"""What a rule about keys without effect says."""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from ...core.plugins import is_plugin
from ...scenario.scenario import Scenario


class _Own(tuple[str, ...]):
    """The names of all parts of somebody's own."""

    def __contains__(self, name: object) -> bool:
        return isinstance(name, str) and is_plugin(name)


class _Given(tuple[str, ...]):
    """Whatever somebody may give at a key that is null if nobody does."""

    def __contains__(self, value: object) -> bool:
        return value is not None


OWN, GIVEN = _Own(), _Given()


class Idle(NamedTuple):
    """Keys without effect where other keys have one of these values, why, and what to do.

    `but` tells of a scenario whether they have one all the same.
    """

    mode: Mapping[str, tuple[Any, ...]]
    keys: tuple[str, ...]
    why: str
    effect: str = "has no effect"
    remedy: str = "remove it"
    but: Callable[[Scenario], bool] = lambda _: False

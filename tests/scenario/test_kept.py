"""Answers that follow from a scenario alone are worked out once while it is asked about."""

import pytest

from bindusbl_des import Scenario
from bindusbl_des.core.scenario.scenario import kept


def test_an_answer_is_kept_until_another_scenario_is_asked_about() -> None:
    """Be it an equal one; and the first is worked out anew when its turn comes again."""
    asked = []

    @kept
    def answer(scenario: Scenario) -> str:
        """Say its name."""
        asked.append(scenario)
        return scenario.name

    first, same, other = (Scenario(name=name) for name in ("one", "one", "two"))
    told = [answer(it) for it in (first, first, same, other, other, first)]
    assert told == ["one", "one", "one", "two", "two", "one"]
    assert [id(it) for it in asked] == [id(it) for it in (first, same, other, first)]
    assert answer.__doc__ == "Say its name."


def test_what_fails_is_not_kept() -> None:
    """Whoever asks again is told again."""

    @kept
    def answer(scenario: Scenario) -> int:
        raise ValueError(scenario.name)

    for _ in range(2):
        with pytest.raises(ValueError, match="one"):
            answer(Scenario(name="one"))

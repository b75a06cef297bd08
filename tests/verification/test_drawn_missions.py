"""What is accepted does not collide in missions that somebody has laid out against it."""

import json
import math
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from missions_against import Data, collisions, drawn_protocol, uncompiled

from bindusbl_des import Scenario, Verdict, verify

# Missions of the everyday test are short.
FIRST, DRAWN, MISSIONS, SHORT_S = 46, 16, 3, 4.0
SLOW_DRAWN, SLOW_MISSIONS = 1000, 20

# Of the scenarios that are never seen to collide, so many at least are accepted.
LEAST_ACCEPTED = 0.3


def scenarios(
    seeds: range, folder: Path, longest_s: float = math.inf
) -> Iterator[tuple[int, Data, Scenario]]:
    """Yield drawn scenarios whose keys do not contradict each other, with seeds and data."""
    for seed in seeds:
        data = drawn_protocol(seed, folder)
        data["duration_s"] = min(data["duration_s"], longest_s)
        try:
            yield seed, data, Scenario.model_validate(data)
        except ValueError:
            continue


def share_accepted(judged: Iterator[tuple[int, Verdict, int]]) -> tuple[int, int]:
    """Return how many scenarios were accepted, and how many never collided.

    Raises:
        AssertionError: when one that is accepted does, naming its seed.
    """
    accepted, quiet = 0, 0
    for seed, verdict, collided in judged:
        assert (verdict.witness is not None) == (verdict.verdict == "refused"), seed
        assert not (verdict.accepted and collided), seed
        accepted, quiet = accepted + verdict.accepted, quiet + (collided == 0)
    return accepted, quiet


def test_what_is_accepted_does_not_collide_in_missions_against_it(tmp_path: Path) -> None:
    """Every key drawn; AUVs at and about edges of ranges, held or on their way across them."""
    collided = uncompiled("verification.test_drawn_missions", tmp_path)
    accepted, quiet = share_accepted(
        (seed, verify(scenario), collided[str(seed)])
        for seed, _, scenario in scenarios(range(FIRST, FIRST + DRAWN), tmp_path, SHORT_S)
    )
    assert accepted >= 2
    assert accepted >= LEAST_ACCEPTED * quiet


def played(folder: Path) -> Iterator[tuple[int, Verdict, int]]:
    """Yield seeds, verdicts and collisions of many scenarios, those that are accepted in more."""
    for seed, data, scenario in scenarios(range(10_000, 10_000 + SLOW_DRAWN), folder):
        verdict = verify(scenario)
        missions = SLOW_MISSIONS if verdict.accepted else MISSIONS
        yield seed, verdict, collisions(scenario, data, seed, missions)


@pytest.mark.slow
def test_a_thousand_scenarios_that_are_accepted_do_not_collide(tmp_path: Path) -> None:
    """Each accepted one in twenty missions."""
    accepted, quiet = share_accepted(played(tmp_path))
    print(f"{accepted} accepted, {quiet} of {SLOW_DRAWN} never collided")
    assert accepted >= LEAST_ACCEPTED * quiet


if __name__ == "__main__":
    drawn = scenarios(range(FIRST, FIRST + DRAWN), Path(sys.argv[1]), SHORT_S)
    print(json.dumps({seed: collisions(it, data, seed, MISSIONS) for seed, data, it in drawn}))

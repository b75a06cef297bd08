"""What is accepted does not collide in missions that somebody has laid out against it."""

from pathlib import Path

import pytest
from missions_against import collisions, drawn_protocol

from bindusbl_des import Scenario, verify

DRAWN, MISSIONS = 24, 3
SLOW_DRAWN, SLOW_MISSIONS = 1000, 20

# Of the scenarios that are never seen to collide, so many at least are accepted.
LEAST_ACCEPTED = 0.3


def share_accepted(seeds: range, missions: int, folder: Path) -> tuple[int, int]:
    """Play drawn scenarios; return how many were accepted, and how many never collided.

    Raises:
        AssertionError: when one that is accepted does, naming its seed.
    """
    accepted, quiet = 0, 0
    for seed in seeds:
        data = drawn_protocol(seed, folder)
        try:
            scenario = Scenario.model_validate(data)
        except ValueError:  # keys that contradict each other
            continue
        verdict = verify(scenario)
        assert (verdict.witness is not None) == (verdict.verdict == "refused"), seed
        collided = collisions(scenario, data, seed, missions if verdict.accepted else MISSIONS)
        assert not (verdict.accepted and collided), seed
        accepted, quiet = accepted + verdict.accepted, quiet + (collided == 0)
    return accepted, quiet


def test_what_is_accepted_does_not_collide_in_missions_against_it(tmp_path: Path) -> None:
    """Every key drawn; AUVs at and about edges of ranges, held or on their way across them."""
    accepted, quiet = share_accepted(range(DRAWN), MISSIONS, tmp_path)
    assert accepted >= 5
    assert accepted >= LEAST_ACCEPTED * quiet


@pytest.mark.slow
def test_a_thousand_scenarios_that_are_accepted_do_not_collide(tmp_path: Path) -> None:
    """Each accepted one in twenty missions."""
    accepted, quiet = share_accepted(range(10_000, 10_000 + SLOW_DRAWN), SLOW_MISSIONS, tmp_path)
    print(f"{accepted} accepted, {quiet} of {SLOW_DRAWN} never collided")
    assert accepted >= LEAST_ACCEPTED * quiet

"""What the missions of a campaign came to: who is the worst, and how often."""

import numpy as np
import pyarrow as pa

from bindusbl_des.campaigns.statistics.outcomes import NONE, MissionOutcomes, auv_numbers


def test_names_are_numbers() -> None:
    """Across chunks, in any order; a mission that names nobody has NONE."""
    names = pa.chunked_array([["AUV2", None], ["AUV10", "AUV2"]], pa.string())
    assert auv_numbers(names).tolist() == [2, NONE, 10, 2]
    assert auv_numbers(pa.chunked_array([[None]], pa.string())).tolist() == [NONE]


def test_who_is_worst_most_often_comes_first() -> None:
    """Of equals the lower number; missions that failed, or name nobody, do not count."""
    worst = np.array([3, 1, 3, 0, 2, 1, NONE, 5])
    ok = np.array([True] * 4 + [False] + [True] * 3)
    point = np.array([0, 0, 0, 0, 0, 0, 0, 1])
    seeds = np.arange(len(worst))
    found = MissionOutcomes(seeds, point, seeds, ok, {}, worst={"worst_position_error_m": worst})
    who = found.who(0, "worst_position_error_m")
    assert list(who.items()) == [("AUV1", 2), ("AUV3", 2), ("AUV0", 1)]
    assert not found.who(2, "worst_position_error_m")
    assert not found.who(0, "nis")

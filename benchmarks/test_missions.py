"""The standard missions under pytest-benchmark: `pytest benchmarks`, never asserted on time.

Choose with -k, as in -k 3x1-kinematic; keep and compare runs with --benchmark-save and
--benchmark-compare.
"""

import re
from itertools import count
from typing import Any

import pytest

from bindusbl_des import simulate
from bindusbl_des.benchmarks.missions import standard_missions

# Large fleets take long: they are measured when asked for, by -k 1000x50 or -k 10000x200.
MISSIONS = standard_missions()


def identity(name: str) -> str:
    """Return a name that -k can choose: (3,1) kinematic is 3x1-kinematic."""
    return re.sub(r"\((\d+),(\d+)\) ", r"\1x\2-", name)


@pytest.mark.parametrize("name", MISSIONS, ids=identity)
def test_mission(benchmark: Any, name: str, request: pytest.FixtureRequest) -> None:
    """One mission, warm, with a seed of its own each time."""
    mission, seeds = MISSIONS[name], count()
    large, fleet = mission.auvs.count > 100, identity(name).split("-")[0]
    if large and fleet not in request.config.getoption("-k"):
        pytest.skip(f"takes long; ask for it with -k {fleet}")
    rounds, warm = (1, 0) if large else (5, 1)
    result = benchmark.pedantic(
        lambda: simulate(mission, next(seeds)), rounds=rounds, warmup_rounds=warm
    )
    benchmark.extra_info["pings"] = int(result.auvs["pings"].sum())
    assert len(result.auvs) == mission.auvs.count

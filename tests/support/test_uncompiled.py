"""Equations as Python runs them where numba is asked not to compile: slowly, and the same."""

import os
import pickle
import subprocess
import sys
from collections.abc import Iterator
from math import exp, floor, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from test_golden import BASE, MISSIONS
from worlds import merged, scenario

from bindusbl_des import Scenario, simulate
from bindusbl_des.support.uncompiled import as_compiled, uncompiled

TESTS = Path(__file__).parents[1]

# Hulls and autopilots, noise of the sea, a smoother, systematic errors
FURTHER: dict[str, Any] = {
    "duration_s": 5.0,
    "auvs": {"vehicle": "bluerov2", "speed_m_per_s": 0.5, "feedback": "estimate"},
    "acoustics": {"hf": {"channel": "sonar"}},
    "navigation": {"filter": "smoother"},
    "usbl": {"misalignment_sd_deg": 0.5},
}


def missions() -> Iterator[tuple[str, Scenario]]:
    """Yield the golden missions, and one of what they do not have."""
    for name, changes in MISSIONS.items():
        yield name, scenario(**merged(BASE, changes))
    base = {**BASE, "auvs": {"count": 2}, "navigation": {}}
    yield "further", scenario(**merged(base, FURTHER))


def fly() -> dict[str, dict[str, pd.DataFrame]]:
    """Return all tables of these missions."""
    return {
        name: {of: it.to_pandas() for of, it in simulate(world, 1).arrow.items()}
        for name, world in missions()
    }


def test_missions_that_are_not_compiled_have_the_same_tables(tmp_path: Path) -> None:
    """To roundings, in a process of their own, which says that it is slow."""
    file = tmp_path / "tables"
    paths = os.pathsep.join([str(TESTS), os.environ.get("PYTHONPATH", "")])
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1", "PYTHONPATH": paths}
    environment.pop("BINDUSBL_DES_CODE_CACHE_TOLD", None)
    ran = subprocess.run(
        [sys.executable, "-W", "error", __file__, str(file)],
        env=environment,
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert ran.returncode == 0, ran.stderr
    assert "NUMBA_DISABLE_JIT is set: missions take" in ran.stderr
    found = pickle.loads(file.read_bytes())
    for name, tables in fly().items():
        for of, table in tables.items():
            pd.testing.assert_frame_equal(found[name][of], table, rtol=1e-9, atol=1e-9)


def test_what_python_raises_machine_code_does_not() -> None:
    """Zero divides, roots of negative numbers are none, exponentials and floors run over."""

    @uncompiled
    def odd(zero: float) -> tuple[float, float, float, float, int]:
        total = 0.0
        return 1.0 / zero, total / zero, sqrt(zero - 1.0), exp(zero + 1e4), floor(zero - 1e300)

    infinite, undefined, root, large, least = odd(0.0)
    assert infinite == large == np.inf
    assert np.isnan([undefined, root]).all()
    assert least == np.iinfo(np.int64).min


def test_fields_of_records_are_attributes_whatever_their_names() -> None:
    """A field called `round` too; what is written there is written to the array."""
    rows = np.zeros(2, [("round", "i8"), ("place", "f8", (2,))])
    for one in (as_compiled(rows)[1], as_compiled(rows[1]), as_compiled((rows,))[0][1]):
        one.round += 1
        one.place[0] = 2.0
    assert rows.tolist()[1][0] == 3
    assert rows["place"].tolist() == [[0.0, 0.0], [2.0, 0.0]]


@pytest.mark.parametrize("value", [True, None, "text"])
def test_what_compiled_code_does_not_compute_with_stays(value: Any) -> None:
    assert as_compiled(value) is value


if __name__ == "__main__":
    Path(sys.argv[1]).write_bytes(pickle.dumps(fly()))

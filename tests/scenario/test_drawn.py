"""Whatever is inside the stated ranges runs in bounded time or is refused with numbers."""

import json
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[1] / "drawn_scenarios.py"


def ends(first: int, end: int, folder: Path) -> "dict[int, tuple[str, str]]":
    """Draw scenarios in a process of its own; return how each ended."""
    ran = subprocess.run(
        [sys.executable, "-W", "error", str(SCRIPT), str(first), str(end), str(folder)],
        capture_output=True,
        text=True,
    )
    found = {seed: (how, why) for seed, how, why in map(json.loads, ran.stdout.splitlines())}
    assert ran.returncode == 0, f"seed {first + len(found)} hangs or dies:\n{ran.stderr[-4000:]}"
    return found


def check(first: int, count: int, folder: Path) -> None:
    """Draw scenarios; none may break, hang or leave a number that is none, and a third must run."""
    found = ends(first, first + count, folder)
    broken = {seed: why for seed, (how, why) in found.items() if how == "broken"}
    assert not broken, json.dumps(broken, indent=1)
    counts = Counter(how for how, _ in found.values())
    assert counts["ok"] >= count / 4, counts  # else the draws would test the messages alone


def test_drawn_scenarios_run_or_are_refused(tmp_path: Path) -> None:
    """Ends of ranges, choices, nested routes and nulls: 14 scenarios drawn from the schema.

    Of those that run none needs equations that no other test has compiled.
    """
    check(60, 14, tmp_path)


@pytest.mark.slow
def test_five_thousand_drawn_scenarios_run_or_are_refused(tmp_path: Path) -> None:
    """The same for 5,000 others."""
    check(1_000, 5_000, tmp_path)

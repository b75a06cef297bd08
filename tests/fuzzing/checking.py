"""Checks that no input of a range ends as none may, in a process of its own."""

import json
import subprocess
import sys
from collections import Counter
from pathlib import Path

HOME = Path(__file__).parents[2]

# Fewer than this share of endings of either sort, and the inputs would test one sort alone.
LEAST = 0.04


def check(kind: str, first: int, count: int) -> None:
    """Go through inputs of a kind; each must end as documented, and some well."""
    command = [sys.executable, "-m", "tests.fuzzing", kind]
    ran = subprocess.run(
        [*command, str(first), str(first + count)], cwd=HOME, capture_output=True, text=True
    )
    found = [json.loads(line) for line in ran.stdout.splitlines()]
    replay = f"python -m tests.fuzzing {kind}"
    assert len(found) == count, f"`{replay} {first + len(found)}` dies:\n{ran.stderr[-4000:]}"
    assert ran.returncode == 0, ran.stderr[-4000:]
    wrong = [f"`{replay} {seed}`, {words}:\n{why}" for seed, _, its in found for words, why in its]
    assert not wrong, f"{len(wrong)} endings are not as documented:\n" + "\n".join(wrong[:20])
    codes = Counter(code for _, codes, _ in found for code in codes)
    assert min(codes[0], codes[2]) > LEAST * codes.total(), codes

"""Checks that no input of some ranges ends as none may, in a process of their own."""

import json
import subprocess
import sys
from collections import Counter
from pathlib import Path

HOME = Path(__file__).parents[2]

# Fewer than this share of endings of either sort, and the inputs would test one sort alone.
LEAST = 0.04


def check(first: int, **counts: int) -> None:
    """Go through as many inputs of each kind; each must end as documented, and some well."""
    ranges = [word for kind, count in counts.items() for word in (kind, first, first + count)]
    command = [sys.executable, "-m", "tests.fuzzing", *map(str, ranges)]
    ran = subprocess.run(command, cwd=HOME, capture_output=True, text=True)
    found = [json.loads(line) for line in ran.stdout.splitlines()]
    for kind, count in counts.items():
        own = [its for its in found if its[0] == kind]
        replay = f"python -m tests.fuzzing {kind}"
        assert len(own) == count, f"`{replay} {first + len(own)}` dies:\n{ran.stderr[-4000:]}"
        wrong = [
            f"`{replay} {seed}`, {words}:\n{why}" for _, seed, _, its in own for words, why in its
        ]
        assert not wrong, f"{len(wrong)} endings are not as documented:\n" + "\n".join(wrong[:20])
        codes = Counter(code for _, _, codes, _ in own for code in codes)
        assert min(codes[0], codes[2]) > LEAST * codes.total(), (kind, codes)
    assert ran.returncode == 0, ran.stderr[-4000:]

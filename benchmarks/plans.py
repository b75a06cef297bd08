"""How long plans take, as a user makes them: the questions of `experiments/plans` on two cores.

python benchmarks/plans.py            measure and print
python benchmarks/plans.py NAME       and keep it with the measurement NAME of history.json

A plan has as long as it takes, so that all its missions are flown however busy the machine is.
Another version is measured with `PYTHONPATH=ITS_CHECKOUT` before these words.
"""

import json
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from bindusbl_des.benchmark.command_lines import call
from bindusbl_des.benchmark.stopwatch import clocked

HERE = Path(__file__).resolve().parent
PLANS = HERE.parent / "experiments" / "plans"
NAMES = ("survey_60m", "survey_100m", "survey_140m", "rectangle")
WORKERS, LONG_S = 2, 36_000


def plans(told: Callable[[str], None] = lambda _: None) -> dict[str, Any]:
    """Return what each plan takes, by the clock and in processor time (s), after one that loads
    what is cached; how many missions it flew, and its answer.
    """
    found = {}
    with tempfile.TemporaryDirectory() as folder:
        made(NAMES[0], Path(folder, "first"))
        for name in NAMES:
            found[name] = made(name, Path(folder, name))
            told(line(name, found[name]))
    return found


def made(name: str, out: Path) -> dict[str, Any]:
    """Return what one plan takes."""
    words = ["plan", str(PLANS / f"{name}.yaml"), "--out", str(out), "--workers", str(WORKERS)]
    took = clocked(lambda: call([*words, "--budget-s", str(LONG_S), "-q"]))
    record = json.loads((out / "plan.json").read_text(encoding="utf-8"))
    return {
        "wall_s": took.wall,
        "processor_s": took.processor,
        "missions": record["missions"],
        "answer": record["answer"],
    }


def line(name: str, it: dict[str, Any]) -> str:
    """Return what one plan took in words."""
    took = f"{it['wall_s']:.1f} s by the clock, {it['processor_s']:.1f} s of processor time"
    return f"{name}: {took}, {it['missions']} missions; {it['answer']}"


def main(words: list[str]) -> None:
    """Measure, print, and keep it where a name is given."""
    found = plans(print)
    if words:
        from record import HISTORY, history, rounded

        everything = history()
        everything.setdefault(words[0], {})["plans"] = rounded(found)
        HISTORY.write_text(json.dumps(everything, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])

"""Whether plans keep their promises: the shipped ones and the manual's, made twice and flown anew.

python benchmarks/plans.py            measure and print
python benchmarks/plans.py NAME       and keep it with the measurement NAME of history.json

Each plan is made on an idle machine and again beside a competing load, and both have to be the
same.  Its answer is then flown with 100 seeds that no plan has flown, and so is each of its doubts;
the mean that is stated holds if theirs lies within its interval.  The exit code is 1 if a plan
differs, if two of five do not hold, or more than one in five of all doubts.
"""

import json
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from bindusbl_des import Scenario, load_scenario, simulate
from bindusbl_des.apps.campaigns.statistics.intervals import interval
from bindusbl_des.apps.planning.doubting import doubts
from bindusbl_des.apps.planning.folder import resumed
from bindusbl_des.apps.planning.goals import Goal, goals_in
from bindusbl_des.apps.planning.teams import team_of
from bindusbl_des.benchmarks.command_lines import call
from bindusbl_des.benchmarks.timing import clocked

ROOT = Path(__file__).resolve().parents[1]
PLANS = ROOT / "experiments" / "plans"
NAMES = ("survey_60m", "survey_100m", "survey_140m", "rectangle", "team_plan")
WORKERS, FRESH = 2, range(1_000_000, 1_000_100)
MOST_FAILED, LEAST_HOLD = 1, 0.8
BUSY = [sys.executable, "-c", "while True: pass"]


def plans(told: Callable[[str], None] = lambda _: None) -> dict[str, Any]:
    """Return what each plan takes, by the clock and in processor time (s), how many missions it
    flew, its answer, whether it is the same beside other work, and what fresh missions say.
    """
    found = {}
    with tempfile.TemporaryDirectory() as folder:
        for name in NAMES:
            idle, record = made(name, Path(folder, name, "idle"))
            loads = [subprocess.Popen(BUSY) for _ in range(WORKERS)]
            try:
                _, again = made(name, Path(folder, name, "busy"))
            finally:
                for load in loads:
                    load.kill()
                    load.wait()
            found[name] = {**idle, "same": content(record) == content(again), **fresh(record)}
            found[name]["doubts"] = doubted(record, Path(folder, name, "idle"))
            told(line(name, found[name]))
    return found


def made(name: str, out: Path) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return what one plan takes, and its record."""
    out.parent.mkdir(exist_ok=True)
    words = ["plan", str(file_of(name, out.parent)), "--out", str(out), "--workers", str(WORKERS)]
    took = clocked(lambda: call([*words, "-q"]))
    record = json.loads((out / "plan.json").read_text(encoding="utf-8"))
    keys = ("missions", "settled", "answer")
    times = {"wall_s": took.wall, "processor_s": took.processor}
    return {**times, **{key: record[key] for key in keys}}, record


def file_of(name: str, folder: Path) -> Path:
    """Return the file of a plan that ships, or that of the manual written out."""
    if name != "team_plan":
        return PLANS / f"{name}.yaml"
    text = (ROOT / "docs" / "planning.md").read_text(encoding="utf-8")
    block = text.partition("# team_plan.yaml\n")[2].partition("```")[0]
    path = folder / "team_plan.yaml"
    path.write_text(block.replace("scenarios/", f"{ROOT / 'scenarios'}/"), encoding="utf-8")
    return path


def content(record: dict[str, Any]) -> dict[str, Any]:
    """Return a record without the names of its folder."""
    return {key: it for key, it in record.items() if key not in ("run", "scenario")} | {
        "told": [it for it in record["told"] if "best.yaml" not in it]
    }


def fresh(record: dict[str, Any]) -> dict[str, Any]:
    """Return what the answer's first goal was said to be, and what it is with fresh seeds."""
    if record["chosen"] is None:
        return {"stated": None, "fresh": None, "holds": False}
    stated = record["candidates"][record["chosen"]]["simulated"]
    return beside(stated, goals_in(record["goal"])[0], scenario_of(record))


def beside(stated: dict[str, Any], goal: Goal, scenario: Scenario) -> dict[str, Any]:
    """Return a mean with its interval as it was stated, and as fresh missions have it."""
    low, high = stated["low"][0], stated["high"][0]
    missions = (simulate(scenario, seed).auvs[goal.metric].to_numpy() for seed in FRESH)
    own = interval([float(goal.of_fleets(values[None])[0]) for values in missions])
    return {
        "stated": [stated["mean"][0], low, high],
        "fresh": [own.mean, own.low, own.high],
        "holds": low <= own.mean <= high,
    }


def doubted(record: dict[str, Any], folder: Path) -> list[dict[str, Any]]:
    """Return what each doubt of a plan's answer was said to be, and what it is with fresh seeds."""
    if record["answer"] is None:
        return []
    team = team_of(resumed(folder), record["answer"])
    assert team is not None
    goal = goals_in(record["goal"])[0]
    worlds = {doubt.words: doubt.team.scenario for doubt in doubts(team)}
    return [{"told": row["told"], **beside(row, goal, worlds[row["told"]])}
            for row in record["sensitivity"]]  # fmt: skip


def scenario_of(record: dict[str, Any]) -> Scenario:
    """Return the scenario of a plan's answer."""
    best = Path(record["run"].split()[2].strip("'"))
    return load_scenario(best, overrides=["record.detail=summary"])


def line(name: str, it: dict[str, Any]) -> str:
    """Return what one plan took, and came to, in words."""
    took = f"{it['wall_s']:.1f} s by the clock, {it['processor_s']:.1f} s of processor time"
    spans = (
        "-" if it[key] is None else "{:.3f} [{:.3f}, {:.3f}]".format(*it[key])
        for key in ("stated", "fresh")
    )
    same, holds = ("yes" if it[key] else "NO" for key in ("same", "holds"))
    wrong = [doubt["told"] for doubt in it["doubts"] if not doubt["holds"]]
    return (
        f"{name}: {took}, {it['missions']} missions; {it['answer']}; stated, fresh: "
        f"{', '.join(spans)}; holds: {holds}; the same when busy: {same}; doubts that hold: "
        f"{len(it['doubts']) - len(wrong)} of {len(it['doubts'])}, not {wrong}"
    )


def main(words: list[str]) -> None:
    """Measure, print, and keep it where a name is given."""
    found = plans(print)
    if words:
        from record import HISTORY, history, rounded

        everything = history()
        everything.setdefault(words[0], {})["plans"] = rounded(found)
        HISTORY.write_text(json.dumps(everything, indent=1) + "\n", encoding="utf-8")
    failed = sum(not it["holds"] for it in found.values())
    rows = [doubt["holds"] for it in found.values() for doubt in it["doubts"]]
    too_few = sum(rows) < LEAST_HOLD * len(rows)
    sys.exit(failed > MOST_FAILED or too_few or not all(it["same"] for it in found.values()))


if __name__ == "__main__":
    main(sys.argv[1:])

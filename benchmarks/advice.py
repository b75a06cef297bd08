"""Whether the advice in reports keeps its promises: its effects measured again on fresh seeds.

python benchmarks/advice.py [--reports 4] [--seeds 200] [--missions N] [SCENARIO ...]

For each scenario some reports are made, of missions with different seeds.  Every effect stated in
them is measured again on the same fresh seeds, which none of them has used: it holds if their mean
lies within the interval stated.  Fixes that are said to do harm are counted likewise.
"""

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from bindusbl_des import Scenario, advise, load_scenario, simulate
from bindusbl_des.apps.advice.advising import Trial
from bindusbl_des.core.results.effects import Advice
from bindusbl_des.core.scenario.files.scenario_file import Source

SCENARIOS = Path(__file__).resolve().parents[1] / "scenarios"
ASKED = ("recovery_140m", "failure_140m", "remus_1km", "bluerov_lawnmower_60m", "harbour_current")

# Far from the seeds of any report.
FRESH = 1_000_000


class Fresh:
    """Missions of one scenario at fresh seeds, with and without changes, each flown once."""

    def __init__(self, scenario: Scenario, seeds: int) -> None:
        self._text, self._seeds = scenario.model_dump_json(), range(FRESH, FRESH + seeds)
        self._flown: dict[tuple[str, ...], list[Trial]] = {}

    def missions(self, settings: Sequence[str] = ()) -> list[Trial]:
        """Return the missions with these `--set` options."""
        key = tuple(settings)
        if key not in self._flown:
            plan = Source(self._text, overrides=("record.detail=summary", *settings)).read()[1]
            self._flown[key] = [_trial(plan, seed) for seed in self._seeds]
        return self._flown[key]

    def mean(self, settings: Sequence[str]) -> float:
        """Return the mean change (m) of the worst AUV's error."""
        pairs = zip(self.missions(settings), self.missions(), strict=True)
        return float(np.mean([one.error - two.error for one, two in pairs]))

    def harm(self, auv: int) -> float:
        """Return by how much (m) fixes raise an AUV's error."""
        return float(np.mean([it.own[auv, 0] - it.own[auv, 1] for it in self.missions()]))


def _trial(plan: Scenario, seed: int) -> Trial:
    result = simulate(plan, seed=seed)
    own = result.auvs[["position_error_m", "imu_error_m"]].to_numpy()
    return Trial(float(result.mission.worst_position_error_m[0]), own)


def checked(advice: Advice, fresh: Fresh) -> list[dict[str, object]]:
    """Return each statement of a report with what fresh seeds say to it."""
    rows: list[dict[str, object]] = []
    for effect in advice.effects:
        mean = fresh.mean(effect.settings)
        rows.append(
            {
                "said": f"{effect.verdict}: {effect.words}",
                "low": effect.low_m,
                "high": effect.high_m,
                "fresh": mean,
                "seeds": effect.seeds,
                "holds": effect.low_m <= mean <= effect.high_m,
                "advised": effect.verdict == "helps",
            }
        )
    for harm in advice.harms:
        mean = fresh.harm(int(harm.auv.removeprefix("AUV")))
        rows.append(
            {
                "said": f"fixes harm {harm.auv}",
                "low": harm.low_m,
                "high": harm.high_m,
                "fresh": mean,
                "seeds": harm.seeds,
                "holds": harm.low_m <= mean <= harm.high_m,
                "advised": False,
            }
        )
    return rows


def main() -> None:
    """Make the reports, check them, and print what held."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--reports", type=int, default=4)
    parser.add_argument("--seeds", type=int, default=200)
    parser.add_argument("--missions", type=int)
    parser.add_argument("--json", help="Write all statements to this file.")
    parser.add_argument("scenarios", nargs="*", default=ASKED)
    asked = parser.parse_args()
    everything: dict[str, list[dict[str, object]]] = {}
    for name in asked.scenarios:
        path = Path(name) if name.endswith(".yaml") else SCENARIOS / f"{name}.yaml"
        scenario, rows = load_scenario(path), []
        fresh = Fresh(scenario, asked.seeds)
        for seed in range(asked.reports):
            advice = advise(simulate(scenario, seed=seed), missions=asked.missions)
            found = checked(advice, fresh)
            rows += found
            print(f"{name}, seed {seed}: {advice.missions} missions {advice.shortage}")
            for it in found:
                mark = "holds" if it["holds"] else "FAILS"
                print(
                    f"  {mark} {it['fresh']:+.3f} in [{it['low']:+.3f}, {it['high']:+.3f}] "
                    f"({it['seeds']} seeds) {it['said']}"
                )
            sys.stdout.flush()
        everything[name] = rows
    for name, rows in everything.items():
        print(told(name, rows))
    print(told("all", [row for rows in everything.values() for row in rows]))
    if asked.json:
        Path(asked.json).write_text(json.dumps(everything, indent=1), encoding="utf-8")


def told(name: str, rows: list[dict[str, object]]) -> str:
    """Return how many statements held, of all and of what was advised."""
    advised = [row for row in rows if row["advised"]]
    held = [sum(bool(row["holds"]) for row in group) for group in (rows, advised)]
    return f"{name}: {held[0]} of {len(rows)} statements hold, {held[1]} of {len(advised)} advised"


if __name__ == "__main__":
    main()

"""What KN and OCBA of sim-tools need on some problems: `python sim_tools_runs.py > sim_tools.json`.

Wants `pip install sim-tools==1.3.0` (MIT licence), which is no dependency of the program nor of its
tests.  All candidates of a repetition have the same noise as in the test: `noise` below.

KN of sim-tools looks up variances of differences at `i (k - 1) + l - 1`, which for l < i is that of
another pair; where spreads are equal, as here, that costs it little.
"""

import json

import numpy as np
from numpy.typing import NDArray

REPETITIONS, MOST = 100, 1024
ZONE, RISK, FIRST = 1.0, 0.05 / 3, 8

# name: means, standard deviation, correlation between candidates at one seed
PROBLEMS = {
    "one better by the zone": ([0.0, 1.0, 1.0, 1.0], 2.0, 0.0),
    "the same, seeds paired": ([0.0, 1.0, 1.0, 1.0], 4.0, 0.7),
    "ten in steps of the zone": ([float(it) for it in range(10)], 6.0, 0.5),
    "all equal": ([0.0, 0.0, 0.0, 0.0], 2.0, 0.5),
    "one far better": ([0.0, 5.0, 5.0, 5.0], 4.0, 0.0),
}


def noise(name: str, repetition: int) -> NDArray[np.float64]:
    """Return the values (k, MOST) of a repetition of a problem."""
    means, sd, correlation = PROBLEMS[name]
    rng = np.random.default_rng([list(PROBLEMS).index(name), repetition])
    shared = np.sqrt(correlation) * rng.standard_normal(MOST)
    own = np.sqrt(1 - correlation) * rng.standard_normal((len(means), MOST))
    return np.array(means)[:, None] + sd * (shared + own)


class Recorded:
    """A model of sim-tools whose observations are known beforehand."""

    def __init__(self, values: NDArray[np.float64]) -> None:
        self._values, self.flown = values, np.zeros(len(values), int)

    def register_observer(self, observer: object) -> None:
        self._observer = observer

    def simulate(self, design: int) -> None:
        value = self._values[design, self.flown[design]]
        self.flown[design] += 1
        self._observer.feedback(self, design, value)  # type: ignore[attr-defined]


def main() -> None:
    """Write the share of right choices (but for the zone) and the missions of both, as JSON."""
    from sim_tools.ovs.fixed_budget import OCBA  # type: ignore[import-not-found]
    from sim_tools.ovs.indifference_zone import KN  # type: ignore[import-not-found]

    found = {}
    for name, (means, _, _) in PROBLEMS.items():
        right, missions = 0, 0
        for repetition in range(REPETITIONS):
            model = Recorded(noise(name, repetition))
            best = KN(model, len(means), ZONE, alpha=RISK, n_0=FIRST, obj="min").solve()[0]
            right += means[best] < ZONE
            missions += int(model.flown.sum())
        budget = len(means) * FIRST + 10 * round((missions / REPETITIONS - len(means) * FIRST) / 10)
        as_right = 0
        for repetition in range(REPETITIONS):
            model = Recorded(noise(name, repetition))
            best = OCBA(model, len(means), budget, 10, n_0=FIRST, obj="min").solve()
            as_right += means[best] < ZONE
        found[name] = {
            "kn_right": right / REPETITIONS,
            "kn_missions": missions / REPETITIONS,
            "ocba_right": as_right / REPETITIONS,
            "ocba_missions": budget,
        }
    print(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()

"""Predicted errors beside simulated ones, for plans drawn at random.

`python tests/predicted_for_tests.py [PLANS [SEEDS]]` prints how far apart they are, as told in
docs/planning.md and in apps/planning/prediction/inputs.py.
"""

import random
import sys
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bindusbl_des import Scenario, Setup, simulate
from bindusbl_des.apps.planning.prediction.gathering import inputs_of
from bindusbl_des.apps.planning.prediction.predicting import Prediction, predict
from bindusbl_des.core.records.metrics import WORST_IS_LARGEST

__all__ = [
    "METRICS", "Compared", "compared", "drawn_plan", "inputs_of", "off", "predict",
    "rank_correlation", "ratios",
]  # fmt: skip

METRICS = (
    *("position_error_m", "position_error_rms_m", "position_error_p95_m"),
    *("fix_rate_hz", "fix_age_mean_s", "fix_age_p95_s", "fix_age_max_s", "hf_coverage"),
)


class Compared(NamedTuple):
    """A plan, its prediction, and what missions made of it: by metric (seeds, AUVs)."""

    keys: dict[str, Any]
    predicted: Prediction
    simulated: dict[str, NDArray[np.float64]]

    def worst(self, metric: str) -> tuple[float, float]:
        """Return a metric of the worst AUV, predicted and as the mean over missions."""
        of = np.max if WORST_IS_LARGEST[metric] else np.min
        return self.predicted.worst(metric), float(of(self.simulated[metric], axis=1).mean())


def drawn_plan(number: int) -> dict[str, Any]:
    """Return the keys of a plan; the same for the same number."""
    draw = random.Random(number)
    count, asvs = draw.randint(1, 10), draw.randint(1, 6)
    side = draw.uniform(40.0, 200.0)
    hf = draw.uniform(0.25, 1.1) * side
    keys: dict[str, Any] = {
        "name": f"plan {number}",
        "duration_s": draw.choice((120.0, 300.0, 300.0, 600.0, 1200.0)),
        "survey": {"side_m": side},
        "auvs": {"count": count, "speed_m_per_s": draw.uniform(0.4, 1.5)},
        "asvs": {
            "count": asvs,
            "formation": {
                "radius_m": draw.uniform(0.1, 0.6) * side, "angle_deg": draw.uniform(0, 90)
            },
        },
        "acoustics": {
            "hf": {"range_m": hf, "range_metric": draw.choice(("horizontal", "slant"))},
            "mf": {"range_m": draw.uniform(0.8, 3.0) * hf},
            "loss": {"law": draw.choice(("paper", "paper", "head", "none"))},
        },
        "protocol": {
            "schedule": draw.choice(
                ("spatial_reuse",) * 2 + ("dsatur", "one_per_slot", "round_robin", "random")
            ),
            "downlink": draw.choice(
                ("sequential", "sequential", "pipelined_round", "pipelined_group", "direct_reply")
            ),
            "broadcaster": draw.choice(
                ("rotate", "rotate", "random", "most_fixes", "nearest", "fixed")
            ),
            "ranging": draw.choice(("owtt_sync", "owtt_sync", "owtt_sync", "twtt", "passive")),
        },
        "usbl": {"heading_sd_deg": draw.choice((0.3, 1.0, 1.0, 3.0))},
        "navigation": {
            "filter": draw.choice(("kalman",) * 5 + ("fixed_gain", "smoother", "dead_reckoning")),
            "bias_frame": draw.choice(("body", "body", "world")),
        },
    }  # fmt: skip
    if draw.random() < 0.3:
        keys["survey"] = {"size_m": [side, side * draw.uniform(0.4, 1.0)]}
    if draw.random() < 0.4:
        keys["asvs"]["formation"] = {
            "positions_m": [
                [draw.uniform(-0.6, 0.6) * side, draw.uniform(-0.6, 0.6) * side]
                for _ in range(asvs)
            ]
        }
    if draw.random() < 0.4:
        keys["navigation"] |= {
            "velocity_bias_m_per_s": [draw.uniform(-0.1, 0.1), draw.uniform(-0.1, 0.1)],
            "velocity_bias_sd_m_per_s": draw.choice((0.0, 0.05)),
            "random_walk_m_per_sqrt_s": draw.uniform(0.005, 0.1),
        }
    elif draw.random() < 0.2:
        keys["navigation"] |= {"drift": {"percent_of_distance": draw.uniform(0.5, 5.0)}}
    if draw.random() < 0.15:
        keys["acoustics"]["hf"] |= {"channel": "sonar"}
    if draw.random() < 0.2:
        keys["usbl"] |= {"gnss_correlated_sd_m": 0.5, "misalignment_sd_deg": 0.5}
    if keys["protocol"]["ranging"] == "passive":
        keys["protocol"] = {"ranging": "passive"}
    if keys["protocol"].get("downlink") == "direct_reply":
        keys["protocol"].pop("broadcaster")
    if keys["protocol"].get("broadcaster") == "fixed":
        keys["protocol"]["broadcaster"] = {"model": "fixed", "asv": draw.randrange(asvs)}
    if keys["navigation"]["filter"] == "fixed_gain":
        late = draw.choice(("shift", "none"))
        keys["navigation"]["filter"] = {"model": "fixed_gain", "delay_compensation": late}
    return keys


def compared(keys: dict[str, Any], seeds: int) -> Compared:
    """Return a plan predicted, and simulated with some seeds."""
    scenario = Scenario.model_validate({**keys, "record": {"detail": "summary"}})
    predicted = predict(inputs_of(Setup(scenario)), Setup(scenario).stations_m)
    tables = [simulate(scenario, seed).auvs for seed in range(seeds)]
    simulated = {
        metric: np.array([list(table[metric]) for table in tables], dtype=np.float64)
        for metric in METRICS
    }
    return Compared(keys, predicted, simulated)


def ratios(plans: Iterable[Compared], metric: str) -> NDArray[np.float64]:
    """Return how many times the simulated value is predicted, of the worst AUV of each plan that
    has one.
    """
    pairs = (plan.worst(metric) for plan in plans)
    return np.array([found / exact for found, exact in pairs if found > 0.0 and exact > 0.0])


def off(found: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return by which share ratios are off: half and twice alike by 1."""
    return np.asarray(np.exp(np.abs(np.log(found))) - 1.0)


def rank_correlation(number: int, seeds: int) -> float:
    """Return Spearman's correlation of predicted and simulated errors of the worst AUV over twelve
    random placements of the ASVs of a plan whose filter is Kalman's.
    """
    draw, keys = random.Random(number), drawn_plan(number)
    keys["navigation"] = {"filter": "kalman"}
    survey, asvs = keys["survey"], keys["asvs"]
    size = survey.get("size_m") or [survey["side_m"]] * 2
    found = []
    for _ in range(12):
        places = [[draw.uniform(-0.6, 0.6) * it for it in size] for _ in range(asvs["count"])]
        own = {**keys, "asvs": {**asvs, "formation": {"positions_m": places}}}
        found.append(compared(own, seeds).worst("position_error_m"))
    predicted, simulated = (np.argsort(np.argsort(it)) for it in np.array(found).T)
    return float(np.corrcoef(predicted, simulated)[0, 1])


def main(plans: int = 520, seeds: int = 4) -> None:
    """Print how far apart predictions and missions are, also by filter."""
    found = [compared(drawn_plan(number), seeds) for number in range(plans)]
    filters = [str(Scenario.model_validate(plan.keys).navigation.filter) for plan in found]
    for name in ("all", *sorted(set(filters))):
        own = [it for it, its in zip(found, filters, strict=True) if name in ("all", its)]
        print(f"{name}: {len(own)} plans")
        for metric in METRICS:
            known = ratios(own, metric)
            median, nine, most = np.quantile(off(known), (0.5, 0.9, 0.99))
            middle = np.median(known)
            print(f"  {metric}: {median:.3f} {nine:.3f} {most:.3f}, ratio {middle:.3f}")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))

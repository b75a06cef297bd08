"""The worst AUVs' errors in the paper's sweep: `python sweep_errors.py SWEEP > sweep_errors.csv`.

SWEEP is the folder of `bindusbl-des sweep experiments/sweep.yaml --out SWEEP` (here of model
0.1.0/4).  A row is a point and a metric, with the value (m) at each of its 20 seeds.
"""

import sys

from bindusbl_des import load_campaign

METRICS = ("worst_position_error_m", "worst_position_error_p95_m")
KEYS = {
    "side_m": "survey.side_m",
    "asvs": "asvs.count",
    "angle_deg": "asvs.formation.angle_deg",
    "auvs": "auvs.count",
}
SEEDS = 20


def main() -> None:
    """Write the table, which ends with the seeds' columns."""
    missions = load_campaign(sys.argv[1]).missions.sort_values("mission")
    print(",".join(("metric", *KEYS, *(f"seed_{seed}" for seed in range(SEEDS)))))
    for metric in METRICS:
        for point, rows in missions.groupby(list(KEYS.values())):
            values = rows[metric].tolist()
            assert rows["seed"].tolist() == list(range(SEEDS))
            print(",".join((metric, *map("{:g}".format, point), *map("{:.3f}".format, values))))


if __name__ == "__main__":
    main()

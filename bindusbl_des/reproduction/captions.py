"""The figures of a reproduction, by the name of their file: what each shows."""

CAPTIONS = {
    "baseline": "Baseline, L = 60 m: four AUVs, one ASV that hears them all. One run: "
    "map, and position errors; ticks are fixes delivered.",
    "failure_and_recovery": "Coverage failure and recovery, L = 140 m: one ASV and three, paths of "
    "one run. AUV0's path is the westernmost.",
    "errors_and_fixes": "Failure (above) and recovery (below): position error with the bias in "
    "the body frame (the paper's equation) and in the world frame, and fixes delivered; means and "
    "range over the runs.",
    "two_asvs": "Two ASVs over the formation angle, L = 140 m: means with 95 % intervals; crosses "
    "are the paper's numbers for AUV0.",
    "heatmap": "Mean error over all angles and seeds in three readings of the paper: "
    "cross-track error with 300 s for every team, position error at equal distance travelled, and "
    "position error with a bias in the world frame. Above: the paper's numbers (of so many ASVs).",
    "sweep_distance": "The sweep by formation angle at equal distance travelled (900 s / N): mean "
    "position error and fix rate, one standard deviation over seeds.",
    "sweep": "The sweep by formation angle with 300 s for every team: mean position error and fix "
    "rate, one standard deviation over seeds.",
    "schedulers": "Schedulers on moving AUVs: fix rates at L = 140 m (above) and the gain of "
    "spatial reuse over one AUV per slot at each side (below); bands are the range over formation "
    "angles.",
    "downlinks": "Downlinks where one ASV hears all AUVs: fix rate and mean latency (marks), rate "
    "of the slots in closed form (lines), and what the 2 kbit/s downlink allows at best (dashed).",
    "ablations": "Table I with one choice changed at a time: fixes delivered and position error, "
    "means with 95 % intervals; dashed lines are the paper's numbers.",
}

READINGS_CAPTION = (
    "How many numbers each joint reading foretells, of those that no reading puts in. Dashed: "
    "`default` and the best; shaded: what the best would foretell if the numbers had no reading in "
    "common (5 to 95 %)."
)

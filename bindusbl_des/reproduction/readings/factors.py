"""What the paper leaves open, and the ways to read it: the factors of a joint reading."""

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Factor:
    """What the paper leaves open, the ways to read it, and where the errata argue it."""

    name: str
    question: str
    errata: str
    choices: Mapping[str, str]


FACTORS = (
    Factor(
        "error",
        'what a "mean cross-track error" is: 10-11 m cannot lie across the track, and the '
        'sweep\'s figure says "mean position error"',
        "E8",
        {
            "cross_track": "mean error across the track",
            "position": "mean horizontal error",
            "position_rms": "root mean square of the horizontal error",
            "position_p95": "95 % quantile of the horizontal error",
        },
    ),
    Factor(
        "bias",
        "eq. dead_reckoning turns the bias with the AUV, the text lets drift grow without bound",
        "E7",
        {"body": "the bias turns with the AUV", "world": "the bias keeps its direction"},
    ),
    Factor(
        "delay",
        'eq. update compares a fix with the present, the abstract has "delayed fusion"',
        "E10",
        {
            "none": "a fix is compared with the estimate at its delivery",
            "shift": "a fix is compared with the estimate at its ping",
        },
    ),
    Factor(
        "loss",
        "the loss law is negative at every range, its contention term has no cause under TDMA, and "
        'the baseline is called "ideal"',
        "E1, E2, E3",
        {
            "clamp_first": "the law made a probability before contention is added, none in the "
            "baseline",
            "clamp_first_everywhere": "the same, in the baseline too",
            "paper_raw": "the literal sum, no loss in the baseline",
            "paper_raw_everywhere": "the literal sum, in the baseline too",
            "off": "no contention, and so no loss within range, anywhere",
        },
    ),
    Factor(
        "turns",
        "the baseline's AUVs are served one per second, with shares of 24.3 to 25.9 %",
        "E26",
        {
            "in_turn": "the baseline serves one AUV after the other",
            "by_lot": "the baseline draws an AUV every second",
        },
    ),
    Factor(
        "reply",
        "51 ms leave no room for the protocol's own airtime, so the baseline's ASV answers at "
        "once; at once after what?",
        "E23",
        {
            "ping_front": "the baseline's ASV answers the ping's front",
            "ping_end": "the baseline's ASV answers the ping's end",
        },
    ),
    Factor(
        "speed",
        "no speed is given; the distances of Table I are 182 to 192 m",
        "E28",
        {
            "common_speed": "all AUVs fly at their mean, 0.627 m/s",
            "published_speeds": "each AUV flies at its own, the published distance over 300 s",
        },
    ),
    Factor(
        "sweep",
        '"the distance-normalised protocol holds total team travel approximately constant", which '
        "the heatmap contradicts",
        "E31",
        {
            "equal_time": "every team flies 300 s",
            "equal_distance": "every team flies what three AUVs fly in 300 s",
        },
    ),
)
# The factor of each choice; no two factors share one.
FACTOR_OF = {choice: factor.name for factor in FACTORS for choice in factor.choices}

"""What the metrics of missions tell a planner: which way is better, and which an AUV may lack."""

from functools import cache
from typing import get_args, get_type_hints

from ...records.metrics import WORST, AuvMetrics
from ...records.worst import WORST_IS_LARGEST

# What a mission is for, first; what the network did for it, after.  A mission is as good as what
# its worst AUV got (interface: a plan is judged by it, averaged over seeds).
JUDGED = (
    "worst_position_error_m",
    "worst_position_error_p95_m",
    "worst_fix_age_p95_s",
    "worst_hf_coverage",
    "worst_latency_mean_s",
)
# The same of the fleet's means, in which an AUV that got little is hidden by those that got much.
MEANS = tuple(name.removeprefix(WORST) for name in JUDGED)

# What an AUV without a value did not get, by the beginning of the metric
LACKING = {
    "interval": "got fewer than two fixes",
    "latency": "got no fix",
    "fix_error": "was never located",
    "hf_coverage": "sent no ping that landed",
}


def of_an_auv(metric: str) -> str:
    """Return the metric of one AUV that a mission's is made of.

    >>> of_an_auv("worst_latency_mean_s"), of_an_auv("rounds")
    ('latency_mean_s', 'rounds')
    """
    return metric.removeprefix(WORST)


def lower_is_better(metric: str) -> bool | None:
    """Tell which way is better, None where neither is.

    >>> [lower_is_better(it) for it in ("worst_fix_age_max_s", "fix_rate_hz", "rounds")]
    [True, False, None]
    """
    return WORST_IS_LARGEST.get(of_an_auv(metric))


@cache
def may_be_missing(metric: str) -> bool:
    """Tell whether an AUV can be without it: what is measured on fixes, for one that got none.

    >>> may_be_missing("worst_latency_mean_s"), may_be_missing("position_error_m")
    (True, False)
    """
    if of_an_auv(metric) not in WORST_IS_LARGEST:
        return False
    return type(None) in get_args(get_type_hints(AuvMetrics)[of_an_auv(metric)])


def lacking(metric: str) -> str:
    """Return what became of an AUV that has no value of a metric.

    >>> lacking("worst_interval_max_s"), lacking("path_error_m")
    ('got fewer than two fixes', 'had no path_error_m')
    """
    own = of_an_auv(metric)
    return next((said for name, said in LACKING.items() if own.startswith(name)), f"had no {own}")

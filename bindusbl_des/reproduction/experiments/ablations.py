"""Ablations: what each choice that the paper leaves open does to Table I."""

from typing import TYPE_CHECKING

from ...campaigns.campaign import Campaign
from ...campaigns.statistics.intervals import interval
from .measured import chosen, per_seed
from .running import Runs

if TYPE_CHECKING:
    import pandas as pd

UNCHANGED = "as the paper writes"
AUVS = ("AUV0", "AUV1", "AUV2")


def changes(campaign: Campaign, asvs: int) -> dict[str, int]:
    """Return what was changed (``key=value``) and the point of the campaign, for an ASV count."""
    found: dict[str, int] = {}
    for number, point in enumerate(campaign.plan.points):
        if point.sets["asvs.count"] == asvs:
            rest = {key: value for key, value in point.sets.items() if key != "asvs.count"}
            found[_named(rest)] = number
    return found


def _named(rest: dict[str, object]) -> str:
    return ", ".join(f"{key}={_written(value)}" for key, value in rest.items()) or UNCHANGED


def _written(value: object) -> str:
    return "null" if value is None else str(value)


def compared(runs: Runs) -> "pd.DataFrame":
    """Return a row per ASV count and change: fixes and errors of each AUV, and collisions."""
    import pandas as pd

    campaign = runs["ablations"]
    return pd.DataFrame(
        [
            _row(campaign, asvs, change, point)
            for asvs in (1, 3)
            for change, point in changes(campaign, asvs).items()
        ]
    )


def _row(campaign: Campaign, asvs: int, change: str, point: int) -> dict[str, object]:
    found: dict[str, object] = {"asvs": asvs, "change": change}
    for auv in AUVS:
        where = {"point": point, "auv": auv}
        for name, column in (("fixes", "fixes_delivered"), ("error", "position_error_m")):
            it = interval(per_seed(campaign.auvs, column, where))
            found[f"{name}_{auv}"], found[f"{name}_{auv}_half_width"] = it.mean, it.half_width
    rows = chosen(campaign.missions, {"point": point})
    return {**found, "collisions": rows.collisions.mean()}

"""Ablations: what each choice that the paper leaves open does to Table I."""

from ..campaigns.campaign import Campaign

AS_PUBLISHED = "as the paper writes"


def changes(campaign: Campaign, asvs: int) -> dict[str, int]:
    """Return what was changed, as ``key=value``, and the point of the campaign, for an ASV count."""
    found: dict[str, int] = {}
    for number, point in enumerate(campaign.plan.points):
        if point.sets["asvs.count"] == asvs:
            rest = {key: value for key, value in point.sets.items() if key != "asvs.count"}
            found[_named(rest)] = number
    return found


def _named(rest: dict[str, object]) -> str:
    return ", ".join(f"{key}={value}" for key, value in rest.items()) or AS_PUBLISHED

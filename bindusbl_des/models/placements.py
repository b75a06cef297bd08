"""The placements that send ASVs elsewhere again and again: the keys of each, and what gives ASVs
their targets.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Literal, TypeAlias

from ..core.scenario.key_types import OURS, Real, key
from ..core.scenario.sections.placements import Ahead, Grouped

if TYPE_CHECKING:
    from ..core.protocol.anchors.information import FixErrors
    from ..core.protocol.anchors.view import Mover
    from ..core.scenario.site import Site

    Errors: TypeAlias = Callable[[], list[FixErrors]]


class Follow(Ahead):
    """ASVs stay where the farthest AUV is as near as possible (k-centre)."""

    MOST_AUVS = 100  # these take 0.1 s to place; twice as many take seconds
    model: Literal["follow"] = "follow"
    within_m: Real | None = key(
        None,
        "m",
        "ASVs rest while each AUV is estimated within this distance of one; null = never",
        ge=0,
        le=1e5,
    )

    def mover(self, site: Site, errors: Errors) -> Mover:
        """Return what gives ASVs their targets, made anew."""
        from ..core.protocol.anchors.follow import FollowPlacement

        return FollowPlacement(
            horizon_s=self.horizon_s, hysteresis=self.hysteresis, within_m=self.within_m
        )


class Assign(Ahead):
    """Each ASV stays above the middle of its own AUVs."""

    model: Literal["assign"] = "assign"

    def mover(self, site: Site, errors: Errors) -> Mover:
        """Return what gives ASVs their targets, made anew."""
        from ..core.protocol.anchors.assign import AssignPlacement

        return AssignPlacement(horizon_s=self.horizon_s, hysteresis=self.hysteresis)


class Visit(Grouped):
    """Each ASV keeps near one of its AUVs at a time: that with the largest expected error."""

    model: Literal["visit"] = "visit"
    near_m: Real | None = key(
        None,
        "m",
        "an ASV rests while the AUV that it visits is estimated within this distance; null = "
        "half the HF range",
        ge=0,
        le=1e5,
    )
    dwell_s: Real = key(
        30.0, "s", "least time that an ASV stays with an AUV, once near", OURS, ge=0, le=1e6
    )

    def mover(self, site: Site, errors: Errors) -> Mover:
        """Return what gives ASVs their targets, made anew."""
        from ..core.protocol.anchors.visit import VisitPlacement

        return VisitPlacement(
            within_m=site.horizontal_reach_m / 2.0 if self.near_m is None else self.near_m,
            dwell_s=self.dwell_s,
            hysteresis=self.hysteresis,
            replan_s=self.replan_s,
        )


class Information(Grouped):
    """ASVs go where fixes are expected to leave the least error (Fisher information)."""

    MOST_AUVS = 100
    model: Literal["information"] = "information"
    lookahead_s: Real = key(
        30.0, "s", "how far ahead the AUVs' errors are predicted", OURS, ge=1, le=1e6
    )
    criterion: Literal["trace", "determinant"] = key(
        "trace", "", "size of a covariance: A-optimality or D-optimality", OURS
    )

    def mover(self, site: Site, errors: Errors) -> Mover:
        """Return what gives ASVs their targets, made anew."""
        from ..core.protocol.anchors.information import InformationPlacement

        return InformationPlacement(
            errors(),
            horizon_s=self.lookahead_s,
            hysteresis=self.hysteresis,
            criterion=self.criterion,
        )


class Zigzag(Grouped):
    """Each ASV sweeps to and fro over its own AUVs."""

    model: Literal["zigzag"] = "zigzag"
    amplitude_m: Real | None = key(
        None,
        "m",
        "half the width of the sweep; null = from the first to the last of the ASV's AUVs, of a "
        "single one half the HF range",
        ge=0.01,
        le=1e5,
    )
    period_s: Real | None = key(
        None,
        "s",
        "period of a sweep; null = that of an ASV which keeps up with AUVs",
        ge=1,
        le=1e6,
    )

    def mover(self, site: Site, errors: Errors) -> Mover:
        """Return what gives ASVs their targets, made anew."""
        from ..core.protocol.anchors.zigzag import ZigzagPlacement

        return ZigzagPlacement(
            amplitude_m=self.amplitude_m,
            period_s=self.period_s,
            hysteresis=self.hysteresis,
            replan_s=self.replan_s,
            auv_speed=max(site.planned_speeds_m_per_s),
        )

"""The figures that a campaign offers."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..core.wording import did_you_mean
from ..figures.style import finished
from ..figures.sweeps import curves, heatmap
from .statistics.cells import means_of
from .statistics.outcomes import JUDGED

if TYPE_CHECKING:
    from .campaign import Campaign

KINDS = {"curves": curves, "heatmap": heatmap}


def drawn(
    campaign: "Campaign",
    kind: str,
    width: float,
    path: str | Path | None = None,
    **what: str | None,
) -> Any:
    """Return a figure of a campaign by its kind, `width` inches wide; also write it to a path.

    `what` is shown: its `metric`, and the keys `x` and `series`, as for `means_of`.

    Raises:
        ValueError: when there is no such kind, format, metric or key, or nothing to draw.
        OSError: when it cannot be written.
    """
    if kind not in KINDS:
        hint = did_you_mean(kind, KINDS) or f"; there are {', '.join(KINDS)}"
        raise ValueError(f"no figure {kind!r} of a campaign{hint}")
    try:
        means = means_of(campaign, what.pop("metric", None) or JUDGED[0], **what)
    except LookupError as error:
        raise ValueError(error.args[0]) from None
    return finished(lambda inches: KINDS[kind](means, inches), width, path)

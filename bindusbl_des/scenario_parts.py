"""What a scenario's keys are made of: plain strict numbers, each with its unit, meaning and source.

``PAPER`` marks defaults published in the BIND-USBL paper, ``THESIS`` those of the simulator behind
its reference [max_phd] (M. Nitsch, RWTH Aachen 2024, DOI 10.18154/RWTH-2024-05964), ``OURS`` those
chosen here.
"""

from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, Strict

PAPER = "BIND-USBL paper"
THESIS = "Nitsch 2024, USBL-Simulator"
OURS = "this package"

Real = Annotated[float, Strict(), Field(allow_inf_nan=False)]
Whole = Annotated[int, Strict()]
Text = Annotated[str, Strict()]
Coordinate = Annotated[float, Strict(), Field(allow_inf_nan=False, ge=-1e6, le=1e6)]
Point = tuple[Coordinate, Coordinate]


def key(default: Any, unit: str, meaning: str, source: str = OURS, **bounds: Any) -> Any:
    """Describe one scenario key: its default, unit, meaning, source and allowed range."""
    return Field(
        default=default,
        description=meaning,
        json_schema_extra={"unit": unit, "source": source},
        **bounds,
    )


class Part(BaseModel):
    """A frozen part of a scenario; a key that is not listed is a mistake, never ignored."""

    model_config = ConfigDict(frozen=True, extra="forbid", validate_default=True)

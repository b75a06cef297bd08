"""The keys of ASVs that fail during a mission."""

from typing import Annotated

from pydantic import Field

from ..key_types import Part, Real, Whole, key

Instant = Annotated[Real, Field(ge=0, le=1e9)]


class Failure(Part):
    """An ASV that from an instant on neither hears, calls nor broadcasts, for good or for a time.

    It stays where it keeps station.
    """

    asv: Whole = Field(
        ge=0,
        le=9_999,
        description="number of the ASV that fails",
        json_schema_extra={"unit": "1", "source": "this package"},
    )
    at_s: Instant = Field(
        description="instant at which it fails",
        json_schema_extra={"unit": "s", "source": "this package"},
    )
    until_s: Instant | None = key(
        None, "s", "instant from which it works again; null = it does not until the mission ends"
    )

    def lasts(self, time: float) -> bool:
        """Tell whether it has failed, and not come back, at an instant (s)."""
        return self.at_s <= time and (self.until_s is None or time < self.until_s)

"""The numbers that the paper publishes, as it prints them."""

import csv
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

TABLE = Path(__file__).with_name("paper_results.csv")


@dataclass(frozen=True)
class Published:
    """One number of the paper: where it stands, for which mission and vehicle, in which unit.

    `side_m`, `auvs`, `asvs` and `angle_deg` are texts, since the paper also gives numbers for
    ranges of them ("3-10", "all").
    """

    source: str
    side_m: str
    auvs: str
    asvs: str
    angle_deg: str
    auv: str
    quantity: str
    text: str
    unit: str

    @property
    def value(self) -> float:
        """The number itself."""
        return float(self.text)

    @property
    def half_digit(self) -> float:
        """Half a unit of the last printed digit: the number was rounded by no more than that.

        >>> row = Published("tab:x", "140", "3", "1", "0", "AUV0", "coverage", "0.70", "1")
        >>> row.half_digit
        0.005
        """
        decimals = len(self.text.partition(".")[2])
        return float(f"5e-{decimals + 1}")

    @property
    def case(self) -> str:
        """The mission and vehicle in a few words."""
        angle = "" if self.angle_deg == "all" or self.asvs == "1" else f" at {self.angle_deg} deg"
        side = "all sides" if self.side_m == "all" else f"{self.side_m} m"
        return f"{side}, {self.auvs} AUVs, {self.asvs} ASV{'s' * (self.asvs != '1')}{angle}"


@cache
def published() -> tuple[Published, ...]:
    """Return every number of the paper, in the order of the table that lists them."""
    return tuple(_rows())


def _rows() -> Iterator[Published]:
    with open(TABLE, encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            text = row.pop("value")
            yield Published(**row, text=text)

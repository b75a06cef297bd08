"""What a preset is: figures by name, and of each how it is known."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

# How a figure is known: the maker's own page, the source code of a driver or simulator, second
# hand, or worked out from other figures.
Tag = Literal["M", "S", "2", "calc"]
TAGS: dict[Tag, str] = {
    "M": "the maker's own page",
    "S": "read in the source code of a driver or simulator",
    "2": "second hand",
    "calc": "worked out here from other figures",
}


@dataclass(frozen=True)
class Figure:
    """One number of a data sheet, or a word, in its unit ("" for none), and where it stands."""

    value: float | int | str
    unit: str
    tag: Tag
    source: str


@dataclass(frozen=True)
class Preset:
    """A named set of figures; each is named as the key, or setting, of a scenario that it is for.

    What has no source is not in it: a key that a preset does not name keeps its default.
    """

    name: str
    title: str
    figures: Mapping[str, Figure]

    @property
    def values(self) -> dict[str, float | int | str]:
        """The bare values by name."""
        return {name: figure.value for name, figure in self.figures.items()}

"""Tables as pandas frames: each is made when it is first asked for, and kept."""

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

import pyarrow as pa

from ..core.wording import did_you_mean

if TYPE_CHECKING:
    import pandas as pd


class PandasTables(Mapping[str, "pd.DataFrame"]):
    """Arrow tables by name, as pandas frames.

    Who asks for metrics alone does not wait for all receptions to be turned into a frame.
    """

    def __init__(self, arrow: Mapping[str, pa.Table]) -> None:
        self._arrow = arrow
        self._made: dict[str, pd.DataFrame] = {}

    def __getitem__(self, name: str) -> "pd.DataFrame":
        if name not in self._arrow:
            meant = did_you_mean(name, self) or f"; there are {', '.join(self)}"
            raise KeyError(f"no table {name!r}{meant}")
        if name not in self._made:
            self._made[name] = self._arrow[name].to_pandas()
        return self._made[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._arrow)

    def __len__(self) -> int:
        return len(self._arrow)

    def __repr__(self) -> str:
        return f"<pandas tables {', '.join(self)}>"

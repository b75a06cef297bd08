"""The result of one mission: its tables, and the folder that holds them.

Pages and figures are made by applications, which are imported when first asked for.
"""

import hashlib
import json
import os
import platform
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from html import escape
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any

import pyarrow as pa

from ...support.facts import cached_property, fact
from ...support.files import sealed, write_text
from ...support.kept_files import copies_of, keep, portable
from ...support.mistakes import ScenarioWarning
from ...support.wording import did_you_mean
from ..scenario.scenario import Scenario
from ..setup import Setup
from .effects import Advice
from .result_folder import (
    ADVICE,
    DICTIONARY,
    FILE_SUMS,
    RECORD,
    SCENARIO,
    SUMS,
    SummedFile,
    advice_text,
    result_draft,
    sha256_of,
    write_json,
    write_parquet,
)
from .schemas import SCHEMA_VERSION, data_dictionary
from .summary import summary
from .violations import Violations

if TYPE_CHECKING:
    import pandas as pd


# Functions, by their modules in the package, that make of a result
PAGE = "apps.report.run_page:run_page"  # a page (HTML)
FIGURE = "apps.figures.kinds:drawn"  # a figure (matplotlib), given its kind and width (in)
WARNINGS = "apps.preflight.warnings:warnings_of"  # warnings, of its scenario


def face(home: str) -> Any:
    """Return the function named ``module:function``, its module relative to the package."""
    module, _, name = home.partition(":")
    return getattr(import_module(f"....{module}", __name__), name)


def page(result: Any) -> str:
    """Return the report of a result, one HTML page."""
    text: str = face(PAGE)(result)
    return text


PACKAGES = ("bindusbl-des", "simpy", "numpy", "networkx", "pandas", "pyarrow", "numba")


class PandasTables(Mapping[str, "pd.DataFrame"]):
    """Arrow tables by name, as pandas frames, each converted when it is first asked for."""

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


class Result:
    """The result of one mission.

    `scenario` and `seed` made it; `arrow` has its tables as Arrow tables, by name; `wall_time_s`
    (s) is how long the mission took to simulate; `violations` counts signals of its schedule that
    others destroyed, and has the first; `advice` has the measured effects of changes (`advise`),
    None if none was tried; `whole_time_s` (s) is how long a command took from reading the scenario
    to the page, else None.
    """

    def __init__(
        self,
        scenario: Scenario,
        seed: int,
        arrow: Mapping[str, pa.Table],
        wall_time_s: float,
        warnings: Sequence[ScenarioWarning] | None = None,
        *,
        notes: Sequence[ScenarioWarning] = (),
        violations: Violations | None = None,
        overrides: Sequence[str] = (),
    ) -> None:
        """Take the Arrow tables by name; with `record.detail: summary` only auvs and mission.

        `warnings` are those of the run; by default those of the scenario now, and `notes`, which
        the scenario alone does not give.  `violations` is None where they are not known or AUVs
        ping as they like; `overrides` are the KEY=VALUE options set beside the scenario's file.
        """
        self.scenario, self.seed = scenario, seed
        self.arrow = dict(arrow)
        self.wall_time_s, self.violations = wall_time_s, violations
        self.overrides = tuple(overrides)
        #: The user-defined navigator that a mission of this process had; None otherwise.
        self.navigator: Any = None
        self.advice: Advice | None = None
        self.whole_time_s: float | None = None
        self._given_warnings, self._notes = warnings, notes

    def __getstate__(self) -> dict[str, Any]:
        """Leave out a user-defined navigator: another process may not know its class."""
        return {**self.__dict__, "navigator": None}

    @cached_property
    def warnings(self) -> tuple[ScenarioWarning, ...]:
        """Warnings about the scenario, to read before the results are trusted."""
        if self._given_warnings is not None:
            return tuple(self._given_warnings)
        return (*face(WARNINGS)(self.scenario), *self._notes)

    @fact
    def setup(self) -> Setup:
        """The facts of the scenario."""
        return Setup.of(self.scenario)

    @cached_property
    def tables(self) -> "Mapping[str, pd.DataFrame]":
        """All tables as pandas frames, by name; each is made when it is first asked for."""
        return PandasTables(self.arrow)

    @property
    def auvs(self) -> "pd.DataFrame":
        """Metrics of AUVs, a row for each."""
        return self.tables["auvs"]

    @property
    def mission(self) -> "pd.DataFrame":
        """Metrics of the mission, one row."""
        return self.tables["mission"]

    def summary(self) -> str:
        """Return the most important metrics in a table of at most 80 columns, and the advice."""
        auvs, mission = (self.arrow[name].to_pylist() for name in ("auvs", "mission"))
        broken = "" if self.violations is None else self.violations.text
        return summary(auvs, mission[0], self.advice, broken)

    def report(self, path: str | Path | None = None) -> str:
        """Return the report, one HTML page that opens offline; also write it to `path`, if given.

        Raises:
            OSError: when it cannot be written.
        """
        text = page(self)
        if path is not None:
            write_text(Path(path), text)
        return text

    def plot(
        self, kind: str, path: str | Path | None = None, *, width: float = 7.16, **options: Any
    ) -> Any:
        """Return a matplotlib figure, `width` inches wide, as the command `plot` draws it; also
        write it to `path`, if given.

        `kind` is trajectory, error, fixes, coverage, timeline, round or latency; the ending of
        `path` chooses PNG, SVG or PDF.  Options: `first` and `last` round of a timeline, `number`
        of a round.

        Raises:
            ValueError: when there is no such figure, format or round, or the result lacks the
                tables that the figure needs.
            OSError: when it cannot be written.
        """
        return face(FIGURE)(self, kind, width, path, **options)

    def __repr__(self) -> str:
        auvs, asvs = self.scenario.auvs.count, self.scenario.asvs.count
        return (
            f"<Result of {self.scenario.name}, seed {self.seed}: {auvs} AUVs, {asvs} ASVs, "
            f"{self.scenario.duration_s:g} s>"
        )

    def _repr_html_(self) -> str:
        """Return the summary as notebooks show it."""
        return f"<p>{escape(repr(self))}</p><pre>{escape(self.summary())}</pre>"

    def run_record(self) -> dict[str, Any]:
        """Return the data of `run.json`: scenario, seed, warnings, versions, times, status."""
        return {
            "status": "complete",
            "schema": SCHEMA_VERSION,
            "scenario": portable(self.scenario.model_dump(mode="json")),
            "scenario_sha256": scenario_sha256(self.scenario),
            "seed": self.seed,
            "overrides": list(self.overrides),
            "warnings": [
                {"key": warning.key, "message": warning.message} for warning in self.warnings
            ],
            "violations": None if self.violations is None else self.violations.data(),
            "versions": {"python": platform.python_version(), **versions()},
            "wall_time_s": self.wall_time_s,
            **({} if self.whole_time_s is None else {"whole_time_s": self.whole_time_s}),
            "sim_seconds_per_second": self.scenario.duration_s / self.wall_time_s,
        }

    def write(
        self, folder: str | Path, *, force: bool = False, scenario_text: str | None = None
    ) -> Path:
        """Write the result folder, whole or not at all; return its path.

        An earlier run's folder is replaced only with `force`, and only if it holds nothing else.
        If another process takes the name meanwhile, the results are written beside it.

        Raises:
            FileExistsError: when the folder exists or came to exist; it says where results are.
            OSError: when it cannot be written, or the disk is full.
        """
        folder = Path(folder)
        with result_draft(folder, force=force) as draft:
            self.fill(draft, scenario_text)
        return folder

    def fill(self, folder: Path, scenario_text: str | None, began_s: float | None = None) -> None:
        """Write all files into a folder; the scenario as its user wrote it, if that text is given.

        `began_s` is the instant of :func:`time.monotonic` at which the command began.

        Raises:
            OSError: when the folder cannot be written to, or is full.
        """
        run = self.run_record()
        origin = {
            "bindusbl.scenario_sha256": run["scenario_sha256"],
            "bindusbl.seed": str(self.seed),
        }
        run[SUMS] = {}
        for name, table in self.arrow.items():
            # Opened here, since Arrow takes no names that are not UTF-8.
            with SummedFile(folder / f"{name}.parquet") as file:
                write_parquet(table, name, file, origin)
            run[SUMS][name] = file.sha256()
        copies = copies_of(self.scenario.model_dump(mode="json"))
        if copies:
            keep({name: file for name, file in copies.items() if os.path.isfile(file)}, folder)
            scenario_text = None  # it has the files' original paths
        # JSON is YAML, but for its escapes of characters beyond U+FFFF.
        text = scenario_text or json.dumps(run["scenario"], indent=2, ensure_ascii=False)
        (folder / SCENARIO).write_text(text, encoding="utf-8")
        write_json(folder / DICTIONARY, data_dictionary())
        run[FILE_SUMS] = {name: sha256_of(folder / name) for name in (SCENARIO, DICTIONARY)}
        if self.advice is not None:
            (folder / ADVICE).write_text(advice_text(self.advice), encoding="utf-8")
        if began_s is not None:
            run["whole_time_s"] = self.whole_time_s = monotonic() - began_s
        (folder / "report.html").write_text(page(self), encoding="utf-8")
        write_json(folder / RECORD, sealed(run))


@cache
def versions() -> dict[str, str]:
    """Return the installed version of each package that a mission's numbers depend on."""
    return {package: version(package) for package in PACKAGES}


def scenario_sha256(scenario: Scenario) -> str:
    """Return the fingerprint of a scenario: equal scenarios have equal fingerprints.

    Files that it names count by their contents and names, wherever they are.
    """
    return sha256_as_written(portable(scenario.model_dump(mode="json")))


def sha256_as_written(scenario: Mapping[str, Any]) -> str:
    """Return the fingerprint of a scenario's data as written, even if keys were added since."""
    canonical = json.dumps(scenario, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(canonical.encode()).hexdigest()

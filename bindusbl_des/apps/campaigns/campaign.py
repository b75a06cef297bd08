"""A campaign's folder as an object: its progress, tables, and reports."""

import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from html import escape
from pathlib import Path
from shutil import copytree, ignore_patterns
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...core.results.result import Result, face
from ...core.scenario.scenario import Scenario
from ...support.facts import cached_property
from ...support.files import folder_draft, write_text
from ...support.kept_files import placed
from ...support.wording import counted, did_you_mean, plain, shortened
from .experiments.experiment import Experiment, ExperimentPlan, fingerprint
from .statistics.findings import findings
from .statistics.outcomes import JUDGED, outcomes
from .statistics.points_table import (
    latex_table,
    points_rows,
    points_table,
    settled,
)
from .storage.folder import LOCK, CampaignError, damaged_record, is_locked, read_record
from .storage.part_rows import (
    done,
    of_mission,
    of_schema,
    read_part,
    read_table,
    varied_columns,
)
from .storage.parts import MISSIONS, OK, TABLES, Done, committed, listed

if TYPE_CHECKING:
    import pandas as pd

# Functions that draw a campaign, by module of the package
PAGE = "apps.campaigns.page:sweep_page"  # a page (HTML)
FIGURE = "apps.campaigns.drawing:drawn"  # a figure (matplotlib), given its kind and width (in)

# The number of columns that identify a mission (number, fingerprint, seed), before point and keys
LABELS = 3

# Exceptions that an edited record may cause.
WRONG = (AttributeError, LookupError, TypeError, ValueError, ArithmeticError, RecursionError)


@dataclass(frozen=True)
class CampaignState:
    """The progress of a campaign: its number of `missions`, those `done`, and those `failed`.

    `status` is complete, running, interrupted or killed; `missions_per_s` is None if unknown.
    """

    missions: int
    done: int
    failed: int
    status: str
    missions_per_s: float | None = None

    @property
    def missing(self) -> int:
        """The number of missions without a row."""
        return self.missions - self.done - self.failed

    @property
    def seconds_left(self) -> float | None:
        """The time (s) until the end at the present rate, or None."""
        return self.missing / self.missions_per_s if self.missions_per_s else None


class CampaignInterrupted(KeyboardInterrupt):
    """Ctrl-C, or a request to end, stopped a campaign; `campaign` holds the finished missions.

    `resume` on its `folder`, or the same `sweep` again, continues it.
    """

    def __init__(self, campaign: "Campaign", how_to_go_on: str) -> None:
        self.campaign, self.folder = campaign, campaign.folder
        state = campaign.state()
        super().__init__(f"{state.missing} of {state.missions} missions are left; {how_to_go_on}")


class Campaign:
    """A campaign's `folder`, and its `record` (`campaign.json`)."""

    def __init__(self, folder: Path, plan: ExperimentPlan | None, record: dict[str, Any]) -> None:
        """Use a plan, or (None) read that of the record when it is needed."""
        self.folder, self._plan, self.record = folder, plan, record

    @cached_property
    def experiment(self) -> Experiment:
        """The base scenario, the points that vary it, and the seeds."""
        if self._plan is not None:
            return self._plan.experiment
        with _read_of(self.folder):
            record = self.record["experiment"]
            return Experiment.from_record(record, self.record["scenario"], self.folder)

    @cached_property
    def plan(self) -> ExperimentPlan:
        """All missions, and each point with its whole scenario.

        Raises:
            CampaignError: when a point's scenario is invalid.
        """
        if self._plan is not None:
            return self._plan
        experiment = self.experiment
        with _read_of(self.folder):
            plan = ExperimentPlan(experiment)
        plan.model_version = self.record["model_version"]
        return plan

    def __repr__(self) -> str:
        points, seeds = len(self.experiment.points), len(self.experiment.seeds)
        status = self.record["status"]
        return (
            f"<Campaign {self.record['name']}: {counted(points, 'point')} x "
            f"{counted(seeds, 'seed')}, {'' if status == 'complete' else f'{status}, '}"
            f"in {self.folder}>"
        )

    def _repr_html_(self) -> str:
        """Return the summary as notebooks show it."""
        return f"<p>{escape(repr(self))}</p><pre>{escape(self.summary())}</pre>"

    def summary(self) -> str:
        """Return the text that `sweep` prints: a row for each point, and the findings."""
        return points_table(self.folder, self.plan, findings(self.folder, self.plan))

    def report(self, path: str | Path | None = None) -> str:
        """Return the report, one HTML page that opens offline; also write it to `path`, if given.

        Raises:
            OSError: when it cannot be written.
        """
        text: str = face(PAGE)(self)
        if path is not None:
            write_text(Path(path), text)
        return text

    def plot(
        self,
        kind: str = "curves",
        path: str | Path | None = None,
        *,
        metric: str | None = None,
        x: str | None = None,
        series: str | None = None,
        width: float = 4.5,
    ) -> Any:
        """Return a matplotlib figure, `width` inches wide, as `plot` draws it; also write it.

        `kind` is curves, or heatmap where two keys vary.  `metric` (that of the worst AUV's error
        unless given) is drawn over the varied key `x`, for each value of the key `series`; the
        ending of `path` chooses PNG, SVG or PDF.

        Raises:
            ValueError: when there is no such figure, format, metric or key, or nothing to draw.
            OSError: when it cannot be written.
        """
        return face(FIGURE)(self, kind, width, path, metric=metric, x=x, series=series)

    def write(self, folder: str | Path) -> Path:
        """Copy the campaign into a new folder, all of it or nothing; return its path.

        Raises:
            FileExistsError: when the folder exists.
            OSError: when it cannot be written, or the disk is full.
        """
        folder = Path(folder)
        if folder.exists():
            raise FileExistsError(f"{folder}: exists; name another folder")
        with folder_draft(folder, lambda _: "exists") as draft:
            copytree(self.folder, draft, ignore=ignore_patterns(LOCK), dirs_exist_ok=True)
        return folder

    @cached_property
    def missions(self) -> "pd.DataFrame":
        """One row per mission in the order of the plan: varied keys, seed, status, metrics."""
        return self._frame("missions")

    @cached_property
    def auvs(self) -> "pd.DataFrame":
        """One row per AUV of each mission, in the order of the plan."""
        return self._frame("auvs")

    @cached_property
    def points(self) -> "pd.DataFrame":
        """A row for each metric and point: point number, varied keys, metric, unit, mean, the ends
        `low` and `high` of its 95 % interval (Student's t), the number `n` of missions with a
        value, and the number of successful `missions`.
        """
        found: pd.DataFrame = points_rows(self.folder, self.plan).to_pandas()
        return found

    def to_latex(
        self, path: str | Path | None = None, *, metrics: Sequence[str] = JUDGED[:3]
    ) -> str:
        """Return a LaTeX table with a row for each point; also write it to `path`, if given.

        Columns are the varied keys, the number of missions, and mean +- half the 95 % interval of
        each metric.  It needs no LaTeX package.

        Raises:
            ValueError: when there is no such metric.
            OSError: when it cannot be written.
        """
        text = latex_table(self.folder, self.plan, self.record["name"], metrics)
        if path is not None:
            write_text(Path(path), text)
        return text

    def table(self, name: str) -> "pd.DataFrame":
        """Return a table of all missions: `missions`, `auvs`, or with `detail: full` one of events.

        Each row has its mission, seed, point and varied keys.

        Raises:
            ValueError: when there is no such table, or the campaign does not keep it.
        """
        if name in (MISSIONS, "auvs"):
            return self.missions if name == MISSIONS else self.auvs
        if name not in TABLES:
            hint = did_you_mean(name, TABLES) or f"; there are {', '.join(TABLES)}"
            raise ValueError(f"no table {name!r}{hint}")
        if self.experiment.detail != "full":
            raise ValueError(
                f"{self.folder} has no table {name!r}, since it keeps metrics alone; sweep with "
                "detail full into another folder, or fly one of its missions by `simulate`"
            )
        frame = self._frame(name)
        if len(frame):
            point = frame["mission"].to_numpy() // len(self.experiment.seeds)
            frame.insert(LABELS, "point", point)
            varied = [planned.varied for planned in self.plan.points]
            keys = varied_columns(self.plan.columns, varied).items()
            for place, (key, values) in enumerate(keys, LABELS + 1):
                frame.insert(place, key, values.to_pandas().to_numpy()[point])
        return frame

    def result(self, point: int, seed: int) -> Result:
        """Return one mission's result from its point's number and its seed.

        It has the metrics, and with `detail: full` the tables of events.

        Raises:
            ValueError: when there is no such mission, or it is not done, or failed.
            CampaignError: when a part is damaged.
        """
        seeds, points = self.experiment.seeds, len(self.experiment.points)
        if point not in range(points):
            raise ValueError(f"no point {point!r}; there are 0 to {points - 1}")
        if seed not in seeds:
            raise ValueError(f"no seed {seed!r}; there are {shortened(plain(list(seeds)))}")
        rows = of_mission(self.folder, point * len(seeds) + seeds.index(seed))
        what = f"{self.folder}: the mission of point {point} with seed {seed}"
        if rows is None:
            raise ValueError(f"{what} has not been flown; `resume` flies what is missing")
        rows["mission"] = rows.pop(MISSIONS)
        (mission,) = rows["mission"].to_pylist()
        if mission["status"] != OK:
            raise ValueError(f"{what} failed: {mission['error']}")
        data = placed(json.loads(self.plan.points[point].scenario), self.folder)
        tables = {name: of_schema(table, name) for name, table in rows.items()}
        scenario = Scenario.model_validate(data)
        return Result(scenario, int(seed), tables, mission["wall_time_s"])

    def _frame(self, table: str) -> "pd.DataFrame":
        import pandas as pd

        rows = read_table(self.folder, table)
        frame: pd.DataFrame = pd.DataFrame() if rows is None else rows.to_pandas()
        return frame

    def done(self) -> Done:
        """Return the missions that have a row.

        Raises:
            CampaignError: when a part is damaged, or belongs to another campaign.
        """
        return done(self.folder, self.record["plan_sha256"])

    def wanted(self) -> NDArray[np.int64]:
        """Return the numbers of this folder's missions: all, or those of its shard.

        With `until_ci` they are those that the targets need by the present results.
        """
        numbers = self.experiment.shard(*(self.record["shard"] or (1, 1)))
        targets = self.experiment.until_ci
        if not targets:
            return numbers
        metrics = [target.metric for target in targets]
        found = outcomes(self.folder, metrics, len(self.experiment.points))
        point, replicate = np.divmod(numbers, len(self.experiment.seeds))
        return numbers[replicate < np.array([n for n, _ in settled(self.plan, found)])[point]]

    def missing(self) -> NDArray[np.int64]:
        """Return the numbers of wanted missions that have no row yet, in the plan's order."""
        return np.setdiff1d(self.wanted(), self.done().numbers, assume_unique=True)

    def state(self) -> CampaignState:
        """Return the progress of the campaign."""
        rows, wanted = self.done(), self.wanted()
        failed = int(rows.failed.sum())
        status = "running" if is_locked(self.folder) else self.record["status"]
        if status == "running" and not is_locked(self.folder):
            status = "killed"
        return CampaignState(len(wanted), len(rows) - failed, failed, status, self._rate(len(rows)))

    def _rate(self, ran: int) -> float | None:
        """Return missions per second in this session, or None.

        Time counts from the first mission's begin, without the start of workers.
        """
        session = self.record["session"]
        if self.record["status"] != "running":
            return None
        written, parts = listed(self.folder)[MISSIONS], committed(self.folder)
        ends = {part: written[part].st_mtime for part in parts if part in written}
        ends = {part: at for part, at in ends.items() if at > session["began_at"]}
        if not ends:
            return None
        first = min(ends, key=ends.__getitem__)
        rows = read_part(self.folder, MISSIONS, first, ("wall_time_s",))
        assert rows is not None  # since the part is committed
        took = sum(seconds or 0.0 for seconds in rows["wall_time_s"].to_pylist())
        spent = max(ends.values()) - max(ends[first] - took, session["began_at"])
        since = ran - session["rows_before"]  # not above 0 if rows were lost meanwhile
        return since / spent if since > 0 and spent > 0 else None


def load_campaign(folder: str | Path) -> Campaign:
    """Read a campaign's folder, finished or not.

    Raises:
        CampaignError: when it is no campaign, is damaged, or lost rows after it was complete.
    """
    campaign = unfinished_campaign(folder)
    campaign.done()  # raises for a damaged part
    lost = len(campaign.missing()) if campaign.record["status"] == "complete" else 0
    if lost:
        raise CampaignError(
            f"{campaign.folder / MISSIONS} was complete and has lost the rows of {lost} of "
            f"{len(campaign.wanted())} missions; `bindusbl-des resume {campaign.folder}` runs them "
            "again"
        )
    return campaign


def unfinished_campaign(folder: str | Path) -> Campaign:
    """Read a campaign's folder, whichever rows it has.

    Raises:
        CampaignError: when it is no campaign, or is damaged.
    """
    folder = Path(folder)
    record = read_record(folder)
    campaign = Campaign(folder, None, record)
    plan = record["experiment"], record["own_parts"], record["model_version"]
    if fingerprint(*plan) != record["plan_sha256"]:  # edited, so that points may be invalid
        _ = campaign.plan
    return campaign


@contextmanager
def _read_of(folder: Path) -> Iterator[None]:
    """Raise CampaignError for a record that gives no plan."""
    try:
        yield
    except WRONG as error:
        raise damaged_record(folder, error) from None

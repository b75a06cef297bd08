"""What each published number becomes under a joint reading."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ..experiments import baseline, case_study, sweep
from ..experiments.measured import Measured, Reason, chosen, per_seed
from ..experiments.running import Runs
from ..published import Published
from ..verdicts import Limit, Prediction, predicted
from .crossing import ANGLE, SPEED
from .readings import SWEEPS, Reading

if TYPE_CHECKING:
    import pandas as pd

BASELINE, SWEEP = ("sec:baseline",), ("sec:sweep", "con")

SERVED = Reason(
    "E28",
    "errors depend on when an AUV is in range, and so on starts and turns that are never stated",
)
ACROSS = Reason("E7, E8", "the published errors are not those across the track")
LOSSES = Reason("E3", "the paper's loss law takes 7-15 % of the pings; 298.2 fixes lack 0.6 %")
LATE = Reason("E23", "an answer at the ping's end comes 10 ms later, before ticks round it up")
LOT = Reason("E26", "shares by lot differ from run to run")

Where = tuple[tuple[str, Any], ...]


@dataclass(frozen=True)
class Question:
    """Where a reading looks for a number: rows of a campaign's table, and what of them."""

    row: Published
    campaign: str
    where: Where
    column: str


class Foretelling:
    """The campaigns of joint readings, asked for numbers; what was asked before is remembered."""

    def __init__(self, runs: Runs) -> None:
        self._runs = runs
        self._frames: dict[tuple[str, Where], pd.DataFrame] = {}
        self._known: dict[Question, Prediction] = {}

    def measured(self, row: Published, reading: Reading) -> Measured:
        """Return a published number with what it becomes under a reading."""
        question = asked(row, reading)
        if question not in self._known:
            self._known[question] = self._answer(question)
        found, claim = self._known[question], sweep.claim_of(row)
        return Measured(
            row, reading.name, found, _reason(row, reading), (), claim, _limit(row, reading)
        )

    def _answer(self, question: Question) -> Prediction:
        row, rows = question.row, self._rows(question.campaign, question.where)
        if row.source in BASELINE:
            return predicted(baseline.values(row, rows), baseline.RUNS_OF_THE_PAPER)
        if row.source in SWEEP:
            return sweep.over_cells(row, rows, question.column)
        values = per_seed(rows, question.column, {"auv": row.auv})
        return predicted(values, case_study.RUNS_OF_THE_PAPER)

    def _rows(self, campaign: str, where: Where) -> "pd.DataFrame":
        if (campaign, where) not in self._frames:
            run = self._runs[campaign]
            table = run.missions if campaign in SWEEPS.values() else run.auvs
            self._frames[campaign, where] = chosen(table, dict(where))
        return self._frames[campaign, where]


def asked(row: Published, reading: Reading) -> Question:
    """Return where a reading looks for a number."""
    if row.source in BASELINE:
        return Question(row, "baseline", tuple(reading.baseline.items()), row.quantity)
    where = reading.missions
    if row.source in SWEEP:
        column = sweep.column_of(row, reading)
        return Question(row, SWEEPS[reading.sweep], tuple(where.items()), column)
    where[SPEED] = reading.speed_of(row.auv)
    column = reading.metric if row.quantity == "cte" else case_study.COLUMNS[row.quantity]
    if row.asvs == "2":
        where[ANGLE] = float(row.angle_deg)
        return Question(row, "two_asvs", tuple(where.items()), column)
    where["asvs.count"] = int(row.asvs)
    return Question(row, "table_1", tuple(where.items()), column)


def is_put_in(row: Published, reading: Reading) -> bool:
    """Tell whether a reading takes a number from the paper, so that it cannot explain it."""
    return row.quantity == "distance" and reading.speed == "published_speeds"


def _limit(row: Published, reading: Reading) -> Limit | None:
    if row.quantity == "cte" and reading.error == "cross_track":
        return case_study.across_track_limit()
    return sweep.limit_of(row)


def _reason(row: Published, reading: Reading) -> Reason:
    """Return why a number may differ under a reading."""
    if row.source in BASELINE:
        return _baseline_reason(row, reading)
    if row.quantity == "latency_max":
        return sweep.LATENCY
    if row.quantity.startswith("cte"):
        return ACROSS if reading.error == "cross_track" else SERVED
    return case_study.reason(row)


def _baseline_reason(row: Published, reading: Reading) -> Reason:
    if row.quantity.startswith("latency"):
        return LATE if reading.reply == "ping_end" else baseline.AIRTIME
    lossless = reading.baseline["acoustics.loss.combine"] == "off"
    if row.quantity == "fix_share":
        return baseline.LOT if lossless and reading.turns == "in_turn" else LOT
    return baseline.PINGS if lossless else LOSSES

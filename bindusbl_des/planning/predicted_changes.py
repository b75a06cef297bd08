"""What changes of a plan are predicted to do where none of them could be flown."""

from contextlib import suppress
from typing import TYPE_CHECKING

from ..advice.changes import changed, proposals
from ..results.effects import Foreseen
from ..scenario.planned import asv_stations
from ..scenario.scenario import Scenario
from .prediction.inputs import inputs_of
from .prediction.predicting import predict

if TYPE_CHECKING:
    from ..results.result import Result

# A reader compares a few, one of each kind; predictions are off by more than a smaller share.
MOST, WORTHWHILE = 5, 0.1


def foreseen(result: "Result") -> tuple[Foreseen, ...]:
    """Return what is predicted to lower the worst AUV's mean error, the best first.

    Nothing where the scenario cannot be predicted.
    """
    try:
        now = _error(result.scenario)
    except ValueError:
        return ()
    best: dict[str, Foreseen] = {}
    for change in proposals(result)[0]:
        with suppress(ValueError):  # it cannot be predicted
            scenario = changed(result.scenario, change.settings)
            assert scenario is not None  # as it was proposed
            then = _error(scenario)
            known = best.get(change.kind)
            if then < (1.0 - WORTHWHILE) * now and (known is None or then < known.then_m):
                best[change.kind] = Foreseen(change.words, change.lines, now, then)
    return tuple(sorted(best.values(), key=lambda it: it.then_m)[:MOST])


def _error(scenario: Scenario) -> float:
    return predict(inputs_of(scenario), asv_stations(scenario)).worst("position_error_m")

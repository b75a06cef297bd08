"""A plan as it was made, and its files: what was found, a scenario to run, a page."""

import json
from collections.abc import Mapping
from pathlib import Path
from shlex import quote
from typing import Any

from ..campaigns.campaign import Campaign, unfinished_campaign
from ..core.files import write_text
from ..scenario.families import leave_of
from ..scenario.planned import stations_kept
from ..scenario.scenario import Scenario
from .folder import BEST, MISSIONS, PAGE, PLAN, best_yaml, record
from .found import Found
from .plan_page import chart_of, plan_page
from .prediction.inputs import Inputs
from .telling import summary


class Plan:
    """A plan that was made: its `folder`, and the `record` that `plan.json` holds."""

    def __init__(self, folder: Path, record: Mapping[str, Any]) -> None:
        self.folder, self.record = folder, record

    def __repr__(self) -> str:
        answer = "no team" if self.answer is None else f"{self.answer['asvs.count']} ASVs"
        return f"<Plan {self.record['name']}: {answer}, in {self.folder}>"

    @property
    def answer(self) -> dict[str, Any] | None:
        """The keys and values of the least team; None where none is shown to keep to the goals."""
        answer: dict[str, Any] | None = self.record["answer"]
        return answer

    @property
    def scenario(self) -> Scenario | None:
        """The scenario of that team."""
        if self.answer is None:
            return None
        from ..scenario.files.scenario_file import load_scenario

        return load_scenario(self.folder / BEST)

    @property
    def campaign(self) -> Campaign:
        """The missions by which the team was chosen."""
        return unfinished_campaign(self.folder / MISSIONS)

    def summary(self) -> str:
        """Return what the command prints."""
        return summary(self.record, str(self.folder))


def written(found: Found, folder: Path) -> Plan:
    """Write the files of a plan, `plan.json` last; return the plan.

    Raises:
        OSError: when one cannot be written.
    """
    scenario = found.question.source or str(folder / MISSIONS / "scenario.yaml")
    team = found.team
    file, keys = (str(folder / BEST), team.scenario) if team else (scenario, found.question.base)
    run = f"bindusbl-des run {quote(file)}{leave_of(keys)}"
    told = {**record(found, run), "scenario": scenario}
    if found.team is None:
        (folder / BEST).unlink(missing_ok=True)
    else:
        write_text(folder / BEST, best_yaml(found.team.scenario, told["told"][0]))
    write_text(folder / PAGE, _page(found, told))
    text = json.dumps(told, indent=2, allow_nan=False, ensure_ascii=False)
    write_text(folder / PLAN, f"{text}\n")
    return Plan(folder, told)


def _page(found: Found, told: dict[str, Any]) -> str:
    base = found.question.base
    inputs = found.foresight.inputs(base)
    if inputs is None or not stations_kept(base):
        return plan_page(told)
    each: list[Inputs | None] = [found.foresight.inputs(it.scenario) for it in found.candidates]
    return plan_page(told, chart_of(base, inputs, each))

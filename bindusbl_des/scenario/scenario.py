"""The scenario of a mission: keys that agree with each other."""

import json
from html import escape
from typing import Any

from pydantic import ModelWrapValidatorHandler, ValidationError, model_validator
from pydantic_core import PydanticCustomError

from .consistency import problems
from .sections import ScenarioKeys


class Scenario(ScenarioKeys):
    """One mission of ASVs and AUVs: everything that decides it but the seed."""

    def __repr__(self) -> str:
        return (
            f"<Scenario {self.name}: {self.auvs.count} AUVs, {self.asvs.count} ASVs, "
            f"{self.survey.side_m:g} m, {self.duration_s:g} s>"
        )

    def _repr_html_(self) -> str:
        """Return what differs from the defaults, as notebooks show it."""
        given = json.dumps(self.model_dump(mode="json", exclude_defaults=True), indent=1)
        return f"<p>{escape(repr(self))}</p><pre>{escape(given)}</pre>"

    @model_validator(mode="wrap")
    @classmethod
    def _told_in_words(
        cls, data: Any, validate: ModelWrapValidatorHandler["Scenario"]
    ) -> "Scenario":
        try:
            return validate(data)
        except ValidationError as error:
            from .files.explanations import in_words  # which only mistakes need

            raise in_words(error, data) from None

    @model_validator(mode="after")
    def _consistent(self) -> "Scenario":
        found = problems(self)
        if found:
            text = "\n".join(f"{problem.key}: {problem.message}" for problem in found)
            raise PydanticCustomError("inconsistent", "{text}", {"text": text, "problems": found})
        return self

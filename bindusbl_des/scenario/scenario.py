"""The scenario of a mission: keys that agree with each other."""

from pydantic import model_validator
from pydantic_core import PydanticCustomError

from .consistency import problems
from .sections import ScenarioKeys


class Scenario(ScenarioKeys):
    """One mission of ASVs and AUVs: everything that decides it but the seed."""

    @model_validator(mode="after")
    def _consistent(self) -> "Scenario":
        found = problems(self)
        if found:
            text = "\n".join(f"{problem.key}: {problem.message}" for problem in found)
            raise PydanticCustomError("inconsistent", "{text}", {"text": text, "problems": found})
        return self

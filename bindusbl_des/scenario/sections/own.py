"""Placements and routes of somebody's own: sections whose other keys are the part's settings."""

from collections.abc import Mapping
from typing import Any, ClassVar, Literal

from pydantic import BaseModel, ConfigDict, model_serializer, model_validator

from ...core.plugins import is_plugin
from ..part_choice import PartChoice


class OwnSection(BaseModel):
    """A part named ``module:object`` at one of the section's keys, `WORD`; the others set it."""

    WORD: ClassVar[str]

    model_config = ConfigDict(frozen=True, extra="forbid")

    choice: PartChoice

    @model_validator(mode="before")
    @classmethod
    def _read(cls, data: Any) -> Any:
        if not isinstance(data, Mapping) or cls.WORD not in data:
            return data
        settings = {name: value for name, value in data.items() if name != cls.WORD}
        return {"choice": PartChoice.read({"model": data[cls.WORD], **settings}, str)}

    @model_serializer
    def _written(self) -> dict[str, Any]:
        return {self.WORD: str(self.choice), **self.choice.settings}

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: Any, handler: Any) -> dict[str, Any]:
        own = {"type": "string", "pattern": "^[^:]+:[^:]+$"}
        return {"type": "object", "properties": {cls.WORD: own}, "required": [cls.WORD]}


class OwnPlacement(OwnSection):
    """Where the ASVs keep station, as somebody's own function says."""

    WORD = "model"


class OwnRoute(OwnSection):
    """Where the AUVs go, as somebody's own function says."""

    WORD = "kind"
    kind: ClassVar[Literal["own"]] = "own"
    is_flown: ClassVar[bool] = False
    is_held: ClassVar[bool] = False
    is_recorded: ClassVar[bool] = False


def is_own(section: Any, word: str) -> bool:
    """Tell whether a section names somebody's own part at one of its words."""
    if isinstance(section, OwnSection):
        return True
    name = section.get(word) if isinstance(section, Mapping) else None
    return callable(name) or (isinstance(name, str) and is_plugin(name))

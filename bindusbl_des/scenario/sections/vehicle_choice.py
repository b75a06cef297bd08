"""Which vehicle model a scenario asks for, and which of its coefficients differ."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Self

from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from ...core.plugins import is_plugin
from ...core.wording import described, did_you_mean
from ..declared import ASVS, AUVS, HullTraits
from ..part_choice import PartChoice


@dataclass(frozen=True)
class VehicleChoice:
    """A vehicle model by name, and the coefficients that differ from its published ones.

    In a file it is the name, or a mapping: ``{model: remus100, yaw_time_constant_s: 5}``.  `part`
    is a vehicle with settings: one without dynamics, or somebody's own, named ``module:object``.
    """

    MODELS: ClassVar[Mapping[str, HullTraits]] = {}

    model: str
    coefficients: tuple[tuple[str, float], ...] = ()
    part: PartChoice | None = None

    def __str__(self) -> str:
        return self.model + ("*" if self.coefficients or (self.own and self.own.settings) else "")

    @property
    def own(self) -> PartChoice | None:
        """The vehicle where it is somebody's own."""
        return self.part if self.part is not None and is_plugin(self.part) else None

    @property
    def choice(self) -> PartChoice:
        """The vehicle as a part of the mission."""
        return self.part or PartChoice(self.model)

    @property
    def is_steered(self) -> bool:
        """Whether it goes as planned, but not exactly: by equations of motion, or somebody's."""
        return self.has_dynamics or self.own is not None

    @property
    def has_dynamics(self) -> bool:
        """Whether the vehicle moves by equations of motion."""
        return self.own is None and self.MODELS[self.model].has_dynamics

    @classmethod
    def read(cls, value: Any) -> Self:
        """Return the choice that a file's value stands for.

        Raises:
            PydanticCustomError: naming the rule, the value and the remedy.
        """
        if isinstance(value, cls):
            return value
        if _is_own(value):
            own = PartChoice.read(value, str)
            return cls(str(own), part=own)
        if isinstance(value, str):
            return cls(cls._known(value))
        if not isinstance(value, Mapping) or "model" not in value:
            raise _mistake(
                f"must be one of {', '.join(cls.MODELS)}, or a mapping with `model` and "
                f"coefficients; got {described(value)}"
            )
        model = cls._known(value["model"])
        changes = {str(name): number for name, number in value.items() if name != "model"}
        if not cls.MODELS[model].has_dynamics:  # and so no coefficients
            return cls(
                model, part=PartChoice.read({**value, "model": model}, str) if changes else None
            )
        for name, number in changes.items():
            others = [it for it, hull in cls.MODELS.items() if name in hull.settings.model_fields]
            if others:
                raise _mistake(
                    f"{name}: remove it, or choose {others[0]}, {model} has no such setting"
                )
            if isinstance(number, bool) or not isinstance(number, int | float):
                raise _mistake(f"{name} must be a number; got {described(number)}")
            if not math.isfinite(number):
                raise _mistake(f"{name} must be finite; got {described(number)}")
        if changes:
            from ...vehicles.hulls import parameters

            try:
                parameters(model, changes)
            except ValueError as error:
                raise _mistake(str(error)) from None
        return cls(model, tuple((name, float(number)) for name, number in changes.items()))

    @classmethod
    def _known(cls, name: Any) -> str:
        if name not in cls.MODELS:
            hint = did_you_mean(str(name), cls.MODELS)
            raise _mistake(f"must be one of {', '.join(cls.MODELS)}; got {described(name)}{hint}")
        return str(name)

    def plain(self) -> "str | dict[str, Any]":
        """Return the choice as it is written in a file."""
        if self.part is not None:
            return self.part.plain()
        return {"model": self.model, **dict(self.coefficients)} if self.coefficients else self.model

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: Any) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(
            cls.read,
            serialization=core_schema.plain_serializer_function_ser_schema(lambda v: v.plain()),
        )

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: Any) -> dict[str, Any]:
        names = {"enum": list(cls.MODELS), "type": "string"}
        mapping = {
            "type": "object",
            "properties": {"model": names},
            "required": ["model"],
            "additionalProperties": {"type": "number"},
        }
        own = {"type": "string", "pattern": "^[^:]+:[^:]+$"}
        mine = {"type": "object", "properties": {"model": own}, "required": ["model"]}
        return {"anyOf": [names, mapping, own, mine]}


class AuvVehicle(VehicleChoice):
    """The model of an underwater vehicle."""

    MODELS = AUVS


class AsvVehicle(VehicleChoice):
    """The model of a surface vessel."""

    MODELS = ASVS


def _is_own(value: Any) -> bool:
    name = value.get("model") if isinstance(value, Mapping) else value
    return callable(name) or (isinstance(name, str) and is_plugin(name))


def _mistake(text: str) -> PydanticCustomError:
    return PydanticCustomError("vehicle", "{text}", {"text": text})

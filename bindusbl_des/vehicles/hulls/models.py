"""The vehicles that the sea can hold: their names, states, commands, and what may be changed."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from math import isfinite
from numbers import Real
from typing import Any

from ...core.arrays import Floats
from ...core.wording import did_you_mean
from . import bluerov2, cybership2, otter, remus100, rk4

# A quantity so named is above zero: lags, masses, densities, sizes, and the limits of actuators.
_ABOVE_ZERO = (
    "_s", "mass_kg", "inertia_kg_m2", "_m3", "length_m", "diameter_m", "_rad", "_rpm", "_n",
    "oswald_efficiency", "reference_area_fraction", "advance_at_speed",
    "gravity_m_per_s2",
)  # fmt: skip


@dataclass(frozen=True)
class Model:
    """A kind of vehicle: how its equations are known to `rk4`, and what its rows hold.

    `states` and `commands` name the columns; `heading` and `velocity` are the places of yaw and of
    the body velocities over ground (u, v, and w where there is one) in a state. `body` is the
    frozen parameter set, `pack` turns one into the vector that the compiled equations read.
    """

    name: str
    equations: int
    states: tuple[str, ...]
    commands: tuple[str, ...]
    body: type[Any]
    pack: Callable[[Any], Floats]

    @property
    def heading(self) -> int:
        """Where yaw lies in a state."""
        return self.states.index("psi")

    @property
    def velocity(self) -> slice:
        """Where the body velocities over ground lie in a state."""
        return slice(
            self.states.index("u"), self.states.index("w" if "w" in self.states else "v") + 1
        )


def _remus100(name: str, equations: int) -> Model:
    remus = remus100
    return Model(name, equations, remus.STATE, remus.COMMAND, remus.Remus100, remus.pack)


MODELS: Mapping[str, Model] = {
    model.name: model
    for model in (
        _remus100("remus100", rk4.REMUS100),
        _remus100("remus100_pvs", rk4.REMUS100_PVS),
        Model("bluerov2", rk4.BLUEROV2, bluerov2.STATE, bluerov2.COMMAND,
              bluerov2.BlueRov2, bluerov2.pack),
        Model("otter", rk4.OTTER, otter.STATE, otter.COMMAND, otter.Otter, otter.pack),
        Model("cybership2", rk4.CYBERSHIP2, cybership2.STATE, cybership2.COMMAND,
              cybership2.CyberShip2, cybership2.pack),
    )
}  # fmt: skip


def find(model: str) -> Model:
    """Return the model of that name; ValueError, with the names there are, for an unknown one."""
    if model not in MODELS:
        known = ", ".join(MODELS)
        raise ValueError(
            f"unknown model {model!r}{did_you_mean(str(model), MODELS)}; known: {known}"
        )
    return MODELS[model]


def parameters(model: str, overrides: Mapping[str, float] | None = None) -> Any:
    """Return what a vehicle of a model is made of, its published numbers changed where asked.

    The result is the model's frozen dataclass (`Remus100`, `BlueRov2`, `Otter`, `CyberShip2`),
    units in its field names. Raises ValueError for a name the model does not have, a number that is
    not finite, and a size, mass or time constant that is not above zero.

    >>> parameters("remus100", {"yaw_time_constant_s": 5}).yaw_time_constant_s
    5.0
    """
    kind = find(model)
    allowed = [field.name for field in fields(kind.body)]
    values: dict[str, float] = {}
    for name, value in (overrides or {}).items():
        if name not in allowed:
            raise ValueError(
                f"{model}: unknown parameter {name!r}{did_you_mean(name, allowed)}; "
                f"allowed: {', '.join(allowed)}"
            )
        values[name] = _checked(model, name, value)
    return kind.body(**values)


def _checked(model: str, name: str, value: float) -> float:
    """Return the number as a float, or say what is wrong with it."""
    if not isinstance(value, Real) or isinstance(value, bool) or not isfinite(value):
        raise ValueError(f"{model}: parameter {name} must be a finite number, not {value!r}")
    if value <= 0 and name.endswith(_ABOVE_ZERO) and "added" not in name:
        raise ValueError(f"{model}: parameter {name} must be above zero, not {value!r}")
    return float(value)

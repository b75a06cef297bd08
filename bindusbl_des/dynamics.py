"""Hulls under the name that other programs know: :mod:`.core.vehicles.hulls`.

SI units and radians; North, East, Down; velocities over ground in body axes; yaw clockwise from
North.
"""

from .core.vehicles.hulls.fleet import (
    DivergenceError,
    Fleet,
    SteadyTurn,
    parameters,
    steady_speed,
    steady_turn,
    trajectory,
)
from .core.vehicles.hulls.forces import Model
from .core.vehicles.hulls.rk4 import MODELS

__all__ = [
    "MODELS",
    "DivergenceError",
    "Fleet",
    "Model",
    "SteadyTurn",
    "parameters",
    "steady_speed",
    "steady_turn",
    "trajectory",
]

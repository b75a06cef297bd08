"""Hulls under the name that other programs know: see :mod:`.vehicles.hulls`."""

from .vehicles.hulls import (
    MODELS,
    DivergenceError,
    Fleet,
    Model,
    SteadyTurn,
    parameters,
    steady_speed,
    steady_turn,
    trajectory,
)

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

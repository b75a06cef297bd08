"""Limits and angles, as every controller on board needs them."""

from math import floor, pi

from ...core.compiled import inlined


@inlined
def within(value: float, limit: float) -> float:
    """Return a command, or the limit (of either sign) that it exceeds."""
    return min(max(value, -limit), limit)


@inlined
def half_turn(angle: float) -> float:
    """Return the turn of at most half a circle (rad) that leads through an angle."""
    return angle - 2.0 * pi * floor(angle / (2.0 * pi) + 0.5)

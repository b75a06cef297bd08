"""What an export tells a viewer: messages with the instant and the topic they belong to."""

from collections.abc import Iterator
from typing import Any, NamedTuple

from foxglove.messages import Color, Timestamp

# The survey's frame as viewers see it: east, north, up from the centre of the surface.
MAP = "map"


class Message(NamedTuple):
    """One message: when (mission time, s), on which topic, and a Foxglove message or a row."""

    at_s: float
    topic: str
    content: Any


Messages = Iterator[Message]


def nanoseconds(at_s: float) -> int:
    """Return an instant of the mission in whole nanoseconds; the mission begins at 0.

    >>> nanoseconds(0.1 + 0.2)
    300000000
    """
    return round(at_s * 1e9)


def timestamp(at_s: float) -> Timestamp:
    """Return an instant of the mission as Foxglove writes it."""
    return Timestamp(*divmod(nanoseconds(at_s), 1_000_000_000))


def colour(code: str, opacity: float = 1.0) -> Color:
    """Return a colour such as "#0072B2" as Foxglove writes it."""
    red, green, blue = (int(code[at : at + 2], 16) / 255 for at in (1, 3, 5))
    return Color(r=red, g=green, b=blue, a=opacity)

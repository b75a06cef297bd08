"""Recorded missions through our navigators: logs, where they began, what noise was in them."""

from .fitting import fit
from .reading import read_log
from .replaying import replay

__all__ = ["fit", "read_log", "replay"]

"""Figures of results: drawn from their tables, in one style, for screens and papers."""

from .mission import save_mission_figure

__all__ = ["save_mission_figure"]

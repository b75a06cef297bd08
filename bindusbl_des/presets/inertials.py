"""Inertial systems as their sheets state them; figures are named as the keys of `navigation`."""

from .preset import Preset

INERTIALS: tuple[Preset, ...] = ()

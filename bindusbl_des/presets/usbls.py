"""USBL systems as their sheets state them; figures are named as the keys of `usbl`."""

from .preset import Preset

USBLS: tuple[Preset, ...] = ()

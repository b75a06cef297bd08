"""The channel of a band, as its scenario names it."""

from ..core.plugins import Family, is_plugin
from ..scenario.channel_settings import Curve
from ..scenario.part_settings import settings_of
from .channel import AskedChannel, own_channel
from .curve import curve_channel


def channel_named(family: Family, choice: str) -> AskedChannel | None:
    """Return the channel of a family by its name in the scenario; None for the compiled disc.

    Raises:
        PluginError: when one's own is not allowed, or cannot be loaded or called.
        ValueError: when the file of a curve is none.
    """
    if is_plugin(choice):
        return own_channel(family, choice)
    if choice == "disc":
        return None
    settings = settings_of(family, choice)
    assert isinstance(settings, Curve)
    return curve_channel(settings)

"""The channel `sonar`; its equations are :mod:`.sonar_equation` and :mod:`.sonar_channel`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..scenario.families import ChannelTraits
from .sound_settings import PingSonar, Sonar

if TYPE_CHECKING:
    from .asking import Asking
    from .channel import AskedChannel


@ChannelTraits(settings=PingSonar, frame_settings=Sonar, has_levels=True, has_echoes=True)
def sonar(asking: Asking, *, settings: Sonar) -> AskedChannel:
    """Return the channel of a band's sound, with echoes where a ping has some."""
    from .sonar_channel import echoing_sonar, sonar_channel
    from .sonar_equation import link_budget

    site, settings = asking.site, asking.as_sold(settings)
    budget = link_budget(settings, site.water)
    if isinstance(settings, PingSonar) and site.pings_echo:
        speed = site.sound_speed_m_per_s
        return echoing_sonar(settings, budget, asking.message, asking.range_m, speed)
    return sonar_channel(settings, budget, asking.message, asking.range_m)

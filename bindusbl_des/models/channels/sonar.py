"""The channel `sonar`; its equations are :mod:`...core.acoustics.sonar_equation` and
:mod:`...core.acoustics.sonar_channel`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...core.acoustics.sound_settings import PingSonar, Sonar
from ...core.scenario.families import ChannelTraits

if TYPE_CHECKING:
    from ...core.acoustics.asking import Asking
    from ...core.acoustics.channel import AskedChannel


@ChannelTraits(settings=PingSonar, frame_settings=Sonar, has_levels=True, has_echoes=True)
def sonar(asking: Asking, *, settings: Sonar) -> AskedChannel:
    """Return the channel of a band's sonar, with echoes where pings have them."""
    from ...core.acoustics.sonar_channel import echoing_sonar, sonar_channel
    from ...core.acoustics.sonar_equation import link_budget

    site, settings = asking.site, asking.as_sold(settings)
    budget = link_budget(settings, site.water)
    if isinstance(settings, PingSonar) and site.pings_echo:
        speed = site.sound_speed_m_per_s
        given = settings, budget, asking.message, asking.range_m, speed
        return echoing_sonar(*given, site.bottom)
    return sonar_channel(settings, budget, asking.message, asking.range_m)

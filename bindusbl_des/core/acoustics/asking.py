"""What a channel is made for."""

from typing import NamedTuple, TypeVar

from ...models.presets.catalogue import preset
from ..scenario.site import Site
from .sonar_equation import SoundMessage
from .sound_settings import Sound

# The settings of a channel that knows levels
Sounding = TypeVar("Sounding", bound=Sound)


def as_sold(settings: Sounding, modem: str | None) -> Sounding:
    """Let the figures of a band's modem stand for settings that are not given."""
    if modem is None:
        return settings
    values = preset("modem", modem).values
    names = (values.keys() & type(settings).model_fields) - settings.model_fields_set
    return settings.model_copy(update={name: values[name] for name in names})


class Asking(NamedTuple):
    """For what a channel is made: the site, a signal, the range (m) and the modem of its band."""

    site: Site
    message: SoundMessage
    range_m: float
    modem: str | None

    def as_sold(self, settings: Sounding) -> Sounding:
        """Let the figures of the modem stand for settings that are not given."""
        return as_sold(settings, self.modem)

"""What a channel is made from."""

from typing import NamedTuple, TypeVar

from ...models.presets.catalogue import preset
from ..scenario.site import Site
from .sonar_equation import SoundMessage
from .sound_settings import Sound

# Settings of a channel with levels
Sounding = TypeVar("Sounding", bound=Sound)


def as_sold(settings: Sounding, modem: str | None) -> Sounding:
    """Return settings in which the data sheet of a band's `modem` gives the figures that the
    scenario does not (None: the settings as they are).
    """
    if modem is None:
        return settings
    values = preset("modem", modem).values
    names = (values.keys() & type(settings).model_fields) - settings.model_fields_set
    return settings.model_copy(update={name: values[name] for name in names})


class Asking(NamedTuple):
    """What a channel is made from: the site, a signal, the range (m) and the modem of its band."""

    site: Site
    message: SoundMessage
    range_m: float
    modem: str | None

    def as_sold(self, settings: Sounding) -> Sounding:
        """Return settings in which figures of the modem replace those that are not given."""
        return as_sold(settings, self.modem)

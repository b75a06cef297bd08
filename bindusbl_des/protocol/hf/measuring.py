"""What pings are measured with: an instrument, errors that last, and the noise of each pair."""

from functools import cache, partial

import numpy as np

from ...core.handed import Handed
from ...core.streams import NoiseStore, Purpose, Streams
from ...records.recorder import Recorder
from ...usbl.instrument import NO_INSTRUMENT, NOISE_WIDTH
from ...usbl.own_instrument import OwnInstrument
from ...usbl.systematic.errors import OUTLIER_WIDTH, Astray, HandedErrors
from ...usbl.usbl import Usbl
from .reception import Noise


class Measuring:
    """Who measures the pings of a band, with what noise, and what is wrong all the time.

    `own` is an instrument of somebody's own, which measures in Python what compiled code has
    decided, with a `draw` for each AUV; None where one that ships does.
    """

    def __init__(
        self,
        instrument: Usbl | Astray | OwnInstrument,
        streams: Streams,
        auvs: int,
        asvs: int,
        record: Recorder,
    ) -> None:
        """Measure pings between so many AUVs and ASVs, and write fixes to a record."""
        self._record, self._errors, outliers = record, None, 0
        if isinstance(instrument, Astray):
            (instrument, lasting), outliers = instrument, OUTLIER_WIDTH
            levers = record.levers
            self._errors = Handed(HandedErrors(*lasting, levers.of, levers.left))
            levers.hand_on(self._errors)
        self.noise = NoiseStore(streams, auvs, asvs, NOISE_WIDTH + 1, outliers)
        self.own = instrument if isinstance(instrument, OwnInstrument) else None
        self.draw = cache(partial(streams.of, Purpose.INSTRUMENT))
        self.instrument, has_sheet = NO_INSTRUMENT, None
        if isinstance(instrument, Usbl):
            self.instrument, has_sheet = instrument.handed, instrument.has_sheet
        #: What compiled code is made for: whether there is a data sheet, and errors that last, by
        #: their address; None where there are none.
        self.made_for = has_sheet, None if self._errors is None else self._errors.address

    def make_room(self, fixes: int) -> None:
        """Have room for so many further fixes."""
        room = self._record.fixes.room_for(fixes)
        if self._errors is not None:
            self._record.levers.make_room(len(room))

    def hand_on(self, to: Handed) -> None:
        """Keep the field `noise` of what compiled code is handed what the noise is."""
        self.noise.on_grown = lambda store: to.renew("noise", noise_of(store))


def noise_of(store: NoiseStore) -> Noise:
    """Return noise as compiled code takes it."""
    asvs, width = store.shelf.shape[1], store.blocks.shape[2]
    return Noise(store.shelf, store.taken, store.blocks, np.zeros((asvs, width)))

"""Where the surface fleet believes all vehicles to be, and so who is within reach of whom."""

from ..acoustics.propagation import Band
from ..records.recorder import EventBuffer
from ..vehicles.fleet import Fleet
from ..vehicles.motion import places
from .chart import Chart
from .conflicts import Array, Hearing, Survey, Surveyed, hearing


class Lookout:
    """What the fleet sees of its AUVs: where they are, or where a chart has them by their fixes."""

    def __init__(
        self,
        auvs: Fleet,
        asvs: Fleet,
        band: Band,
        margin: float,
        chart: Chart | None,
        fixes: EventBuffer,
    ) -> None:
        """Look out for who is heard: within the reach of the HF band and a margin (m) of an ASV."""
        self._auvs, self._asvs, self._slant = auvs, asvs, band.slant
        self._reach = band.reach + margin
        self._survey = Survey(Surveyed(auvs.motion, asvs.motion, self._reach, band.slant))
        self._chart, self._fixes, self._plotted = chart, fixes, 0

    def seen(self, time: float) -> tuple[Array, Array, Hearing]:
        """Return where AUVs and ASVs are believed to be at an instant (s), (n, 3) and (m, 3) in m,
        and which AUVs each ASV that works is believed to hear, (n, m).
        """
        self._asvs.advance(time)
        if self._chart is None:
            self._auvs.advance(time)
            auvs, asvs, heard = self._survey.at(time)
        else:
            self._chart.note(self._fixes.rows[self._plotted :])
            self._plotted = self._fixes.count
            auvs = self._chart.at(time)
            asvs = places(self._asvs.motion, time)[:, :3]
            heard = hearing(auvs, asvs, self._reach, self._slant)
        if failed := self._asvs.failed(time):
            heard[:, failed] = False
        return auvs, asvs, heard

    def within(self, reach: float, time: float) -> Hearing:
        """Return which AUVs are believed within a horizontal reach (m) of each ASV, (n, m)."""
        auvs, asvs, _ = self.seen(time)
        return hearing(auvs, asvs, reach, slant=False)

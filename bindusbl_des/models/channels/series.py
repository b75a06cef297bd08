"""The channel `series`: the decoding chance, or level, of each link as measured over time."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ...core.scenario.families import ChannelTraits, Lossy
from ...core.scenario.key_types import Real, Text, key
from ...core.scenario.measured import read_series

if TYPE_CHECKING:
    from ...core.acoustics.asking import Asking
    from ...core.acoustics.channel import Prospects, Receiver, Signals
    from ...support.arrays import Floats


class Series(Lossy):
    """Settings of the channel `series`: a file of measurements of each link over time."""

    file: Text = key(
        ...,
        "",
        "CSV with columns time_s, from, to (AUV0, ASV1, ...) and chance or level_db; relative to "
        "the scenario file",
    )
    threshold_db: Real | None = key(
        None,
        "dB",
        "level at which half of all signals are decoded, of a file with levels",
        ge=-300,
        le=300,
    )
    shadowing_sd_db: Real = key(
        0.0, "dB", "standard deviation of a signal's level around the file's", ge=0, le=40
    )
    noise_db: Real = key(
        0.0, "dB", "level of the noise in the band, to turn levels into SNRs", ge=-300, le=300
    )


@dataclass(frozen=True)
class SeriesChannel:
    """Channel by measurements of each link: a value holds until the next, the first also before.

    A link with one direction in the file has it both ways; a link without any hears nothing.
    `links` have instants and values of (sender, listener), AUVs by their numbers from 0, ASVs from
    -1 downwards.  Levels are for a receiver with a threshold.
    """

    links: Mapping[tuple[int, int], tuple[Floats, Floats]]
    has_levels: bool
    receiver: Receiver
    audible_m: float | None = None

    def prospects(self, signals: Signals) -> Prospects:
        """Return the answer about each signal between numbered vehicles.

        Raises:
            ValueError: when the vehicles have no numbers.
        """
        import numpy as np

        from ...core.acoustics.channel import SELDOM
        from ...core.acoustics.propagation import PROSPECT

        if signals.auv_numbers is None or signals.asv_numbers is None:
            raise ValueError("what was measured of links tells of no places, but of vehicles alone")
        found = np.full(signals.ranges.shape, np.nan)
        for row, auv in enumerate(signals.auv_numbers.tolist()):
            for column, asv in enumerate(signals.asv_numbers.tolist()):
                ends = auv, -1 - asv
                link = ends[::-1] if signals.calling else ends
                found[row, column] = self._at(signals.time, *link)
        out, deaf = np.zeros(found.shape, PROSPECT), np.isnan(found)
        out["snr_db"], out["late_s"] = math.nan, 0.0
        out["loss"], out["sound"] = (
            np.where(deaf, 1.0, 1.0 - found),
            np.where(found > 0.0, 1.0, 0.0),
        )
        if self.has_levels:
            receiver = self.receiver
            snr = np.where(deaf, -math.inf, found - receiver.noise_db)
            chance = normal_chance(snr - receiver.threshold_db, receiver.shadowing_sd_db)
            out["loss"], out["snr_db"] = 1.0 - chance, np.where(deaf, math.nan, snr)
            out["sound"] = np.where(chance > SELDOM, 10.0 ** (np.where(deaf, 0.0, snr) / 10.0), 0.0)
        out["loss"][out["loss"] > 1.0 - SELDOM] = 1.0
        return out

    def _at(self, time: float, sender: int, listener: int) -> float:
        """Return a link's value at an instant (s); NaN if it was not measured."""
        link = self.links.get((sender, listener)) or self.links.get((listener, sender))
        if link is None:
            return math.nan
        return float(link[1][max(int(link[0].searchsorted(time, side="right")) - 1, 0)])


def normal_chance(margin_db: Floats, sd: float) -> Floats:
    """Return the probability that a level with a margin (dB) above its threshold stays above it,
    with a standard deviation `sd` (dB).

    >>> import numpy as np
    >>> normal_chance(np.array([-1.0, 0.0, 3.0]), 0.0), normal_chance(np.array([3.0]), 3.0).round(4)
    (array([0., 1., 1.]), array([0.8413]))
    """
    import numpy as np

    from ...core.acoustics.sonar_equation import normal_cdf

    if sd == 0.0:
        return np.where(margin_db >= 0.0, 1.0, 0.0)
    return normal_cdf(margin_db / sd)


@ChannelTraits(settings=Series, frame_settings=Series, reach_of_its_own=True, by_link=True)
def series(asking: Asking, *, settings: Series) -> SeriesChannel:
    """Return the channel of measured links in a file.

    Raises:
        ValueError: naming file, line and remedy, when it is not such a file, or names an unknown
            vehicle.
    """
    import numpy as np

    from ...core.acoustics.channel import PLAIN, Receiver

    scenario, measured = asking.site.scenario, read_series(settings.file)
    auvs, asvs = scenario.auvs.count, scenario.asvs.count
    if measured.has_levels and settings.threshold_db is None:
        raise ValueError(
            f"{settings.file} has levels, of which nobody says which are decoded; give threshold_db"
        )
    found: dict[tuple[int, int], list[tuple[float, float]]] = {}
    for row in measured.rows:
        ends = []
        for column, name in (("from", row.sender), ("to", row.listener)):
            kind, number, count = name[:3], int(name[3:]), auvs if name[:3] == "AUV" else asvs
            if number >= count:
                raise ValueError(
                    f"{row.where}: {column} is {name!r}, and the mission has {count} {kind}s, "
                    f"{kind}0 to {kind}{count - 1}; leave the line out, or add vehicles"
                )
            ends.append(number if kind == "AUV" else -1 - number)
        found.setdefault((ends[0], ends[1]), []).append((row.time, row.value))
    links = {link: (np.array(rows)[:, 0], np.array(rows)[:, 1]) for link, rows in found.items()}
    if not measured.has_levels:
        return SeriesChannel(links, False, PLAIN)
    threshold = (settings.threshold_db or 0.0) - settings.noise_db
    receiver = Receiver(math.inf, settings.shadowing_sd_db, settings.noise_db, threshold)
    return SeriesChannel(links, True, receiver)

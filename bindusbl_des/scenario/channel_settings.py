"""The settings of the channels that ship, and the curves of delivery over range that files have."""

import math
import re
from functools import partial
from itertools import pairwise
from typing import Literal, NamedTuple

from pydantic import model_validator

from ..core.tables import TableRow, of_file, read_table, sifted
from .families import ChannelTraits, Lossy
from .key_types import Real, Text, key
from .part_choice import PartChoice


class Disc(Lossy):
    """The settings of the channel `disc`."""


class Curve(Lossy):
    """The settings of the channel `curve`."""

    file: Text = key(
        ...,
        "",
        "CSV with columns range_m (slant) and delivery_ratio; relative to the scenario file",
    )
    interference_m: Real | None = key(
        None,
        "m",
        "how far signals drown others that they overlap; null = to the last range of the file",
        ge=0,
        le=1e6,
    )


class Series(Lossy):
    """The settings of the channel `series`: what was measured of each link over time."""

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
        0.0, "dB", "standard deviation of a signal's level about that of the file", ge=0, le=40
    )
    noise_db: Real = key(
        0.0, "dB", "level of the noise in the band, above which levels are SNRs", ge=-300, le=300
    )


class Sound(Lossy):
    """The settings of channels with levels: a band's sound, what absorbs it, noise and decoding.

    Levels are in dB re 1 uPa, those of sources at 1 m.
    """

    frequency_khz: Real = key(25.0, "kHz", "centre frequency of the band", ge=0.1, le=1000)
    bandwidth_khz: Real = key(10.0, "kHz", "bandwidth B of the band", ge=1e-3, le=1000)
    source_level_db: Real = key(180.0, "dB", "source level SL re 1 uPa at 1 m", ge=0, le=250)
    directivity_index_db: Real = key(0.0, "dB", "directivity index DI of receivers", ge=0, le=60)
    absorption: Literal["francois_garrison", "ainslie_mccolm", "thorp"] = key(
        "francois_garrison", "", "law of absorption; thorp knows neither water nor pH"
    )
    ph: Real = key(8.1, "1", "acidity of the water, for absorption", ge=7, le=9)
    wind_m_per_s: Real = key(5.0, "m/s", "wind, whose waves make noise", ge=0, le=50)
    shipping: Real = key(0.5, "1", "distant ships' noise, none to heavy", ge=0, le=1)
    own_noise_db: Real | None = key(
        None, "dB", "noise of a receiver's own vehicle re 1 uPa2/Hz; null = none", ge=-50, le=200
    )
    decoding: Literal[
        "threshold", "non_coherent", "coherent", "rayleigh", "bpsk", "dpsk", "nc_fsk"
    ] = key(
        "threshold",
        "",
        "what decodes: a threshold of SNR; a matched filter (coherent or not, or in a Rayleigh "
        "channel); the bits of a frame, which must all be right",
    )
    snr_threshold_db: Real | None = key(
        None,
        "dB",
        "SNR at which the decoding `threshold` succeeds; null = that at the band's range",
        ge=-60,
        le=120,
    )
    false_alarm: Real = key(
        1e-4, "1", "false-alarm probability of a matched filter", ge=1e-15, le=0.5
    )
    shadowing_sd_db: Real = key(
        3.0, "dB", "standard deviation of the SNR (log-normal shadowing)", ge=0, le=40
    )
    interference_db: Real = key(
        10.0,
        "dB",
        "how far below the SNR that half of all signals are decoded at others still drown them",
        ge=0,
        le=120,
    )
    capture_db: Real | None = key(
        None,
        "dB",
        "ratio to the noise and all that overlaps it from which a signal survives; null = never",
        ge=-30,
        le=60,
    )

    @model_validator(mode="after")
    def _one_way_of_decoding(self) -> "Sound":
        """Refuse what the decoding that was chosen does not know."""
        if self.snr_threshold_db is not None and self.decoding != "threshold":
            raise ValueError(
                f"snr_threshold_db belongs to decoding threshold, not {self.decoding}; remove one"
            )
        if self.bandwidth_khz > 2.0 * self.frequency_khz:
            raise ValueError(
                f"bandwidth_khz {self.bandwidth_khz:g} reaches below 0 Hz around frequency_khz "
                f"{self.frequency_khz:g}; make it at most twice the frequency"
            )
        return self


class Sonar(Sound):
    """The settings of the channel `sonar`: sound spreads by a law."""

    spreading: Real = key(
        2.0, "1", "spreading k of 10 k lg r: 2 spherical, 1.5 practical, 1 cylindrical", ge=1, le=3
    )


class Table(Sound):
    """The settings of the channel `table`: sound goes along bent rays, by a table of its loss."""

    rays: Text | None = key(
        None,
        "",
        "CSV or Parquet of range_m, source_depth_m, receiver_depth_m, travel_time_s, loss_db; null "
        "= traced by BELLHOP (package pelagic)",
    )
    bottom_m: Real = key(30.0, "m", "depth of the sea in which rays are traced", ge=1, le=12_000)

    @model_validator(mode="after")
    def _traced_once(self) -> "Table":
        """Refuse a depth to trace in where rays are given."""
        if self.rays is not None and "bottom_m" in self.model_fields_set:
            raise ValueError("bottom_m is for rays that are traced; remove it, or rays")
        return self


class _OfPings(Sound):
    """Sound that carries no bits."""

    decoding: Literal["threshold", "non_coherent", "coherent", "rayleigh"] = key(
        "threshold",
        "",
        "what decodes: a threshold of SNR; a matched filter, coherent or not, or in a Rayleigh "
        "channel",
    )
    timing: Literal["constant", "envelope", "carrier"] = key(
        "constant",
        "",
        "what an array's time differences lose as SNR falls: nothing, or as arrivals are timed by "
        "the envelope, or by the carrier as well",
    )


class PingSonar(_OfPings, Sonar):
    """The settings of the channel `sonar` of pings."""

    bottom_m: Real | None = key(
        None, "m", "depth of a flat sea that echoes pings; null = no echoes", ge=1, le=12_000
    )
    surface_sd_m: Real = key(
        0.0, "m", "standard deviation of the surface's height, for its echoes", ge=0, le=20
    )
    transducer_m: Real = key(
        0.5, "m", "depth at which ASVs carry their transducers, for echoes", ge=0.01, le=100
    )

    @model_validator(mode="after")
    def _echoes_of_a_bottom(self) -> "PingSonar":
        """Refuse what only echoes depend on where there are none, and what lies below the sea."""
        given = self.model_fields_set & {"surface_sd_m", "transducer_m"}
        if self.bottom_m is None and given:
            raise ValueError(
                f"{' and '.join(sorted(given))} matter for echoes; add bottom_m, or remove them"
            )
        if self.bottom_m is not None and self.transducer_m >= self.bottom_m:
            raise ValueError(
                f"transducer_m {self.transducer_m:g} lies on the bottom at {self.bottom_m:g} m or "
                "below it; make it less"
            )
        return self


class PingTable(_OfPings, Table):
    """The settings of the channel `table` of pings."""


def burst_s(channel: PartChoice) -> float | None:
    """Return how long (s) signals are lost on a band with a channel, on average; None where each is
    lost by itself.
    """
    given: float | None = channel.settings.get("burst_s")
    return given


# What a file with a curve has, and what a line of it looks like
COLUMNS = ("range_m", "delivery_ratio")
EXAMPLE = "such as `50,0.95`"


class DeliveryCurve(NamedTuple):
    """Ranges (n,), m, which increase, delivery ratios (n,), and what is to be said of rows that do
    not count.
    """

    ranges_m: tuple[float, ...]
    ratios: tuple[float, ...]
    left_out: tuple[str, ...] = ()


@of_file(16)
def read_curve(path: str) -> DeliveryCurve:
    """Return the curve in a CSV file.

    Its header line has the columns range_m and delivery_ratio, in any order and among others; the
    ranges increase, and the ratios lie in [0, 1].

    Raises:
        ValueError: naming file, line, value and remedy, when the file is not such a curve.
    """
    table = read_table(path)
    missing = [name for name in COLUMNS if name not in table.names]
    if missing:
        raise ValueError(
            f"{path}:1: column {', '.join(missing)} missing; the header needs {', '.join(COLUMNS)}"
        )
    points, unread = sifted(table.rows(), _point)
    if not points:
        raise ValueError(f"{path}: has no points; a curve needs at least one line {EXAMPLE}")
    for (_, before, _), (where, away, _) in pairwise(points):
        if away <= before:
            raise ValueError(
                f"{where}: range_m is {away:g} after {before:g}; sort the lines by range, each "
                "range once (is there a curve of another modem in the file?)"
            )
    _, ranges, ratios = zip(*points, strict=True)
    return DeliveryCurve(ranges, ratios, (*table.left_out, *unread))


def _point(row: TableRow) -> tuple[str, float, float]:
    """Return where a row stands, its range (m) and its delivery ratio."""
    values = []
    for name in COLUMNS:
        try:
            values.append(float(row.cells[name]))
        except ValueError:
            raise ValueError(
                f"{row.where}: {name} is {row.cells[name]!r}; give a number, {EXAMPLE}"
            ) from None
    away, ratio = values
    if not 0.0 <= away < math.inf:
        raise ValueError(f"{row.where}: range_m is {away:g}; give metres from 0 on")
    if not 0.0 <= ratio <= 1.0:
        remedy = "divide per cent by 100" if 1.0 < ratio <= 100.0 else "give a share of 1"
        raise ValueError(f"{row.where}: delivery_ratio is {ratio:g}, not within 0 and 1; {remedy}")
    return row.where, away, ratio


# What a file with links has beside what was measured, and a vehicle's name
LINK = ("time_s", "from", "to")
MEASURED = ("chance", "level_db")
VEHICLE = re.compile(r"(AUV|ASV)(\d{1,6})")
LINKS_EXAMPLE = "such as `0,AUV0,ASV1,0.9`"


class LinkRow(NamedTuple):
    """Where a row stands (file:line), its instant (s), who sends and who listens, the value."""

    where: str
    time: float
    sender: str
    listener: str
    value: float


class LinkSeries(NamedTuple):
    """Rows of links, those of each by rising instants; whether their values are levels (dB), not
    chances; and what is to be said of rows that do not count.
    """

    rows: tuple[LinkRow, ...]
    has_levels: bool
    left_out: tuple[str, ...] = ()


@of_file(16)
def read_series(path: str) -> LinkSeries:
    """Return the measured time series of links in a CSV file.

    Its header line has the columns time_s, from and to, and either chance, in [0, 1], or level_db;
    instants of one link rise.

    Raises:
        ValueError: naming file, line, column, value and remedy, when it is none.
    """
    table = read_table(path)
    missing = [name for name in LINK if name not in table.names]
    measured = [name for name in MEASURED if name in table.names]
    if missing or len(measured) != 1:
        lacks = (
            f"column {', '.join(missing)} missing"
            if missing
            else (
                "has both chance and level_db" if measured else "column chance or level_db missing"
            )
        )
        raise ValueError(
            f"{path}:1: {lacks}; the header needs time_s, from, to and one of chance, level_db"
        )
    [value] = measured
    rows, unread = sifted(table.rows(), partial(_link, value))
    if not rows:
        raise ValueError(f"{path}: has no rows; give at least one {LINKS_EXAMPLE}")
    last: dict[tuple[str, str], float] = {}
    for row in rows:
        link = row.sender, row.listener
        if row.time <= last.get(link, -math.inf):
            raise ValueError(
                f"{row.where}: time_s is {row.time:g} after {last[link]:g} of the same link; sort "
                "the lines of each link by time, each instant once"
            )
        last[link] = row.time
    return LinkSeries(tuple(rows), value == "level_db", (*table.left_out, *unread))


def _link(column: str, row: TableRow) -> LinkRow:
    """Return a row of links, with what was measured in a column."""
    numbers = []
    for name in ("time_s", column):
        text = row.cells[name]
        try:
            numbers.append(float(text))
        except ValueError:
            numbers.append(math.nan)
        if not math.isfinite(numbers[-1]):
            raise ValueError(f"{row.where}: {name} is {text!r}; give a number, {LINKS_EXAMPLE}")
    for name in ("from", "to"):
        if VEHICLE.fullmatch(row.cells[name].strip()) is None:
            raise ValueError(
                f"{row.where}: {name} is {row.cells[name]!r}; name a vehicle, AUV0 or ASV1"
            )
    time, value = numbers
    sender, listener = row.cells["from"].strip(), row.cells["to"].strip()
    if sender == listener:
        raise ValueError(f"{row.where}: to is {listener!r}, as from is; name another vehicle")
    if column == "chance" and not 0.0 <= value <= 1.0:
        remedy = "divide per cent by 100" if 1.0 < value <= 100.0 else "give a share of 1"
        raise ValueError(f"{row.where}: chance is {value:g}, not within 0 and 1; {remedy}")
    return LinkRow(row.where, time, sender, listener, value)


def read_measured(path: str) -> DeliveryCurve | LinkSeries:
    """Return what a channel's file has: links over time, or a curve over ranges.

    Raises:
        ValueError: as of :func:`read_series` and :func:`read_curve`.
    """
    names = read_table(path).names
    return read_series(path) if {*LINK[1:], *MEASURED} & {*names} else read_curve(path)


DISC = ChannelTraits(settings=Disc, frame_settings=Disc, ends_at_range=True, keeps_frames=True)
CURVE = ChannelTraits(settings=Curve, frame_settings=Curve, reach_of_its_own=True)
SONAR = ChannelTraits(settings=PingSonar, frame_settings=Sonar, has_levels=True, has_echoes=True)
TABLE = ChannelTraits(settings=PingTable, frame_settings=Table, has_levels=True, traces_rays=True)
SERIES = ChannelTraits(settings=Series, frame_settings=Series, reach_of_its_own=True, by_link=True)

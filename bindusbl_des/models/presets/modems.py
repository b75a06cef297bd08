"""Acoustic modems: airtimes, ranges, payloads and powers.

Figures are named as the keys of `acoustics.mf` and `acoustics.hf`, and as the settings of the
channel `sonar`.  Powers are electrical.  A bit rate's `overhead` says whether it is the user's (1)
or the line's, and how that is known.  If a sheet states a band, `frequency_khz` is its middle and
`bandwidth_khz` its width.  Measured airtimes have a row for each payload.
"""

from dataclasses import dataclass, field
from itertools import pairwise
from math import isfinite
from pathlib import Path
from typing import NoReturn

from ...support.tables import TableRow, of_file, read_table, sifted
from .preset import Figure, Preset

COLUMNS = ("payload_bytes", "airtime_s", "processing_delay_mean_s")


def table_file(name: str) -> str:
    """Return the path of a table that ships."""
    return str(Path(__file__).with_name(name))


# The largest payload of a table (B), as of `acoustics.mf.payload_bytes`
MOST_BYTES = 65_535


@dataclass(frozen=True)
class AirtimeTable:
    """Airtimes of messages of 1, 2, ... bytes, and how much later a modem delivers them.

    Both are tuples of s, the first for one byte.  Both are linear between measured payloads; below
    the smallest (S2C: delays below 20 B) its value holds, beyond the last delay that one.  A table
    without delays has 0.
    """

    airtimes_s: tuple[float, ...]
    delays_s: tuple[float, ...]
    #: Messages about rows that were left out.
    left_out: tuple[str, ...] = field(default=(), compare=False)

    @property
    def most_bytes(self) -> int:
        """The largest payload of the table."""
        return len(self.airtimes_s)

    def airtime(self, payload_bytes: int) -> float:
        """Return the airtime (s) of a message.

        >>> airtime_table(table_file("s2c_airtimes.csv")).airtime(56)
        0.770201
        """
        return self.airtimes_s[payload_bytes - 1]

    def delay(self, payload_bytes: int) -> float:
        """Return how long (s) after its end a message is delivered.

        >>> table = airtime_table(table_file("s2c_airtimes.csv"))
        >>> table.delay(1), table.delay(20), table.delay(21)
        (0.088179, 0.088179, 0.088342)
        """
        return self.delays_s[payload_bytes - 1]


@of_file(16)
def airtime_table(file: str) -> AirtimeTable:
    """Return the table in a CSV file.

    Its columns are `payload_bytes`, which rise, `airtime_s` and, optionally,
    `processing_delay_mean_s`, whose cells may be empty.

    Raises:
        ValueError: when there is no such file, or a line of it is wrong.
    """
    table = read_table(file)
    if not {*COLUMNS[:2]} <= {*table.names}:
        _refuse(f"{file}:1", f"has no columns {' and '.join(COLUMNS[:2])}")
    rows, unread = sifted(table.rows(), _measured)
    if not rows:
        _refuse(f"{file}:2", "is the first of the table, and there is none")
    for (_, before, _, _), (where, size, _, _) in pairwise(rows):
        if size <= before:
            _refuse_size(where, str(size), before + 1)
    airtimes = {size: airtime for _, size, airtime, _ in rows}
    delays = {size: delay for _, size, _, delay in rows if delay is not None}
    most = max(airtimes)
    told = (*table.left_out, *unread)
    return AirtimeTable(_each(most, airtimes), _each(most, delays or {1: 0.0}), told)


def _measured(row: TableRow) -> tuple[str, int, float, float | None]:
    """Return a row's place, its payload (B), airtime (s) and delay (s), if it has one."""
    size = _number(row.cells[COLUMNS[0]])
    if not (size == int(size) and 0 < size <= MOST_BYTES):
        _refuse_size(row.where, row.cells[COLUMNS[0]], 1)
    has_delay = row.cells.get(COLUMNS[2], "").strip()
    delay = _seconds(row, COLUMNS[2]) if has_delay else None
    return row.where, int(size), _seconds(row, COLUMNS[1]), delay


def _each(most: int, measured: dict[int, float]) -> tuple[float, ...]:
    """Return values for 1, 2, ... `most` bytes, interpolated between measured ones."""
    import numpy as np  # which scenarios without such tables do not wait for

    sizes = np.arange(1, most + 1)
    return tuple(np.interp(sizes, [*measured], [*measured.values()]).tolist())


def _number(text: str) -> float:
    """Return a text as a finite number, or -1."""
    try:
        value = float(text)
    except ValueError:
        return -1.0
    return value if isfinite(value) else -1.0


def _seconds(row: TableRow, column: str) -> float:
    value = _number(row.cells[column])
    if not 0.0 <= value <= 1e4:
        _refuse(row.where, f"has the {column} {row.cells[column]!r}, which is no time in s")
    return value


def _refuse_size(where: str, size: str, least: int) -> NoReturn:
    told = f"is for {size!r} bytes; these are whole numbers that rise"
    _refuse(where, f"{told}, here from {least} to at most {MOST_BYTES}")


def _refuse(where: str, what: str) -> NoReturn:
    raise ValueError(f"{where}: a line of a table of airtimes that {what}")


DESERT = (
    "github.com/signetlabdei/DESERT_Underwater, dbs/evologics_LUT/txduration_s2c_LUT.csv; how it "
    "was recorded is not stated there"
)
RESELLERS = "figures of the data sheet as repeated by others"
DCCOMMS = f"{RESELLERS} (github.com/dcentelles/dccomms_utils)"
LECOM = (
    "E. Pinto, LECOM, UFMG, simulation of acoustic and optical modems, which cites "
    "EvoLogics_S2CR_1834_Product_Information.pdf"
)
WATER_LINKED_DOCS = "Water Linked, documentation (github.com/waterlinked/docs)"
MICRO_RANGER = "Sonardyne's figures of Micro-Ranger 2 as repeated by others"
AS_SIMULATED = "as set by others who simulate it"
OF_THE_BAND = "of the band that is stated"
SEATRAC = "Blueprint Subsea's figures as repeated by others"
SEATRAC_COMMANDS = (
    "Blueprint Subsea, SeaTrac Serial Command Interface Reference UM-140-D00221-02, 8.3.1 "
    "CID_DAT_SEND: 80 ms for each byte of data"
)
NOT_SAID = "whether it is the user's or the line's is not said; taken for the user's"
SONARDYNE_WIDEBAND = "Sonardyne, 6G Wideband 2"
SONARDYNE_MODEM = (
    "https://www.sonardyne.com/products-knowledge-base/what-data-rates-should-i-expect-from-modem-6"
)
WATER_LINKED = "https://waterlinked.com/underwater-communication"
WHOI = "http://acomms.whoi.edu/micro-modem"
AHOI = "ahoi modem (TUHH), as set in its simulation"
UWAVE = "UC&NL, uWAVE underwater acoustic modem specifications (github.com/ucnl/ucnl.github.io)"
NANOMODEM = (
    "https://research.ncl.ac.uk/usmart/newsevents/october2018v3modemsreadyforfieldtesting.html"
)

MODEMS = (
    Preset(
        "s2c_instant",
        "EvoLogics S2C, instant messages",
        {
            "airtimes": Figure("s2c_airtimes.csv", "", "S", DESERT),
            "payload_bytes": Figure(64, "B", "S", f"{DESERT}: it ends at 64 B"),
        },
    ),
    Preset(
        "s2cr_18_34",
        "EvoLogics S2CR 18/34",
        {
            "range_m": Figure(3500.0, "m", "2", DCCOMMS),
            "bit_rate_bps": Figure(13900.0, "bit/s", "2", f"{DCCOMMS}: at most"),
            "overhead": Figure(1.0, "1", "2", f"{DCCOMMS}: {NOT_SAID}"),
            "transmit_w": Figure(35.0, "W", "2", f"{RESELLERS}; 2.8 W where 1,000 m are enough"),
            "receive_w": Figure(1.3, "W", "S", LECOM),
            "source_level_db": Figure(184.0, "dB re 1 uPa at 1 m", "2", AS_SIMULATED),
            "frequency_khz": Figure(26.0, "kHz", "2", AS_SIMULATED),
            "bandwidth_khz": Figure(8.0, "kHz", "2", AS_SIMULATED),
        },
    ),
    Preset(
        "s2cr_48_78",
        "EvoLogics S2CR 48/78",
        {
            "range_m": Figure(1000.0, "m", "2", RESELLERS),
            "transmit_w": Figure(
                60.0, "W", "2", f"{RESELLERS}; at full source level, 5 W at least"
            ),
            "receive_w": Figure(1.1, "W", "2", RESELLERS),
            "source_level_db": Figure(184.0, "dB re 1 uPa at 1 m", "2", RESELLERS),
            "frequency_khz": Figure(63.0, "kHz", "calc", f"middle {OF_THE_BAND}, 48-78 kHz"),
            "bandwidth_khz": Figure(30.0, "kHz", "calc", f"width {OF_THE_BAND}, 48-78 kHz"),
        },
    ),
    Preset(
        "seatrac",
        "Blueprint Subsea SeaTrac X150, X110, X010",
        {
            "range_m": Figure(1000.0, "m", "2", SEATRAC),
            "bit_rate_bps": Figure(100.0, "bit/s", "M", SEATRAC_COMMANDS),
            "overhead": Figure(1.0, "1", "M", f"{SEATRAC_COMMANDS}: 100 bit/s are the user's"),
            "payload_bytes": Figure(30, "B", "2", SEATRAC),
            "frequency_khz": Figure(28.0, "kHz", "calc", f"middle {OF_THE_BAND}, 24-32 kHz"),
            "bandwidth_khz": Figure(8.0, "kHz", "calc", f"width {OF_THE_BAND}, 24-32 kHz"),
        },
    ),
    Preset(
        "sonardyne_wideband2",
        "Sonardyne 6G, Wideband 2 navigation",
        {
            "ping_s": Figure(0.008, "s", "M", f"{SONARDYNE_WIDEBAND}: 8 or 16 ms"),
            "frequency_khz": Figure(25.5, "kHz", "calc", f"middle {OF_THE_BAND}, 19-32 kHz"),
            "bandwidth_khz": Figure(13.0, "kHz", "calc", f"width {OF_THE_BAND}, 19-32 kHz"),
        },
    ),
    Preset(
        "sonardyne_modem6",
        "Sonardyne Modem 6, telemetry scheme TS3",
        {
            "bit_rate_bps": Figure(900.0, "bit/s", "M", SONARDYNE_MODEM),
            "overhead": Figure(
                1.0, "1", "M", f"{SONARDYNE_MODEM}: an actual acoustic data rate; {NOT_SAID}"
            ),
        },
    ),
    Preset(
        "m64",
        "Water Linked Modem M64",
        {
            "range_m": Figure(200.0, "m", "M", WATER_LINKED),
            "bit_rate_bps": Figure(64.0, "bit/s", "M", WATER_LINKED),
            "overhead": Figure(1.0, "1", "M", f"{WATER_LINKED}: its 64 bit/s are the user's"),
            "payload_bytes": Figure(8, "B", "M", f"{WATER_LINKED}: packages of 64 bits"),
        },
    ),
    Preset(
        "m16",
        "Water Linked Modem M16",
        {
            "range_m": Figure(1000.0, "m", "M", f"{WATER_LINKED_DOCS}, Modem M16"),
            "bit_rate_bps": Figure(10.0, "bit/s", "M", f"{WATER_LINKED_DOCS}, Modem M16"),
            "overhead": Figure(
                1.0, "1", "M", f"{WATER_LINKED_DOCS}, Modem M16: 16 bits a package of 1.6 s"
            ),
            "payload_bytes": Figure(
                2, "B", "M", f"{WATER_LINKED_DOCS}, Modem M16: 16 bits a package"
            ),
            "frequency_khz": Figure(58.5, "kHz", "M", f"{WATER_LINKED_DOCS}, Modem M16"),
        },
    ),
    Preset(
        "ugps_g2_u1",
        "Water Linked Underwater GPS G2 R300, locator U1 on channel 3",
        {
            "range_m": Figure(300.0, "m", "M", f"{WATER_LINKED_DOCS}, system selector"),
            "frequency_khz": Figure(
                109.375, "kHz", "calc", f"middle {OF_THE_BAND}, 93.75-125 kHz: {WATER_LINKED_DOCS}"
            ),
            "bandwidth_khz": Figure(
                31.25, "kHz", "calc", f"width {OF_THE_BAND}, 93.75-125 kHz: {WATER_LINKED_DOCS}"
            ),
        },
    ),
    Preset(
        "sonardyne_micro_ranger",
        "Sonardyne Micro-Ranger 2, its pings",
        {
            "range_m": Figure(995.0, "m", "2", MICRO_RANGER),
            "frequency_khz": Figure(27.0, "kHz", "calc", f"middle {OF_THE_BAND}, 20-34 kHz"),
            "bandwidth_khz": Figure(14.0, "kHz", "calc", f"width {OF_THE_BAND}, 20-34 kHz"),
        },
    ),
    Preset(
        "micromodem_psk6",
        "WHOI Micromodem, PSK rate 6",
        {
            "bit_rate_bps": Figure(490.0, "bit/s", "M", WHOI),
            "overhead": Figure(1.0, "1", "M", f"{WHOI}: its burst rate counts the user's bytes"),
            "payload_bytes": Figure(192, "B", "M", f"{WHOI}: 6 frames of 32 B"),
            "transmit_w": Figure(50.0, "W", "M", WHOI),
            "receive_w": Figure(0.158, "W", "M", WHOI),
        },
    ),
    Preset(
        "uwave",
        "UC&NL uWAVE",
        {
            "range_m": Figure(1000.0, "m", "M", UWAVE),
            "bit_rate_bps": Figure(78.0, "bit/s", "M", UWAVE),
            "overhead": Figure(1.0, "1", "M", f"{UWAVE}: its 78 bit/s are of the payload"),
            "doppler_limit_m_per_s": Figure(1.0, "m/s", "M", f"{UWAVE}: largest relative velocity"),
            "transmit_w": Figure(6.0, "W", "M", UWAVE),
            "receive_w": Figure(0.33, "W", "M", UWAVE),
            "frequency_khz": Figure(20.0, "kHz", "calc", f"middle {OF_THE_BAND}, 10-30 kHz"),
            "bandwidth_khz": Figure(20.0, "kHz", "calc", f"width {OF_THE_BAND}, 10-30 kHz"),
        },
    ),
    Preset(
        "nanomodem_v3",
        "Newcastle University Nanomodem V3",
        {
            "range_m": Figure(2000.0, "m", "M", f"{NANOMODEM}: more than 2 km"),
            "bit_rate_bps": Figure(640.0, "bit/s", "M", NANOMODEM),
            "overhead": Figure(1.382, "1", "calc", "640 bit/s of which 463 are throughput"),
            "payload_bytes": Figure(64, "B", "M", NANOMODEM),
            "transmit_w": Figure(1.5, "W", "calc", "300 mA at 5 V at most"),
            "receive_w": Figure(0.025, "W", "calc", "5 mA at 5 V"),
            "idle_w": Figure(0.0125, "W", "calc", "listening: 2.5 mA at 5 V"),
            "source_level_db": Figure(168.0, "dB re 1 uPa at 1 m", "M", NANOMODEM),
            "frequency_khz": Figure(28.0, "kHz", "calc", f"middle {OF_THE_BAND}, 24-32 kHz"),
            "bandwidth_khz": Figure(8.0, "kHz", "calc", f"width {OF_THE_BAND}, 24-32 kHz"),
        },
        since="2018-10",
    ),
    Preset(
        "ahoi",
        "ahoi modem (TUHH)",
        {
            "bit_rate_bps": Figure(195.3, "bit/s", "S", AHOI),
            "overhead": Figure(
                1.0, "1", "S", f"{AHOI}: the bits of a packet are sent at that rate, as they are"
            ),
            "channel": Figure(
                "ahoi_delivery.csv", "", "S", f"{AHOI}: delivery measured over 12 to 200 m"
            ),
            "source_level_db": Figure(156.0, "dB re 1 uPa at 1 m", "S", AHOI),
            "frequency_khz": Figure(50.0, "kHz", "S", AHOI),
            "bandwidth_khz": Figure(25.0, "kHz", "S", AHOI),
        },
        "measured",
    ),
)

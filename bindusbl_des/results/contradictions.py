"""What the tables of a mission cannot be: values that contradict its scenario or each other.

Checks are of whole columns, and of the different words in them: they take little beside reading.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import islice

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from ..core.plugins import is_plugin
from ..records.events import COLLIDED, DELIVERED, HEARD, IN_FLIGHT, LOST, OUT_OF_RANGE, OUTCOMES
from ..records.worst import WORST_IS_LARGEST
from ..scenario.families import is_random
from ..scenario.scenario import Scenario
from ..scenario.telling import tells_slots
from .arrow import numpy_array
from .parquet import Words
from .schemas import VEHICLES, never_null, schema

# What nothing measured in a mission reaches, in whatever unit, its squares included.
BEYOND_MEASURE = 1e100
LARGEST_COUNT = 2**53
LONGEST_S = 1e9

_UPLINK = tuple(OUTCOMES[code] for code in (HEARD, OUT_OF_RANGE, LOST, COLLIDED, IN_FLIGHT))
_DOWNLINK = tuple(OUTCOMES[code] for code in (DELIVERED, OUT_OF_RANGE, LOST, COLLIDED, IN_FLIGHT))
ENUMERATIONS = {
    ("receptions", "outcome"): _UPLINK,
    ("frame_receptions", "outcome"): _UPLINK,
    ("pings", "call"): _UPLINK,
    ("fixes", "outcome"): _DOWNLINK,
    ("assignments", "outcome"): ("known", "missed"),
}
# From which table's row count those of others follow.
FOLLOWS = dict.fromkeys(("receptions", "rounds", "fixes", "broadcasts"), "pings")
FOLLOWS |= {"frame_receptions": "broadcasts", "assignments": "rounds"}
# What a fix has once it was broadcast, and once it was delivered.
BROADCAST = ("broadcast_at_s", "broadcast_by")
ARRIVED = ("delivered_at_s", "latency_s", "innovation_m")
# What a track holds of AUVs alone, in every row.
ESTIMATED = ("estimate_x_m", "estimate_y_m", "estimate_z_m", "imu_x_m", "imu_y_m")

Tables = Mapping[str, pa.Table]
Texts = Mapping[str, Mapping[str, Words]]


def too_many_rows(scenario: Scenario, rows: Mapping[str, int]) -> Iterator[tuple[str, str]]:
    """Yield the tables that claim row counts no such mission has, with what is wrong.

    Nobody pings again before his ping is over; every other count follows from that of the pings.
    Who pings in a round, and how often it broadcasts, a part of one's own may decide as it likes.
    """
    auvs, asvs, duration = scenario.auvs.count, scenario.asvs.count, scenario.duration_s
    passive = scenario.protocol.is_passive
    pinging, listening = (asvs, auvs) if passive else (auvs, asvs)
    limits = {"auvs": (auvs, auvs), "mission": (1, 1)}
    pings, ping_s = rows.get("pings", 0), scenario.acoustics.hf.ping_s
    if "pings" in rows:
        own = any(map(is_plugin, _decide_rounds(scenario)))
        told = tells_slots(scenario)  # and AUVs that are not told do not ping
        instants = int(duration * scenario.record.tracks_hz) + 2
        named = auvs * rows["rounds"] if told else 0
        broadcasts = LARGEST_COUNT if own else rows["fixes"] + rows["rounds"] + named
        instant = scenario.protocol.replies and not scenario.protocol.sends_frames
        frames = 0 if instant else rows["broadcasts"]
        limits |= {
            "pings": (0, LARGEST_COUNT if own else int(pinging * (duration / ping_s + 2))),
            "receptions": (pings * listening, pings * listening),
            "rounds": (0, LARGEST_COUNT if told or own else pings + 2 + _late(scenario)),
            "assignments": (0, named),
            "fixes": (0, pings * listening if passive else pings),
            "broadcasts": (0, 0 if passive else broadcasts),
            "frame_receptions": (auvs * frames, auvs * frames),
            "tracks": (auvs + asvs, (auvs + asvs) * instants),
        }
    for name, (fewest, most) in limits.items():
        if not fewest <= rows[name] <= most:
            expected = f"{most:,}" if fewest == most else f"from {fewest:,} to {most:,}"
            other = FOLLOWS.get(name)
            by = f" by {other}.parquet ({rows[other]:,} rows)" if other else ""
            yield name, f"has {rows[name]:,} rows, where its mission has {expected}{by}"


def _decide_rounds(scenario: Scenario) -> tuple[str, ...]:
    """Return the parts that decide who pings and what is broadcast, if anybody is scheduled."""
    protocol = scenario.protocol
    return () if protocol.is_passive else (protocol.schedule, protocol.downlink, protocol.ranging)


def _late(scenario: Scenario) -> int:
    """Return how many rounds there may be whose pings are so late that the mission ends before."""
    return int(max(scenario.auvs.ping_late_s or (0.0,)) / scenario.acoustics.hf.ping_s)


def contradictions(
    scenario: Scenario, arrow: Mapping[str, pa.Table], texts: Texts
) -> Iterator[tuple[str, str]]:
    """Yield the tables whose values no such mission has, with what is wrong.

    Of each table the first is told, and tables are compared once each is sound by itself.
    """
    alone = {
        name: next(_of_columns(name, it, scenario, texts[name]), "") for name, it in arrow.items()
    }
    if any(alone.values()):
        yield from ((name, wrong) for name, wrong in alone.items() if wrong)
        return
    for name, check in _OF_TABLES.items():
        if name in arrow and len(arrow[name]):
            yield from ((name, wrong) for wrong in islice(check(scenario, arrow, texts), 1))


def _of_columns(
    name: str, table: pa.Table, scenario: Scenario, words: Mapping[str, Words]
) -> Iterator[str]:
    """Yield what is wrong with single columns: nulls, numbers beyond all measure, unknown words."""
    required = never_null(name)
    for field in schema(name):
        column = table[field.name]
        if column.null_count and field.name in required:
            yield f"has no value in {column.null_count:,} rows of its column {field.name}"
        if field.type == pa.string():
            unknown = _apart(words[field.name].words) - _known(scenario, name, field.name)
            if unknown:
                yield f"has {min(unknown)[:30]!r} in its column {field.name}"
        elif not all(_within(chunk, *_bounds(field, scenario)) for chunk in column.chunks):
            yield f"has values in its column {field.name} that its mission cannot have"


def _apart(words: Sequence[str]) -> set[str]:
    """Return the words of texts that may hold several, as the ASVs of a fix."""
    return {word for text in words for word in (text.split(" "))}


def _known(scenario: Scenario, table: str, column: str) -> set[str]:
    """Return the words that may stand in a column of text."""
    if (table, column) in ENUMERATIONS:
        return set(ENUMERATIONS[table, column])
    auvs = {f"AUV{n}" for n in range(scenario.auvs.count)}
    asvs = {f"ASV{n}" for n in range(scenario.asvs.count)}
    if table == "tracks":
        return auvs | asvs
    return asvs if VEHICLES.get(column) == "ASV" or column == "asvs" else auvs


def _bounds(field: pa.Field, scenario: Scenario) -> tuple[float, float]:
    """Return the least and largest value of a column: a count, an instant, whatever is measured."""
    name, listening = field.name, scenario.asvs.count
    if scenario.protocol.is_passive:
        listening = scenario.auvs.count
    if field.type == pa.int64():
        return 0, listening if name in ("in_range_of", "heard_by") else LARGEST_COUNT
    if name == "time_s" or (name.endswith("_at_s") and name != "arrived_at_s"):
        return 0, scenario.duration_s
    if name.endswith("_s") and not name.endswith("_per_s"):  # some arrive after the end
        return 0, LONGEST_S
    return -BEYOND_MEASURE, BEYOND_MEASURE


def _within(chunk: pa.Array, least: float, most: float) -> bool:
    """Tell whether all known numbers lie between two; nan never does."""
    values = numpy_array(chunk)
    if not len(values):
        return True
    if not chunk.null_count:
        return bool(least <= values.min() and values.max() <= most)
    within = np.count_nonzero((values >= least) & (values <= most))
    return bool(within == len(values) - chunk.null_count)


def _whole(table: pa.Table, name: str) -> NDArray[np.int64]:
    column: NDArray[np.int64] = numpy_array(table[name].combine_chunks())
    return column


def _numbered(table: pa.Table, name: str) -> Iterator[str]:
    """Yield what is wrong with numbers that count rows from 0."""
    if not np.array_equal(_whole(table, name), np.arange(len(table))):
        yield f"does not count its rows in its column {name}"


def _beyond(table: pa.Table, name: str, rows: int) -> Iterator[str]:
    """Yield what is wrong with numbers of the rows of another table."""
    if len(table) and _whole(table, name).max() >= rows:
        yield f"names rows in its column {name} that {name}s.parquet has not"


def _auvs(scenario: Scenario, arrow: Tables, texts: Texts) -> Iterator[str]:
    if arrow["auvs"]["auv"].to_pylist() != [f"AUV{n}" for n in range(scenario.auvs.count)]:
        yield "does not have each AUV in its place"


def _mission(scenario: Scenario, arrow: Tables, texts: Texts) -> Iterator[str]:
    mission, auvs = arrow["mission"], arrow["auvs"]
    for metric in WORST_IS_LARGEST:
        name = f"worst_{metric}_auv"
        if mission[name].null_count and auvs[metric].null_count < len(auvs):
            yield f"names nobody in its column {name}, though auvs.parquet has values"


def _rounds(scenario: Scenario, arrow: Tables, texts: Texts) -> Iterator[str]:
    yield from _numbered(arrow["rounds"], "round")


def _pings(scenario: Scenario, arrow: Tables, texts: Texts) -> Iterator[str]:
    pings, rounds = arrow["pings"], arrow["rounds"]
    yield from _numbered(pings, "ping")
    yield from _beyond(pings, "round", len(rounds))
    sender, other = ("asv", "auv") if scenario.protocol.is_passive else ("auv", "asv")
    if pings[sender].null_count or pings[other].null_count != len(pings):
        yield f"has pings of no {sender.upper()}, or of an {other.upper()}"
    if tells_slots(scenario) and scenario.protocol.missed == "last_slot":
        return  # whose slots may be those of longer rounds
    slots = _whole(rounds, "colours")[_whole(pings, "round")]
    if is_random(scenario):  # all are in the one slot that there is
        slots = np.maximum(slots, 1)
    if (_whole(pings, "slot") >= slots).any():
        yield "has slots that its rounds have not"


def _receptions(scenario: Scenario, arrow: Tables, texts: Texts) -> Iterator[str]:
    yield from _beyond(arrow["receptions"], "ping", len(arrow["pings"]))


def _broadcasts(scenario: Scenario, arrow: Tables, texts: Texts) -> Iterator[str]:
    yield from _beyond(arrow["broadcasts"], "round", len(arrow["rounds"]))


def _frame_receptions(scenario: Scenario, arrow: Tables, texts: Texts) -> Iterator[str]:
    yield from _beyond(arrow["frame_receptions"], "broadcast", len(arrow["broadcasts"]))


def _assignments(scenario: Scenario, arrow: Tables, texts: Texts) -> Iterator[str]:
    yield from _beyond(arrow["assignments"], "round", len(arrow["rounds"]))


def _fixes(scenario: Scenario, arrow: Tables, texts: Texts) -> Iterator[str]:
    fixes, outcome = arrow["fixes"], texts["fixes"]["outcome"]
    yield from _numbered(fixes, "fix")
    yield from _beyond(fixes, "ping", len(arrow["pings"]))
    yield from _beyond(fixes, "round", len(arrow["rounds"]))
    delivered = outcome.are("delivered")
    missed = outcome.are("out_of_range") | outcome.are("lost") | outcome.are("collided")
    broadcast = delivered | missed
    if scenario.protocol.is_passive:
        if not delivered.all() or any(fixes[name].null_count < len(fixes) for name in BROADCAST):
            yield "has fixes that AUVs made themselves, and yet have not, or that were broadcast"
        broadcast = np.zeros(len(fixes), dtype=bool)
    for rows, columns in ((delivered, ARRIVED), (broadcast, BROADCAST)):
        for name in columns:
            if (rows & _nulls(fixes[name])).any():
                yield f"has delivered fixes or broadcast ones without {name}"


def _nulls(column: pa.ChunkedArray) -> NDArray[np.bool_]:
    found = [np.zeros(0, dtype=bool), *(_null(chunk) for chunk in column.chunks)]
    return np.concatenate(found)


def _null(chunk: pa.Array) -> NDArray[np.bool_]:
    validity = chunk.buffers()[0]
    if validity is None or not chunk.null_count:
        return np.zeros(len(chunk), dtype=bool)
    known = np.unpackbits(np.frombuffer(validity, dtype=np.uint8), bitorder="little")
    missing: NDArray[np.bool_] = known[chunk.offset : chunk.offset + len(chunk)] == 0
    return missing


def _tracks(scenario: Scenario, arrow: Tables, texts: Texts) -> Iterator[str]:
    tracks, vehicle = arrow["tracks"], texts["tracks"]["vehicle"]
    vehicles = scenario.auvs.count + scenario.asvs.count
    if len(tracks) % vehicles:
        yield f"has {len(tracks):,} rows, which do not belong to {vehicles} vehicles"
        return
    instants = len(tracks) // vehicles
    names = [f"AUV{n}" for n in range(scenario.auvs.count)]
    names += [f"ASV{n}" for n in range(scenario.asvs.count)]
    places = np.array([names.index(word) for word in vehicle.words])
    if (places[vehicle.codes] != np.repeat(np.arange(vehicles), instants)).any():
        yield "does not have the vehicles one after the other, AUVs first"
    times = numpy_array(tracks["time_s"].combine_chunks()).reshape(vehicles, -1)
    if (times != times[0]).any() or (np.diff(times[0]) <= 0).any():
        yield "does not have the same ascending instants for each vehicle"
    for name in ESTIMATED:
        if tracks[name].null_count != scenario.asvs.count * instants:
            yield f"does not have {name} for all AUVs, and for them alone"


_OF_TABLES: Mapping[str, Callable[[Scenario, Tables, Texts], Iterator[str]]] = {
    "auvs": _auvs,
    "mission": _mission,
    "rounds": _rounds,
    "pings": _pings,
    "receptions": _receptions,
    "broadcasts": _broadcasts,
    "frame_receptions": _frame_receptions,
    "assignments": _assignments,
    "fixes": _fixes,
    "tracks": _tracks,
}

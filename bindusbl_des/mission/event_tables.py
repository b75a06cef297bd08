"""The event tables of a finished mission: what happened, and where everybody was meanwhile."""

from functools import lru_cache

import numpy as np
import pyarrow as pa

from ..acoustics.channel import Receiver
from ..protocol.broadcasters import hearers
from ..records.events import OUTCOMES
from ..records.rows import Recorder
from ..results.tables import begun, from_numbers, from_rows
from .outcomes.accuracy import TRACK_POINT, track_points
from .world import World

# What tables have beside the buffers of a mission: how loud receptions were, and whose measurements
# were fused
LEVELS = np.dtype([("level_db", "f8"), ("margin_db", "f8")])
FUSED = np.dtype([("asvs", "i8")])
GNSS = np.dtype([("gnss_fix", "i8"), ("fixed_at_s", "f8"), ("sd_m", "f8")])


def event_tables(world: World) -> dict[str, pa.Table]:
    """Return the event tables of a finished mission, as far as it keeps any."""
    if world.scenario.record.detail == "summary":
        return {}
    record, gnss = world.record, world.scenario.navigation.gnss_fix is not None
    return {
        "rounds": from_rows("rounds", record.rounds),
        "pings": from_numbers("pings", record.pings.rows),
        "receptions": _receptions_table(record, world.network.uplink.receiver),
        "broadcasts": from_numbers("broadcasts", world.broadcasts),
        "frame_receptions": from_numbers("frame_receptions", record.frame_receptions.rows),
        "assignments": from_rows("assignments", record.assignments),
        "fixes": _fixes_table(record, len(world.asv_fleet)),
        **({"gnss_fixes": _gnss_fixes_table(record)} if gnss else {}),
        "tracks": _tracks_table(world),
    }


def _receptions_table(record: Recorder, receiver: Receiver) -> pa.Table:
    rows = record.receptions.rows
    told, levels = receiver.levels(rows["snr_db"]), np.empty(len(rows), dtype=LEVELS)
    for name in LEVELS.names or ():
        levels[name] = told[name]
    return from_numbers("receptions", rows, levels)


def _fixes_table(record: Recorder, asvs: int) -> pa.Table:
    rows = record.fixes.rows
    heard = np.zeros((len(rows), -(-asvs // 64) * 64), dtype=np.bool_)
    heard[:, :asvs] = hearers(record, range(len(rows)), asvs)
    packed = np.packbits(heard, axis=1)
    together = np.uint64 if asvs <= 64 else f"V{packed.shape[1]}"  # which is slower to compare
    groups, group = np.unique(packed.view(together)[:, 0], return_inverse=True)
    fused = np.empty(len(rows), dtype=FUSED)
    fused["asvs"] = len(OUTCOMES) + group
    names = [_together(own.tobytes()) for own in groups]
    return from_numbers("fixes", rows, fused, words=(*OUTCOMES, *names))


def _gnss_fixes_table(record: Recorder) -> pa.Table:
    rows = record.gnss_fixes.rows
    own = np.empty(len(rows), dtype=GNSS)
    own["gnss_fix"], own["fixed_at_s"] = rows["fix"], rows["delivered_at_s"]
    own["sd_m"] = rows["sd_x_m"]
    return from_numbers("gnss_fixes", rows, own)


@lru_cache(maxsize=1024)
def _together(packed: bytes) -> str:
    """Return the names of ASVs, of each of which there is a bit, that is set if it is meant."""
    bits = np.unpackbits(np.frombuffer(packed, dtype=np.uint8))
    return " ".join([f"ASV{asv}" for asv in np.flatnonzero(bits)])


def _tracks_table(world: World) -> pa.Table:
    auvs, asvs = range(len(world.auv_fleet)), range(len(world.asv_fleet))
    names = *(f"AUV{auv}" for auv in auvs), *(f"ASV{asv}" for asv in asvs)
    instants_each = world.trajectories.beside_m.shape[1]
    table = begun("tracks", len(names) * instants_each, TRACK_POINT, words=names)
    for points in track_points(world):
        table.write(points)
    return table.table()

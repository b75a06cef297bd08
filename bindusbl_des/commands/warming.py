"""Compiling what missions need, once, where the package is installed (`doctor --warm`)."""

import hashlib
import os
import platform
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path

# Scenarios that ship, and changes of them, that together need the code of nearly all missions.
KINDS: tuple[tuple[str, ...], ...] = (
    ("harbour_current",),
    ("quickstart", "protocol.ranging=twtt"),
    ("quickstart", "protocol.ranging=passive"),
    ("quickstart", "navigation.filter=smoother"),
    ("quickstart", "usbl.preset=seatrac_x150", "navigation.drift.percent_of_distance=0.3"),
    ("quickstart", "usbl.preset=seatrac_x150", "usbl.misalignment_sd_deg=1"),
    ("quickstart", "usbl.misalignment_sd_deg=1"),
    ("quickstart", "protocol.downlink=direct_reply"),
    ("quickstart", "protocol.knowledge=broadcast", "protocol.schedule=dsatur"),
    ("quickstart", "protocol.schedule=super_tdma", "protocol.positions=carried_forward"),
    ("quickstart", "protocol.schedule=polling"),
    ("recovery_140m",),
    ("quickstart",),
)

# Long enough for pings to be heard and fixes to be delivered.
SHORT_S = 12.0

# Side by side two compile sooner than one, although they wait for each other.
PROCESSES = 2


def warmed(folder: Path) -> Path:
    """Return the file that says that a folder of compiled code holds all of it."""
    of = (KINDS, platform.node(), platform.machine())
    return folder / f"warm-{hashlib.sha256(repr(of).encode()).hexdigest()[:16]}"


def warm(folder: Path) -> Iterator[int]:
    """Compile what missions of all kinds need; yield after each how many are done.

    What is kept already is loaded only.  The folder then says that it holds all.
    """
    from ..campaigns.workers.processes import Spawn, go_with_parent

    workers = min(PROCESSES, os.cpu_count() or 1)
    with ProcessPoolExecutor(workers, Spawn(), go_with_parent) as pool:
        flown = [pool.submit(fly, kind) for kind in KINDS]
        for done, future in enumerate(as_completed(flown), start=1):
            future.result()
            yield done
    warmed(folder).touch()


def fly(kind: tuple[str, ...]) -> None:
    """Fly a short mission of a kind and predict its errors, as `run` and `plan` would."""
    from ..mission.simulation import simulate
    from ..planning.prediction.inputs import inputs_of
    from ..planning.prediction.predicting import predict
    from ..scenario.files.scenario_file import load_scenario

    scenario = load_scenario(kind[0], overrides=(*kind[1:], f"duration_s={SHORT_S}"))
    simulate(scenario, 0).summary()
    if kind == KINDS[-1]:
        predict(inputs_of(scenario), [(0.0, 0.0)])

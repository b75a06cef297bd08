"""What holds of every mission, whatever its scenario: all families together, every key drawn.

Half of the scenarios are drawn from the whole schema, half so that vehicles and signals meet.
"""

import json
import random
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from drawn_scenarios import SCHEMA, drawn
from missions_against import collided, drawn_protocol, uncompiled

from bindusbl_des import Mission, Result, Scenario, Setup, simulate, verify
from bindusbl_des.apps.preflight.effort import effort
from properties.books import (
    alone_on_a_band,
    causal,
    collide_by_overlap,
    conserved,
    finite,
    told_why,
)
from properties.figures import agree

DURATIONS_S = (3.0, 8.0, 15.0)
SHORTER = 0.5  # so many times as long are missions of the everyday test
WORTH_RUNNING_S, MOST_BYTES = 1.0, 3e8


def small(seed: int, folder: Path, lasts: float = 1.0) -> Scenario | None:
    """Return the scenario of a seed, with all recorded, that `lasts` so many times as long as it
    would; None for one that contradicts itself.
    """
    data = drawn_protocol(seed, folder) if seed % 2 else drawn(seed, folder)
    draw = random.Random(seed)
    data["duration_s"] = lasts * draw.choice(DURATIONS_S)
    rate = draw.choice((1.0, 6.0))
    data["record"] = {"detail": "full", "tracks_hz": rate, "metrics_hz": rate}
    if draw.random() < 0.2:
        data["record"]["metrics_from_s"] = draw.choice((0.5, 2.0))
    try:
        scenario = Scenario.model_validate(data)
        cost = effort(Setup(scenario))
    except ValueError:
        return None
    return scenario if cost.seconds < WORTH_RUNNING_S and cost.bytes < MOST_BYTES else None


def flown(seed: int, folder: Path, lasts: float = 1.0) -> Result | None:
    """Return the mission of a seed; None for one that is refused as it is built, or diverges."""
    scenario = small(seed, folder, lasts)
    if scenario is None:
        return None
    try:
        return simulate(scenario, seed)
    except (ValueError, RuntimeError, FloatingPointError):
        return None


def stepped(result: Result, seed: int) -> None:
    """Stops at any instants change nothing."""
    draw, mission = random.Random(seed), Mission(result.scenario, seed)
    end = result.scenario.duration_s
    for instant in sorted(draw.uniform(0.0, end) for _ in range(draw.randint(1, 5))):
        mission.advance(instant)
        if draw.random() < 0.5:
            mission.auvs()
    again = mission.result()
    for name, table in result.arrow.items():
        assert table.equals(again.arrow[name]), name


# When rows are on record, and what depends on the mission's end: how much of a round takes place,
# and instants at which it is looked whether a cell is swept (by a fraction of a cell).
BEGUN = {
    "tracks": "time_s", "pings": "sent_at_s", "rounds": "started_at_s", "broadcasts": "sent_at_s",
    "receptions": "arrived_at_s", "fixes": "delivered_at_s", "frame_receptions": "arrived_at_s",
}  # fmt: skip
ENDING = {"uplink_s", "downlink_s", "swept_m2"}
# What a smoother knows better afterwards
AFTERWARDS = {
    "estimate_x_m", "estimate_y_m", "estimate_sd_x_m", "estimate_sd_y_m", "estimate_cov_xy_m2",
    "position_error_m", "cross_track_error_m",
}  # fmt: skip


def cut(result: Result, seed: int) -> None:
    """A mission that ends earlier is the same until then: nobody knows what will be true."""
    scenario = result.scenario
    end = random.Random(seed).uniform(0.3, 0.8) * scenario.duration_s
    if end <= scenario.record.metrics_from_s:
        return
    data = {**scenario.model_dump(exclude_unset=True), "duration_s": end}
    try:
        shorter = Scenario.model_validate(data)
    except ValueError as error:
        if "left to judge" not in str(error):
            raise
        return
    earlier = simulate(shorter, seed).tables
    later = ENDING | AFTERWARDS if scenario.navigation.filter == "smoother" else ENDING
    for name, begun in BEGUN.items():
        whole, part = (
            it[name][lambda it, begun=begun: it[begun] < end - 0.05].reset_index(drop=True)
            for it in (result.tables, earlier)
        )
        if name == "pings":  # a call that the end overtakes has no answer
            whole, part = (it[it["call"] != "in_flight"] for it in (whole, part))
        assert len(whole) == len(part), name
        if name in ("receptions", "frame_receptions"):  # of what is on its way nothing is known
            whole, part = (it[part["outcome"] != "in_flight"] for it in (whole, part))
        for column in whole.select_dtypes("float").columns.difference(later):
            # An AUV at a third of the speed of sound is sought where it is after the end as well.
            rounding = 1e-12 if column == "arrived_at_s" else 0.0
            same = np.isclose(whole[column], part[column], rtol=0.0, atol=rounding, equal_nan=True)
            assert same.all(), (name, column)


def proved(result: Result) -> bool:
    """What `verify` accepts does not collide; tell whether it was."""
    try:
        accepted = verify(result.scenario).accepted
    except ValueError as error:
        if "--max-speed" not in str(error):
            raise
        return False  # AUVs of a track that nobody could follow
    assert not (accepted and collided(result))
    return accepted


PROPERTIES = (finite, causal, conserved, alone_on_a_band, collide_by_overlap, told_why, agree)


def check(seeds: range, folder: Path, lasts: float = 1.0, proves: bool = False) -> Counter[str]:
    """Fly the missions of seeds; all must hold of each. Return how many were flown, and of what."""
    counts: Counter[str] = Counter()
    for seed in seeds:
        try:
            if (result := flown(seed, folder, lasts)) is None:
                continue
            for holds in PROPERTIES:
                holds(result)
            counts["proved"] += proves and proved(result)
            stepped(result, seed)
            cut(result, seed)
        except Exception as error:
            error.add_note(f"seed {seed}")
            raise
        counts["flown"] += 1
        counts["fixes"] += len(result.tables["fixes"])
        counts["collided"] += collided(result)
    return counts


def forgetful(take: Callable[..., Any]) -> Callable[..., Any]:
    """Return what takes memory as `take` does, but what is not written there is no number."""

    def taken(*words: Any, **further: Any) -> Any:
        array = take(*words, **further)
        if not array.dtype.hasobject:
            array.reshape(-1).view(np.uint8).fill(0xFF)
        return array

    return taken


def test_all_holds_of_drawn_missions(tmp_path: Path) -> None:
    """Equations run uncompiled, in a process of their own: to compile all families takes longer.
    What nobody has written is NaN there.  Verdicts wait for the slow test, and for
    verification/test_drawn_missions.py.
    """
    counts = Counter(uncompiled("properties.test_properties", 180, 220, tmp_path, SHORTER))
    assert counts["flown"] >= 8, counts
    assert counts["fixes"] > 80, counts
    assert counts["collided"] > 10, counts


@pytest.mark.slow
@pytest.mark.parametrize("part", range(10))
def test_all_holds_of_five_thousand_drawn_missions(part: int, tmp_path: Path) -> None:
    """The same for others."""
    counts = check(range(1000 + 500 * part, 1500 + 500 * part), tmp_path, proves=True)
    print(counts)
    assert counts["flown"] >= 200


# Keys that are not drawn, or seldom, and why.
BOTTOM = "a bottom, and what is above it: vehicles/test_bottom.py"
SAILS = "vessels that sail have a wind: vehicles/test_sailing.py"
OFFICES = "which of many a file of a chart or of routes means: charts/test_offices.py"
DEGREES = "the same places on Earth: scenario/test_places.py reads them as metres"
NOT_DRAWN = {
    "asvs.formation.tracks": "files of several tracks: mission/test_anchors.py",
    "asvs.formation.positions_deg": DEGREES,
    "auvs.route.points_deg": DEGREES,
    "auvs.route.crs": OFFICES,
    "auvs.route.routes": OFFICES,
    "survey.area_name": OFFICES,
    "environment.wind": SAILS,
    "environment.wind.speed_m_per_s": SAILS,
    "environment.wind.from_deg": SAILS,
    "environment.wind.gust_sd_m_per_s": SAILS,
    "environment.wind.veer_sd_deg": SAILS,
    "environment.wind.gust_time_s": SAILS,
    "environment.wind.file": SAILS,
    "environment.bathymetry": BOTTOM,
    "environment.bathymetry.depth_m": BOTTOM,
    "environment.bathymetry.slope_deg": BOTTOM,
    "environment.bathymetry.slope_towards_deg": BOTTOM,
    "environment.bathymetry.file": BOTTOM,
    "environment.bathymetry.crs": BOTTOM,
    "environment.bathymetry.positive": BOTTOM,
    "auvs.depth": BOTTOM,
    "auvs.depth.altitude_m": BOTTOM,
    "auvs.depth.shallowest_m": BOTTOM,
    "auvs.depth.climb_angle_deg": BOTTOM,
    "navigation.dvl_range_m": BOTTOM,
    "asvs.groups": "vessels that differ: mission/test_mixed_vessels.py",
    "survey.crs": OFFICES,
    "modems.lines": "files of what hosts said: live/test_wires.py",
    "auvs.route.positions_deg": DEGREES,
}


def keys(schema: dict[str, Any], path: tuple[str, ...] = ()) -> Iterator[str]:
    """Yield all keys of the schema, dotted."""
    for name, part in schema.get("properties", {}).items():
        if not path and name == "name":
            continue
        yield ".".join((*path, name))
        for arm in (part, *part.get("anyOf", ())):
            if "$ref" in arm:
                kind = arm["$ref"].rpartition("/")[2]
                if not kind.startswith("Own"):
                    yield from keys(SCHEMA["$defs"][kind], (*path, name))


def written(data: dict[str, Any], path: tuple[str, ...] = ()) -> Iterator[str]:
    """Yield all keys of a scenario, dotted."""
    for name, value in data.items():
        yield ".".join((*path, name))
        if isinstance(value, dict):
            yield from written(value, (*path, name))


def test_every_key_is_drawn(tmp_path: Path) -> None:
    """In a scenario that is accepted; one that is not stands above with a reason."""
    missing = {key for key in keys(SCHEMA) if key not in NOT_DRAWN}
    for seed in range(2600):
        data = drawn(seed, tmp_path)
        try:
            Scenario.model_validate(data)
        except ValueError:
            continue
        missing.difference_update(written(json.loads(json.dumps(data))))
        if not missing:
            break
    assert not missing


if __name__ == "__main__":
    first, end, folder, lasts = sys.argv[1:]
    np.empty, np.empty_like = forgetful(np.empty), forgetful(np.empty_like)
    print(json.dumps(check(range(int(first), int(end)), Path(folder), float(lasts))))

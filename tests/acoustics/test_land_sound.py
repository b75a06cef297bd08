"""Sound does not pass land: every signal of the sea, whichever channel and protocol."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
import shapely
from explain_for_tests import chain_of_fix, chain_of_ping

from bindusbl_des import Mission, Result, Scenario, simulate

ISLAND = [[10.0, -15.0], [20.0, -15.0], [20.0, 25.0], [10.0, 25.0]]
SPIT = [[-70.0, 5.0], [-10.0, 5.0], [-10.0, 9.0], [-70.0, 9.0]]
ASHORE = shapely.union_all([shapely.Polygon(ISLAND), shapely.Polygon(SPIT)])
HELD = [[0.0, 0.0], [5.0, -25.0], [28.0, 3.0], [-30.0, 20.0]]
MOORED = [[45.0, 10.0], [-35.0, -15.0], [-5.0, 40.0]]

VARIED: dict[str, dict[str, Any]] = {
    "plain": {},
    "calls": {"protocol": {"ranging": "twtt"}},
    "passive": {"protocol": {"ranging": "passive"}},
    "sonar": {"acoustics": {"hf": {"channel": "sonar"}, "mf": {"channel": "sonar"}}},
    "echoes": {"acoustics": {"hf": {"channel": {"model": "sonar", "bottom_m": 30.0}}}},
    "program": {"protocol": {"access": "t_lohi"}},
    "peers": {"navigation": {"peers": {"every_s": 4.0}}},
    "relay": {"protocol": {"acknowledge": "frame", "relay": {"hops": 2}}},
    "data": {"traffic": {"bytes": 16, "every_s": 3.0}},
}


def scenario(*, land: bool = True, **keys: Any) -> Scenario:
    acoustics = {"hf": {"range_m": 60.0}, "mf": {"range_m": 75.0}, "loss": {"law": "none"}}
    for name, own in keys.pop("acoustics", {}).items():
        acoustics[name] = {**acoustics[name], **own}  # type: ignore[dict-item]
    given = {
        "name": "island", "duration_s": 8.0, "acoustics": acoustics,
        "survey": {"land": [ISLAND, SPIT]} if land else {},
        "auvs": {"count": 4, "route": {"kind": "hold", "positions_m": HELD}},
        "asvs": {"count": 3, "formation": {"positions_m": MOORED}},
    }  # fmt: skip
    return Scenario.model_validate({**given, **keys})


PLACES = {f"AUV{n}": place for n, place in enumerate(HELD)} | {
    f"ASV{n}": place for n, place in enumerate(MOORED)
}


def is_crossed(one: str, other: str) -> bool:
    return bool(shapely.LineString([PLACES[one], PLACES[other]]).intersection(ASHORE).length > 1e-6)


def met(result: Result) -> Iterator[tuple[str, str, str, str]]:
    """Yield of which table, from whom, to whom, and what became of each signal on record."""
    tables = result.tables
    for row in tables["receptions"].itertuples():
        yield "receptions", row.auv, row.asv, row.outcome
    frames = tables["broadcasts"].asv
    for row in tables["frame_receptions"].itertuples():
        yield "frame_receptions", frames[row.broadcast], row.auv, row.outcome
    for name, sent, number in (
        ("signal_receptions", "signals", "signal"),
        ("auv_frame_receptions", "auv_frames", "auv_frame"),
    ):
        for row in tables[name].itertuples() if name in tables else ():
            which = getattr(row, number)
            if which == which and which is not None:
                own = tables[sent].iloc[int(which)]
                sender = own.sender if "sender" in own else own.auv
                yield name, sender, row.listener, row.outcome
    for row in tables["packets"].itertuples() if "packets" in tables else ():
        if row.outcome == "delivered":
            yield "packets", row.auv, row.delivered_to, "heard"
    for row in tables["pings"].itertuples():
        if row.call is not None and row.call == row.call:
            yield "calls", row.called_by, row.auv, row.call


@pytest.mark.parametrize("name", VARIED)
def test_what_land_crosses_is_lost(name: str) -> None:
    found = simulate(scenario(**VARIED[name]), seed=1)
    seen: dict[tuple[str, bool], set[str]] = {}
    for table, one, other, outcome in met(found):
        crossed = is_crossed(one, other)
        seen.setdefault((table, crossed), set()).add(outcome)
        if crossed:
            assert outcome in ("blocked", "out_of_range"), (table, one, other)
        else:
            assert outcome != "blocked", (table, one, other)
    for table in {table for table, _ in seen} - {"packets", "calls"}:
        assert "blocked" in seen[table, True], table
        assert "heard" in seen[table, False], table
    assert "blocked" in set(found.tables["fixes"].outcome) or name not in ("plain", "sonar")


def test_land_that_no_sound_meets_changes_nothing() -> None:
    far = {"land": [[[900.0, 0.0], [950.0, 0.0], [950.0, 50.0]]]}
    without, beside = (
        simulate(scenario(land=False, survey=survey), seed=1) for survey in ({}, far)
    )
    for table in ("receptions", "fixes", "frame_receptions", "tracks"):
        one, other = without.tables[table], beside.tables[table]
        assert (one.isna() == other.isna()).all().all()
        numbers = one.select_dtypes("number")
        assert np.allclose(numbers, other[numbers.columns], rtol=1e-9, equal_nan=True), table
        texts = one.columns.difference(numbers.columns)
        assert one[texts].equals(other[texts]), table


def test_who_is_behind_land_is_told() -> None:
    found = simulate(scenario(), seed=1)
    receptions, fixes = found.tables["receptions"], found.tables["fixes"]
    ping = int(receptions[receptions.outcome == "blocked"].ping.iloc[0])
    text = chain_of_ping(found, ping).text()
    assert "is behind land: on the" in text
    assert "hears nothing" in text
    fix = int(fixes[fixes.outcome == "blocked"].fix.iloc[0])
    assert "never delivered" in (text := chain_of_fix(found, fix).text())
    assert "behind land" in text
    missed = fixes.outcome.isin(["blocked", "out_of_range"])
    assert int(found.auvs.fixes_out_of_range.sum()) == int(missed.sum())


def test_groups_are_made_by_who_is_seen() -> None:
    """AUVs on both sides of a spit share a slot, though one ASV is within range of both."""
    wall = [[-2.0, -90.0], [2.0, -90.0], [2.0, 90.0], [-2.0, 90.0]]
    places = [[30.0, 0.0], [-30.0, 0.0]]
    auvs = {"count": 2, "route": {"kind": "hold", "positions_m": places}}
    asvs = {"count": 2, "formation": {"positions_m": [[10.0, 20.0], [-10.0, 20.0]]}}
    alike = {"auvs": auvs, "asvs": asvs}
    colours = {
        side: simulate(scenario(survey=survey, **alike), seed=1).tables["rounds"].colours.max()
        for side, survey in (("open", {}), ("behind", {"land": [wall]}))
    }
    assert colours == {"open": 2, "behind": 1}


def test_what_happens_is_told_as_it_is_on_record() -> None:
    """Of whoever waits for it: what land blocked is blocked, and had no chance."""
    mission = Mission(scenario(**VARIED["program"]), 1)
    rows = [happening.row for happening in mission.happenings("signal_reception")]
    blocked = [row for row in rows if row.outcome == "blocked"]
    assert {(row.why, row.loss_probability) for row in blocked} == {("blocked", None)}
    assert not any(row.why == "blocked" for row in rows if row not in blocked)
    on_record = mission.result().tables["signal_receptions"]
    over = on_record[on_record.arrived_at_s.notna()]
    assert len(blocked) == (over.outcome == "blocked").sum()


@pytest.mark.parametrize("name", ["plain", "sonar"])
def test_frames_that_land_blocked_had_no_chance(name: str) -> None:
    frames = simulate(scenario(**VARIED[name]), seed=1).tables["frame_receptions"]
    chances = frames.loss_probability
    assert chances[frames.outcome == "blocked"].isna().all()
    assert chances[frames.outcome == "heard"].isna().all() == (name == "plain")

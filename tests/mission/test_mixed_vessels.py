"""Vessels of several groups: each does and measures what it does in a fleet of its own kind."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from predicted_for_tests import inputs_of, predict

from bindusbl_des import Scenario, ScenarioError, Setup, load_scenario, simulate, warnings_of

Keys = dict[str, Any]

#: One AUV that lies still between two vessels, each of which hears it
STILL: Keys = {"count": 1, "route": {"kind": "hold", "positions_m": [[3, 4]]}}
PLACES: Keys = {"model": "positions", "positions_m": [[20, 0], [-20, 10]]}


def mission(asvs: Keys, **changes: Any) -> Scenario:
    keys = {"name": "mixed", "duration_s": 40.0, "auvs": STILL, "asvs": asvs, **changes}
    return Scenario(**keys)


def own_fixes(asvs: Keys, ranging: str = "owtt_sync", **changes: Any) -> pd.DataFrame:
    """Return what each vessel alone measures, receptions that were heard."""
    given = {"protocol": {"ranging": ranging}, **changes}
    found = simulate(mission({"formation": PLACES, **asvs}, **given), 2).tables["receptions"]
    return found[found.outcome == "heard"]


@pytest.mark.parametrize("lasting", [{}, {"misalignment_sd_deg": 1.0}])
@pytest.mark.parametrize("ranging", ["owtt_sync", "twtt"])
def test_each_vessel_measures_by_its_own_usbl(ranging: str, lasting: Keys) -> None:
    """The direction that a vessel measures is that of the vessel of its number in a fleet that is
    all of its kind, by an array or by a data sheet.
    """
    kinds: list[Keys] = [
        {"heading_sd_deg": 3.0, "tdoa_sd_s": 2e-6, "array": "cross5"},
        {"model": {"model": "datasheet", "bearing_sd_deg": 0.5, "range_sd_m": 0.3}},
    ]
    mixed = own_fixes(
        {"groups": [{"count": 1, "usbl": its} for its in kinds]}, ranging, usbl=lasting
    )
    for asv, its in enumerate(kinds):
        alone = own_fixes({"count": 2}, ranging, usbl={**lasting, **its})
        told = ["azimuth_deg", "elevation_deg", "body_azimuth_deg"]
        name = f"ASV{asv}"
        one, two = (table[table.asv == name].reset_index(drop=True) for table in (mixed, alone))
        assert len(one) > 3
        pd.testing.assert_frame_equal(one[told], two[told])
        others = own_fixes({"count": 2}, ranging, usbl={**lasting, **kinds[1 - asv]})
        assert not one[told].equals(others[others.asv == name].reset_index(drop=True)[told])


def test_a_fix_weighs_vessels_by_what_they_carry() -> None:
    """A fix of a sure and an unsure vessel is about as good as that of two sure ones."""
    unsure: Keys = {"heading_sd_deg": 20.0, "gnss_sd_m": 5.0}
    errors = {}
    for name, groups in {
        "sure": [{"count": 2}],
        "mixed": [{"count": 1}, {"count": 1, "usbl": unsure}],
        "unsure": [{"count": 2, "usbl": unsure}],
    }.items():
        scenario = mission({"formation": PLACES, "groups": groups}, duration_s=120.0)
        fixes = simulate(scenario, 1).tables["fixes"]
        errors[name] = fixes.error_m.mean()
        stated = np.sqrt((fixes.sd_x_m**2 + fixes.sd_y_m**2).mean())
        assert 0.6 < np.sqrt((fixes.error_m**2).mean()) / stated < 1.6
    assert errors["mixed"] < 2.0 * errors["sure"] < 0.3 * errors["unsure"]


FLEETS: list[Keys] = [
    {},
    {"vehicle": "otter"},
    {"formation": {"model": "follow", "speed_m_per_s": 1.5}},
]


@pytest.mark.parametrize("extra", FLEETS)
def test_groups_that_say_nothing_are_one_fleet(extra: Keys) -> None:
    """A fleet that is split in groups is the fleet, bit for bit, however it lies or moves."""
    usbl = {"gnss_sd_m": 0.3, "gnss_correlated_sd_m": 0.5, "misalignment_sd_deg": 0.5}
    given: Keys = {"duration_s": 30.0, "auvs": {"count": 3}, "usbl": usbl}
    whole = simulate(mission({"count": 3, **extra}, **given), seed=1)
    for groups in ([{"count": 3}], [{"count": 2}, {"count": 1}]):
        split = simulate(mission({**extra, "groups": groups}, **given), 1)
        assert split.scenario.asvs.count == 3
        for name, table in whole.tables.items():
            pd.testing.assert_frame_equal(table, split.tables[name], obj=f"{name} of {groups}")


def test_a_steered_vessel_lies_beside_a_moored_one() -> None:
    wind = {"current_m_per_s": 0.2}
    groups = [{"count": 1}, {"count": 1, "vehicle": "otter"}]
    scenario = mission({"formation": PLACES, "groups": groups}, environment=wind, duration_s=60.0)
    tracks = simulate(scenario, 1).tables["tracks"]
    moored, otter = (tracks[tracks.vehicle == f"ASV{asv}"] for asv in range(2))
    assert not np.ptp(moored.x_m)
    assert 0.0 < np.ptp(otter.x_m) < 10.0
    assert scenario.asvs.words == "1 moored, 1 otter"
    alone = mission({"count": 2, "vehicle": "otter", "formation": PLACES},
                    environment=wind, duration_s=60.0)  # fmt: skip
    theirs = simulate(alone, 1).tables["tracks"]
    mixed, all_otters = (
        table[table.vehicle == "ASV1"].reset_index(drop=True) for table in (tracks, theirs)
    )
    pd.testing.assert_frame_equal(mixed, all_otters)


@pytest.mark.parametrize("model", ["follow", "information"])
def test_each_vessel_goes_at_its_own_speed(model: str) -> None:
    places = {"model": model, "start_m": [[0, 0], [0, 10]], "speed_m_per_s": 1.0}
    groups = [{"count": 1, "speed_m_per_s": 2.5}, {"count": 1}]
    auvs = {"count": 2, "route": {"kind": "hold", "positions_m": [[60, 0], [-60, 10]]}}
    scenario = mission({"formation": places, "groups": groups}, auvs=auvs,
                       acoustics={"hf": {"range_m": 30.0}}, duration_s=60.0)  # fmt: skip
    tracks = simulate(scenario, 1).tables["tracks"]
    for asv, speed in enumerate((2.5, 1.0)):
        way = tracks[tracks.vehicle == f"ASV{asv}"]
        gone = np.hypot(np.diff(way.x_m), np.diff(way.y_m)) / np.diff(way.time_s)
        assert gone.max() == pytest.approx(speed, rel=1e-6)


def test_a_prediction_knows_who_carries_what() -> None:
    """Two vessels side by side, one unsure: what is predicted is what missions have."""

    close: Keys = {"model": "positions", "positions_m": [[0, -5], [0, 5]]}

    def made(groups: list[Keys]) -> Scenario:
        return Scenario(
            name="two kinds", duration_s=120.0, survey={"side_m": 60.0}, auvs={"count": 2},
            asvs={"groups": groups, "formation": close}, record={"detail": "summary"},
            acoustics={"hf": {"range_m": 60.0}},
        )  # fmt: skip

    unsure: Keys = {"gnss_sd_m": 25.0}
    cases: list[list[Keys]] = [
        [{"count": 1}, {"count": 1, "usbl": unsure}],
        [{"count": 2, "usbl": unsure}],
        [{"count": 2}],
    ]
    found = []
    for groups in cases:
        setup = Setup(made(groups))
        predicted = predict(inputs_of(setup), setup.stations_m).position_error_m.mean()
        missions = np.mean([simulate(made(groups), seed).auvs.position_error_m
                            for seed in range(4)])  # fmt: skip
        found.append((predicted, missions))
    (mixed, mixed_flown), (bad, _), (good, _) = found
    assert good < mixed < 0.7 * bad
    assert abs(mixed / mixed_flown - 1.0) < 0.4


def test_arrays_of_groups_alone_have_as_many_slow_errors_as_elements() -> None:
    """More of them than the array that no vessel has."""
    array = [
        [0.1, 0, 0],
        [-0.1, 0, 0],
        [0, 0.1, 0],
        [0, -0.1, 0],
        [0, 0, 0.1],
        [0, 0, -0.1],
        [0.1, 0.1, 0.1],
    ]
    usbl = {"slow_share": 0.9, "tdoa_sd_s": 1e-6}
    groups = own_fixes({"groups": [{"count": 2, "usbl": {"array": array}}]}, usbl=usbl)
    alone = own_fixes({"count": 2}, usbl={**usbl, "array": array})
    pd.testing.assert_frame_equal(groups, alone)


# Groups (or, behind a !, all keys of asvs), and what is said of them: below asvs.groups, or !
BAD = """
{count: 2}, {count: 0}
    1.count: must be >= 1; got 0
!groups: [{count: 2}], count: 3
    !asvs.count: is 3, and groups are of 2 = 2 ASVs; remove it, or have them add up
{speed_m_per_s: 1}
    0.count: missing; add it
{count: 1, speed_m_per_s: 1}
    0.speed_m_per_s: is for ASVs that move, and those of
{count: 1, speed_m_s: 1}
    0.speed_m_s: unknown key; did you mean 'speed_m_per_s'?
{count: 1, usbl: {gnss_sd_m: -1}}
    0.usbl.gnss_sd_m: must be >= 0 m; got -1
{count: 1, usbl: {slow_share: 0.5}}
    0.usbl.slow_share: no key of a group, as all vessels have the same; say it in usbl.slow
{count: 1, usbl: {tdoa_sd_s: 0.5}}
    0.usbl.tdoa_sd_s: noise of 0.5 s is
{count: 1, usbl: {preset: seatrac}}
    0.usbl.preset: no usbl preset is named
{count: 1, vehicle: remus100}
    0.vehicle: must be one of moored, otter, cybership2
{count: 1, usbl: {array: [[0,0,0],[1,0,0],[0,1,0],[0,0,1]]}}, {count: 1}
    0.usbl.array: must have as many elements as those of other vessels; they have 4 and 5
!formation: {model: follow}, groups: [{count: 1}, {count: 1, vehicle: otter}]
    !asvs.groups.1.vehicle: otter keeps a station, and follow moves ASVs
!groups: {count: 2}
    !asvs.groups: needs a list of {count, vehicle,
"""


def wrong() -> list[tuple[str, str]]:
    """Return keys of asvs, and the beginning of what is said of them."""
    said = [line.strip() for line in BAD.strip().splitlines()]
    return [
        (
            keys[1:] if keys.startswith("!") else f"groups: [{keys}]",
            told[1:] if told.startswith("!") else f"asvs.groups.{told}",
        )
        for keys, told in zip(said[::2], said[1::2], strict=True)
    ]


@pytest.mark.parametrize(("asvs", "told"), wrong())
def test_a_group_that_cannot_be_is_told_at_its_line(asvs: str, told: str, tmp_path: Path) -> None:
    file = tmp_path / "mixed.yaml"
    file.write_text(f"name: mixed\nasvs: {{{asvs}}}\n")
    with pytest.raises(ScenarioError) as raised:
        load_scenario(file)
    assert any(
        str(it).startswith(f"{file}:2:") and told in str(it) for it in raised.value.mistakes
    ), str(raised.value)


def test_with_passive_ranging_vessels_carry_no_arrays() -> None:
    with pytest.raises(ValueError, match=r"groups.0.usbl: has no effect with passive"):
        mission({"groups": [{"count": 1, "usbl": {"gnss_sd_m": 1.0}}]},
                protocol={"ranging": "passive"})  # fmt: skip


def test_options_reach_into_groups_and_files_keep_them(tmp_path: Path) -> None:
    file = tmp_path / "mixed.yaml"
    file.write_text("name: mixed\nasvs: {groups: [{count: 1, usbl: {heading_sd_deg: 2}}]}\n")
    changes = ["asvs.groups.0.usbl.gnss_sd_m=0.7", "asvs.groups.0.count=2"]
    scenario = load_scenario(file, overrides=changes)
    assert [usbl.gnss_sd for usbl in Setup(scenario).usbls] == [0.7, 0.7]
    assert Scenario.model_validate(scenario.model_dump()) == scenario
    assert not [it for it in warnings_of(scenario) if "asvs.groups" in it.key]

"""The keys of the water: which speed of sound follows from them, and what is refused."""

from pathlib import Path
from typing import Any

import pytest

from bindusbl_des import Scenario, ScenarioError, Setup, load_scenario, simulate, warnings_of
from bindusbl_des.core.sea.water import USUAL_WATER

CAST = "depth_m,temperature_c,salinity_psu\n0,18,30\n10,12,33\n25,8,34\n"


def sea(**environment: Any) -> Scenario:
    return Scenario.model_validate({"name": "m", "duration_s": 8.0, "environment": environment})


def written(folder: Path, environment: str, cast: str = CAST) -> Path:
    """Return a scenario file with a cast beside it."""
    (folder / "cast.csv").write_text(cast)
    file = folder / "mission.yaml"
    file.write_text(f"name: m\nduration_s: 8\nenvironment: {environment}\n")
    return file


def tables(scenario: Scenario) -> dict[str, list[Any]]:
    result = simulate(scenario, 1)
    return {name: table.to_pylist() for name, table in result.arrow.items()}


def test_by_default_the_speed_is_given() -> None:
    assert Setup(sea()).sound_speed_m_per_s == 1500.0
    assert Setup(sea(sound_speed_m_per_s=1482.5)).sound_speed_m_per_s == 1482.5
    assert Setup(sea()).water == USUAL_WATER


def test_temperature_salinity_and_law_change_the_speed() -> None:
    """Between surface and 10 m a sea of 10 degC and 35 psu is as fast as at 5 m."""
    assert Setup(sea(temperature_c=10.0)).sound_speed_m_per_s == pytest.approx(
        1489.884905, abs=1e-4
    )
    fresher = Setup(sea(temperature_c=10.0, salinity_psu=30.0)).sound_speed_m_per_s
    assert fresher == pytest.approx(1489.884905 - 5 * 1.340 + 5 * 0.1025, abs=1e-4)
    by_medwin = sea(temperature_c=10.0, sound_speed_law="medwin")
    assert Setup(by_medwin).sound_speed_m_per_s == pytest.approx(1490.15 - 0.08, abs=1e-4)
    by_teos = sea(
        temperature_c=10.0, sound_speed_law="teos10", origin={"lat_deg": 47.0, "lon_deg": -30.0}
    )
    assert Setup(by_teos).sound_speed_m_per_s == pytest.approx(1489.981970 - 0.0816, abs=1e-3)
    assert Setup(sea(temperature_c=4.0, salinity_psu=7.0)).water == (4.0, 7.0, 10.0)


def test_the_fleet_may_assume_another_speed() -> None:
    """It works with the true one unless told otherwise, and is 0.7 % off if it was."""
    scenario = sea(temperature_c=10.0)
    assert Setup(scenario).assumed_sound_speed_m_per_s == Setup(scenario).sound_speed_m_per_s
    wrong = sea(temperature_c=10.0, assumed_sound_speed_m_per_s=1500.0)
    assert Setup(wrong).assumed_sound_speed_m_per_s == 1500.0


@pytest.mark.parametrize("ranging", ["owtt_sync", "twtt", "passive"])
@pytest.mark.parametrize("downlink", ["sequential", "direct_reply"])
def test_a_mission_in_known_water_is_one_at_its_speed(ranging: str, downlink: str) -> None:
    """Everything works with the speed that follows: tables are those of the same speed given."""
    protocol = {"ranging": ranging, "downlink": downlink}
    known = {"temperature_c": 7.0, "salinity_psu": 31.0}
    base = {"name": "m", "duration_s": 8.0, "protocol": protocol}
    measured = Scenario.model_validate({**base, "environment": known})
    speed = {"sound_speed_m_per_s": Setup(measured).sound_speed_m_per_s}
    given = Scenario.model_validate({**base, "environment": speed})
    assert tables(measured) == tables(given)
    assert tables(given) != tables(Scenario.model_validate(base))


def test_a_cast_is_sought_beside_the_scenario(tmp_path: Path) -> None:
    scenario = load_scenario(written(tmp_path, "{ctd: cast.csv}"))
    assert scenario.environment.ctd == str(tmp_path / "cast.csv")
    shallow = load_scenario(tmp_path / "mission.yaml", overrides=["survey.depth_m=1"])
    assert (
        Setup(scenario).sound_speed_m_per_s < Setup(shallow).sound_speed_m_per_s
    )  # colder further down
    assert Setup(scenario).water == pytest.approx((15.0, 31.5, 10.0))
    assert len(simulate(scenario, 1).tables["fixes"]) > 0


def test_results_take_the_cast_along(tmp_path: Path) -> None:
    """A folder of results is read where the cast is no longer, with the same speed."""
    from bindusbl_des import load_result

    (tmp_path / "plan").mkdir()
    scenario = load_scenario(written(tmp_path / "plan", "{ctd: cast.csv}"))
    simulate(scenario, 1).write(tmp_path / "run")
    speed = Setup(scenario).sound_speed_m_per_s
    (tmp_path / "plan" / "cast.csv").unlink()
    assert Setup(load_result(tmp_path / "run").scenario).sound_speed_m_per_s == speed


@pytest.mark.parametrize(
    ("environment", "key", "message"),
    [
        ("{ctd: cast.csv, temperature_c: 8}", "environment.ctd", "remove temperature_c"),
        (
            "{ctd: cast.csv, sound_speed_m_per_s: 1500}",
            "environment.sound_speed_m_per_s",
            "follows from ctd; keep one of them",
        ),
        (
            "{temperature_c: 8, sound_speed_m_per_s: 1490}",
            "environment.sound_speed_m_per_s",
            "follows from temperature_c; keep one",
        ),
        (
            "{temperature_c: 8, sound_speed_law: teos10}",
            "environment.sound_speed_law",
            "set environment.origin, or use mackenzie",
        ),
        (
            "{temperature_c: 8, sound_speed_law: teos10, origin: {lat_deg: -86.1, lon_deg: 0}}",
            "environment.sound_speed_law",
            "no water south of 86 deg S; use mackenzie",
        ),
        ("{ctd: other.csv}", "environment.ctd", "no such file"),
    ],
)
def test_contradictions_are_refused(
    tmp_path: Path, environment: str, key: str, message: str
) -> None:
    with pytest.raises(ScenarioError) as told:
        load_scenario(written(tmp_path, environment))
    assert len(told.value.mistakes) == 1
    assert told.value.mistakes[0].key == key
    assert message in told.value.mistakes[0].message


def test_wrong_casts_are_told_at_their_key(tmp_path: Path) -> None:
    """Once each: a file that is wrong, and one that ends above the survey."""
    for cast, message in (
        ("depth_m,temperature_c,salinity_psu\n0,18,30\n9,hot,33\n", "cast.csv:3: temperature_c"),
        ("depth_m,sound_speed_m_per_s\n0,1500\n9,1490\n", "ends at 9 m, above the survey at 10 m"),
    ):
        with pytest.raises(ScenarioError) as told:
            load_scenario(written(tmp_path, "{ctd: cast.csv}", cast))
        assert [it.key for it in told.value.mistakes] == ["environment.ctd"]
        assert message in told.value.mistakes[0].message


def test_without_gsw_teos10_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        "bindusbl_des.core.scenario.agreement.instruments.find_spec", lambda _: None
    )
    with pytest.raises(ValueError, match=r"pip install 'bindusbl-des\[ocean\]'"):
        sea(temperature_c=8.0, sound_speed_law="teos10", origin={"lat_deg": 1, "lon_deg": 2})


def test_a_whole_section_written_out_is_no_contradiction() -> None:
    """What the program writes names all keys, also the speed that was not given."""
    scenario = sea(temperature_c=8.0)
    whole = scenario.model_dump(mode="json")
    assert Scenario.model_validate(whole) == scenario
    del whole["environment"]["wind"]  # as a version before wrote it, which had no such key
    assert Scenario.model_validate(whole) == scenario


def test_keys_without_effect_are_named() -> None:
    told = {
        it.key: it.message for it in warnings_of(sea(salinity_psu=30.0, sound_speed_law="medwin"))
    }
    assert "environment.temperature_c: null" in told["environment.salinity_psu"]
    assert "the speed of sound is given" in told["environment.sound_speed_law"]
    assert not list(
        warnings_of(sea(temperature_c=8.0, salinity_psu=30.0, sound_speed_law="medwin"))
    )

"""A modem by name: its figures stand for keys that are not given; contradictions are refused."""

from pathlib import Path
from typing import Any

import pytest

from bindusbl_des import Scenario, ScenarioError, load_result, load_scenario, simulate, warnings_of
from bindusbl_des.core.results.result import scenario_sha256
from bindusbl_des.models.presets.modems import table_file

S2C_FILE = "recovery_140m_s2c"


def bands(**acoustics: Any) -> Scenario:
    """Return the default scenario with other bands."""
    return Scenario.model_validate({"name": "m", "acoustics": acoustics})


def told(scenario: Scenario) -> dict[str, str]:
    """Return the warnings, by their keys."""
    return {found.key: found.message for found in warnings_of(scenario)}


def test_figures_stand_for_keys_that_are_not_given() -> None:
    """What the sheet says of the band; what it does not say keeps its default."""
    mf = bands(mf={"modem": "s2cr_48_78"}).acoustics.mf
    assert (mf.range_m, mf.transmit_w, mf.receive_w) == (1000.0, 60.0, 1.1)
    assert (mf.bit_rate_bps, mf.overhead, mf.idle_w) == (2000.0, 2.0, None)
    assert bands(hf={"modem": "sonardyne_wideband2"}).acoustics.hf.ping_s == 0.008
    assert bands(mf={"modem": "s2c_instant"}).acoustics.mf.payload_bytes == 64


def test_a_modem_of_null_is_none() -> None:
    assert bands(mf={"modem": None}) == bands()


def test_what_is_given_wins_and_is_told() -> None:
    scenario = bands(mf={"modem": "s2cr_48_78", "range_m": 300, "receive_w": 1.1})
    assert scenario.acoustics.mf.range_m == 300.0
    assert told(scenario) == {
        "acoustics.mf.range_m": "is 300, not the 1000 of the modem s2cr_48_78: what is given wins"
    }


def test_figures_are_not_taken_for_given() -> None:
    """Nobody is told that a rate does nothing which stands in a sheet, not in the file."""
    direct = {"protocol": {"downlink": {"model": "direct_reply", "reply": "instant"}}}
    data = {"name": "m", "acoustics": {"mf": {"modem": "micromodem_psk6"}}, **direct}
    assert list(told(Scenario.model_validate(data))) == ["acoustics.mf.modem"]


def test_another_modem_brings_its_own_figures() -> None:
    """An option lays a name over a file, not over the figures that the file's modem had."""
    changed = load_scenario(S2C_FILE, overrides=["acoustics.mf.modem=micromodem_psk6"]).acoustics.mf
    assert (changed.airtimes, changed.payload_bytes, changed.bit_rate_bps) == (None, 192, 490.0)
    bare = load_scenario(S2C_FILE, overrides=["acoustics.mf.modem=null"]).acoustics.mf
    assert (bare.airtimes, bare.payload_bytes, bare.transmit_w) == (None, None, None)


def test_rates_do_nothing_beside_a_table() -> None:
    found = told(bands(mf={"modem": "s2c_instant", "bit_rate_bps": 100.0}))
    assert "has no effect with acoustics.mf.airtimes" in found["acoustics.mf.bit_rate_bps"]


def test_names_that_are_wrong() -> None:
    with pytest.raises(ValueError, match="no modem preset is named 's2c_instnt'; did you mean"):
        bands(mf={"modem": "s2c_instnt"})
    with pytest.raises(ValueError, match="no modem preset is named 'fax'; there are s2c_instant,"):
        bands(hf={"modem": "fax"})


@pytest.mark.parametrize(
    ("mf", "why"),
    [
        ({"modem": "m64"}, "a message of 8 B holds no fix, .* = 24 B"),
        ({"payload_bytes": 23}, "a message of 23 B holds no fix"),
        ({"modem": "s2c_instant", "payload_bytes": 65}, "65 B exceed the table .* 64 B"),
        ({"modem": "s2c_instant", "fix_bytes": 60}, "a message of 64 B holds no fix"),
    ],
)
def test_messages_that_cannot_be_sent_are_refused(mf: dict[str, Any], why: str) -> None:
    with pytest.raises(ValueError, match=why):
        bands(mf=mf)
    quiet = {
        "name": "m",
        "acoustics": {"mf": mf},
        "protocol": {"downlink": {"model": "direct_reply", "reply": "instant"}},
    }
    assert Scenario.model_validate(quiet).protocol.downlink == "direct_reply"


def test_a_table_that_is_not_there_is_refused_whatever_is_sent() -> None:
    for downlink in ("sequential", "direct_reply"):
        data = {"name": "m", "acoustics": {"mf": {"airtimes": "/no/table.csv"}}}
        with pytest.raises(ValueError, match="No such file"):
            Scenario.model_validate({**data, "protocol": {"downlink": downlink}})


def test_a_backlog_that_grows_is_told() -> None:
    few = {"name": "m", "auvs": {"count": 4}, "asvs": {"count": 1}}
    mf = {"modem": "s2c_instant", "overfull": "oldest_first"}
    found = told(Scenario.model_validate({**few, "acoustics": {"mf": mf}}))
    assert "holds 3 fixes and a round may bring 4" in found["acoustics.mf.overfull"]
    three = {**few, "auvs": {"count": 3}, "acoustics": {"mf": mf}}
    assert told(Scenario.model_validate(three)) == {}


def test_a_guard_shorter_than_the_way_of_answers_is_told() -> None:
    own = {"downlink": "direct_reply", "schedule": "one_per_slot", "downlink_guard_s": 0.01}
    found = told(Scenario.model_validate({"name": "m", "protocol": own}))
    assert "ends 0.01 s after its answer" in found["protocol.downlink_guard_s"]
    assert "MF range (0.06667 s)" in found["protocol.downlink_guard_s"]
    enough = {**own, "downlink_guard_s": 0.07}
    assert told(Scenario.model_validate({"name": "m", "protocol": enough})) == {}


def test_a_table_of_ones_own_goes_with_the_results(tmp_path: Path) -> None:
    """Named beside the scenario, copied into its folder by its contents, read back from there."""
    (tmp_path / "mine.csv").write_text(
        "payload_bytes,airtime_s\n" + "".join(f"{n},{0.01 * n:.2f}\n" for n in range(1, 65))
    )
    (tmp_path / "m.yaml").write_text(
        "name: m\nduration_s: 5\nauvs: {count: 1}\nasvs: {count: 1}\n"
        "acoustics: {mf: {airtimes: mine.csv}}\n"
    )
    scenario = load_scenario(tmp_path / "m.yaml")
    result = simulate(scenario)
    assert set(result.tables["broadcasts"].airtime_s) <= {0.08, 0.24}
    result.write(tmp_path / "out")
    assert len(list((tmp_path / "out" / "airtimes").glob("mine-*.csv"))) == 1
    (tmp_path / "mine.csv").unlink()
    again = load_result(tmp_path / "out").scenario
    assert simulate(again).tables["broadcasts"].equals(result.tables["broadcasts"])
    with pytest.raises(ScenarioError, match="no such file"):
        load_scenario(tmp_path / "m.yaml")


def test_frames_of_sizes_that_were_not_measured_take_times_in_between(tmp_path: Path) -> None:
    """8 B and a fix of 16 B lie in the middle of 20 and 28 B, 0.3 s of 0.25 and 0.35 s."""
    (tmp_path / "mine.csv").write_text("payload_bytes,airtime_s\n10,0.1\n20,0.25\n28,0.35\n")
    mf = {"airtimes": str(tmp_path / "mine.csv")}
    few = {"duration_s": 20, "auvs": {"count": 1}, "asvs": {"count": 1}}
    result = simulate(Scenario.model_validate({"name": "m", **few, "acoustics": {"mf": mf}}))
    frames = result.tables["broadcasts"].groupby("fixes").airtime_s.unique()
    assert {size: times.tolist() for size, times in frames.items()} == {1: pytest.approx([0.3])}


def test_results_of_a_preset_mean_the_same_anywhere(tmp_path: Path) -> None:
    """The table that ships is copied as well; scenario and hash are those of the run."""
    scenario = load_scenario(S2C_FILE, overrides=["duration_s=5"])
    assert scenario.acoustics.mf.airtimes == table_file("s2c_airtimes.csv")
    simulate(scenario).write(tmp_path / "out")
    again = load_result(tmp_path / "out").scenario
    assert scenario_sha256(again) == scenario_sha256(scenario)
    assert told(again) == {}
    assert again.acoustics.mf.modem == "s2c_instant"

"""The command `verify`: what it says, writes and refuses."""

import json
from pathlib import Path

import pytest
from commands_for_tests import call

KEYS = {
    "verdict", "accepted", "scenario", "bounds", "pairs", "uplink", "downlink", "conflict_margin",
    "frame", "witness", "remedy",
}  # fmt: skip


def test_a_refusal_says_what_collides_and_what_would_be_accepted(tmp_path: Path) -> None:
    """Following what it says is accepted, and told in lines that fit a terminal."""
    outcome = call("verify", "recovery_140m", "--out", str(tmp_path / "out"))
    assert outcome.exit_code == 1
    lines = outcome.stdout.splitlines()
    assert lines[0] == "recovery_140m: refused: two signals overlap"
    assert max(map(len, lines)) <= 80
    assert "  --set protocol.conflict_margin_m=0.15" in lines
    again = call("verify", "recovery_140m", "--set", "protocol.conflict_margin_m=0.15")
    assert again.exit_code == 0
    assert again.stdout.startswith("recovery_140m: accepted: no two signals overlap")
    witness = tmp_path / "out" / "witness.yaml"
    run = call("run", str(witness), "--no-advice", "--json", "--out", str(tmp_path / "run"))
    assert run.exit_code == 0
    assert json.loads(run.stdout)["collisions"] >= 2 / 3


def test_the_record_says_it_in_numbers(tmp_path: Path) -> None:
    """`--json` prints what is written to verify.json."""
    folder = tmp_path / "out"
    outcome = call("verify", "recovery_140m", "--json", "--max-speed", "3", "--out", str(folder))
    found = json.loads(outcome.stdout)
    assert found == json.loads((folder / "verify.json").read_text())
    assert set(found) == KEYS
    assert (found["verdict"], found["accepted"]) == ("refused", False)
    assert found["bounds"]["max_speed_m_per_s"] == 3.0
    assert found["conflict_margin"]["needed_m"] == pytest.approx(3.0 * 7 / 30)
    assert {"kind", "what", "verdict", "margin_s", "margin_m", "why"} == set(found["pairs"][0])
    assert set(found["uplink"]) == {"set_s", "needed_s", "wasted_s"}
    assert {it["sender"] for it in found["witness"]["signals"]} == {"AUV1", "AUV2"}
    assert found["witness"]["receiver"] == "ASV0"
    assert found["remedy"] == {"protocol.conflict_margin_m": 0.71}


def test_what_is_neither_proved_nor_seen_has_an_exit_code_of_its_own(tmp_path: Path) -> None:
    """Nothing is proved of half duplex on both bands, and no witness claimed."""
    one_band = ("--set", "protocol.duplex=per_node")
    outcome = call("verify", "quickstart", *one_band, "--out", str(tmp_path / "out"))
    assert outcome.exit_code == 3
    assert outcome.stdout.startswith("quickstart: undecided: not proved safe, nor seen to collide")
    found = json.loads((tmp_path / "out" / "verify.json").read_text())
    assert (found["verdict"], found["accepted"], found["witness"]) == ("undecided", False, None)
    assert not (tmp_path / "out" / "witness.yaml").exists()


def test_sound_without_a_range_is_played_before_it_is_called_undecided() -> None:
    """Two AUVs that share a slot by their ranges are heard together where sound goes on."""
    outcome = call("verify", "quickstart", "--set", "acoustics.hf.channel={model: sonar}")
    assert outcome.exit_code == 1
    assert "Witness: AUV0's ping 0 (round 0, slot 0) and AUV1's ping 1" in outcome.stdout


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("--max-speed", "-1"), "--max-speed: must be at least 0 and at most 20 m/s; got -1"),
        (("--clock-error", "nan"), "must be at least 0 and at most 1000 s; got nan"),
        (("--clock-error", "1e308"), "--clock-error: must be at least 0 and at most 1000 s"),
        (("--sound-speed-error", "400"), "leaves the 1300 to 1700 m/s of water"),
    ],
)
def test_impossible_bounds_are_bad_input(words: tuple[str, str], told: str) -> None:
    outcome = call("verify", "recovery_140m", *words)
    assert outcome.exit_code == 2
    assert told in outcome.stderr


def test_no_guard_is_proposed_that_no_scenario_may_have() -> None:
    """Clocks 100 s off need a guard of 200 s, and 60 s is the longest."""
    outcome = call("verify", "quickstart", "--clock-error", "100")
    assert outcome.exit_code == 1
    assert "No guard, margin or schedule is known that would be accepted." in outcome.stdout


def test_a_folder_of_something_else_is_left_alone(tmp_path: Path) -> None:
    """Force replaces a verdict, and nothing else."""
    (tmp_path / "notes.txt").write_text("mine")
    outcome = call("verify", "quickstart", "--out", str(tmp_path), "--force")
    assert outcome.exit_code == 2
    assert "notes.txt" in outcome.stderr
    for words in ((), ("--force",)):
        done = call("verify", "quickstart", "--out", str(tmp_path / "out"), *words)
        assert done.exit_code == 0
    assert call("verify", "quickstart", "--out", str(tmp_path / "out")).exit_code == 2

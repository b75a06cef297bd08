"""Files of curves: what is wrong with one is told with its line, its value and a remedy."""

from pathlib import Path

import pytest

from bindusbl_des import ScenarioError, load_scenario
from bindusbl_des.core.scenario.measured import read_curve
from bindusbl_des.models.presets.modems import table_file

HEAD = "range_m,delivery_ratio\n"


def test_columns_in_any_order_and_others_beside_them(tmp_path: Path) -> None:
    path = tmp_path / "c.csv"
    path.write_text("modem, delivery_ratio ,range_m\na,1,0\n\na,0.5,80\n")
    assert read_curve(path)[:2] == ((0.0, 80.0), (1.0, 0.5))


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", ":1: column range_m, delivery_ratio missing"),
        ("range_m,ratio\n1,1\n", ":1: column delivery_ratio missing"),
        (HEAD, ": has no points"),
        (HEAD + "10,0.9\n20\n", ":3: delivery_ratio is ''; give a number, such as `50,0.95`"),
        (HEAD + "ten,0.9\n", ":2: range_m is 'ten'; give a number"),
        (HEAD + "-1,0.9\n", ":2: range_m is -1; give metres from 0 on"),
        (HEAD + "10,90\n", ":2: delivery_ratio is 90, not within 0 and 1; divide per cent by 100"),
        (HEAD + "10,nan\n", ":2: delivery_ratio is nan, not within 0 and 1; give a share of 1"),
        (HEAD + "20,1\n10,1\n", ":3: range_m is 10 after 20; sort the lines by range"),
    ],
)
def test_what_is_wrong_is_told_at_its_key(text: str, told: str, tmp_path: Path) -> None:
    (tmp_path / "c.csv").write_text(text)
    lines = "name: m\nacoustics:\n  mf: {channel: {model: curve, file: c.csv}}\n"
    (tmp_path / "m.yaml").write_text(lines)
    with pytest.raises(ScenarioError) as error:
        load_scenario(tmp_path / "m.yaml")
    assert "m.yaml:3:" in str(error.value)
    assert "acoustics.mf.channel.file: " in str(error.value)
    assert f"c.csv{told}" in str(error.value)


def test_a_curve_needs_its_file(tmp_path: Path) -> None:
    (tmp_path / "m.yaml").write_text("name: m\nacoustics: {hf: {channel: curve}}\n")
    with pytest.raises(ScenarioError, match=r"acoustics\.hf\.channel\.file: missing; add it"):
        load_scenario(tmp_path / "m.yaml")


def test_pings_have_no_bits(tmp_path: Path) -> None:
    lines = "name: m\nacoustics: {hf: {channel: {model: sonar, decoding: bpsk}}}\n"
    (tmp_path / "m.yaml").write_text(lines)
    with pytest.raises(ScenarioError, match=r"hf.channel.decoding: must be .*; got .*bpsk"):
        load_scenario(tmp_path / "m.yaml")


def test_shipped_curves_can_be_read() -> None:
    """One is a modem's preset, one lies beside the scenarios."""
    names = (
        table_file("ahoi_delivery.csv"),
        Path(__file__).parents[2] / "scenarios/hermes_delivery.csv",
    )
    assert [len(read_curve(name)[0]) for name in names] == [6, 5]

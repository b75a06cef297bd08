"""Presets: every number has a unit, a tag and a source; tables are read as they are printed."""

import csv
import json
from pathlib import Path
from typing import Any

import pytest
from commands_for_tests import call

import bindusbl_des
from bindusbl_des import Scenario, Setup, warnings_of
from bindusbl_des.models.presets.modems import airtime_table

S2C = str(Path(bindusbl_des.__file__).with_name("models") / "presets" / "s2c_airtimes.csv")
ALL = json.loads(call("presets", "--json").output)
MODEMS = [it for it in ALL if it["kind"] == "modem"]


@pytest.mark.parametrize("it", ALL, ids=lambda it: it["name"])
def test_every_figure_has_a_unit_a_tag_and_a_source(it: dict[str, Any]) -> None:
    assert it["figures"]
    assert it["name"].isidentifier()
    for name, figure in it["figures"].items():
        assert figure["tag"] in ("M", "S", "2", "calc"), name
        assert len(figure["source"]) > 10, name
        assert figure["unit"] or isinstance(figure["value"], str), name


@pytest.mark.parametrize(
    "it", [it for it in MODEMS if "bit_rate_bps" in it["figures"]], ids=lambda it: it["name"]
)
def test_a_bit_rate_says_whose_bits_these_are(it: dict[str, Any]) -> None:
    """And how that is known; nothing falls back to the paper's two bits sent for each."""
    assert len(it["figures"]["overhead"]["source"]) > 10


def test_a_message_of_a_seatrac_takes_eighty_ms_a_byte() -> None:
    """24 bytes 1.92 s, as its maker's manual has it; 3.84 s with the paper's overhead."""
    mission = Scenario(name="m", acoustics={"mf": {"modem": "seatrac"}})
    assert Setup(mission).messages.airtime(1) == pytest.approx(1.92)
    assert not [it for it in warnings_of(mission) if "overhead" in it.message]


@pytest.mark.parametrize(
    ("mf", "is_told"),
    [
        ({"bit_rate_bps": 100.0}, True), ({"bit_rate_bps": 100.0, "overhead": 1.0}, False),
        ({"bit_rate_bps": 100.0, "overhead": 2.0}, False), ({"bit_rate_bps": 2000.0}, False),
        ({}, False), ({"overhead": 1.5}, False),
        ({"modem": "s2cr_48_78", "bit_rate_bps": 100.0}, True),
        ({"modem": "seatrac", "bit_rate_bps": 200.0}, False),
        ({"modem": "s2c_instant", "bit_rate_bps": 200.0}, False),
    ],
)  # fmt: skip
def test_a_bit_rate_without_a_word_on_overhead_is_told(mf: dict[str, Any], is_told: bool) -> None:
    found = [it for it in warnings_of(Scenario(name="m", acoustics={"mf": mf}))
             if "given without overhead" in it.message]  # fmt: skip
    assert bool(found) == is_told
    if is_told:
        assert found[0].key == "acoustics.mf.bit_rate_bps"
        assert "takes 3840 ms" in found[0].message
        assert "1920 ms" in found[0].message
    passive = Scenario(name="m", acoustics={"mf": mf}, protocol={"ranging": "passive"})
    assert "given without overhead" not in str(warnings_of(passive))


@pytest.mark.parametrize(
    ("usbl", "perfect"),
    [
        ({"preset": "seatrac_x150"}, ["compass", "GNSS", "mounting"]),
        ({"preset": "cerulean_rovl"}, ["GNSS", "mounting"]),  # whose budget has its compass in it
        ({"preset": "evologics_oem"}, ["GNSS", "mounting"]),
        ({"preset": "ugps_g2_gnss"}, ["compass", "mounting"]),
        ({"preset": "seatrac_x150", "heading_sd_deg": 0.5, "gnss_sd_m": 0.0}, ["mounting"]),
        (
            {"preset": "seatrac_x150", "heading_sd_deg": 0.5, "gnss_correlated_sd_m": 1.0,
             "misalignment_sd_deg": 0.0},
            [],
        ),
        ({"model": {"model": "datasheet", "bearing_sd_deg": 1.0}}, []),
    ],
)  # fmt: skip
def test_what_a_usbl_is_installed_with_is_not_taken_for_perfect_unsaid(
    usbl: dict[str, Any], perfect: list[str]
) -> None:
    """A sheet is of the array: compass, GNSS, mounting are the vessel's unless it says."""
    found = [it for it in warnings_of(Scenario.model_validate({"name": "m", "usbl": usbl}))
             if it.key == "usbl.preset"]  # fmt: skip
    told = "".join(it.message for it in found)
    assert [what for what in ("compass", "GNSS", "mounting") if f"{what} (" in told] == perfect
    assert bool(found) == bool(perfect)


def test_no_two_presets_have_one_name() -> None:
    names, kinds = [it["name"] for it in ALL], {it["kind"] for it in ALL}
    assert len({*names, *kinds}) == len(names) + len(kinds)


def test_all_airtimes_of_the_s2c_come_out_to_the_last_digit() -> None:
    """64 payloads; DESERT Underwater's own extremes are 0.172102 and 0.860338 s."""
    table = airtime_table(S2C)
    with Path(S2C).open() as stream:
        printed = [row["airtime_s"] for row in csv.DictReader(stream)]
    assert [f"{table.airtime(size):.6f}" for size in range(1, 65)] == printed
    assert (table.airtime(1), table.airtime(56), table.airtime(64)) == (
        0.172102,
        0.770201,
        0.860338,
    )
    assert table.most_bytes == 64


def test_a_delay_below_the_first_that_was_measured_is_that_one() -> None:
    table = airtime_table(S2C)
    assert {table.delay(size) for size in range(1, 21)} == {0.088179}
    assert table.delay(21) == 0.088342


def test_a_table_of_ones_own(tmp_path: Path) -> None:
    own = tmp_path / "mine.csv"
    own.write_text("payload_bytes,airtime_s,processing_delay_mean_s\n1,0.5,\n2,0.75,0.1\n3,1,\n")
    table = airtime_table(str(own))
    assert table.airtimes_s == (0.5, 0.75, 1.0)
    assert table.delays_s == (0.1, 0.1, 0.1)
    own.write_text("payload_bytes,airtime_s\n1,0.25\n")
    assert airtime_table(str(own)).delays_s == (0.0,)


def test_between_payloads_that_were_measured_times_go_straight(tmp_path: Path) -> None:
    """Below the smallest they are that one's; delays have gaps of their own."""
    own = tmp_path / "mine.csv"
    own.write_text(
        "payload_bytes,airtime_s,processing_delay_mean_s\n"
        "4,0.4,\n8,0.5,0.1\n9.0,0.5,\n13,0.9,\n16,1.5,0.18\n"
    )
    table = airtime_table(str(own))
    assert table.most_bytes == 16
    times = [table.airtime(size) for size in (1, 4, 6, 8, 9, 10, 13, 14, 16)]
    assert times == pytest.approx([0.4, 0.4, 0.45, 0.5, 0.5, 0.6, 0.9, 1.1, 1.5], abs=1e-12)
    delays = [table.delay(size) for size in (1, 8, 9, 12, 16)]
    assert delays == pytest.approx([0.1, 0.1, 0.11, 0.14, 0.18], abs=1e-12)
    own.write_text("payload_bytes,airtime_s,processing_delay_mean_s\n2,1,0.3\n65535,2,\n")
    wide = airtime_table(str(own))
    assert (wide.most_bytes, wide.delay(1), wide.delay(65_535)) == (65_535, 0.3, 0.3)
    assert wide.airtime(65_535) == 2.0


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("bytes,airtime_s\n1,0.5\n", "1: a line of a table of airtimes that has no columns"),
        ("payload_bytes,airtime_s\n3,0.5\n3,0.6\n", "3: .* is for '3' bytes; .* from 4 to at most"),
        ("payload_bytes,airtime_s\n8,0.5\n2,0.6\n", "3: .* is for '2' bytes; .* from 9 to at most"),
        ("payload_bytes,airtime_s\n0,0.5\n", "2: .* is for '0' bytes; .* from 1 to at most 65535"),
        ("payload_bytes,airtime_s\n1.5,0.5\n", "2: .* is for '1.5' bytes; these are whole"),
        ("payload_bytes,airtime_s\n1e9,0.5\n", "2: .* is for '1e9' bytes; these are whole"),
        ("payload_bytes,airtime_s\nfew,0.5\n", "2: .* is for 'few' bytes; these are whole"),
        ("payload_bytes,airtime_s\n1,soon\n", "2: .* has the airtime_s 'soon', which is no time"),
        ("payload_bytes,airtime_s\n1,-1\n", "2: .* '-1', which is no time"),
        (f"payload_bytes,airtime_s\n1,{'9' * 200_000}\n", "mine.csv: cannot be read as a CSV file"),
        ("payload_bytes,airtime_s\n", "2: .* is the first of the table, and there is none"),
    ],
)
def test_wrong_tables_are_told_with_their_line(tmp_path: Path, text: str, told: str) -> None:
    own = tmp_path / "mine.csv"
    own.write_text(text)
    with pytest.raises(ValueError, match=told):
        airtime_table(str(own))


def test_a_table_that_is_not_there() -> None:
    with pytest.raises(ValueError, match=r"none\.csv: .* No such file"):
        airtime_table("none.csv")


def test_names_that_are_nearly_right() -> None:
    with pytest.raises(ValueError, match="did you mean 's2c_instant'"):
        Setup(Scenario(name="m", acoustics={"mf": {"modem": "s2c_instnt"}}))


def test_the_command_lists_number_unit_tag_and_source() -> None:
    told = call("presets", "micromodem_psk6")
    assert told.exit_code == 0
    assert "transmit_w     50 W       [M] http://acomms.whoi.edu/micro-modem" in told.output
    found = json.loads(call("presets", "modem", "--json").output)
    assert {it["name"] for it in found} == {it["name"] for it in MODEMS}
    figure = next(it for it in found if it["name"] == "s2cr_48_78")["figures"]["receive_w"]
    assert (figure["value"], figure["unit"], figure["tag"]) == (1.1, "W", "2")
    wrong = call("presets", "modm")
    assert (wrong.exit_code, wrong.output) == (
        2,
        "no preset, and no kind of presets, is named 'modm'; did you mean 'modem'?\n",
    )


def test_the_manual_lists_every_modem() -> None:
    """One line for each; `presets` has its figures."""
    page = (Path(__file__).parents[2] / "docs" / "modems.md").read_text()
    for it in MODEMS:
        assert f"| `{it['name']}` | {it['title']} |\n" in page, it["name"]


def test_presets_say_since_when_where_their_source_does() -> None:
    dated = {it["name"]: it["since"] for it in ALL if it["since"]}
    assert dated == {
        "nanomodem_v3": "2018-10",
        "evologics_oem": "2024",
        "rlg_dvl_sea": "2013",
        "rlg_dvl_river": "2013",
    }
    for name, year in dated.items():  # each stands in the source of a figure
        [preset] = [it for it in ALL if it["name"] == name]
        named = "october2018" if name == "nanomodem_v3" else year
        assert any(named in figure["source"] for figure in preset["figures"].values())
    said = call("presets").output
    assert "measured, 2013)" in said
    assert "stated, no date stated)" in said

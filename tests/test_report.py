"""Reports: what they say is what the tables hold, and they ask the network for nothing."""

import base64
import json
import math
import re
import zlib
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from worlds import paper_case, scenario, still

from bindusbl_des import Result, load_result, load_scenario, simulate
from bindusbl_des.cli import main
from bindusbl_des.launch import asv_stations
from bindusbl_des.report import run_data
from bindusbl_des.report.envelope import error_envelope
from bindusbl_des.report.packing import Packer
from bindusbl_des.report.page import as_script
from bindusbl_des.report.recording import FATES, recording
from bindusbl_des.report.remedies import Trial, remedies
from bindusbl_des.report.run_page import AUV_COLUMNS, run_page
from bindusbl_des.report.service import patience, service
from bindusbl_des.report.story import story

SCENARIOS = Path(__file__).parents[1] / "scenarios"
MEGABYTE = 1e6


@pytest.fixture(scope="module")
def recovery() -> Result:
    """The paper's recovery mission."""
    return simulate(load_scenario(SCENARIOS / "recovery_140m.yaml"), seed=0)


def told(result: Result) -> str:
    """Return all sentences of a run's story."""
    found = story(recording(result))
    return "\n".join([found.verdict, *(text for _, texts in found.sections for text in texts)])


def unpacked(place: dict[str, Any], packed: str) -> np.ndarray:
    """Return a column as a page unpacks it."""
    data = zlib.decompress(base64.b64decode(packed), -15)
    start, length = 4 * place["at"], place["length"]
    planes = np.frombuffer(data[start : start + 4 * length], np.uint8).reshape(4, length)
    zigzag = np.ascontiguousarray(planes.T).view(np.uint32).ravel().astype(np.int64)
    steps = (zigzag >> 1) ^ -(zigzag & 1)
    for _ in range(place["order"]):
        steps = np.cumsum(steps)
    steps = (steps + 2**31) % 2**32 - 2**31
    return np.where(steps == -(2**31), np.nan, steps * place["quantum"])


@pytest.mark.parametrize(
    "column",
    [
        [],
        [0.25],
        [1.0, math.nan, -3.5, math.nan],
        [-1e6, 1e6, 0.0, 12345.678],
        list(np.arange(100) / 2),
        [1e9, -1e9, 0.5],
    ],
    ids=["empty", "one", "missing", "wide", "regular", "beyond 31 bits"],
)
def test_columns_come_back(column: list[float]) -> None:
    """A packed column is the same again, to half a quantum; what is missing stays missing."""
    packer = Packer()
    packer.add([7.0, 8.0])  # something before it
    place = packer.add(column, quantum=0.001)
    again = unpacked(place, packer.text())
    assert place["quantum"] <= 1.0
    np.testing.assert_allclose(again, column, atol=place["quantum"] * 0.5001, rtol=0)


class Cells(HTMLParser):
    """The rows of the tables of a page."""

    def __init__(self) -> None:
        super().__init__()
        self.rows: list[list[str]] = []
        self._open = False

    def handle_starttag(self, tag: str, attrs: Any) -> None:
        if tag == "tr":
            self.rows.append([])
        self._open = tag in ("td", "th")
        if self._open:
            self.rows[-1].append("")

    def handle_endtag(self, tag: str) -> None:
        if tag in ("td", "th"):
            self._open = False

    def handle_data(self, data: str) -> None:
        if self._open:
            self.rows[-1][-1] += data


def test_the_table_of_a_page_is_the_table_of_the_run(recovery: Result) -> None:
    """Each AUV's rows hold its metrics, in the units that the headings name."""
    cells = Cells()
    cells.feed(run_page(recovery))
    rows: dict[str, list[str]] = {}
    for row in cells.rows:
        rows.setdefault(row[0], []).extend(row[1:])
    for auv in recovery.auvs.itertuples():
        for shown, (_, _, metric, digits, factor) in zip(rows[auv.auv], AUV_COLUMNS, strict=True):
            assert float(shown) == pytest.approx(getattr(auv, metric) * factor, abs=10**-digits)
    lost = [metric for _, _, metric, *_ in AUV_COLUMNS].index("receptions_lost")
    assert rows["AUV0"][lost] == str(recovery.auvs.receptions_lost[0])


def test_the_worst_auv_stands_out(recovery: Result) -> None:
    """In a column whose AUVs differ the worst one's cell is marked; a tile names it."""
    page, mission = run_page(recovery), recovery.arrow["mission"].to_pylist()[0]
    marked = re.findall(r'<td class="worst">([^<]*)</td>', page)
    expected = [
        f"{mission['worst_' + metric] * factor:.{digits}f}"
        for _, _, metric, digits, factor in AUV_COLUMNS
        if f"worst_{metric}" in mission and recovery.auvs[metric].nunique() > 1
    ]
    assert marked == expected
    worst = mission["worst_position_error_m"], mission["worst_position_error_m_auv"]
    assert "<small>{1}: {0:.2f}</small>".format(*worst) in page


def test_the_tracks_of_a_page_are_those_of_the_run(recovery: Result) -> None:
    """Positions are true to a centimetre, errors to a millimetre."""
    page = run_page(recovery)
    data = json.loads(re.findall(r'id="data">(.*?)</script>', page)[0])
    packed = re.findall(r'id="packed">(.*?)</script>', page)[0]
    track = recovery.tables["tracks"]
    for auv in data["auvs"]:
        own = track[track.vehicle == auv["name"]]
        for name, column, tolerance in (
            ("x", own.x_m, 0.0051),
            ("error", own.position_error_m, 6e-4),
        ):
            np.testing.assert_allclose(unpacked(auv[name], packed), column, atol=tolerance)
    delivered = unpacked(data["fixes"]["delivered"], packed)
    fixes = recovery.tables["fixes"]
    np.testing.assert_allclose(delivered, fixes.delivered_at_s.to_numpy(), atol=6e-5)
    outcomes = unpacked(data["receptions"]["outcome"], packed)
    receptions = recovery.tables["receptions"].outcome
    for code, name in enumerate(data["outcomes"]):
        assert (outcomes == code).sum() == (receptions == name).sum()


def test_a_page_loads_nothing_and_is_small(recovery: Result) -> None:
    """The recovery mission's page is below 2 MB and refers to no other file."""
    page = run_page(recovery)
    assert len(page.encode()) < 0.5 * MEGABYTE
    assert not re.search(r"""(src|href)\s*=\s*["']?(https?:)?//|@import|url\(""", page)
    assert "default-src 'none'" in page
    assert "MIT License" in page  # of the library in it


def test_names_cannot_break_a_page() -> None:
    """A scenario's name is shown as it is, whatever it looks like."""
    mission = scenario(name="</script><b>&", duration_s=3.0)
    page = run_page(simulate(mission))
    assert "</script><b>" not in page
    assert "<h1>&lt;/script&gt;&lt;b&gt;&amp;</h1>" in page
    assert json.loads(as_script({"a": "</script>\u2028"})) == {"a": "</script>\u2028"}


def test_a_run_without_events_says_so() -> None:
    """With `detail: summary` the page has the metrics, and says why it has no more."""
    result = simulate(paper_case(3, duration_s=10.0))
    page = run_page(result)
    assert "record.detail=full" in page
    assert 'id="slider"' not in page
    assert f"{result.auvs.position_error_m[0]:.2f}" in page


def test_who_was_out_of_range_is_told() -> None:
    """An AUV 20 m from an ASV that hears 12 m far: all pings, distance, range needed."""
    result = simulate(still(1, at=20.0, acoustics={"hf": {"range_m": 12.0}}), seed=0)
    pings = int(result.auvs.pings[0])
    text = told(result)
    assert f"of {pings} pings it sent in those gaps, {pings} (100 %) were out of HF range" in text
    assert "nearest ASV was 20 m away" in text
    assert "an HF range of 20 m instead of 12 m" in text
    assert "AUV0 starved: 300 of 300 s (100 %)" in text


def test_fixes_beyond_mf_range_are_told() -> None:
    """An AUV that is heard but not reached by broadcasts starves for that reason."""
    acoustics = {"hf": {"range_m": 50.0}, "mf": {"range_m": 15.0}}
    result = simulate(still(1, at=20.0, acoustics=acoustics), seed=0)
    text = told(result)
    assert "the fix was broadcast beyond MF range of the AUV" in text
    assert "acoustics.mf.range_m=20" in text
    assert "of every ASV" not in text


def test_collisions_are_told() -> None:
    """AUVs that all ping at once, as far from the ASV, destroy each other's pings."""
    result = simulate(
        still(2, at=20.0, protocol={"schedule": "schedules_for_tests:all_at_once"}), seed=0
    )
    text = told(result)
    assert "collided with another ping" in text
    assert "protocol.schedule=one_per_slot" in text


def test_nobody_starves_under_a_good_asv() -> None:
    """An AUV near an ASV, without losses: the longest wait is told, and nothing to mend."""
    result = simulate(still(1, at=20.0, duration_s=60.0), seed=0)
    text = told(result)
    assert text.startswith("No AUV starved; the longest wait for a fix was")
    assert "Nothing: pings were in range" in text


def test_gaps_and_fates_add_up(recovery: Result) -> None:
    """Gaps are the waits above the patience; the fates of all pings are those in the tables."""
    mission = recording(recovery)
    wait = patience(mission)
    fixes, outcomes = recovery.tables["fixes"], recovery.tables["receptions"].outcome
    for auv in range(3):
        arrivals = fixes[fixes.auv == f"AUV{auv}"].delivered_at_s.dropna().sort_values()
        waits = np.diff([0.0, *arrivals, 300.0])
        served = service(mission, auv, wait)
        assert [gap.length for gap in served.gaps] == pytest.approx(waits[waits > wait].tolist())
    counts = {name: int((mission.fate == code).sum()) for code, name in enumerate(FATES)}
    assert sum(counts.values()) == len(recovery.tables["pings"])
    assert counts["delivered"] == (fixes.outcome == "delivered").sum()
    assert counts["out_of_hf"] == (recovery.tables["pings"].in_range_of == 0).sum()
    assert counts["collided"] == (outcomes == "collided").sum() == 0


def test_patience_is_the_time_to_drift_a_metre() -> None:
    """sqrt((0.06 sqrt(2) t)^2 + 2 0.027^2 t) = 1 m after 11.7 s."""
    mission = recording(simulate(still(1, duration_s=60.0), seed=0))
    wait = patience(mission)
    assert math.sqrt(2 * (0.06 * wait) ** 2 + 2 * 0.027**2 * wait) == pytest.approx(1.0, abs=1e-6)


def test_a_remedy_keeps_its_promise() -> None:
    """Simulated as proposed, AUVs are in range for the time that was counted on the paths."""
    mission = paper_case(2, record={"detail": "full"})
    proposed = remedies(recording(simulate(mission, seed=0)))
    assert "turn the formation" in proposed[0].words
    for remedy in proposed:
        changed = load_scenario(
            SCENARIOS / "two_asvs_140m_0deg.yaml", overrides=list(remedy.settings)
        )
        result = simulate(changed, seed=0)
        again = Trial(recording(result)).coverage(np.array(asv_stations(changed)))
        assert again == pytest.approx((remedy.worst, remedy.all), abs=0.005)
        # Rounds are longer while more is heard, so the share of pings is not quite that of time.
        assert result.auvs.hf_coverage.min() == pytest.approx(remedy.worst, abs=0.05)


def test_the_envelope_without_fixes_is_drift() -> None:
    """Without any fix the bound is the bias's drift and three sigma of the random walk."""
    result = simulate(still(1, at=20.0, acoustics={"hf": {"range_m": 12.0}}), seed=0)
    mission = recording(result)
    time = mission.times
    expected = 0.06 * math.sqrt(2) * time + 3 * 0.027 * np.sqrt(time)
    np.testing.assert_allclose(error_envelope(mission, 0), expected, atol=1e-9)


@pytest.mark.parametrize("compensation", ["none", "shift"])
def test_the_envelope_holds_the_error(compensation: str) -> None:
    """Errors are within the bound nearly always, and the bound is no larger than it must be."""
    changes = {"record": {"detail": "full"}, "navigation": {"delay_compensation": compensation}}
    mission = recording(simulate(paper_case(3, **changes), seed=0))
    for auv in range(3):
        error, bound = mission.own["position_error_m"][auv], error_envelope(mission, auv)
        assert (error <= bound + 1e-9).mean() > 0.985
        assert np.median(bound) < 6 * np.median(error)


def call(*words: str) -> Any:
    return CliRunner().invoke(main, list(words), catch_exceptions=False)


def test_the_command_writes_what_the_run_wrote(recovery: Result, tmp_path: Path) -> None:
    """A result folder has its report; the command makes it again from the tables."""
    folder = recovery.write(tmp_path / "run")
    first = (folder / "report.html").read_text()
    (folder / "report.html").unlink()
    outcome = call("report", str(folder))
    assert outcome.exit_code == 0
    assert outcome.stdout.strip() == str(folder / "report.html")
    assert (folder / "report.html").read_text() == first == run_page(load_result(folder))
    assert [path.name for path in folder.iterdir() if path.name.startswith(".")] == []


def test_mistakes_of_the_command(recovery: Result, tmp_path: Path) -> None:
    """A wrong folder, a file in the way and a folder that is not there: exit 2, nothing written."""
    folder = recovery.write(tmp_path / "run")
    taken = tmp_path / "taken.html"
    taken.write_text("mine")
    for words, said in (
        ((str(tmp_path / "nowhere"),), "no result folder"),
        ((str(folder), "--out", str(taken)), "--force"),
        ((str(folder), "--out", str(tmp_path)), "is a folder"),
        ((str(folder), "--out", str(tmp_path / "no" / "page.html")), "does not exist"),
    ):
        outcome = call("report", *words)
        assert (outcome.exit_code, said in outcome.stderr) == (2, True), outcome.output
    assert taken.read_text() == "mine"
    assert call("report", str(folder), "--out", str(taken), "--force").exit_code == 0
    assert taken.read_text().startswith("<!doctype html>")


def test_long_missions_are_thinned_and_say_so(
    recovery: Result, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Too many rows: tracks keep every k-th, pings those of every k-th round; sums hold all."""
    monkeypatch.setattr(run_data, "MOST_TRACK_POINTS", 1200)
    monkeypatch.setattr(run_data, "MOST_PINGS", 300)
    page = run_page(recovery)
    data = json.loads(re.findall(r'id="data">(.*?)</script>', page)[0])
    packed = re.findall(r'id="packed">(.*?)</script>', page)[0]
    assert data["auvs"][0]["x"]["length"] == data["time"]["length"] == 200
    pings = recovery.tables["pings"]
    kept = pings[pings["round"] % 3 == 0]
    np.testing.assert_array_equal(unpacked(data["pings"]["id"], packed), kept.ping)
    of = unpacked(data["receptions"]["ping"], packed).astype(int)
    heard = recovery.tables["receptions"].query("outcome == 'heard'").ping
    outcomes = unpacked(data["receptions"]["outcome"], packed)
    expected = heard[heard.isin(kept.ping)].tolist()
    assert kept.ping.to_numpy()[of[outcomes == 0]].tolist() == expected
    assert "Tracks are shown at 0.667 Hz, one of 3 rows" in page
    assert f"Of 651 pings {len(kept)} are played" in page
    assert data["fixes"]["auv"]["length"] == len(recovery.tables["fixes"])

"""Figures: drawn from the tables, with units on their axes, the same bytes for the same tables."""

import itertools
import re
from functools import cache, partial
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pyarrow as pa
import pytest
from commands_for_tests import call
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.text import Text
from scipy import stats
from worlds import QUIET_NAVIGATION, QUIET_USBL, scenario, still

from bindusbl_des import Result, Scenario, load_campaign, simulate, sweep
from bindusbl_des.apps.figures.style import finished
from bindusbl_des.apps.figures.sweeps import Levels, Means, curves, heatmap
from bindusbl_des.core.results.round_timeline import downlink_slots, uplink_slots

pytestmark = pytest.mark.usefixtures("in_this_process")

KINDS = ("trajectory", "error", "fixes", "coverage", "timeline", "round", "latency")
BINS = 30  # of a histogram
UNIT = re.compile(r"\((m|s|ms|count|1)\)$")


@pytest.fixture(scope="module")
def result() -> Result:
    """A short mission of three AUVs with every table."""
    return simulate(scenario(duration_s=30.0, acoustics={"hf": {"range_m": 45.0}}), 2)


@pytest.fixture(scope="module")
def folder(result: Result, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of that mission, into which no test writes."""
    return result.write(tmp_path_factory.mktemp("figures") / "run")


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A campaign of two ranges, two numbers of ASVs and two seeds."""
    folder = tmp_path_factory.mktemp("campaign")
    (folder / "base.yaml").write_text("name: base\nduration_s: 10\n")
    (folder / "grid.yaml").write_text(
        "scenario: base.yaml\nvary:\n  acoustics.hf.range_m: [40, 60]\n  asvs.count: [1, 2]\n"
        "  protocol.downlink: [sequential, pipelined_round]\nseeds: 2\n"
    )
    sweep(folder / "grid.yaml", folder / "out", workers=1)
    return folder / "out"


@cache
def drawn(kind: str, result: Result) -> Figure:
    """Return a figure, laid out, which no test changes."""
    figure: Figure = result.plot(kind)
    return figure


def busiest(result: Result) -> int:
    """Return the first of the rounds that brought most fixes."""
    return int(result.tables["rounds"].fixes.to_numpy().argmax())


# What matplotlib calls the axes of a colour bar
COLOURBAR = "<colorbar>"


def lines(axes: Axes, label: str) -> list[np.ndarray]:
    """Return the lines (n, 2) of the collections that bear a label."""
    found = [c for c in axes.collections if c.get_label() == label]
    return [np.asarray(s) for c in found if isinstance(c, LineCollection) for s in c.get_segments()]


@pytest.mark.parametrize("kind", KINDS)
def test_every_axis_has_its_unit(kind: str, result: Result) -> None:
    """What an axis measures is written with its unit; an axis of names says so."""
    figure = drawn(kind, result)
    for axes in figure.axes:
        if axes.get_label() == COLOURBAR:
            assert UNIT.search(axes.get_ylabel())
            continue
        labels = [axes.get_xlabel(), axes.get_ylabel()]
        if kind == "error":
            labels = [figure.get_supylabel(), figure.axes[-1].get_xlabel()]
        for label in labels:
            assert UNIT.search(label) or label in ("vehicle", "band, vehicle"), label


def circles(axes: Axes, label: str) -> list[float]:
    """Return the diameters (m) of the circles of a label."""
    drawn = next(it for it in axes.collections if it.get_label() == label)
    return [round(path.get_extents().width, 9) for path in drawn.get_paths()]


def test_the_map_shows_the_tracks(result: Result) -> None:
    """True, fused and dead-reckoned paths are those of the tables, east before north; circles have
    the ranges.
    """
    axes = drawn("trajectory", result).axes[0]
    tracks = result.tables["tracks"]
    for label, columns in (
        ("true", ["y_m", "x_m"]),
        ("fused", ["estimate_y_m", "estimate_x_m"]),
        ("dead reckoning", ["imu_y_m", "imu_x_m"]),
    ):
        for index, path in enumerate(lines(axes, label)):
            expected = tracks.loc[tracks.vehicle == f"AUV{index}", columns].to_numpy()
            assert path == pytest.approx(expected)
    assert circles(axes, "HF range") == [90.0] * 3
    assert circles(axes, "MF range") == [200.0] * 3


def test_errors_are_those_of_the_tracks(result: Result) -> None:
    """One panel per AUV: fused error, error without fixes, and a mark for each delivery."""
    panels = drawn("error", result).axes
    tracks, fixes = result.tables["tracks"], result.tables["fixes"]
    assert len(panels) == 3
    for index, axes in enumerate(panels):
        track = tracks[tracks.vehicle == f"AUV{index}"]
        shown = {str(line.get_label()): line.get_xydata() for line in axes.lines}
        assert shown["fused"] == pytest.approx(track[["time_s", "position_error_m"]].to_numpy())
        free = np.hypot(track.imu_x_m - track.x_m, track.imu_y_m - track.y_m)
        assert shown["dead reckoning"][:, 1] == pytest.approx(free.to_numpy())
        bound = axes.collections[0].get_paths()[0].vertices[:, 1].max()
        xx, yy = track.estimate_sd_x_m**2, track.estimate_sd_y_m**2
        largest = (xx + yy) / 2 + np.hypot((xx - yy) / 2, track.estimate_cov_xy_m2)
        assert bound == pytest.approx(3.0 * np.sqrt(largest.max()))
        got = fixes[(fixes.auv == f"AUV{index}") & (fixes.outcome == "delivered")]
        assert sorted(shown["fixes"][:, 0]) == pytest.approx(sorted(got.delivered_at_s))


def test_a_large_fleet_is_drawn_by_quantiles() -> None:
    """The median over the AUVs at each instant is the line."""
    many = simulate(scenario(duration_s=10.0, auvs={"count": 8}), 0)
    axes = drawn("error", many).axes[0]
    tracks = many.tables["tracks"]
    medians = tracks.groupby("time_s").position_error_m.median()
    shown = next(line for line in axes.lines if line.get_label() == "fused estimate")
    assert shown.get_xydata() == pytest.approx(np.column_stack((medians.index, medians)))


def test_fixes_are_counted_when_they_come(result: Result) -> None:
    """Each step is a delivery, and the last count the number of deliveries."""
    axes = drawn("fixes", result).axes[0]
    collection = next(c for c in axes.collections if isinstance(c, LineCollection))
    fixes = result.tables["fixes"]
    for index, path in enumerate(collection.get_segments()):
        got = fixes.delivered_at_s[(fixes.auv == f"AUV{index}") & fixes.delivered_at_s.notna()]
        assert path[1:-1:2, 0] == pytest.approx(np.sort(got))
        assert path[-1].tolist() == [30.0, len(got)]


def test_coverage_tells_the_exact_share(result: Result) -> None:
    """The legend holds share and covering radius, the map the pings that nobody could hear."""
    figure = drawn("coverage", result)
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    unheard = result.tables["pings"].query("in_range_of == 0")
    assert f"pings in nobody's range: {len(unheard)}" in texts
    assert any("% of the survey" in text for text in texts)
    assert set(circles(figure.axes[0], "HF range")) == {90.0}


def test_the_timeline_shows_what_happened_in_its_rounds(result: Result) -> None:
    """Pings, receptions and deliveries of rounds 3 and 4, each at its instant."""
    axes = result.plot("timeline", first=3, last=4).axes[0]
    shown = {str(c.get_label()): np.asarray(c.get_offsets())[:, 0] for c in axes.collections
             if len(c.get_offsets()) and not str(c.get_label()).startswith("_")}  # fmt: skip
    pings = result.tables["pings"].query("3 <= round <= 4")
    receptions = result.tables["receptions"]
    met = receptions[receptions.ping.isin(pings.ping)]
    assert shown["sent"] == pytest.approx(pings.sent_at_s.to_numpy())
    heard = met[met.outcome == "heard"].arrived_at_s
    assert shown["heard"] == pytest.approx(heard.to_numpy())
    start, end = axes.get_xlim()
    assert start == pytest.approx(uplink_slots(result, 3)[0].start)
    assert end == pytest.approx(downlink_slots(result, 4)[-1].end)


def test_collisions_are_red() -> None:
    """Two AUVs that ping at once beside each other collide, and the timeline says so in red."""
    crowd = scenario(
        duration_s=3.0,
        auvs={"count": 2, "route": {"kind": "hold", "positions_m": [[9, 0], [9, 1]]}},
        asvs={"count": 1, "formation": {"positions_m": [[0, 0]]}},
        protocol={"schedule": "schedules_for_tests:all_at_once"},
    )
    run = simulate(crowd)
    assert run.mission.collisions[0] > 0
    axes = drawn("timeline", run).axes[0]
    red = next(c for c in axes.collections if c.get_label() == "collided")
    shown = run.tables["receptions"].query("outcome == 'collided'")
    assert len(red.get_offsets()) == len(shown[shown.arrived_at_s <= axes.get_xlim()[1]])
    r, g, b, _ = red.get_facecolor()[0]
    assert r > 0.7
    assert max(g, b) < 0.3


def test_of_frames_that_begin_together_each_brings_its_own_fixes() -> None:
    """Direct replies: a line for each fix of the round that was delivered, from who sent it."""
    data = {"name": "side", "duration_s": 60, "survey": {"side_m": 200}, "auvs": {"count": 6}}
    protocol = {"schedule": "spatial_reuse", "downlink": "direct_reply"}
    run = simulate(Scenario.model_validate({**data, "asvs": {"count": 4}, "protocol": protocol}), 7)
    whole, _ = drawn("round", run).axes
    fixes = run.tables["fixes"].query("outcome == 'delivered'")
    fixes = fixes[fixes["round"] == busiest(run)]
    rows = [label.get_text() for label in whole.get_yticklabels()]
    found = [[rows[int(row)] for row in way[:, 1]] for way in lines(whole, "delivery")]
    assert sorted(found) == sorted(fixes[["broadcast_by", "auv"]].to_numpy().tolist())
    assert not any("T_{DL}" in text.get_text() for text in whole.texts)


def test_the_anatomy_has_the_ways_of_its_pings(result: Result) -> None:
    """Each heard ping is a line from where and when it was sent to where and when it arrived."""
    whole, slot = drawn("round", result).axes
    pings = result.tables["pings"]
    pings = pings[pings["round"] == busiest(result)].set_index("ping")
    heard = result.tables["receptions"].query("outcome == 'heard' and ping in @pings.index")
    ways = lines(whole, "heard")
    assert [way[:, 0].tolist() for way in ways] == [
        [pings.sent_at_s[m.ping], m.arrived_at_s] for m in heard.itertuples()
    ]
    rows = [label.get_text() for label in whole.get_yticklabels()]
    assert [rows[int(way[1, 1])] for way in ways] == heard.asv.tolist()
    texts = [text.get_text() for axes in (whole, slot) for text in axes.texts]
    for symbol in ("$T_P$", r"$\tau_{OT,max}$", "$T_G$", "$T_{UL}$", "$T_{tx}$", "$T_{DL}$"):
        assert any(text.startswith(symbol) for text in texts), symbol


def test_histograms_hold_every_fix(result: Result) -> None:
    """The bars add up to all deliveries; intervals are one less for each AUV."""
    left, right = drawn("latency", result).axes
    fixes = result.tables["fixes"]
    got = fixes[fixes.outcome == "delivered"]
    for axes, count in ((left, len(got)), (right, len(got) - got.auv.nunique())):
        assert sum(bar.get_height() for bar in axes.patches) == count


def test_a_histogram_survives_an_outlier(result: Result) -> None:
    """One fix that is 200 s late leaves the others their room; the last bar holds it."""
    fixes = result.tables["fixes"].copy()
    late = fixes.index[fixes.outcome == "delivered"][0]
    fixes.loc[late, "latency_s"] = 200.0
    arrow = {**result.arrow, "fixes": pa.Table.from_pandas(fixes, preserve_index=False)}
    figure = Result(result.scenario, 0, arrow, 1.0).plot("latency")
    axes = figure.axes[0]
    got = fixes.latency_s[fixes.outcome == "delivered"]
    assert sum(bar.get_height() for bar in axes.patches) == len(got)
    edges = np.linspace(*axes.get_xlim(), BINS + 1)
    held = np.histogram(got.clip(upper=edges[-1]), edges)[0]
    assert np.count_nonzero(held) > 2
    assert held[-1] == 1
    told = [text.get_text() for text in axes.get_legend().get_texts()]
    assert "last bar: 1 beyond, up to 200 s" in told


def test_a_round_shows_its_calls() -> None:
    """Each from its ASV to the AUV that answers, and the two ways of its slot."""
    result = simulate(
        scenario(duration_s=6.0, protocol={"ranging": {"model": "twtt", "turnaround_s": 0.1}}),
        seed=1,
    )
    figure = result.plot("round", number=1)
    pings: Any = result.tables["pings"]
    answered = pings[(pings["round"] == 1) & (pings.call == "heard")]
    for axes in figure.axes:
        [calls] = [it for it in axes.collections if it.get_label() == "call"]
        assert [way[0][0] for way in calls.get_segments()] == answered.called_at_s.tolist()
        gaps = answered.sent_at_s.to_numpy() - [way[1][0] for way in calls.get_segments()]
        assert gaps == pytest.approx(0.11)
    assert "turnaround 100 ms" in {it.get_text() for it in figure.axes[1].texts}
    slot, begun = figure.axes[1], answered.called_at_s.min()  # as the call, the slot begins
    marks = [float(it.get_text()) for it in slot.get_xticklabels()]
    assert marks[0] == 0.0
    assert slot.get_xticks() == pytest.approx(begun + np.array(marks) / 1e3)


@pytest.mark.parametrize(
    ("downlink", "ranging"),
    [("sequential", "owtt_sync"), ("pipelined_round", "twtt"), ("pipelined_group", "owtt_sync"),
     ("direct_reply", "twtt")],
)  # fmt: skip
def test_slots_are_those_of_the_protocol(downlink: str, ranging: str) -> None:
    """Every ping is sent in its slot, and rounds follow each other as the slots say."""
    run = simulate(
        scenario(duration_s=12.0, protocol={"downlink": downlink, "ranging": ranging}), 1
    )
    rounds = run.tables["rounds"]
    for ping in run.tables["pings"].itertuples():
        span = uplink_slots(run, ping.round)[ping.slot]
        assert span.start - 1e-9 <= ping.sent_at_s < span.end
        if ranging == "owtt_sync":
            assert ping.sent_at_s == pytest.approx(span.start)
    for number in range(len(rounds) - 1):
        ends = [s.end for s in uplink_slots(run, number)]
        if downlink == "sequential":
            ends += [s.end for s in downlink_slots(run, number)]
            assert max(ends) == pytest.approx(rounds.started_at_s[number + 1])
        assert max(ends) <= rounds.started_at_s[number + 1] + 1e-9 or downlink != "direct_reply"


ODD = {
    "one AUV": scenario(duration_s=6.0, auvs={"count": 1}),
    "no fixes": still(2, at=60.0, duration_s=5.0),
    "an instant": scenario(duration_s=0.05),
    "no errors": still(2, duration_s=5.0, navigation=QUIET_NAVIGATION, usbl=QUIET_USBL),
    "huge ranges": scenario(
        duration_s=5.0, acoustics={"hf": {"range_m": 4e3}, "mf": {"range_m": 1e5}}
    ),
    "a long thin survey": scenario(
        duration_s=5.0,
        survey={"side_m": 1000.0},
        auvs={"count": 1, "route": {"kind": "waypoints", "points_m": [[[-480, 0], [480, 0.5]]]}},
    ),
    "a long name, many AUVs": scenario(
        name="x" * 100, duration_s=3.0, auvs={"count": 40}, asvs={"count": 12}
    ),
}


# Those that are drawn with --all only
SLOW = ("no fixes", "no errors", "huge ranges", "a long thin survey", "a long name, many AUVs")


@pytest.mark.parametrize(
    "world", [pytest.param(it, marks=[pytest.mark.slow] if it in SLOW else []) for it in ODD]
)
def test_odd_missions_are_drawn_without_warning(world: str) -> None:
    """Whatever the mission, each figure has axes of some size, over one column, or two."""
    run, width = simulate(ODD[world], 1), 7.16 if world == "an instant" else 3.5
    for kind in KINDS:
        figure = run.plot(kind, width=width)
        figure.draw_without_rendering()
        for axes in figure.axes:
            assert axes.get_position().width > 0.2 or axes.get_label() == COLOURBAR, kind
            assert axes.get_position().height > 0.05, kind


@pytest.mark.parametrize("suffix", [".svg", ".png", pytest.param(".pdf", marks=pytest.mark.slow)])
def test_equal_tables_give_equal_bytes(suffix: str, result: Result, tmp_path: Path) -> None:
    """Neither dates nor random identifiers get into a file."""
    paths = [tmp_path / f"{number}{suffix}" for number in (1, 2)]
    for path in paths:
        result.plot("round", path, width=3.5)
    assert paths[0].read_bytes() == paths[1].read_bytes()
    assert not [path for path in tmp_path.iterdir() if path.name.startswith(".")]


def test_plot_draws_all_that_a_run_supports(result: Result, tmp_path: Path) -> None:
    """Without a kind every figure goes to DIR/figures; those that exist are kept."""
    folder = result.write(tmp_path / "run")
    done = call("plot", str(folder), "--format", "svg")
    assert done.exit_code == 0, done.stderr
    files = [folder / "figures" / f"{kind}.svg" for kind in KINDS]
    assert done.stdout.splitlines() == [str(file) for file in files]
    assert all(file.read_text(encoding="utf-8").startswith("<?xml") for file in files)
    again = call("plot", str(folder), "fixes", "--format", "svg")
    assert (again.exit_code, again.stdout) == (2, "")
    assert "fixes.svg: exists; use --force" in again.stderr
    assert call("plot", str(folder), "fixes", "--format", "svg", "--force").exit_code == 0
    assert call("plot", str(folder), "round", "--from", "2", "--out", str(tmp_path / "r.pdf"))
    assert (tmp_path / "r.pdf").read_bytes().startswith(b"%PDF")


def test_figures_keep_text_and_leave_titles_out(
    folder: Path, result: Result, tmp_path: Path
) -> None:
    """Words of an SVG can be searched and edited; with --no-title it has all but its title."""
    for kind in ("error", "round"):
        texts = []
        for options in ((), ("--no-title",)):
            out = tmp_path / f"{kind}{len(options)}.svg"
            assert call("plot", str(folder), kind, "--out", str(out), *options).exit_code == 0
            parts = ElementTree.parse(out).iter("{http://www.w3.org/2000/svg}text")
            texts.append(["".join(part.itertext()) for part in parts])
        assert any(text.startswith("time (s)") or "(s)" in text for text in texts[0])
        titles = [text for text in texts[0] if text.startswith(result.scenario.name)]
        assert len(titles) == 1
        assert sorted(texts[1]) == sorted(text for text in texts[0] if text not in titles)


def test_numbers_of_a_heatmap_can_be_read() -> None:
    """No powers of ten in its cells, and black or white as the ground asks for."""
    keys = Levels("asvs.count", "1", (1, 2)), Levels("acoustics.hf.range_m", "m", (40.0, 60.0))
    cells = {(0, 0): (1234.5, 5.3e-15, 2), (1, 0): (0.5, 0.0123, 2), (1, 1): (700.0, 99.9, 2)}
    means = Means("worst_position_error_m", "m", *keys, cells, "a title")
    axes = finished(partial(heatmap, means), 4.5, None).axes
    texts = {text.get_text(): text.get_color() for text in axes[0].texts}
    assert list(texts) == ["1234\n±0", "0.500\n±0.012", "700\n±100"]
    assert (texts["1234\n±0"], texts["0.500\n±0.012"]) == ("white", "black")
    assert axes[1].get_ylabel() == "worst AUV's mean position error (m)"
    assert keys[1].label == "acoustics.hf.range (m)"


def test_plot_follows_no_link_in_a_folder(result: Result, tmp_path: Path) -> None:
    """A stranger's folder does not choose where figures are written."""
    folder, elsewhere = result.write(tmp_path / "run"), tmp_path / "elsewhere"
    elsewhere.mkdir()
    (folder / "figures").symlink_to(elsewhere)
    done = call("plot", str(folder), "--force")
    assert done.exit_code == 2
    assert "is a link, which is not followed" in done.stderr
    assert list(elsewhere.iterdir()) == []


def test_plot_of_a_summary_says_what_is_missing(tmp_path: Path) -> None:
    """Without event tables the coverage can be drawn; the rest is told with the remedy."""
    summary = simulate(scenario(duration_s=3.0, record={"detail": "summary"}))
    folder = str(summary.write(tmp_path / "run"))
    refused = call("plot", folder, "timeline")
    assert refused.exit_code == 2
    assert "needs the tables rounds, pings" in refused.stderr
    assert "run it again with --set record.detail=full" in refused.stderr
    done = call("plot", folder)
    assert done.exit_code == 0
    assert done.stdout == f"{folder}/figures/coverage.png\n"
    assert done.stderr.count("\n") == len(KINDS) - 1


def test_plot_of_a_mission_without_rounds_draws_the_rest(tmp_path: Path) -> None:
    nobody = [{"asv": 0, "at_s": 0.0}]
    run = simulate(scenario(duration_s=3.0, asvs={"count": 1, "failures": nobody}))
    folder = str(run.write(tmp_path / "run"))
    refused = call("plot", folder, "timeline", "--from", "0")
    assert (refused.exit_code, refused.stdout) == (2, "")
    assert "no timeline: the mission had no round" in refused.stderr
    with pytest.raises(ValueError, match="no round: the mission had no round"):
        run.plot("round")
    done = call("plot", folder, "--format", "svg")
    assert done.exit_code == 0, done.stderr
    assert len(done.stdout.splitlines()) == len(KINDS) - 2


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("{run}", "trajectry"), "no figure 'trajectry' of a run; did you mean 'trajectory'?"),
        (("{run}", "heatmap"), "no figure 'heatmap' of a run; there are trajectory"),
        (("{run}", "error", "--out", "e.doc"), "e.doc: a figure's name ends in one of .png"),
        (("{run}", "error", "--out", "no/e.png"), "the folder no does not exist"),
        (("{run}", "--out", "e.png"), "--out names one file, so give a KIND too"),
        (("{run}", "error", "--metric", "rounds"), "--metric is for campaigns"),
        (("{run}", "timeline", "--from", "999"), "there is no round 999: the run has rounds 0 to "),
        (("{run}", "timeline", "--from", "3", "--to", "2"), "--from 3 comes after --to 2"),
        (("{run}", "error", "--from", "3"), "--from is for timeline and round"),
        (("{sweep}", "error"), "no figure 'error' of a campaign; there are curves, heatmap"),
        (("{sweep}", "--metric", "latency_mean"), "did you mean 'latency_mean_s'?"),
        (("{sweep}", "--x", "asvs.cnt"), "does not vary 'asvs.cnt'; did you mean 'asvs.count'?"),
        (("{sweep}", "--from", "1"), "--from is for runs"),
        (("nowhere",), "nowhere is no result folder"),
    ],
)
def test_what_cannot_be_drawn_is_told(
    words: tuple[str, ...],
    told: str,
    folder: Path,
    campaign: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Bad input ends with 2, in plain words, and leaves nothing behind."""
    monkeypatch.chdir(tmp_path)
    before = sorted(folder.rglob("*"))
    done = call("plot", *(word.format(run=folder, sweep=campaign) for word in words))
    assert (done.exit_code, done.stdout) == (2, "")
    assert told in done.stderr
    assert sorted(folder.rglob("*")) == before
    assert not list(tmp_path.iterdir())


def test_a_campaign_is_drawn_as_curves_and_heatmap(campaign: Path) -> None:
    """`plot` of a sweep folder draws both kinds."""
    done = call("plot", str(campaign), "--format", "svg")
    assert done.exit_code == 0, done.stderr
    assert done.stdout.splitlines() == [
        f"{campaign}/figures/{kind}.svg" for kind in ("curves", "heatmap")
    ]


@pytest.mark.parametrize("kind", ["curves", "heatmap"])
def test_figures_of_campaigns_show_the_means(kind: str, campaign: Path) -> None:
    """Points of curves and cells of heatmaps are mean and 95 % interval of the missions with their
    values, other keys pooled; the axes have units.
    """
    held = load_campaign(campaign)
    groups = held.missions.groupby(["acoustics.hf.range_m", "asvs.count"]).latency_mean_s
    means = groups.mean().unstack().to_numpy()
    halves = (stats.t.ppf(0.975, 3) * groups.std() / 2.0).unstack().to_numpy()  # of 4 missions
    assert (groups.size() == 4).all()
    figure = held.plot(kind, metric="latency_mean_s")
    axes = figure.axes[0]
    assert axes.get_xlabel() == "acoustics.hf.range (m)"
    if kind == "curves":
        assert "pooled over protocol.downlink" in " ".join(axes.get_title().split())
        assert axes.get_ylabel() == "mean latency (s)"
        for series, bars in enumerate(axes.containers):
            assert bars.lines[0].get_ydata() == pytest.approx(means[:, series])
            shown = [np.ptp(bar[:, 1]) / 2 for bar in bars.lines[2][0].get_segments()]
            assert shown == pytest.approx(halves[:, series], rel=2e-4)
    else:
        assert axes.get_ylabel() == "asvs.count"
        assert np.asarray(axes.images[0].get_array()) == pytest.approx(means.T)
        assert len(axes.texts) == 4
        assert figure.axes[1].get_ylabel() == "mean latency (s)"


def test_messages_of_one_broadcast_share_a_slot() -> None:
    """Two frames, one downlink slot, as long as the round says; anatomy and timeline are drawn."""
    mf = {"modem": "s2c_instant", "payload_bytes": 24}
    run = simulate(still(2, duration_s=4.0, acoustics={"mf": mf}))
    rounds = run.tables["rounds"]
    assert (run.tables["broadcasts"]["round"] == 0).sum() == 2
    (slot,) = downlink_slots(run, 0)
    assert slot.length == pytest.approx(rounds.downlink_s[0])
    for kind in ("round", "timeline"):
        assert run.plot(kind).axes


LONG = "recovery_of_three_vehicles_in_the_outer_harbour_with_current_and_all"


def misplaced(figure: Figure) -> list[str]:
    """Return the texts of a figure that are not within it, and names at ticks that overlap."""
    figure.draw_without_rendering()
    width, height = figure.bbox.size
    axises = [axis for axes in figure.axes for axis in (axes.xaxis, axes.yaxis)]
    beyond = set()  # labels of ticks that are not drawn
    for axis in axises:
        low, high = sorted(axis.get_view_interval())
        ticks = [it for it in axis.get_major_ticks() if not low <= it.get_loc() <= high]
        beyond |= {label for tick in ticks for label in (tick.label1, tick.label2)}
    texts = [it for it in figure.findobj(Text) if it.get_visible() and it.get_text()]
    boxes = {it: it.get_window_extent() for it in texts if it not in beyond}
    found = [
        text.get_text() for text, box in boxes.items()
        if box.x0 < -1 or box.y0 < -1 or box.x1 > width + 1 or box.y1 > height + 1
    ]  # fmt: skip
    for axis in axises:
        shown = [it for it in axis.get_ticklabels() if it in boxes]
        for one, other in itertools.combinations(shown, 2):
            if boxes[one].overlaps(boxes[other]):
                found.append(f"{one.get_text()} | {other.get_text()}")
    return found


PARTS = [
    "kalman", "fixed_gain", "my_very_long_module_of_navigators:WeighingByRandomWalkOfDeadReckoning",
    "my_very_long_module_of_navigators:WeighingByRandomWalkWithGate",
    {"model": "other_navigators:Weighing", "drift_m_per_sqrt_s": 0.3, "gate": None},
]  # fmt: skip
KEYS = {
    "parts": Levels("navigation.filter", "", tuple(PARTS)),
    "places": Levels(
        "asvs.formation.positions_m", "m", tuple([[k + 0.5, 20.25]] * 3 for k in range(4))
    ),
    "numbers": Levels("acoustics.hf.range_m", "m", tuple(40 + 1.25 * k for k in range(11))),
    "many": Levels("asvs.formation.clearance_m", "m", tuple(k / 8 for k in range(40))),
    "uneven": Levels("navigation.random_walk_m_per_sqrt_s", "m/sqrt(s)", (1e-4, 1.1e-4, 0.05)),
}


def grid(x: Levels, series: Levels | None, metric: str) -> Means:
    """Return some mean wherever both keys have some values."""
    rows = range(len(series.values) if series else 1)
    cells = {(i, j): (0.1234 * (i + 1), 1.9e-5, 9) for i in range(len(x.values)) for j in rows}
    gaps = {(0, 0): (3, 9)}
    return Means(metric, "m", x, series, cells, f"{LONG}: 1000 seeds, 95 % intervals", gaps)


def fits(across: str, upright: str | None, width: float) -> None:
    """Check that all texts of figures over one or two keys have room, and name what they should."""
    series = KEYS[upright] if upright else None
    means = grid(KEYS[across], series, "worst_latency_from_broadcast_s")
    for draw in (curves, heatmap) if series else (curves,):
        figure = finished(partial(draw, means), width, None)
        assert misplaced(figure) == [], draw.__name__
        axes = figure.axes[0]
        assert "latency" in (axes if draw is curves else figure.axes[1]).get_ylabel()
        assert axes.get_position().height * figure.get_figheight() > 0.2 * width
        if across == "parts":
            names = [it.get_text() for it in axes.get_xticklabels()]
            assert len(set(names)) == len(PARTS)
            told = re.sub(r"\s", "", f"{axes.get_xlabel()}{''.join(names)}")
            assert "WeighingByRandomWalkOfDeadReckoning" in told
            assert "Weighing(drift_m_per_sqrt_s0.3)" in told


TWO_KEYS = list(zip(KEYS, [*list(KEYS)[1:], "parts"], strict=True))


@pytest.mark.parametrize(("across", "upright"), [("parts", None), *TWO_KEYS])
def test_long_names_have_room_in_one_column(across: str, upright: str | None) -> None:
    """Titles and labels are broken into lines; names without room at ticks have letters, told
    below, and no two names become one.
    """
    fits(across, upright, 3.5)


@pytest.mark.slow
@pytest.mark.parametrize("width", [3.0, 3.5, 4.5, 7.16, 12.0])
@pytest.mark.parametrize("across", KEYS)
def test_long_names_have_room_at_any_width(across: str, width: float) -> None:
    for upright in (None, *KEYS):
        fits(across, upright, width)


@pytest.mark.parametrize("kind", KINDS)
def test_long_names_have_room_in_figures_of_runs(kind: str, result: Result) -> None:
    """A title that is too long has several lines, and its end is there: it says what is shown."""
    named = Scenario.model_validate({**result.scenario.model_dump(mode="json"), "name": LONG})
    figure = Result(named, 2, result.arrow, 1.0).plot(kind, width=3.5)
    titles = [text for text in figure.findobj(Text) if text.get_text().startswith("recovery_of")]
    (title,) = titles
    assert title.get_text() not in misplaced(figure)
    assert title.get_text().replace("\n", "").startswith(LONG[:30])
    assert re.search("seed 2|HF range 45 m", title.get_text().replace("\n", " "))

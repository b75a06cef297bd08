"""What a page says twice is the same twice: every number of one quantity, read from the page."""

import re
from html import unescape
from typing import Any

import pytest
from worlds import merged, scenario

from bindusbl_des import load_scenario, simulate

FIVE = {"auvs": {"count": 5}, "duration_s": 60.0}
CASES: dict[str, dict[str, Any]] = {
    "recovery": {},
    "aloha": merged(FIVE, {"protocol": {"schedule": "aloha", "frame_s": 0.5}}),
    "frames": {  # of two ASVs, which both broadcast as they like
        "duration_s": 60.0,
        "asvs": {"count": 2, "formation": {"positions_m": [[-47, 0], [48, 0]]}},
        "protocol": {
            "schedule": "one_per_slot", "downlink": "pipelined_round", "downlink_guard_s": 0.0,
            "knowledge": {"model": "broadcast", "assignment_bytes": 64}, "positions": "truth",
        },
    },
    "duplex": merged(
        FIVE, {"protocol": {"schedule": "aloha", "frame_s": 1.0, "duplex": "per_node"}}
    ),
    "all_at_once": merged(
        FIVE,
        {"protocol": {"schedule": "schedules_for_tests:all_at_once"}, "survey": {"side_m": 60}},
    ),
    "twtt": {"protocol": {"ranging": "twtt"}, "duration_s": 60.0},
    "passive": {"protocol": {"ranging": "passive"}, "duration_s": 60.0},
}  # fmt: skip


class Page:
    """The numbers of a page, by where they stand."""

    def __init__(self, page: str) -> None:
        body = page[page.index("<header>") : page.index("<script", page.index("<header>"))]
        self.text = " ".join(unescape(re.sub(r"<[^>]+>", " ", body)).split())
        # name: of the worst AUV and of the fleet, both as written
        self.tiles = {
            unescape(name): (worst, fleet)
            for name, worst, fleet in re.findall(
                r"<dt>(.*?)</dt><dd>([-\d.]+).*?</dd>(?:<dd><small>(.*?)</small></dd>)?</div>", body
            )
        }
        self.tables: dict[str, dict[str, list[str]]] = {}
        for title, table in re.findall(r"<h3>([^<]*)</h3>.*?<table>(.*?)</table>", body, re.DOTALL):
            heads = re.findall(r"<th(?: [^>]*)?>([^<]*)", table.split("</thead>")[0])[1:]
            rows = re.findall(r"<tr>(.*?)</tr>", table.split("</thead>")[1], re.DOTALL)
            cells = [re.findall(r"<td[^>]*>([^<]*)", row) for row in rows]
            self.tables[title] = {
                head: list(column)
                for head, column in zip(heads, zip(*cells, strict=True), strict=True)
            }

        self.names = re.findall(r'<tr><th scope="row">(AUV\d+)</th>', body.split('id="auvs"')[1])

    def found(self, pattern: str) -> list[Any]:
        """Return what groups of a pattern stand for, wherever it is in the text."""
        return re.findall(pattern, self.text)

    def column(self, title: str, head: str) -> list[float]:
        """Return a column of the AUVs, without the mean."""
        return [float(it) for it in self.tables[title][head][:-1]]


def seen(case: str) -> tuple[Any, Page]:
    """Return a mission's result and its page."""
    result = simulate(load_scenario("harbour_current", overrides=["duration_s=60"]), 0) if (
        case == "harbour_current"
    ) else simulate(scenario(**CASES[case]), 3)  # fmt: skip
    return result, Page(result.report())


@pytest.mark.parametrize("case", ["harbour_current", *CASES])
def test_what_a_page_says_twice_is_the_same(case: str) -> None:
    """Collisions, errors, ages, fixes, latencies and what histograms leave out."""
    result, page = seen(case)
    tiles, column = page.tiles, page.column
    hf, mf = sum(column("Pings", "collided")), sum(column("Fixes", "collided"))
    assert {"aloha": hf, "frames": mf, "duplex": mf, "all_at_once": hf}.get(case, 1) > 0
    [told] = page.found(r"\d+ rounds?, (\d+) collisions?")
    assert int(told) == hf + mf
    assert f"{told} collision" in result.summary()
    assert page.found(r"Collisions: (\d+) receptions? on HF") == [f"{hf:.0f}"] * (hf > 0)
    assert page.found(r"\((\d+) on HF, (\d+) on MF\)") == [(f"{hf:.0f}", f"{mf:.0f}")] * (mf > 0)
    [*violated] = page.found(r"violated (\w+?)(?: times)?,")
    counted = result.violations is not None and result.violations.count
    assert set(violated) == ({"once" if counted == 1 else str(counted)} if counted else set())
    assert not counted or counted == hf + mf
    [(mean, fleet, p95)] = page.found(
        r"its error was ([\d.]+) m on average \(mean of the fleet ([\d.]+) m\); "
        r"for 95 % .*? below ([\d.]+) m"
    )
    assert f"{max(column('Position error', 'mean')):.2f}" == mean
    assert f"{max(column('Position error', '95 %')):.2f}" == p95
    auvs = result.arrow["auvs"].to_pylist()
    worst = max(auvs, key=lambda it: it["position_error_m"])["auv"]
    beside = f"{worst}; fleet {fleet} m" if len(auvs) > 1 else ""
    assert tiles["mean error"] == (mean, beside)
    assert column("Position error", "mean") == sorted(column("Position error", "mean"))[::-1]
    for tile, title, head in (
        ("95 % of the time below", "Position error", "95 %"),
        ("error without any fix", "Position error", "without fixes"),
        ("longest without a fix", "Waiting for fixes", "largest"),
    ):
        shown = page.tables[title][head]  # the mean last
        largest = max(shown[:-1], key=float)
        named = {page.names[n] for n, it in enumerate(shown[:-1]) if it == largest}
        whose, _, rest = tiles[tile][1].partition("; ")
        assert tiles[tile][0] == largest
        assert len(auvs) == 1 or (whose in named and rest.split()[:2] == ["fleet", shown[-1]])
    assert "astray" not in page.text
    ages, auvs = column("Waiting for fixes", "largest"), page.names
    for age, auv in page.found(r"the last fix was never older than ([\d.]+) s \((AUV\d)\)"):
        assert (age, ages[auvs.index(auv)]) == (f"{max(ages):.1f}", max(ages))
    means = page.found(r"(?:to delivery|delivered fixes): (?:mean of all ([\d.]+) s|none)")
    for possible in page.found(r"Latency, mean of all fixes .*? ([\d.]+) s [\d.]+ s \d+ %"):
        assert float(possible) == pytest.approx(float(means[0]), abs=0.006)
    drawn = [
        [text.get_text() for text in axes.get_legend().get_texts()] if axes.get_legend() else []
        for axes in result.plot("latency").axes
    ]
    for mean, labels in zip(means, drawn, strict=True):
        assert f"mean {mean} s" in labels if mean else not labels
    assert not page.found(r"[ ,;]1 \(\d+ %\) were")
    beyond = re.findall(r"last bar: (\d+) beyond", str(drawn))
    assert page.found(r"the last bar holds the (\d+) beyond") == beyond

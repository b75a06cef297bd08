"""The page docs/performance.md, written from the measurements in history.json."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from string import Template
from textwrap import fill
from typing import Any

Measured = dict[str, Any]

WIDTH = 100
TEMPLATE = Path(__file__).with_name("performance.template.md")


def page(history: dict[str, Measured]) -> str:
    """Return the page in Markdown; the last measurement is the present one."""
    now = list(history.values())[-1]
    return Template(TEMPLATE.read_text(encoding="utf-8")).substitute(
        machine=_machine(now["machine"]),
        missions=_missions(now),
        commands=_commands(now["commands"]) if "commands" in now else "Not measured.\n",
        plans=_plans(now) if "plans" in now else "Not measured.\n",
        campaigns=_campaigns(now["campaigns"]) if "campaigns" in now else "Not measured.\n",
        peers=_peers(now) if "peers" in now else "Not measured.\n",
    )


def table(head: Sequence[str], rows: Iterator[Sequence[str]]) -> str:
    """Return a Markdown table, numbers to the right of their first column."""
    lines = [head, ["---", *["---:"] * (len(head) - 1)], *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def number(value: float | None) -> str:
    """Return a number with three digits; a dash for none."""
    if value is None:
        return "-"
    return f"{value:,.0f}" if value >= 100 else f"{value:.3g}"


def _machine(it: dict[str, Any]) -> str:
    text = (
        f"{it['processor']}, {it['cores']} cores, {it['system']}, Python {it['python']}, "
        f"numpy {it['numpy']}, numba {it['numba']}."
    )
    if it["load"] > 1:
        text += (
            f" Other work had {it['load']:g} processes at once when the measurement began: times "
            "by the clock say more about that than about missions."
        )
    return fill(text, WIDTH)


def _missions(now: Measured) -> str:
    """Return a row for each fleet, of points and, where they were measured, of hulls."""
    head = ("(N,M)", "mission ms", "new ms", "new with hulls ms", "tables ms", "MB")
    found = now["missions"]

    def rows() -> Iterator[Sequence[str]]:
        for name, row in found.items():
            fleet, _, vehicle = name.partition(" ")
            if vehicle == "kinematic":
                hull = found.get(f"{fleet} bluerov2")
                yield (
                    fleet,
                    number(row["mission_ms"]["processor"]),
                    number(row["new_configuration_ms"]["processor"]),
                    number(hull and hull["new_configuration_ms"]["processor"]),
                    number(row["writing_ms"]["processor"]),
                    number(row["peak_memory_mb"]),
                )

    return table(head, rows())


def _commands(found: Measured) -> str:
    sweep = found["sweep"]
    rows = (
        (name, number(found[key]["processor"]))
        for name, key in (
            ("`from bindusbl_des import Scenario, simulate`", "import_ms"),
            ("`--help`", "help_ms"),
            ("`validate` of the paper's baseline", "validate_ms"),
            ("`run` of it, from command to page", "run_ms"),
            ("`run --advice` of it", "advice_ms"),
        )
        if key in found
    )
    text = (
        f"A sweep of {sweep['missions']:,} missions (3 to 10 AUVs, 1 to 4 ASVs, `detail: summary`) "
        f"took {number(sweep['processor_s'])} s; the largest process had "
        f"{number(sweep['peak_memory_mb'])} MB."
    )
    return f"{table(('command', 'ms'), rows)}\n{fill(text, WIDTH)}\n"


def _plans(now: Measured) -> str:
    """Return how long the questions of the manual took."""
    plans = [(it["processor_s"], it["missions"]) for it in now["plans"].values()]
    (least, few), (most, many) = min(plans), max(plans)
    text = (
        "The questions of [planning](planning.md#how-many-asvs-for-1-m) (`experiments/plans`) took "
        f"{number(least)} s ({few} missions) to {number(most)} s ({many}), from command to page."
    )
    return f"{fill(text, WIDTH, break_long_words=False, break_on_hyphens=False)}\n"


def _campaigns(found: Measured) -> str:
    """Return what a campaign adds to its missions, and what the largest one needed."""
    ways, large = found["ways"], found["large"][-1]
    fixed = [it["fixed_s"] for it in ways.values()]
    beside = "; ".join(f"{way}, {it['efficiency']:.2f}" for way, it in list(ways.items())[1:])
    text = (
        f"A campaign takes {number(min(fixed))} to {number(max(fixed))} s beyond its missions: "
        "starting, compiled code loaded by each worker, plan, report. Efficiency beside a pool of "
        f"processes, {found['missions']:,} missions: {beside}. With {large['missions']:,} missions "
        f"in {large['parts']:,} parts `status` took {number(large['status']['processor_s'])} s; "
        f"`resume`, for the last 16, {number(large['resume']['processor_s'])} s and "
        f"{number(large['resume']['memory_mb'])} MB."
    )
    return f"{fill(text, WIDTH, break_long_words=False, break_on_hyphens=False)}\n"


def _peers(now: Measured) -> str:
    """Return how the program's whole missions compare with ns-3's acoustics of their signals."""
    rows = [
        (
            name.partition(" ")[0],
            number(row["ratio_stock"]),
            number(row["new_configuration_ms"] / row["stock_run_ms"]),
            number(row["ratio_listeners"]),
        )
        for name, row in now["peers"].items()
        if name.endswith("kinematic")
    ]
    text = (
        "ns-3's UAN module (3.44, C++, `-O3`) repeats the traffic of our mission, each ping and "
        "frame at its instant, and must agree on every reception. Ours is the whole mission "
        "(vehicles, navigation, USBL, schedules, tables), ns-3's acoustics alone; above 1 we are "
        "slower. *Listeners* is a channel of ours in ns-3 that delivers signals only to receivers "
        "in range."
    )
    head = ("(N,M)", "ours / ns-3", "new configuration", "beside *listeners*")
    return f"{fill(text, WIDTH, break_long_words=False)}\n\n{table(head, iter(rows))}"

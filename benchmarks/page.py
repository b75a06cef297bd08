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
        plans=_plans(now),
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
    head = ("(N,M), vehicle", "mission ms", "new configuration ms", "tables ms", "MB")
    rows = (
        (
            name,
            number(row["mission_ms"]["processor"]),
            number(row["new_configuration_ms"]["processor"]),
            number(row["writing_ms"]["processor"]),
            number(row["peak_memory_mb"]),
        )
        for name, row in now["missions"].items()
    )
    return table(head, rows)


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
    times = table(("command", "processor ms"), rows)
    text = (
        f"A sweep of {sweep['missions']:,} missions (3 to 10 AUVs, 1 to 4 ASVs, `detail: summary`) "
        f"took {number(sweep['processor_s'])} s with {sweep['workers']} workers; the largest "
        f"process had {number(sweep['peak_memory_mb'])} MB."
    )
    return f"{times}\n{fill(text, WIDTH)}\n"


def _plans(now: Measured) -> str:
    """Return how long the questions of the manual took."""
    rows = (
        (plan, number(it["processor_s"]), str(it["missions"]))
        for plan, it in now.get("plans", {}).items()
    )
    return table(("plan", "s", "missions"), rows)


def _campaigns(found: Measured) -> str:
    rows = (
        (
            way,
            number(it["processor_s"]),
            number(it["fixed_s"]),
            number(it["mission_ms"]),
            f"{it['efficiency']:.2f}",
        )
        for way, it in found["ways"].items()
    )
    text = f"{found['missions']:,} missions on {found['cores']} cores:"
    large = (
        (
            f"{it['missions']:,}",
            f"{it['parts']:,}",
            number(it["status"]["processor_s"]),
            number(it["complete"]["processor_s"]),
            number(it["resume"]["processor_s"]),
            number(it["resume"]["memory_mb"]),
        )
        for it in found["large"]
    )
    asked = (
        "missions", "parts", "`status`, s", "`resume` of none, s", "`resume` of the last 16, s",
        "memory MB",
    )  # fmt: skip
    ways = table(("campaign", "processor s", "fixed s", "ms each further", "efficiency"), rows)
    return f"{text}\n\n{ways}\n{table(asked, large)}"


def _peers(now: Measured) -> str:
    head = (
        "mission", "ours ms", "ns-3 ms", "ratio", "ratio, new configuration",
        "ratio to ns-3 listeners", "receptions, equal",
    )  # fmt: skip
    rows = (
        (
            name,
            number(row["mission_ms"]),
            number(row["stock_run_ms"]),
            number(row["ratio_stock"]),
            number(row["new_configuration_ms"] / row["stock_run_ms"]),
            number(row["ratio_listeners"]),
            f"{row['pings_heard'] + row['frames_reached']:,}",
        )
        for name, row in now["peers"].items()
    )
    return table(head, rows)

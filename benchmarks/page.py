"""The page docs/performance.md, written from the measurements in history.json."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from string import Template
from textwrap import fill
from typing import Any

from targets import verdicts

from bindusbl_des.benchmarks.missions import standard_missions

Measured = dict[str, Any]

WIDTH = 100
TEMPLATE = Path(__file__).with_name("performance.template.md")


def page(history: dict[str, Measured]) -> str:
    """Return the page in Markdown; the last measurement is the present one."""
    now = list(history.values())[-1]
    return Template(TEMPLATE.read_text(encoding="utf-8")).substitute(
        targets=_targets(now),
        machine=_machine(now["machine"]),
        missions=_missions(now),
        fleets=_fleets(now),
        shares=_shares(now),
        history=_history(history),
        commands=_commands(now["commands"]) if "commands" in now else "Not measured.\n",
        plans=_plans(history),
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


def _targets(now: Measured) -> str:
    rows = (
        (
            target.what,
            f"{target.first:g} {target.unit}",
            f"{target.then:g} {target.unit}",
            f"{number(value)} {target.unit}" if value is not None else "-",
            verdict,
        )
        for target, value, verdict in verdicts(now)
    )
    return table(("at most", "first", "then", "now", ""), rows)


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
    head = (
        "mission", "processor ms", "by the clock, median (min .. max) ms", "new configuration ms",
        "tables ms", "events/s", "times real time", "us per AUV and s", "MB",
    )  # fmt: skip
    return table(
        head,
        (
            (
                name,
                number(row["mission_ms"]["processor"]),
                "{} ({} .. {})".format(
                    *(number(row["mission_ms"][key]) for key in ("median", "min", "max"))
                ),
                number(row["new_configuration_ms"]["processor"]),
                number(row["writing_ms"]["processor"]),
                number(row["events_per_s"]),
                number(row["sim_seconds_per_s"]),
                number(row["us_per_auv_second"]),
                number(row["peak_memory_mb"]),
            )
            for name, row in now["missions"].items()
        ),
    )


def _fleets(now: Measured) -> str:
    missions = standard_missions()
    head = ("fleet", "side m", "HF range m", "MF range m", "bit/s", "events")
    rows = (
        (
            name.split()[0],
            number(missions[name].survey.side_m),
            number(missions[name].acoustics.hf.range_m),
            number(missions[name].acoustics.mf.range_m),
            number(missions[name].acoustics.mf.bit_rate_bps),
            "-" if row["events"] is None else f"{row['events']:,}",
        )
        for name, row in now["missions"].items()
        if name.endswith("kinematic")
    )
    return table(head, rows)


def _shares(now: Measured) -> str:
    parts = list(next(iter(now["missions"].values()))["shares"])
    rows = (
        (name, *(f"{100 * row['shares'][part]:.0f}" for part in parts))
        for name, row in now["missions"].items()
    )
    return table(("mission", *parts), rows)


def _history(history: dict[str, Measured]) -> str:
    missions = list(dict.fromkeys(name for it in history.values() for name in it["missions"]))
    rows: list[list[str]] = []
    for mission in missions:
        found = [it["missions"].get(mission) for it in history.values()]
        took = [it and it["new_configuration_ms"]["processor"] for it in found]
        rows.append([f"{mission}, ms", *map(number, took), _gain(took)])
    for what, key in (("`--help`, ms", "help_ms"), ("`run` of the baseline, ms", "run_ms")):
        times = [it.get("commands", {}).get(key, {}).get("processor") for it in history.values()]
        rows.append([what, *map(number, times), _gain(times)])
    sweeps = [it.get("commands", {}).get("sweep", {}) for it in history.values()]
    times = [it and it["planned_processor_s"] for it in sweeps]
    rows.append(["sweep of 5,760 missions, s", *(number(it or None) for it in times), _gain(times)])
    return table(("", *history, "times faster"), iter(rows))


def _gain(took: Sequence[float | None]) -> str:
    return number(took[0] / took[-1]) if took[0] and took[-1] else "-"


def _commands(found: Measured) -> str:
    sweep = found["sweep"]
    rows = (
        (name, number(found[key]["median"]), number(found[key]["processor"]))
        for name, key in (
            ("`from bindusbl_des import Scenario, simulate`", "import_ms"),
            ("`--help`", "help_ms"),
            ("`run` of the paper's baseline", "run_ms"),
        )
        if key in found
    )
    times = table(("command, warm cache", "by the clock ms", "processor ms"), rows)
    text = (
        f"A sweep with {sweep['workers']} workers made {sweep['missions']:,} missions (fleets of 3 "
        "to 10 AUVs under 1 to 4 ASVs, three sizes, 30 seeds each) in "
        f"{number(sweep['wall_s'])} s by the clock, or {number(sweep['processor_s'])} s of "
        "processor time, start-up and tables included. The largest process had "
        f"{number(sweep['peak_memory_mb'])} MB."
    )
    return f"{times}\n{fill(text, WIDTH)}\n"


def _plans(history: dict[str, Measured]) -> str:
    """Return how long the questions of the manual took, each time that they were asked."""
    asked = {name: it["plans"] for name, it in history.items() if "plans" in it}
    if not asked:
        return "Not measured.\n"
    heads = (f"{name}, {what}" for name in asked for what in ("s", "missions"))
    rows = []
    for plan in dict.fromkeys(plan for it in asked.values() for plan in it):
        found = [it.get(plan, {}) for it in asked.values()]
        took = [it.get("processor_s") for it in found]
        cells = (
            cell for it in found
            for cell in (number(it.get("processor_s")), str(it.get("missions", "-")))
        )  # fmt: skip
        rows.append([plan, *cells, *([_gain(took)] if len(took) > 1 else [])])
    gain = ["times faster"] if len(asked) > 1 else []
    return table(("plan", *heads, *gain), iter(rows))


def _campaigns(found: Measured) -> str:
    head = ("campaign", "processor s", "efficiency", "by the clock s", "efficiency by the clock")
    rows = (
        (
            way,
            number(it["processor_s"]),
            f"{it['efficiency']:.2f}",
            number(it["wall_s"]),
            f"{it['efficiency_by_the_clock']:.2f}",
        )
        for way, it in found["ways"].items()
    )
    text = (
        f"{found['missions']:,} missions of {number(found['mission_ms'])} ms each on "
        f"{found['cores']} cores:"
    )
    large = (
        (
            f"{it['missions']:,}",
            f"{it['parts']:,}",
            number(it["status"]["processor_s"]),
            number(it["status"]["wall_s"]),
            number(it["status"]["memory_mb"]),
            number(it["resume"]["processor_s"]),
            number(it["resume"]["memory_mb"]),
        )
        for it in found["large"]
    )
    asked = (
        "missions", "parts", "`status`, processor s", "by the clock s", "memory MB",
        "`resume`, processor s", "memory MB",
    )  # fmt: skip
    return f"{text}\n\n{table(head, rows)}\n{table(asked, large)}"


def _peers(now: Measured) -> str:
    head = (
        "mission", "ours ms", "acoustics and protocol of it ms", "ours, new configuration ms",
        "ns-3 stock ms", "ratio", "ratio, new configuration", "ns-3 listeners ms", "ratio",
        "ns-3 set-up ms", "receptions, equal",
    )  # fmt: skip
    rows = (
        (
            name,
            number(row["mission_ms"]),
            number(row["mission_ms"] * _share_of_acoustics(now["missions"][name]["shares"])),
            number(row["new_configuration_ms"]),
            number(row["stock_run_ms"]),
            number(row["ratio_stock"]),
            number(row["new_configuration_ms"] / row["stock_run_ms"]),
            number(row["listeners_run_ms"]),
            number(row["ratio_listeners"]),
            number(row["stock_set_up_ms"]),
            f"{row['pings_heard'] + row['frames_reached']:,}",
        )
        for name, row in now["peers"].items()
    )
    return table(head, rows)


def _share_of_acoustics(shares: dict[str, float]) -> float:
    """Return which share of a mission goes into what ns-3 does too."""
    return (shares["acoustics"] + shares["protocol"]) / (1.0 - shares["writing"])

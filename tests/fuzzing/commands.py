"""Command lines of every command there is, with values that nobody would give."""

from pathlib import Path
from random import Random

import click
from commands_for_tests import COMMANDS

from .files import EXPERIMENT, SCENARIO, TINY, Lines
from .material import lay_out
from .trees import as_yaml
from .values import KEYS, NUMBERS, PATHS, WORDS

# What keeps a command from doing what takes long; options that would undo it are not drawn.
GUARDS = {
    "run": ["--no-advice"],
    "live": ["--speed", "max"],
    "sweep": ["--dry-run"],
    "bench": ["--only", "(0,0)"],
    "reproduce": ["--reading", "none/such"],
}

# Values that options of these names take rightly, or nearly so.
ALMOST = {
    "advice_missions": ("0", "1", "-1", "x", ""),
    "advice_s": ("0", "0.01", "-1", "nan", "inf", "1e-300", "x", ""),
    "metrics": ("position_error_m", "fix_rate_hz", "position_eror_m", "seed", "status", ""),
    "metric": ("position_error_m", "fix_rate_hz", "position_eror_m", "seed", "status", ""),
    "until_ci": ("position_error_m=5%", "position_error_m=nan", "x=1", "position_error_m=-1", "="),
    "by": ("asvs.count", "asvs", "seed", "survey.side_m", ""),
    "baseline": ("2", "3", "4", "x", ""),
    "x": ("asvs.count", "seed", "x", ""),
    "series": ("asvs.count", "seed", "x", ""),
    "backend": ("local", "dask:", "dusk:x", "x", ""),
    "folders": ("run", "campaign", "run", "campaign", "empty"),
    "folder": ("run", "campaign", "run", "campaign", "empty"),
    "kind": ("trajectory", "fixes", "curves", "heatmap", "error", "x", "scenario", "experiment"),
    "pattern": ("auvs", "*", "**.", "[", "x", ""),
    "file": (EXPERIMENT, SCENARIO),
    "files": (EXPERIMENT, SCENARIO, "quickstart", "table_1", "quikstart"),
    "scenario": (SCENARIO,),
    "vary": (
        "asvs.count=2:4", "asvs.count=4:2", "auvs.count=1,2:3", "asvs.formation.angle_deg=0:9:3",
        "auvs.speed_m_per_s=0.5:1:0.25", "auvs.speed_m_per_s=0:1:1e-9", "asvs.count=:", "x=1:2:0",
        "protocol.schedule=dsatur,some:thing", "asvs.count",
    ),
    "what": ("paper",),
    "wanted": (
        "json:file:out.json", "nmea:file:out.txt", "json:tcp:0", "json:pty", "ugps:http:0", "json",
        "mavlink/AUV0:udp:127.0.0.1:9", "json:udp:x", "json/AUV9:pty", "ros2:file:b.mcap", ":", "",
    ),
    "only": ("ASV0", "ASV0,AUV1", ",", "AUV99", "x"),
    "start": ("2026-06-01T08:00:00Z", "2026-06-01", "0001-01-01", "9999-12-31T23:59:59Z", "now"),
    "bind": ("127.0.0.1", "300.0.0.1", "x y", ""),
    "poses": ("udp:0", "udp", "tcp:1", "udp:99999"),
}  # fmt: skip


def command(seed: int, draw: Random) -> Lines:
    """Lay out files and folders here; return a command line about them."""
    names = sorted(COMMANDS)
    name = names[seed % len(names)]
    line = [*_common(draw), name, *_words(name, draw)]
    lay_out([word for word in ("run", "campaign") if any(word in it for it in line)])
    Path(SCENARIO).write_text(as_yaml(TINY), encoding="utf-8")
    Path(EXPERIMENT).write_text(
        as_yaml({"scenario": SCENARIO, "vary": {"asvs.count": [2, 3]}, "seeds": 2}),
        encoding="utf-8",
    )
    return [line]


def _common(draw: Random) -> list[str]:
    odd = (["-q"], ["--json"], ["--set", "asvs.count=2"], ["--version"], ["-h"], ["--quite"])
    return draw.choice((*odd, *[[]] * 8))


def _words(name: str, draw: Random) -> list[str]:
    """Return arguments and options of a command, in any order."""
    guard = GUARDS.get(name, [])
    parts: Lines = []
    for parameter in COMMANDS[name].params:
        if isinstance(parameter, click.Argument):
            count = draw.choice(
                (1, 1, 1, 1, 0, 2, 3) if parameter.nargs == -1 else (1, 1, 1, 1, 1, 1, 0, 2)
            )
            parts += [[_value(parameter, draw)] for _ in range(count)]
        elif not set(parameter.opts) & set(guard):
            likely = 0.8 if parameter.required else 0.2
            parts += [_option(parameter, draw) for _ in range(2) if draw.random() < likely / 1.5]
    draw.shuffle(parts)
    if draw.random() < 0.05:
        parts.append([draw.choice(WORDS)])
    return [*guard, *(word for part in parts for word in part)]


def _option(parameter: click.Parameter, draw: Random) -> list[str]:
    name = draw.choice(parameter.opts)
    if getattr(parameter, "is_flag", False):
        return [name if draw.random() < 0.98 else f"{name}=x"]
    return [name, _value(parameter, draw)]


def _value(parameter: click.Parameter, draw: Random) -> str:
    """Return a value for a parameter, mostly one that is nearly right."""
    if draw.random() < 0.25:
        return draw.choice(WORDS)
    name, kind, metavar = parameter.name or "", parameter.type, parameter.metavar or ""
    if name in ALMOST:
        return draw.choice(ALMOST[name])
    if isinstance(kind, click.Choice):
        return str(draw.choice(kind.choices))
    if isinstance(kind, click.types.IntParamType | click.types.FloatParamType):
        return draw.choice(("0", "1", "2", "5", "1000000000", "-1", str(draw.choice(NUMBERS))))
    if "=" in metavar:
        values = ",".join(str(draw.choice(NUMBERS)) for _ in range(draw.choice((1, 1, 2))))
        return f"{draw.choice(KEYS)}={values}"
    return draw.choice(PATHS)

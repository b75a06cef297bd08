"""Starters of scenario files, written from the table of keys so that they never fall behind it."""

from collections.abc import Collection, Iterator, Mapping
from typing import TYPE_CHECKING

from ...support.wording import plain

if TYPE_CHECKING:
    from ...core.scenario import keys as table

# Column at which the comments begin.
MARGIN = 44

# Keys that every starter shows at work; the others stand in comments with their defaults.
IMPORTANT = (
    "duration_s",
    "survey.side_m",
    "survey.depth_m",
    "auvs.count",
    "auvs.speed_m_per_s",
    "auvs.route.kind",
    "asvs.count",
    "asvs.formation.angle_deg",
    "environment.sound_speed_m_per_s",
    "acoustics.hf.range_m",
    "acoustics.mf.range_m",
    "acoustics.loss.law",
    "protocol.schedule",
    "protocol.downlink",
    "usbl.heading_sd_deg",
    "navigation.filter",
    "record.detail",
)

# What each starter sets otherwise than the defaults.
TEMPLATES: Mapping[str, Mapping[str, object]] = {
    "starter": {"name": "my_mission"},
    "paper": {
        "name": "paper_mission",
        "acoustics.loss.law": "paper",
        "acoustics.loss.combine": "clamp_first",
        "protocol.tick_rate_hz": 30,
        "navigation.filter": {"model": "fixed_gain", "gain": 0.9, "delay_compensation": "none"},
        "record.metrics_hz": 30,
    },
    "still": {
        "name": "still_vehicles",
        "duration_s": 60,
        "survey.side_m": 60,
        "auvs.count": 2,
        "auvs.route.kind": "hold",
        "auvs.route.positions_m": [[15, 0], [-15, 0]],
        "asvs.count": 1,
        "asvs.formation.positions_m": [[0, 0]],
    },
    "large": {
        "name": "large_fleet",
        "survey.side_m": 400,
        "auvs.count": 16,
        "asvs.count": 12,
        "asvs.formation.radius_m": 150,
        "acoustics.mf.range_m": 400,
        "record.detail": "summary",
    },
}

# What does nothing in a starter stays in comments.
IDLE = {"still": ("auvs.speed_m_per_s", "asvs.formation.angle_deg")}

HEAD = """\
# Scenario for bindusbl-des. Lines in comments show the defaults; remove the # to change them.
# Check:  bindusbl-des validate FILE      Run:  bindusbl-des run FILE
# Editors complete and check the keys after:  bindusbl-des schema > scenario.schema.json
# yaml-language-server: $schema=scenario.schema.json
"""


def template(name: str) -> str:
    """Return a starter scenario file with every section, every key and a comment on each."""
    shown = [key for key in IMPORTANT if key not in IDLE.get(name, ())]
    return HEAD + "\n" + "\n".join(_lines(TEMPLATES[name], shown)) + "\n"


def _lines(values: Mapping[str, object], important: Collection[str]) -> Iterator[str]:
    from ...core.scenario import keys as table  # with all models: seldom needed

    optional = table.optional_sections()
    rows = table.keys()
    for row in rows:
        if not row.section:
            yield _line(row, values, row.key in important, row.section in optional)
    for section, meaning in table.sections().items():
        if "." not in section:
            yield ""
        name, comment = section.rpartition(".")[2], "# " * (section in optional)
        yield f"{_indent(section)}{comment}{name}:".ljust(MARGIN) + f"# {meaning}"
        for row in rows:
            if row.section == section:
                yield _line(row, values, row.key in important, row.section in optional)


def _indent(key: str) -> str:
    return "  " * key.count(".")


def _line(
    row: "table.Key", values: Mapping[str, object], is_important: bool, is_optional: bool
) -> str:
    given = row.key in values
    value = plain(values[row.key]) if given else row.default
    # Without its kind in the file, a key of another route would be a mistake.
    shown = given or is_important
    text = f"{_indent(row.key)}{'' if shown else '# '}{row.name}: {value}"
    return f"{text.ljust(MARGIN - 1)} # {_comment(row, is_optional)}"


def _comment(row: "table.Key", is_optional: bool) -> str:
    """Return the comment of a key: unit, meaning, choices, range, and which part it belongs to."""
    choices = " | ".join(row.choices)
    unit = "" if row.unit == "1" else row.unit
    with_it = row.section.rpartition(".")[2] if is_optional else ""
    remarks = (
        unit,
        row.meaning,
        choices,
        row.range,
        f"only {row.chooser}: {row.only}" if row.only else "",
        f"only with {with_it}" if with_it else "",
    )
    return "; ".join(remark for remark in remarks if remark)

"""A part declares itself: nobody else tests its name."""

import ast
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import bindusbl_des
from bindusbl_des.scenario import declared, families

LIBRARY = Path(bindusbl_des.__file__).parent

TABLES = {
    families.SCHEDULES: declared.SCHEDULES,
    families.DOWNLINKS: declared.DOWNLINKS,
    families.BROADCASTERS: declared.BROADCASTERS,
    families.RANGINGS: declared.RANGINGS,
    families.CHANNELS: declared.CHANNELS,
    families.FILTERS: declared.NAVIGATORS,
}

# Words that name a part and other things too, such as a table of results.
AMBIGUOUS = {"table", "positions", "array", "track", "nearest", "fixed", "random", "follow"}
NAMES = {name for names in TABLES for name in names} - AMBIGUOUS

# Where names of parts belong: registries, and the modules in which the parts work.
HOMES = (
    *("scenario/declared.py", "scenario/families.py", "scenario/files/templates.py"),
    *("protocol/access/", "protocol/schedules/", "protocol/downlinks.py", "protocol/ranging.py"),
    *("protocol/broadcasters.py", "acoustics/named_channels.py", "presets/"),
)

# Comparisons with names of parts that are left in each room; a number here may only fall.
LEFT = {
    "acoustics": 3,
    "campaigns": 1,
    "commands": 5,
    "figures": 1,
    "mission": 7,
    "planning": 5,
    "preflight/idle": 1,
    "report": 1,
    "results": 4,
    "scenario": 15,
    "usbl": 1,
}


def _compared(tree: ast.AST) -> Iterator[ast.Constant]:
    """Yield what is compared, matched or looked up."""
    for node in ast.walk(tree):
        met: list[ast.expr] = []
        if isinstance(node, ast.Compare):
            met = [node.left, *node.comparators]
        elif isinstance(node, ast.MatchValue):
            met = [node.value]
        elif isinstance(node, ast.Dict):
            met = [key for key in node.keys if key is not None]
        while met:
            value = met.pop()
            if isinstance(value, ast.Tuple | ast.List | ast.Set):
                met += value.elts
            elif isinstance(value, ast.Constant):
                yield value


def _found() -> Iterator[tuple[str, str]]:
    """Yield each comparison with the name of a part outside its home: the room, and where."""
    for path in sorted(LIBRARY.rglob("*.py")):
        name = path.relative_to(LIBRARY).as_posix()
        if name.startswith(HOMES):
            continue
        room = "preflight/idle" if name.startswith("preflight/idle") else name.split("/")[0]
        for constant in _compared(ast.parse(path.read_text("utf-8"))):
            if constant.value in NAMES:
                yield room, f"{name}:{constant.lineno}: {constant.value}"


def test_each_part_that_ships_declares_itself() -> None:
    """What a scenario can name has a record, and nothing else has."""
    for names, table in TABLES.items():
        assert set(names) == set(table)


def test_nobody_tests_the_name_of_a_part() -> None:
    """Whoever needs to know something of a part asks its record."""
    found = list(_found())
    counts = Counter(room for room, _ in found)
    lines = {room: [line for own, line in found if own == room] for room in counts}
    assert {room: lines[room] for room in counts if counts[room] > LEFT.get(room, 0)} == {}

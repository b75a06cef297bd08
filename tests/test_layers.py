"""The rooms of the package: arrows point downwards, and each library has one home."""

import ast
import re
import runpy
import subprocess
import sys
from functools import cache
from importlib import import_module
from importlib.util import resolve_name
from pathlib import Path
from pydoc import locate

import networkx as nx
import pytest

import bindusbl_des

PACKAGE = Path(__file__).parents[1] / "bindusbl_des"

# From the ground to the faces; a room imports only from itself and from those before it.  Rooms of
# what a mission is are in `core`, of what reasons about missions in `apps`; charts and presets are
# in `models`, whose other folders are one room: the core knows their names alone.
ROOMS = [
    *("support", "geometry", "sea", "records", "charts", "vehicles", "presets", "scenario"),
    *("acoustics", "usbl", "navigation", "protocol", "setup", "results", "mission", "models"),
    *("preflight", "verification", "explain", "report", "figures", "export", "live", "gym"),
    *("recorded", "campaigns", "advice", "planning", "benchmark", "workbench", "commands"),
    *("cli", "dynamics", "__main__"),
]

# What commands run that is not the library: folders of the repository, which the wheel has, too.
BESIDE = ("benchmarks", "properties", "experiments")

# Libraries that only these rooms and modules may import (numpy is everywhere).
HOMES = {
    "simpy": "core.protocol core.mission models.access apps.live.readings gym",
    "gymnasium": "gym",
    "pettingzoo": "gym",
    "networkx": "core.protocol.conflicts core.protocol.view core.geometry.ways",
    "pelagic": "models.channels.table_channel",
    "pyogrio": "models.charts.grid_charts",
    "pyproj": "models.charts.positions",
    "pyarrow": "models.channels.ray_tables core.results core.mission.tables core.mission.modems "
    "apps.campaigns apps.export apps.recorded",
    "yaml": "support.plain_yaml support.yaml_edits",
    "click": "cli apps.commands",
    "numba": "support.compiled support.packed",
    "pydantic": "core.scenario core.results core.acoustics.sound_settings apps.campaigns",
    "pydantic_core": "core.scenario",
    "matplotlib": "apps.figures apps.recorded",
    "pandas": "core.results apps.campaigns apps.benchmark",
    "foxglove": "support.mcap_log apps.export apps.live.ros2",
    "gsw": "core.sea.water",
    "xarray": "models.ocean models.charts.bottoms",
    "rasterio": "models.charts.bottoms",
    "gtsam": "apps.recorded.replaying",
    "mcap": "models.charts.recordings",
    "mcap_protobuf": "models.charts.recordings",
    "starlette": "apps.workbench.server",
    "uvicorn": "apps.workbench.server",
}


def modules() -> list[Path]:
    return sorted(PACKAGE.rglob("*.py"))


def name_of(path: Path) -> str:
    """Return the dotted name of a module below the package, empty for the package itself."""
    parts = path.relative_to(PACKAGE).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


NAMES = {name_of(path): path for path in modules()}


def room_of(name: str) -> str:
    """Return the room of a module, empty for the package and for what a group of rooms says."""
    group, _, below = name.partition(".")
    room = below.partition(".")[0]
    if group == "models":
        return room if room in ROOMS else group
    return room if group in ("core", "apps") else group


@cache
def tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text())


@cache
def imports(path: Path) -> tuple[set[str], set[str]]:
    """Return the package's own modules and the libraries that a file imports, for types as well."""
    own, others = set(), set()
    folder = path.relative_to(PACKAGE).parent.parts
    for node in ast.walk(tree(path)):
        if isinstance(node, ast.Import):
            others |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            others.add((node.module or "").split(".")[0])
        elif isinstance(node, ast.ImportFrom):
            above = folder[: len(folder) - node.level + 1]
            module = ".".join([*above, *filter(None, [node.module])])
            names = {f"{module}.{alias.name}".lstrip(".") for alias in node.names}
            own |= names & set(NAMES) or {module}
    return own, others


def test_every_room_is_on_the_plan() -> None:
    assert {room_of(name) for name in NAMES} - {""} == set(ROOMS)


@pytest.mark.parametrize("room", ROOMS)
def test_a_room_imports_only_from_those_below(room: str) -> None:
    """Events know nothing of protocols, protocols nothing of tables, tables nothing of commands."""
    for name in (it for it in NAMES if room_of(it) == room):
        own, others = imports(NAMES[name])
        assert "bindusbl_des" not in others, f"{name} imports modules of ours by their full names"
        beside = {it for it in own if it.split(".")[0] in BESIDE}
        assert not beside or room == "commands", f"{name} imports what is not the library: {beside}"
        above = {it for it in own - beside if ROOMS.index(room_of(it)) > ROOMS.index(room)}
        assert not above, f"{name} imports upwards: {above}"
        for library in others & set(HOMES):
            homes = HOMES[library].split()
            assert any(f"{name}.".startswith(f"{it}.") for it in homes), f"{library} in {name}"


def test_no_files_go_in_circles() -> None:
    arrows = [(name, own) for name, path in NAMES.items() if name for own in imports(path)[0]]
    circles = nx.strongly_connected_components(nx.DiGraph(arrows))
    assert [sorted(circle) for circle in circles if len(circle) > 1] == []


# Where numbers have names: outcomes, models and kinds of columns, no places in a row; and the table
# of motions, which as records would cost each entry 0.12 us more (6 % of a mission).
NUMBERED = {
    "core.vehicles.motion",
    *("core.records.events", "core.protocol.access.seatrac", "core.results.tables"),
    *(
        "core.vehicles.guidance.flight",
        "core.vehicles.hulls.forces",
        "core.vehicles.sailing",
        "apps.report.recording",
    ),
}


def test_rows_have_fields_and_no_numbered_columns() -> None:
    """A row's numbers are read by name: no `X, Y, Z = range(3)` tells where they lie in it."""
    numbered = {
        name
        for name, path in NAMES.items()
        for node in tree(path).body
        if isinstance(node, ast.Assign)
        and isinstance(node.targets[0], ast.Tuple)
        and isinstance(node.value, ast.Call)
        and ast.unparse(node.value.func) == "range"
    }
    assert numbered <= NUMBERED


def test_every_folder_of_tests_is_that_of_a_room() -> None:
    """Who looks for the tests of a room, or of what is beside them, finds them by its name."""
    tests = Path(__file__).parent
    folders = {path.parent.name for path in tests.glob("*/test_*.py")}
    assert folders <= {*ROOMS, *BESIDE, "second"}  # a second program, which has no room
    assert {"fuzzing", "golden", "reference"} | folders >= {
        path.name for path in tests.glob("[!._]*") if any(path.glob("*.*"))
    }


def test_files_that_the_design_names_are_there() -> None:
    repository = PACKAGE.parent
    named = re.findall(r"`([\w/]+\.py)`", (repository / "docs/design.md").read_text())
    assert len(named) > 20
    gone = [it for it in named if not any((at / it).is_file() for at in (PACKAGE, repository))]
    assert gone == []


def test_the_design_lists_the_rooms_from_the_ground_up() -> None:
    """A room leans on those above it in the table, as `ROOMS` has them."""
    told = (PACKAGE.parent / "docs/design.md").read_text().partition("| room |")[2]
    cells = re.findall(r"^\| ((?:`\w+`(?:, )?)+) \|", told, re.MULTILINE)
    listed = re.findall(r"\w+", " ".join(cells))
    assert sorted(set(ROOMS) - set(listed)) == ["dynamics"]
    assert [room for room in ROOMS if room in listed] == listed


def test_the_files_of_the_three_ways_are_named() -> None:
    """Those of a ping, a key and a plan, as the design tells; each holds what it says."""
    told = (PACKAGE.parent / "docs/design.md").read_text().partition("## Three ways through it")[2]
    told = told.partition("### A part")[0]
    rows = re.findall(r"^\|[^|]*\| `([\w/]+\.py)` \|([^|]*)\|$", told, re.MULTILINE)
    files = [file for file, _ in rows]
    assert files[0] == "core/protocol/conflicts.py"
    assert len(set(files)) > 20
    for file, words in rows:
        marked = re.findall(r"`([\w./]+)`", words)
        others = [it for it in marked if it.endswith(".py")]
        named = {it.rpartition(".")[2] for it in marked if it not in others}
        defined = set(re.findall(r"(?:def|class) (\w+)", (PACKAGE / file).read_text()))
        assert named <= defined, file


# What is told of other places than those of a mission: where AUVs might be, or ASVs might go, where
# a map shows the chance of a fix; and how long modems are busy, once all is over.
OTHER_PLACES = {
    *("core.protocol.view", "core.protocol.anchors.follow"),
    *("apps.preflight.fix_chance", "core.acoustics.energy"),
}


def test_within_range_is_decided_in_one_function() -> None:
    """Who is within range of whom in a mission is what `acoustics.propagation.within` says."""
    rooms, deciding = ("acoustics", "usbl", "navigation", "protocol", "mission", "models"), set()
    for name, path in NAMES.items():
        for it in ast.walk(ast.parse(path.read_text())):
            if isinstance(it, ast.Compare) and room_of(name) in rooms:
                sides = [it.left, *it.comparators]
                is_range = re.search(r"\b(reach|[hm]f_range|range_m)\b", ast.unparse(it))
                if is_range and not any(isinstance(side, ast.Constant) for side in sides):
                    deciding.add(name)
    assert deciding - OTHER_PLACES == {"core.acoustics.propagation"}


def test_the_picture_of_the_house_is_that_of_its_imports() -> None:
    """docs/figures/house.svg shows each room; what leans on another is led there by arrows, and no
    arrow is there that is no import.
    """
    folder = PACKAGE.parent / "docs" / "figures"
    svg = (folder / "house.svg").read_text()
    house = runpy.run_path(str(folder / "house.py"))
    assert svg == house["drawn"](house["imports"]()), "run python docs/figures/house.py"
    boxes = re.findall(r'x="(\d+)" y="(\d+)" width="(\d+)" height="(\d+)".*?>(\w+)</text>', svg)
    arrows = re.findall(r'd="M(\d+) (\d+)[^"]*[ CL](\d+) (\d+)" fill="none"', svg)
    rooms = set(ROOMS) - {"cli", "dynamics", "__main__"}
    assert {box[-1] for box in boxes} == rooms
    drawn = [(room_at(boxes, *ends[:2]), room_at(boxes, *ends[2:])) for ends in arrows]
    assert len(drawn) == svg.count("marker-end")
    lean = {(room_of(a), room_of(b)) for a in NAMES for b in imports(NAMES[a])[0]}
    assert set(drawn) <= lean
    led = nx.transitive_closure(nx.DiGraph(drawn))
    assert {(a, b) for a, b in lean if a != b and {a, b} <= rooms} <= set(led.edges)


def room_at(boxes: list[tuple[str, ...]], x: str, y: str) -> str:
    """Return the room at whose edge an arrow of the picture begins, or before which it ends."""
    for *sides, room in boxes:
        left, top, width, height = map(int, sides)
        if -2 <= int(x) - left <= width + 2 and -2 <= int(y) - top <= height + 2:
            return room
    raise AssertionError(f"no room is at {x}, {y}")


def test_variables_say_what_they_are() -> None:
    """No loop, comprehension, lambda or function calls `it` what it goes through, or is given."""
    nameless = [
        f"{name}:{node.lineno}"
        for name, path in NAMES.items()
        for node in ast.walk(tree(path))
        if (isinstance(node, ast.Name) and node.id in ("it", "its"))
        or (isinstance(node, ast.arg) and node.arg in ("it", "its"))
    ]
    assert nameless == []


# What a scenario means is asked of its Setup: so many calls still hand on a whole scenario, to read
# keys, to lay others over them, or to make missions of it.
HANDED_ON = 107


def test_few_functions_are_given_a_whole_scenario() -> None:
    """Their number may only fall."""
    calls = re.findall(r"\w\(scenario[,)]", "".join(path.read_text() for path in NAMES.values()))
    assert len(calls) <= HANDED_ON


# Rooms that apply what the kernel decides, and the rooms of the kernel that decide something.
# What the others know (geometry, sea, records, charts, presets, results) is mathematics and tables.
APPLICATIONS = {*ROOMS[ROOMS.index("preflight") :]} - {"dynamics"}
DECIDING = {
    *("vehicles", "scenario", "acoustics", "usbl", "navigation", "protocol", "setup", "mission"),
}
KNOWING = {"geometry", "sea", "records", "charts", "presets", "results"}


def inner_names(of: set[str]) -> list[tuple[str, str]]:
    """Return the names, not public, that applications import from rooms, once for each import."""
    public = {(module, name) for name, module in bindusbl_des._HOMES.items()}
    found = []
    for name, path in NAMES.items():
        if room_of(name) not in APPLICATIONS:
            continue
        folder = path.relative_to(PACKAGE).parent.parts
        for node in ast.walk(tree(path)):
            if isinstance(node, ast.ImportFrom) and node.level:
                above = folder[: len(folder) - node.level + 1]
                module = ".".join([*above, *filter(None, [node.module])])
                if room_of(module) in of:
                    found += [(module, alias.name) for alias in node.names]
    return [it for it in found if it not in public]


# How much applications still know of the inside of these rooms: imports, and names among them.
@pytest.mark.parametrize(
    ("rooms", "imports", "names"), [(DECIDING, 117, 65), (KNOWING, 183, 96)],
    ids=["deciding", "knowing"],
)  # fmt: skip
def test_applications_stand_on_public_names(rooms: set[str], imports: int, names: int) -> None:
    """Their numbers may only fall: what an application asks is a fact of the setup, or public."""
    found = inner_names(rooms)
    assert len(found) <= imports
    assert len(set(found)) <= names


# How many names tests take from modules below the package, once for each import.
TAKEN_BY_TESTS = 557


def test_tests_know_the_world_and_not_the_layout() -> None:
    """Their number may only fall: what users see is said by public names, commands and tables."""
    taken = 0
    for path in Path(__file__).parent.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("bindusbl_des."):
                taken += len(node.names)
            elif isinstance(node, ast.ImportFrom) and node.module == "bindusbl_des":
                taken += sum(alias.name not in bindusbl_des.__all__ for alias in node.names)
            elif isinstance(node, ast.Import):
                taken += sum(alias.name.startswith("bindusbl_des.") for alias in node.names)
    assert taken <= TAKEN_BY_TESTS


def test_explaining_only_words_what_is_on_record() -> None:
    """It asks no part, draws nothing, searches no overlap: each was noted where it was decided."""
    told = {room_of(other) for name in NAMES if room_of(name) == "explain"
            for other in imports(NAMES[name])[0]}  # fmt: skip
    assert told <= {"explain", "records", "results", "support"}


# What is entered in plain Python: files, and functions with names among them.
ENTERED = {"world": (66, 317), "ping": (42, 224)}


def test_few_files_and_functions_are_entered() -> None:
    """Building a world, and one ping until its fix is used: their numbers may only fall."""
    script = PACKAGE.parent / "scripts" / "trace_ping.py"
    told = subprocess.run([sys.executable, script], capture_output=True, text=True, check=True)
    counted = re.findall(r"(\w+): (\d+) files, (\d+) functions", told.stdout)
    assert {what for what, *_ in counted} == set(ENTERED)
    for what, files, functions in counted:
        assert int(files) <= ENTERED[what][0], what
        assert int(functions) <= ENTERED[what][1], what


def test_docstrings_refer_to_what_there_is() -> None:
    """`:func:`.room.thing`` counts from the module's package, `:func:`thing`` from the module."""
    missing = []
    for name, path in NAMES.items():
        if name == "__main__":  # which runs
            continue
        module = import_module(f"bindusbl_des.{name}".rstrip("."))
        package = module.__name__ if path.name == "__init__.py" else module.__package__
        for found in re.findall(r":(?:mod|class|func|data):`([\w.]+)`", path.read_text()):
            if found.startswith("."):
                there = locate(resolve_name(found, package))
            else:
                there = locate(f"{module.__name__}.{found}") or locate(found)
            if there is None:
                missing.append(f"{path}: {found}")
    assert not missing

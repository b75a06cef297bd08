"""The layers of the package: data goes one way, and each library has one home."""

import ast
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "bindusbl_des"

# From the words of the domain to the faces; a module imports only from its own layer or lower ones.
LAYERS = [
    "compiled code_cache clock ctrl_c durable durable_folder kept_tracks plugin_sources plugins "
    "wording events worst columns growing streams progress palette quantities plain_json effects",
    "water loss light_time formations coverage dubins paths turns routes hydrophones usbl fusion "
    "conflicts colouring logs motion propagation calling round_trip measurement reception "
    "dead_reckoning belief track_file currents vehicles dynamics guidance geodesy",
    "key_types route_keys families consistency vehicle_choice scenario idle_keys",
    "navigation own_navigator recorder fleet slots planned",
    "uplink downlink ranging boards broadcasters schedules chart network protocol",
    "voyages launch onboard courses build world samples metrics",
    "round_lengths worth_knowing effort arrow_columns tables event_tables rounds figures summary "
    "result result_folder loading parquet_reading contradictions simulation explain report export",
    "plain_yaml yaml_syntax mistakes overrides explanations scenario_keys templates scenario_file",
    "campaigns advice sweep_data sweep_report benchmark",
    "reproduction",
    "commands cli manual __init__",
]
RANK = {name: rank for rank, names in enumerate(LAYERS) for name in names.split()}

# Libraries that only these modules may import (numpy is everywhere).
HOMES = {
    "simpy": "boards downlink ranging protocol network build simulation",
    "networkx": "conflicts schedules",
    "pyarrow": "arrow_columns tables event_tables result loading parquet_reading contradictions "
    "simulation campaigns export",
    "yaml": "plain_yaml yaml_syntax",
    "click": "cli commands manual",
    "numba": "compiled code_cache",
    "pydantic": "key_types route_keys scenario scenario_file scenario_keys campaigns",
    "pydantic_core": "scenario scenario_file vehicle_choice",
    "matplotlib": "figures reproduction",
    "pandas": "result summary campaigns reproduction",
    "foxglove": "export",
}


def modules() -> list[Path]:
    return sorted(PACKAGE.rglob("*.py"))


def home(path: Path) -> str:
    return path.relative_to(PACKAGE).parts[0].removesuffix(".py")


def imports(path: Path) -> tuple[set[str], set[str]]:
    """Return the package's own modules and the libraries that a file imports."""
    own, others = set(), set()
    depth = len(path.relative_to(PACKAGE).parts)
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            others |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            others.add((node.module or "").split(".")[0])
        elif isinstance(node, ast.ImportFrom) and node.level == depth:
            names = [node.module] if node.module else [alias.name for alias in node.names]
            own |= {name.split(".")[0] for name in names}
    return own, others


@pytest.mark.parametrize("path", modules(), ids=lambda path: str(path.relative_to(PACKAGE)))
def test_a_module_imports_only_downwards(path: Path) -> None:
    """Events know nothing of protocols, protocols nothing of tables, tables nothing of commands."""
    if home(path) == "__init__":
        return
    own, others = imports(path)
    assert "bindusbl_des" not in others, "the package imports its own modules relatively"
    above = {name for name in own if RANK[name] > RANK[home(path)]}
    assert not above, f"{home(path)} imports upwards: {above}"
    for library, homes in HOMES.items():
        if library in others:
            assert home(path) in homes.split(), f"{library} has no home in {home(path)}"


def test_every_module_has_a_layer() -> None:
    """No room of the house is left off the plan, and the plan names no room that is gone."""
    assert {home(path) for path in modules()} == set(RANK)


def test_files_stay_readable() -> None:
    """A file that grows beyond 350 lines holds more than one idea."""
    assert [path.name for path in modules() if len(path.read_text().splitlines()) > 350] == []

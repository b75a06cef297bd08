"""A part declares itself: nobody else tests its name."""

import ast
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path
from typing import Any

import pytest

import bindusbl_des
from bindusbl_des import Scenario, View, ping_group, simulate
from bindusbl_des.core.protocol.network import Steps
from bindusbl_des.core.scenario import families

LIBRARY = Path(bindusbl_des.__file__).parent
ROOT = Path(__file__).parents[1]

# Words that name a part and other things too, such as a table of results or a type of JSON.
AMBIGUOUS = {"table", "array", "nearest", "fixed", "random", "broadcast", "shared", "most_fixes"}
AMBIGUOUS |= {"positions", "track"}
NAMES = {name for family in families.FAMILIES for name in family.parts} - AMBIGUOUS

# The models of parts and of their settings: who asks which of them it has asks which part it is.
SECTIONS = {
    it
    for family in (families.ROUTE, families.PLACEMENT)
    for section in family.traits.values()
    for it in section.__mro__
    if it.__module__.endswith(("routes", "placements"))
}
MODELS = {it.__name__ for family in families.FAMILIES for it in family.settings.values()} - {
    "Settings"
}
MODELS |= {it.__name__ for it in SECTIONS} | {"OwnSection", "OwnRoute", "OwnPlacement"}

# Where names of parts belong: registries, and the modules in which the parts work.
HOMES = (
    "models/",
    *("core/protocol/access/", "core/protocol/anchors/", "core/protocol/downlinks.py"),
    *("core/protocol/ranging.py", "core/scenario/families.py", "core/scenario/site.py"),
    *("core/scenario/sections/routes.py", "core/scenario/sections/placements.py"),
    *("core/vehicles/hulls/", "apps/commands/starters.py"),
    "apps/benchmark/",  # methods that enter by their names
)

# What is left, and why.
DEFENDED = {
    "core/acoustics/sonar_equation.py: Sonar": "the part's own equations: of pings, or of frames",
    "apps/planning/placement.py: information": "an objective by which places are judged",
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
        yield from _constants(met)


def _constants(met: list[ast.expr]) -> Iterator[ast.Constant]:
    """Yield the constants among expressions, and in tuples, lists and sets of them."""
    for value in met:
        if isinstance(value, ast.Tuple | ast.List | ast.Set):
            yield from _constants(value.elts)
        elif isinstance(value, ast.Starred):
            yield from _constants([value.value])
        elif isinstance(value, ast.Constant):
            yield value


def _found(tree: ast.AST) -> Iterator[str]:
    """Yield by what a module tells parts apart: names that it compares, constants that hold names,
    and models of settings that it asks for.
    """
    for constant in _compared(tree):
        if constant.value in NAMES:
            yield str(constant.value)
    for node in ast.walk(tree):
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
            held = [it.value for it in _constants([node.value])]
            if held and all(isinstance(it, str) for it in held) and NAMES & set(held):
                yield node.targets[0].id
        elif isinstance(node, ast.Call) and getattr(node.func, "id", "") == "isinstance":
            yield from _models(node.args[1])
        elif isinstance(node, ast.MatchClass):
            yield from _models(node.cls)


def _models(tree: ast.AST) -> list[str]:
    """Return the models of parts that an expression names."""
    return sorted({it.id for it in ast.walk(tree) if isinstance(it, ast.Name)} & MODELS)


def replying(network: Any, turn: Any, time: float) -> Steps:
    """A downlink that declares what `direct_reply` does."""
    for slot in range(len(turn.groups)):
        time = yield from ping_group(network, turn, slot, time)
    turn.row.downlink_s = 0.0
    return time


def in_turn(view: View) -> list[list[int]]:
    """A schedule that declares what `round_robin` does."""
    return [[view.round % len(view.auvs)]]


replying.replies = True
in_turn.framed, in_turn.groups, in_turn.turn = True, "frame", "rotation"


@pytest.mark.parametrize(
    ("key", "own", "shipped"),
    [("downlink", replying, "direct_reply"), ("schedule", in_turn, "round_robin")],
)
def test_a_part_of_ones_own_is_treated_as_it_declares(key: str, own: object, shipped: str) -> None:
    """One that declares what a shipped part does flies the same mission."""
    missions = [
        Scenario.model_validate(
            {"name": "m", "duration_s": 20, "protocol": {"schedule": "one_per_slot", key: part}}
        )
        for part in (own, shipped)
    ]
    mine, theirs = (simulate(it, 1).tables for it in missions)
    assert all(mine[name].equals(theirs[name]) for name in theirs)


def test_the_manual_lists_what_a_part_may_declare() -> None:
    """Each attribute but those that only parts that ship have."""
    page = (ROOT / "docs" / "extending.md").read_text("utf-8")
    listed = page.partition("## What a part declares")[2].partition("```")[0]
    of_ours = {"settings", "frame_settings", "advised", "is_proposed", "is_proved"}
    for family in families.FAMILIES:
        if family.is_open and family.undeclared is not None and family is not families.ACCESS:
            for field in fields(family.undeclared):
                assert field.name in of_ours or f"`{field.name}`" in listed


def test_nobody_tests_which_part_it_is() -> None:
    """Whoever needs to know something of a part asks its record."""
    found = set()
    for path in sorted(LIBRARY.rglob("*.py")):
        name = path.relative_to(LIBRARY).as_posix()
        if not name.startswith(HOMES):
            tree = ast.parse(path.read_text("utf-8"))
            found |= {f"{name}: {what}" for what in _found(tree)}
    assert found == set(DEFENDED)


@pytest.mark.parametrize(
    "code",
    [
        'if scenario.protocol.ranging == "twtt": pass',
        'if name in ("a", "smoother"): pass',
        'gain = {"fixed_gain": 0.9}[name]',
        'match name:\n    case "passive": pass',
        'def is_passive(self): return self.ranging == "passive"',
        'CALLED = ("twtt", *("polling",))',
        'ONE = "aloha"',
        "if isinstance(settings, SuperTdma | Polling): pass",
        'if scenario.auvs.route.kind == "hold": pass',
        'steers = vehicle.model not in ("kinematic", "moored")',
        "if isinstance(scenario.asvs.formation, Placed): pass",
        "match placement:\n    case Follow(): pass",
    ],
)
def test_it_is_found_however_it_is_written(code: str) -> None:
    """By a literal, a constant, a property or a type."""
    assert list(_found(ast.parse(code)))

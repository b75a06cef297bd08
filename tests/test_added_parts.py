"""CONTRIBUTING.md's recipes, followed in a copy of the package: a part is one file and one line."""

import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

import bindusbl_des

PACKAGE = Path(bindusbl_des.__file__).parent

Copy = Callable[..., str]

# A file of a part, and the line after which its own line stands in `families.py`
PARTS = {
    "models/loop.py": '''
from typing import Literal

from ..core.scenario.sections.placements import Placed


class Loop(Placed):
    """ASVs go round the middle of the AUVs."""

    model: Literal["loop"] = "loop"

    def mover(self, site, errors):
        return self

    def targets(self, view):
        import numpy as np

        middle = view.auvs(view.begins)[:, :2].mean(axis=0)
        turn = view.begins / 10 + np.arange(len(view.vessels))
        return middle + 20 * np.stack([np.cos(turn), np.sin(turn)], axis=1)
''',
    "models/line.py": '''
from typing import Literal

from ..core.scenario.sections.placements import Shipped


class Line(Shipped):
    """ASVs lie in a line along x."""

    model: Literal["line"] = "line"

    def stations(self, view):
        return [(7.0 * asv, 0.0) for asv in range(view.asvs)]
''',
    "models/kite.py": '''
from typing import ClassVar, Literal

from ..core.scenario.sections.routes import Flown


class Kite(Flown):
    """AUVs fly to and fro in parallel."""

    is_flown: ClassVar[bool] = True
    is_worked_out: ClassVar[bool] = True

    kind: Literal["kite"] = "kite"

    def ways(self, view):
        return [[(-20.0, 5.0 * auv), (20.0, 5.0 * auv)] for auv in range(view.auvs)]
''',
    "models/twice.py": """
from ..core.scenario.families import BroadcasterTraits, RangingTraits
from ..core.scenario.key_types import Real, key
from ..core.scenario.part_choice import Settings


class Twice(Settings):
    apart_s: Real = key(0.1, "s", "from an AUV's first ping to its second", gt=0, le=1)


@RangingTraits(settings=Twice, own_clocks=True)
def twice(slot, time, *, settings):
    slot.ping(slot.group, time)
    yield slot.until(time + settings.apart_s)
    slot.ping(slot.group, time + settings.apart_s)


twice.slot_s = lambda ping_s, way_s, crossing_s: 0.3 + ping_s + way_s + crossing_s


@BroadcasterTraits()
def last(view):
    return view.count - 1
""",
}
LINES = {
    '"visit": "models.placements:Visit",': '"loop": "models.loop:Loop",',
    '"zigzag": "models.placements:Zigzag",': '"line": "models.line:Line",',
    '"hold": "core.scenario.sections.routes:Hold",': '"kite": "models.kite:Kite",',
    '"twtt": "models.rangings:twtt",': '"twice": "models.twice:twice",',
    '"rotate": "models.broadcasters:rotate",': '"last": "models.twice:last",',
}


@pytest.fixture
def copy(tmp_path: Path) -> Copy:
    """Return how to run Python, uncompiled, with a copy of the package in which lines follow."""

    def run(script: str, edits: dict[tuple[str, str], str], parts: dict[str, str]) -> str:
        there = tmp_path / PACKAGE.name
        shutil.copytree(PACKAGE, there)
        for (file, line), more in edits.items():
            text = (there / file).read_text("utf-8")
            assert text.count(line) == 1, line
            (there / file).write_text(text.replace(line, f"{line}\n{more}"), "utf-8")
        for file, text in parts.items():
            (there / file).write_text(text, "utf-8")
        given = {**os.environ, "NUMBA_DISABLE_JIT": "1", "PYTHONPATH": str(tmp_path)}
        ran = subprocess.run(
            [sys.executable, "-c", script], cwd=tmp_path, env=given, capture_output=True, text=True
        )
        return ran.stdout + ran.stderr

    return run


def of_families(lines: dict[str, str]) -> dict[tuple[str, str], str]:
    return {("core/scenario/families.py", line): more for line, more in lines.items()}


def test_a_part_is_one_file_and_one_line(copy: Copy) -> None:
    """Placements, a route, a ranging, a broadcaster: validated, flown and explained by that."""
    told = copy(
        """
from bindusbl_des import Scenario, simulate, verify
from bindusbl_des.apps.explain import chain_of_fix

def fly(**formation):
    return simulate(Scenario.model_validate({
        "name": "m", "duration_s": 3, "auvs": {"count": 2, "route": {"kind": "kite"}},
        "asvs": {"count": 2, "formation": formation},
        "protocol": {"ranging": "twice", "broadcaster": "last"},
    }), 1)

found = fly(model="line")
print("stations", found.setup.stations_m)
pings = found.tables["pings"]
print("pings", len(pings) / len(pings[["auv", "round"]].drop_duplicates()))
print(chain_of_fix(found, 0))
print([it.kind for it in verify(found.scenario).pairs])
print("moved", fly(model="loop").tables["tracks"].query("vehicle == 'ASV1'").y_m.abs().max() > 5)
""",
        of_families(LINES),
        PARTS,
    )
    assert "stations ((0.0, 0.0), (7.0, 0.0))" in told, told
    assert "pings 2.0" in told, told
    assert "last: a rule of its own chose ASV1" in told
    assert "ranging by steps" in told
    assert "moved True" in told


def test_a_section_and_its_line_that_differ_in_their_name_are_one_error(copy: Copy) -> None:
    lines = {'"zigzag": "models.placements:Zigzag",': '"lap": "models.loop:Loop",'}
    told = copy("import bindusbl_des.core.scenario.scenario", of_families(lines), PARTS)
    assert told.splitlines()[-1] == (
        "TypeError: asvs.formation.model: 'lap' in families.py is Loop, whose model is 'loop'; "
        "give both the same name"
    )


METRIC = {
    ("core/records/metrics.py", '    auv: int = column("", "AUV")'): (
        '    turns: int = metric("1", "turns of its own", "slots that were its own")'
    )
}
VALUE = {
    ("core/mission/metrics.py", '    metrics["slots_missed"] = _missed(world.record, count)'): (
        '    metrics["turns"] = np.bincount(world.record.pings.rows["auv"], minlength=count)'
    )
}


def test_a_metric_is_a_row_and_its_value(copy: Copy) -> None:
    told = copy(
        """
from bindusbl_des import Scenario, simulate
from bindusbl_des.core.records.metrics import quantity

ran = simulate(Scenario(name="m", duration_s=3), 1)
print(quantity("turns"), ran.tables["auvs"].turns.tolist() == ran.tables["auvs"].pings.tolist())
""",
        METRIC | VALUE,
        {},
    )
    assert "turns of its own (count) True" in told


def test_a_metric_whose_value_is_forgotten_ends_the_mission(copy: Copy) -> None:
    script = "from bindusbl_des import *; simulate(Scenario(name='m', duration_s=3), 1)"
    assert "AUV0's turns is no number" in copy(script, METRIC, {})

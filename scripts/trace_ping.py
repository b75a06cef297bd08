"""Count what one ping passes through: which files and functions of the package it enters.

    python scripts/trace_ping.py [--names]

It runs a mission of three AUVs and three ASVs in plain Python, without compiled code, and traces
two things: how the mission's world is built; and one ping, from the start of its slot over sound,
measurement, frame and delivery to the estimate that its fix corrects.  `tests/test_layers.py` holds
what is counted to its limits.
"""

import os
import sys
from collections.abc import Callable
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

os.environ["NUMBA_DISABLE_JIT"] = "1"  # so that equations run in Python, where they are seen
sys.path.insert(0, str(Path(__file__).parents[1]))

from bindusbl_des import Mission, load_scenario

PACKAGE = Path(__file__).parents[1] / "bindusbl_des"


def entered(work: Callable[[], Any]) -> set[CodeType]:
    """Return the code of the package that some work enters."""
    found: set[CodeType] = set()

    def note(frame: FrameType, event: str, _: Any) -> None:
        if event == "call":
            found.add(frame.f_code)

    sys.setprofile(note)
    try:
        work()
    finally:
        sys.setprofile(None)
    here = f"{PACKAGE}{os.sep}"
    return {code for code in found if code.co_filename.startswith(here)}


def counted(codes: set[CodeType]) -> tuple[list[str], list[str]]:
    """Return the files, and the functions with names, that some code is of."""
    files = {str(Path(code.co_filename).relative_to(PACKAGE)) for code in codes}
    named = {
        f"{Path(code.co_filename).relative_to(PACKAGE)}:{code.co_qualname}"
        for code in codes
        if not code.co_name.startswith("<")
    }
    return sorted(files), sorted(named)


def traced() -> dict[str, tuple[list[str], list[str]]]:
    """Return the files and functions that building a world enters, and that one ping enters."""
    scenario = load_scenario("recovery_140m").model_copy(update={"duration_s": 20.0})
    Mission(scenario, seed=0)  # what is imported when first needed is no part of it
    missions: list[Mission] = []
    building = entered(lambda: missions.append(Mission(scenario.model_copy(), seed=0)))
    (mission,) = missions

    def one_ping() -> None:
        mission.advance(mission.happening("delivery"))
        mission.auvs()

    return {"world": counted(building), "ping": counted(entered(one_ping))}


if __name__ == "__main__":
    for what, (files, functions) in traced().items():
        print(f"{what}: {len(files)} files, {len(functions)} functions")
        if "--names" in sys.argv:
            print(*(f"  {name}" for name in functions), sep="\n")

"""Kept code is known by every file that it is made of, and by no other."""

from pathlib import Path

import pytest

from bindusbl_des.core.compiled import PACKAGE, _made_of

FAR = ("report", "results", "explain", "commands", "campaigns")


@pytest.mark.parametrize("file", ["protocol/hf/reception.py", "protocol/mf/frames.py"])
def test_code_that_opens_records_is_made_of_what_lays_them_out(file: str) -> None:
    """An event that has one number more moves those after it, in records that are handed over."""
    made = _made_of(PACKAGE / file)
    assert {PACKAGE / f"records/{name}.py" for name in ("rows", "events", "frames")} <= made
    assert not [it for it in made if it.relative_to(PACKAGE).parts[0] in FAR]


def test_numbers_are_made_of_what_is_beside_them(tmp_path: Path) -> None:
    """Neither of what is elsewhere, nor of what nobody takes."""
    texts = {
        "sea/travel.py": "from bindusbl_des.core.compiled import entry\nfrom .rows import PING\n",
        "sea/rows.py": "from .events import Ping\nfrom ..shore.page import show\nPING = Ping\n",
        "sea/events.py": "class Ping: ...\n",
        "sea/other.py": "",
        "shore/page.py": "def show(): ...\n",
    }
    for name, text in texts.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    made = {it.relative_to(tmp_path).as_posix() for it in _made_of(tmp_path / "sea/travel.py")}
    assert made == {"sea/travel.py", "sea/rows.py", "sea/events.py"}


def test_equations_of_ones_own_are_made_of_ours_that_they_call(tmp_path: Path) -> None:
    """What was kept of them is that of the version that they were compiled with."""
    source = tmp_path / "own.py"
    source.write_text("from bindusbl_des.vehicles.guidance.tracks import distance_from\n")
    ours = {
        PACKAGE / f"{name}.py" for name in ("vehicles/guidance/tracks", "vehicles/guidance/signals")
    }
    assert {source, *ours} <= _made_of(source)

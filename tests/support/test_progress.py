"""Long work says how far it is, and being watched changes nothing of it."""

import io

import pytest
from worlds import scenario

from bindusbl_des import simulate
from bindusbl_des.support import process as progress
from bindusbl_des.support.process import ProgressLine


class Terminal(io.StringIO):
    """A stream that says it is a terminal."""

    def isatty(self) -> bool:
        return True


def told(stream: io.StringIO, quiet: bool = False) -> str:
    line = ProgressLine(quiet=quiet, stream=stream)
    for share in (10, 20):
        line.tell(lambda share=share: f"{share} %")
    line.end(lambda: "done")
    return stream.getvalue()


def test_short_work_is_not_spoken_of() -> None:
    """Within the first seconds nothing is said at all."""
    assert told(Terminal()) == told(io.StringIO()) == ""


def test_a_terminal_has_one_line_and_a_file_many(monkeypatch: pytest.MonkeyPatch) -> None:
    """On a terminal the line is redrawn and ended; elsewhere each is a line by itself."""
    for constant in ("PATIENCE_S", "LINE_EVERY_S", "REDRAWN_EVERY_S"):
        monkeypatch.setattr(progress, constant, 0.0)
    assert told(Terminal()) == "\r10 %\x1b[K\r20 %\x1b[K\rdone\x1b[K\n"
    assert told(io.StringIO()) == "10 %\n20 %\n"
    assert told(Terminal(), quiet=True) == ""


def test_a_watched_mission_is_the_same() -> None:
    """Instants come in order, up to the end, and no row differs."""
    world, instants = scenario(duration_s=20.0), []
    watched = simulate(world, 3, progress=instants.append)
    assert len(instants) > 100
    assert instants == sorted(instants)
    assert instants[-1] < 20.0
    plain = simulate(world, 3)
    assert all(watched.arrow[name].equals(plain.arrow[name]) for name in plain.arrow)

"""Processes that want the same code at the same time compile it once."""

import subprocess
import sys
import textwrap
from pathlib import Path
from time import monotonic

from bindusbl_des.core.compiling.turns import Turn

PACKAGE = Path(__file__).parents[3]


def test_of_two_processes_one_compiles_and_the_other_loads(tmp_path: Path) -> None:
    program = tmp_path / "half.py"
    program.write_text(
        textwrap.dedent("""
        from bindusbl_des.core.compiled import entry
        @entry
        def half(number: float) -> float:
            return number / 2.0
        half(3.0)
        print(sum(half.stats.cache_hits.values()))
    """)
    )
    side_by_side = [
        subprocess.Popen(
            [sys.executable, program],
            stdout=subprocess.PIPE, text=True, cwd=tmp_path, env={"PYTHONPATH": str(PACKAGE)},
        )
        for _ in range(2)
    ]  # fmt: skip
    assert sorted(it.communicate(timeout=100)[0].strip() for it in side_by_side) == ["0", "1"]


def test_the_turn_of_a_process_that_is_killed_is_over(tmp_path: Path) -> None:
    path = tmp_path / "half.lock"
    program = f"""
        import os, signal
        from pathlib import Path
        from bindusbl_des.core.compiling.turns import Turn
        Turn(Path({str(path)!r})).take()
        os.kill(os.getpid(), signal.SIGKILL)
    """
    ended = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(program)],
        env={"PYTHONPATH": str(PACKAGE)},
        check=False,
    )
    assert ended.returncode < 0
    turn = Turn(path)
    turn.take()
    turn.give()


def test_nobody_waits_where_nothing_can_be_kept(tmp_path: Path) -> None:
    turn = Turn(tmp_path / "no such folder" / "half.lock")
    turn.take()
    turn.give()


def test_threads_of_a_process_share_its_turn(tmp_path: Path) -> None:
    turn, other = Turn(tmp_path / "half.lock"), Turn(tmp_path / "half.lock")
    turn.take()
    turn.take()
    turn.give()
    turn.give()
    began = monotonic()
    other.take()
    other.give()
    assert monotonic() - began < 10.0

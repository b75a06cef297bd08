"""Folders that are whole or not there: names taken meanwhile, failures, killed processes."""

import os
import socket
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from bindusbl_des.support.files import clear_killed, folder_draft


def objection(folder: Path) -> str | None:
    """Object to all but folders that hold `ours` alone, or nothing."""
    if not folder.is_dir():
        return "is no folder"
    foreign = {it.name for it in folder.iterdir()} - {"ours"}
    return f"holds {foreign.pop()}" if foreign else None


def write(
    folder: Path,
    text: str,
    *,
    force: bool = False,
    meanwhile: Callable[[Path], object] = lambda _: None,
) -> None:
    with folder_draft(folder, objection, force=force) as draft:
        (draft / "ours").write_text(text)
        meanwhile(folder)


def thesis(folder: Path) -> None:
    folder.mkdir(exist_ok=True)
    (folder / "thesis.tex").write_text("precious")


TAKERS: dict[str, Callable[[Path], object]] = {
    "an empty folder": Path.mkdir,
    "a full folder": thesis,
    "a file": lambda folder: folder.write_text("precious"),
    "a link to nothing": lambda folder: folder.symlink_to("nowhere"),
}


@pytest.mark.parametrize("taker", TAKERS)
def test_a_name_taken_meanwhile_is_left_as_it_is(taker: str, tmp_path: Path) -> None:
    """Whatever came to exist stays; what was written lies beside it, and the message says where."""
    folder = tmp_path / "out"
    (tmp_path / "out-2").mkdir()
    found = []

    def take(folder: Path) -> None:
        TAKERS[taker](folder)
        found.append((os.lstat(folder).st_ino, folder.is_dir() and os.listdir(folder)))

    with pytest.raises(FileExistsError, match=r"out: came to exist meanwhile; .* is in .*out-3$"):
        write(folder, "new", meanwhile=take)
    assert found == [(os.lstat(folder).st_ino, folder.is_dir() and os.listdir(folder))]
    assert (tmp_path / "out-3" / "ours").read_text() == "new"
    assert sorted(os.listdir(tmp_path)) == ["out", "out-2", "out-3"]


def test_what_fills_the_name_at_the_last_moment_is_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Even between taking the name and renaming onto it nothing is replaced."""
    rename = os.rename

    def late(source: Path, place: Path) -> None:
        if place.name == "out":
            thesis(place)
        rename(source, place)

    monkeypatch.setattr("os.rename", late)
    with pytest.raises(FileExistsError, match=r"is in .*out-2$"):
        write(tmp_path / "out", "new")
    assert os.listdir(tmp_path / "out") == ["thesis.tex"]
    assert os.listdir(tmp_path / "out-2") == ["ours"]


def test_force_replaces_what_is_ours_and_nothing_else(tmp_path: Path) -> None:
    """An earlier folder gives way; one that holds something else, a file or a link does not."""
    folder = tmp_path / "out"
    write(folder, "first")
    with pytest.raises(FileExistsError, match="out: exists; use --force"):
        write(folder, "second")
    write(folder, "second", force=True)
    assert (folder / "ours").read_text() == "second"
    (tmp_path / "link").symlink_to(folder)
    (tmp_path / "file").write_text("precious")
    thesis(folder)
    for name, said in (
        ("out", "holds thesis.tex"),
        ("link", "is a link"),
        ("file", "is no folder"),
    ):
        with pytest.raises(FileExistsError, match=f"{name}: {said}"):
            write(tmp_path / name, "third", force=True)
    assert (folder / "ours").read_text() == "second"
    assert (tmp_path / "file").read_text() == "precious"
    assert sorted(os.listdir(tmp_path)) == ["file", "link", "out"]


def test_what_comes_into_a_folder_meanwhile_is_not_replaced_by_force(tmp_path: Path) -> None:
    """Force is checked again at the end; the new folder lies beside."""
    folder = tmp_path / "out"
    write(folder, "first")
    with pytest.raises(FileExistsError, match=r"holds thesis\.tex; .* is in .*out-2$"):
        write(folder, "second", force=True, meanwhile=thesis)
    assert sorted(os.listdir(folder)) == ["ours", "thesis.tex"]
    assert (tmp_path / "out-2" / "ours").read_text() == "second"


def test_a_failure_leaves_everything_as_it_was(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No draft and no folder made for it stays; an earlier folder on its way out comes back."""

    def end(_: Path) -> None:
        raise SystemExit(143)

    with pytest.raises(SystemExit):
        write(tmp_path / "new" / "deep" / "out", "half", meanwhile=end)
    assert os.listdir(tmp_path) == []
    write(tmp_path / "out", "first")
    rename = os.rename

    def fails(source: Path, place: Path) -> None:
        if source.name == "new":
            raise OSError("disk full")
        rename(source, place)

    monkeypatch.setattr("os.rename", fails)
    with pytest.raises(OSError, match="disk full"):
        write(tmp_path / "out", "second", force=True)
    assert (tmp_path / "out" / "ours").read_text() == "first"
    assert os.listdir(tmp_path) == ["out"]


def test_all_is_on_the_disk_before_it_has_its_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Files first, then their folder, the name, and the folder of the name."""
    order: list[str] = []
    rename = os.rename

    def renamed(source: Path, place: Path) -> None:
        order.append("renamed")
        rename(source, place)

    monkeypatch.setattr("os.rename", renamed)
    monkeypatch.setattr(
        "os.fsync", lambda file: order.append(Path(os.readlink(f"/proc/self/fd/{file}")).name)
    )
    write(tmp_path / "out", "new")
    assert order == ["ours", "new", "renamed", tmp_path.name]


LEFT = ".out-abcd_123.draft"


def killed_process(folder: Path) -> Path:
    """Let a process be killed while it fills a folder; return what it left."""
    program = (
        "import os, signal, sys; from pathlib import Path\n"
        "from bindusbl_des.support.files import folder_draft\n"
        "with folder_draft(Path(sys.argv[1]), lambda _: None):\n"
        "    os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    assert subprocess.run([sys.executable, "-c", program, folder]).returncode == -9
    (left,) = folder.parent.glob(".out-*.draft")
    return left


def test_what_a_killed_process_left_is_removed(tmp_path: Path) -> None:
    """Its lock is gone with it; an earlier folder that it had moved aside comes back."""
    folder = tmp_path / "out"
    left = killed_process(folder)
    (left / "old").mkdir()
    (left / "old" / "ours").write_text("first")
    assert clear_killed(folder) == []
    assert os.listdir(tmp_path) == ["out"]
    assert (folder / "ours").read_text() == "first"


def test_whoever_writes_there_next_removes_what_a_killed_process_left(tmp_path: Path) -> None:
    killed_process(tmp_path / "out")
    write(tmp_path / "out", "second")
    assert os.listdir(tmp_path) == ["out"]


def test_what_may_be_of_a_living_process_is_left(tmp_path: Path) -> None:
    """A process that runs is left in peace, that of another machine is told, a link is no draft."""
    folder = tmp_path / "out"
    with folder_draft(folder, objection) as draft:
        assert clear_killed(folder) == []
        assert draft.is_dir()
    (tmp_path / LEFT).mkdir()
    assert clear_killed(folder) == [tmp_path / LEFT]
    (tmp_path / LEFT / "host").write_text(f"not {socket.gethostname()}")
    assert clear_killed(folder) == [tmp_path / LEFT]
    thesis(tmp_path / "theirs")
    (tmp_path / "theirs" / "host").write_text(socket.gethostname())
    (tmp_path / ".out-abcd_124.draft").symlink_to(tmp_path / "theirs")
    assert clear_killed(folder) == [tmp_path / LEFT]
    assert (tmp_path / "theirs" / "thesis.tex").exists()
    (tmp_path / LEFT / "host").write_text(socket.gethostname())
    assert clear_killed(tmp_path / "other") == []
    assert (tmp_path / LEFT).exists()
    assert clear_killed(folder) == []
    assert not (tmp_path / LEFT).exists()

"""Files that are whole or not there: drafts, links, failures half way."""

import os
import stat
from pathlib import Path

import pytest

from bindusbl_des.support.files import write_text


def test_file_is_written_with_the_rights_of_any_file(tmp_path: Path) -> None:
    write_text(tmp_path / "a.txt", "ä")
    assert (tmp_path / "a.txt").read_text(encoding="utf-8") == "ä"
    (tmp_path / "plain.txt").write_text("")
    rights = [stat.S_IMODE((tmp_path / n).stat().st_mode) for n in ("a.txt", "plain.txt")]
    assert rights[0] == rights[1]


def test_failure_half_way_leaves_what_was_there(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    write_text(path, "before")
    with pytest.raises(UnicodeEncodeError):
        write_text(path, "half \ud800")
    assert os.listdir(tmp_path) == ["a.txt"]
    assert path.read_text() == "before"


def test_link_is_replaced_and_not_followed(tmp_path: Path) -> None:
    (tmp_path / "victim").write_text("mine")
    (tmp_path / "page").symlink_to(tmp_path / "victim")
    write_text(tmp_path / "page", "theirs")
    assert (tmp_path / "victim").read_text() == "mine"
    assert not (tmp_path / "page").is_symlink()


def test_file_that_came_to_exist_is_not_replaced_unasked(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    write_text(path, "first", replace=False)
    (tmp_path / "link").symlink_to("nowhere")
    for taken in (path, tmp_path / "link"):
        with pytest.raises(FileExistsError):
            write_text(taken, "second", replace=False)
    assert path.read_text() == "first"
    assert sorted(os.listdir(tmp_path)) == ["a.txt", "link"]

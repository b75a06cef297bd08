"""A power cut loses what was not synced: no mission that counted is ever among it."""

import os
import shutil
from pathlib import Path
from stat import S_ISDIR
from typing import Any

import pytest
from campaigns_for_tests import Killed, OneThread, fly_with, read_record, same
from commands_for_tests import call

from bindusbl_des import CampaignState, load_campaign, sweep

MISSIONS = 24


class Disk:
    """What a disk keeps when power is cut: of each file what it held, and of each folder which
    names it had, when it was last synced.
    """

    def __init__(self) -> None:
        self.files: dict[int, bytes] = {}
        self.folders: dict[int, dict[str, int]] = {}

    def keep(self, descriptor: int) -> None:
        """Keep a file or folder as it is now."""
        found = os.fstat(descriptor)
        if S_ISDIR(found.st_mode):
            self.folders[found.st_ino] = {it.name: it.inode() for it in os.scandir(descriptor)}
        else:
            self.files[found.st_ino] = os.pread(descriptor, found.st_size, 0)

    def restore(self, path: Path, now: Path, *, removed: bool, inode: int | None = None) -> None:
        """Write to `path` what is kept of the file or folder at `now`.

        Where `removed`, what was removed is gone although its folder was not synced since: either
        may be.
        """
        inode = now.stat().st_ino if inode is None else inode
        if inode not in self.folders:
            path.write_bytes(self.files.get(inode, b""))
            return
        path.mkdir()
        for name, inside in self.folders[inode].items():
            if not removed or (now / name).exists():
                self.restore(path / name, now / name, removed=removed, inode=inside)


def test_no_mission_that_counted_is_lost_with_power(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Power is cut after each sync: what counted counts, and `resume` finds the same as ever."""
    home, cut = tmp_path / "home", tmp_path / "cut"
    for folder in (home, cut):
        folder.mkdir()
    monkeypatch.chdir(tmp_path)
    fly_with(monkeypatch)
    Path("base.yaml").write_text("name: tiny\nduration_s: 2\n")
    disk, plain = Disk(), os.fsync
    counted, kept = [0], dict[int, Path]()

    def sync(descriptor: int) -> None:
        plain(descriptor)
        disk.keep(descriptor)
        for removed in (False, True) if home.stat().st_ino in disk.folders else ():
            left = cut / "left"
            shutil.rmtree(left, ignore_errors=True)
            disk.restore(left, home, removed=removed)
            if not (left / "c/campaign.json").exists():
                assert counted == [0]
                continue
            counted.append(len(load_campaign(left / "c").done()))
            assert counted[-1] >= counted[-2]
            assert counted[-1] == MISSIONS or read_record(left / "c")["status"] != "complete"
            if counted[-1] not in kept:
                kept[counted[-1]] = Path(shutil.copytree(left / "c", cut / str(counted[-1])))

    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", sync)
        swept = call("sweep", "base.yaml", "--seeds", MISSIONS, "--out", home / "c")
    assert swept.exit_code == 0, swept.stderr
    assert len(kept) > 4
    assert max(kept) == MISSIONS
    for count in sorted(kept)[:2]:
        left = kept[count]
        resumed = call("resume", left)
        assert resumed.exit_code == 0, resumed.stderr
        same(load_campaign(home / "c"), load_campaign(left))


@pytest.mark.parametrize("made", ["missions", "auvs", "checksums"])
def test_a_table_folder_that_another_process_has_made_is_synced_too(
    made: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Workers of two machines begin at once: one makes the folder and is slow to sync its name, the
    other finds it and commits first; a power cut then must not take what was committed.
    """
    home, left = tmp_path / "home", tmp_path / "left"
    home.mkdir()
    (tmp_path / "base.yaml").write_text("name: tiny\nduration_s: 2\n")
    disk, plain = Disk(), os.fsync

    def sync(descriptor: int) -> None:
        plain(descriptor)
        disk.keep(descriptor)

    class Beside(OneThread):
        def submit(self, batch: Any) -> Any:
            for name in {"missions", "auvs", "checksums"} - {made}:
                (home / "c" / name).mkdir(exist_ok=True)
            disk.keep(descriptor := os.open(home / "c", os.O_RDONLY))
            os.close(descriptor)
            (home / "c" / made).mkdir(exist_ok=True)  # by the other, which syncs it later
            return super().submit(batch)

    def cut(_: CampaignState) -> None:
        disk.restore(left, home, removed=False)
        raise Killed

    fly_with(monkeypatch, Beside)
    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", sync)
        with pytest.raises(Killed):
            sweep(tmp_path / "base.yaml", home / "c", seeds=2, progress=cut)
    whole = load_campaign(home / "c")
    assert len(whole.missions) > 0
    same(whole, load_campaign(left / "c"))

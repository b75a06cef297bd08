"""Files that are none: devices and pipes, which never end or wait for ever."""

import errno
import os
import subprocess
import sys
from multiprocessing.synchronize import SemLock
from pathlib import Path

import pytest
from commands_for_tests import call

from bindusbl_des.support.files import regular

SCENARIO = "name: s\nduration_s: 20\n"
ROUTE = "auvs: {{count: 1, route: {{kind: track, files: [{0}]}}}}\n"


def refused(*words: str) -> str:
    """Return the one line with which a command refuses what it was given."""
    done = call(*words)
    assert done.exit_code == 2, done.output
    return done.output


@pytest.mark.parametrize("ending", ["csv", "gpx", "mcap"])
def test_a_track_is_no_pipe(tmp_path: Path, ending: str) -> None:
    pipe = tmp_path / f"track.{ending}"
    os.mkfifo(pipe)
    scenario = tmp_path / "s.yaml"
    scenario.write_text(SCENARIO + ROUTE.format(pipe))
    told = refused("validate", str(scenario))
    assert "no regular file" in told
    assert pipe.name in told


def test_a_track_is_no_device(tmp_path: Path) -> None:
    scenario = tmp_path / "s.yaml"
    scenario.write_text(SCENARIO + ROUTE.format("/dev/zero"))
    assert "/dev/zero" in refused("validate", str(scenario))


@pytest.mark.parametrize(
    "key",
    [
        "survey: {{area: {0}}}\n",
        "environment: {{ctd: {0}}}\n",
        "acoustics: {{hf: {{channel: {{model: table, rays: {0}}}}}}}\n",
    ],
)
def test_nor_are_charts_casts_and_tables(tmp_path: Path, key: str) -> None:
    for ending in ("csv", "kml", "geojson"):
        pipe = tmp_path / f"it.{ending}"
        if not pipe.exists():
            os.mkfifo(pipe)
        (tmp_path / "s.yaml").write_text(SCENARIO + key.format(pipe))
        refused("validate", str(tmp_path / "s.yaml"))


@pytest.mark.parametrize("command", ["replay", "fit"])
def test_nor_is_what_a_command_is_given(tmp_path: Path, command: str) -> None:
    for ending in ("pyfg", "mcap"):
        pipe = tmp_path / f"it.{ending}"
        os.mkfifo(pipe)
        assert call(command, pipe).exit_code == 2


def test_files_of_a_bounded_size(tmp_path: Path) -> None:
    path = tmp_path / "large"
    path.write_bytes(b"12345")
    assert regular(path, 5) == path
    with pytest.raises(OSError, match="larger than 4 bytes"):
        regular(path, 4)
    with pytest.raises(IsADirectoryError):
        regular(tmp_path)
    with pytest.raises(FileNotFoundError):
        regular(tmp_path / "none")


def test_millions_of_empty_elements_are_refused(tmp_path: Path) -> None:
    area = tmp_path / "area.kml"
    area.write_text(f"<kml>{'<a/>' * 450_000}</kml>")
    (tmp_path / "s.yaml").write_text(SCENARIO + f"survey: {{area: {area}}}\n")
    assert "more than 400,000 elements" in refused("validate", str(tmp_path / "s.yaml"))


@pytest.mark.parametrize("threads", ["0", "-1"])
def test_threads_that_numba_refuses_are_named(tmp_path: Path, threads: str) -> None:
    (tmp_path / "s.yaml").write_text(SCENARIO)
    done = subprocess.run(
        [sys.executable, "-c", "from bindusbl_des.cli import main; main()", "run", "s.yaml"],
        cwd=tmp_path,
        env={**os.environ, "NUMBA_NUM_THREADS": threads},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    assert done.stderr.splitlines()[-1].startswith(
        f"NUMBA_NUM_THREADS: must be 1 or more; got '{threads}'"
    )


def test_workers_without_a_place_for_semaphores_are_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where /dev/shm is read-only it is named, not the folder of results."""

    def refuse(*_: object, **__: object) -> None:
        raise OSError(errno.EROFS, os.strerror(errno.EROFS))

    monkeypatch.setattr(SemLock, "__init__", refuse)
    (tmp_path / "s.yaml").write_text(SCENARIO)
    words = ["sweep", str(tmp_path / "s.yaml"), "--seeds", "2", "--out", str(tmp_path / "out")]
    done = call(*words)
    assert done.exit_code == 1
    assert done.output.splitlines()[-1].endswith(
        "/dev/shm: Read-only file system; workers have their semaphores there: make it writable"
    )

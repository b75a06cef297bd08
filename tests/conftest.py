"""Runs under test keep their warnings as errors and their results in temporary folders."""

import gc
import os
import signal
import sys
import threading
from collections.abc import Generator, Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
os.environ.setdefault("NUMBA_OPT", "1")  # as of the command line

import pytest
from browser_for_tests import browser, opened  # noqa: F401 (fixtures)
from campaigns_for_tests import fly_with
from hypothesis import settings

from bindusbl_des.support.plugins import allow

# The first example may compile equations.  Every day a property is tried with the same examples,
# wherever that is; with those that take minutes, with others each time.
settings.register_profile("daily", deadline=None, derandomize=True)
settings.register_profile("all", deadline=None)
settings.load_profile("daily")


def pytest_configure(config: pytest.Config) -> None:
    """Draw at random where all tests are asked for; before any of them is read."""
    settings.load_profile("daily" if config.option.markexpr else "all")


# Shells have what they run in the background ignore requests that some tests send.
if threading.current_thread() is threading.main_thread():
    signal.signal(signal.SIGINT, signal.default_int_handler)
    signal.signal(signal.SIGHUP, signal.SIG_DFL)

# Files of few tests that take long go first: begun last, they would leave all workers but one idle.
LONG = (
    "test_docs.py", "test_properties.py", "test_campaigns.py", "test_replays.py", "test_bursts.py",
    "test_plans.py", "test_reproduction.py", "test_ellipses.py", "test_report_browser.py",
    "test_figures.py", "test_second.py", "test_advice.py", "test_sea_trials.py", "test_losses.py",
    "test_drawn_missions.py", "test_fuzzing.py",
)  # fmt: skip


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Half a million objects of what is collected stay: no search for garbage meets them, and the
    searches are fewer.
    """
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.set_threshold(50_000)
        gc.enable()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    items.sort(key=lambda item: LONG.index(item.path.name) if item.path.name in LONG else len(LONG))


# Parts of the tests' own, named by scenarios in Python; files need leave as everywhere.
SCHEDULES = ("all_at_once", "no_groups", "twice", "stranger", "broken", "nothing", "absent")
allow(f"schedules_for_tests:{name}" for name in SCHEDULES)
allow(f"test_navigators:{name}" for name in ("Still", "Silent", "Nobody", "Noting"))
allow(f"test_warnings:{name}" for name in ("fading", "compass", "Adrift"))
allow(["math:sqrt", "test_report_sweep:raising", "test_explain:Trusting"])


@pytest.fixture(scope="module")
def in_this_process() -> Iterator[None]:
    """Campaigns of a module have no workers, whose start takes longer than small missions."""
    with pytest.MonkeyPatch.context() as patch:
        fly_with(patch)
        yield


@pytest.fixture
def in_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The test runs in an empty folder of its own, `tmp_path`."""
    monkeypatch.chdir(tmp_path)

"""Processes that are forked while threads fly missions, as programs around this one may do."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

FORKING = """
import os, signal, threading, time
from numba.extending import overload
from bindusbl_des import Scenario, simulate
from bindusbl_des.support.compiled import compiled

flown = Scenario.model_validate({"name": "flown", "duration_s": 20.0, "asvs": {"count": 2}})
simulate(flown, 0)
over = threading.Event()

def child():
    signal.alarm(20)
    try:
        simulate(flown, 9999)
        os._exit(0)
    finally:
        os._exit(3)

def fork():
    pid = os.fork()
    if not pid:
        child()
    return os.waitpid(pid, 0)[1]

def fly():
    seed = 1
    while not over.is_set():
        simulate(flown, seed)
        seed += 1

threads = [threading.Thread(target=fly) for _ in range(2)]
for thread in threads:
    thread.start()
found = []
for _ in range(20):
    time.sleep(0.003)
    found.append(fork())
over.set()
for thread in threads:
    thread.join()

def nap():
    pass

@overload(nap)
def napping():
    begun.set()
    time.sleep(0.3)
    return lambda: None

def slow(x):
    nap()
    return x + 1.0

begun = threading.Event()
thread = threading.Thread(target=compiled(slow), args=(1.0,))
thread.start()
begun.wait()
pid = os.fork()
if not pid:
    signal.alarm(20)
    compiled(slow)(2)
    os._exit(0)
found.append(os.waitpid(pid, 0)[1])
thread.join()
print(found)
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="nothing forks on this machine")
def test_a_fork_while_threads_fly_or_compile_flies_too(tmp_path: Path) -> None:
    """No lock that a thread held is held for ever in the process that has not this thread."""
    (tmp_path / "forking.py").write_text(FORKING)
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "forking.py"],
        capture_output=True, text=True, timeout=300, cwd=tmp_path,
    )  # fmt: skip
    assert done.stdout.split("\n")[0] == str([0] * 21), done.stderr

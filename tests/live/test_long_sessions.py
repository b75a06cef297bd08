"""Long sessions: eight hours leave no more memory taken than the mission does by itself."""

import selectors
import socket
import subprocess
import sys
import threading
from contextlib import suppress
from pathlib import Path

import pytest
from live_for_tests import FORMATS, START, Datagrams, Output, Session, at_sea, earth_of

from bindusbl_des import Instruments, Mission, Setup

# Flies eight hours, with or without a session, and prints by how much memory (MB) has grown from
# the second to the eighth.
EIGHT_HOURS = """
import selectors, sys
from bindusbl_des import Mission
from bindusbl_des.apps.live.outputs import FORMATS
from bindusbl_des.apps.live.readings import Instruments, earth_of
from bindusbl_des.apps.live.session import Output, Session
from live_for_tests import START, at_sea

def resident():
    return int(open("/proc/self/statm").read().split()[1]) * 4096 / 1e6

class Nowhere:
    name, clients = "", 0
    def send(self, telegram): pass

mission = Mission(at_sea(duration_s=28800.0, record={"detail": "summary"}), 1)
early = None
if sys.argv[1] == "alone":
    for hour in range(1, 9):
        mission.advance(3600.0 * hour)
        early = resident() if hour == 2 else early
else:
    def note(session):
        global early
        if early is None and session.time > 7200.0:
            early = resident()
    outputs = [Output(FORMATS[it].make(), Nowhere()) for it in ("json", "nmea", "mavlink")]
    earth = earth_of(mission.scenario, START)
    with selectors.DefaultSelector() as selector:
        session = Session(
            Instruments(mission), earth, outputs, selector, print, speed=float("inf")
        )
        session.fly(note)
print(resident() - early)
"""


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="no /proc")
def test_eight_hours_leave_nothing_behind() -> None:
    """But what the mission itself keeps; 30 MB are what allocators differ by."""
    grown = {}
    for kind in ("alone", "live"):
        done = subprocess.run(
            [sys.executable, "-c", EIGHT_HOURS, kind],
            capture_output=True, text=True, check=True, cwd=Path(__file__).parent,
            env={"PYTHONPATH": f"{Path(__file__).parents[1]}:{Path(__file__).parent}"},
        )  # fmt: skip
        grown[kind] = float(done.stdout)
    assert grown["live"] < grown["alone"] + 30.0


@pytest.mark.slow
def test_a_hundred_times_real_time_is_sustained_without_loss() -> None:
    """Half an hour of 10 AUVs and 3 ASVs in 18 s: each datagram is received."""
    scenario = at_sea(duration_s=1800.0, auvs={"count": 10})
    over, received = threading.Event(), []
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ours:
        ours.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 23)
        ours.bind(("127.0.0.1", 0))
        ours.settimeout(0.5)

        def receive() -> None:
            while not over.is_set():
                with suppress(TimeoutError):
                    received.append(len(ours.recv(65536)))

        receiver = threading.Thread(target=receive)
        receiver.start()
        sink = Datagrams("udp", "127.0.0.1", ours.getsockname()[1])
        outputs = [Output(FORMATS[it].make(), sink) for it in ("json", "nmea")]
        with selectors.DefaultSelector() as selector:
            session = Session(
                Instruments(Mission(scenario, 1)), earth_of(Setup(scenario), START), outputs,
                selector, pytest.fail, speed=100.0,
            )  # fmt: skip
            session.fly(lambda _: None)
        over.wait(1.0)
        over.set()
        receiver.join()
        sink.close()
    assert len(received) == session.sent > 90_000
    assert session.lateness.quantile(0.5) < 0.02

"""gpsd reads the stream, as chart plotters have it: the real program, where there is one."""

import json
import os
import selectors
import shutil
import socket
import subprocess
import threading
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from live_for_tests import (
    FORMATS,
    START,
    Datagrams,
    Gnss,
    Output,
    Session,
    Terminal,
    at_sea,
    earth_of,
)

from bindusbl_des import Instruments, Mission, Setup
from bindusbl_des.apps.live.sinks import Sink

GPSD = shutil.which("gpsd", path=f"{os.environ.get('PATH', '')}:/usr/sbin:/usr/local/sbin")


def free_port(kind: int) -> int:
    with socket.socket(socket.AF_INET, kind) as found:
        found.bind(("127.0.0.1", 0))
        port: int = found.getsockname()[1]
        return port


@pytest.mark.skipif(GPSD is None, reason="gpsd is not installed")
@pytest.mark.parametrize("way", ["udp", "pty"])
def test_gpsd_has_the_positions_that_gnss_measured(way: str, tmp_path: Path) -> None:
    """Each that it tells is one that was sent, within 1e-8 degrees of the last digit (2 mm)."""
    scenario = at_sea(duration_s=8.0, usbl={"gnss_sd_m": 0.5})
    with selectors.DefaultSelector() as selector:
        sink: Sink
        if way == "udp":
            port = free_port(socket.SOCK_DGRAM)
            sink, device = Datagrams("udp", "127.0.0.1", port), f"udp://127.0.0.1:{port}"
        else:
            terminal = Terminal("pty", selector)
            sink, device = terminal, terminal.path
        asked = free_port(socket.SOCK_STREAM)
        command = [str(GPSD), "-N", "-n", "-b", "-S", str(asked), device]
        with subprocess.Popen(command, stderr=subprocess.DEVNULL) as gpsd:
            try:
                told = _told_while_flying(scenario, sink, asked, selector)
            finally:
                gpsd.terminate()
        sink.close()
    mission, earth = Mission(scenario, 3), earth_of(Setup(scenario), START)
    instruments = Instruments(mission, only=("ASV0",))
    sent = [earth.geodetic(it.place)[:2] for it in instruments.advance(8.0) if isinstance(it, Gnss)]
    positions = [(it["lat"], it["lon"]) for it in told if "lat" in it]
    assert len(positions) > 3
    for lat, lon in positions:
        assert min(abs(lat - a) + abs(lon - b) for a, b in sent) < 4e-8


def _told_while_flying(
    scenario: Any, sink: Sink, port: int, selector: selectors.BaseSelector
) -> list[dict[str, Any]]:
    """Fly a mission into gpsd; return what it tells of positions (TPV) meanwhile."""
    told: list[dict[str, Any]] = []
    began = time.monotonic()
    while True:
        try:
            client = socket.create_connection(("127.0.0.1", port), timeout=10.0)
            break
        except OSError:
            assert time.monotonic() - began < 10.0
            time.sleep(0.05)
    client.sendall(b'?WATCH={"enable":true,"json":true}\n')

    def listen() -> None:
        with client.makefile() as lines, suppress(OSError):
            for line in lines:
                said = json.loads(line)
                if said["class"] == "TPV":
                    told.append(said)

    listener = threading.Thread(target=listen)
    listener.start()
    session = Session(
        Instruments(Mission(scenario, 3), only=("ASV0",)), earth_of(Setup(scenario), START),
        [Output(FORMATS["nmea"].make(), sink)], selector, pytest.fail,
    )  # fmt: skip
    session.fly(lambda _: None)
    time.sleep(0.5)
    client.shutdown(socket.SHUT_RDWR)
    listener.join()
    client.close()
    return told

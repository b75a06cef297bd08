"""Sessions against the clock: sinks, what befalls them, and a result as that of `run`."""

import json
import math
import os
import resource
import selectors
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from http.client import HTTPConnection, HTTPException
from pathlib import Path
from typing import Any

import pytest
from commands_for_tests import call
from live_for_tests import (
    BEGINS,
    YAML,
    Datagrams,
    Output,
    Session,
    Terminal,
    Topside,
    asked,
    at_sea,
    earth_of,
    written,
)

from bindusbl_des import Instruments, Mission, Setup, load_result, simulate
from bindusbl_des.apps.live.outputs import Opening, opened
from bindusbl_des.apps.live.session import Lateness
from bindusbl_des.apps.live.sinks import BACKLOG, MOST_CLIENTS, File, Port

from live_for_tests import START  # isort: skip

pytestmark = pytest.mark.usefixtures("in_empty_folder")


class Kept:
    """A sink that keeps what it is sent, and when."""

    name, clients = "kept", 0

    def __init__(self) -> None:
        self.sent: list[tuple[float, bytes]] = []

    def send(self, telegram: bytes) -> None:
        self.sent.append((time.monotonic(), telegram))

    def close(self) -> None:
        pass


def flown(sink: Any, *, speed: float, **changes: Any) -> tuple[Session, Mission, list[str]]:
    """Fly a mission whose JSON lines go to a sink."""
    scenario, said = at_sea(**changes), []
    mission = Mission(scenario, 3)
    with selectors.DefaultSelector() as selector:
        output = Output(opened_format("json"), sink)
        earth = earth_of(Setup(scenario), START)
        session = Session(Instruments(mission), earth, [output], selector, said.append, speed=speed)
        session.fly(lambda _: None)
    return session, mission, said


def opened_format(name: str) -> Any:
    from bindusbl_des.apps.live.outputs import FORMATS

    return FORMATS[name].make()


def same_tables(one: Any, other: Any) -> bool:
    return all(one.arrow[name].equals(other.arrow[name]) for name in other.arrow)


def test_the_result_is_that_of_run(tmp_path: Path) -> None:
    """At speed max: telegrams of both formats in files, and a folder equal table for table."""
    done = call(
        "live", written(tmp_path), "--to", "nmea:file:n.txt", "--to", "json/AUV0:file:j.txt",
        "--speed", "max", "--seed", "4", "--start", BEGINS, "--out", "flown",
    )  # fmt: skip
    assert done.exit_code == 0, done.output
    plain = simulate(tmp_path / "sea.yaml", 4)
    assert same_tables(load_result(tmp_path / "flown"), plain)
    lines = [json.loads(it) for it in Path("j.txt").read_text().splitlines()]
    assert {it["vehicle"] for it in lines} == {"AUV0"}
    assert lines[0]["utc"] == "2026-06-01T08:00:00.000000Z"
    assert Path("n.txt").read_bytes().count(b"\r\n") > 100
    again = call("live", "sea.yaml", "--to", "json:file:j.txt", "--out", "other", "--speed", "max")
    assert again.exit_code == 2
    assert "j.txt: cannot be opened (File exists)" in again.output


def test_telegrams_are_sent_when_they_are_due() -> None:
    """Three seconds at speed 1: none early, and half of all within 20 ms on a busy machine."""
    sink = Kept()
    session, mission, _ = flown(sink, speed=1.0, duration_s=3.0)
    times = [json.loads(text)["time_s"] for _, text in sink.sent]
    assert len(times) > 10
    assert times == sorted(times)
    began = min(at - due for (at, _), due in zip(sink.sent, times, strict=True))
    late = [at - due - began for (at, _), due in zip(sink.sent, times, strict=True)]
    assert sorted(late)[len(late) // 2] < 20e-3
    assert session.lateness.quantile(0.5) < 20e-3
    assert same_tables(mission.result(), simulate(at_sea(duration_s=3.0), 3))


def test_a_hundred_times_as_fast_is_the_same_mission() -> None:
    sink, slow = Kept(), Kept()
    _, mission, _ = flown(sink, speed=100.0)
    flown(slow, speed=float("inf"))
    assert [it for _, it in sink.sent] == [it for _, it in slow.sent]
    assert same_tables(mission.result(), simulate(at_sea(), 3))


def test_datagrams_are_received() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ours:
        ours.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 22)
        ours.bind(("127.0.0.1", 0))
        ours.settimeout(5.0)
        sink = Datagrams("udp", "127.0.0.1", ours.getsockname()[1])
        session, _, said = flown(sink, speed=100.0, duration_s=20.0)
        got = [ours.recv(4096) for _ in range(session.sent)]
        sink.close()
    assert not said
    assert all(it.endswith(b"}\n") for it in got)


def test_datagrams_to_nobody_are_lost() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ours:
        ours.bind(("127.0.0.1", 0))
        port = ours.getsockname()[1]
    sink = Datagrams("udp", "127.0.0.1", port)
    session, _, said = flown(sink, speed=float("inf"), duration_s=5.0)
    sink.close()
    assert session.sent
    assert not said


def test_a_terminal_is_read_like_a_serial_port() -> None:
    with selectors.DefaultSelector() as selector:
        sink = Terminal("pty", selector)
        port = os.open(sink.path, os.O_RDWR | os.O_NOCTTY)
        os.write(port, b"garbage\n")
        sink.send(b"$GPHDT,1.0,T*00\r\n")
        for key, mask in selector.select(1.0):
            key.data(mask)
        assert os.read(port, 100) == b"$GPHDT,1.0,T*00\r\n"
        for _ in range(1000):  # what nobody reads is lost, and nobody waits
            sink.send(b"x" * 100)
        os.close(port)
        sink.close()


def served(selector: selectors.BaseSelector) -> None:
    for key, mask in selector.select(0.05):
        key.data(mask)


def test_clients_come_and_go() -> None:
    """A thousand connections leave nothing behind, whatever they say."""
    with selectors.DefaultSelector() as selector:
        port = Port("tcp", "127.0.0.1", 0, selector, pytest.fail)
        before = len(os.listdir("/proc/self/fd")) if Path("/proc/self/fd").is_dir() else 0
        for number in range(1000):
            with socket.create_connection(("127.0.0.1", port.port)) as client:
                served(selector)
                assert port.clients == 1
                client.sendall(b"\x00\xffGET /" * (number % 3))
                port.send(b"hello\n")
                assert client.recv(6) == b"hello\n"
            while port.clients:
                served(selector)
        assert not before or len(os.listdir("/proc/self/fd")) <= before + 3
        port.close()
        assert not selector.get_map()


def test_a_client_that_does_not_read_is_dropped() -> None:
    said: list[str] = []
    with selectors.DefaultSelector() as selector:
        port = Port("json:tcp:1", "127.0.0.1", 0, selector, said.append)
        with (
            socket.create_connection(("127.0.0.1", port.port)) as slow,
            socket.create_connection(("127.0.0.1", port.port)) as quick,
        ):
            served(selector)
            served(selector)
            assert port.clients == 2
            quick.setblocking(False)
            for _ in range(40 * BACKLOG // 65536 * 4):
                port.send(b"x" * 65536)
                try:
                    while quick.recv(1 << 20):
                        pass
                except BlockingIOError:
                    pass
                served(selector)
                if said:
                    break
            assert said == ["json:tcp:1: a client that does not read is dropped"]
            assert port.clients == 1
            assert slow.fileno() >= 0
        port.close()


@contextmanager
def few_files(left: int) -> Iterator[None]:
    """Let this process open so many more files meanwhile."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    with open(os.devnull) as probe:
        first = probe.fileno()
    resource.setrlimit(resource.RLIMIT_NOFILE, (first + left, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


def test_clients_beyond_the_most_are_turned_away_and_told_of_once() -> None:
    said: list[str] = []
    with selectors.DefaultSelector() as selector, ExitStack() as stack:
        port = Port("tcp", "127.0.0.1", 0, selector, said.append)
        idle = [
            stack.enter_context(socket.create_connection(("127.0.0.1", port.port)))
            for _ in range(MOST_CLIENTS + 10)
        ]
        for _ in idle:
            served(selector)
        assert port.clients == MOST_CLIENTS
        assert said == ["tcp: 64 clients are served, more are turned away"]
        assert idle[-1].recv(1) == b""
        idle[0].close()
        served(selector)
        with socket.create_connection(("127.0.0.1", port.port)) as late:
            served(selector)
            port.send(b"hello\n")
            assert late.recv(6) == b"hello\n"
        port.close()


def test_a_port_does_not_ask_again_and_again_where_no_file_can_be_opened(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Too many are open as a client comes: nobody waits for it, until there is room."""
    with selectors.DefaultSelector() as selector:
        port = Port("tcp", "127.0.0.1", 0, selector, pytest.fail)
        with socket.create_connection(("127.0.0.1", port.port)) as client:
            with few_files(0):
                served(selector)
                assert not selector.select(0.05)
                port.send(b"lost\n")
                assert not selector.select(0.05)
            monkeypatch.setattr("bindusbl_des.apps.live.sinks.monotonic", lambda: math.inf)
            port.send(b"lost\n")
            served(selector)
            port.send(b"hello\n")
            assert client.recv(6) == b"hello\n"
        port.close()
        assert not selector.get_map()


def test_outputs_leave_descriptors_to_the_result(tmp_path: Path) -> None:
    """Of a hundred terminals the first few are opened, and the result is written."""
    with few_files(100):
        done = call(
            "live",
            written(tmp_path),
            *["--to", "json:pty"] * 100,
            "--speed",
            "max",
            "--out",
            "flown",
        )
    assert done.exit_code == 0, done.output
    assert (
        "json:pty: cannot be opened (too few files may be open; raise `ulimit -n`)" in done.output
    )
    assert load_result(tmp_path / "flown").seed == 0


def test_idle_clients_cost_no_result(tmp_path: Path) -> None:
    """Of 128 files that may be open, clients and halves of HTTP requests ask for 200."""
    written(tmp_path, YAML.replace("duration_s: 20", "duration_s: 4"))
    command = (
        f"ulimit -n 128; exec {sys.executable} -m bindusbl_des.cli live sea.yaml "
        "--to json:tcp:0 --to ugps/ASV0,AUV0:http:0 --out flown"
    )
    with (
        subprocess.Popen(
            ["sh", "-c", command], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        ) as process,
        ExitStack() as stack,
    ):
        assert process.stdout is not None
        for half in ("", "GET /api/v1/about HTTP/1.1\r\nHost: "):
            port = int(process.stdout.readline().split(":")[-1].partition("/")[0])
            for _ in range(100):
                client = stack.enter_context(socket.create_connection(("127.0.0.1", port)))
                with suppress(ConnectionError):  # turned away
                    client.sendall(half.encode())
        out, err = process.communicate(timeout=120.0)
    assert process.returncode == 0, err
    assert "Results: flown" in out
    assert "clients are served, more are turned away" in err
    assert "cannot be written to" not in err
    assert same_tables(load_result(tmp_path / "flown"), simulate(tmp_path / "sea.yaml", 0))


def test_sinks_are_closed_before_the_result_is_made(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    refused = []
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    result = Mission.result

    def asked_for(mission: Mission) -> Any:
        with pytest.raises(ConnectionRefusedError):
            socket.create_connection(("127.0.0.1", port))
        refused.append(port)
        return result(mission)

    monkeypatch.setattr(Mission, "result", asked_for)
    to = f"json:tcp:{port}"
    done = call("live", written(tmp_path), "--to", to, "--speed", "max", "--out", "flown")
    assert done.exit_code == 0, done.output
    assert refused == [port]


def test_clients_of_http_beyond_the_most_are_turned_away() -> None:
    topside = Topside("ugps", "127.0.0.1", 0, "ASV0", "AUV0")
    with ExitStack() as stack:
        for _ in range(MOST_CLIENTS + 1):
            client = stack.enter_context(socket.create_connection(("127.0.0.1", topside.port)))
        client.settimeout(5.0)  # half as long as one that is served may be silent
        assert client.recv(1) == b""
        topside.close()


def test_a_client_of_http_that_asks_nothing_is_let_go(monkeypatch: pytest.MonkeyPatch) -> None:
    """A byte now and then is no request: who comes to no end makes room; who asks is answered."""
    monkeypatch.setattr("bindusbl_des.apps.live.ugps.SILENCE_S", 0.3)
    threads = threading.active_count()
    topside = Topside("ugps", "127.0.0.1", 0, "ASV0", "AUV0")
    with ExitStack() as stack:
        slow = [
            stack.enter_context(socket.create_connection(("127.0.0.1", topside.port)))
            for _ in range(MOST_CLIENTS)
        ]
        began, answered = time.monotonic(), 0
        while time.monotonic() - began < 10.0 and not answered:
            for client in slow:
                with suppress(ConnectionError):
                    client.sendall(b"G")
            with suppress(OSError, HTTPException):
                asker = HTTPConnection("127.0.0.1", topside.port, timeout=1.0)
                asker.request("GET", "/api/v1/about")
                answered = asker.getresponse().status
                asker.close()
            time.sleep(0.05)
        assert answered == 200
        topside.close()
        while threading.active_count() > threads:  # of those that are connected still
            assert time.monotonic() - began < 20.0
            time.sleep(0.01)


def test_a_pipe_whose_reader_is_slow_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    reader = os.open(tmp_path / "pipe", os.O_RDONLY | os.O_NONBLOCK)
    sink = File("json:file:pipe", tmp_path / "pipe", replace=True)

    def fill() -> None:
        for _ in range(100):
            sink.send(b"x" * 10_000)

    sending = threading.Thread(target=fill, daemon=True)
    sending.start()
    sending.join(10.0)
    assert not sending.is_alive()
    sink.close()
    os.close(reader)


def test_two_outputs_to_one_file_do_not_write_over_each_other(tmp_path: Path) -> None:
    sinks = [File(name, tmp_path / "x", replace=True) for name in ("one", "two")]
    for sink in (*sinks, *sinks):
        sink.send(f"{sink.name}\n".encode())
    for sink in sinks:
        sink.close()
    assert (tmp_path / "x").read_text().split() == ["one", "two", "one", "two"]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is full")
def test_a_full_disk_ends_the_sink_and_not_the_mission() -> None:
    sink = File("json:file:/dev/full", Path("/dev/full"), replace=False)
    session, mission, said = flown(sink, speed=float("inf"), duration_s=5.0)
    assert said == ["json:file:/dev/full: No space left on device; the mission goes on"]
    assert not session.outputs
    assert same_tables(mission.result(), simulate(at_sea(duration_s=5.0), 3))


def test_a_port_that_is_taken_is_told_and_the_mission_goes_on(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        words = ("live", written(tmp_path), "--to", f"json:tcp:{port}", "--speed", "max")
        both = call(*words, "--to", "json:file:j.txt", "--out", "one")
        alone = call(*words, "--out", "two")
    assert f"json:tcp:{port}: cannot be opened (Address already in use)" in both.output
    assert both.exit_code == 0
    assert load_result(tmp_path / "one").seed == 0
    assert alone.exit_code == 2
    assert "nothing can be sent anywhere" in alone.output
    assert not Path("two").exists()


def test_ctrl_c_leaves_a_whole_result(tmp_path: Path) -> None:
    """An hour at speed 1 is interrupted: the folder is that of `run`, table for table."""
    file = written(tmp_path, YAML.replace("duration_s: 20", "duration_s: 300"))
    command = [
        sys.executable, "-m", "bindusbl_des.cli", "live", file,
        "--to", "json:file:j.txt", "--out", "flown", "--seed", "7",
    ]  # fmt: skip
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        began = time.monotonic()
        while time.monotonic() - began < 120.0:
            if Path("j.txt").is_file() and Path("j.txt").stat().st_size > 2000:
                break
            time.sleep(0.05)
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=120.0)
    assert process.returncode == 0, err
    assert b"Results: flown" in out
    assert same_tables(load_result(tmp_path / "flown"), simulate(file, 7))
    assert len(Path("j.txt").read_bytes().splitlines()) < 2000


@pytest.mark.parametrize(
    ("wanted", "told"),
    [
        ("morse:udp:1.2.3.4:5", "there is no format 'morse'; it is one of nmea, json, ugps"),
        ("json:carrier", "there is no sink 'carrier'; write json:udp:HOST:PORT, json:tcp:PORT"),
        ("json:udp:10110", "write json:udp:HOST:PORT"),
        ("json:tcp:99999", "'99999' is no port; give a number from 0 to 65535"),
        ("json/AUV9:pty", "there is no AUV9; there are ASV0, ASV1"),
        ("json:file:", "write json:file:PATH"),
        ("json:file:nowhere/x", "cannot be opened (No such file or directory)"),
    ],
)
def test_wrong_outputs_are_refused_in_a_line(wanted: str, told: str, tmp_path: Path) -> None:
    done = call("live", written(tmp_path), "--to", wanted, "--speed", "max", "--out", "flown")
    assert done.exit_code == 2
    assert told in done.output
    assert not Path("flown").exists()


def test_a_scenario_nowhere_on_earth_is_refused_with_the_key(tmp_path: Path) -> None:
    file = written(tmp_path, "name: x\nduration_s: 5\n")
    done = call("live", file, "--to", "nmea:pty", "--out", "flown")
    assert done.exit_code == 2
    assert "nmea needs a place on Earth; add environment.origin.lat_deg and lon_deg" in done.output
    done = call("live", file, "--to", "json:file:j", "--out", "flown", "--speed", "max")
    assert done.exit_code == 0


def test_dry_prints_the_first_of_each_kind(tmp_path: Path) -> None:
    done = call("live", written(tmp_path), "--to", "nmea:tcp:1", "--to", "json:pty", "--dry")
    assert done.exit_code == 0
    lines = done.output.splitlines()
    kinds = [json.loads(it)["kind"] for it in lines if it.startswith("{")]
    assert sorted(kinds) == ["broadcast", "compass", "estimate", "fix", "gnss", "ping", "usbl"]
    starts = [it.partition(",")[0] for it in lines if it.startswith("$")]
    assert sorted(starts) == ["$GPGGA", "$GPHDT", "$GPRMC", "$GPZDA", "$PSIMSSB"]
    assert not any(Path().glob("results*"))


def test_lateness_is_counted_in_bounded_memory() -> None:
    late = Lateness()
    for number in range(10_000):
        late.note(number * 1e-6)
    assert late.quantile(0.99) == pytest.approx(9.9e-3, abs=2e-4)
    late.note(1e9)
    assert len(late.counts) < 200


def test_outputs_listen_where_they_are_told() -> None:
    said: list[str] = []
    with selectors.DefaultSelector() as selector:
        output = opened(
            asked("json:tcp:0", ["ASV0"]), (), Opening(selector, said.append, pytest.fail)
        )
        assert "listens on 127.0.0.1:" in said[0]
        threads = threading.active_count()
        output.sink.close()
        assert threading.active_count() == threads

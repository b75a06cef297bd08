"""A workbench as its user starts it, and one window of it, spoken with as a page does."""

import json
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from http.client import HTTPConnection
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from websockets.sync.client import ClientConnection, connect

SURVEY = """\
# what is said of it stays
name: cove
duration_s: 60
survey: {side_m: 120, depth_m: 10}  # a square
auvs: {count: 2}
asvs: {count: 2, formation: {positions_m: [[-30, 0], [30, 0]]}}
acoustics: {hf: {range_m: 100}, mf: {range_m: 200}}
"""


class Server:
    """A workbench that was started: its address."""

    def __init__(self, process: "subprocess.Popen[str]", address: str) -> None:
        self.process, self.address = process, address
        self.host, self.path = urlsplit(address).netloc, urlsplit(address).path

    def ask(
        self, path: str = "", method: str = "GET", body: bytes | None = None, **heads: str
    ) -> tuple[int, bytes, dict[str, str]]:
        """Return status, body and headers of what is answered; `path` goes on behind the token."""
        connection = HTTPConnection("127.0.0.1", int(self.host.partition(":")[2]), timeout=60)
        own = path if path.startswith("/") else self.path + path
        connection.request(method, own, body, {"Host": self.host, **heads})
        answer = connection.getresponse()
        found = answer.status, answer.read(), {k.lower(): v for k, v in answer.getheaders()}
        connection.close()
        return found

    @contextmanager
    def window(self, **how: Any) -> Iterator["Window"]:
        """Open a window, as a browser does."""
        given = {
            "origin": f"http://{self.host}",
            "proxy": None,
            "max_size": None,
            "ping_interval": None,
        }
        given |= how
        with connect(f"ws://{self.host}{self.path}talk", **given) as socket:
            yield Window(socket)


class Window:
    """What a page does: it asks, and hears."""

    def __init__(self, socket: ClientConnection) -> None:
        self.socket = socket
        self.desk = self.until("desk")

    def until(self, what: str, **holds: Any) -> dict[str, Any]:
        """Return the next message of a kind that holds some values."""
        while True:
            message: dict[str, Any] = json.loads(self.socket.recv(timeout=400))
            if message["is"] == "desk":
                self.desk = message
            if message["is"] == what and all(message.get(k) == v for k, v in holds.items()):
                return message

    def do(self, verb: str, **more: Any) -> None:
        """Ask for something on the version that this window knows."""
        asked = {"do": verb, "version": self.desk["version"], **more}
        self.socket.send(json.dumps(asked))

    def change(self, verb: str, **more: Any) -> dict[str, Any]:
        """Change the scenario; return what it looks like then."""
        before = self.desk["version"]
        self.do(verb, **more)
        while self.desk["version"] == before:
            self.until("desk")
        return self.until("look", version=self.desk["version"])

    def job(self, number: int, *status: str) -> dict[str, Any]:
        """Return a job once it has one of these statuses."""
        while True:
            jobs = {job["number"]: job for job in self.until("jobs")["jobs"]}
            if number in jobs and jobs[number]["status"] in status:
                return jobs[number]


@contextmanager
def started(where: Path, *options: str, cwd: Path | None = None) -> Iterator[Server]:
    """Start a workbench with the command, and end it; it may leave no traceback."""
    command = [sys.executable, "-m", "bindusbl_des", "workbench", str(where), "--no-browser"]
    told = tempfile.TemporaryFile("w+")  # noqa: SIM115 (closed when it was read)
    process = subprocess.Popen(
        [*command, *options],
        stdout=subprocess.PIPE,
        stderr=told,
        text=True,
        cwd=cwd or (where if where.is_dir() else where.parent),
    )
    assert process.stdout is not None
    line = process.stdout.readline()
    try:
        yield Server(process, line.split()[-1])
    finally:
        process.send_signal(signal.SIGTERM)
        process.wait(timeout=40)
        process.stdout.close()
        told.seek(0)
        said = told.read()
        told.close()
    assert "Traceback" not in said, said

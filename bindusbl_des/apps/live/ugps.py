"""The HTTP API of Water Linked's Underwater GPS: one vessel's topside, which locates one AUV.

Source: the API's OpenAPI description, waterlinked.com 1.0.0.  What is not known is -1, as it says.
It is what the maker's extension for BlueOS takes as a fix, in its versions up to 1.0.7: quality,
dilution and satellites are those of a good receiver, since they reach the autopilot as they are,
and the configuration says that the topside's place is given (`static`).  What clients tell (depth,
heading, the master's place) is answered, and of it the heading alone is told again.
"""

import json
import math
import socket
import threading
import time
from collections.abc import Sequence
from contextlib import suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.metadata import version
from typing import Any

from .nmea import HDOP, SATELLITES, head_up
from .readings import Compass, Earth, Gnss, Reading, UsblReading
from .sinks import MOST_CLIENTS, WAITING, leaves_room

# What clients may tell, in so many bytes at most.
TOLD = tuple(
    f"/api/v1/{name}"
    for name in (
        *("external/depth", "external/imu", "external/master", "external/orientation"),
        *("config/antenna", "config/generic"),
    )
)
LONGEST = 4096

# Receivers of a topside; the array is one, whose range stands for each.
RECEIVERS = 4

# A position that is older (s) is none.
STALE_S = 5.0

# A client that has not asked anything to its end for so long (s) is let go.
SILENCE_S = 10.0

# After each answer and each new client others rest so long (s), so that the mission is not starved.
PAUSE_S = 1e-3

KM_PER_H = 3.6

# The last heading that the API has.
HIGHEST_DEG = 359.999

UNKNOWN: dict[str, float] = {
    "lat": 0.0, "lon": 0.0, "orientation": -1, "cog": -1, "sog": -1, "hdop": -1, "numsats": -1,
    "fix_quality": 0,
}  # fmt: skip
# What receivers say that have a fix; an autopilot is told the quality as the type of its fix, 3D.
GOOD = {"hdop": HDOP, "numsats": SATELLITES, "fix_quality": 3}
NOWHERE: dict[str, Any] = {
    "x": 0.0, "y": 0.0, "z": 0.0, "std": 0.0, "position_valid": False,
    "receiver_distance": [0.0] * RECEIVERS, "receiver_rssi": [0.0] * RECEIVERS,
    "receiver_nsd": [0.0] * RECEIVERS, "receiver_valid": [0.0] * RECEIVERS,
}  # fmt: skip


class Topside:
    """Answers with what a vessel has measured last, of itself and of an AUV; encoder and sink."""

    def __init__(self, name: str, host: str, port: int, vessel: str, auv: str) -> None:
        """Listen on a port.

        Raises:
            OSError: when it is taken.
        """
        self.name, self._vessel, self._auv = name, vessel, auv
        self._master, self._global, self._acoustic = dict(UNKNOWN), dict(UNKNOWN), dict(NOWHERE)
        self._heading = -1.0
        self._seen_at, self._server = -math.inf, _Server((host, port), self)
        #: The port that it listens on; of port 0 the one that was free.
        self.port = self._server.server_address[1]
        self._thread = threading.Thread(
            target=self._server.serve_forever, kwargs={"poll_interval": 0.1}, daemon=True
        )
        self._thread.start()

    @property
    def clients(self) -> int:
        return 0

    def __call__(self, reading: Reading, earth: Earth) -> Sequence[bytes]:
        """Note a reading; whoever asks is answered with the last ones."""
        if reading.at_s - self._seen_at > STALE_S and self._acoustic["position_valid"]:
            self._acoustic, self._global = dict(NOWHERE), dict(UNKNOWN)
        if reading.vehicle != self._vessel:
            return ()
        if isinstance(reading, Gnss):
            self._master = self._master | _satellites(reading, earth)
        elif isinstance(reading, Compass):
            self._master = self._master | {"orientation": _degrees(reading.yaw)}
        elif isinstance(reading, UsblReading) and reading.auv == self._auv:
            self._seen_at, self._acoustic = reading.at_s, _acoustic(reading)
            lat, lon, _ = earth.geodetic(reading.sight.place.tolist())
            self._global = UNKNOWN | GOOD | {"lat": lat, "lon": lon}
        return ()

    def send(self, telegram: bytes) -> None:
        """Send nothing: clients ask."""

    def answer(self, path: str) -> Any:
        """Return what is answered to a path; None if there is none such."""
        found = {
            "/api": {"versions": ["v1"]},
            "/api/v1/about": _about(),
            "/api/v1/about/status": {"imu": 3, "gps": 3, "battery": -1},
            "/api/v1/config/antenna": {"x": 0.0, "y": 0.0, "depth": 0.1, "antenna_rotation": 0},
            "/api/v1/config/generic": self._configured(),
            "/api/v1/external/orientation": {"orientation": self._heading},
            "/api/v1/position/acoustic/filtered": self._acoustic,
            "/api/v1/position/acoustic/raw": self._acoustic,
            "/api/v1/position/global": self._global | {"orientation": self._heading},
            "/api/v1/position/master": self._master,
        }
        return found.get(_plain(path))

    def _configured(self) -> dict[str, Any]:
        master = self._master
        return {
            "channel": 0,
            "locator_type": "u1",
            "gps": "static",
            "compass": "onboard",
            "static_lat": master["lat"],
            "static_lon": master["lon"],
            "static_orientation": max(math.floor(master["orientation"]), 0),
        }

    def told(self, path: str, text: bytes) -> dict[str, Any] | None:
        """Take in what a client tells at a path; return what is answered, None if there is none
        such path.
        """
        if _plain(path) not in TOLD:
            return None
        try:
            said = json.loads(text)
            if _plain(path).endswith("orientation"):
                heading = float(said["orientation"])
                if not -1.0 <= heading < 360.0:
                    raise ValueError("orientation is beyond 360")
                self._heading = min(heading, HIGHEST_DEG) if heading >= 0.0 else -1.0
            return {"success": True}
        except (ValueError, TypeError, KeyError, OverflowError, RecursionError) as error:
            return {"success": False, "error": f"not understood: {error}"}

    def close(self) -> None:
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()
        self._server.let_go(SILENCE_S)


def _plain(path: str) -> str:
    return path.partition("?")[0].rstrip("/")


def _satellites(reading: Gnss, earth: Earth) -> dict[str, float]:
    lat, lon, _ = earth.geodetic(reading.place)
    found: dict[str, float] = GOOD | {"lat": lat, "lon": lon}
    if reading.velocity is not None:
        speed = math.hypot(*reading.velocity) * KM_PER_H
        course = _degrees(math.atan2(reading.velocity[1], reading.velocity[0]))
        found |= {"sog": speed, "cog": course if speed >= 0.1 else -1}
    return found


def _acoustic(reading: UsblReading) -> dict[str, Any]:
    """Return where an AUV is, x ahead of the vessel, y to starboard, z below."""
    starboard, forward, below = head_up(reading)
    covariance = reading.sight.covariance
    reach = math.sqrt(starboard**2 + forward**2 + below**2)
    return NOWHERE | {
        "x": forward,
        "y": starboard,
        "z": max(below, 0.0),
        "std": math.sqrt(max(float(covariance[0, 0] + covariance[1, 1]), 0.0)),
        "position_valid": True,
        "receiver_distance": [reach] * RECEIVERS,
        "receiver_valid": [1.0] * RECEIVERS,
    }


def _degrees(yaw: float) -> float:
    """Return a heading (rad) in degrees, in [0, 360)."""
    return min(math.degrees(yaw) % 360.0, HIGHEST_DEG)


def _about() -> dict[str, Any]:
    ours = version("bindusbl-des")
    return {
        "chipid": "0x0",
        "hardware_revision": 0,
        "product_id": 0,
        "product_name": "bindusbl-des",
        "variant": "simulated",
        "version": ours,
        "version_short": ours,
    }


class _Server(ThreadingHTTPServer):
    daemon_threads = True
    block_on_close = False
    request_queue_size = WAITING

    def __init__(self, address: tuple[str, int], topside: Topside) -> None:
        self.topside = topside
        #: When each client was answered last (s, of the clock `monotonic`), or came.
        self.answered: dict[Any, float] = {}
        self.turn = threading.Lock()
        super().__init__(address, _Handler)

    def get_request(self) -> tuple[Any, Any]:
        time.sleep(PAUSE_S)  # also where none can be taken, since too many files are open
        return super().get_request()

    def verify_request(self, request: Any, client_address: Any) -> bool:
        """Tell whether there is room for one more client."""
        self.answered[request] = time.monotonic()
        return len(self.answered) <= MOST_CLIENTS and leaves_room(request.fileno())

    def shutdown_request(self, request: Any) -> None:
        self.answered.pop(request, None)
        super().shutdown_request(request)

    def service_actions(self) -> None:
        self.let_go(0.0)

    def let_go(self, early: float) -> None:
        """End the connections of clients that are silent, or will be in so long (s)."""
        for request, at_s in self.answered.copy().items():
            if time.monotonic() + early - at_s >= SILENCE_S:
                with suppress(OSError):  # its thread then closes it
                    request.shutdown(socket.SHUT_RDWR)

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Say nothing of clients that go in the midst of an answer."""


class _Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    server: _Server

    def do_GET(self) -> None:
        self._answer(self.server.topside.answer(self.path))

    def do_PUT(self) -> None:
        length = self.headers.get("Content-Length", "")
        if not length.isdecimal() or int(length) > LONGEST:
            self.send_error(413 if length else 411)  # which ends the connection
            return
        self._answer(self.server.topside.told(self.path, self.rfile.read(int(length))))

    def _answer(self, found: Any) -> None:
        text = json.dumps({"error": "not found"} if found is None else found).encode()
        is_wrong = isinstance(found, dict) and found.get("success") is False
        self.send_response(404 if found is None else 400 if is_wrong else 200)
        self.send_header("Content-Type", "application/json")
        self.send_header("Access-Control-Allow-Origin", "*")
        self.send_header("Content-Length", str(len(text)))
        self.end_headers()
        self.wfile.write(text)
        self.server.answered[self.connection] = time.monotonic()
        with self.server.turn:
            time.sleep(PAUSE_S)

    def log_message(self, format: str, *args: Any) -> None:
        """Say nothing of what is asked."""

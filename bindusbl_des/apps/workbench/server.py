"""The server of the page: for the user of this machine who was given its address, and nobody else.

It listens on 127.0.0.1.  Whoever asks must name that host (a page elsewhere whose name was bound to
this address anew does not), come from the page itself where a browser says from where, and know the
token, which is in the address and is drawn at each start.
"""

import asyncio
import hmac
import json
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import asynccontextmanager, contextmanager, suppress
from functools import partial
from importlib.resources import files
from math import isfinite
from pathlib import Path
from string import Template
from typing import Any, TypeVar

from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import (
    FileResponse,
    HTMLResponse,
    JSONResponse,
    PlainTextResponse,
    Response,
)
from starlette.routing import Mount, Route, WebSocketRoute
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from starlette.websockets import WebSocket, WebSocketDisconnect

from ...core.scenario.keys import keys
from ...models.charts.areas import polygon_names
from ...support.compiled import watch_compiling
from ...support.mistakes import ScenarioError
from ...support.palette import variables
from ...support.plain_data import leaves, path_of
from ...support.plain_yaml import read_text, read_yaml
from ...support.shipped import ENDINGS
from ...support.wording import described, file_name, lettered, significant
from ...support.yaml_edits import REMOVED, edited
from ..planning.goals import Goal, goal_of
from ..planning.plan_page import goal_text, of_goal, worded
from ..planning.prediction.forecast import COARSE, FINE, Forecast
from ..planning.teams import excess
from ..planning.tender import tender, tender_cells, tender_places
from ..report.page import asset
from ..report.run_page import played
from . import desk as changes
from .desk import Desk, Stale
from .jobs import Job, Jobs, Refused
from .looking import Look, reach_of, shadows

Answer = TypeVar("Answer")

# Files of charts and logs that are dropped on the page, and their size (bytes) at most.
DROPPED = (
    ".kml",
    ".kmz",
    ".geojson",
    ".json",
    ".gpx",
    ".csv",
    ".cnv",
    ".mcap",
    ".pyfg",
    ".yaml",
    ".yml",
)
LARGEST_DROP = 32_000_000
# Of a chart of many polygons, so many are offered as the area.
MOST_AREAS = 12
# A message of the page is at most so long (bytes): a scenario file twice over.
LARGEST_MESSAGE = 2_000_000
# How often (s) one looks how far jobs are, and whether another program has written the file.
EVERY_S = 0.4

# Assets by the name of their room: those of the pages, and our own.
SHARED = ("base.js", "mission.js", "playback.js", "page.css", "uPlot.iife.min.js", "uPlot.min.css")
TYPES = {".js": "text/javascript", ".css": "text/css", ".html": "text/html"}

POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; "
    "connect-src 'self' ws://$host; frame-src 'self'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'"
)
# A page of results runs its own scripts, which it names, but reaches nothing of the workbench.
SANDBOX = "sandbox allow-scripts allow-downloads; frame-ancestors 'self'"


class Guard:
    """Lets pass who names this host, comes from here, and knows the token; others are refused."""

    def __init__(self, app: ASGIApp, token: str, port: int) -> None:
        self._app, self._token = app, token.encode()
        self.hosts = {f"{name}:{port}" for name in ("127.0.0.1", "localhost")}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        if (why := self._refusal(scope)) is None:
            await self._app(scope, receive, partial(self._with_headers, scope, send))
        elif scope["type"] == "websocket":
            await receive()
            await send({"type": "websocket.close", "code": 1008, "reason": why})
        else:
            refused = PlainTextResponse(f"{why}\n", 403)
            await refused(scope, receive, send)

    def _refusal(self, scope: Scope) -> str | None:
        """Return why a request is refused, None where it is not."""
        heads: dict[bytes, list[str]] = {}
        for name, value in scope["headers"]:
            heads.setdefault(name, []).append(value.decode("latin-1"))
        hosts, origins = heads.get(b"host", []), heads.get(b"origin", [])
        if len(hosts) != 1 or hosts[0] not in self.hosts:
            return "this server answers to 127.0.0.1 alone"
        needs_origin = scope["type"] == "websocket" or scope["method"] not in ("GET", "HEAD")
        if (needs_origin or origins) and origins != [f"http://{hosts[0]}"]:
            return "this server answers its own page alone"
        token = scope["path"].encode().split(b"/")[1]
        if not hmac.compare_digest(token, self._token):
            return (
                "open the address that `bindusbl-des workbench` printed; its token is new each time"
            )
        return None

    async def _with_headers(self, scope: Scope, send: Send, message: Message) -> None:
        if message["type"] == "http.response.start":
            host = dict(scope["headers"])[b"host"].decode()
            given = {name for name, _ in message["headers"]}
            usual = {
                b"content-security-policy": Template(POLICY).substitute(host=host),
                b"x-content-type-options": "nosniff",
                b"referrer-policy": "no-referrer",
                b"cache-control": "no-store",
                b"cross-origin-opener-policy": "same-origin",
                b"cross-origin-resource-policy": "same-origin",
            }
            own = [(name, value.encode()) for name, value in usual.items() if name not in given]
            message = {**message, "headers": [*message["headers"], *own]}
        await send(message)


class Workbench:
    """A desk, those who look at it, and what they ask for."""

    def __init__(self, file: Path) -> None:
        self.desk = Desk(file)
        self.jobs = Jobs(self.desk.folder, self._woken)
        self._sockets = set[WebSocket]()
        # One thread has the desk, looks and predicts with what is warm; another reads results
        self._looking, self._reading = ThreadPoolExecutor(1), ThreadPoolExecutor(1)
        self._look: Look | None = None
        self._shade: Any = "lanes"
        self._goal: Goal | None = None
        self._told_jobs = ""
        self._compiled = 0
        self._tasks = set[asyncio.Task[None]]()

    async def _think(self, work: Callable[..., Answer], *given: Any) -> Answer:
        return await asyncio.get_running_loop().run_in_executor(self._looking, work, *given)

    async def read(self, work: Callable[..., Answer], *given: Any) -> Answer:
        """Return what a function answers, in a thread beside the one that predicts."""
        return await asyncio.get_running_loop().run_in_executor(self._reading, work, *given)

    def _woken(self) -> None:
        self._told_jobs = ""

    # What everybody hears

    async def _tell(self, message: Mapping[str, Any], only: WebSocket | None = None) -> None:
        text = json.dumps(message, allow_nan=False, ensure_ascii=False)
        for socket in [only] if only else list(self._sockets):
            with suppress(RuntimeError, WebSocketDisconnect):  # it has gone
                await socket.send_text(text)

    def _state(self) -> dict[str, Any]:
        desk = self.desk
        return {
            "is": "desk",
            "file": str(desk.file),
            "text": desk.text,
            "version": desk.version,
            "undo": desk.can_undo,
            "redo": desk.can_redo,
            "given": desk.given(),
        }

    async def show(self, only: WebSocket | None = None) -> None:
        """Tell what lies on the desk, what it looks like, and then what is predicted of it."""
        state = await self._think(self._state)
        await self._tell(state, only)
        version, text = state["version"], state["text"]
        if only is None or self._look is None:
            self._look = await self._think(Look, text, self.desk.file)
        data = await self._think(self._look.data)
        await self._tell({"is": "look", "version": version, **data}, only)
        task = asyncio.create_task(self.forecast(only))  # other changes do not wait for it
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def forecast(self, only: WebSocket | None = None) -> None:
        """Tell what is predicted of the scenario as it is."""
        look, version = self._look, self.desk.version
        if look is None or look.setup is None:
            return
        found = await self._think(
            lambda: _forecast(look, self._shade, self._goal) if look is self._look else None
        )
        if found is not None:  # it was not changed before its turn came
            await self._tell({"is": "forecast", "version": version, **found}, only)

    async def tell_jobs(self, only: WebSocket | None = None) -> None:
        """Tell how far jobs are, if that is news."""
        states = await self.read(self.jobs.states)
        text = json.dumps(states, sort_keys=True, default=str)
        if only is not None or text != self._told_jobs:
            self._told_jobs = text
            await self._tell({"is": "jobs", "jobs": states}, only)

    def _compiling(self, made: int, _: float) -> None:
        self._compiled = made

    async def watch(self) -> None:
        """Tell, now and then, what went on without the page."""
        watch_compiling(self._compiling)
        await self.show()  # before anybody looks, so that the equations are loaded
        while True:
            await asyncio.sleep(EVERY_S)
            if not self._sockets:
                continue
            if self._compiled:
                words = f"compiling the equations, once: {self._compiled} so far"
                await self._tell({"is": "said", "text": words, "bad": False})
                self._compiled = 0
            with suppress(OSError, ValueError):
                if self.jobs.running or not self._told_jobs:
                    await self.tell_jobs()
                if await self._think(self.desk.take_in):
                    await self.show()

    async def close(self) -> None:
        """End what is at work, and the threads."""
        await self.jobs.close()
        self._looking.shutdown(cancel_futures=True)
        self._reading.shutdown(cancel_futures=True)

    # What one window asks for

    async def talk(self, socket: WebSocket) -> None:
        """Serve one window until it is closed."""
        await socket.accept()
        self._sockets.add(socket)
        try:
            await self.show(socket)
            await self.tell_jobs(socket)
            while True:
                await self._obey(socket, await socket.receive_text())
        except (WebSocketDisconnect, RuntimeError, asyncio.CancelledError):  # it, or the server,
            pass  # has gone, while it was told something
        finally:
            self._sockets.discard(socket)

    async def _obey(self, socket: WebSocket, text: str) -> None:
        """Do what a message asks for; what cannot be done is told to its window."""
        try:
            asked = json.loads(text)
            verb = VERBS.get(asked["do"]) if isinstance(asked, dict) else None
            if verb is None:
                raise Refused(f"there is nothing to do for {described(asked)}")
            await verb(self, socket, asked)
        except Stale as error:
            await self._complain(socket, str(error))
            await self.show(socket)
        except OSError as error:
            where = error.filename or self.desk.file
            await self._complain(socket, f"{where}: {error.strerror or error}")
        except (ScenarioError, ValueError, LookupError, TypeError) as error:
            missing = f"the message lacks {error}" if isinstance(error, KeyError) else str(error)
            await self._complain(socket, missing)

    async def _complain(self, socket: WebSocket, text: str) -> None:
        await self._tell({"is": "said", "text": text, "bad": True}, socket)

    async def _change(self, made: list[changes.Change], version: int) -> None:
        await self._think(self.desk.change, made, version)
        await self.show()

    @property
    def _site(self) -> changes.Ground:
        if self._look is None or self._look.site is None:
            raise Refused("the scenario has mistakes; mend them, and draw then")
        return self._look.site

    async def do_vessels(self, _: WebSocket, asked: dict[str, Any]) -> None:
        """Moor vessels at places."""
        site = None if self._look is None else self._look.site
        made = changes.vessels(asked["stations"])
        if site is not None and site.scenario.asvs.groups:
            groups = self.desk.given()["asvs.groups"]
            made = changes.vessels(asked["stations"], groups, site.kept_stations_m)
        await self._change(made, asked["version"])

    async def do_area(self, _: WebSocket, asked: dict[str, Any]) -> None:
        """Make the survey a polygon."""
        await self._change(changes.area(self._site, asked["corners"]), asked["version"])

    async def do_shapes(self, _: WebSocket, asked: dict[str, Any]) -> None:
        """Make land, or water where nobody goes, polygons."""
        if asked["name"] not in ("land", "keep_out"):
            raise Refused(f"no shapes {described(asked['name'])}")
        made = changes.shapes(self._site, asked["name"], asked["polygons"])
        await self._change(made, asked["version"])

    async def do_ways(self, _: WebSocket, asked: dict[str, Any]) -> None:
        """Send AUVs along points, or over lanes again."""
        await self._change(changes.ways(asked["points"], self._site.origin_deg), asked["version"])

    async def do_key(self, _: WebSocket, asked: dict[str, Any]) -> None:
        """Give a key a value."""
        await self._change(changes.key(asked["key"], asked["value"]), asked["version"])

    async def do_text(self, _: WebSocket, asked: dict[str, Any]) -> None:
        """Give the scenario another text."""
        text, version = asked["text"], asked["version"]
        if not isinstance(text, str):
            raise Refused("text: needs a text")
        await self._think(self.desk.write, text, version)
        await self.show()

    async def do_file(self, socket: WebSocket, asked: dict[str, Any]) -> None:
        """Use a file that was dropped for what it can be meant for: an area, land, ways, a cast; if
        that is several things, and `as` says none, ask which.
        """
        name = Path(asked["name"]).name
        path = self.desk.file.parent / name
        if asked.get("as") == changes.A_LOG or path.suffix == ".pyfg":
            await self._begin({"kind": "replay", "log": str(path)})
            return
        if path.suffix in ENDINGS:
            await self._think(self.desk.write, read_text(path), asked["version"])
            await self.show()
            return
        before = await self._think(Look, self.desk.text, self.desk.file)
        known, why = {mistake.message for mistake in before.mistakes}, list[str]()
        texts = dict[str, str]()
        areas = list[str]()
        with suppress(ValueError, ImportError):  # which what it is tried for says
            areas = await self._think(polygon_names, str(path))
        for words, meant in changes.meanings(name, areas[:MOST_AREAS]).items():
            if asked.get("as") in (None, words):
                text = edited(self.desk.text, meant)
                look = await self._think(Look, text, self.desk.file)
                new = [mistake.message for mistake in look.mistakes if mistake.message not in known]
                if not new:
                    texts[words] = text
                why += new[:1]
        if not texts:
            reason = why[0] if why else "say for what"
            raise Refused(f"{name} is kept beside the scenario, and is not used: {reason}")
        if len(texts) > 1:
            await self._tell({"is": "choose", "name": name, "among": list(texts)}, socket)
            return
        await self._think(self.desk.write, *texts.values(), asked["version"])
        await self.show()

    async def do_step(self, _: WebSocket, asked: dict[str, Any]) -> None:
        """Undo, or redo."""
        await self._think(self.desk.step, 1 if asked["by"] == 1 else -1)
        await self.show()

    async def do_shade(self, _: WebSocket, asked: dict[str, Any]) -> None:
        """Shade the map by something else."""
        if asked["shade"] not in ("lanes", "dwells", "chance"):
            raise Refused(f"no shade {described(asked['shade'])}")
        self._shade = asked["shade"]
        await self.forecast()

    async def do_goal(self, _: WebSocket, asked: dict[str, Any]) -> None:
        """Judge what is predicted by a goal."""
        self._goal = goal_of(asked["below"], of="mean" if asked.get("mean") is True else "worst")
        await self.forecast()

    async def do_try(self, socket: WebSocket, asked: dict[str, Any]) -> None:
        """Predict with vessels at other places, or with other keys, which are not kept."""
        look = self._look
        if keys := asked.get("keys"):
            made = [change for key, text in keys.items() for change in changes.key(key, text)]
            look = await self._think(Look, edited(self.desk.text, made), self.desk.file)
        forecast = None if look is None else await self._think(lambda: look.forecast)
        if look is None or forecast is None:
            refusal = look.mistakes[0].message if look and look.mistakes else look and look.refusal
            await self._tell({"is": "tried", "id": asked["id"], "refusal": refusal or ""}, socket)
            return
        given = asked.get("stations") or forecast.setup.kept_stations_m
        stations = [[float(axis) for axis in place] for place in given]
        found = await self._think(_tried, forecast, stations, self._shade, self._goal)
        await self._tell({"is": "tried", "id": asked["id"], "stations": stations, **found}, socket)

    async def do_begin(self, _: WebSocket, asked: dict[str, Any]) -> None:
        """Begin a job, of a recorded log with the files that were dropped together."""
        wanted = {name: asked[name] for name in WANTED if name in asked}
        if "of" in asked:  # the log of another job
            wanted["log"] = self.jobs[asked["of"]].asked["log"]
        elif "log" in asked:
            wanted["log"] = str(self.logs / file_name(asked["log"]))
        await self._begin(wanted)

    @property
    def logs(self) -> Path:
        """Where files that are one log lie, each log in a folder."""
        return self.desk.folder / "logs"

    async def _begin(self, wanted: dict[str, Any]) -> None:
        look = self._look
        if look is None or look.setup is None or look.mistakes:
            raise Refused("the scenario has mistakes; mend them first")
        await self.jobs.begin(look.setup.scenario, wanted, self.desk.version)
        await self.tell_jobs()

    async def do_stop(self, _: WebSocket, asked: dict[str, Any]) -> None:
        """Stop a job; what it has flown is kept."""
        await self.jobs[asked["job"]].stop()
        await self.tell_jobs()

    async def do_go_on(self, _: WebSocket, asked: dict[str, Any]) -> None:
        """Go on with a job that was stopped."""
        await self.jobs.go_on(asked["job"])
        await self.tell_jobs()

    async def do_noise(self, _: WebSocket, asked: dict[str, Any]) -> None:
        """Give the scenario the noise that was fitted to a recorded log."""
        job = self.jobs[asked["job"]]
        text = await self.read(read_text, job.outcome)
        data = read_yaml(text, job.outcome.name).data
        made = [(path_of(key), value) for key, value in leaves(data) if key != "name"]
        await self._change(made, asked["version"])

    async def do_compare(self, socket: WebSocket, asked: dict[str, Any]) -> None:
        """Tell what plans answer, side by side."""
        jobs = [self.jobs[number] for number in asked["jobs"]]
        rows = await self.read(tender, [job.found for job in jobs])
        names = [f"{lettered(n)}: plan {job.number}" for n, job in enumerate(jobs)]
        head, *cells = tender_cells(rows)
        lines = [", ".join(names), *tender_places(rows)]
        goals = rows[0]["goal"]
        head = tuple(worded(cell, goals) for cell in head)
        told = {"is": "compared", "head": head, "rows": cells, "lines": lines}
        await self._tell(told, socket)

    async def do_take(self, _: WebSocket, asked: dict[str, Any]) -> None:
        """Take over a team that a plan has flown."""
        keys = self.jobs[asked["job"]].team(asked["team"])
        gone = [(path_of("asvs.formation"), REMOVED)]
        await self._change([*gone, *((path_of(k), v) for k, v in keys.items())], asked["version"])


Verb = Callable[[Workbench, WebSocket, dict[str, Any]], Awaitable[None]]
VERBS: Mapping[str, Verb] = {
    name.removeprefix("do_"): verb for name, verb in vars(Workbench).items() if name[:3] == "do_"
}
# What a window may ask of a job
WANTED = (
    *("kind", "seeds", "below", "above", "vary", "mean", "placed", "survive", "budget_missions"),
    *("set", "words"),
)


def _tried(
    forecast: Forecast, stations: list[list[float]], shade: Any, goal: Goal | None
) -> dict[str, Any]:
    """Return what is predicted of vessels at stations (m), and what land hides from them."""
    found = _judged(forecast.at(stations, shade, COARSE, goal), goal)
    setup = forecast.setup
    return {**found, "shadows": shadows(setup, stations), "reach": reach_of(setup)}


def _judged(found: dict[str, Any], goal: Goal | None) -> dict[str, Any]:
    """Return what is predicted with the goal, and whether it is met, in words."""
    if goal is None:
        return found
    told = {**goal.record(), **of_goal(goal.record())}
    value, words = found.pop("asked"), goal_text(told)
    if not isfinite(value):
        return {**found, "goal": {"told": f"{words}; not predicted", "met": None, "top": None}}
    met = excess(goal, value) <= 0.0
    reached = f"{significant(value * told['factor'])} {told['unit']}".strip()
    words = f"{words}; predicted {reached}, {'met' if met else 'not met'}"
    top = goal.limit if goal.metric.startswith("position_error") else None
    return {**found, "goal": {"told": words, "met": met, "top": top}}


def _forecast(look: Look, shade: Any, goal: Goal | None) -> dict[str, Any]:
    """Return what is predicted of a scenario as it is; None of one of which nothing is, and why."""
    forecast = look.forecast
    if forecast is None:
        return {"found": None, "refusal": look.refusal}
    stations = forecast.setup.kept_stations_m
    found = _judged(forecast.at(stations, shade, FINE, goal), goal)
    return {"found": found, "left_out": list(forecast.left_out)}


# What is asked for by address


def _file(package: str | None, name: str) -> Response:
    ending = Path(name).suffix
    found = files(package or __package__) / "assets" / name
    if "/" in name or ending not in TYPES or not found.is_file():
        return PlainTextResponse("there is no such file\n", 404)
    return Response(found.read_bytes(), media_type=TYPES[ending])


async def _page(request: Request) -> Response:
    return _file(None, "workbench.html")


async def _asset(request: Request) -> Response:
    name = request.path_params["name"]
    if name == "colours.css":
        return Response(variables(), media_type="text/css")
    if name in SHARED:
        return Response(asset(name), media_type=TYPES[Path(name).suffix])
    return _file(None, name)


async def _keys(request: Request) -> Response:
    """Return every key of a scenario, as `params` has them."""
    rows = ("key", "kind", "choices", "unit", "default", "range", "meaning", "condition")
    return JSONResponse([{name: getattr(key, name) for name in rows} for key in keys()])


async def _run_page(request: Request) -> Response:
    """Return the page of a mission, of all missions of a job, or of a plan."""
    bench: Workbench = request.app.state.bench
    which = request.path_params["which"]
    try:
        job = bench.jobs[request.path_params["job"]]
        if which == "picture":
            return FileResponse(job.picture)
        if which == "plan":
            page = await bench.read((job.found / "plan.html").read_text, "utf-8")
        elif which == "all":
            page = await bench.read(lambda: job.campaign().report())
        else:
            page = await bench.read(lambda: job.result(int(which)).report())
    except (ValueError, OSError, LookupError) as error:
        return PlainTextResponse(f"{error}\n", 404)
    return HTMLResponse(page, headers={"content-security-policy": SANDBOX})


async def _play(request: Request) -> Response:
    """Return a mission of a job as data, of which a page plays it."""
    bench: Workbench = request.app.state.bench
    given = request.path_params
    try:
        found = await bench.read(_played, bench.jobs[given["job"]], given["seed"])
    except (ValueError, OSError, LookupError) as error:
        return PlainTextResponse(f"{error}\n", 404)
    return JSONResponse(found)


def _played(job: Job, seed: int) -> dict[str, Any]:
    data, packed = played(job.result(seed))
    return {"data": data, "packed": packed}


async def _export(request: Request) -> Response:
    """Return the team of a plan as a chart, as `export` writes it."""
    bench: Workbench = request.app.state.bench
    try:
        path = await bench.jobs[request.path_params["job"]].export(request.path_params["kind"])
    except Refused as error:
        return PlainTextResponse(f"{error}\n", 404)
    return FileResponse(path, filename=path.name)


async def _drop(request: Request) -> Response:
    """Keep a file that was dropped beside the scenario, under a name that nothing has."""
    bench: Workbench = request.app.state.bench
    name = Path(request.query_params.get("name", "")).name
    stem, ending = file_name(Path(name).stem).lstrip("."), Path(name).suffix.lower()
    if not stem or ending not in DROPPED:
        return JSONResponse({"error": f"{described(name)}: give {', '.join(DROPPED)}"}, 400)
    raw = bytearray()
    async for part in request.stream():
        raw += part
        if len(raw) > LARGEST_DROP:
            return JSONResponse({"error": f"{name}: has more than {LARGEST_DROP:,} bytes"}, 413)
    folder = bench.desk.file.parent
    try:
        if log := request.query_params.get("log"):
            folder = bench.logs / file_name(log).lstrip(".")
            folder.mkdir(parents=True, exist_ok=True)
        path = await bench.read(_kept, folder, stem, ending, bytes(raw))
    except OSError as error:
        return JSONResponse({"error": f"{name}: {error.strerror or error}"}, 507)
    return JSONResponse({"name": path.name})


@contextmanager
def _whole_or_none(path: Path) -> Iterator[None]:
    """Leave no file that could not be written whole."""
    try:
        yield
    except OSError:
        path.unlink()
        raise


def _kept(folder: Path, stem: str, ending: str, raw: bytes) -> Path:
    """Write a file into a folder, unless it is there; return its name there."""
    number = 1
    while True:
        path = folder / (f"{stem}{ending}" if number == 1 else f"{stem}-{number}{ending}")
        try:
            with path.open("xb") as file, _whole_or_none(path):
                file.write(raw)
            return path
        except FileExistsError:
            if path.is_file() and path.read_bytes() == raw:
                return path
        number += 1


async def _talk(socket: WebSocket) -> None:
    await socket.app.state.bench.talk(socket)


def application(file: Path, token: str, port: int, plan: Path | None = None) -> ASGIApp:
    """Return the workbench of a scenario file, for who knows the token, at a port of this machine;
    with a plan, by its folder, among its jobs.

    Raises:
        ScenarioError: when the file is no text.
        PlanError: when the plan cannot be used.
        OSError: when nothing can be written beside it.
    """
    bench = Workbench(file)
    if plan is not None:
        bench.jobs.adopt(plan, bench.desk.version)

    @asynccontextmanager
    async def living(_: Starlette) -> AsyncIterator[None]:
        watching = asyncio.create_task(bench.watch())
        try:
            yield
        finally:
            watching.cancel()
            await bench.close()

    own = [
        Route("/", _page),
        Route("/assets/{name}", _asset),
        Route("/keys", _keys),
        Route("/pages/{job:int}/{which}", _run_page),
        Route("/play/{job:int}/{seed:int}", _play),
        Route("/export/{job:int}/{kind}", _export),
        Route("/drop", _drop, methods=["POST"]),
        WebSocketRoute("/talk", _talk),
    ]
    app = Starlette(routes=[Mount(f"/{token}", routes=own)], lifespan=living)
    app.state.bench = bench
    return Guard(app, token, port)


def serve(file: Path, port: int, begun: Callable[[str], None], plan: Path | None = None) -> None:
    """Serve the workbench of a scenario file, with a plan, until the process is asked to end.

    `begun` is told its address.

    Raises:
        ScenarioError: when the file is no text.
        PlanError: when the plan cannot be used.
        OSError: when the port is not free, or nothing can be written beside the file.
    """
    import secrets
    import socket

    import uvicorn

    token = secrets.token_urlsafe(24)
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as listening:
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listening.bind(("127.0.0.1", port))
        listening.listen()  # whoever is told the address may ask at once
        own_port = listening.getsockname()[1]
        app = application(file, token, own_port, plan)
        config = uvicorn.Config(
            app,
            ws="websockets-sansio",
            ws_max_size=LARGEST_MESSAGE,
            ws_ping_interval=None,  # a page of this machine is there, or has closed
            log_level="warning",
            access_log=False,
            server_header=False,
            timeout_graceful_shutdown=2,
        )
        begun(f"http://127.0.0.1:{own_port}/{token}/")
        uvicorn.Server(config).run(sockets=[listening])

"""What takes long: commands in a process of their own, each in a folder that says how far it is.

A campaign, or a plan, keeps what it has flown.  So a job that was stopped, or whose server was
killed, goes on where it was; and one that outlives its server is found again.
"""

import asyncio
import json
import os
import re
import shlex
import shutil
import signal
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from math import isfinite
from pathlib import Path
from time import monotonic
from typing import IO, Any

from ...core.results.result import Result
from ...core.scenario.scenario import Scenario
from ...support.files import read_json, write_text
from ...support.kept_files import copies_of, keep, portable
from ...support.wording import described, file_name
from ..campaigns.campaign import Campaign, unfinished_campaign
from ..campaigns.statistics.intervals import intervals
from ..campaigns.storage.folder import is_locked
from ..campaigns.storage.parts import OK
from ..planning.doubting import by_surprise
from ..planning.folder import BEST, MISSIONS, PLAN, drawn_team, resumed
from ..planning.goals import limits_text
from ..planning.plan_page import condition, interval, of_goal, parted, verdict, worded
from ..planning.teams import FORMATION, PLACEMENT

Row = Mapping[str, Any]

SCENARIO, ASKED, LOG, FOUND = "scenario.yaml", "job.json", "log.txt", "found"
PROCESS, SAID = "process.txt", "said.txt"
# What is done with recorded logs, and where it writes what it finds.
RECORDED = {"replay": FOUND, "fit": "noise.yaml"}

# So many seeds are simulated at once at most, so many jobs are listed.
MOST_SEEDS, MOST_LISTED = 1000, 40
# So long (s) a process that is asked to end finishes the missions that are under way.
PATIENCE_S = 20.0

# A line of the log that tells of mistakes, and how much of it a page shows.
LONGEST_TOLD = 2000

# What `plan` can be asked to find, and what may be chosen: as its options have it.
GOAL = re.compile(r"\w+=[-+.\deE]+")
CHOICE = re.compile(r"[\w.]+=[^\n\0]+")
PART = re.compile(r"[\w.:]+")
NUMBERS = ("survive", "budget_missions")

METRICS = ("worst_position_error_m", "worst_position_error_p95_m", "worst_fix_age_max_s")


class Refused(ValueError):
    """What was asked for cannot be done; the message says why, and what to do."""


def arguments(asked: Mapping[str, Any]) -> list[str]:
    """Return the command that does what is asked, to be run in its job's folder.

    Raises:
        Refused: when there is no such job.
    """
    kind = asked.get("kind")
    if kind == "simulate":
        seeds = asked.get("seeds")
        if type(seeds) is not int or not 1 <= seeds <= MOST_SEEDS:
            needs = f"seeds: needs a whole number from 1 to {MOST_SEEDS}"
            raise Refused(f"{needs}; got {described(seeds)}")
        command = ["sweep", SCENARIO, "--seeds", str(seeds), "--detail", "full"]
    elif kind == "plan":
        command = ["plan", SCENARIO]
        for option, pattern in (("below", GOAL), ("above", GOAL), ("vary", CHOICE)):
            for text in asked.get(option) or ():
                if not isinstance(text, str) or not pattern.fullmatch(text):
                    raise Refused(f"{option}: needs NAME=VALUE; got {described(text)}")
                command += [f"--{option}", text]
        command += ["--mean"] if asked.get("mean") is True else []
        for name in NUMBERS:
            if (number := asked.get(name)) is not None:
                if type(number) is not int or number < 0:
                    raise Refused(f"{name}: needs a whole number; got {described(number)}")
                command += [f"--{name.replace('_', '-')}", str(number)]
    elif kind in RECORDED:
        return [str(kind), str(asked["log"]), "--out", RECORDED[kind], "--force"]
    else:
        known = ", ".join(("simulate", "plan", *RECORDED))
        raise Refused(f"there is no job {described(kind)}; there are {known}")
    for key, value in (asked.get("set") or {}).items():  # what is doubted
        command += ["--set", f"{key}={json.dumps(value)}"]
    return [*command, "--out", FOUND]


class Job:
    """One job: its folder, and what is asked there."""

    def __init__(self, folder: Path) -> None:
        """Take a job's folder.

        Raises:
            OSError, ValueError: when it holds none.
        """
        self.folder, self.asked = folder, dict(read_json(folder / ASKED))
        self.process: asyncio.subprocess.Process | None = None

    @property
    def number(self) -> int:
        """Its number."""
        return int(self.folder.name)

    @property
    def found(self) -> Path:
        """The folder of what it finds; of a plan that was opened that of the plan."""
        return self.folder / str(self.asked.get("found", FOUND))

    @property
    def campaign_folder(self) -> Path:
        """The folder of the missions that it flies."""
        return self.found / MISSIONS if self.asked["kind"] == "plan" else self.found

    @property
    def runs(self) -> bool:
        """Whether a process works on it, ours or that of a server that was killed."""
        if self.process is not None:
            return self.process.returncode is None
        return self.campaign_folder.is_dir() and is_locked(self.campaign_folder)

    def campaign(self) -> Campaign:
        """Return its missions (raises `CampaignError` where there are none)."""
        return unfinished_campaign(self.campaign_folder)

    def result(self, seed: int) -> Result:
        """Return a mission by its seed.

        Raises:
            ValueError: when it was not flown, or is damaged.
        """
        return self.campaign().result(0, seed)

    async def start(self) -> None:
        """Begin it, or go on with it."""
        is_begun = self.campaign_folder.is_dir() and self.asked["kind"] not in RECORDED
        command = ["resume", str(self.found)] if is_begun else arguments(self.asked)
        with (self.folder / LOG).open("wb") as log, (self.folder / SAID).open("wb") as said:
            self.process = await self._run(command, log, said)
        write_text(self.folder / PROCESS, f"{self.process.pid}\n")

    async def export(self, kind: str) -> Path:
        """Return the file to which `export` has written the team of a plan.

        Raises:
            Refused: when it writes none, saying why.
        """
        path = self.folder / f"{file_name(self.asked['name'])}.{kind}"
        if not re.fullmatch(r"[a-z0-9]+", kind):
            raise Refused(f"there is no export {described(kind)}")
        with tempfile.TemporaryFile() as log:
            command = ["export", str(self.found), "--to", kind, "--out", path.name, "--force"]
            process = await self._run(command, log)
            if await process.wait():
                log.seek(0)
                raise Refused(log.read().decode("utf-8", "replace").strip())
        return Path(shutil.make_archive(str(path), "zip", path)) if path.is_dir() else path

    async def _run(
        self, command: Sequence[str], log: IO[bytes], said: IO[bytes] | None = None
    ) -> asyncio.subprocess.Process:
        return await asyncio.create_subprocess_exec(
            *(sys.executable, "-P", "-m", "bindusbl_des", *command),
            cwd=self.folder,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
            stdin=asyncio.subprocess.DEVNULL,
            stdout=said or asyncio.subprocess.DEVNULL,
            stderr=log,
            start_new_session=True,  # Ctrl-C is for the server, which ends it
        )

    async def stop(self) -> None:
        """Have it end; what it has flown is kept.

        Raises:
            Refused: when it is another program's.
        """
        if self.runs and self.process is None and not (self.folder / PROCESS).exists():
            raise Refused(f"another program works on job {self.number}; end it there")
        for number in (signal.SIGINT, signal.SIGTERM):
            if not self.runs:
                return
            with suppress(OSError, ValueError):  # it has just ended
                os.kill(int((self.folder / PROCESS).read_text()), number)
            end = monotonic() + PATIENCE_S
            while self.runs and monotonic() < end:
                await asyncio.sleep(0.05)

    def state(self) -> dict[str, Any]:
        """Return how far it is, and what it found, as plain data."""
        state: dict[str, Any] = {
            "number": self.number,
            **self.asked,
            "status": "running" if self.runs else "stopped",
            "done": 0,
            "missions": self.asked.get("seeds"),
            "left_s": None,
            "told": self._log(),
            "command": self._command(),
        }
        if self.asked["kind"] in RECORDED:
            return {**state, **self._recorded_state()}
        try:
            campaign = self.campaign()
            far = campaign.state()
            state |= {"done": far.done, "failed": far.failed, "left_s": far.seconds_left}
            if self.asked["kind"] == "plan":
                return {**state, **self._plan_state()}
            state |= _seeds(campaign)
            if far.status == "complete" and not self.runs:
                state["status"] = "complete"
        except (ValueError, OSError, LookupError):  # not begun yet, or it never will; or its parts
            if not self.campaign_folder.is_dir() and not self.runs:  # are being joined just now
                state["status"] = "failed"
        return state

    def _command(self) -> str:
        """Return the command that does the same in a shell; "" of a plan that was opened."""
        if "found" in self.asked:
            return ""
        given = {SCENARIO: str(self.folder / SCENARIO), FOUND: str(self.found)}
        command = ["bindusbl-des", *arguments(self.asked)]
        return shlex.join([given.get(word, word) for word in command])

    @property
    def outcome(self) -> Path:
        """Where what was made of a recorded log lies."""
        return self.folder / RECORDED[self.asked["kind"]]

    @property
    def picture(self) -> Path:
        """The figure of a recorded log that was replayed (raises LookupError without one)."""
        pictures = sorted(self.outcome.glob("*.png"))
        return pictures[0]

    def _recorded_state(self) -> dict[str, Any]:
        if self.runs:
            return {}
        if not self.outcome.exists():
            return {"status": "failed"}
        told = self.outcome if self.outcome.is_file() else self.folder / SAID
        return {"status": "complete", "said": told.read_text(encoding="utf-8").strip()}

    def _plan_state(self) -> dict[str, Any]:
        try:
            plan = read_json(self.found / PLAN)
            team = drawn_team(self.found)
        except (OSError, ValueError):
            return {}
        if self.runs:
            return {}
        return {
            "status": "complete" if plan["status"] == "complete" else "stopped",
            "answer": plan["answer"],
            "answered": [worded(text, plan["goal"]) for text in plan["told"]],
            "would": worded(plan["would"] or "", plan["goal"]),
            "keys": plan["candidates"][team.number]["keys"],
            "teams": [_team(plan, number) for number in _flown(plan, team.number)],
            "unit": of_goal(plan["goal"][0])["unit"],
            "doubts": [_doubt(plan, *pair) for pair in by_surprise(plan["sensitivity"])],
            "run": shlex.join(["bindusbl-des", "run", str(self.found / BEST)]),
        }

    def team(self, number: int) -> dict[str, Any]:
        """Return the keys of a team that its plan has flown, by its number among the candidates.

        Raises:
            Refused: when it has flown none of that number.
        """
        for team in self.state().get("teams", ()):
            if team["number"] == number:
                return dict(team["keys"])
        raise Refused(f"this plan has flown no team {described(number)}")

    def _log(self) -> str:
        """Return what its process said last."""
        try:
            with (self.folder / LOG).open("rb") as file:
                file.seek(max(os.fstat(file.fileno()).st_size - LONGEST_TOLD, 0))
                text = file.read().decode("utf-8", "replace")
        except OSError:
            return ""
        lines = [line.rpartition("\r")[2] for line in text.splitlines()]
        if "KeyboardInterrupt" in text:  # it was stopped before it began
            return ""
        return "\n".join(lines if not self.runs else lines[-1:]).strip()


def _flown(plan: Row, first: int) -> list[int]:
    """Return the numbers of candidates that a plan has flown, those it speaks of first."""
    flown = [n for n, candidate in enumerate(plan["candidates"]) if candidate["simulated"]]
    return list(dict.fromkeys([first, *plan["runners_up"], *flown]))[:MOST_LISTED]


def _team(plan: Row, number: int) -> dict[str, Any]:
    """Return a candidate of a plan: its number, its keys, and in words what it is and came to."""
    candidate, goal = plan["candidates"][number], plan["goal"][0]
    reached = interval(candidate["simulated"], 0, of_goal(goal)["factor"])
    told = f"{candidate['team']}: {reached} {of_goal(goal)['unit']}, {candidate['verdict']}"
    stations = [[place["x_m"], place["y_m"]] for place in candidate["places"]]
    keys = dict(candidate["keys"])
    if candidate["stations"]:  # it is moored, wherever that was chosen by
        keys = {key: value for key, value in keys.items() if not key.startswith(FORMATION)}
        keys[FORMATION] = {"positions_m": stations}
    return {"number": number, "told": told, "keys": keys}


def _doubt(plan: Row, case: Row, known: Row | None) -> dict[str, Any]:
    """Return in words what becomes of a team that is not as planned, and the keys that make it so:
    with the filter as planned, and, where it was flown, with one that knows.
    """
    factor = of_goal(plan["goal"][0])["factor"]
    return {
        "told": condition(case),
        "verdict": verdict(case),
        "mean": parted(case, 0, factor)[0],
        "planned": parted(case.get("as_planned"), 0, factor)[0],
        "keys": case["keys"],
        "known": known and parted(known, 0, factor)[0],
        "known_keys": known and known["keys"],
    }


def _seeds(campaign: Campaign) -> dict[str, Any]:
    """Return what each seed that was flown came to, the best first; and the mean of the worst AUV's
    error with half of its 95 % interval (None of a single one).
    """
    frame = campaign.missions
    if frame.empty:
        return {}
    frame = frame[frame.status == OK].sort_values([METRICS[0], "seed"])
    rows = frame[["seed", *METRICS, f"{METRICS[0]}_auv"]].to_dict("records")
    found = intervals(frame[[METRICS[0]]].to_numpy().T)
    half = float(found.half_width[0])
    return {
        "seeds_flown": [
            {str(name): None if value != value else value for name, value in row.items()}
            for row in rows
        ],
        "mean": float(found.mean[0]),
        "half": half if isfinite(half) else None,
    }


class Jobs:
    """The jobs of a desk, the newest last; `changed` hears of each that is at work."""

    def __init__(self, folder: Path, changed: Callable[[], object]) -> None:
        self.folder = folder / "jobs"
        self.folder.mkdir(parents=True, exist_ok=True)
        self._changed = changed
        self._jobs = {job.number: job for job in map(_job, sorted(self.folder.iterdir())) if job}

    def __getitem__(self, number: int) -> Job:
        try:
            return self._jobs[number]
        except KeyError:
            raise Refused(f"there is no job {described(number)}") from None

    @property
    def running(self) -> list[Job]:
        """Those on which a process works."""
        return [job for job in self._jobs.values() if job.runs]

    def states(self) -> list[dict[str, Any]]:
        """Return how far the newest of them are."""
        return [job.state() for job in list(self._jobs.values())[-MOST_LISTED:]]

    async def begin(self, scenario: Scenario, asked: Mapping[str, Any], version: int) -> Job:
        """Begin a job on a scenario.

        Raises:
            Refused: when there is no such job, or another is at work.
            OSError: when its folder cannot be written.
        """
        if asked.get("kind") == "plan":
            asked = _placing(scenario, asked)
        arguments(asked)
        self._check_free()
        number = max(self._jobs, default=0) + 1
        folder = self.folder / f"{number:04}"
        folder.mkdir(exist_ok=True)
        write_text(folder / SCENARIO, text_of(scenario, folder))
        self._note(number, {**asked, "version": version, "name": scenario.name})
        return await self.go_on(number)

    def _note(self, number: int, asked: Mapping[str, Any]) -> None:
        folder = self.folder / f"{number:04}"
        folder.mkdir(exist_ok=True)
        write_text(folder / ASKED, f"{json.dumps(asked)}\n")
        self._jobs[number] = Job(folder)

    def adopt(self, plan: Path, version: int) -> None:
        """Have the plan in a folder among them, if it is not there.

        Raises:
            PlanError: when it is none, or cannot be used.
        """
        found = str(plan.resolve())
        if any(job.asked.get("found") == found for job in self._jobs.values()):
            return
        question = resumed(plan)
        goals = [limits_text([goal]) for goal in question.goals]
        asked = {"kind": "plan", "found": found, "version": version, "name": question.name}
        self._note(max(self._jobs, default=0) + 1, {**asked, "below": goals, "words": plan.name})

    async def go_on(self, number: int) -> Job:
        """Go on with a job that was stopped (raises as `begin`)."""
        job = self[number]
        self._check_free()
        await job.start()
        asyncio.get_running_loop().create_task(self._watch(job))
        return job

    def _check_free(self) -> None:
        if self.running:
            job = self.running[0]
            raise Refused(f"job {job.number} ({job.asked['kind']}) is at work; stop it first")

    async def _watch(self, job: Job) -> None:
        assert job.process is not None
        await job.process.wait()
        (job.folder / PROCESS).unlink(missing_ok=True)
        self._changed()

    async def close(self) -> None:
        """End what is at work."""
        await asyncio.gather(*(job.stop() for job in self.running), return_exceptions=True)


def _placing(scenario: Scenario, asked: Row) -> Row:
    """Return what a plan is asked with vessels that it places itself, by any of the models that are
    named, or else as the scenario has them if these move.
    """
    models = asked.get("placed") or []
    if not isinstance(models, list) or not all(map(PART.fullmatch, map(str, models))):
        raise Refused(f"placed: needs a list of placements; got {described(models)}")
    if not models and scenario.asvs.formation.moored is None:
        return asked
    vary = [*(asked.get("vary") or ()), *([f"{PLACEMENT}={','.join(models)}"] if models else ())]
    return {**asked, "vary": vary, "set": {FORMATION: {"model": [*models, "ring"][0]}}}


def text_of(scenario: Scenario, folder: Path) -> str:
    """Return the text of a scenario file in a folder, to which copies of its files go."""
    given = scenario.model_dump(mode="json", exclude_unset=True)
    keep(copies_of(given), folder)
    every = portable(given).items()
    return "".join(f"{key}: {json.dumps(own, ensure_ascii=False)}\n" for key, own in every)


def _job(folder: Path) -> Job | None:
    try:
        return Job(folder) if folder.name.isdigit() else None
    except (OSError, ValueError, TypeError):
        return None

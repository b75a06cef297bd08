"""A mission that can be advanced to an instant, looked at, advanced again, and ended."""

import time as clock
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from numbers import Real
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import simpy

from ...support.arrays import Floats, keep_memory
from ...support.facts import cached_property
from ...support.wording import plain
from ..records.events import HEARD, Broadcast, GnssFix

# The first mission imports numba and Arrow, which take a second that an import of this module does
# not wait for.
if TYPE_CHECKING:
    from ...support.mistakes import ScenarioWarning
    from ..protocol.access.hosted import Modem
    from ..protocol.happenings import Happening, Watch
    from ..protocol.outcomes import Sight
    from ..protocol.steps import MissionEnvironment
    from ..protocol.view import Schedule
    from ..results.result import Result
    from ..scenario.scenario import Scenario
    from ..vehicles.poses import PoseSource

# Memory (bytes) that is kept for the next mission: half of what up to a hundred AUVs need.
keep_memory(8_000_000)

# Relative rounding error of sums of times is less: a million rounds of 0.1 s have 1.3e-11.
ROUNDING = 1e-10


class AuvStates(NamedTuple):
    """The AUVs at one instant, a row for each; survey frame, z down.

    `truth` (n, 4): x, y, z (m), yaw (rad, in (-pi, pi]).  `estimate` (n, 2): x and y (m) of the
    AUV's own navigator.  `covariance` (n, 2, 2), m2, of the estimate.
    """

    truth: Floats
    estimate: Floats
    covariance: Floats


class PingUnderWay(NamedTuple):
    """A ping in the water: its number in the table `pings`, its AUV (row), when it began (s).

    With passive ranging it is the ping of an ASV (row), and of no AUV (None).
    """

    ping: int
    auv: int | None
    sent_at_s: float
    asv: int | None = None


class Mission:
    """One mission of a scenario, as far as it has been advanced.

    All that happens up to and including the instant `time` has happened, and nothing later.  The
    mission covers [0, duration): what would happen at its last instant does not, and pings and
    fixes still under way then are recorded as in flight.  The same scenario and seed give the same
    tables, at whatever instants the mission has been stopped and looked at.

    >>> from bindusbl_des import Mission, Scenario
    >>> mission = Mission(Scenario(name="example", duration_s=10.0), seed=1)
    >>> mission.advance(4.0)
    >>> mission.time, mission.auvs().estimate.shape, len(mission.result().auvs)
    (4.0, (3, 2), 3)
    """

    def __init__(
        self,
        scenario: "Scenario | str | Path",
        seed: int = 0,
        *,
        allow_plugins: bool = False,
        poses: "PoseSource | None" = None,
        pose_step_s: float = 0.1,
        schedule: "Schedule | None" = None,
    ) -> None:
        """Build a mission; it is at 0 s.

        `scenario` may be the path of a scenario file, or the name of one that ships, read as by
        `load_scenario`.  `poses` is an outside program that moves AUVs, ASVs or both, in the place
        of the scenario (:class:`..vehicles.poses.PoseSource`).  It is asked each `pose_step_s` (s),
        as the mission goes on; positions between two samples are interpolated.  `schedule` replaces
        the scenario's (:mod:`..protocol.own_parts`).

        Raises:
            ScenarioError: when the scenario file cannot be read or used.
            TypeError: when `scenario` is neither a scenario nor a path.
            ValueError: when the seed is not a whole number >= 0, the scenario names a schedule or
                track that cannot be used, or the poses cannot be used, now or later.
        """
        from ..setup import Setup

        if isinstance(seed, bool) or not isinstance(seed, (int, np.integer)) or seed < 0:
            raise ValueError(f"the seed must be a whole number >= 0, got {seed!r}")
        from ..protocol.steps import MissionEnvironment
        from ..scenario.chosen_parts import ready_plugins
        from ..scenario.files.scenario_file import as_scenario
        from .build import build_world

        self.scenario = as_scenario(scenario, allow_plugins=allow_plugins)
        self.seed = int(seed)
        self._time, self._worked_s, self._has_failed = 0.0, 0.0, False
        with self._at_work():
            self._env = MissionEnvironment()
            ready_plugins(self.scenario)
            setup = Setup.of(self.scenario)
            self._world = build_world(self._env, setup, self.seed, poses, pose_step_s)
            if schedule is not None:
                self._schedule_by(schedule)
            self._happen(0.0)

    def _schedule_by(self, schedule: "Schedule") -> None:
        from ...support.plugins import OwnPart
        from ..protocol.network import Network
        from ..protocol.own_parts import checked_groups

        network = self._world.network
        if not isinstance(network, Network):
            raise ValueError("with passive ranging ASVs ping in turn: nothing is scheduled")
        if self.scenario.protocol.random_access or network.dissemination is not None:
            raise ValueError(
                "with random access, or slots that frames tell (knowledge: broadcast), a schedule "
                "that is given is not asked; name it in the scenario at protocol.schedule"
            )
        part = OwnPart("protocol.schedule", "schedule", schedule)
        network.schedule = partial(checked_groups, part)

    def __repr__(self) -> str:
        end = plain(self.scenario.duration_s)
        return f"<Mission {self.scenario.name}, seed {self.seed}: {self.time:.6g} of {end} s>"

    @property
    def time(self) -> float:
        """The instant (s) that the mission has been advanced to, or of the error that ended it."""
        return self._time

    @property
    def navigator(self) -> Any:
        """The user-defined navigator itself; None with one that ships."""
        return getattr(self._world.navigator, "own", None)

    @property
    def env(self) -> "MissionEnvironment":
        """The environment of the mission's events, for a user's processes beside it."""
        return self._env

    def happening(self, kind: str, **which: Any) -> simpy.Event:
        """Return the event of the next happening of a kind: `ping`, `arrival`, `reception`,
        `broadcast` or `delivery`.

        Its value is a :class:`..protocol.happenings.Happening`: kind, time (s), and the row of that
        instant.  `which` are values that columns of the row must have: ``happening("delivery",
        auv=1)``.  Waiting changes nothing of the mission.

        Raises:
            ValueError: for an unknown kind or column, or a value that the column never has.
        """
        return self._world.network.watching.next(kind, which, self._last_instant(self._time))

    def happenings(self, *kinds: str, **which: Any) -> "Iterator[Happening]":
        """Advance from one happening of some kinds to the next, to the mission's end.

        A happening is yielded once all events of its instant have happened; `which` as in
        :meth:`happening`.

        Raises:
            ValueError: for an unknown kind or column, or a value that the column never has.
        """
        since = self._last_instant(self._time)
        return self._each(self._world.network.watching.watch(kinds, which, since))

    def watch(self, *kinds: str, **which: Any) -> "Watch":
        """Return all happenings of some kinds from now on, one after the other by its `next()`: for
        a process beside the mission that may miss none; `which` as in :meth:`happening`.

        Raises:
            ValueError: for an unknown kind or column, or a value that the column never has.
        """
        return self._world.network.watching.watch(kinds, which, self._last_instant(self._time))

    def sight_of(self, ping: int, asv: int) -> "Sight | None":
        """Return what an ASV alone has measured of a ping, at the instant of its `reception`.

        None with passive ranging, where no ASV measures, or with a user-defined instrument.
        """
        return self._world.network.outcomes.sight_of(ping, asv)

    def _each(self, watch: "Watch") -> "Iterator[Happening]":
        try:
            while self._time < self.scenario.duration_s:
                event = watch.next()
                happening = self.advance(event)
                if event.processed:
                    yield happening
        finally:
            watch.close()

    def advance(self, until: float | simpy.Event) -> Any:
        """Advance to an instant (s) of the mission, including all its events.

        Or to the instant of an event, whose value is returned; None if the mission ends before.

        Raises:
            TypeError: when `until` is neither an instant nor an event.
            ValueError: when it is in the past or beyond the mission's end, or of another mission.
            RuntimeError: when the mission has ended with an error before.
        """
        if isinstance(until, simpy.Event):
            return self._advance_to_event(until)
        if not isinstance(until, Real):
            raise TypeError(f"advance to an instant (s) or a SimPy event; got {until!r}")
        until, end = float(until), self.scenario.duration_s
        if until < self._time:
            raise ValueError(
                f"the mission is at {plain(self._time)} s and does not go back to "
                f"{plain(until)} s; begin a new Mission"
            )
        if not until <= end:
            raise ValueError(
                f"the mission ends at {plain(end)} s and cannot be advanced to {plain(until)} s; "
                "give an earlier instant, or lengthen duration_s"
            )
        self._refuse_failed()
        if until > self._time:
            with self._at_work():
                self._happen(until)
                if self.modems:
                    self._env.show(until)
                if until == end:
                    self._world.network.close(end)
                    self._world.auv_fleet.advance(end)
                    self._world.asv_fleet.advance(end)
                self._time = until
        return None

    def _advance_to_event(self, event: simpy.Event) -> Any:
        """Advance to the instant of an event, and return its value."""
        if event.env is not self._env:
            raise ValueError("the event is of another mission, which is to be advanced to it")
        from ..protocol.happenings import Happening

        self._refuse_failed()
        last = self._last_instant(self.scenario.duration_s)
        if self._time > last:  # the mission has ended, but a user's events may be to come
            return event.value if event.processed else None
        with self._at_work():
            while not event.processed and self._env.peek() <= last:
                self._env.happen_next()
            if event.processed:
                # the recorded instant may be later than the event's by a rounding error
                happened_s = event.value.time if isinstance(event.value, Happening) else 0.0
                self._time = min(max(self._time, self._env.now, happened_s), last)
                self._happen(self._time)
                return event.value
        self.advance(self.scenario.duration_s)
        return None

    def _refuse_failed(self) -> None:
        if self._has_failed:
            raise RuntimeError(
                f"the mission has ended with an error at {plain(self._time)} s; begin a new one"
            )

    def _happen(self, until: float) -> None:
        """Run all events up to an instant (s)."""
        self._env.happen(self._last_instant(until))

    def _last_instant(self, time: float) -> float:
        """Return the last instant (s), not after `time`, at which events may happen.

        Events before the mission's end by no more than a rounding error do not happen.
        """
        return min(time, self.scenario.duration_s * (1.0 - ROUNDING))

    @contextmanager
    def _at_work(self) -> Iterator[None]:
        """Count the time that the mission itself takes; after an error it cannot go on."""
        began = clock.perf_counter()
        try:
            yield
        except BaseException:
            self._has_failed, self._time = True, max(self._time, self._env.now)
            raise
        self._worked_s += clock.perf_counter() - began

    def auvs(self) -> AuvStates:
        """Return where the AUVs are now, their estimates and the covariances of these.

        The estimate includes every fix delivered by now, as in `tracks`.
        """
        from .world import wrapped

        world, now = self._world, np.array([self._time])
        world.network.deliveries.settle(self._last_instant(self._time))
        world.auv_fleet.advance(self._time)
        count = len(world.auv_fleet)
        states = AuvStates(np.empty((count, 4)), np.empty((count, 2)), np.empty((count, 2, 2)))
        for auv in range(count):
            found = world.sample(auv, now)
            states.truth[auv], states.estimate[auv] = found.way.truth[0], found.estimate[0]
            xx, yy, xy = world.navigator.covariance(auv, found.odometry)[0]
            states.covariance[auv] = (xx, xy), (xy, yy)
        states.truth[:, 3] = wrapped(states.truth[:, 3])
        return states

    def gnss_fixes(self, first: int = 0) -> list[GnssFix]:
        """Return the GNSS fixes that AUVs have made at the surface by now, from one on, `first`."""
        self._world.network.deliveries.settle(self._last_instant(self._time))
        rows = self._world.record.gnss_fixes.rows[first:]
        return [
            GnssFix(
                *(int(row[name]) for name in ("fix", "auv")),
                *(float(row[name]) for name in ("delivered_at_s", "x_m", "y_m", "sd_x_m")),
                *(float(row[name]) for name in ("error_m", "innovation_m", "correction_m", "nis")),
            )
            for row in rows
        ]

    def fleet_fixes(self) -> Floats:
        """Return the newest fix of each AUV that the surface fleet has made by now, delivered or
        not: x, y (m) and when its ping was sent (s), (n, 3); NaN before the first, and with passive
        ranging.
        """
        return self._world.network.outcomes.newest_fixes(self._last_instant(self._time))

    def asvs(self) -> Floats:
        """Return where the ASVs are now: x, y, z (m), z down, yaw (rad, in (-pi, pi]), (n, 4)."""
        from ..vehicles.motion import places
        from .world import wrapped

        fleet = self._world.asv_fleet
        fleet.advance(self._time)
        found = places(fleet.motion, self._time)
        found[:, 3] = wrapped(found[:, 3])
        return found

    def failed_asvs(self) -> tuple[int, ...]:
        """Return the numbers of ASVs that have failed by now."""
        return self._world.asv_fleet.failed(self._time)

    @property
    def modems(self) -> "Mapping[str, Modem]":
        """The modems of vehicles by their names, where the scenario has `modems`: `hear` takes a
        line of the host, and `on_say` is called with each line to it.
        """
        return self._world.network.modems

    def pings_under_way(self) -> list[PingUnderWay]:
        """Return the pings under way now, in the order in which they were sent.

        A ping is under way while it is being sent, and until its end has passed every ASV in range.
        Calls of `twtt` are not included.
        """
        from ..records.rows import NONE

        pings, band = self._world.record.pings.rows, self._world.network.uplink.band
        # an AUV that was called in vain does not ping
        silent = ~np.isin(pings["call"], (NONE, HEARD))
        sending = ~silent & (pings["sent_at_s"] + band.duration > self._time)
        passing = np.isfinite(pings["passed_at_s"]) & (pings["passed_at_s"] > self._time)
        found = pings[list(PingUnderWay._fields)][sending | passing].tolist()
        return [
            PingUnderWay(ping, None if auv == NONE else auv, sent_at, None if asv == NONE else asv)
            for ping, auv, sent_at, asv in found
        ]

    def broadcast_on_air(self) -> Broadcast | None:
        """Return the last of :meth:`broadcasts_on_air`, if any."""
        current = self.broadcasts_on_air()
        return current[-1] if current else None

    def broadcasts_on_air(self) -> list[Broadcast]:
        """Return the frames that are on the air now.

        A frame is on the air while its ASV (a row of `asvs`) sends it; there are several where ASVs
        broadcast at once (`parallel`, `direct_reply`).  Instant answers take no time.
        """
        return [
            replace(frame)
            for frame in self._world.record.broadcasts
            if self._time < frame.sent_at_s + frame.airtime_s
        ]

    def result(self) -> "Result":
        """Run to the end; return what happened, a table for each kind of event.

        Raises:
            RuntimeError: when the mission has ended with an error before.
        """
        self.advance(self.scenario.duration_s)
        return self._result

    @cached_property
    def _result(self) -> "Result":
        from ..results.result import Result
        from ..results.tables import from_numbers, from_row
        from .metrics import metrics_of
        from .tables import event_tables, violations_of

        world = self._world
        with self._at_work():
            tables = event_tables(world)
            auvs, whole = metrics_of(world)
            tables["auvs"] = from_numbers("auvs", auvs)
            tables["mission"] = from_row("mission", whole)
            broken = violations_of(world)
        result = Result(
            self.scenario, self.seed, tables, self._worked_s, notes=self._notes(), violations=broken
        )
        result.navigator = self.navigator
        return result

    def _notes(self) -> "list[ScenarioWarning]":
        """Return a warning for each fleet that another program moved."""
        moved = self._world.auv_fleet.poses or self._world.asv_fleet.poses
        if moved is None:
            return []
        from ...support.mistakes import ScenarioWarning

        return [ScenarioWarning(f"{kind}.vehicle", moved.described) for kind in moved.kinds]

"""What a schedule is asked with, and what it may answer: ping groups, with slots of any length.

What the surface fleet knows of how well its AUVs know where they are goes by the fixes that it has
made and broadcast, and by how dead reckoning is planned to drift (section navigation).  It sees no
estimate, no truth, and not whether an AUV has decoded a frame.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from ...support.arrays import Flags, Floats, Ints
from ...support.facts import cached_property
from ..records.rows import Recorder, Rows
from ..scenario.own_sensors import Sensors
from ..vehicles.fleet import VehicleFleet
from .acknowledged import Acknowledged, known_by
from .conflicts import conflict_graph
from .predicted_positions import planned_speeds
from .slots import Slots

if TYPE_CHECKING:
    import networkx as nx

Groups = Sequence[Sequence[int]]


@dataclass(frozen=True)
class Plans:
    """What is planned for AUVs, as far as it tells how wrong the fleet may be.

    How well each knows its start (m, per axis); its speed (m/s), (n,), and that at which it and an
    ASV may come nearer to each other; the drift (m, RMS) of an AUV, by number, in a time (s)
    without fixes; and where it is believed to be, as of `protocol.positions`.
    """

    initial_sd_m: float
    speeds_m_per_s: Floats
    range_rates_m_per_s: Floats
    drift: Callable[[int, float], float]
    positions: str


class KnownFixes:
    """The last fix of each AUV that was broadcast, and the turns that it was given since.

    Nothing is worked out before somebody asks.
    """

    def __init__(self, record: Recorder, plans: Plans) -> None:
        self._record, self._plans = record, plans
        self.range_rates_m_per_s = plans.range_rates_m_per_s
        auvs, initial_sd_m = len(plans.speeds_m_per_s), plans.initial_sd_m
        self._pinged_at, self._pinged = np.zeros(auvs), np.full(auvs, -1)  # for the last fix
        self._variance = np.full(auvs, 2.0 * initial_sd_m**2)
        self._fixed = np.full(auvs, 0.0)  # variances (m2) of the last fixes, where AUVs are plotted
        self._turns: list[list[int]] = [[] for _ in range(auvs)]  # rounds since then
        self._is_asked = False  # whether the schedule of this round goes by them
        self._fixes = 0  # of these rows account has been taken

    def since_s(self, time: float) -> Floats:
        """Return how long before an instant (s) each AUV sent the ping of its last fix, (n,)."""
        self._note()
        return np.asarray(time - self._pinged_at)

    def expected_error_m(self, time: float) -> Floats:
        """Return the RMS of the horizontal error (m) expected of each AUV at an instant (s), (n,).

        Variances of drift add up, those of fixes are weighed with them (:func:`weighed`).
        """
        since = self.since_s(time)
        drift = self._plans.drift
        drifted = [drift(auv, max(age, 0.0)) for auv, age in enumerate(since.tolist())]
        return np.asarray(np.sqrt(self._variance + np.square(drifted)))

    def misplaced_m(self, time: float, sds: float) -> Floats:
        """Return how far (m) AUVs may be from where they are believed at an instant (s), (n,).

        Where the last fixes are plotted: by so many standard deviations of them, and the way since.
        Where these are carried forward, AUVs are off their plans by what they err by themselves,
        too.
        """
        if self._plans.positions == "truth":
            return np.zeros(len(self._variance))
        if self._plans.positions == "carried_forward":
            return np.asarray(sds * np.sqrt(self._fixed + self.expected_error_m(time) ** 2))
        way = self._plans.speeds_m_per_s * self.since_s(time)
        return np.asarray(sds * np.sqrt(self._fixed) + way)

    def turns_in_vain(self) -> Ints:
        """Return how many turns each AUV was given since that of its last fix, (n,)."""
        self._note()
        self._is_asked = True
        return np.array([len(turns) for turns in self._turns], dtype=np.int64)

    def give_turns(self, groups: Groups, heard: Flags, number: int) -> None:
        """Note who has a turn in a round, by its number, and is `heard` (n, m), if its schedule
        asks for that.  Whether AUVs know of their turn and ping, the fleet cannot tell.
        """
        for group in groups if self._is_asked else ():
            for auv in group:
                if heard[auv].any():
                    self._turns[auv].append(number)
        self._is_asked = False

    def _note(self) -> None:
        """Take account of the fixes that were broadcast meanwhile."""
        fixes = self._record.fixes.rows[self._fixes :]
        broadcast = np.isfinite(fixes["broadcast_at_s"])
        for fix in fixes[broadcast]:
            self._note_fix(fix)
        self._fixes += len(fixes) if broadcast.all() else int(broadcast.argmin())

    def _note_fix(self, fix: Rows) -> None:
        auv = int(fix["auv"])
        if fix["ping"] > self._pinged[auv]:  # one sent before older ones is met again
            self._pinged[auv] = fix["ping"]
            since = float(fix["pinged_at_s"]) - self._pinged_at[auv]
            drifted = self._variance[auv] + self._plans.drift(auv, since) ** 2
            self._variance[auv] = weighed(drifted, fix["sd_x_m"] ** 2 + fix["sd_y_m"] ** 2)
            self._fixed[auv] = fix["sd_x_m"] ** 2 + fix["sd_y_m"] ** 2
            self._pinged_at[auv] = fix["pinged_at_s"]
            self._turns[auv] = [turn for turn in self._turns[auv] if turn > fix["round"]]


def weighed(drifted: float, fix: float) -> float:
    """Return what variance (m2) is left of one that has drifted when a fix of another is weighed
    with it: the inverses add up.

    >>> weighed(4.0, 4.0), weighed(0.0, 1.0)
    (2.0, 0.0)
    """
    return drifted * fix / (drifted + fix) if drifted > 0.0 else 0.0


def known_of(setup: Sensors, auvs: VehicleFleet, record: Recorder) -> KnownFixes:
    """Return what a fleet will know of its AUVs' estimates and places, by what it has planned."""
    scenario = setup.scenario
    speeds, water = planned_speeds(setup, auvs), scenario.environment
    carried = 0.0
    if scenario.auvs.vehicle.has_dynamics:
        carried = water.current_m_per_s + 3.0 * water.current_variation_m_per_s
    placed = scenario.asvs.formation.replanned
    vessels = placed.speed_m_per_s if placed is not None else 0.0

    def drift(auv: int, time: float) -> float:
        return setup.own_sensors.straight_drift_rms(time, float(speeds[auv]))

    initial, positions = scenario.navigation.initial_position_sd_m, setup.positions
    moving = speeds + carried
    return KnownFixes(record, Plans(initial, moving, moving + vessels, drift, positions))


class TimedGroups(tuple[Sequence[int], ...]):
    """Ping groups whose slots last as long as they say: `lengths_s` (s), one for each group.

    >>> TimedGroups([[0], [2, 1]], [0.1, 0.25]).lengths_s
    (0.1, 0.25)
    """

    lengths_s: tuple[float, ...]

    def __new__(cls, groups: Groups, lengths_s: Iterable[float]) -> "TimedGroups":
        made = super().__new__(cls, groups)
        made.lengths_s = tuple(lengths_s)
        return made


@dataclass
class View:
    """What the surface fleet knows when it schedules a round.

    `round` is its number, `time` (s) when it begins.  `auvs` (n, 3) are the AUV positions it
    believes and `asvs` (m, 3) its own (m); `heard` (n, m) tells which ASVs each AUV is within HF
    range and `protocol.conflict_margin_m` of, `hf_range` (m) and `range_metric` (horizontal or
    slant) what that range is; `random` is a stream of the schedule's own.  `failed` are the ASVs
    that have failed, which hear nobody, and `lost` AUVs that nobody counts on.  The round begins up
    to `ahead_s` (s) later, where frames have to tell of it first.  `conflicts` is the conflict
    graph of the AUVs, and `slots` what the protocol's slots are made of.  What it knows of each AUV
    is worked out when it is asked for: of its estimate `since_s`, `expected_error_m` and
    `turns_in_vain`, of its place `misplaced_m` and `range_rates_m_per_s`, of what it is known to
    have `acknowledged_at_s` and `acknowledged_ping_s`.
    """

    round: int
    time: float
    auvs: Floats
    asvs: Floats
    heard: Flags
    hf_range: float
    range_metric: str
    random: np.random.Generator
    failed: tuple[int, ...] = ()
    slots: Slots | None = None
    known: KnownFixes | None = field(default=None, repr=False)
    lost: tuple[int, ...] = ()
    ahead_s: float = 0.0
    acknowledged: Acknowledged | None = field(default=None, repr=False)

    @cached_property
    def conflicts(self) -> "nx.Graph[int]":
        """The conflict graph; of a large fleet it is large, so only made when asked for."""
        return conflict_graph(self.heard)

    @cached_property
    def since_s(self) -> Floats:
        """How long (s) ago each AUV sent the ping of the last fix that was broadcast for it; since
        the start of the mission where there was none, shape (n,).
        """
        return self._known.since_s(self.time)

    @cached_property
    def expected_error_m(self) -> Floats:
        """How wrong (m, RMS) each AUV's estimate is expected to be: as its last fix was, and what
        dead reckoning has drifted by on a straight way since, shape (n,).
        """
        return self._known.expected_error_m(self.time)

    @cached_property
    def turns_in_vain(self) -> Ints:
        """How many turns each AUV has been given since then where an ASV was believed to hear it,
        none of which made a fix that was broadcast, shape (n,); of rounds whose view was asked.
        """
        return self._known.turns_in_vain()

    @cached_property
    def range_rates_m_per_s(self) -> Floats:
        """How fast (m/s) each AUV and an ASV may come nearer to each other, or go apart, (n,)."""
        return self._known.range_rates_m_per_s

    @cached_property
    def acknowledged_at_s(self) -> Floats:
        """Since when (s) the fleet knows of each AUV's newest fix that it knows to be delivered,
        shape (n,), NaN before the first.

        Raises:
            LookupError: where AUVs do not acknowledge (`protocol.acknowledge`).
        """
        return known_by(self.acknowledged).at_s

    @cached_property
    def acknowledged_ping_s(self) -> Floats:
        """When (s) each AUV sent the ping of that fix, shape (n,); errors as of
        `acknowledged_at_s`.
        """
        return known_by(self.acknowledged).pinged_at_s

    def misplaced_m(self, sds: float) -> Floats:
        """Return how far (m) each AUV may be from where it is believed, (n,), by so many standard
        deviations of fixes: nothing with `positions: truth`.
        """
        return self._known.misplaced_m(self.time, sds)

    def may_hear(self, margins: Floats) -> Flags:
        """Return which ASVs may hear each AUV, (n, m), that is up to so much, `margins` (n,), m,
        nearer than it is believed to be.
        """
        axes = 3 if self.range_metric == "slant" else 2
        away = np.linalg.norm(self.auvs[:, None, :axes] - self.asvs[None, :, :axes], axis=2)
        near: Flags = away <= self.hf_range + margins[:, None]
        near[:, list(self.failed)] = False
        near[list(self.lost)] = False
        return near | self.heard

    @property
    def _known(self) -> KnownFixes:
        if self.known is None:
            raise LookupError(
                "this view was made by hand, without a mission: give it a `known`, "
                "or set view.since_s, view.expected_error_m or view.turns_in_vain"
            )
        return self.known


# Who pings when: a schedule is a function from what the fleet knows to ping groups.
Schedule = Callable[[View], Groups]

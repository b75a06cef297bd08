"""What a schedule is asked with and may return: ping groups, with slots of any length.

The surface fleet judges how well its AUVs know their positions by the fixes that it has made and
broadcast, and by the drift that the section navigation predicts for dead reckoning.  It sees no
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
from .conflicts import GROUPINGS, conflict_graph
from .predicted_positions import planned_speeds
from .slots import Slots

if TYPE_CHECKING:
    import networkx as nx

Groups = Sequence[Sequence[int]]


@dataclass(frozen=True)
class Plans:
    """What is planned for AUVs, as far as it tells how wrong the fleet may be.

    The standard deviation of each AUV's start (m, per axis); its speed (m/s), (n,); the fastest
    rate at which its distance to an ASV may change (m/s), (n,); the drift (m, RMS) of an AUV, by
    number, in a time (s) without fixes; and the key `protocol.positions`.
    """

    initial_sd_m: float
    speeds_m_per_s: Floats
    range_rates_m_per_s: Floats
    drift: Callable[[int, float], float]
    positions: str


class KnownFixes:
    """The last fix of each AUV that was broadcast, and the AUV's turns since then.

    All of it is worked out when it is asked for.
    """

    def __init__(self, record: Recorder, plans: Plans) -> None:
        self._record, self._plans = record, plans
        self.range_rates_m_per_s = plans.range_rates_m_per_s
        auvs, initial_sd_m = len(plans.speeds_m_per_s), plans.initial_sd_m
        self._pinged_at, self._pinged = np.zeros(auvs), np.full(auvs, -1)  # of the last fixes
        self._variance = np.full(auvs, 2.0 * initial_sd_m**2)
        self._fixed = np.full(auvs, 0.0)  # variances (m2) of the last fixes, where AUVs are plotted
        self._turns: list[list[int]] = [[] for _ in range(auvs)]  # their rounds since then
        self._is_asked = False  # whether the schedule of this round uses the turns
        self._fixes = 0  # rows of fixes before this one are noted

    def since_s(self, time: float) -> Floats:
        """Return the age (s) of each AUV's last fix at an instant (s), from its ping on, (n,)."""
        self._note()
        return np.asarray(time - self._pinged_at)

    def expected_error_m(self, time: float) -> Floats:
        """Return the expected RMS horizontal error (m) of each estimate at an instant (s), (n,).

        The variances of drift add up; a fix reduces the sum (:func:`weighed`).
        """
        drifted = self.drifted_m2(self.since_s(time)[:, None])[:, 0]
        return np.asarray(np.sqrt(self._variance + drifted))

    @property
    def left_m2(self) -> Floats:
        """The variance (m2) of each estimate, both axes together, that its last fix left, (n,)."""
        self._note()
        return self._variance.copy()

    def drifted_m2(self, ages: Floats) -> Floats:
        """Return the squared drift (m2) of AUVs in times (n, k), s, without fixes, shape (n, k)."""
        drift = self._plans.drift
        rows = [[drift(auv, max(age, 0.0)) for age in row] for auv, row in enumerate(ages.tolist())]
        return np.square(rows)

    def misplaced_m(self, time: float, sds: float) -> Floats:
        """Return how far (m) AUVs may be from their believed positions at `time` (s), (n,).

        With `last_fix` that is `sds` standard deviations of the last fix, and the distance
        travelled since. With `carried_forward` the fleet moves AUVs on by plan, and the error of
        their own estimates, by which they steer, is added to the fix's.
        """
        if self._plans.positions == "truth":
            return np.zeros(len(self._variance))
        if self._plans.positions == "carried_forward":
            return np.asarray(sds * np.sqrt(self._fixed + self.expected_error_m(time) ** 2))
        way = self._plans.speeds_m_per_s * self.since_s(time)
        return np.asarray(sds * np.sqrt(self._fixed) + way)

    def turns_in_vain(self) -> Ints:
        """Return the number of turns that each AUV has had since the turn of its last fix, (n,)."""
        self._note()
        self._is_asked = True
        return np.array([len(turns) for turns in self._turns], dtype=np.int64)

    def give_turns(self, groups: Groups, heard: Flags, number: int) -> None:
        """Note the turns of round `number`, if its schedule has asked for turns: those of AUVs that
        an ASV is believed to hear, `heard` (n, m).  Whether they ping, the fleet cannot tell.
        """
        for group in groups if self._is_asked else ():
            for auv in group:
                if heard[auv].any():
                    self._turns[auv].append(number)
        self._is_asked = False

    def _note(self) -> None:
        """Take in the fixes that were broadcast since the last call."""
        fixes = self._record.fixes.rows[self._fixes :]
        broadcast = np.isfinite(fixes["broadcast_at_s"])
        for fix in fixes[broadcast]:
            self._note_fix(fix)
        self._fixes += len(fixes) if broadcast.all() else int(broadcast.argmin())

    def _note_fix(self, fix: Rows) -> None:
        auv = int(fix["auv"])
        if fix["ping"] > self._pinged[auv]:  # newer than the last: rows may come again
            self._pinged[auv] = fix["ping"]
            since = float(fix["pinged_at_s"]) - self._pinged_at[auv]
            drifted = self._variance[auv] + self._plans.drift(auv, since) ** 2
            self._variance[auv] = weighed(drifted, fix["sd_x_m"] ** 2 + fix["sd_y_m"] ** 2)
            self._fixed[auv] = fix["sd_x_m"] ** 2 + fix["sd_y_m"] ** 2
            self._pinged_at[auv] = fix["pinged_at_s"]
            self._turns[auv] = [turn for turn in self._turns[auv] if turn > fix["round"]]


def weighed(drifted: float, fix: float) -> float:
    """Return the variance (m2) of an estimate of variance `drifted` (m2) once a fix of variance
    `fix` (m2) has corrected it: their inverses add up.

    >>> weighed(4.0, 4.0), weighed(0.0, 1.0)
    (2.0, 0.0)
    """
    return drifted * fix / (drifted + fix) if drifted > 0.0 else 0.0


def known_of(setup: Sensors, auvs: VehicleFleet, record: Recorder) -> KnownFixes:
    """Return the :class:`KnownFixes` of a new mission, with the planned speeds and drift."""
    scenario = setup.scenario
    speeds, water = planned_speeds(setup, auvs), scenario.environment
    carried = np.array([auv.group.vehicle.has_dynamics for auv in setup.auvs]) * (
        water.current_m_per_s + 3.0 * water.current_variation_m_per_s + setup.flow.limit_m_per_s
    )
    placed = scenario.asvs.formation.replanned
    vessels = placed.speed_m_per_s if placed is not None else 0.0

    def drift(auv: int, time: float) -> float:
        return setup.sensors[auv].straight_drift_rms(time, float(speeds[auv]))

    initial, positions = scenario.navigation.initial_position_sd_m, setup.positions
    moving = speeds + carried
    return KnownFixes(record, Plans(initial, moving, moving + vessels, drift, positions))


class TimedGroups(tuple[Sequence[int], ...]):
    """Ping groups whose slots last `lengths_s` (s), one for each group.

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

    `round` is its number, `time` (s) when it begins.  `auvs` (n, 3) are the AUVs' believed
    positions and `asvs` (m, 3) the ASVs' (m); `heard` (n, m) tells which ASVs each AUV is within HF
    range and `protocol.conflict_margin_m` of, `hf_range` (m) and `range_metric` (horizontal or
    slant) describe that range; `random` is the schedule's own random stream.  `failed` are the ASVs
    that have failed, which hear no AUV, and `lost` the AUVs that the fleet no longer expects to
    hear.  The round begins up to `ahead_s` (s) later, where frames have to announce it first.
    `conflicts` is the conflict graph of the AUVs, and `slots` has the protocol's durations.  The
    rest is worked out when it is asked for: of each AUV's estimate `since_s`, `expected_error_m`
    and `turns_in_vain`, of its position `misplaced_m` and `range_rates_m_per_s`, of its newest
    acknowledged fix `acknowledged_at_s` and `acknowledged_ping_s`.
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
        """The conflict graph, made when it is asked for: a large fleet's is large."""
        return conflict_graph(self.heard)

    def grouped(self, grouping: str) -> Groups:
        """Return ping groups by one of :data:`.conflicts.GROUPINGS`, such as `first_fit`."""
        return GROUPINGS[grouping](self.heard)

    @cached_property
    def since_s(self) -> Floats:
        """Age (s) of each AUV's last broadcast fix, since its ping was sent; since the start of the
        mission before the first fix; shape (n,).
        """
        return self._known.since_s(self.time)

    @cached_property
    def expected_error_m(self) -> Floats:
        """Expected error (m, RMS) of each AUV's estimate: the error of its last fix, and the drift
        of dead reckoning on a straight path since, shape (n,).
        """
        return self._known.expected_error_m(self.time)

    @cached_property
    def turns_in_vain(self) -> Ints:
        """Number of turns without a broadcast fix of each AUV since the turn of its last fix, (n,).
        A turn counts if an ASV was believed to hear the AUV and that round's schedule asked for
        this.
        """
        return self._known.turns_in_vain()

    @cached_property
    def range_rates_m_per_s(self) -> Floats:
        """Fastest rate (m/s) at which the distance of each AUV to an ASV may change, (n,)."""
        return self._known.range_rates_m_per_s

    @cached_property
    def acknowledged_at_s(self) -> Floats:
        """Since when (s) the fleet has known that each AUV has its newest acknowledged fix, shape
        (n,); NaN before the first.

        Raises:
            LookupError: where AUVs do not acknowledge (`protocol.acknowledge`).
        """
        return known_by(self.acknowledged).at_s

    @cached_property
    def acknowledged_ping_s(self) -> Floats:
        """When (s) each AUV sent the ping of its newest acknowledged fix, shape (n,); NaN before
        the first. Errors as of `acknowledged_at_s`.
        """
        return known_by(self.acknowledged).pinged_at_s

    def misplaced_m(self, sds: float) -> Floats:
        """Return how far (m) each AUV may be from its believed position, (n,), by `sds` standard
        deviations of fixes (:meth:`KnownFixes.misplaced_m`): 0 with `positions: truth`.
        """
        return self._known.misplaced_m(self.time, sds)

    def may_hear(self, margins: Floats) -> Flags:
        """Return which ASVs may hear each AUV, (n, m), if it is nearer by up to `margins` (n,), m,
        than it is believed to be.
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


# A schedule is a function from what the fleet knows to ping groups.
Schedule = Callable[[View], Groups]

"""AUVs that correct each other by measurements of each other, with correlations taken into account.

Theory of operation
-------------------
An AUV that measures the range or direction of a peer learns about its own position as much as the
measurement tells, less the uncertainty of the peer's.  Beliefs are those of :mod:`.belief`;
:class:`Joint` combines the beliefs of several AUVs with their correlations; it is carried and
corrected like a single one (:mod:`.correcting`).

`centralised`: one belief about all AUVs, which gets every fix as it is delivered and every
measurement as it is decoded.  It is the bound: no team of this fleet knows more.

`intersection`: each AUV has a belief of its own, and messages carry positions with covariances.
Two AUVs' knowledge has partly the same origin, to an unknown extent.  So each AUV splits its
covariance P into a part D that others may have, too, and the rest, which no other has.  A message
makes the sender's position, and what is correlated with it, common knowledge:

    D <- D + I_xp I_pp^-1 I_px,    I = P - D,  p the position, x all states

(the remaining I is uncorrelated with all that was sent).  An AUV that decodes the message takes

    P' = D / w + I,    D_j' = D_j / (1 - w)     for its own and the sender's share, 0 < w <= 1

which is not overconfident whatever both have in common; w minimises the result.  What the AUV then
knows by the sender is common from then on.  Errors that all AUVs have from the start (a current, an
ASV's array, a bias that is known for all) are common at once.

raw (`share`): messages carry measurements, all that the sender has, so that the next message makes
a lost one good.  Each AUV has a belief about all AUVs, from the measurements that have reached it:
the result of `centralised` for these.

`naive` treats a message as independent: the same without D. It is there for comparison.

Sources: S. J. Julier, J. K. Uhlmann, A Non-divergent Estimation Algorithm in the Presence of
Unknown Correlations, ACC 1997 (covariance intersection; split: General Decentralized Data Fusion
with Covariance Intersection, Handbook of Data Fusion, 2001); L. C. Carrillo-Arce, E. D. Nerurkar,
J. L. Gordillo, S. I. Roumeliotis, Decentralized multi-robot cooperative localization using
covariance intersection, IROS 2013.
"""

from collections.abc import Iterator
from math import atan2, exp, hypot, isnan, nan, sqrt
from statistics import NormalDist
from typing import Any, NamedTuple

import numpy as np

from ...support.arrays import Floats, Ints
from ..records.rows import FIX, NONE, EventBuffer, Jacobians, Rows
from ..vehicles.reckoning import DeadReckoned, expected_error, way_since
from .belief import STATES, Belief, Beliefs, Growths, expected, growth_of
from .correcting import REMEMBERED, TeamBelief, apply_team_fix, carry_team, error_at, hold
from .dead_reckoning import DeadReckoning
from .fix_update import Noise, Rule, take
from .navigators import LinearNavigator
from .smoothing import transition

# Factor on the number of stored measurements where messages carry them
MANY = 16

# Values of w that are tried: AUVs mostly have little in common, or nearly all.
SHARES = np.array((0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.98, 0.995))


class SentBelief(NamedTuple):
    """What an AUV's message says of it: its estimated position (2,), m, as it began to send (s),
    the covariance (2, 2), m2, and the part of that which others may have as well.  With raw
    messages: its measurements, the first `known` of its log.
    """

    sent_at_s: float
    place: Floats
    spread: Floats
    shared: Floats
    known: int


class PeerErrors(NamedTuple):
    """Standard deviations of errors of each AUV's own in measurements between AUVs: its clock's (s,
    s/s) and the misalignment of its array (rad); 0: none, or unknown to the filter.
    """

    clock_offset_sd_s: float
    clock_drift_sd: float
    turn_sd_rad: float


class PeerSight(NamedTuple):
    """An AUV's measurement of a sender, when it arrived and was decoded (s), and the message.

    A range (m) is the mean over paths between both: direct, and for a call also back, where the
    offset between the two differs by `legs` (n, 2), m.  A bearing (rad, from x towards y), and the
    angle (rad) downwards to the sender.  The sender's depth minus the AUV's (m).  Each has its
    variance; NaN: not measured.
    """

    auv: int
    sender: int
    valid_at_s: float
    heard_at_s: float
    told: SentBelief
    range_m: float
    range_m2: float
    bearing_rad: float
    bearing_rad2: float
    steep_rad: float
    steep_rad2: float
    deeper_m: float
    deeper_m2: float
    legs: Floats


class Outcome(NamedTuple):
    """The outcome of a measurement: its innovation (m, or its own unit), its NIS, whether it was
    accepted, and the share w.
    """

    off: float
    nis: float
    is_taken: bool
    share: float = nan


class Common(NamedTuple):
    """What all AUVs of a fleet have in common: variances of the states (k,), and whether each is
    driven by the same noise in all (k,).
    """

    variances: Floats
    driven: Floats


class FixOf(NamedTuple):
    """A fix of an AUV, by its number as of :func:`..records.rows.fix_numbered`."""

    auv: int
    number: int


class SharedAt(NamedTuple):
    """The event that an AUV sends its belief to all others."""

    auv: int


Event = FixOf | SharedAt | PeerSight


class Team(LinearNavigator):
    """Kalman navigators of AUVs that range each other; `fusion` as of the module."""

    def __init__(
        self, reckoning: DeadReckoning, rule: Rule, growths: Growths, first: Beliefs,
        corrections: Floats, learnt: Rows, common: Jacobians, receptions: EventBuffer,
        gnss: EventBuffer, *, fusion: str, raw: bool, fleet: Common, errors: PeerErrors,
        every_s: float, sound_speed: float, columns: dict[str, int],
    ) -> None:  # fmt: skip
        """Take the arguments of :class:`LinearNavigator`; whether messages carry measurements
        (`raw`), what AUVs have in common (`fleet`), their own `errors`, the interval (s) of
        messages, the assumed sound speed (m/s), and at which index of the errors in common `clock`
        and `sound_speed` begin, if they are states.
        """
        super().__init__(
            reckoning, rule, growths, first, corrections, learnt, common, receptions, gnss
        )
        self.reckoning, self.rule, self.growths = reckoning, rule, growths
        self.count, self.size = len(corrections), first.states.shape[1]
        growth = growth_of(growths, 0)
        #: The growth by noise that all have in common.
        self.alike = growth._replace(
            walk=0.0, wander=growth.wander * fleet.driven[4], wandering=0,
            sds=growth.sds * fleet.driven[STATES:], step=float(growths.steps.min()),
        )  # fmt: skip
        self.fleet, self.errors, self.every_s, self.columns = fleet, errors, every_s, columns
        self.sound_speed, self.fixes = sound_speed, np.zeros(0, FIX)
        self._drs: dict[tuple[int, float], DeadReckoned] = {}
        begun, everybody = self._held.all.beliefs, list(range(self.count))
        is_one = fusion == "centralised" and not raw
        joints = [
            Joint(
                self, everybody if is_one or raw else [auv], begun,
                splits=fusion == "intersection" and not raw, depth=MANY if raw else 1,
            )
            for auv in everybody[: 1 if is_one else self.count]
        ]  # fmt: skip
        #: The belief that each AUV uses; `centralised` has one for all.
        self._of = {auv: joints[0 if is_one else auv] for auv in everybody}
        self.raw, self._whose = raw, everybody if is_one else None
        self._read: dict[tuple[int, int], int] = {}  # by reader and sender: entries read of its log

    def dr(self, auv: int, time: float) -> DeadReckoned:
        """Return an AUV's dead reckoning at an instant (s)."""
        key = auv, time
        if key not in self._drs:
            if len(self._drs) > 4096:
                self._drs.clear()
            odometry = self.reckoning.sample(auv, np.array([time]))[1]
            self._drs[key] = DeadReckoned(
                time, *odometry.position[0].tolist(), *odometry.headings[0].tolist()
            )
        return self._drs[key]

    def row(self, number: int) -> Rows:
        """Return the row (1,) of a fix, by its number as of :func:`..records.rows.fix_numbered`."""
        rows, at = (self.fixes, number) if number >= 0 else (self.gnss.array, -1 - number)
        return rows[at : at + 1]

    def correct(self, fixes: Rows, due: Ints) -> None:
        """Apply the fixes in rows `due` (k,); write innovation, NIS and correction (m)."""
        self.fixes = fixes
        for number in due.tolist():
            fix = self.row(number)
            auv, now = int(fix["auv"][0]), float(fix["delivered_at_s"][0])
            event = float(fix["valid_at_s"][0]), FixOf(auv, number)
            moved, outcome = self._insert(auv, now, event)
            fix["innovation_m"], fix["nis"] = outcome.off, outcome.nis
            fix["correction_m"] = moved if outcome.is_taken else nan

    def apply_peer(self, sight: PeerSight) -> tuple[float, Outcome]:
        """Apply an AUV's measurement of another; return its estimate's move (m), and the
        outcome.
        """
        auv, sender, log = sight.auv, sight.sender, self._of[sight.sender].log
        begin = self._read.get((auv, sender), 0)
        self._read[auv, sender] = max(sight.told.known, begin)
        return self._insert(
            auv, sight.heard_at_s, *log[begin : sight.told.known], (sight.valid_at_s, sight)
        )

    def belief_to_send(self, auv: int, time: float) -> SentBelief:
        """Return the belief that an AUV sends to all others at `time` (s), common from then on."""
        return self._of[auv].tell(auv, time)

    def _insert(self, auv: int, now: float, *events: tuple[float, Event]) -> tuple[float, Outcome]:
        """Apply measurements, each with the instant (s) at which it holds; return how far (m) the
        estimate moved, and the outcome of the last.
        """
        joint, whose, address = self._of[auv], self._whose or [auv], self._known.address
        dr = self.dr(auv, now)
        was = error_at(dr, auv, joint.belief(auv), address)
        outcome = joint.insert(*events)
        is_now = error_at(dr, auv, joint.belief(auv), address)
        self._held.make_room(len(whose), self._known)
        for member in whose:
            hold(address, self._held.count, member, now, joint.belief(member))
            self._held.count += 1
        return hypot(is_now[0] - was[0], is_now[1] - was[1]), outcome


class Joint:
    """A belief about several AUVs, and stored measurements, among which late ones are inserted."""

    def __init__(
        self, team: Team, members: list[int], begun: Any, *, splits: bool, depth: int
    ) -> None:
        """Begin with the beliefs `begun` of all AUVs; `splits`: D is tracked.

        `depth` times as many measurements are stored as of fixes alone.
        """
        self.team, self.members, self._splits = team, members, splits
        self._place = {auv: number for number, auv in enumerate(members)}
        n, k, sds = len(members), team.size, team.errors
        #: Indices at which the AUVs' clocks (s, s/s) and misalignments (rad) begin, or NONE.
        self._clock, self._turn, sizes = NONE, NONE, list[float]()
        at = n * k
        if sds.clock_offset_sd_s or sds.clock_drift_sd:
            self._clock, at = at, at + 2 * team.count
            sizes += [sds.clock_offset_sd_s**2, sds.clock_drift_sd**2] * team.count
        if sds.turn_sd_rad:
            self._turn, at = at, at + team.count
            sizes += [sds.turn_sd_rad**2] * team.count
        spread = np.zeros((at, at))
        spread[range(n * k, at), range(n * k, at)] = sizes
        shared = np.zeros((at * splits, at * splits))
        together = np.diag(team.fleet.variances)
        for a, auv in enumerate(members):
            spread[self._block(a), self._block(a)] = begun.covariances[auv]
            for b in range(a):
                spread[self._block(a), self._block(b)] = together
                spread[self._block(b), self._block(a)] = together
            if splits:
                shared[self._block(a), self._block(a)] = together
        states = np.concatenate([*(begun.states[auv] for auv in members), np.zeros(at - n * k)])
        belief = Belief(begun.moments[members].copy(), states, spread)
        self._now = TeamBelief(np.array(members), belief, shared)
        self._events: list[tuple[float, Event]] = []
        self._before: list[TeamBelief] = []
        self._most = REMEMBERED * n * (1 + splits) * depth
        #: All measurements so far, in the order of their arrival.
        self.log: list[tuple[float, Event]] = []
        self._have: set[tuple[str, int, int, float]] = set()

    def _block(self, member: int) -> slice:
        return slice(member * self.team.size, (member + 1) * self.team.size)

    def belief(self, auv: int, state: TeamBelief | None = None) -> Belief:
        """Return a copy of the belief about one AUV, after the last measurement or of a `state`."""
        (moments, states, spread), a = (state or self._now).belief, self._place[auv]
        own = self._block(a)
        return Belief(moments[a : a + 1].copy(), states[own].copy(), spread[own, own].copy())

    def tell(self, auv: int, time: float) -> SentBelief:
        """Return the belief about an AUV's position at an instant (s), and mark it as sent."""
        state = _copied(self._now)
        self._carry(state, time)
        own, a = self._place_of(state, auv), self._place[auv]
        at = slice(a * self.team.size, a * self.team.size + 2)
        spread = state.belief.covariance[at, at].copy()
        shared = state.shared[at, at].copy() if self._splits else np.zeros((2, 2))
        if self._splits:
            self.insert((time, SharedAt(auv)))
        return SentBelief(time, own, spread, shared, len(self.log) * self.team.raw)

    def _place_of(self, state: TeamBelief, auv: int) -> Floats:
        """Return an AUV's estimated position (2,), m, at the instant of a state."""
        moments, states, _ = state.belief
        dr = self.team.dr(auv, float(moments["at_s"][0]))
        return np.array((dr.x, dr.y)) - states[self._block(self._place[auv])][:2]

    def insert(self, *events: tuple[float, Event]) -> Outcome:
        """Insert measurements at their instants (s), and apply them and all later ones; one older
        than all stored is too late, and a known one is left out.  Return the outcome of the last.
        """
        first, last = len(self._events), events[-1][1]
        for time, event in events:
            if (key := _key(time, event)) in self._have:
                continue
            self._have.add(key)
            self.log.append((time, event))
            place = len(self._events)
            while place > 0 and self._events[place - 1][0] > time:
                place -= 1
            if place > 0 or len(self._events) < self._most:
                self._events.insert(place, (time, event))
                first = min(first, place)
        state = _copied(self._before[first]) if first < len(self._before) else self._now
        del self._before[first:]
        outcome = Outcome(nan, nan, False)
        for time, event in self._events[first:]:
            self._before.append(_copied(state))
            self._carry(state, time)
            found = self._apply(state, event)
            outcome = found if event is last else outcome
        self._now = state
        over = max(len(self._events) - self._most, 0)
        del self._events[:over], self._before[:over]
        return outcome

    def _carry(self, state: TeamBelief, time: float) -> None:
        """Carry a belief, in place, to a later instant (s)."""
        carry_team(self.team._known.address, state, time, self.team.alike)

    def _apply(self, state: TeamBelief, event: Event) -> Outcome:
        if isinstance(event, SharedAt):
            return self._share(state, event.auv)
        if isinstance(event, FixOf):
            return self._fix(state, event)
        return self._peer(state, event)

    def _share(self, state: TeamBelief, auv: int) -> Outcome:
        """Mark an AUV's position, and what is correlated with it, as common knowledge."""
        own = state.belief.covariance - state.shared
        at = slice(self._place[auv] * self.team.size, self._place[auv] * self.team.size + 2)
        goes_with = own[:, at]
        state.shared[:] += goes_with @ np.linalg.pinv(own[at, at], hermitian=True) @ goes_with.T
        return Outcome(nan, nan, True)

    def _fix(self, state: TeamBelief, event: FixOf) -> Outcome:
        """Apply a fix to a belief `state`, in place."""
        team, row = self.team, self.team.row(event.number)
        noise = np.array((row["sd_x_m"][0] ** 2, row["sd_y_m"][0] ** 2, row["cov_xy_m2"][0]))
        jacobians = np.zeros((2, 4 * team.common.columns + 2))
        if team.common.columns and event.number >= 0:
            jacobians, noise = team.common.of[event.number], team.common.left[event.number]
        a, address = self._place[event.auv], team._known.address
        return Outcome(*apply_team_fix(address, row, noise, jacobians, state, a))

    def _peer(self, state: TeamBelief, sight: PeerSight) -> Outcome:
        """Apply an AUV's measurement of another: range, bearing, or both."""
        belief, shared = state.belief, state.shared
        a, size = self._place[sight.auv], len(belief.state)
        own, b = self._block(a), self._place.get(sight.sender)
        here = self._place_of(state, sight.auv)
        back = np.zeros((2, size))  # Jacobian of the peer's position as it sent, if a member
        if b is None:
            there, away, more = sight.told.place, sight.told.spread, 0.0
        else:
            there, back, more = self._sender(state, sight.sender, sight.told.sent_at_s)
            away = np.zeros((2, 2))
        mine = np.zeros((2, size))
        mine[:, own.start : own.start + 2] = -np.eye(2)
        apart = mine - back  # Jacobian of the offset between both
        spread = apart @ belief.covariance @ apart.T + away
        measured = list(_seen(here - there, spread, sight))
        if not measured:
            return Outcome(nan, nan, False)
        gradient = np.array([seen.gradient for seen in measured])
        slopes = gradient @ apart
        off = np.array([seen.off for seen in measured])
        noise = np.diag([seen.variance for seen in measured])
        noise += gradient @ (more * np.eye(2)) @ gradient.T
        for row, seen in enumerate(measured):
            self._by_errors(slopes[row], seen.kind, sight)
            off[row] -= slopes[row] @ belief.state - gradient[row] @ (apart @ belief.state)
        aside = 1.0 if measured[0].kind == "range" else hypot(*(here - there).tolist())
        length, share, theirs = aside * abs(float(off[0])), nan, np.zeros(noise.shape)
        if b is not None or not self._splits:
            noise += gradient @ away @ gradient.T
        else:
            common = gradient @ sight.told.shared @ gradient.T
            alone = gradient @ (away - sight.told.shared) @ gradient.T
            share = self._best(state, own, slopes, noise + alone, common)
            if share == 1.0:
                return Outcome(length, nan, False, share)
            belief.covariance[:] += (1.0 / share - 1.0) * shared
            shared[:] /= share
            theirs = common / (1.0 - share) + alone
            noise += theirs
        rule, gain = self.team.rule._replace(gate=self._gate(len(off))), np.empty(slopes.shape)
        x, y = (*off.tolist(), 0.0)[:2]
        found = take(belief, (x, y), slopes, _flat(noise), rule, gain, a, shared, _flat(theirs))
        return Outcome(length, *found, share)

    def _sender(self, state: TeamBelief, auv: int, time: float) -> tuple[Floats, Floats, float]:
        """Return a member's estimated position (2,), m, at an instant (s) before the state's;
        its Jacobian by all states (2, n); and the variance (m2, per axis) of the walk since then.
        """
        team, own = self.team, self._block(self._place[auv])
        belief, dr = self.belief(auv, state), team.dr(auv, time)
        growth = growth_of(team.growths, auv)
        passed = float(belief.moment["at_s"][0]) - time
        by = np.empty((team.size, team.size))
        transition(belief, dr, growth, by)
        drift = expected(belief, growth)
        error = expected_error(drift, way_since(drift, dr, growth.in_body))
        back = np.zeros((2, len(state.belief.state)))
        back[:, own] = -by[:2]
        return np.array((dr.x - error[0], dr.y - error[1])), back, growth.walk * abs(passed)

    def _by_errors(self, slopes: Floats, kind: str, sight: PeerSight) -> None:
        """Add to `slopes` (n,) the Jacobian of a range or bearing (`kind`) by errors of sound
        speed, clocks and arrays.
        """
        team, begin = self.team, self.team.size - self.team.common.columns
        own = self._block(self._place[sight.auv])
        if kind == "steep":
            return
        if kind == "bearing":
            if team.growths.stretched:  # the compass rotates the path and the bearing alike
                slopes[own.start + team.growths.stretched + 1] += 1.0
            if self._turn >= 0:
                slopes[self._turn + sight.auv] += 1.0
            return
        if "sound_speed" in team.columns:
            slopes[own.start + begin + team.columns["sound_speed"]] += sight.range_m
        if len(sight.legs) > 1:
            return
        both = ((sight.auv, -1.0, sight.valid_at_s), (sight.sender, 1.0, sight.told.sent_at_s))
        for auv, sign, time in both:
            at = self._clock + 2 * auv
            if "clock" in team.columns and auv in self._place:
                at = self._block(self._place[auv]).start + begin + team.columns["clock"]
            elif self._clock < 0:
                continue
            slopes[at] += sign * team.sound_speed
            slopes[at + 1] += sign * team.sound_speed * time

    def _gate(self, numbers: int) -> float:
        """Return the gate for so many numbers at once, with the pass rate of the gate for two."""
        gate = self.team.rule.gate
        if gate > 0.0 and numbers == 1:
            gate = NormalDist().inv_cdf(1.0 - exp(-gate / 2.0) / 2.0) ** 2
        return gate

    def _best(
        self, state: TeamBelief, own: slice, slopes: Floats, noise: Floats, common: Floats
    ) -> float:
        """Return the share w that minimises the variance of the AUV's position (states `own`) until
        the next message, moved on by its velocity; `noise` and `common` (q, q) are those of q
        numbers.
        """
        covariance = state.belief.covariance
        weights = np.zeros(self.team.size)
        weights[:2], weights[2:STATES] = 1.0, self.team.every_s**2
        alone = covariance - state.shared
        by_shared, by_alone = state.shared @ slopes.T, alone @ slopes.T
        w = SHARES[:, None, None]
        cross = by_shared / w + by_alone  # (shares, n, numbers)
        total = slopes @ cross + noise + common / (1.0 - w)
        gains = np.linalg.solve(total, cross[:, own].transpose(0, 2, 1))
        learnt = np.einsum("wij,wji->wi", cross[:, own], gains)
        left = (
            np.diag(state.shared)[own] / SHARES[:, None] + np.diag(alone)[own] - learnt
        ) @ weights
        best = int(left.argmin())
        return float(SHARES[best]) if left[best] < weights @ np.diag(covariance)[own] else 1.0


def _copied(state: TeamBelief) -> TeamBelief:
    moments, states, spread = state.belief
    own = Belief(moments.copy(), states.copy(), spread.copy())
    return TeamBelief(state.members, own, state.shared.copy())


def _flat(noise: Floats) -> Noise:
    """Return the noise (n, n) of one or two numbers in the form of :func:`.fix_update.take`."""
    return noise[0, 0], noise[-1, -1], noise[0, 1] if len(noise) > 1 else 0.0


def _key(time: float, event: Event) -> tuple[str, int, int, float]:
    """Return the key that identifies an event at an instant (s)."""
    if isinstance(event, FixOf):
        return "fix", event.auv, event.number, time
    if isinstance(event, SharedAt):
        return "sent", event.auv, NONE, time
    return "peer", event.auv, event.sender, time


class Seen(NamedTuple):
    """A number measured of a peer: innovation, variance, and gradient (2,) by the offset of
    both.
    """

    kind: str
    off: float
    variance: float
    gradient: Floats


def _seen(apart: Floats, spread: Floats, sight: PeerSight) -> Iterator[Seen]:
    """Yield the numbers measured of a peer at an estimated offset `apart` (2,), m, with a
    covariance (2, 2), m2.

    To second order: where the covariance is large beside the distance, ranges are longer on
    average, and a direction tells less.
    """
    if not isnan(sight.range_m):
        expects, gradient, bends = 0.0, np.zeros(2), np.zeros((2, 2))
        steep = 0.0
        for leg in sight.legs:
            way = apart + leg
            length = max(sqrt(float(way @ way) + sight.deeper_m**2), 1e-3)
            expects += length / len(sight.legs)
            gradient += way / length / len(sight.legs)
            bends += (np.eye(2) - np.outer(way, way) / length**2) / length / len(sight.legs)
            steep += sight.deeper_m / length / len(sight.legs)
        bent = bends @ spread
        more = 0.5 * float(np.trace(bent @ bent)) + steep**2 * sight.deeper_m2
        off = sight.range_m - expects - 0.5 * float(np.trace(bent))
        yield Seen("range", off, sight.range_m2 + more, gradient)
    if not isnan(sight.bearing_rad):
        x, y = (-apart).tolist()
        square = max(x * x + y * y, 1e-6)
        off = (sight.bearing_rad - atan2(y, x) + np.pi) % (2 * np.pi) - np.pi
        bends = np.array(((2 * x * y, y * y - x * x), (y * y - x * x, -2 * x * y))) / square**2
        bent = bends @ spread
        gradient = np.array((y, -x)) / square  # by `apart`, whose sign is the opposite
        off -= 0.5 * float(np.trace(bent))
        more = 0.5 * float(np.trace(bent @ bent))
        yield Seen("bearing", float(off), sight.bearing_rad2 + more, gradient)
    if not isnan(sight.steep_rad):
        deeper, level = sight.deeper_m, max(hypot(*apart.tolist()), 1e-3)
        square = level**2 + deeper**2
        by_level = -deeper / square
        along = apart / level
        across = np.eye(2) - np.outer(along, along)
        bends = 2 * deeper * level / square**2 * np.outer(along, along) + by_level / level * across
        bent = bends @ spread
        off = sight.steep_rad - atan2(deeper, level) - 0.5 * float(np.trace(bent))
        more = 0.5 * float(np.trace(bent @ bent)) + (level / square) ** 2 * sight.deeper_m2
        yield Seen("steep", off, sight.steep_rad2 + more, by_level * along)

"""Navigators: the AUVs' own estimates, dead reckoning corrected by the fixes that they receive.

A navigator serves the whole fleet, and never gets the true position: only fixes as they are
delivered, and the AUVs' own sensors.  Those that ship differ in the gain by which a fix corrects
the belief about dead reckoning (:mod:`.belief`): a fixed share of the position (eq. update), the
Kalman gain, or none.  The answers of a user-defined one are checked.  All beliefs are stored
(:class:`StoredBeliefs`), since past estimates are asked for later.
"""

from collections.abc import Mapping
from math import inf, nan
from typing import Any, Protocol

import numpy as np

from ...support.arrays import Floats, Ints, lengthened, real_numbers
from ...support.compiled import compiled
from ...support.packed import Packed, unpacked
from ...support.plugins import PluginError, asked, shown
from ..records.events import HEARD
from ..records.rows import FIX, NONE, RECEPTION, EventBuffer, Jacobians, Row, Rows, in_words
from ..scenario.families import NAVIGATOR
from ..vehicles.reckoning import expected_error, way_since
from .belief import (
    Belief,
    Beliefs,
    Growths,
    begun_at,
    carry,
    error_spread,
    expected,
    growth_of,
    on_circle,
    one,
    step_on,
    write,
)
from .correcting import (
    FilterHistory,
    Known,
    apply_fixes,
    expand,
    expand_rates,
    memory_of,
    scratch_for,
    turn_at,
)
from .dead_reckoning import DeadReckoning, Odometry, dr_at
from .fix_update import Rule, normalised_square
from .range_rates import Rates
from .raw_receptions import Levels, raw


class StoredBeliefs:
    """All beliefs of a fleet, in the order in which they arose."""

    def __init__(self, first: Beliefs) -> None:
        """Take the first beliefs (n,), valid from the start on."""
        self.count = self._fleet = len(first.moments)
        self._sorted = 0
        #: The beliefs are its first `count` rows.
        self.all = FilterHistory(np.arange(self.count), np.zeros(self.count), first)

    def make_room(self, count: int, packed: Packed) -> None:
        """Reserve further rows, also in the field `held` of a packed tuple."""
        room = len(self.all.whose)
        if self.count + count > room:
            length = max(2 * room, self.count + count)
            whose, since, beliefs = self.all
            longer = Beliefs(*[lengthened(part[: self.count], length) for part in beliefs])
            self.all = FilterHistory(
                lengthened(whose[: self.count], length),
                lengthened(since[: self.count], length),
                longer,
            )
            packed.renew("held", self.all)

    def of(self, auv: int) -> Ints:
        """Return the rows of an AUV's beliefs (k,), in order."""
        if self._sorted != self.count:  # sorted once for all AUVs
            whose = self.all.whose[: self.count]
            self._order = np.argsort(whose, kind="stable")
            self._ends = np.searchsorted(whose[self._order], np.arange(self._fleet + 1)).tolist()
            self._sorted = self.count
        return self._order[self._ends[auv] : self._ends[auv + 1]]


@compiled
def believed(
    packed: int, auv: int, own: Ints, as_covariance: bool, times: Floats, position: Floats,
    headings: Floats, out: Floats,
) -> None:  # fmt: skip
    """Write the estimated positions (n, 2), m, of an AUV at rising instants (n,), s; or, if
    `as_covariance`, their covariances xx, yy, xy (n, 3), m2.

    `packed` is the address of a :class:`.correcting.Known`, `own` (k,) are rows of the AUV's
    beliefs, the first from before all `times`; times, position and headings as in
    :class:`.dead_reckoning.Odometry`.
    """
    known = unpacked(packed, Known)
    growth, beliefs, since = growth_of(known.growths, auv), known.held.beliefs, known.held.since
    belief, ahead, n = known.scratch.belief, known.scratch.ahead, 0
    odometry = Odometry(times, position, headings)
    is_plain = growth.stretched == growth.wandering == growth.aligned == 0
    for k in range(own.size):
        until = since[own[k + 1]] if k + 1 < own.size else inf
        if n < times.size and times[n] < until:
            write(one(beliefs, own[k]), belief)
        while n < times.size and times[n] < until:
            stop = step_on(belief, auv, times[n], growth, known.reckoning)
            end = n
            while end < times.size and times[end] < until and times[end] <= stop:
                end += 1
            drift = expected(belief, growth)
            for i in range(n, end):
                dr = dr_at(odometry, i)
                way = way_since(drift, dr, growth.in_body)
                if not as_covariance:
                    x, y = expected_error(drift, way)
                    out[i, 0], out[i, 1] = dr.x - x, dr.y - y
                elif is_plain:
                    out[i, 0], out[i, 1], out[i, 2] = error_spread(belief.covariance, way, growth)
                else:
                    write(belief, ahead)
                    carry(ahead, dr, growth)
                    spread = on_circle(ahead.covariance, growth.aligned)
                    out[i, 0], out[i, 1], out[i, 2] = spread
            n = end


# Fixes that have no errors in common
NOTHING = Jacobians(0)


class Navigator(Protocol):
    """Estimates the positions of AUVs from their fixes and odometry."""

    def correct(self, fixes: Rows, due: Ints) -> None:
        """Apply the fixes in rows `due` (k,), in the order of delivery.

        A user-defined navigator gets record arrays with the columns of table `fixes`, or of
        :data:`.raw_receptions.RAW` if it wants receptions; those that ship get the buffer
        (:data:`FIX`), where -1 - k is row k of the GNSS fixes.
        """

    def estimate(self, auv: int, odometry: Odometry) -> Floats:
        """Return an AUV's estimated positions (n, 2), m, at the instants of its odometry."""

    def covariance(self, auv: int, odometry: Odometry) -> Floats:
        """Return the covariances xx, yy, xy (n, 3), m2, of these estimated positions."""


class LinearNavigator:
    """Navigators that estimate the drift of dead reckoning, and correct it by one rule.

    A fix is applied when it is delivered, at the instant at which it holds.  If fixes of later
    instants were delivered before, it is inserted, and those are applied again.
    """

    def __init__(
        self,
        reckoning: DeadReckoning,
        rule: Rule,
        growths: Growths,
        first: Beliefs,
        corrections: Floats,
        learnt: Rows,
        common: Jacobians = NOTHING,
        receptions: EventBuffer | None = None,
        gnss: EventBuffer | None = None,
        rates: Rates | None = None,
    ) -> None:
        """Take dead reckoning, the rule, the growth of beliefs and the first belief.

        `first` each as of :func:`.belief.first_belief`; for autopilots, `corrections` and `learnt`
        are written as of :class:`.correcting.Known`.  `common` are the Jacobians of fixes by the
        last states; fixes are made of some of the `receptions`; GNSS fixes are rows of `gnss`.
        Range rates with the errors `rates` are applied if not None.
        """
        #: Errors of the range rates that are applied with fixes; None: none are.
        self.rates = rates
        #: Jacobians of fixes by the last states.
        self.common = common
        any_of = Belief(first.moments[:1], first.states[0], first.covariances[0])
        start = Beliefs(first.moments.copy(), first.states.copy(), first.covariances.copy())
        if growths.stretched > 0:
            for auv in range(len(corrections)):
                start.moments[auv] = begun_at(any_of, reckoning.at(auv, 0.0)).moment[0]
        self._held = StoredBeliefs(start)
        memory, scratch = memory_of(any_of, start), scratch_for(any_of, common.columns)
        receptions = EventBuffer(RECEPTION) if receptions is None else receptions
        #: The GNSS fixes.
        self.gnss = EventBuffer(FIX) if gnss is None else gnss
        known, held, rows = reckoning.known, self._held.all, (receptions.array, self.gnss.array)
        self._known = Packed(
            Known(rule, growths, known, memory, held, scratch, *rows, corrections, learnt)
        )
        receptions.hand_on(self._known, "receptions")
        self._receptions = receptions
        self.gnss.hand_on(self._known, "gnss")

    def correct(self, fixes: Rows, due: Ints) -> None:
        """Apply the fixes in rows `due` (k,); write innovation, NIS and correction (m)."""
        self._held.make_room(len(due), self._known)
        has_common = self.common.columns > 0
        common, left = (self.common.of, self.common.left) if has_common else (None, None)
        count = self._held.count
        apply_fixes(self._known.address, count, fixes, due, common, left, self.rates)
        self._held.count += len(due)

    def expanded(
        self, fixes: Rows, noise: Floats, jacobians: Floats, states: Floats, spreads: Floats
    ) -> tuple[Floats, Floats]:
        """Return fixes expanded about beliefs of their instants, (n, 5) and (n, 2, m); see
        :func:`expand` for these and for the arguments.
        """
        said, common = np.empty((len(fixes), 5)), np.empty((len(fixes), 2, self.common.columns))
        expand(self._known.address, fixes, noise, jacobians, states, spreads, said, common)
        return said, common

    def rated(self, fixes: Rows) -> tuple[Ints, Ints]:
        """Return the receptions of fixes (n,) with range rates: index of fix (m,), and row (m,)."""
        receptions, found = self._receptions.array, []
        for k, fix in enumerate(fixes if self.rates is not None else ()):
            rows = np.arange(fix["first"], fix["end"] if fix["first"] != NONE else NONE)
            own = receptions[rows]
            is_rated = (own["outcome"] == HEARD) & ~np.isnan(own["range_rate_m_per_s"])
            found += [(k, row) for row in rows[is_rated & ~np.isnan(own["from_x_m"])].tolist()]
        both = np.array(found, dtype=np.int64).reshape(-1, 2)
        return np.ascontiguousarray(both[:, 0]), np.ascontiguousarray(both[:, 1])

    def expanded_rates(
        self, fixes: Rows, since: Floats, which: tuple[Ints, Ints], states: Floats, spreads: Floats
    ) -> tuple[Floats, Floats, Floats]:
        """Return range rates, `which` as of :meth:`rated`, as sights: rows (m, k), values (m,) and
        variances (m,); other arguments as of :func:`expand_rates`.
        """
        owners, lines = which
        rows, values = np.empty((len(owners), states.shape[1])), np.empty(len(owners))
        variances, rates = np.empty(len(owners)), self.rates
        if rates is not None and len(owners):
            expand_rates(
                self._known.address, fixes, since, owners, lines, states, spreads, rates, rows,
                values, variances,
            )  # fmt: skip
        return rows, values, variances

    def turn(self, fix: Rows, belief: Belief, was: Floats, now: Floats) -> None:
        """Rotate a belief at the instant of a fix whose error (2,), m, was corrected from `was` to
        `now`; :func:`.correcting.turn_at`.
        """
        turn_at(self._known.address, np.array([fix]).view(np.recarray), belief, was, now)

    def latest(self, auv: int) -> tuple[Floats, Floats]:
        """Return an AUV's states (k,) after its last fix, and their covariance (k, k)."""
        beliefs, last = self._held.all.beliefs, self._held.of(auv)[-1]
        return beliefs.states[last], beliefs.covariances[last]

    def estimate(self, auv: int, odometry: Odometry) -> Floats:
        """Return an AUV's estimated positions (n, 2), m, at the instants of its odometry."""
        return self._believed(auv, odometry, as_covariance=False)

    def covariance(self, auv: int, odometry: Odometry) -> Floats:
        """Return the covariances xx, yy, xy (n, 3), m2, of these estimated positions."""
        return self._believed(auv, odometry, as_covariance=True)

    def _believed(self, auv: int, odometry: Odometry, *, as_covariance: bool) -> Floats:
        found = np.empty((len(odometry.times), 2 + as_covariance))
        times, position, headings = [np.ascontiguousarray(column) for column in odometry]
        own = self._held.of(auv)
        believed(self._known.address, auv, own, as_covariance, times, position, headings, found)
        return found


# Relative tolerance by which a covariance may exceed the product of standard deviations
ROUNDING = 1e-6


class Reckoning:
    """The dead reckoning of a fleet, for user-defined navigators."""

    def __init__(self, reckoning: DeadReckoning) -> None:
        self._whole = reckoning

    def at(self, auv: int, time: float) -> tuple[float, float]:
        """Return an AUV's position by dead reckoning alone (m) at an instant (s)."""
        return self._whole.at(auv, time)

    def depth(self, auv: int, time: float) -> float:
        """Return an AUV's depth (m) at an instant (s), by its pressure sensor."""
        return float(self._whole.sample(auv, np.array((time,)))[0][0, 2])

    def odometry(self, auv: int, times: Floats) -> Odometry:
        """Return what an AUV's own sensors have measured by instants (n,), s."""
        return self._whole.sample(auv, np.asarray(times, dtype=np.float64))[1]


# Inputs that a user-defined navigator may ask for
WANTS = ("fixes", "receptions")


class OwnNavigator:
    """A user-defined navigator, named ``module:object`` in the scenario.

    The object is called with the fleet's dead reckoning and the number of AUVs, and returns a
    :class:`.navigators.Navigator`.
    """

    def __init__(
        self,
        name: str,
        make: Any,
        reckoning: DeadReckoning,
        corrections: Floats,
        receptions: EventBuffer | None = None,
        gnss: EventBuffer | None = None,
        levels: Levels | None = None,
    ) -> None:
        """Make the navigator; `corrections` (n, 2), m, of dead reckoning are what autopilots read.

        Fixes are made of some of the `receptions`, with the `levels` of a receiver; each GNSS fix
        is handed over with `ping` -1.

        Raises:
            PluginError: when it cannot be made, lacks a verb, or wants an unknown input.
        """
        self._name, self._reckoning, self._corrections = name, reckoning, corrections
        self._receptions = EventBuffer(RECEPTION) if receptions is None else receptions
        self._gnss = EventBuffer(FIX) if gnss is None else gnss
        self._navigator: Navigator = self._asked(make, Reckoning(reckoning), len(corrections))
        missing = [
            verb
            for verb in ("correct", "estimate", "covariance")
            if not callable(self._asked(getattr, self._navigator, verb, None))
        ]
        if missing:
            raise PluginError(NAVIGATOR.key, f"{name!r} lacks {', '.join(missing)}")
        wanted = self._asked(getattr, make, "wants", "fixes")
        wanted = self._asked(getattr, self._navigator, "wants", wanted)
        if wanted not in WANTS:
            raise PluginError(
                NAVIGATOR.key, f"{name!r} wants {wanted!r}; give one of {', '.join(WANTS)}"
            )
        self._levels = levels if wanted == "receptions" else None
        if wanted == "receptions" and levels is None:
            raise PluginError(
                NAVIGATOR.key,
                f"{name!r} wants receptions, which a log does not have; replay one of fixes",
            )

    @property
    def own(self) -> Any:
        """The user's navigator object."""
        return self._navigator

    def correct(self, fixes: Rows, due: Ints) -> None:
        """Hand over the fixes whose rows are due, each with the columns of table `fixes`; write how
        far it moved the AUV's estimate (m).

        Innovation and NIS are written before, against the estimate at the instant at which the fix
        holds.
        """
        for row in due:
            fix = fixes[row] if row >= 0 else self._gnss.array[-1 - row]
            auv = int(fix["auv"])
            odometry = self._reckoning.sample(auv, np.array([fix["delivered_at_s"]]))[1]
            then = self._reckoning.sample(auv, np.array([fix["valid_at_s"]]))[1]
            x, y = (fix["x_m"], fix["y_m"]) - self.estimate(auv, then)[0]
            xx, yy, xy = self.covariance(auv, then)[0]
            spread = xx + fix["sd_x_m"] ** 2, yy + fix["sd_y_m"] ** 2, xy + fix["cov_xy_m2"]
            fix["innovation_m"], fix["nis"] = np.hypot(x, y), normalised_square(x, y, *spread)
            was = self.estimate(auv, odometry)
            if self._levels is not None:
                told = raw(fix, self._receptions.array, self._levels)
            else:
                told = in_words(fix, self._receptions.array)
                told["error_m"] = np.nan  # unknown on board
            answer = self._asked(self._navigator.correct, told, np.arange(len(told)))
            moved = self.estimate(auv, odometry)
            fix["correction_m"] = np.hypot(*(moved - was)[0])
            self._corrections[auv] = (moved - odometry.position)[0]
            if answer is not None:
                self._write_answer(fix, answer)

    def _write_answer(self, fix: Row, answer: Any) -> None:
        """Write the answer of a user-defined navigator's `correct` into its fix.

        Raises:
            PluginError: when it is not None or a mapping of nis, innovation_m and refused.
        """
        found = self._asked(lambda: dict(answer)) if isinstance(answer, Mapping) else None
        known = found is not None and set(found) <= {"nis", "innovation_m", "refused"}
        if found is None or not known:
            said = shown(NAVIGATOR.key, self._name, answer)
            raise PluginError(
                NAVIGATOR.key,
                f"{self._name!r} returned {said} from correct; it must be None, or a mapping of "
                "nis, innovation_m and refused",
            )
        for name in ("nis", "innovation_m"):
            if name in found:
                number = self._asked(float, found[name])
                if not number >= 0.0 or number == inf:
                    raise PluginError(
                        NAVIGATOR.key,
                        f"{self._name!r} returned {name} = {number:g} from correct; it must be a "
                        "finite number of 0 or more",
                    )
                fix[name] = number
        if self._asked(bool, found.get("refused", False)):
            fix["correction_m"] = nan

    def estimate(self, auv: int, odometry: Odometry) -> Floats:
        """Return an AUV's estimated positions (n, 2), m, at the instants of its odometry."""
        return self._checked("estimate", auv, odometry, 2)

    def covariance(self, auv: int, odometry: Odometry) -> Floats:
        """Return the covariances xx, yy, xy (n, 3), m2, of these estimated positions."""
        found = self._checked("covariance", auv, odometry, 3)
        if (found[:, :2] < 0.0).any():
            raise PluginError(
                NAVIGATOR.key, f"{self._name!r} answered covariance with a variance below 0"
            )
        xx, yy, xy = found.T
        if (np.abs(xy) > np.sqrt(xx) * np.sqrt(yy) + ROUNDING * (xx + yy)).any():
            raise PluginError(
                NAVIGATOR.key,
                f"{self._name!r} answered covariance with a covariance xy above the product of "
                "its standard deviations; the columns are xx, yy, xy",
            )
        return found

    def _checked(self, verb: str, auv: int, odometry: Odometry, width: int) -> Floats:
        copied = Odometry(*(column.copy() for column in odometry))  # they may be written over
        answer = self._asked(lambda: getattr(self._navigator, verb)(auv, copied))
        found: Floats | None = self._asked(real_numbers, answer)
        wanted = (len(odometry.times), width)
        if found is None or found.shape != wanted or not np.isfinite(found).all():
            shape = "of no numbers" if found is None else f"of shape {found.shape}"
            if found is not None and found.shape == wanted:
                shape += " with nan or inf in it"
            raise PluginError(
                NAVIGATOR.key,
                f"{self._name!r} answered {verb} with an array {shape}; it must be {wanted} of "
                "finite numbers",
            )
        return found

    def _asked(self, verb: Any, *arguments: Any) -> Any:
        return asked(NAVIGATOR.key, self._name, verb, *arguments)

"""A navigator whose estimates are smoothed: from fixes of before and after.

During the mission an AUV acts on its filter; estimates that are asked for later are smoothed.
"""

from collections.abc import Iterator
from math import inf, nan
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...support.arrays import Floats, Ints
from ..records.rows import FIX, Rows
from .belief import NO_NUMBERS, Belief, Beliefs, Growths, begun_at, growth_of, on_circle, one
from .dead_reckoning import DeadReckoning, Odometry
from .fix_update import said_of_all
from .navigators import LinearNavigator
from .smoothing import Sights, filtered, smooth

# Most instants that are smoothed at once: each has two matrices of all states.
MOST_INSTANTS = 20_000

# All fixes are expanded again about the smoothed positions until no position moves by more than
# NEAR times its standard deviation, at most MOST_PASSES times.
NEAR, MOST_PASSES = 0.1, 4

# No fixes, by their numbers
NOTHING = np.zeros(0, dtype=np.int64)


class SmoothedTrack(NamedTuple):
    """Estimated positions (n, 2), m, of an AUV, and their covariances xx, yy, xy (n, 3), m2."""

    places: Floats
    covariances: Floats


class FixHistory(NamedTuple):
    """Fixes (n,), their Jacobians by m common errors (n, 2, 4 m + 2), and the remaining covariance
    xx, yy, xy (n, 3), m2, as of :class:`..records.rows.Jacobians`.
    """

    rows: Rows
    common: Floats
    noise: Floats

    def of(self, which: Ints) -> "FixHistory":
        """Return the fixes with indices `which`."""
        return FixHistory(self.rows[which], self.common[which], self.noise[which])


class FixMeasurements(NamedTuple):
    """n fixes as m scalar measurements (`sights`), with the index of each one's fix, `owners` (m,).

    The first 2 n are the positions of the fixes, two each; the rest are their range rates, by fix
    and reception (`rated`, see :meth:`LinearNavigator.rated`).  `since` (n,) is when (s) the fix
    before holds, 0 for the first.
    """

    sights: Sights
    owners: Ints
    rated: tuple[Ints, Ints]
    since: Floats


class Smoother:
    """A Kalman smoother: an estimate uses the fixes delivered up to a lag later.

    Autopilots steer by its filter, whose innovations and gate are written to the fixes; fixes that
    the gate refused are left out, fixes too late for the filter's memory are not.
    """

    def __init__(
        self,
        navigator: LinearNavigator,
        reckoning: DeadReckoning,
        growths: Growths,
        first: Beliefs,
        lag_s: float | None = None,
    ) -> None:
        """Take the filter, its dead reckoning, growth and first belief; `lag_s` None: no limit."""
        self._filter, self._reckoning = navigator, reckoning
        self._growths, self._first = growths, first
        self._lag = inf if lag_s is None else lag_s
        self._histories: list[FixHistory] = []
        self._latest: tuple[object, SmoothedTrack] | None = None

    def correct(self, fixes: Rows, due: Ints) -> None:
        """Apply the fixes whose rows are due to the filter, and store them."""
        self._filter.correct(fixes, due)
        by_gnss, common = due < 0, self._filter.common
        rows = np.array(fixes[np.where(by_gnss, 0, due)])
        rows[by_gnss] = self._filter.gnss.array[-1 - due[by_gnss]]
        kept = ~(np.isnan(rows["correction_m"]) & ~np.isnan(rows["innovation_m"]))
        rows = rows[kept]
        noise = np.column_stack((rows["sd_x_m"] ** 2, rows["sd_y_m"] ** 2, rows["cov_xy_m2"]))
        history = FixHistory(rows, np.zeros((len(rows), 2, 4 * common.columns + 2)), noise)
        if common.columns:
            history.common[~by_gnss[kept]] = common.of[due[kept & ~by_gnss]]
            history.noise[~by_gnss[kept]] = common.left[due[kept & ~by_gnss]]
        self._histories.append(history)
        self._latest = None

    def estimate(self, auv: int, odometry: Odometry) -> Floats:
        """Return an AUV's estimated positions (n, 2), m, at the instants of its odometry."""
        return self._believed(auv, odometry).places

    def covariance(self, auv: int, odometry: Odometry) -> Floats:
        """Return the covariances xx, yy, xy (n, 3), m2, of these estimated positions."""
        return self._believed(auv, odometry).covariances

    def _believed(self, auv: int, odometry: Odometry) -> SmoothedTrack:
        """Return an AUV's smoothed track; the latest is cached, since it is asked for twice."""
        question = auv, odometry.times.tobytes()
        if self._latest is None or self._latest[0] != question:
            self._latest = question, self._worked_out(auv, odometry)
        return self._latest[1]

    def _worked_out(self, auv: int, odometry: Odometry) -> SmoothedTrack:
        known = self._of(auv)
        told = self._as_measurements(auv, known)
        valid, delivered = known.rows["valid_at_s"], known.rows["delivered_at_s"]
        times, count = odometry.times, len(odometry.times)
        found = SmoothedTrack(np.empty((count, 2)), np.empty((count, 3)))
        begin = begun_at(one(self._first, auv), self._reckoning.at(auv, 0.0))
        is_open, growth = np.ones(len(valid), dtype=bool), growth_of(self._growths, auv)
        errors, last = np.full((len(valid), 2), nan), NOTHING
        for first, end in self._groups(times, delivered):
            is_delivered = delivered <= times[first] + self._lag
            # fixes yet to be smoothed for the first time hold at later instants
            is_new = np.isnan(errors[:, 0])
            settled = min(float(times[first]), float(np.min(valid[is_new], initial=inf)))
            sure = is_open & ~is_new & (valid <= settled)
            if sure.any():
                begin = filtered(begin, *self._between(auv, begin, valid, told, sure), growth)
                is_open &= ~sure
                last = np.flatnonzero(sure)[-1:]
            taken = is_open & is_delivered
            nodes, own = self._between(auv, begin, valid, told, taken, times[first:end])
            states, spreads = smooth(begin, nodes, own, growth)
            which = np.flatnonzero(taken)
            for _ in range(MOST_PASSES if which.size else 0):
                looked = np.concatenate((last, which))
                at, was = np.searchsorted(nodes.times, valid[looked]), errors[looked]
                errors[looked] = states[at, :2]
                for fix in last:
                    self._filter.turn(known.rows[fix], begin, was[0], errors[fix])
                self._expand_anew(known.of(which), nodes, states, spreads, told, which)
                nodes, own = self._between(auv, begin, valid, told, taken, times[first:end])
                states, spreads = smooth(begin, nodes, own, growth)
                if _are_near(states[at, :2] - errors[looked], spreads[at]):
                    break
            at = np.searchsorted(nodes.times, times[first:end])
            found.places[first:end] = odometry.position[first:end] - states[at, :2]
            found.covariances[first:end] = [
                on_circle(spread, growth.aligned) for spread in spreads[at]
            ]
        return found

    def _of(self, auv: int) -> FixHistory:
        """Return the fixes of one AUV, in the order in which they hold."""
        if len(self._histories) > 1:  # put together once, not for each AUV
            self._histories = [FixHistory(*map(np.concatenate, zip(*self._histories, strict=True)))]
        if not self._histories:
            return FixHistory(np.zeros(0, dtype=FIX), np.zeros((0, 2, 0)), np.zeros((0, 3)))
        [fixes] = self._histories
        own = np.flatnonzero(fixes.rows["auv"] == auv)
        return fixes.of(own[np.argsort(fixes.rows["valid_at_s"][own], kind="stable")])

    def _groups(self, times: Floats, delivered: Floats) -> Iterator[tuple[int, int]]:
        """Yield begin and end of runs of instants that use the same fixes, as memory allows."""
        known = np.searchsorted(np.sort(delivered), times + self._lag, side="right")
        changes = np.flatnonzero(np.diff(known, prepend=-1))
        firsts = np.union1d(changes, np.arange(0, len(times), MOST_INSTANTS)).tolist()
        yield from zip(firsts, [*firsts[1:], len(times)], strict=True)

    def _between(
        self,
        auv: int,
        begin: Belief,
        valid: Floats,
        told: FixMeasurements,
        which: NDArray[np.bool_],
        times: Floats = NO_NUMBERS,
    ) -> tuple[Odometry, Sights]:
        """Return the odometry at the instants of a belief, of the fixes in `which` (n,), at `times`
        (s), and at the steps in between; and the sights of these fixes.
        """
        instants = np.unique(np.concatenate((begin.moment["at_s"], times, valid[which])))
        nodes = self._reckoning.sample(auv, self._stepped(auv, begin, instants))[1]
        own, sights = np.flatnonzero(which[told.owners]), told.sights
        if len(told.rated[0]):  # sort all sights of a fix together
            own = own[np.argsort(told.owners[own], kind="stable")]
        at = np.searchsorted(nodes.times, valid[told.owners[own]])
        return nodes, Sights(at, sights.rows[own], sights.values[own], sights.variances[own])

    def _as_measurements(self, auv: int, known: FixHistory) -> FixMeasurements:
        """Return fixes as scalar measurements: two positions for each, then range rates.

        The two are x, and y less the part whose noise is correlated with x.
        """
        rows, states = known.rows, self._first.states.shape[1]
        then = self._reckoning.sample(auv, rows["valid_at_s"])[1]
        places = np.column_stack((rows["said_x_m"], rows["said_y_m"]))
        xx, yy, xy = rows["said_xx_m2"], rows["said_yy_m2"], rows["said_xy_m2"]
        common = known.common[:, :, :0]
        if count := known.common.shape[2] // 4:  # expanded about the filter's estimates
            noise = np.column_stack((xx, yy, xy))
            at = np.column_stack((rows["x_m"], rows["y_m"]))
            believed, (errors, spread) = self._filter.estimate(auv, then), self._filter.latest(auv)
            places, noise, common = said_of_all(
                np.array(rows["said_polar"]),
                places,
                at,
                noise,
                known.common,
                believed,
                errors[-count:],
                np.diag(spread)[-count:].copy(),
            )
            xx, yy, xy = noise.T
        sights = _sights_of(then.position - places, common, states, xx, yy, xy)
        rated, since = self._filter.rated(rows), np.append(0.0, rows["valid_at_s"][:-1])
        owners = np.repeat(np.arange(len(rows)), 2)
        if not len(rated[0]):
            return FixMeasurements(sights, owners, rated, since)
        at_fixes, covariance = np.zeros((len(rows), states)), self._first.covariances[auv]
        at_fixes[:, :2] = then.position - self._filter.estimate(auv, then)
        unsure = np.broadcast_to(covariance, (len(rows), *covariance.shape)).copy()
        further = self._filter.expanded_rates(rows, since, rated, at_fixes, unsure)
        both = [np.concatenate(two) for two in zip(sights[1:], further, strict=True)]
        return FixMeasurements(
            Sights(np.append(owners, rated[0]), *both), np.append(owners, rated[0]), rated, since
        )

    def _expand_anew(
        self, known: FixHistory, nodes: Odometry, states: Floats, spreads: Floats,
        told: FixMeasurements, which: Ints,
    ) -> None:  # fmt: skip
        """Expand the fixes `which` again about the smoothed states; write their sights.

        The filter has expanded each about another position, the first about one that may be far
        off, and treats the second-order terms as independent noise, which they are not.  Source: A.
        F. Garcia-Fernandez, L. Svensson, S. Sarkka, Iterated Posterior Linearization Smoother, IEEE
        Trans.  Automatic Control 62(4), 2017.
        """
        at = np.searchsorted(nodes.times, known.rows["valid_at_s"])
        said, common = self._filter.expanded(
            known.rows, known.noise, known.common, states[at], spreads[at]
        )
        off = nodes.position[at] - said[:, :2]
        anew = _sights_of(off, common, states.shape[1], *said[:, 2:].T)
        rows, sights = (2 * which[:, None] + [0, 1]).ravel(), told.sights
        sights.rows[rows], sights.values[rows] = anew.rows, anew.values
        sights.variances[rows] = anew.variances
        owners, lines = told.rated
        own = np.flatnonzero(np.isin(owners, which))
        if own.size:
            rated = np.searchsorted(which, owners[own]), lines[own]
            further = self._filter.expanded_rates(
                known.rows, told.since[which], rated, states[at], spreads[at]
            )
            own += len(told.owners) - len(owners)
            sights.rows[own], sights.values[own], sights.variances[own] = further

    def _stepped(self, auv: int, begin: Belief, instants: Floats) -> Floats:
        """Return instants (s) with the stops in between to which a belief must be carried."""
        step = self._growths.steps[auv]
        if not np.isfinite(step) or not instants.size:
            return instants
        first, last = float(begin.moment["at_s"][0]), float(instants[-1])
        numbers = np.arange(np.floor(first / step) + 1, last / step)
        return np.unique(np.concatenate((instants, numbers * step)))


def _are_near(moved: Floats, spreads: Floats) -> bool:
    """Return whether positions have moved (n, 2), m, little beside their covariances (n, k, k)."""
    unsure = spreads[:, 0, 0] + spreads[:, 1, 1]
    return bool((moved[:, 0] ** 2 + moved[:, 1] ** 2 <= NEAR**2 * unsure).all())


def _sights_of(
    off: Floats, common: Floats, states: int, xx: Floats, yy: Floats, xy: Floats
) -> Sights:
    """Return two sights for each of n errors (n, 2), m, with noise xx, yy, xy (n,), m2: along x,
    and along y less the part whose noise is correlated with x.  `common` (n, 2, k) are the fixes'
    Jacobians by the last k of all `states`.
    """
    slopes = np.zeros((len(off), 2, states))
    slopes[:, 0, 0] = slopes[:, 1, 1] = 1.0
    slopes[:, :, states - common.shape[2] :] -= common
    share = np.divide(xy, xx, out=np.zeros(len(xx)), where=xx > 0.0)
    slopes[:, 1] -= share[:, None] * slopes[:, 0]
    values = np.column_stack((off[:, 0], off[:, 1] - share * off[:, 0]))
    variances = np.column_stack((xx, np.maximum(yy - share * xy, 0.0)))
    numbers = np.repeat(np.arange(len(off)), 2)
    return Sights(numbers, slopes.reshape(-1, slopes.shape[2]), values.ravel(), variances.ravel())

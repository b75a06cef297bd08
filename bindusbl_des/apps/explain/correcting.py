"""How a fix corrects the estimate of its AUV: innovation, gate, gain, error before and after."""

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .chain import Step, known, lines, rows_where

if TYPE_CHECKING:
    from ...core.results.result import Result

Array = NDArray[Any]

# Errors that differ by less (m) count as equal.
SAME_M = 1e-3

# Semi-axis of the 95 % ellipse of a bivariate normal error, per sd along that axis.
ELLIPSE_SCALE = math.sqrt(-2 * math.log(0.05))


def arriving(result: "Result", fix: Any) -> Step:
    """Return the step at which the AUV receives the fix and corrects its estimate."""
    before, after = errors_around(result, fix)
    words = ""
    if before is not None and after is not None:
        words = f"; its error {_changed(before, after)}"
    why = [_compared(result, fix), _gated(result, fix), _moved(result, fix)]
    was, became = ellipses_around(result, fix)
    if was is not None and became is not None:
        why.append(f"half the length of its 95 % ellipse {_changed(was, became)}")
    if (by_gnss := _by_gnss(result, fix)) is not None:
        why.append(_at_surface(by_gnss[by_gnss.fixed_at_s <= fix.delivered_at_s], fix))
    if result.scenario.has_peers:
        why.append(_from_peers(result, fix))
    moved = known(fix.correction_m)
    return Step(
        fix.delivered_at_s,
        fix.auv,
        f"has it {fix.latency_s:.4f} s after its ping{words}",
        lines(*why),
        {
            "latency_s": fix.latency_s, "innovation_m": known(fix.innovation_m),
            "nis": known(fix.nis), "gate": _gate(result),
            "gain": _share(fix), "moved_m": moved,
            "error_before_m": before, "error_after_m": after,
            "ellipse_before_m": was, "ellipse_after_m": became,
        },
    )  # fmt: skip


def _by_gnss(result: "Result", fix: Any) -> Any:
    """Return the GNSS fixes of the AUV of a fix; None where AUVs have no receivers."""
    if result.scenario.navigation.gnss_fix is None:
        return None
    return rows_where(result.tables["gnss_fixes"], auv=fix.auv)


def _from_peers(result: "Result", fix: Any) -> str:
    """Tell which measurement of a peer last corrected the AUV before a fix."""
    earlier = rows_where(result.tables["peer_ranges"], auv=fix.auv)
    earlier = earlier[(earlier.heard_at_s <= fix.delivered_at_s) & earlier.correction_m.notna()]
    if not len(earlier):
        return "no measurement of a peer before it moved the estimate"
    last, ago = earlier.iloc[-1], fix.delivered_at_s - earlier.heard_at_s.iloc[-1]
    return (
        f"the last measurement of a peer that was taken, of {last.sender}, moved the estimate by "
        f"{last.correction_m:.2f} m {ago:.1f} s ago"
    )


def _at_surface(earlier: Any, fix: Any) -> str:
    """Tell which of these GNSS fixes, all `earlier` than a fix, came last."""
    if not len(earlier):
        return "no GNSS fix at the surface before it"
    last = earlier.iloc[-1]
    moved = known(last.correction_m)
    what = "refused" if moved is None else f"which moved the estimate by {moved:.2f} m"
    ago = fix.delivered_at_s - last.fixed_at_s
    return f"its last GNSS fix at the surface, {what}, was {ago:.1f} s ago"


def _changed(before: float, after: float) -> str:
    """Return how a length (m) changed, with enough digits to show the direction.

    >>> _changed(0.6, 0.45), _changed(0.101, 0.104), _changed(3.7412, 3.7412)
    ('falls from 0.60 to 0.45 m', 'grows from 0.101 to 0.104 m', 'stays at 3.74 m')
    """
    for digits in (2, 3):
        if round(before, digits) != round(after, digits):
            verb = "falls" if after < before else "grows"
            return f"{verb} from {before:.{digits}f} to {after:.{digits}f} m"
    return f"stays at {after:.2f} m"


def _smooths(result: "Result") -> bool:
    return result.setup.navigator.is_smoother


def _share(fix: Any) -> float | None:
    """Return the gain: the length of the correction over that of the innovation."""
    moved, innovation = known(fix.correction_m), known(fix.innovation_m)
    return moved / innovation if moved is not None and innovation else None


def _compared(result: "Result", fix: Any) -> str:
    """Tell the innovation of a fix, and to which instant the compared estimate belongs."""
    innovation, navigation = known(fix.innovation_m), result.scenario.navigation
    if innovation is None:
        return ""
    when = "of the instant at which the fix holds"
    if result.setup.navigator.has_gain and navigation.fixed_gain.delay_compensation == "none":
        when = "of now, though it has gone on since the ping (delay_compensation none)"
    return f"innovation {innovation:.2f} m against its estimate {when}"


def _gate(result: "Result") -> float | None:
    """Return the NIS above which the filter refuses fixes; None if `nis_gate` does not decide."""
    navigation = result.scenario.navigation
    return navigation.nis_gate if navigation.weighs and not navigation.filter.is_own else None


def _gated(result: "Result", fix: Any) -> str:
    """Tell whether the gate accepted a fix; "" if the fix never reached the gate."""
    navigation, navigator = result.scenario.navigation, result.setup.navigator
    square, gate = known(fix.nis), _gate(result)
    if navigator.has_gain and known(fix.innovation_m) is not None:
        return f"no gate: {navigation.filter} takes every fix in"
    if navigator.ignores_fixes or square is None:
        return ""
    words = f"normalised, its square is {square:.2f}"
    if navigation.filter.is_own:
        return words
    if gate is None:
        return f"{words}; no gate (nis_gate null)"
    words, limit = f"gate: {words}", f"{gate:.3g}"
    if square <= gate:
        return f"{words} <= {limit} (nis_gate)"
    if known(fix.correction_m) is None:
        return f"{words} > {limit} (nis_gate)"
    refused = _refused_before(result, fix)
    return f"{words} > {limit} (nis_gate), yet {refused} in a row had been refused"


def _refused_before(result: "Result", fix: Any) -> int:
    """Return how many fixes, acoustic or GNSS, the AUV refused in a row before this one."""
    own = rows_where(result.tables["fixes"], auv=fix.auv)
    own = own[own.innovation_m.notna()]
    came = list(own[["delivered_at_s", "correction_m"]].itertuples(index=False, name=None))
    if (by_gnss := _by_gnss(result, fix)) is not None:
        came += by_gnss[["fixed_at_s", "correction_m"]].itertuples(index=False, name=None)
    count = 0
    for time, moved in sorted(came, key=lambda row: row[0]):
        if time < fix.delivered_at_s:
            count = count + 1 if known(moved) is None else 0
    return count


def _moved(result: "Result", fix: Any) -> str:
    """Tell by which gain a fix moved the estimate, or why it did not."""
    navigation, moved = result.scenario.navigation, known(fix.correction_m)
    if result.setup.navigator.ignores_fixes:
        return "dead reckoning alone takes no fix in"
    if known(fix.innovation_m) is None:
        late = "it comes too late for its place among fixes of later instants, and is left out"
        return f"{late} by the filter, not by the smoother" if _smooths(result) else late
    if moved is None:
        return "refused: the estimate stays"
    whose = "its filter's" if _smooths(result) else "the"
    moves = f"moves {whose} estimate by {moved:.2f} m"
    if result.setup.navigator.has_gain:
        return f"gain {navigation.fixed_gain.gain:g} x {fix.innovation_m:.2f} m {moves}"
    who = "by the covariances it" if navigation.weighs else navigation.filter.words
    share = _share(fix)
    return f"{who} {moves}" + (f", {share:.2f} of the innovation" if share is not None else "")


def errors_around(result: "Result", fix: Any) -> tuple[float | None, float | None]:
    """Return the horizontal errors (m) of the estimate just before and after a correction.

    The drift is interpolated between the two rows of the track around the fix.  The correction of
    each row is extrapolated to that instant, since a filter that estimates a bias changes it
    without a fix. Both are None if another fix came between the rows, or if they differ by more
    than the fix moved the estimate, so that the extrapolation failed.
    """
    around = _rows_around(result, fix)
    if around is None:
        return None, None
    track, times, came, last = around
    x, y = ("x_m", "y_m")
    imu = track[[f"imu_{x}", f"imu_{y}"]].to_numpy(float)
    drift = imu - track[[x, y]].to_numpy(float)
    corrections = track[[f"estimate_{x}", f"estimate_{y}"]].to_numpy(float) - imu
    share = (fix.delivered_at_s - times[last]) / (times[last + 1] - times[last])
    now = drift[last] + share * (drift[last + 1] - drift[last])
    rates = _rates(result, times, corrections, came, last)
    if rates is None:
        return None, None
    before, after = (
        float(np.hypot(*(now + corrections[row] + rate * (fix.delivered_at_s - times[row]))))
        for row, rate in zip((last, last + 1), rates, strict=True)
    )
    if abs(after - before) > (known(fix.correction_m) or 0.0) + SAME_M:
        return None, None
    return before, after


def ellipses_around(result: "Result", fix: Any) -> tuple[float | None, float | None]:
    """Return the semi-major axes (m) of the AUV's 95 % ellipse before and after a correction.

    They come from the two rows of the track around it; None if another fix came between these rows,
    or if the fix changed nothing.
    """
    around = _rows_around(result, fix) if known(fix.correction_m) else None
    if around is None:
        return None, None
    track, _, _, last = around
    rows = track.iloc[last : last + 2]
    xx, yy = (rows[f"estimate_sd_{axis}_m"].to_numpy(float) ** 2 for axis in "xy")
    largest = (xx + yy) / 2 + np.hypot((xx - yy) / 2, rows.estimate_cov_xy_m2.to_numpy(float))
    before, after = ELLIPSE_SCALE * np.sqrt(largest)
    return known(float(before)), known(float(after))


def _rows_around(result: "Result", fix: Any) -> tuple[Any, Array, Array, int] | None:
    """Return an AUV's track, its instants (s), the number of fixes in each interval, and the row
    before a correction; None if another fix came in that interval, or if estimates are smoothed.
    """
    if _smooths(result):
        return None  # smoothed estimates contain the fix before it came
    track = rows_where(result.tables["tracks"], vehicle=fix.auv)
    times = track.time_s.to_numpy(float)
    last = int(np.searchsorted(times, fix.delivered_at_s, side="left")) - 1
    others = rows_where(result.tables["fixes"], auv=fix.auv).delivered_at_s.dropna().to_numpy()
    if (by_gnss := _by_gnss(result, fix)) is not None:
        others = np.concatenate((others, by_gnss.fixed_at_s.to_numpy()))
    came = np.diff(np.searchsorted(np.sort(others), times, side="right"))
    if last < 0 or last + 1 >= len(times) or came[last] != 1:
        return None
    return track, times, came, last


def _rates(
    result: "Result",
    times: Array,
    corrections: Array,
    came: Array,
    last: int,
) -> tuple[Array, Array] | None:
    """Return the rates (m/s) at which corrections (n, 2; m) change without a fix, before and after.

    Each belongs to the interval without a fix (`came` 0) that is nearest to row `last`, on its
    side; None without such intervals.
    """
    navigator = result.setup.navigator
    if navigator.has_gain or navigator.ignores_fixes:  # these navigators estimate no bias
        return np.zeros(2), np.zeros(2)
    quiet = np.flatnonzero(came == 0)
    before, after = quiet[quiet < last], quiet[quiet > last]
    if not (before.size and after.size):
        return None
    rates = np.diff(corrections, axis=0) / np.diff(times)[:, None]
    return rates[before[-1]], rates[after[0]]

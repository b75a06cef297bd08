"""Whether a filter knows how far off it is: shares inside its ellipses, against closed forms."""

import re
from dataclasses import replace

import numpy as np
import pyarrow as pa
import pytest
from pages_for_tests import page_data
from worlds import QUIET_NAVIGATION, paper_case, scenario

from bindusbl_des import Result, simulate
from bindusbl_des.apps.report.calibration import calibration, independent, normalised, of_fleet

CONSISTENT, UNDECIDED = "consistent", "cannot be told"
OVERCONFIDENT, UNDERCONFIDENT = "overconfident", "underconfident"
LEVELS = (0.5, 0.95, 0.99)
COUNT = 20_000


def off(believed: float = 1.0) -> np.ndarray:
    """Return normalised errors of a filter that believes a share of their covariance P.

    P changes from instant to instant, in size and direction.
    """
    rng = np.random.default_rng(5)
    size, turn = rng.uniform(0.01, 3.0, (2, COUNT)), rng.uniform(0.0, np.pi, COUNT)
    along, aside = rng.normal(size=(2, COUNT)) * size
    cosine, sine = np.cos(turn), np.sin(turn)
    errors = np.column_stack((cosine * along - sine * aside, sine * along + cosine * aside))
    xx = cosine**2 * size[0] ** 2 + sine**2 * size[1] ** 2
    yy = sine**2 * size[0] ** 2 + cosine**2 * size[1] ** 2
    xy = cosine * sine * (size[0] ** 2 - size[1] ** 2)
    return normalised(errors, believed * np.column_stack((xx, yy, xy)))


@pytest.mark.parametrize(
    ("believed", "verdict"), [(1.0, CONSISTENT), (0.25, OVERCONFIDENT), (4.0, UNDERCONFIDENT)]
)
def test_shares_are_those_of_the_closed_form(believed: float, verdict: str) -> None:
    """Errors believed too small by k are inside p for 1 - (1 - p)^k; 3.3 sigma of the binomial."""
    found = calibration(off(believed), COUNT)
    assert found is not None
    for level, share in zip(LEVELS, found.inside, strict=True):
        expected = 1 - (1 - level) ** believed
        assert share == pytest.approx(
            expected, abs=3.3 * np.sqrt(expected * (1 - expected) / COUNT)
        )
    assert found.verdict == verdict
    assert found.independent == pytest.approx(COUNT, rel=0.1)


def test_errors_alike_from_instant_to_instant_are_worth_fewer() -> None:
    """An autoregression by a is worth n (1 - a) / (1 + a) values, a constant one."""
    rng, kept = np.random.default_rng(2), 0.9
    noise, series = rng.normal(size=(50_000, 2)), np.zeros((50_000, 2))
    for k in range(1, len(series)):
        series[k] = kept * series[k - 1] + noise[k]
    expected = len(series) * (1 - kept) / (1 + kept)
    assert independent(series) == pytest.approx(expected, rel=0.1)
    assert independent(series[:-1]) == pytest.approx(expected, rel=0.1)
    assert independent(np.full((100, 2), 3.0)) == independent(series[:3]) == 1.0


def test_errors_that_last_make_no_filter_wrong() -> None:
    """Half of the variance, a misalignment, say, is drawn once for a mission, the rest wanders.

    The filter is right, and rarely called wrong: how alike errors are is an estimate, too.
    """
    rng, kept, verdicts = np.random.default_rng(3), 0.95, []
    for _ in range(200):
        wandering = rng.normal(size=(600, 2))
        wandering[1:] *= np.sqrt(1 - kept**2)
        for k in range(1, len(wandering)):
            wandering[k] += kept * wandering[k - 1]
        found = calibration(np.sqrt(0.5) * (wandering + rng.normal(size=2)), 600)
        assert found is not None
        verdicts.append(found.verdict)
    assert verdicts.count(OVERCONFIDENT) + verdicts.count(UNDERCONFIDENT) <= 6


def test_few_errors_say_nothing() -> None:
    """A drift that no fix corrects is one error, however many instants it lasts."""
    found = calibration(off(0.25), fixes=0)
    assert found is not None
    assert (found.independent, found.verdict) == (1.0, UNDECIDED)
    assert of_fleet([found] * 10).verdict == OVERCONFIDENT
    for worth, verdict in ((20.0, CONSISTENT), (400.0, OVERCONFIDENT)):
        assert replace(found, inside=(0.2, 0.9, 0.95), independent=worth).verdict == verdict


def test_whoever_is_sure_is_not_asked() -> None:
    """Instants of a covariance that is zero, flat or missing count for nothing."""
    covariances = np.array([[0, 0, 0], [1, 0, 0], [np.nan] * 3, [1, 1, 1], [4, 1, 0]])
    assert np.sum(normalised(np.ones((5, 2)), covariances) ** 2, axis=1).tolist() == [1.25]
    assert calibration(np.empty((0, 2)), 10) is None


@pytest.fixture(scope="module")
def weighed() -> Result:
    """The paper's case study with a filter that weighs its fixes."""
    return simulate(paper_case(3, record={"detail": "full"}, navigation={"filter": "kalman"}), 0)


def believing(result: Result, factor: float) -> Result:
    """Return a result in whose tracks filters believe in `factor` times their covariance."""
    tracks = result.arrow["tracks"]
    for name, power in (("sd_x_m", 0.5), ("sd_y_m", 0.5), ("cov_xy_m2", 1.0)):
        at = tracks.schema.get_field_index(f"estimate_{name}")
        column = tracks.column(at).to_numpy() * factor**power
        field = tracks.schema.field(at)
        tracks = tracks.set_column(at, field, pa.array(column, from_pandas=True, type=field.type))
    arrow = {**result.arrow, "tracks": tracks}
    return Result(result.scenario, result.seed, arrow, result.wall_time_s)


@pytest.mark.parametrize(
    ("factor", "verdict", "words"),
    [
        (1.0, CONSISTENT, "Nothing says that the filter kalman is over- or underconfident"),
        (0.25, OVERCONFIDENT, "kalman is overconfident, further off than it believes"),
        (4.0, UNDERCONFIDENT, "kalman is underconfident, less far off than it believes"),
    ],
)
def test_a_mission_tells_on_its_filter(
    weighed: Result, factor: float, verdict: str, words: str
) -> None:
    """The report has the shares of each AUV and of the fleet, and says in words what they mean."""
    result = believing(weighed, factor)
    told = result.report().partition("Truth inside the ellipses")[2].partition("</section>")[0]
    assert words in told
    judged = dict(re.findall(r"<th[^>]*>([^<]*)</th>((?:<td>[^<]*</td>)+)</tr>", told))
    assert verdict in judged["fleet"]
    tracks = result.tables["tracks"]
    for auv in range(3):
        own = tracks[tracks.vehicle == f"AUV{auv}"].dropna(subset=["estimate_x_m"])
        xx, yy, xy = own.estimate_sd_x_m**2, own.estimate_sd_y_m**2, own.estimate_cov_xy_m2
        x, y = own.estimate_x_m - own.x_m, own.estimate_y_m - own.y_m
        square = (yy * x * x - 2 * xy * x * y + xx * y * y) / (xx * yy - xy * xy)
        for level in LEVELS:
            share = 100 * (square.dropna() <= -2 * np.log(1 - level)).mean()
            assert f"<td>{share:.1f}</td>" in judged[f"AUV{auv}"]


def test_a_drift_alone_is_not_judged() -> None:
    """Dead reckoning has one error per AUV; without noise it has none, and nothing is said."""
    drifting, sure = (
        simulate(scenario(duration_s=20.0, navigation={"filter": "dead_reckoning", **noise}))
        for noise in ({}, QUIET_NAVIGATION)
    )
    told = drifting.report()
    assert "worth some 3 independent ones, too few to say whether it is over-" in told
    assert "<td>cannot be told</td>" in told
    assert "Truth inside the ellipses" not in sure.report()


def test_the_ellipses_of_a_page_are_those_of_the_tracks(weighed: Result) -> None:
    """Both sds within half a millimetre, their covariance within half a hundredth of both."""
    tracks = weighed.tables["tracks"]
    for auv in page_data(weighed)["auvs"]:
        own = tracks[tracks.vehicle == auv["name"]]
        x, y, xy = own.estimate_sd_x_m, own.estimate_sd_y_m, own.estimate_cov_xy_m2
        assert np.abs(auv["sd_x"] - x).max() <= 0.0005 + 1e-9
        assert np.abs(auv["sd_y"] - y).max() <= 0.0005 + 1e-9
        assert np.abs(auv["together"] * x * y - xy).max() <= 0.005 * (x * y).max()
        assert np.abs(auv["together"]).max() > 0.1

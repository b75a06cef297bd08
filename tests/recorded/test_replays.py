"""What navigators make of logs whose truth is known, and of two runs at sea whose truth is not."""

import json
import re
import shlex
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from commands_for_tests import call
from logs_for_tests import BEACONS, NO_RANGES, Sea, lost, made_up, still, write_pyfg
from worlds import scenario

from bindusbl_des import Result, Scenario, fit, load_scenario, read_log, replay, simulate
from bindusbl_des.apps.recorded.navigating import Noise

ROOT = Path(__file__).parents[2]
SEA = Sea()
TOLD = Noise(SEA.range_sd, SEA.share, SEA.outlier_sd, SEA.walk, bias_sd=0.05)


def rms(places: np.ndarray, others: np.ndarray) -> float:
    """Return the root mean square distance of places from others."""
    return float(np.sqrt(np.mean(np.sum((places - others) ** 2, axis=1))))


def mean_nis(seen: np.recarray) -> float:
    """Return the mean NIS of sights, each as likely as it is no outlier."""
    return float(np.average(seen["nis"], weights=seen["inlier"]))


@pytest.mark.parametrize("turn", [0.3, 2.9])
def test_a_start_is_found_wherever_odometry_begins(turn: float) -> None:
    """Turned and moved odometry, one range in ten wrong: found but for drift and noise."""
    log, _ = made_up(Sea(walk=0.01, bias=(0.002, -0.003)))
    adrift, start = lost(log, turn)
    found = replay(adrift, noise=TOLD).start
    assert found is not None
    assert np.hypot(found.pose.x - start.x, found.pose.y - start.y) < 1.0
    assert abs(np.sin((found.pose.heading - start.heading) / 2)) < 0.01
    assert found.rival_loss > 1.5 * found.loss


def test_ranges_to_one_beacon_tell_no_start() -> None:
    """About one beacon every way can be turned."""
    log, _ = made_up(SEA, count=20)
    times, beacons, metres = log.ranges
    one = beacons == 1
    adrift, _ = lost(replace(log, ranges=log.ranges._make((times[one], beacons[one], metres[one]))))
    with pytest.raises(ValueError, match="ranges to 1 beacons give no start"):
        replay(adrift)


@pytest.mark.slow
def test_what_is_believed_is_as_far_off_as_it_says() -> None:
    """Filter and smoother told of the noise: NIS is 1, NEES 2, the smoother nearer to the truth."""
    nees, nis, off = [], [], []
    for seed in range(20):
        log, truth = made_up(SEA, seed=seed)
        found = replay(log, noise=TOLD)
        track, later = found.filter, found.smoother
        off.append([rms(it.places, truth) for it in (track, later)])
        nis.append(mean_nis(track.seen))
        nees.append([_nees(it.places - truth, it.covariances) for it in (track, later)])
    assert np.mean(nis) == pytest.approx(1.0, abs=0.03)
    assert np.mean(nees, axis=0) == pytest.approx([2.0, 2.0], abs=0.35)
    before, after = np.mean(off, axis=0)
    assert after < 0.8 * before


def _nees(error: np.ndarray, covariances: np.ndarray) -> float:
    xx, yy, xy = covariances[100:].T  # the start is known
    x, y = error[100:].T
    return float(np.mean((yy * x * x - 2 * xy * x * y + xx * y * y) / (xx * yy - xy * xy)))


def test_the_tail_is_told_from_the_rest() -> None:
    """Outliers are known by the smoother; taken for Gaussian noise they spoil the track."""
    log, truth = made_up(Sea(share=0.2, outlier_sd=40.0), seed=3)
    told = replace(TOLD, outlier_share=0.2, outlier_sd=40.0)
    found = replay(log, noise=told)
    plain = replay(log, noise=replace(told, outlier_share=0.0))
    assert np.mean(found.smoother.seen["inlier"] < 0.5) == pytest.approx(0.2, abs=0.04)
    assert rms(found.filter.places, truth) < 0.5 * rms(plain.filter.places, truth)


def test_a_gate_refuses_what_no_outlier_explains() -> None:
    """A range that is off by a kilometre is not taken in, and changes nothing."""
    log, _ = made_up(SEA, count=60)
    spoiled = log.ranges.metres.copy()
    spoiled[30] += 1000.0
    wrong = replace(log, ranges=log.ranges._replace(metres=spoiled))
    track = replay(wrong, noise=replace(TOLD, gate=25.0)).filter
    assert np.flatnonzero(~track.seen["taken"]).tolist() == [30]
    left = log.ranges._make(np.delete(column, 30) for column in log.ranges)
    without = replay(replace(log, ranges=left), noise=TOLD).filter
    assert track.places == pytest.approx(without.places, abs=1e-12)


def test_the_smoother_is_at_the_least_squares_of_what_is_not_linear() -> None:
    """Where it has settled the sum of squares of ranges and steps rises in every direction."""
    log, _ = made_up(Sea(share=0.0), count=60)
    told = Noise(1.5, 0.0, 1.0, 0.05, bias_sd=0.05)
    headings = np.diff(log.odometry(log.times).headings, axis=0)
    along, aside = headings, np.column_stack((-headings[:, 1], headings[:, 0]))
    design = np.stack((along, aside), axis=-1)  # of each step, by the bias ahead and to the side
    variance = 0.05**2 * np.diff(log.times)

    def loss(errors: np.ndarray) -> float:
        steps = np.diff(errors, axis=0)
        places = log.places - errors
        off = log.ranges.metres - np.hypot(*(places - BEACONS.places[log.ranges.beacons, :2]).T)
        left = np.sum((steps - design @ bias) ** 2, axis=1) / variance
        return float(np.sum(off**2) / 1.5**2 + np.sum(left))

    errors = log.places - replay(log, noise=told).smoother.places
    normal = np.einsum("nij,nik,n->jk", design, design, 1 / variance) + np.eye(2) / 0.05**2
    moved = np.einsum("nij,ni,n->j", design, np.diff(errors, axis=0), 1 / variance)
    bias = np.linalg.solve(normal, moved)  # likeliest with these errors
    rng, least = np.random.default_rng(1), loss(errors)
    for _ in range(50):
        nudge = 1e-2 * np.cumsum(rng.standard_normal(errors.shape), axis=0)
        nudge[0] = 0.0  # the start is known
        up, down = loss(errors + nudge), loss(errors - nudge)
        assert min(up, down) > least - 1e-4 * (up + down - 2 * least) - 1e-6


def test_noise_is_found_again() -> None:
    """Spread, tail and walk of made-up logs, means of ten: as they were put in."""
    found = [fit(made_up(SEA, seed=seed)[0]).noise for seed in range(10)]

    def mean(name: str) -> float:
        return float(np.mean([getattr(it, name) for it in found]))

    assert mean("range_sd") == pytest.approx(SEA.range_sd, rel=0.1)
    assert mean("outlier_share") == pytest.approx(SEA.share, abs=0.03)
    assert mean("outlier_sd") == pytest.approx(SEA.outlier_sd, rel=0.2)
    assert mean("random_walk") == pytest.approx(SEA.walk, rel=0.5)
    assert np.mean([it.bias for it in found], axis=0) == pytest.approx(SEA.bias, abs=0.01)


@pytest.mark.slow
def test_without_outliers_none_are_found() -> None:
    """Gaussian ranges leave nothing to a tail, and their spread is not split up to make one."""
    sea = Sea(share=0.0)
    found = [fit(made_up(sea, count=300, seed=seed)[0]).noise for seed in range(10)]
    assert [it.outlier_share for it in found] == [0.0] * 10
    sds = [it.range_sd for it in found]
    assert np.mean(sds) == pytest.approx(sea.range_sd, abs=3 * np.std(sds, ddof=1) / np.sqrt(10))


@pytest.mark.parametrize("metres", [2.0**31, 9e9])
def test_an_absurd_range_does_not_keep_the_search_going(metres: float, tmp_path: Path) -> None:
    """Where no number is as low as a likelihood, the search went on for ever."""
    n = range(8)
    tables = {
        "odometry": ["time_s,x_m,y_m,yaw_rad,z_m", *(f"{k},{2 * k},{0.5 * k},0.1,3" for k in n)],
        "beacons": ["beacon,x_m,y_m", "L0,50,0", "L1,0,40"],
        "ranges": ["time_s,beacon,range_m", *(f"{k},L{k % 2},{48 - k}" for k in n[1:-1])],
        "fixes": ["time_s,x_m,y_m,sd_x_m,sd_y_m", *(f"{k},{2 * k},0.5,0.5,0.5" for k in n)],
    }
    tables["ranges"].append(f"7,L1,{metres}")
    for name, lines in tables.items():
        (tmp_path / f"{name}.csv").write_text("\n".join(lines))
    told = call("fit", tmp_path)
    said = {0: "a range of", 2: "no noise makes what was measured likely"}[told.exit_code]
    assert said in told.output
    assert "nan" not in told.output


@pytest.mark.slow
def test_the_bias_is_as_unsure_as_it_is_said_to_be() -> None:
    """Squares of its errors in standard deviations, of 20 logs: 1 in the mean, chi-squared.

    Of some of these logs the likeliest random walk is next to none, with which a bias seems far
    surer than it is.
    """
    found = [fit(made_up(SEA, count=300, seed=seed)[0]) for seed in range(20)]
    off = np.array([it.noise.bias for it in found]) - SEA.bias
    squares = (off / np.array([it.bias_sds for it in found])) ** 2
    assert squares.mean() == pytest.approx(1.0, abs=3 * np.sqrt(2 / squares.size))


@pytest.mark.parametrize(
    ("share", "outlier_sd", "speed", "begin"),
    [
        (0.0, 0.0, (1.0, 0.5), (0.0, 0.0)),
        (0.0, 0.0, (0.0, 0.0), (150.0, 30.0)),
        pytest.param(0.1, 20.0, (0.0, 0.0), (0.0, 0.0), marks=pytest.mark.slow),
        pytest.param(0.2, 100.0, (0.0, 0.0), (0.0, 0.0), marks=pytest.mark.slow),
        (0.1, 100.0, (0.0, 0.0), (150.0, 30.0)),
    ],
)
def test_noise_is_found_where_odometry_stands_still(
    share: float, outlier_sd: float, speed: tuple[float, float], begin: tuple[float, float]
) -> None:
    """USBL without a velocity log: walk, speed and outliers as they were put in, NIS about 2."""
    walks, shares, sds, biases, nis = [], [], [], [], []
    for seed in range(10):
        log, _ = still(0.3, share, outlier_sd, seed=seed, speed=speed, begin=begin)
        again = replay(log)
        walks.append(again.noise.random_walk)
        shares.append(again.noise.outlier_share)
        sds.append(again.noise.outlier_sd)
        biases.append(again.noise.bias)
        nis.append(mean_nis(again.filter.seen))
        assert (again.noise.start_sd > 0.0) == (begin != (0.0, 0.0))
    assert np.mean(walks) == pytest.approx(0.3, rel=0.1)
    assert max(walks) < 0.4
    if share:  # one in ten of 300: +- 1.7 % in a log
        assert np.mean(shares) == pytest.approx(share, abs=0.02)
        assert np.mean(sds) == pytest.approx(outlier_sd, rel=0.1)
    else:
        assert shares == [0.0] * 10
    # The mean speed of a walk of 598 s: +- 0.3 / sqrt(598) m/s in a log.
    assert np.mean(biases, axis=0) == pytest.approx(-np.array(speed), abs=3 * 0.0123 / np.sqrt(10))
    assert np.mean(nis) == pytest.approx(2.0, abs=0.1)


def test_ranges_alone_tell_the_speed_of_a_vehicle_without_a_velocity_log() -> None:
    """A compass and ranges: the speed, 1.5 m/s ahead, is what odometry misses."""
    log, truth = made_up(SEA)
    found = replay(replace(log, places=np.tile(log.places[0], (len(log.times), 1))))
    assert found.noise.bias == pytest.approx((-1.5, 0.0), abs=0.01)
    assert found.noise.range_sd == pytest.approx(SEA.range_sd, rel=0.2)
    assert found.noise.outlier_share == pytest.approx(SEA.share, abs=0.05)
    assert rms(found.smoother.places, truth) < 3.0


class Halfway:
    """A navigator of one's own: half of each fix, and the random walk that it is told of."""

    def __init__(self, reckoning, auvs, *, noise=None):  # type: ignore[no-untyped-def]
        self.walk = 1.0 if noise is None else noise.random_walk
        self.reckoning, self.times, self.totals = reckoning, [0.0], [np.zeros(2)]

    def correct(self, fixes, due):  # type: ignore[no-untyped-def]
        for fix in fixes[due]:
            believed = self.reckoning.at(fix.auv, fix.valid_at_s) + self.totals[-1]
            self.times.append(fix.delivered_at_s)
            self.totals.append(self.totals[-1] + 0.5 * ((fix.x_m, fix.y_m) - believed))

    def estimate(self, auv, odometry):  # type: ignore[no-untyped-def]
        last = np.searchsorted(self.times, odometry.times, side="right") - 1
        return odometry.position + np.array(self.totals)[last]

    def covariance(self, auv, odometry):  # type: ignore[no-untyped-def]
        return np.tile((self.walk**2, self.walk**2, 0.0), (len(odometry.times), 1))


class Deaf(Halfway):
    """One that is told of no noise."""

    def __init__(self, reckoning, auvs):  # type: ignore[no-untyped-def]
        super().__init__(reckoning, auvs)


def test_a_navigator_of_ones_own_is_replayed_with_the_noise() -> None:
    """It stands in the filter's place, knows the noise given or fitted, or its lack is said."""
    log, _ = still()
    told = Noise(0.0, 0.0, 0.0, 0.7)
    own = replay(log, navigator=Halfway, noise=told)
    halves = np.zeros((len(log.times), 2))
    for k, fix in enumerate(log.fixes.places):
        halves[k] = 0.5 * (fix + (halves[k - 1] if k else 0.0))
    assert own.filter.places == pytest.approx(halves)
    assert own.filter.covariances[:, 0] == pytest.approx(0.7**2)
    off = log.fixes.places[5] - halves[4]
    assert own.filter.seen["nis"][5] == pytest.approx(off @ off / (0.7**2 + 0.5**2))
    ours = replay(log, noise=told)
    assert own.smoother.places == pytest.approx(ours.smoother.places)
    assert replay(log, navigator=Halfway).filter.covariances[0, 0] == pytest.approx(0.09, rel=0.2)
    assert replay(log, navigator=Deaf).filter.covariances[0, 0] == 1.0
    with pytest.raises(ValueError, match="Deaf would not know the noise that is given: give it a"):
        replay(log, navigator=Deaf, noise=told)
    with pytest.raises(ValueError, match="Halfway cannot be replayed, since a navigator"):
        replay(made_up(SEA, count=60)[0], navigator=Halfway)


def test_the_navigator_that_noise_names_is_replayed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A filter of one's own in the file of `--noise`: its code is loaded with leave only."""
    monkeypatch.syspath_prepend(str(Path(__file__).parent))
    log, _ = still()
    folder = as_csv(log, tmp_path / "mine")
    noise = tmp_path / "noise.yaml"
    noise.write_text("name: own\nnavigation: {filter: 'test_replays:Halfway'}\n")
    words = ["replay", folder, "--noise", str(noise), "--json"]
    refused = call(*words)
    assert refused.exit_code == 2
    assert "'test_replays:Halfway' is a plug-in" in refused.output
    flown = json.loads(run(*words, "--allow-plugins"))["logs"][0]
    noise.write_text("name: ours\n")
    ours = json.loads(run(*words))["logs"][0]
    assert flown["filter_nis"] != ours["filter_nis"]
    noise.write_text("name: paper\nnavigation: {filter: fixed_gain}\n")
    outcome = call(*words)
    assert "not navigation.filter: fixed_gain" in outcome.stderr


def test_the_noise_found_is_a_scenario(tmp_path: Path) -> None:
    """The file of `fit` is read as a scenario, and tells the noise that was found."""
    path = str(tmp_path / "noise.yaml")

    def fitted(log: Any, name: str) -> Any:
        folder = as_csv(log, tmp_path / name)
        run("fit", folder, "--out", path, "--force")
        assert load_scenario(path).name == f"{name} noise"
        return read_log(folder)

    log = fitted(made_up(SEA)[0], "my: log #1")
    found, told = fit(log).noise, replay(log, noise=load_scenario(path)).noise
    for name in ("range_sd", "outlier_share", "outlier_sd", "random_walk", "bias_sd"):
        assert getattr(told, name) == pytest.approx(getattr(found, name), rel=6e-3), name
    assert told.bias == pytest.approx(found.bias, rel=6e-3)
    log = fitted(still(speed=(1.0, 0.5), begin=(150.0, 30.0))[0], "drifting")
    again = replay(log, noise=load_scenario(path))
    assert again.noise.start_sd == pytest.approx(fit(log).noise.start_sd, rel=6e-3)
    assert mean_nis(again.filter.seen) == pytest.approx(2.0, abs=0.3)
    fitted(still(begin=(4e6, 0.0))[0], "elsewhere")
    assert load_scenario(path).navigation.initial_position_sd_m == 1e5


def test_a_mission_of_ours_replayed_is_that_mission(tmp_path: Path) -> None:
    """Its export through the filter of logs, fix by fix: nearly what its own AUVs believed.

    They know the way at every instant, the log twice a second, and the filter of a log has no gate
    and is told of each fix at its ping, not at its delivery: so the latest estimate is compared.
    They also know where each fix was measured from, and turn its covariance to the place that they
    believe in; a log has fixes with covariances alone.  That makes 27 mm, where they are unsure of
    46 and 66; by the same covariances it was less than 20.
    """
    own = scenario(
        duration_s=120, record={"tracks_hz": 10.0}, navigation={"nis_gate": None},
        survey={"side_m": 60.0},
    )  # fmt: skip
    result = simulate(own, seed=3)
    track = replay(exported(result, tmp_path, "AUV1"), noise=own).filter
    tracks = result.tables["tracks"]
    last = tracks[tracks.vehicle == "AUV1"].iloc[-1]
    asked = last[["estimate_x_m", "estimate_y_m"]].to_numpy(float)
    assert len(track.seen) > 20
    assert track.at(np.array([last.time_s]))[0] == pytest.approx(asked, abs=0.04)
    told = track.covariances[np.searchsorted(track.times, last.time_s)]
    assert np.sqrt(told[0]) == pytest.approx(last.estimate_sd_x_m, rel=0.1)


@pytest.mark.parametrize("line", [20.0, 200.0])
def test_the_drift_of_a_sheet_wanders_in_a_replay_as_well(line: float, tmp_path: Path) -> None:
    """As sure as the mission's own filter; taken for constant it was sure of 5 mm, 0.5 m off."""
    drift = {"percent_of_distance": 5.0, "line_m": line}
    own = scenario(
        duration_s=120, record={"tracks_hz": 10.0}, survey={"side_m": 60.0},
        navigation={"nis_gate": None, "drift": drift, "velocity_bias_m_per_s": (0.0, 0.0),
                    "random_walk_m_per_sqrt_s": 0.0},
    )  # fmt: skip
    result = simulate(own, seed=3)
    track = replay(exported(result, tmp_path, "AUV1"), noise=own).filter
    tracks = result.tables["tracks"]
    last = tracks[tracks.vehicle == "AUV1"].iloc[-1]
    told = track.covariances[np.searchsorted(track.times, last.time_s)]
    sds = last[["estimate_sd_x_m", "estimate_sd_y_m"]].to_numpy(float)
    assert np.sqrt(told[:2]) == pytest.approx(sds, rel=0.1)
    believed = last[["estimate_x_m", "estimate_y_m"]].to_numpy(float)
    assert track.at(np.array([last.time_s]))[0] == pytest.approx(believed, abs=0.1)


def test_our_exports_are_one_log(tmp_path: Path) -> None:
    """MCAP and CSV of the same mission: the same odometry and fixes, and so the same track."""
    pytest.importorskip("mcap", reason="the extra `replay`")
    pytest.importorskip("foxglove", reason="the extra `mcap`")
    result = simulate(scenario(duration_s=20, survey={"side_m": 60.0}), seed=3)
    tracks = []
    for kind in ("csv", "mcap"):
        log = exported(result, tmp_path / kind, "AUV2", kind)
        assert len(log.fixes.times) > 5
        tracks.append(replay(log, noise=TOLD).filter.places)
    assert tracks[0] == pytest.approx(tracks[1], abs=1e-9)


def exported(result: Result, folder: Path, vehicle: str, kind: str = "csv") -> Any:
    """Return the log that the export of a mission is for a vehicle."""
    result.write(folder / "run")
    run("export", str(folder / "run"), "--to", kind, "--out", str(folder / f"out.{kind}"))
    return read_log(str(folder / f"out.{kind}"), vehicle)


def run(*words: str) -> str:
    """Return what a command prints."""
    outcome = call(*words)
    assert outcome.exit_code == 0, outcome.output
    return outcome.stdout


def as_csv(log: Any, folder: Path) -> str:
    """Write a log as CSV files of one's own."""
    folder.mkdir()
    ranges = zip(log.ranges.times, log.ranges.beacons, log.ranges.metres, strict=True)
    beacons = zip(log.beacons.names, *log.beacons.places[:, :2].T, strict=True)
    fixes = np.column_stack((log.fixes.times, log.fixes.places, np.sqrt(log.fixes.covariances)))
    odometry = np.column_stack((log.times, log.places, log.yaws))
    for name, head, lines in (
        ("odometry", "time_s,x_m,y_m,yaw_rad", odometry.tolist()),
        ("ranges", "time_s,beacon,range_m", [(t, log.beacons.names[n], r) for t, n, r in ranges]),
        (
            "beacons",
            "beacon,x_m,y_m",
            [*beacons],
        ),
        ("fixes", "time_s,x_m,y_m,sd_x_m,sd_y_m", fixes[:, :5].tolist()),
    ):
        if lines:
            text = "\n".join([head, *(",".join(map(str, line)) for line in lines)])
            (folder / f"{name}.csv").write_text(f"{text}\n")
    return str(folder)


def test_commands_replay_and_fit_what_one_has_recorded(tmp_path: Path) -> None:
    """A folder of CSV: the noise fitted to it, then told; tables, figure and JSON."""
    log = as_csv(made_up(SEA, count=120)[0], tmp_path / "mine")
    noise, out = str(tmp_path / "noise.yaml"), tmp_path / "out"
    assert run("fit", log, "--out", noise).strip() == noise
    assert "mine" in run("replay", log, "--noise", noise, "--out", str(out))
    assert {path.name for path in out.iterdir()} == {
        "columns.csv", "mine.png",
        *(f"{name}.{end}" for name in ("logs", "tracks", "sights", "beacons")
          for end in ("csv", "parquet")),
    }  # fmt: skip
    assert '"smoother_to_reference_m": null' in run("replay", log, "--noise", noise, "--json")
    refused = call("replay", log, "--noise", noise, "--out", out)
    assert (refused.exit_code, "--force" in refused.output) == (2, True)
    (tmp_path / "mine" / "ranges.csv").write_text("time_s,beacon,range_m\n4,L0,far\n")
    refused = call("replay", log)
    assert refused.exit_code == 2
    assert "ranges.csv:2: needs a number in the column range_m" in refused.output


@pytest.mark.parametrize("speed", ["nan", "inf", "0", "-1"])
def test_a_speed_that_is_none_is_refused(speed: str, tmp_path: Path) -> None:
    """One line names the option, whatever the log."""
    path = write_pyfg(tmp_path / "log.pyfg")
    for command in ("replay", "fit"):
        refused = call(command, path, "--speed", speed)
        assert refused.exit_code == 2
        assert "Invalid value for '--speed': " in refused.output


def test_ranges_that_determine_no_pose_have_no_optimum(tmp_path: Path) -> None:
    """The filter and the smoother are told all the same, and why GTSAM's optimum is not."""
    pytest.importorskip("gtsam", reason="the optimum is GTSAM's, the extra `replay`")
    path = write_pyfg(tmp_path / "log.pyfg", ("L1 0 40", "L1 1000 40"))
    told = call("replay", path, "--json")
    assert told.exit_code == 0, told.output
    assert told.stderr == (
        "log: no robust optimum to compare with: its ranges do not determine all poses\n"
    )
    assert json.loads(told.stdout)["logs"][0]["smoother_to_reference_m"] is None


def test_both_runs_at_sea_replay_from_the_line_of_the_manual() -> None:
    """And their figures are those of the page on validation."""
    pytest.importorskip("gtsam", reason="the runs ship with gtsam, the extra `replay`")
    line = re.search(
        r"`(bindusbl-des replay goats[^`]*)`", (ROOT / "docs" / "replay.md").read_text()
    )
    assert line is not None
    printed = run(*shlex.split(line[1])[1:])
    page = (ROOT / "docs" / "validation.md").read_text()
    rows = [row for row in printed.splitlines() if re.match(r"goats_1[56]  ", row)]
    assert len(rows) == 2
    for row in rows:
        assert "| " + " | ".join(row.split()) + " |" in page


@pytest.mark.slow
def test_the_noise_of_one_run_is_not_that_of_the_other(tmp_path: Path) -> None:
    """Each run with the noise found in the other: the figures of the page on validation."""
    pytest.importorskip("gtsam", reason="the runs ship with gtsam, the extra `replay`")
    rows = []
    for name, other in (("goats_15", "goats_16"), ("goats_16", "goats_15")):
        noise = str(tmp_path / f"{other}.yaml")
        run("fit", other, "--out", noise)
        rows.append(json.loads(run("replay", name, "--noise", noise, "--json"))["logs"][0])
    page = " ".join((ROOT / "docs" / "validation.md").read_text().split())
    for told, column in (
        ("the filter is {:.2f} and {:.2f} m", "filter_to_reference_m"),
        ("the smoother {:.2f} and {:.2f} m", "smoother_to_reference_m"),
        ("NIS is {:.2f} and {:.2f}", "filter_nis"),
    ):
        assert told.format(*(row[column] for row in rows)) in page


def test_where_the_origin_lies_changes_nothing() -> None:
    """A heading that is unsure turns the way about its start, not about the frame's origin."""
    log, _ = made_up(SEA, count=100)
    away = np.array([4000.0, -3000.0])
    beacons = log.beacons._replace(places=log.beacons.places + np.append(away, 0.0))
    moved = replace(log, places=log.places + away, beacons=beacons)
    told = TOLD.with_start_found()
    tracks = [replay(it, noise=told).filter for it in (log, moved)]
    assert tracks[1].places - away == pytest.approx(tracks[0].places, abs=1e-6)
    assert np.sqrt(tracks[0].covariances[0, :2].max()) < 1.01 * told.start_sd


@pytest.mark.parametrize("share", [0.0, 0.1])
@pytest.mark.parametrize("kind", ["ranges", "fixes"])
def test_a_wrong_belief_is_given_up(kind: str, share: float) -> None:
    """A filter too sure of a wrong start doubts it after five unlikely sights, and comes back: they
    are no outliers, all of them.
    """
    log, truth = made_up(Sea(share=share), count=200)
    if kind == "fixes":
        noise = SEA.range_sd * np.random.default_rng(1).standard_normal(truth.shape)
        variances = np.tile((SEA.range_sd**2, SEA.range_sd**2, 0.0), (200, 1))
        fixes = log.fixes._make((log.times, truth + noise, variances))
        log = replace(log, ranges=NO_RANGES, fixes=fixes)
    off = replace(log, places=log.places + 60.0)
    wide = SEA.outlier_sd if share else 0.0
    told = replace(TOLD, outlier_share=share, outlier_sd=wide, gate=9.2, start_sd=5.0)
    track, right = (replay(it, noise=told).filter for it in (off, log))
    if kind == "fixes" and not share:  # the fifth would just have passed
        away = np.sum((track.places[4] - log.fixes.places[4]) ** 2)
        assert away / (track.covariances[4, 0] + SEA.range_sd**2) == pytest.approx(9.2)
    if not share:
        assert np.flatnonzero(track.seen["taken"])[0] == 5
    late = slice(150, None)
    assert rms(track.places[late], truth[late]) < 1.5 * rms(right.places[late], truth[late])


def test_the_runs_at_sea_are_what_they_are_said_to_be() -> None:
    """Counts of ranges and poses; far from all ranges lies what is told of a beacon."""
    pytest.importorskip("gtsam", reason="the runs ship with gtsam, the extra `replay`")
    for name, poses, ranges, beacons in (("goats_15", 473, 786, 3), ("goats_16", 201, 572, 4)):
        log = read_log(name)
        assert (len(log.times), len(log.ranges.times)) == (poses, ranges)
        assert len(log.beacons.names) == beacons
        assert log.ranges.metres.max() < 710.0
    told = run("replay", "goats_16")
    assert "the 144 ranges to L1 are off by 2" in told
    assert re.search(r"the best other one has [\d.]+ times the loss", told)


def test_a_start_that_all_ranges_fit_exactly_is_told(tmp_path: Path) -> None:
    """No other one has so many times its loss, which is none."""
    told = run("replay", str(write_pyfg(tmp_path / "log.pyfg")))
    assert "found from the ranges, which fit it exactly" in told


def test_land_that_ranges_cross_is_counted_and_drawn() -> None:
    """By shapely, from where the smoother has the vehicle to its beacons; and fixes on it."""
    log, _ = made_up(Sea(), count=60)
    wall = [[20.0, -300.0], [30.0, -300.0], [30.0, 300.0], [20.0, 300.0]]
    noise = Scenario(name="wall", survey={"side_m": 900.0, "land": [wall]}, asvs={"count": 1})
    replayed = replay(log, noise=noise)
    here = replayed.smoother.at(log.ranges.times)
    there = log.beacons.places[log.ranges.beacons, :2]
    ways = shapely.linestrings(np.stack((here, there), axis=1))
    across = shapely.length(shapely.intersection(ways, shapely.Polygon(wall))) > 1e-6
    assert 5 < across.sum() < 55
    assert replayed.over_land == (across.sum(), 0)
    assert replay(log, noise=Scenario(name="sea", asvs={"count": 1})).over_land == (0, 0)


def test_land_lies_where_it_is_on_earth(tmp_path: Path) -> None:
    """About a log in degrees, which begins 111 m north of the middle of the survey."""
    (tmp_path / "odometry.csv").write_text(
        "time_s,lat_deg,lon_deg,yaw_rad\n0,54.331,10.16,0\n60,54.3315,10.16,0\n"
    )
    (tmp_path / "fixes.csv").write_text(
        "valid_at_s,lat_deg,lon_deg,sd_x_m,sd_y_m\n"
        "10,54.3311,10.16,1,1\n30,54.33125,10.16,1,1\n50,54.33142,10.16,1,1\n"
    )
    isle = [[135.0, -9.0], [145.0, -9.0], [145.0, 9.0], [135.0, 9.0]]
    place = {"origin": {"lat_deg": 54.33, "lon_deg": 10.16}}
    noise = Scenario(name="isle", survey={"side_m": 400.0, "land": [isle]}, environment=place)
    replayed = replay(read_log(str(tmp_path)), noise=noise)
    assert replayed.offset_m == pytest.approx((111.3, 0.0), abs=0.1)
    assert replayed.over_land == (0, 1)
    assert replay(read_log(str(tmp_path)), noise=Scenario(name="nowhere")).over_land == (0, 0)

"""Losses in bursts: as long as is said, as many as the channel has, and nothing else changed."""

from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands_for_tests import explained
from scipy import stats
from worlds import merged, scenario, still

from bindusbl_des import ScenarioError, Signals, load_scenario, simulate
from bindusbl_des.core.acoustics.bursts import PAIR, burst_luck, renewed
from bindusbl_des.core.acoustics.loss import chance_of

# A mean of n draws lies within so many standard deviations of what it is expected to be, but for
# one seed in ten thousand; chi-squared sums are rarer than this as seldom.
SDS, RARE = 3.9, 1e-4


def pair(seed: int, burst_s: float) -> Any:
    key = np.random.default_rng(seed).integers(0, 2**64, dtype=np.uint64)
    return np.array([(key, burst_s)], dtype=PAIR)[0]


def lost(of: Any, times: np.ndarray, losses: np.ndarray) -> np.ndarray:
    """Return which receptions (n,) at instants (n,), s, are lost, with their probabilities (n,)."""
    luck = [chance_of(burst_luck(of, at, p)) for at, p in zip(times, losses, strict=True)]
    return np.asarray(np.array(luck) < losses)


def runs(is_lost: np.ndarray) -> np.ndarray:
    """Return how many receptions in a row were lost, of all runs but the first and the last."""
    return np.array([len(list(it)) for was, it in groupby(is_lost.tolist()) if was][1:-1])


def rarity(found: np.ndarray, goes_on: float) -> float:
    """Return how seldom runs are as unlike those which go on with a probability, by chi-squared."""
    expected, most = len(found) * (1.0 - goes_on) * goes_on ** np.arange(200), 200
    while expected[: most - 1].min() < 5.0:
        most -= 1
    counts = np.bincount(np.minimum(found, most) - 1, minlength=most)
    rest = len(found) * goes_on ** (most - 1)
    return float(stats.chisquare(counts, [*expected[: most - 1], rest]).pvalue)


@pytest.mark.parametrize(("p", "every_s"), [(0.15, 0.41), (0.35, 0.1), (0.6, 1.0), (0.02, 0.2)])
def test_losses_go_on_as_those_of_a_two_state_chain(p: float, every_s: float) -> None:
    """Of 1e5 receptions: P(lost | lost) = p + (1 - p) e^(-t / ((1 - p) burst_s)), so that runs are
    geometric; as many are lost as the channel says.
    """
    burst_s, count = 0.4, 100_000
    found = lost(pair(1, burst_s), every_s * np.arange(count), np.full(count, p))
    kept = np.exp(-every_s / ((1.0 - p) * burst_s))
    assert rarity(runs(found), p + (1.0 - p) * kept) > RARE
    # The mean of a chain whose neighbours are correlated by `kept`
    sd = np.sqrt(p * (1.0 - p) / count * (1.0 + kept) / (1.0 - kept))
    assert found.mean() == pytest.approx(p, abs=SDS * sd)
    assert rarity(runs(found), p) < RARE or kept < 0.01  # each lost by itself they are shorter


@pytest.mark.parametrize("p", [0.1, 0.5, pytest.param(0.9, marks=pytest.mark.slow)])
def test_losses_last_for_exponential_times(p: float) -> None:
    """Not only as pings see it: with a mean of burst_s, from renewal to renewal of the luck."""
    of, ends, lasted, lasts = pair(2, 3.0), 2e5, [], 0.0
    while ends > 0.0:
        since, luck = renewed(of["key"], of["burst_s"], ends, p)
        if chance_of(luck) < p:
            lasts += ends - since
        elif lasts:
            lasted.append(lasts)
            lasts = 0.0
        ends = float(np.nextafter(since, -np.inf))
    assert len(lasted) > 5000
    assert stats.kstest(lasted, "expon", args=(0.0, 3.0)).pvalue > RARE


def test_as_many_are_lost_where_range_changes() -> None:
    """A pair that comes and goes, slowly or fast against its bursts: at each range its own share,
    within 1 %.
    """
    for period in (40.0, 2.0):
        times = 0.7 * np.arange(400_000)
        losses = 0.5 + 0.25 * np.sin(2.0 * np.pi * times / period)
        found = lost(pair(3, 0.5), times, losses)
        near = losses < 0.5
        for part in (near, ~near):
            assert found[part].mean() == pytest.approx(losses[part].mean(), rel=0.01)


def test_luck_is_that_of_an_instant_whoever_asks_first() -> None:
    """So pinging more often does not change the sea."""
    of, times = pair(4, 2.0), np.random.default_rng(0).uniform(-5.0, 500.0, 2000)
    losses = np.random.default_rng(1).uniform(0.0, 1.0, 2000)
    luck = np.array([burst_luck(of, at, p) for at, p in zip(times, losses, strict=True)])
    again = [burst_luck(of, at, p) for at, p in zip(times[::-1], losses[::-1], strict=True)]
    assert luck.tolist() == again[::-1]


def delivered(folder: Path, ratio: float) -> dict[str, Any]:
    """Return a channel that decodes a share of all signals, up to 1 km."""
    path = folder / f"ratio_{ratio}.csv"
    path.write_text(f"range_m,delivery_ratio\n0,{ratio}\n1000,{ratio}\n")
    return {"model": "curve", "file": str(path)}


def tables(asked: Any, seed: int = 1) -> dict[str, Any]:
    return simulate(asked, seed).tables


def same(one: dict[str, Any], other: dict[str, Any], *names: str) -> bool:
    return all(one[name].equals(other[name]) for name in names or one)


PROTOCOLS: list[dict[str, Any]] = [
    {},
    {"ranging": "twtt"},
    {"ranging": "passive"},
    {"ranging": "twtt", "schedule": "polling"},
    {"schedule": "csma"},
    {"downlink": "direct_reply"},
]


@pytest.mark.parametrize("protocol", PROTOCOLS, ids=str)
def test_bursts_change_nothing_but_who_is_lost(tmp_path: Path, protocol: dict[str, Any]) -> None:
    """Where nothing is lost, tables are those without bursts, bit for bit; where something is, the
    vehicles and all noise are.
    """
    base = {"duration_s": 60.0, "survey": {"side_m": 140.0}, "protocol": protocol}
    for ratio in (1.0, 0.6):
        bands = {band: {"channel": delivered(tmp_path, ratio)} for band in ("hf", "mf")}
        bursty = merged(bands, {band: {"channel": {"burst_s": 5.0}} for band in bands})
        plain, changed = (tables(scenario(**base, acoustics=it)) for it in (bands, bursty))
        assert same(plain, changed) == (ratio == 1.0)
        assert same(plain, changed, "tracks") or ratio < 1.0
        assert same(changed, tables(scenario(**base, acoustics=bursty)))
        if ratio < 1.0:
            assert not same(changed, tables(scenario(**base, acoustics=bursty), 2))
            columns = ["time_s", "vehicle", "x_m", "y_m", "z_m", "imu_x_m", "imu_y_m"]
            assert plain["tracks"][columns].equals(changed["tracks"][columns])


def test_the_disc_has_bursts_too() -> None:
    """Null is none."""
    lossy = {"hf": {"range_m": 200.0}, "loss": {"law": "head"}}
    base = {"duration_s": 60.0, "acoustics": lossy, "survey": {"side_m": 300.0}}
    plain = tables(scenario(**base))
    for burst_s in (None, 3.0):
        acoustics = merged(lossy, {"hf": {"channel": {"model": "disc", "burst_s": burst_s}}})
        found = tables(scenario(**merged(base, {"acoustics": acoustics})))
        assert same(plain, found) == (burst_s is None)


@pytest.mark.parametrize("ranging", ["owtt_sync", pytest.param("passive", marks=pytest.mark.slow)])
def test_a_mission_loses_as_many_in_longer_runs(tmp_path: Path, ranging: str) -> None:
    """A fixed share over all ranges: each pair loses it, in runs of the chain's length."""
    asked = still(
        1,
        duration_s=4000.0,
        asvs={"count": 8, "formation": {"positions_m": [[5.0 * n, 10.0] for n in range(8)]}},
        acoustics={"hf": {"channel": {**delivered(tmp_path, 0.7), "burst_s": 2.0}}},
        protocol={"ranging": ranging},
        navigation={"filter": "dead_reckoning"},
    )
    met = tables(asked)["receptions"].query("outcome in ('heard', 'lost')")
    each, share, sights = [], [], []
    for _, own in met.groupby("asv"):
        every_s = float(np.median(np.diff(own.arrived_at_s)))
        kept = np.exp(-every_s / (0.7 * 2.0))
        each.append(runs((own.outcome == "lost").to_numpy()))
        share.append((own.outcome == "lost").mean())
        sights.append(len(own) * (1.0 - kept) / (1.0 + kept))
        assert np.ptp(np.diff(own.arrived_at_s)) < 0.05 * every_s
    lost_together = met.pivot(index="ping", columns="asv", values="outcome").eq("lost").corr()
    beside = np.abs(lost_together.to_numpy() - np.eye(8)).max()
    assert beside < 5.0 / np.sqrt(min(sights))  # each pair has luck of its own
    sd = np.sqrt(0.3 * 0.7 / sum(sights))
    assert np.average(share, weights=sights) == pytest.approx(0.3, abs=SDS * sd)
    assert rarity(np.concatenate(each), 0.3 + 0.7 * kept) > RARE


def test_calls_are_lost_as_the_pings_of_their_pair_are(tmp_path: Path) -> None:
    """A call that is heard is answered in the same burst of luck, or nearly so."""
    found = {}
    for burst_s in (None, 20.0):
        channel = {**delivered(tmp_path, 0.7), "burst_s": burst_s}
        asked = still(
            1, duration_s=3000.0, acoustics={"hf": {"channel": channel}},
            protocol={"ranging": "twtt"},
        )  # fmt: skip
        found[burst_s] = tables(asked)
    for burst_s, heard in ((None, 0.7), (20.0, 1.0)):
        assert (found[burst_s]["pings"].call == "lost").mean() == pytest.approx(0.3, abs=0.08)
        answered = found[burst_s]["receptions"].dropna(subset="arrived_at_s")
        assert (answered.outcome == "heard").mean() == pytest.approx(heard, abs=0.03)


def test_frames_are_lost_in_bursts(tmp_path: Path) -> None:
    """Ages of fixes show it: as many frames are lost, more of them in a row."""
    found = {}
    for burst_s in (None, 6.0):
        channel = {**delivered(tmp_path, 0.7), "burst_s": burst_s}
        asked = still(1, duration_s=3000.0, acoustics={"mf": {"channel": channel}})
        result = simulate(asked, 1)
        outcomes = (result.tables["fixes"].outcome == "lost").to_numpy()
        auv = result.auvs.iloc[0]
        found[burst_s] = outcomes.mean(), runs(outcomes).mean(), auv.fix_age_max_s
    assert found[None][0] == pytest.approx(0.3, abs=0.03)
    assert found[6.0][0] == pytest.approx(0.3, abs=0.05)
    assert found[6.0][1] > 2.0 * found[None][1]
    assert found[6.0][2] > 2.0 * found[None][2]


def test_shadowing_lasts_where_levels_are_known() -> None:
    """What is lost is still what arrives below the threshold."""
    sonar = {"model": "sonar", "shadowing_sd_db": 6.0, "burst_s": 8.0}
    asked = still(1, duration_s=400.0, at=40.0, acoustics={"hf": {"channel": sonar}})
    met = tables(asked)["receptions"]
    assert ((met.margin_db >= 0.0) == (met.outcome == "heard")).all()
    margins = met.margin_db.to_numpy(float)
    assert 0.1 < (margins < 0.0).mean() < 0.9
    assert np.corrcoef(margins[1:], margins[:-1])[0, 1] > 0.5


def test_explain_tells_since_when_a_pair_had_lost_its_signals(tmp_path: Path) -> None:
    channel = {**delivered(tmp_path, 0.5), "burst_s": 5.0}
    asked = still(1, duration_s=60.0, acoustics={"hf": {"channel": channel}})
    asked = asked.model_validate(
        merged(asked.model_dump(mode="json"), {"acoustics": {"mf": {"channel": channel}}})
    )
    result = simulate(asked, 3)
    met = result.tables["receptions"]
    first = int(np.argmax(met.outcome == "heard"))  # what is lost before is so since the start
    second = next(
        n for n in range(first + 1, len(met)) if (met.outcome[n - 1 : n + 1] == "lost").all()
    )
    said = explained(result, ping=int(met.ping[second]))
    words = "losses last 5 s on average (burst_s), and this pair had lost its last 2 signals since "
    assert words in said
    since = float(said.partition(words)[2].split()[0])
    assert since <= met.arrived_at_s[second - 1]
    fixes = result.tables["fixes"]
    lost_fix = fixes[fixes.outcome == "lost"].iloc[-1]
    assert words in explained(result, fix=int(lost_fix.fix))


def some(signals: Signals, *, share: float) -> np.ndarray:
    """Decode a share of all signals."""
    return np.full(signals.ranges.shape, share)


def test_one_s_own_channel_has_bursts_and_is_not_asked_for_them() -> None:
    found = {}
    for burst_s in (None, 10.0):
        own = {"model": some, "share": 0.4, "burst_s": burst_s}
        asked = still(1, duration_s=300.0, acoustics={"hf": {"channel": own}})
        outcomes = (tables(asked)["receptions"].outcome == "lost").to_numpy()
        found[burst_s] = runs(outcomes).mean()
    assert found[10.0] > 3.0 * found[None]


@pytest.mark.parametrize(
    ("channel", "said"),
    [
        (
            "{model: disc, burst_s: 0}",
            r"m.yaml:2:50: acoustics.hf.channel.burst_s: must be > 0; got 0",
        ),
        (
            "{model: disc, burst_s: long}",
            r"m.yaml:2:[0-9]+: .*burst_s: needs a number; got the text 'lon",
        ),
        (
            "{model: sonar, bursts_s: 1}",
            r"m.yaml:2:[0-9]+: .*unknown setting; did you mean 'burst_s'",
        ),
    ],
)
def test_what_is_no_length_is_told(tmp_path: Path, channel: str, said: str) -> None:
    (tmp_path / "m.yaml").write_text(f"name: m\nacoustics: {{hf: {{channel: {channel}}}}}\n")
    with pytest.raises(ScenarioError, match=said):
        load_scenario(tmp_path / "m.yaml")


# Two dives with a Water Linked UGPS G2: time between readings (s), of each stretch of distance how
# many readings there were and which share was valid; how many were lost after a lost one.
DIVES = {
    "pier": (0.5, [(661, 0.923), (229, 0.908), (322, 0.727)], 0.375),
    "island": (
        0.41,
        [(430, 0.881), (308, 0.906), (419, 0.869), (353, 0.807), (244, 0.807), (338, 0.645)],
        0.365,
    ),
}


def after_a_lost_one(every_s: float, stretches: list[tuple[int, float]], burst_s: float) -> float:
    """Return how many readings after a lost one are lost."""
    count, valid = np.array(stretches).T
    p = 1.0 - valid
    kept = np.exp(-every_s / (valid * burst_s))
    return float((count * p * (p + valid * kept)).sum() / (count * p).sum())


def test_one_mean_describes_two_dives() -> None:
    """docs/validation.md: 0.33 s, with chi-squared 2.6; each lost by itself is excluded."""
    squares = {0.33: 0.0, 1e-9: 0.0}
    for every_s, stretches, measured in DIVES.values():
        lost_in_all = sum(n * (1.0 - valid) for n, valid in stretches)
        sd = np.sqrt(measured * (1.0 - measured) / lost_in_all)
        for burst_s in squares:
            off = after_a_lost_one(every_s, stretches, burst_s) - measured
            squares[burst_s] += (off / sd) ** 2
    assert squares[0.33] < 3.84  # 95 % of one degree of freedom
    assert squares[1e-9] > 40.0


@pytest.mark.slow
def test_the_dive_that_ships_has_the_bursts_that_were_measured() -> None:
    """The mean of seeds, whose spread is that of one dive, holds the dive's own figures."""
    found = {}
    for burst_s in ("0.33", "null"):
        asked = load_scenario("ugps_100m", overrides=[f"acoustics.hf.channel.burst_s={burst_s}"])
        rows = []
        for seed in range(16):
            result = simulate(asked, seed)
            is_lost = (result.tables["receptions"].outcome == "lost").to_numpy()
            after = is_lost[1:]
            rows.append((is_lost.mean(), after[is_lost[:-1]].mean(), after[~is_lost[:-1]].mean()))
        found[burst_s] = np.mean(rows, axis=0), np.std(rows, axis=0)
    mean, sd = found["0.33"]
    assert (np.abs(mean - (0.177, 0.365, 0.137)) < 2.0 * sd).all()
    assert found["null"][0][1] < 0.365 - 5.0 * found["null"][1][1]

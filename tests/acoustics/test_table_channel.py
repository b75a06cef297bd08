"""The channel `table`: a sonar along bent rays, traced or read."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands_for_tests import call
from worlds import QUIET_NAVIGATION, QUIET_USBL, merged

from bindusbl_des import (
    Mission,
    Scenario,
    ScenarioError,
    Setup,
    load_scenario,
    simulate,
    warnings_of,
)

QUIET = {"source_level_db": 150.0, "snr_threshold_db": 20.0}
CLEAR = {"shadowing_sd_db": 0.0, "snr_threshold_db": 1.0}
Tables = Any  # by their names
ASVS = np.array([[0.0, 0.0, 0.0], [30.0, -20.0, 0.0]])
AUVS = np.array([[40.0, 5.0, 10.0], [120.0, 60.0, 3.0], [-300.0, 10.0, 25.0]])
CAST = "depth_m,sound_speed_m_per_s\n0,1525\n8,1524\n25,1492\n30,1490\n"


@pytest.fixture(autouse=True)
def _caches_of_their_own(
    tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.getbasetemp() / "cache"))


def world(channel: Any, **changes: Any) -> Scenario:
    data = {"name": "m", "duration_s": 20.0, "acoustics": {"hf": {"channel": channel}}}
    return Scenario.model_validate({**data, **changes})


def snrs(scenario: Scenario) -> np.ndarray:
    """Return the SNRs (dB) of pings of AUVs at places at ASVs, without shadowing."""
    data = scenario.model_dump(mode="json", exclude_unset=True)
    here: dict[str, Any] = {
        "duration_s": 6.0,
        "survey": {"side_m": 60.0, "depths_m": AUVS[:, 2].tolist()},
        "auvs": {"count": 3, "route": {"kind": "hold", "positions_m": AUVS[:, :2].tolist()}},
        "asvs": {"count": 2, "formation": {"positions_m": ASVS[:, :2].tolist()}},
        "acoustics": {
            "hf": {"range_m": 500.0, "channel": {"shadowing_sd_db": 0.0, "snr_threshold_db": 1.0}}
        },
        "protocol": {"schedule": "one_per_slot"},
    }
    met = simulate(Scenario.model_validate(merged(data, here)), 1).tables["receptions"]
    assert set(met.outcome) <= {"heard", "lost", "in_flight"}
    return np.array(
        [
            [met.query(f"auv == 'AUV{n}' and asv == 'ASV{m}'").snr_db.iloc[0] for m in range(2)]
            for n in range(3)
        ]
    )


def in_summer(folder: Path, **channel: Any) -> Scenario:
    """Return a scenario with a thermocline."""
    (folder / "cast.csv").write_text(CAST)
    model = {"model": "table", **QUIET, **channel}
    return world(model, environment={"ctd": str(folder / "cast.csv")})


def test_in_water_without_a_gradient_it_is_the_sonar() -> None:
    """Straight rays lose what spherical spreading takes, and absorption: SNRs are the sonar's."""
    table, sonar = (snrs(world({"model": it, **QUIET})) for it in ("table", "sonar"))
    assert table == pytest.approx(sonar, abs=3e-3)


def test_a_thermocline_weakens_what_is_below(tmp_path: Path) -> None:
    """Above it AUVs are heard as on straight ways, below it several dB weaker."""
    summer = in_summer(tmp_path)
    bent, straight = snrs(summer), snrs(world({"model": "sonar", **QUIET}))
    assert np.abs(bent[1] - straight[1]).max() < 0.5
    assert (straight[2] - bent[2]).min() > 1.5
    told = simulate(summer, 1).tables["receptions"]
    assert told["snr_db"].notna().any()


def test_rays_of_ones_own(tmp_path: Path) -> None:
    """A file that takes 10 dB more than spherical spreading makes SNRs 10 dB less."""
    lines = ["range_m,source_depth_m,receiver_depth_m,travel_time_s,loss_db"]
    for away in (1.0, 20.0, 400.0):
        for below in (0.0, 30.0):
            way = float(np.hypot(away, below))
            loss = 20.0 * np.log10(max(way, 1.0)) + 10.0
            lines.append(f"{away},0.5,{below},{way / 1500.0},{loss}")
    (tmp_path / "sound.csv").write_text("\n".join(lines))
    (tmp_path / "m.yaml").write_text(
        "name: m\nacoustics: {hf: {channel: {model: table, rays: sound.csv, "
        "source_level_db: 150, snr_threshold_db: 20}}}\n"
    )
    own = load_scenario(tmp_path / "m.yaml")
    assert not [it for it in warnings_of(own) if "rays" in it.key]
    for key, value in (("acoustics.hf.range_m", 500.0), ("survey.depth_m", 31.0)):
        beyond = load_scenario(tmp_path / "m.yaml", overrides=[f"{key}={value}"])
        (warning,) = [it for it in warnings_of(beyond) if it.key == "acoustics.hf.channel.rays"]
        assert "a table up to 400 m, of receivers 0 to 30 m deep" in warning.message
    assert snrs(own) == pytest.approx(snrs(world({"model": "sonar", **QUIET})) - 10.0, abs=0.2)
    assert len(simulate(own, 1).tables["pings"]) > 0


@pytest.mark.parametrize(
    ("channel", "message"),
    [
        ({"bottom_m": 8.0}, "the sea, 8 m deep, ends above the survey at 10 m; give its depth"),
        ({"rays": "x.csv", "bottom_m": 40.0}, "remove it, or rays"),
        ({"spreading": 1.5}, "spreading"),
        ({"decoding": "bpsk"}, "decoding: must be 'threshold'"),
    ],
)
def test_wrong_tables_are_refused(channel: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        world({"model": "table", **channel})


def test_a_file_that_is_missing_is_told(tmp_path: Path) -> None:
    (tmp_path / "m.yaml").write_text(
        "name: m\nacoustics: {hf: {channel: {model: table, rays: no.csv}}}\n"
    )
    with pytest.raises(ScenarioError, match="no such file"):
        load_scenario(tmp_path / "m.yaml")


@pytest.mark.parametrize(
    ("row", "said"),
    [
        ("1,1,1,0.001,0", "needs at least two values of range_m"),
        ("1,1", "receiver_depth_m must hold numbers; row 1 has none"),
    ],
)
def test_a_file_that_is_no_table_is_told_before_the_mission(
    tmp_path: Path, row: str, said: str
) -> None:
    """At the key that names it, by every command that reads the scenario."""
    columns = "range_m,source_depth_m,receiver_depth_m,travel_time_s,loss_db"
    (tmp_path / "sound.csv").write_text(f"{columns}\n{row}\n")
    text = "name: m\nacoustics: {hf: {channel: {model: table, rays: sound.csv}}}\n"
    (tmp_path / "m.yaml").write_text(text)
    for command in ("validate", "coverage"):
        told = call(command, tmp_path / "m.yaml")
        assert told.exit_code == 2
        assert re.search(rf"m.yaml:2:48: acoustics.hf.channel.rays: .*{said}", told.output)


def test_without_pelagic_only_given_rays_are_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("bindusbl_des.core.scenario.agreement.protocol.find_spec", lambda _: None)
    with pytest.raises(ValueError, match=r"pip install 'bindusbl-des\[bellhop\]'"):
        world("table")
    assert world({"model": "table", "rays": "sound.csv"}).acoustics.hf.channel == "table"


@pytest.mark.parametrize(
    ("speeds", "depths", "away"),
    [((1480.0, 1540.0), [5.0, 28.0], 200.0), ((1480.0, 1540.0), [10.0, 28.0], 100.0),
     ((1516.0, 1484.5), [14.0, 28.0], 100.0)],
)  # fmt: skip
def test_ranges_are_those_of_circles_whatever_depths_others_have(
    tmp_path: Path, speeds: tuple[float, float], depths: list[float], away: float
) -> None:
    """The time of a ray to its own AUV, at the mean speed that all take: +2.5 m in the first."""
    exact = dict.fromkeys(
        ("tdoa_sd_s", "travel_time_sd_s", "quantum_s", "roll_sd_deg", "pitch_sd_deg",
         "heading_sd_deg"), 0.0,
    )  # fmt: skip
    (tmp_path / "cast.csv").write_text(
        f"depth_m,sound_speed_m_per_s\n0,{speeds[0]}\n30,{speeds[1]}\n"
    )
    positions = [[away, 0.0], [0.0, away]]
    held = world(
        {"model": "table", "bottom_m": 30.0, **QUIET},
        survey={"side_m": 400.0, "depths_m": depths},
        auvs={"count": 2, "route": {"kind": "hold", "positions_m": positions}},
        asvs={"count": 1, "formation": {"positions_m": [[0.0, 0.0]]}},
        acoustics={
            "hf": {"range_m": 300.0, "channel": {"model": "table", "bottom_m": 30.0, **QUIET}},
            "mf": {"range_m": 400.0},
        },
        environment={"ctd": str(tmp_path / "cast.csv")},
        usbl=exact,
    )
    fixes = simulate(held, 1).tables["fixes"].query("auv == 'AUV0'")
    assert len(fixes) > 2
    found = np.sqrt(fixes.x_m**2 + fixes.y_m**2 + fixes.z_m**2)
    slope, asv = (speeds[1] - speeds[0]) / 30.0, 0.5  # an ASV's transducer, as it is traced
    both = (speeds[0] + slope * asv) * (speeds[0] + slope * depths[0])
    apart = away**2 + (depths[0] - asv) ** 2
    circle = np.arccosh(1.0 + slope**2 * apart / (2.0 * both)) / abs(slope)
    expected = Setup(held).sound_speed_m_per_s * circle
    assert found.to_numpy() == pytest.approx(expected, abs=0.2)
    assert abs(expected - np.hypot(away, depths[0])) > 0.5


def test_ranges_are_measured_along_bent_rays(tmp_path: Path) -> None:
    """A fix without noise is as much nearer than the AUV as sound is there sooner."""
    exact = dict.fromkeys(
        ("tdoa_sd_s", "travel_time_sd_s", "quantum_s", "roll_sd_deg", "pitch_sd_deg",
         "heading_sd_deg"), 0.0,
    )  # fmt: skip
    summer = in_summer(tmp_path)
    place = {
        "auvs": {"count": 1, "route": {"kind": "hold", "positions_m": [[200.0, 0.0]]}},
        "asvs": {"count": 1, "formation": {"positions_m": [[0.0, 0.0]]}},
        "acoustics": {**summer.model_dump()["acoustics"], "mf": {"range_m": 300.0}},
        "environment": summer.model_dump()["environment"],
        "usbl": exact,
    }
    held = world({"model": "table", **QUIET}, **place)
    tables = simulate(held, 1).tables
    met, fixes = tables["receptions"].query("outcome == 'heard'"), tables["fixes"]
    late = (met.travel_time_s - met.slant_range_m / Setup(held).sound_speed_m_per_s).iloc[0]
    assert -1e-3 < late < -1e-5
    nearer = 200.0 - np.hypot(fixes.x_m, fixes.y_m)
    assert len(fixes) > 3
    # the straight way is that of the harmonic mean from the surface, to a millimetre
    assert nearer.to_numpy() == pytest.approx(-late * Setup(held).sound_speed_m_per_s, abs=1e-3)


def held(*aways: float) -> dict[str, Any]:
    """Return AUVs that stay where they are, by turns north and east of the middle (m)."""
    places = [[away, 0.0] if n % 2 == 0 else [0.0, away] for n, away in enumerate(aways)]
    return {"count": len(aways), "route": {"kind": "hold", "positions_m": places}}


def longer_by(metres: float, folder: Path, **changes: Any) -> Scenario:
    """Return a world in which every way between an AUV and an ASV is so much longer than straight
    on, in both bands, and nothing errs.
    """
    lines = ["range_m,source_depth_m,receiver_depth_m,travel_time_s,loss_db"]
    for away in (1.0, 200.0, 1000.0):
        for above in (0.0, 20.0):
            for below in (0.0, 20.0):
                way = float(np.hypot(away, below - above))
                lines.append(
                    f"{away},{above},{below},{(way + metres) / 1500.0!r},{20 * np.log10(way)}"
                )
    path = folder / f"longer_by_{metres}.csv"
    path.write_text("\n".join(lines))
    table = {"model": "table", "rays": str(path), "source_level_db": 180.0}
    base = {
        "survey": {"side_m": 200.0, "depth_m": 10.0},
        "auvs": changes.pop("auvs", held(60.0)),
        "asvs": {"count": 1, "formation": {"positions_m": [[0.0, 0.0]]}},
        "acoustics": {
            "hf": {"range_m": 200.0, "channel": table},
            "mf": {"range_m": 400.0, "channel": table},
        },
        "usbl": {**QUIET_USBL, "gnss_sd_m": 0.0},
        "navigation": QUIET_NAVIGATION,
        "record": {"detail": "full"},
    }
    return merged_world(base, changes)


def merged_world(base: dict[str, Any], changes: dict[str, Any]) -> Scenario:
    return Scenario.model_validate({"name": "m", "duration_s": 12.0, **merged(base, changes)})


class Anchored:
    """Whatever moves AUVs and ASVs: nobody knows before that they stay where they are."""

    def advance_to(self, time: float) -> dict[str, np.ndarray]:
        return {"auvs": np.array([[60.0, 0.0, 10.0, 0.0]]), "asvs": np.zeros((1, 4))}


STEERS = {
    "auvs": {"count": 1, "vehicle": {"model": "bluerov2"}, "feedback": "estimate"},
    "navigation": {"filter": "dead_reckoning"},  # which is the same in both
}


def flown(folder: Path, ways: str, **changes: Any) -> tuple[Tables, Tables]:
    """Return tables where ways are straight, and where they are longer by 1.5 m: of AUVs whose ways
    are known before, who steer by themselves, or are moved by another program.
    """
    if ways == "steers":
        changes = {**STEERS, **changes}
    poses = Anchored() if ways == "moved" else None
    near, far = (
        Mission(longer_by(metres, folder, **changes), 1, poses=poses).result().tables
        for metres in (0.0, 1.5)
    )
    return near, far


WAYS = pytest.mark.parametrize("ways", ["foreseen", "steers", "moved"])


@WAYS
@pytest.mark.parametrize("ranging", ["owtt_sync", "twtt", "passive"])
def test_sound_takes_the_same_way_whoever_sends_it(tmp_path: Path, ranging: str, ways: str) -> None:
    """A way longer by 1.5 m puts fixes 1.50 m farther off: by pings, by calls and their answers, by
    pings of ASVs; 0.75 m by calls, and 0.00 m by ASVs' pings, where those went straight.
    """
    near, far = flown(tmp_path, ways, protocol={"ranging": ranging})
    plain, longer = (
        np.sqrt(it["fixes"].x_m ** 2 + it["fixes"].y_m ** 2 + it["fixes"].z_m ** 2)
        for it in (near, far)
    )
    assert len(plain) == len(longer) > 3
    # who steers is a little elsewhere by then: answers come 1 ms later
    assert (longer - plain).to_numpy() == pytest.approx(np.full(len(plain), 1.5), abs=3e-3)
    receptions = far["receptions"]
    late = receptions.travel_time_s - receptions.slant_range_m / 1500.0
    assert late.to_numpy() == pytest.approx(np.full(len(late), 1e-3), abs=1e-9)
    sent = far["pings"].set_index("ping").loc[receptions.ping].sent_at_s.to_numpy()
    arrived = (receptions.arrived_at_s - sent).to_numpy()
    assert arrived == pytest.approx(receptions.travel_time_s.to_numpy(), abs=1e-9)


ANSWERS: dict[str, Any] = {
    "frame": ({}, 1),
    "instant": ({"downlink": {"model": "direct_reply", "reply": "instant"}}, 2),
    "reply": ({"downlink": "direct_reply"}, 2),
}


@WAYS
@pytest.mark.parametrize("answer", ANSWERS)
def test_frames_and_answers_take_that_way_too(tmp_path: Path, answer: str, ways: str) -> None:
    """Each way is 1 ms longer: a frame's, of a round that begins when it would; an answer's, and
    that of the ping before it.
    """
    protocol, longer = ANSWERS[answer]
    near, far = flown(tmp_path, ways, protocol=protocol)
    near, far = (it["fixes"].dropna(subset="latency_s") for it in (near, far))
    assert len(near) == len(far) > 3
    later = (far.latency_s - near.latency_s).to_numpy()
    assert later == pytest.approx(np.full(len(later), 1e-3 * longer), abs=2e-6)


def test_overlaps_are_those_of_bent_ways(tmp_path: Path) -> None:
    """Receptions begin as much later as their ways are longer, also where two meet at an ASV; an
    AUV that listens before it pings hears others as late.
    """
    changes = {
        "auvs": held(60.0, 60.0),
        "protocol": {"schedule": "csma"},
        "duration_s": 30.0,
    }
    tables = simulate(longer_by(1.5, tmp_path, **changes), 1).tables
    late = tables["receptions"].travel_time_s - tables["receptions"].slant_range_m / 1500.0
    assert len(late) > 10
    assert late.to_numpy() == pytest.approx(np.full(len(late), 1e-3), abs=1e-9)


def test_a_call_comes_with_its_echoes_as_a_ping_does() -> None:
    """What the echoes of a ping shift its range by, those of its call do again: `twtt` errs by as
    much as one way, not by half of it.
    """
    off = {}
    for ranging in ("owtt_sync", "twtt"):
        echoing = {"model": "sonar", "bottom_m": 30.0, "shadowing_sd_db": 0.0}
        far = {
            "survey": {"side_m": 400.0, "depth_m": 10.0},
            "auvs": held(333.0),
            "asvs": {"count": 1, "formation": {"positions_m": [[0.0, 0.0]]}},
            "acoustics": {"hf": {"range_m": 500.0, "channel": echoing}, "mf": {"range_m": 900.0}},
            "usbl": {**QUIET_USBL, "gnss_sd_m": 0.0},
            "navigation": QUIET_NAVIGATION,
            "protocol": {"ranging": ranging},
        }
        fixes = simulate(merged_world(far, {}), 1).tables["fixes"]
        found = np.hypot(np.hypot(fixes.x_m, fixes.y_m), fixes.z_m) - np.hypot(333.0, 10.0)
        assert len(found) > 3
        off[ranging] = float(found.mean())
    assert abs(off["owtt_sync"]) > 0.01
    assert off["twtt"] == pytest.approx(off["owtt_sync"], rel=0.01)

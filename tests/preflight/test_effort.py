"""What a mission will take is known before it is begun."""

from pathlib import Path
from typing import Any

import pytest
from commands_for_tests import call

from bindusbl_des import Scenario, Setup
from bindusbl_des.apps.preflight import effort
from bindusbl_des.apps.preflight import effort as machine
from bindusbl_des.apps.preflight.effort import Effort

# Peak resident memory (MB) of `run --no-advice`, files included, measured on Linux, x86-64, Python
# 3.11, numpy 2.4, numba 0.68 with its code compiled before.
MEASURED: list[tuple[int, dict[str, Any]]] = [
    (412, {"auvs": {"count": 8000}, "duration_s": 5}),
    (845, {"duration_s": 2000, "record": {"tracks_hz": 100}}),
    (583, {"duration_s": 20000, "navigation": {"imu_rate_hz": 100}}),
    (518, {"duration_s": 20000}),
    (384, {"duration_s": 20000, "record": {"detail": "summary"}}),
    (721, {"auvs": {"count": 300}, "asvs": {"count": 300}, "duration_s": 40}),
    (337, {"auvs": {"count": 30, "vehicle": "bluerov2"}, "duration_s": 600}),
    (734, {"auvs": {"count": 3000}, "duration_s": 300, "record": {"detail": "summary"}}),
    (1711, {"auvs": {"count": 1000}, "duration_s": 1000}),
    (406, {"auvs": {"count": 10}, "asvs": {"count": 1000}, "duration_s": 50}),
    (491, {"duration_s": 2000, "record": {"metrics_hz": 1000}}),
    (339, {"duration_s": 3000,
           "navigation": {"imu_rate_hz": 300, "velocity": "through_water"}}),
]  # fmt: skip


def cost(**keys: Any) -> Effort:
    return effort.effort(Setup(Scenario.model_validate({"name": "m", **keys})))


@pytest.mark.parametrize(("measured", "keys"), MEASURED)
def test_memory_is_estimated_as_measured(measured: float, keys: dict[str, Any]) -> None:
    """Hardly ever too low, and by less than a third too high: 0 to +28 % in these."""
    assert 0.97 < cost(**keys).bytes / 1e6 / measured < 1.3


def test_who_is_heard_is_counted_by_the_range_metric() -> None:
    """50 m of slant range reach 40 m far at 30 m depth: AUVs 45 m away make no receptions."""
    route = {"kind": "hold", "positions_m": [[45.0, 0.0], [0.0, 45.0]]}
    keys = {"survey": {"depth_m": 30.0}, "auvs": {"count": 2, "route": route}, "asvs": {"count": 1}}
    counted = [
        cost(**keys, acoustics={"hf": {"range_m": 50.0, "range_metric": metric}}).counts["fixes"]
        for metric in ("horizontal", "slant")
    ]
    assert counted[0] > 100
    assert counted[1] == 0


@pytest.fixture
def small_machine(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Let commands believe that they have 4 GiB."""
    monkeypatch.setattr(effort, "machine_memory", lambda: 2.0**32)
    monkeypatch.chdir(tmp_path)


def refused(command: str, text: str) -> str:
    """Return the one line in which a command refuses a scenario, with exit code 2."""
    Path("f.yaml").write_text(f"name: m\n{text}\n")
    result = call(command, "f.yaml", *(["--seeds", "2"] * (command != "run")))
    assert result.exit_code == 2
    return result.stderr.splitlines()[-1]


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("duration_s: 80000\nrecord: {tracks_hz: 1000}", "Lower record.tracks_hz or duration_s"),
        ("duration_s: 80000\nrecord: {metrics_hz: 1000}", "Lower record.metrics_hz or duration_s"),
        ("auvs: {count: 20000}", "Lower record.tracks_hz or duration_s"),
        ("auvs: {count: 10000}\nasvs: {count: 10000}", "Lower auvs.count or asvs.count"),
    ],
)
@pytest.mark.usefixtures("small_machine")
def test_what_is_too_large_is_refused_with_the_key_to_lower(text: str, told: str) -> None:
    """Before anything is simulated: how much it would take, and what to change."""
    line = refused("run", text)
    assert "more memory than the 4.3 GB of this machine" in line
    assert told in line
    assert line.endswith("--anyway begins it nevertheless")


@pytest.mark.usefixtures("small_machine")
def test_what_a_small_machine_can_do_is_not_refused() -> None:
    """Fleets whose conflict graph alone took 5 and 11 GB, since none is made."""
    assert cost(auvs={"count": 8000}).excess() == ""
    assert cost(auvs={"count": 20000}, record={"detail": "summary"}).excess() == ""


@pytest.mark.usefixtures("small_machine")
def test_a_sweep_counts_the_missions_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """What one worker can do two together cannot; fewer workers are a remedy."""
    assert cost(auvs={"count": 20000}, record={"detail": "summary"}).excess(2)
    monkeypatch.setattr("os.cpu_count", lambda: 2)
    assert "use fewer --workers" in refused("sweep", "auvs: {count: 20000}")


def test_a_container_has_its_own_memory(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A limit of a container counts, "max" is none."""
    whole = machine.machine_memory()
    limit = tmp_path / "memory.max"
    monkeypatch.setattr(machine, "CONTAINER_LIMITS", (str(limit), str(tmp_path / "none")))
    limit.write_text("1000000\n")
    assert machine.machine_memory() == 1e6
    limit.write_text("max\n")
    assert machine.machine_memory() >= whole

"""Bags for ROS 2, read back by rosbags with the definitions of ROS 2 itself."""

import math
from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands_for_tests import call
from live_for_tests import (
    BEGINS,
    START,
    EstimateReading,
    FixReading,
    Gnss,
    Truth,
    UsblReading,
    at_sea,
    heard,
    ned_at_depth,
    written,
)
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from bindusbl_des import Mission
from bindusbl_des.apps.live.ros2 import DEFINITIONS, Bag, definition

STORE = get_typestore(Stores.ROS2_HUMBLE)


def read(path: Path) -> dict[str, list[tuple[int, Any]]]:
    """Return the messages on each topic of a bag, with their log times (ns)."""
    found = defaultdict(list)
    with Reader(path) as reader:
        for connection, at, data in reader.messages():
            message = STORE.deserialize_cdr(data, connection.msgtype)
            found[connection.topic].append((at, message))
    return found


@pytest.mark.parametrize("kind", sorted(DEFINITIONS))
def test_definitions_are_those_of_ros2(kind: str) -> None:
    """Field by field, constants beside them."""
    name = kind.replace("/", "/msg/")
    ours = get_types_from_msg(definition(kind), name)
    for it, (_, fields) in ours.items():
        assert fields == STORE.fielddefs[it][1]


@pytest.mark.parametrize("origin", [True, False])
def test_a_bag_is_read_back_as_it_was_measured(tmp_path: Path, *, origin: bool) -> None:
    """Positions and covariances to the last bit but for frames, instants to the nanosecond."""
    changes = {} if origin else {"environment": {"origin": {"lat_deg": None, "lon_deg": None}}}
    readings, _, earth = heard(at_sea(usbl={"gnss_sd_m": 0.5}, **changes), truth=True)
    bag = Bag("ros2", tmp_path / "bag.mcap", replace=False)
    for it in readings:
        assert bag(it, earth) == ()
    bag.close()
    found = read(tmp_path / "bag.mcap")
    epoch = round(START.timestamp()) * 10**9
    wanted = defaultdict(list)
    for it in readings:
        now = epoch + round(it.at_s * 1e9)
        if isinstance(it, FixReading):
            place = it.fix.x_m, it.fix.y_m, it.fix.z_m
            held = epoch + round(it.fix.valid_at_s * 1e9)
            wanted[f"/{it.vehicle}/fix"].append((now, held, place, it.fix.sd_y_m**2))
        elif isinstance(it, UsblReading):
            topic = f"/{it.vehicle}/usbl/{it.auv}"
            spread = it.sight.covariance[1, 1]
            wanted[topic].append((now, now, it.sight.place.tolist(), spread))
        elif isinstance(it, EstimateReading):
            spread = it.covariance[1][1]
            wanted[f"/{it.vehicle}/odometry"].append((now, now, it.place, spread))
        elif isinstance(it, Truth):
            wanted[f"/truth/{it.vehicle}"].append((now, now, it.place, 0.0))
        elif isinstance(it, Gnss) and origin:
            (at, message), *found[f"/{it.vehicle}/gnss"] = found[f"/{it.vehicle}/gnss"]
            assert at == now
            ((x, y, _),) = ned_at_depth(
                [message.latitude], [message.longitude], [0.0], earth.origin
            )
            assert [x, y] == pytest.approx(it.place, abs=1e-6)
    for topic, rows in wanted.items():
        assert len(rows) == len(found[topic])
        for (now, held, place, variance), (at, message) in zip(rows, found[topic], strict=True):
            stamp = message.header.stamp
            assert (at, stamp.sec * 10**9 + stamp.nanosec) == (now, held)
            assert message.header.frame_id == "map"
            position = message.pose.pose.position
            assert (position.y, position.x, -position.z) == pytest.approx(place, abs=1e-12)
            assert message.pose.covariance[0] == pytest.approx(variance, abs=1e-12)
    assert {it.child_frame_id for _, tf in found["/tf"] for it in tf.transforms} >= {
        "ASV0", "AUV0/estimate",
    }  # fmt: skip
    clocks = [message.clock for _, message in found["/clock"]]
    assert [it.sec - epoch // 10**9 for it in clocks] == list(range(60))
    assert bool([it for it in found if it.endswith("navsat")]) == origin
    assert len([it for it in found if it.startswith("/truth")]) == 6


def test_headings_are_those_of_ros() -> None:
    """North is a quarter turn from x, east none."""
    from bindusbl_des.apps.live.ros2 import quaternion

    assert quaternion(math.pi / 2) == (0.0, 0.0, 0.0, 1.0)
    assert quaternion(0.0)[2:] == pytest.approx((math.sqrt(0.5), math.sqrt(0.5)))


def test_a_run_is_exported_as_a_bag(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each delivered fix, estimate and true place of the tables, and nothing that was lost."""
    monkeypatch.chdir(tmp_path)
    assert call("run", written(tmp_path), "--out", "run", "--no-advice").exit_code == 0
    done = call("export", "run", "--to", "ros2bag")
    assert done.exit_code == 0, done.output
    found = read(tmp_path / "run" / "live.ros2.mcap")
    result = Mission(tmp_path / "sea.yaml", 0).result()
    fixes, tracks = result.tables["fixes"], result.tables["tracks"]
    for auv in ("AUV0", "AUV1", "AUV2"):
        own = fixes[(fixes.auv == auv) & (fixes.outcome == "delivered")]
        north = [message.pose.pose.position.y for _, message in found[f"/{auv}/fix"]]
        assert north == pytest.approx(own.sort_values("delivered_at_s").x_m.tolist())
        east = [message.pose.pose.position.x for _, message in found[f"/{auv}/odometry"]]
        assert east == pytest.approx(tracks[tracks.vehicle == auv].estimate_y_m.tolist())
    assert call("run", "sea.yaml", "--out", "run", "--force", "--no-advice").exit_code == 0
    done = call("export", "run", "--to", "ros2bag")
    assert done.exit_code == 0
    assert call("export", "run", "--to", "ros2bag").exit_code == 2


def test_a_session_writes_a_bag(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    words = ("live", written(tmp_path), "--speed", "max", "--start", BEGINS)
    done = call(*words, "--to", "ros2/AUV0:file:bag.mcap", "--out", "flown")
    assert done.exit_code == 0, done.output
    found = read(tmp_path / "bag.mcap")
    assert set(found) == {"/AUV0/fix", "/AUV0/fix/navsat", "/AUV0/odometry", "/tf", "/clock"}
    assert np.diff([at for at, _ in found["/AUV0/odometry"]]).tolist() == [10**9] * 19
    refused = call(*words, "--to", "ros2:file:bag.mcap", "--out", "other")
    assert "bag.mcap: cannot be opened (File exists)" in refused.output
    refused = call(*words, "--to", "ros2:file:bag", "--out", "other")
    assert "write ros2:file:PATH.mcap" in refused.output

"""The records of buffers have what event classes have, and more that only missions need."""

from dataclasses import fields

import numpy as np
import pytest

from bindusbl_des.protocol.hf.calling import CALL, Call
from bindusbl_des.protocol.mf.reception import FRAME, Frame
from bindusbl_des.records.events import Fix, FrameReception, Ping, Reception
from bindusbl_des.records.rows import CALLED, FIX, FRAME_RECEPTION, PING, RECEPTION, SIGHT

LEFT_TO_TABLES = (
    *("asvs", "level_db", "margin_db"),
    *("misalignment_deg", "gnss_error_x_m", "gnss_error_y_m", "slow_range_error_m", "clock_late_s"),
)
SAID = [f"said_{it}" for it in ("x_m", "y_m", "xx_m2", "yy_m2", "xy_m2", "polar")]


@pytest.mark.parametrize(
    ("event", "kind", "further"),
    [
        (Ping, PING, ["call_time_s", "first", "end", "passed_at_s", "longest_s", "calls"]),
        (
            Reception,
            RECEPTION,
            ["listener", "loss", "slow_range", "sound", "bent_s", "late_s", "lowered", *SIGHT],
        ),
        (Fix, FIX, ["first", "end", "arrives_at_s", "frame", *SAID]),
        (FrameReception, FRAME_RECEPTION, ["ended_at_s"]),
        (Frame, FRAME, []),
        (Call, CALL, []),
    ],
)
def test_a_record_has_a_field_for_each_of_its_events(
    event: type, kind: np.dtype, further: list[str]
) -> None:
    """In their order; what no number stands for, or is worked out in tables, is left to these."""
    left = {*LEFT_TO_TABLES, *(["loss_probability"] if event is Reception else [])}
    told = [field.name for field in fields(event) if field.name not in left]
    assert list(kind.names) == told + further


def test_numbers_are_whole_where_they_count_or_name_something() -> None:
    """Vehicles, outcomes and counts; instants and places are not."""
    whole = {name for name in PING.names if PING[name].kind == "i"}
    assert whole == {
        "ping", "round", "slot", "auv", "asv", "in_range_of", "heard_by", "called_by", "call",
        "call_why",
        "first", "end", "calls",
    }  # fmt: skip
    assert {name for name in FIX.names if FIX[name].kind == "i"} == {
        "fix", "ping", "round", "auv", "broadcast_by", "outcome", "first", "end", "frame",
        "said_polar",
    }  # fmt: skip
    assert set(CALLED.names) < set(PING.names)

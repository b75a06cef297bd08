"""The columns of buffers are those of the event classes, whose order tables have."""

from dataclasses import fields

import pytest

from bindusbl_des.protocol.calling import Call
from bindusbl_des.records import columns as at
from bindusbl_des.records.events import Fix, Ping, Reception, TrackPoint
from bindusbl_des.records.recorder import Recorder

PING = {
    "ping": at.PING, "round": at.ROUND, "slot": at.SLOT, "auv": at.AUV, "sent_at_s": at.SENT_AT,
    "x_m": at.PING_X, "y_m": at.PING_Y, "z_m": at.PING_Z,
    "in_range_of": at.IN_RANGE_OF, "heard_by": at.HEARD_BY,
    "called_at_s": at.CALLED_AT, "called_by": at.CALLED_BY, "call": at.CALL,
}  # fmt: skip
RECEPTION = {
    "ping": at.OF_PING, "auv": at.OF_AUV, "asv": at.AT_ASV, "arrived_at_s": at.ARRIVED_AT,
    "slant_range_m": at.SLANT_RANGE, "travel_time_s": at.TRAVEL_TIME, "outcome": at.OUTCOME,
}  # fmt: skip
FIX = {
    "fix": at.FIX, "ping": at.PING_OF_FIX, "round": at.ROUND_OF_FIX, "auv": at.AUV_OF_FIX,
    "asvs": at.FUSED, "pinged_at_s": at.PINGED_AT, "valid_at_s": at.VALID_AT,
    "x_m": at.POSITION, "y_m": at.POSITION + 1, "z_m": at.POSITION + 2,
    "sd_x_m": at.SD, "sd_y_m": at.SD + 1, "sd_z_m": at.SD + 2,
    "cov_xy_m2": at.COVARIANCE, "cov_xz_m2": at.COVARIANCE + 1, "cov_yz_m2": at.COVARIANCE + 2,
    "error_m": at.ERROR, "broadcast_at_s": at.BROADCAST_AT, "broadcast_by": at.BROADCAST_BY,
    "delivered_at_s": at.DELIVERED_AT, "latency_s": at.LATENCY, "innovation_m": at.INNOVATION,
    "correction_m": at.CORRECTION, "nis": at.NIS, "outcome": at.OUTCOME_OF_FIX,
}  # fmt: skip
CALL = {
    "sent_at_s": at.CALL_SENT_AT, "asv": at.CALL_AT_ASV, "arrived_at_s": at.CALL_ARRIVED_AT,
    "longest_s": at.LONGEST_CALL,
}  # fmt: skip
TRACK_POINT = {
    "time_s": at.TIME, "vehicle": at.VEHICLE,
    "x_m": at.TRUTH, "y_m": at.TRUTH + 1, "z_m": at.TRUTH + 2, "yaw_rad": at.YAW,
    "estimate_x_m": at.ESTIMATE, "estimate_y_m": at.ESTIMATE + 1, "estimate_z_m": at.DEPTH,
    "imu_x_m": at.IMU, "imu_y_m": at.IMU + 1, "position_error_m": at.POSITION_ERROR,
    "cross_track_error_m": at.CROSS_TRACK_ERROR, "path_error_m": at.PATH_ERROR,
    "estimate_sd_x_m": at.ESTIMATE_SPREAD, "estimate_sd_y_m": at.ESTIMATE_SPREAD + 1,
    "estimate_cov_xy_m2": at.ESTIMATE_SPREAD + 2,
}  # fmt: skip


@pytest.mark.parametrize(
    ("event", "places"),
    [(Ping, PING), (Reception, RECEPTION), (Fix, FIX), (Call, CALL), (TrackPoint, TRACK_POINT)],
)
def test_columns_stand_where_the_event_has_its_fields(event: type, places: dict[str, int]) -> None:
    """Each field of an event has a column, at the field's position."""
    assert places == {field.name: place for place, field in enumerate(fields(event))}


def test_columns_that_only_missions_need_come_after_the_events() -> None:
    """They follow each other without a gap, and a buffer has room for them but does not tell."""
    told = len(fields(Ping))
    own = [at.CALL_TIME, at.FIRST, at.END, at.PASSED_AT, at.LONGEST, at.CALLS]
    assert own == list(range(told, at.PING_COLUMNS))
    told = len(fields(Fix))
    own = [at.FUSED_END, at.ARRIVES_AT]
    assert own == list(range(told, at.FIX_COLUMNS))
    assert len(fields(TrackPoint)) == at.TRACK_COLUMNS
    record = Recorder()
    for buffer, event, columns in (
        (record.pings, Ping, at.PING_COLUMNS),
        (record.receptions, Reception, len(fields(Reception))),
        (record.fixes, Fix, at.FIX_COLUMNS),
    ):
        assert (buffer.told, buffer.array.shape[1]) == (len(fields(event)), columns)

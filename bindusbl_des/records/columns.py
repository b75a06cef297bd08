"""The columns of the buffers: those of an event's class in order, then what only missions need.

A buffer (:class:`.recorder.EventBuffer`) is an array that compiled equations write to; labels are
numbers in it, and what has not happened is NaN.
"""

# events.Ping
PING, ROUND, SLOT, AUV, SENT_AT, PING_X, PING_Y, PING_Z, IN_RANGE_OF, HEARD_BY = range(10)
CALLED_AT, CALLED_BY, CALL = range(10, 13)
# How long (s) that call was under way; its receptions, FIRST up to END; the instant (s) at which
# all have passed, infinite when they are decided; the longest travel time (s) of any ping so far;
# how many calls (calling.Call) were on record when it was sent.
CALL_TIME, FIRST, END, PASSED_AT, LONGEST, CALLS = range(13, 19)
PING_COLUMNS = 19

# calling.Call
CALL_SENT_AT, CALL_AT_ASV, CALL_ARRIVED_AT, LONGEST_CALL = range(4)

# events.Reception
OF_PING, OF_AUV, AT_ASV, ARRIVED_AT, SLANT_RANGE, TRAVEL_TIME, OUTCOME = range(7)

# events.Fix: position and standard deviations (m), covariances xy, xz, yz (m2); in the place of the
# ASVs' names, FUSED is the first of the receptions that it may be made of
FIX, PING_OF_FIX, ROUND_OF_FIX, AUV_OF_FIX, FUSED, PINGED_AT, VALID_AT = range(7)
POSITION, SD, COVARIANCE, ERROR = 7, 10, 13, 16
BROADCAST_AT, BROADCAST_BY, DELIVERED_AT, LATENCY, INNOVATION = range(17, 22)
CORRECTION, NIS, OUTCOME_OF_FIX = 22, 23, 24
# Where those receptions end; when it reaches the AUV (s).
FUSED_END, ARRIVES_AT, FIX_COLUMNS = 25, 26, 27

# events.TrackPoint
TIME, VEHICLE, TRUTH, YAW, ESTIMATE, DEPTH, IMU = 0, 1, 2, 5, 6, 8, 9
POSITION_ERROR, CROSS_TRACK_ERROR, PATH_ERROR, ESTIMATE_SPREAD, TRACK_COLUMNS = 11, 12, 13, 14, 17

"""The columns of the ledgers: those of an event's class in order, then what only missions need.

A ledger (:class:`.recorder.Ledger`) is an array that compiled equations write to; labels are
numbers in it, and what has not happened is NaN.
"""

# events.Ping
PING, ROUND, SLOT, AUV, SENT_AT, PING_X, PING_Y, PING_Z, IN_RANGE_OF, HEARD_BY = range(10)
# Its receptions, FIRST up to END; the instant (s) at which all have passed, infinite when they are
# decided; the longest travel time (s) of any ping so far; who called, or -1, and how long (s) that
# call was under way.
FIRST, END, PASSED_AT, LONGEST, CALLER, CALL_TIME = range(10, 16)
PING_COLUMNS = 16

# events.Reception
OF_PING, OF_AUV, AT_ASV, ARRIVED_AT, SLANT_RANGE, TRAVEL_TIME, OUTCOME = range(7)

# events.Fix: position and standard deviations (m), covariances xy, xz, yz (m2); in the place of the
# ASVs' names, FUSED is the first of the receptions that it may be made of
FIX, PING_OF_FIX, ROUND_OF_FIX, AUV_OF_FIX, FUSED, PINGED_AT = range(6)
POSITION, SD, COVARIANCE, ERROR = 6, 9, 12, 15
BROADCAST_AT, BROADCAST_BY, DELIVERED_AT, LATENCY, INNOVATION, MOVED, OUTCOME_OF_FIX = range(16, 23)
# Where those receptions end; when it reaches the AUV (s); the sum of the AUV's corrections (m)
# from then on, along x and y.
FUSED_END, ARRIVES_AT, CORRECTION = 23, 24, 25
FIX_COLUMNS = 27

# events.TrackPoint
TIME, VEHICLE, TRUTH, YAW, ESTIMATE, DEPTH, IMU = 0, 1, 2, 5, 6, 8, 9
POSITION_ERROR, CROSS_TRACK_ERROR, PATH_ERROR, TRACK_COLUMNS = 11, 12, 13, 14

"""The entry `newest` of the benchmark: the newest fix is the truth (docs/benchmark.md)."""

import numpy as np


class Newest:
    """Dead reckoning from the newest fix on."""

    def __init__(self, reckoning, auvs):
        self.reckoning = reckoning
        self.known = [[(0.0, np.zeros(2), np.zeros(2))] for _ in range(auvs)]

    def correct(self, fixes, due):
        for fix in fixes[due]:
            off = np.array((fix.x_m, fix.y_m)) - self.reckoning.at(fix.auv, fix.valid_at_s)
            self.known[fix.auv].append(
                (fix.delivered_at_s, off, np.square((fix.sd_x_m, fix.sd_y_m)))
            )

    def estimate(self, auv, odometry):
        return odometry.position + self._latest(auv, odometry.times)[0]

    def covariance(self, auv, odometry):
        variances = self._latest(auv, odometry.times)[1]
        return np.column_stack((variances, np.zeros(len(variances))))

    def _latest(self, auv, times):
        since, offsets, variances = map(np.array, zip(*self.known[auv], strict=True))
        last = np.searchsorted(since, times, side="right") - 1
        return offsets[last], variances[last]

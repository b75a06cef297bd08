# %% [markdown]
# # A navigator of one's own against Kalman
#
# After this notebook you can put a navigator of your own in the place of the Kalman filter, and
# know when the filter earns its keep. The idea to try: believe the newest fix, and go on from it
# by dead reckoning.
#
# A part of one's own may stand in a cell; where workers need it (`sweep`, `plan`), in a module.

# %%
import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

from bindusbl_des import DeadReckoning, Navigator, Odometry, Scenario, simulate


class LastFix(Navigator):
    """The newest fix is the truth; dead reckoning goes on from there."""

    def __init__(self, reckoning: DeadReckoning, auvs: int):
        self.reckoning = reckoning
        self.known = [[(0.0, np.zeros(2), np.zeros(2))] for _ in range(auvs)]

    def correct(self, fixes, due):
        for fix in fixes[due]:  # it holds for the instant of the ping, and comes later
            believed = self.reckoning.at(fix.auv, fix.valid_at_s)
            offset = np.array((fix.x_m, fix.y_m)) - believed
            variance = np.square((fix.sd_x_m, fix.sd_y_m))
            self.known[fix.auv].append((fix.delivered_at_s, offset, variance))

    def estimate(self, auv: int, odometry: Odometry):
        return odometry.position + self._latest(auv, odometry.times)[0]

    def covariance(self, auv: int, odometry: Odometry):
        variance = self._latest(auv, odometry.times)[1]
        return np.column_stack((variance, np.zeros(len(variance))))

    def _latest(self, auv, times):
        since, offsets, variances = map(np.array, zip(*self.known[auv], strict=True))
        last = np.searchsorted(since, times, side="right") - 1
        return offsets[last], variances[last]


# %% [markdown]
# ## How good is it?
#
# Beside no fixes at all, the paper's fixed gain and the Kalman filter, under a good GNSS receiver
# on the vessels (0.2 m per axis) and a poor one (2 m).

# %%
FILTERS = {
    "dead_reckoning": "dead_reckoning",
    "LastFix": LastFix,
    "fixed_gain": "fixed_gain",
    "kalman": "kalman",
}
rows = []
for gnss_sd_m in (0.2, 2.0):
    for name, part in FILTERS.items():
        scenario = Scenario(
            name="bay",
            duration_s=200,
            usbl={"gnss_sd_m": gnss_sd_m},
            navigation={"filter": part},
        )
        for seed in range(3):
            auvs = simulate(scenario, seed=seed).auvs
            rows.append((gnss_sd_m, name, auvs.position_error_m.mean(), auvs.nees.mean()))
flown = pd.DataFrame(rows, columns=["gnss_sd_m", "filter", "error_m", "nees"])
means = flown.groupby(["gnss_sd_m", "filter"]).mean()
errors = means.error_m.unstack(0).loc[[*FILTERS]]
print(errors.round(2))

# %% [markdown]
# **With good fixes it does well**: some 0.6 m instead of almost 6 m, as good as the fixed gain,
# since it shifts each fix to the instant for which it holds. Kalman is better by a factor of two
# to three, for it takes the mean of many fixes.

# %%
good, poor = errors[0.2], errors[2.0]
assert good["LastFix"] < 0.12 * good["dead_reckoning"]
assert 2 < good["LastFix"] / good["kalman"] < 3.5

# %% [markdown]
# ## And with poor fixes?

# %%
print((poor / good).round(1))

# %% [markdown]
# **It passes all their noise on**: its error is four times as large, 2.5 m. The Kalman filter
# weighs a fix by its covariance, and stays below 1 m. Dead reckoning does not care, for it hears
# no fix.

# %%
assert 3.5 < poor["LastFix"] / good["LastFix"] < 5.5
assert poor["kalman"] < 1
assert poor["dead_reckoning"] == good["dead_reckoning"]

# %% [markdown]
# ## Does it know how wrong it is?
#
# NEES is the squared error over the covariance; of a filter that knows itself it is 2, by the two
# axes.

# %%
print(means.nees.unstack(0).loc[[*FILTERS]].round(1))

# %% [markdown]
# **Almost**: between fixes it is a little too sure, since its covariance does not grow while it
# drifts. Try to add the drift (`navigation.random_walk_m_per_sqrt_s`), and see it fall.

# %%
assert 1.5 < means.nees[2.0]["LastFix"] < 2.5

# %%
errors.plot.barh(logx=True)
plt.xlabel("mean error, m")
plt.show()

# %% [markdown]
# # A campaign and its doubt
#
# After this notebook you can say whether one plan is better than another, how sure that is, and
# how many missions it takes to know. Two vessels stand beside a survey of 140 m. Is it better to
# have them at 75 or at 90 degrees?

# %%
import matplotlib.pyplot as plt
import numpy as np

from bindusbl_des import Scenario, compare, sweep

harbour = Scenario.model_validate(
    {
        "name": "harbour",
        "duration_s": 120,
        "survey": {"side_m": 140, "depth_m": 10},
        "auvs": {"count": 3},
        "asvs": {"count": 2},
        "acoustics": {"hf": {"range_m": 60}, "mf": {"range_m": 150}},
    }
)
SEEDS = 16
campaign = sweep(harbour, vary={"asvs.formation.angle_deg": [75, 90]}, seeds=SEEDS, workers=1)
errors = campaign.missions.pivot(
    index="seed", columns="asvs.formation.angle_deg", values="worst_position_error_m"
)
print(errors.round(3))

# %% [markdown]
# ## What does one mission say?
#
# Seed 13 alone says that **90 degrees are better**. Seed 8 says the opposite, by more than a
# factor of two. A seed is a throw of the dice: noise of the instruments, biases of the inertial
# systems.

# %%
assert errors[90][13] < errors[75][13]
assert errors[90][8] > 2 * errors[75][8]

# %% [markdown]
# ## What do all of them say?
#
# Both points fly the same seeds, so that each seed gives a difference. `compare` has the mean of
# the differences and its 95 % interval.

# %%
table = compare(campaign, by="asvs.formation.angle_deg", metrics=["worst_position_error_m"])
print(table.said[0])

# %% [markdown]
# **75 degrees are better**: the interval of the difference lies above 0, and seed 13 was luck.

# %%
assert table.verdict[0] == "worse"
assert table.low[0] > 0

# %% [markdown]
# ## What were the pairs worth?
#
# Had each point flown seeds of its own, the variances of both would add up. In pairs, luck that
# both share cancels.

# %%
difference = errors[90] - errors[75]
paired = difference.std()
unpaired = np.sqrt(errors[75].var() + errors[90].var())
print(f"standard deviation of a difference: {paired:.3f} m in pairs, {unpaired:.3f} m without")
saved = 1 - (paired / unpaired) ** 2
print(f"pairs save {saved:.0%} of the missions")

# %% [markdown]
# **Some of the missions**, as intervals shrink with the square root of their number: the more
# alike two plans are, the more of them.

# %%
assert 0 < saved < 0.9

# %% [markdown]
# ## How many missions would show 3 cm?
#
# The half width of the interval is about 2 sd / √n, so n is about (2 sd / 0.03 m)².

# %%
needed = int(np.ceil((2 * paired / 0.03) ** 2))
print(f"some {needed} seeds, four times those of 6 cm")

# %% [markdown]
# **Some 40 to 60**: four times as many missions for half the doubt. `sweep(...,
# until_ci={"worst_position_error_m": 0.03})` stops by itself when it is sure enough.

# %%
assert SEEDS < 40 <= needed <= 60

# %%
counts = np.arange(3, SEEDS + 1)
means = np.array([difference[:n].mean() for n in counts])
halves = np.array([2 * difference[:n].std() / np.sqrt(n) for n in counts])
plt.fill_between(counts, means - halves, means + halves, alpha=0.3)
plt.plot(counts, means)
plt.axhline(0, color="black", linewidth=0.8)
plt.xlabel("seeds")
plt.ylabel("90 degrees worse than 75 by, m")
plt.show()

# %% [markdown]
# # Four ways to share the band, in metres
#
# After this notebook you know what a MAC costs and gains in navigation: four programs of access on
# the same seeds, by the error of the worst AUV, the energy of the modems and fairness, with paired
# intervals. Papers compare throughput; a survey wants to know where its vehicles are.
#
# Twelve AUVs, two vessels, something to send each 3.6 s on average; pings of 10 ms, as a USBL's
# are, and of 300 ms, as long as a short message.

# %%
import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

from bindusbl_des import Scenario, simulate

MACS, SEEDS, T_95 = ("aloha", "csma", "t_lohi", "macau"), 6, 2.571  # Student's t, 5 degrees
rows = []
for ping_s in (0.01, 0.3):
    for access in MACS:
        scenario = Scenario.model_validate(
            {
                "name": "macs",
                "duration_s": 240,
                "survey": {"side_m": 200},
                "auvs": {"count": 12},
                "asvs": {"count": 2},
                "acoustics": {
                    "hf": {
                        "range_m": 150,
                        "ping_s": ping_s,
                        "transmit_w": 10,
                        "receive_w": 1,
                        "idle_w": 0.1,
                    },
                    "mf": {"range_m": 300},
                },
                "protocol": {"access": access, "frame_s": 3.6},
            }
        )
        for seed in range(SEEDS):
            mission = simulate(scenario, seed=seed).mission.iloc[0]
            rows.append({"ping_s": ping_s, "access": access, "seed": seed, **mission})
flown = pd.DataFrame(rows)
COLUMNS = ["worst_position_error_m", "energy_j", "fairness", "pings_heard", "collisions"]
means = flown.groupby(["ping_s", "access"])[COLUMNS].mean()
print(means.round(2).to_string())


def against_aloha(metric: str, ping_s: float) -> pd.DataFrame:
    """Return mean and half-width of the paired difference of each MAC from ALOHA."""
    of_pings = flown[flown.ping_s == ping_s]
    each = of_pings.pivot_table(index="seed", columns="access", values=metric)
    more = each[list(MACS[1:])].sub(each["aloha"], axis=0)
    return pd.DataFrame({"mean": more.mean(), "half": T_95 * more.std() / np.sqrt(SEEDS)})


# %% [markdown]
# ## Is it worth listening before pings of 10 ms?
#
# **No.** Carrier sensing changes nothing that six paired missions show, and to reserve the band
# costs more time than the collisions: the worst AUV is farther off with T-Lohi and MACA-U.

# %%
short = against_aloha("worst_position_error_m", 0.01)
print(short.round(2).to_string())
assert abs(short.loc["csma", "mean"]) < max(short.loc["csma", "half"], 0.1)
assert short.loc["t_lohi", "mean"] > short.loc["t_lohi", "half"]
assert short.loc["macau", "mean"] > short.loc["macau", "half"]

# %% [markdown]
# ## And before pings of 300 ms?
#
# **Yes: now ALOHA's pings meet**, and with carrier sensing the worst AUV errs by less, surely.

# %%
long = against_aloha("worst_position_error_m", 0.3)
print(long.round(2).to_string())
assert long.loc["csma", "mean"] < -long.loc["csma", "half"]
assert means.loc[(0.3, "aloha"), "collisions"] > 2 * means.loc[(0.3, "csma"), "collisions"]

# %% [markdown]
# ## Who spends least, and is it fair?
#
# **Whoever reserves the band sends fewer pings that nobody decodes**: T-Lohi takes less than half
# of ALOHA's energy. MACA-U pays for that with fairness, of which carrier sensing has most.

# %%
energy = against_aloha("energy_j", 0.3)
print(energy.round(0).to_string())
assert (energy["mean"] < -energy["half"]).all()
assert means.loc[(0.3, "t_lohi"), "energy_j"] < 0.5 * means.loc[(0.3, "aloha"), "energy_j"]
assert means.loc[0.3].fairness.idxmax() == "csma"
assert means.loc[(0.3, "macau"), "fairness"] < means.loc[(0.3, "csma"), "fairness"]

# %%
axes = means.worst_position_error_m.unstack("ping_s").plot.bar()
axes.set_ylabel("worst AUV's mean error, m")
plt.show()

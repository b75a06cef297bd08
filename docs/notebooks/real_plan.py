# %% [markdown]
# # A real plan
#
# After this notebook you can go from a polygon drawn on a map and the sheets of your instruments
# to a team, its place, and what would break the plan. Two AUVs survey a cove at 12 m depth; the
# worst of them shall be within 0.5 m on average. Does one surface vessel do?

# %%
import json
from pathlib import Path

import matplotlib.pyplot as plt

from bindusbl_des import load_scenario, plan, simulate

# Longitude and latitude, as QGIS and Google Earth have them
CORNERS = [
    (10.1600, 54.3920), (10.1624, 54.3923), (10.1631, 54.3932), (10.1620, 54.3938),
    (10.1609, 54.39315), (10.1598, 54.39305),
]  # fmt: skip
polygon = {"type": "Polygon", "coordinates": [[*CORNERS, CORNERS[0]]]}
Path("cove.geojson").write_text(json.dumps(polygon))
Path("cove.yaml").write_text("""
name: cove
duration_s: survey
survey: {area: cove.geojson, depth_m: 12}
environment: {temperature_c: 9, salinity_psu: 16}
auvs:
  count: 2
  speed_m_per_s: 1.5
  route: {lane_spacing_m: 25, division: equal_length, start: strip_corner}
asvs: {count: 1}
acoustics:
  hf: {range_m: 120}                       # pings are trusted up to here
  mf: {modem: s2c_instant, range_m: 500}   # EvoLogics S2C instant messages
usbl:                                      # the sheet: 1 deg, 0.2 m and 0.5 %
  model: {model: datasheet, bearing_sd_deg: 1, range_sd_m: 0.2, range_sd_percent: 0.5}
  heading_sd_deg: 0.5
  gnss_sd_m: 0.5
navigation:
  initial_position_sd_m: 3
  drift: {percent_of_distance: 0.5, statistic: cep}
""")
cove = load_scenario("cove.yaml")
print(f"the survey takes {cove.duration_s:.0f} s")

# %% [markdown]
# ## How many vessels, and where?
#
# `plan` proposes teams, predicts them, and flies the promising ones until the answer is sure.

# %%
answer = plan(
    "cove.yaml",
    "answer",
    below={"position_error_m": 0.5},
    vary={"asvs.count": [1, 2], "protocol.downlink": ["sequential"]},
    workers=1,
    force=True,
)
print(answer.summary())

# %% [markdown]
# **One vessel, near the middle**: it leaves the worst AUV some 0.36 m off, surely below 0.5 m.

# %%
team = answer.record["candidates"][answer.record["chosen"]]
assert answer.answer["asvs.count"] == 1
assert 0.3 < team["simulated"]["mean"][0] < 0.4
assert team["simulated"]["high"][0] < 0.5

# %% [markdown]
# ## What would break it?

# %%
doubts = {doubt["told"]: doubt for doubt in answer.record["sensitivity"] if not doubt["known"]}
verdicts = {True: "met", False: "not met", None: "undecided"}
for told, doubt in doubts.items():
    print(f"{doubt['mean'][0]:.2f} m   {verdicts[doubt['met']]:<9}   {told}")

# %% [markdown]
# **Shorter ranges and a wrong speed of sound.** Pings that are heard 20 % less far cost the goal,
# and so does a cast that is old enough to be 1 % wrong. Twice the drift does not.

# %%
broken = {told for told, doubt in doubts.items() if doubt["met"] is False}
assert broken >= {"ranges -20 %", "speed of sound taken 1 % too high"}
assert doubts["drift x 2"]["met"]

# %% [markdown]
# ## A better USBL, or a better inertial system?

# %%
binding = {it["what"]: it["value"] for it in answer.record["binding"]}
print({what: round(value, 2) for what, value in binding.items()})

# %% [markdown]
# **The USBL**: with half its noise the error is predicted to be 0.2 m, with half the drift 0.3 m.

# %%
assert binding["fix_noise"] < 0.25 < binding["drift"]

# %% [markdown]
# ## Would a second vessel make the plan safe from a wrong speed of sound?
#
# Fly the best team of two under that doubt.

# %%
two = next(it for it in answer.record["candidates"] if it["keys"]["asvs.count"] == 2)
wrong = doubts["speed of sound taken 1 % too high"]["keys"]
changes = [f"{key}={json.dumps(value)}" for key, value in (two["keys"] | wrong).items()]
doubted = load_scenario("cove.yaml", overrides=changes)
errors = [simulate(doubted, seed=seed).auvs.position_error_m.max() for seed in range(4)]
print(f"{sum(errors) / len(errors):.2f} m")

# %% [markdown]
# **Yes**: on opposite sides their errors of range all but cancel, and the goal is met. A fresh
# cast does the same for less.

# %%
assert sum(errors) / len(errors) < 0.5

# %%
simulate(answer.scenario, seed=0).plot("trajectory")
plt.show()  # for the boss: answer/plan.html; for the skipper: bindusbl-des export answer --to kml

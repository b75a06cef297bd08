"""What a plan takes rounds to be is what the downlinks make of them."""

import numpy as np
import pytest
from plans_for_tests import inputs_of

from bindusbl_des import Setup, load_scenario
from bindusbl_des.apps.planning.prediction.rounds import timed, uplink_slot
from bindusbl_des.core.protocol.cycles import cycle
from bindusbl_des.core.scenario.families import DOWNLINK

AUVS = 5


@pytest.mark.parametrize("tick_rate_hz", ["null", "30"])
@pytest.mark.parametrize("bit_rate_bps", [300, 20_000])
@pytest.mark.parametrize("downlink", DOWNLINK.siblings)
def test_rounds_of_a_plan_go_as_the_downlinks_have_them(
    downlink: str, bit_rate_bps: int, tick_rate_hz: str
) -> None:
    """Slots, broadcasts and lengths, of all groups and fixes that a round may have, whether uplink
    slots or frames are the longer ones.
    """
    scenario = load_scenario(
        "baseline_60m",
        overrides=[
            *(f"auvs.count={AUVS}", f"protocol.downlink={downlink}"),
            *(f"acoustics.mf.bit_rate_bps={bit_rate_bps}", f"protocol.tick_rate_hz={tick_rate_hz}"),
            *("protocol.shortest_downlink_slot_s=0.05", "protocol.schedule=spatial_reuse"),
        ],
    )
    inputs, slots = inputs_of(Setup(scenario)), Setup(scenario).slots
    uplink = uplink_slot(inputs.slots, inputs.hf.range_m, inputs.hf.by_slant)
    many = [(groups, fixes) for groups in range(1, AUVS + 1) for fixes in range(AUVS + 1)]
    pitch, send, _, period, broadcasts = timed(inputs, uplink, *np.array(many, dtype=float).T)
    for number, (groups, fixes) in enumerate(many):
        found = cycle(downlink, slots, groups, fixes)
        assert period[number] == pytest.approx(found.length_s)
        assert broadcasts[number] == len(found.broadcasts_s)
        if groups > 1:
            apart = (found.slots_s[-1] - found.slots_s[0]) / (groups - 1)
            even = not DOWNLINK.traits[downlink].by_group or fixes % groups == 0
            assert not even or pitch[number] == pytest.approx(apart)
        if broadcasts[number] == 1 and groups == 1:
            assert send[number] == pytest.approx(found.broadcasts_s[0])

"""A round in time by the downlinks' own generators, beside closed forms of how long it lasts."""

from dataclasses import replace
from typing import Any

import pytest

from bindusbl_des import Setup, load_scenario
from bindusbl_des.core.protocol.cycles import cycle


def _uplink(slots: Any, groups: int) -> float:
    ends = 0.0
    for _ in range(groups):
        ends = slots.clock.after(ends, slots.uplink_slot)
    return ends


def _downlink(slots: Any, fixes: int, named: int = 0) -> float:
    return slots.clock.after(0.0, slots.downlink_slot(fixes, named))


@pytest.mark.parametrize("name", ["baseline_60m_tdma", "recovery_140m", "recovery_140m_s2c"])
@pytest.mark.parametrize("longer", [1.0, 3.0])
@pytest.mark.parametrize("shortest_s", [None, 0.0])
def test_rounds_last_as_long_as_their_slots_say(
    name: str, longer: float, shortest_s: float | None
) -> None:
    """Sequential rounds add up, pipelined ones last as long as the longer of both bands."""
    slots = Setup(load_scenario(name)).slots
    slots = replace(slots, uplink_slot=longer * slots.uplink_slot)
    if shortest_s is not None:
        slots = replace(slots, shortest_downlink=shortest_s)
    for groups in range(1, 6):
        up = _uplink(slots, groups)
        for fixes in range(7):
            for named in (0, 3):
                down = _downlink(slots, fixes, named)
                both = cycle("sequential", slots, groups, fixes, named).length_s
                assert both == slots.clock.after(up, slots.downlink_slot(fixes, named))
                longest = cycle("pipelined_round", slots, groups, fixes, named).length_s
                assert longest == pytest.approx(max(up, down), abs=1e-12)
            each, more = divmod(fixes, groups)
            shares = [_downlink(slots, each + (k < more)) for k in range(groups)]
            by_group = sum(max(_uplink(slots, 1), share) for share in shares)
            found = cycle("pipelined_group", slots, groups, fixes)
            assert found.length_s == pytest.approx(by_group, abs=1e-12)
            assert len(found.slots_s) == len(found.broadcasts_s) == groups
        assert cycle("direct_reply", slots, groups, 0).length_s == up
        assert cycle(None, slots, groups, 0).length_s == up


def test_a_round_without_groups_is_a_downlink_slot() -> None:
    """With random access a cycle of the downlink is no longer than its broadcast."""
    slots = Setup(load_scenario("baseline_60m_tdma")).slots
    assert cycle("sequential", slots, 0, 4).length_s == _downlink(slots, 4)


def test_broadcasts_begin_when_they_do_in_a_mission() -> None:
    """A sequential round broadcasts once its slots are over, and the next begins after that."""
    slots = Setup(load_scenario("recovery_140m")).slots
    found = cycle("sequential", slots, 3, 3)
    assert found.slots_s == tuple(_uplink(slots, n) for n in range(3))
    assert found.broadcasts_s == (_uplink(slots, 3),)

"""Rangings, channels and instruments of somebody's own: as good as those that ship, and checked."""

import math
from collections.abc import Callable, Generator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands_for_tests import each_explained
from worlds import QUIET_NAVIGATION, QUIET_USBL, scenario, still

from bindusbl_des import Result, Scenario, Signals, Slot, Sounding, View, simulate, sweep
from bindusbl_des.core.protocol.ranging import nearest
from bindusbl_des.core.protocol.slots import two_way_uplink_slot
from bindusbl_des.core.records.events import HEARD

Steps = Generator[Any, Any, None]
PING = 0.01  # s, the default


def disc(signals: Signals) -> np.ndarray:
    """The channel that ships, without loss."""
    away = signals.auvs[:, None, :2] - signals.asvs[None, :, :2]
    return np.hypot(away[..., 0], away[..., 1]) <= signals.reach


def half(signals: Signals) -> np.ndarray:
    """Every other signal is lost, at any range."""
    return np.full(signals.ranges.shape, 0.5)


def on_time(slot: Slot, time: float) -> Steps:
    """The one-way ranging that ships."""
    slot.ping(slot.group, time)
    yield slot.until(time)


def called(slot: Slot, time: float) -> Steps:
    """The two-way ranging that ships, without a turnaround."""
    callers = nearest(slot.view, slot.group)
    calls = slot.call(slot.group, callers, time)
    answers = []
    for k, auv in enumerate(slot.group):
        if calls[k].call == HEARD:
            answers.append((time + calls[k].call_time_s + PING, k, auv))
        else:
            slot.ping([auv], time, calls[k : k + 1])
    for answer, k, auv in sorted(answers):
        yield slot.until(answer)
        slot.ping([auv], answer, calls[k : k + 1])


called.slot_s = lambda ping_s, way_s, crossing_s: two_way_uplink_slot(  # type: ignore[attr-defined]
    ping_s, way_s, 0.0, crossing_s
)


def compass(sounding: Sounding, *, sd_m: float = 0.5) -> tuple[np.ndarray, np.ndarray]:
    """Fixes with the same error along all axes."""
    count = len(sounding.asvs)
    off = sd_m * sounding.random.standard_normal((count, 3))
    return sounding.source + off, np.tile(sd_m**2 * np.eye(3), (count, 1, 1))


def small(**changes: Any) -> Scenario:
    """Return a minute with losses at the edge of the range, and pings that may collide."""
    base: dict[str, Any] = {
        "duration_s": 40.0,
        "survey": {"side_m": 90.0},
        "acoustics": {"loss": {"law": "none"}},
    }
    return scenario(**{**base, **changes})


def same(one: Result, other: Result) -> bool:
    """Tell whether two missions have equal tables."""
    return all(table.equals(other.tables[name]) for name, table in one.tables.items())


@pytest.mark.parametrize("ranging", ["owtt_sync", "twtt"])
def test_a_disc_of_ones_own_is_the_disc(ranging: str) -> None:
    """Asked for every group, it gives every table bit for bit what the compiled one gives."""
    protocol = {"ranging": ranging}
    hf = {"channel": disc, "range_m": 45.0}
    own = small(acoustics={"hf": hf, "loss": {"law": "none"}}, protocol=protocol)
    shipped = small(acoustics={"hf": {"range_m": 45.0}, "loss": {"law": "none"}}, protocol=protocol)
    found = simulate(own, 3)
    assert same(found, simulate(shipped, 3))
    assert {"heard", "out_of_range"} <= set(found.tables["receptions"].outcome)


@pytest.mark.parametrize(("way", "shipped"), [(on_time, "owtt_sync"), (called, "twtt")])
def test_a_ranging_of_ones_own_can_be_one_that_ships(way: Callable[..., Any], shipped: str) -> None:
    """Written with the words of a slot, it gives the same tables bit for bit."""
    loss = {"law": "head", "combine": "clamp_first"}
    worlds = [
        small(acoustics={"loss": loss, "hf": {"range_m": 60.0}}, protocol={"ranging": ranging})
        for ranging in (way, shipped)
    ]
    own, other = (simulate(world, 5) for world in worlds)
    for name, table in own.tables.items():
        if name == "pings" and shipped == "twtt":  # calls not answered by the end are its own
            assert len(table) >= len(other.tables[name]) - 4
        elif name not in ("auvs", "mission"):
            assert table.equals(other.tables[name]), name
    told = ("latency_from_slot_s",)  # only shipped ones are known to begin with their slots
    assert own.auvs.drop(columns=list(told)).equals(other.auvs.drop(columns=list(told)))


def test_chances_of_ones_own_are_kept() -> None:
    """Half of all receptions are lost, by the same luck whoever is asked."""
    world = still(
        1, duration_s=900.0, acoustics={"hf": {"channel": half}}, navigation=QUIET_NAVIGATION
    )
    outcomes = simulate(world, 1).tables["receptions"].outcome
    decided = outcomes[outcomes != "in_flight"]
    assert set(decided) == {"heard", "lost"}
    assert (decided == "lost").mean() == pytest.approx(0.5, abs=4 * 0.5 / math.sqrt(len(decided)))


def test_an_instrument_of_ones_own_is_fused_as_any() -> None:
    """Two ASVs that measure to 0.5 m make fixes of 0.5 m / sqrt(2), and say so."""
    world = still(
        1, at=10.0, duration_s=900.0, navigation=QUIET_NAVIGATION,
        usbl={**QUIET_USBL, "model": {"model": compass, "sd_m": 0.5}},
        asvs={"count": 2, "formation": {"radius_m": 5.0}},
    )  # fmt: skip
    fixes = simulate(world, 2).tables["fixes"]
    assert len(fixes) > 1000
    assert set(fixes.asvs) == {"ASV0 ASV1"}
    assert fixes.sd_x_m.to_numpy() == pytest.approx(0.5 / math.sqrt(2))
    rms = math.sqrt((fixes.error_m**2).mean() / 2)
    assert rms == pytest.approx(0.5 / math.sqrt(2), rel=4 / math.sqrt(2 * 2 * len(fixes)))


def in_place(sounding: Sounding) -> Any:
    """The fixes of `compass`, made where the source is told."""
    fixes = []
    for _ in sounding.asvs:
        place = sounding.source
        place += 0.5 * sounding.random.standard_normal(3)
        fixes.append(place)
    return fixes, np.tile(0.25 * np.eye(3), (len(fixes), 1, 1))


def test_an_instrument_that_changes_its_source_still_errs() -> None:
    """The error of a fix is measured from where the AUV was, not from what the part made of it."""
    world = still(1, at=10.0, duration_s=20.0, usbl={**QUIET_USBL, "model": in_place})
    fixes = simulate(world, 2).tables["fixes"]
    assert len(fixes) > 10
    off = np.hypot(*(fixes[["x_m", "y_m"]].to_numpy() - (10.0, 0.0)).T)
    assert fixes.error_m.to_numpy() == pytest.approx(off)
    assert off.min() > 0.0


OWN = {
    "channel": {"acoustics": {"hf": {"channel": half}}},
    "ranging": {"protocol": {"ranging": called}},
    "instrument": {"usbl": {"model": compass}},
}


@pytest.mark.parametrize(
    "part", [pytest.param(it, marks=() if it == "channel" else pytest.mark.slow) for it in OWN]
)
def test_workers_and_explain_know_parts_of_ones_own(part: str, tmp_path: Path) -> None:
    """In a worker process they do what they do here; explaining says that they decided."""
    world = small(**{**OWN[part], "duration_s": 10.0})
    campaign = sweep(world, vary={"auvs.count": [2, 3]}, seeds=2, workers=1, out=tmp_path / "s")
    table = campaign.missions
    alone = simulate(Scenario.model_validate({**world.model_dump(), "auvs": {"count": 3}}), 1)
    errors = table.position_error_m.round(12).tolist()
    assert round(float(alone.mission.position_error_m[0]), 12) in errors
    result = simulate(world, 0)
    told = "".join(each_explained(result, "ping", range(8)))
    words = {"channel": "by the channel test_own_bands:half", "ranging": ":called: the plug-in"}
    assert words.get(part, "") in " ".join(told.split())


def short(signals: Signals) -> np.ndarray:
    return np.ones(1)


def certain(signals: Signals) -> np.ndarray:
    return np.full(signals.ranges.shape, 1.5)


def plain(slot: Slot, time: float) -> float:
    return time


def endless(slot: Slot, time: float) -> Steps:
    slot.ping([99], time)
    yield slot.until(time)


def early(slot: Slot, time: float) -> Steps:
    slot.ping(slot.group, time + 1.0)
    yield slot.until(time)


def waits(slot: Slot, time: float) -> Steps:
    yield time


def timeless(slot: Slot, time: float) -> Steps:
    yield slot.until(time)


timeless.slot_s = lambda *durations: "long"  # type: ignore[attr-defined]


def lame(sounding: Sounding) -> Any:
    return sounding.source, np.eye(3)


def crooked(sounding: Sounding) -> Any:
    count = len(sounding.asvs)
    return np.zeros((count, 3)), np.tile(-np.eye(3), (count, 1, 1))


def nothing(sounding: Sounding) -> None:
    pass


def blinding(view: View) -> list[list[int]]:
    """Each AUV in a slot of its own; it spoils what it was told."""
    view.heard[:], view.auvs[:], view.asvs[:] = True, 1e9, -1e9
    return [[auv] for auv in range(len(view.auvs))]


def test_a_schedule_spoils_its_own_view_only() -> None:
    """Who calls, and how many conflicts are recorded, goes by what the fleet knows."""
    results = [
        simulate(small(duration_s=10.0, protocol={"ranging": "twtt", "schedule": schedule}), 1)
        for schedule in (blinding, "one_per_slot")
    ]
    assert same(*results)


def forged(slot: Slot, time: float) -> Steps:
    calls = slot.call(slot.group, [0] * len(slot.group), time)
    calls.called_by[:] = 77
    slot.ping(slot.group[:1], time, calls[:1])
    yield slot.until(time)


def swapped(slot: Slot, time: float) -> Steps:
    calls = slot.call(slot.group, [0] * len(slot.group), time)
    slot.ping(slot.group, time, calls[:1])
    yield slot.until(time)


def grown(slot: Slot, time: float) -> Steps:
    slot.group.append(7)
    slot.ping([7], time)
    yield slot.until(time)


def never(slot: Slot, time: float) -> Steps:
    yield slot.until(math.nan)


def lost(sounding: Sounding) -> Any:
    count = len(sounding.asvs)
    return np.full((count, 3), 1e200), np.tile(np.eye(3), (count, 1, 1))


def imaginary(sounding: Sounding) -> Any:
    count = len(sounding.asvs)
    return np.full((count, 3), 1j), np.tile(np.eye(3), (count, 1, 1))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"protocol": {"ranging": forged}}, "as it is, and of the one AUV"),
        ({"protocol": {"ranging": swapped}}, "as it is, and of the one AUV"),
        ({"protocol": {"ranging": grown}}, "the AUVs of the slot are .* got .7."),
        ({"protocol": {"ranging": never}}, "nan s is no instant"),
        ({"usbl": {"model": lost}}, "no fix farther off than 1e.06 m"),
        ({"usbl": {"model": imaginary}}, "finite, symmetric"),
        ({"acoustics": {"hf": {"channel": short}}}, "an array of probabilities in"),
        ({"acoustics": {"hf": {"channel": certain}}}, "an array of probabilities in"),
        ({"protocol": {"ranging": plain}}, "it must be a generator function"),
        ({"protocol": {"ranging": endless}}, "the AUVs of the slot are .* got .99."),
        ({"protocol": {"ranging": early}}, "wait with `yield slot.until"),
        ({"protocol": {"ranging": waits}}, "it must be an event"),
        ({"protocol": {"ranging": timeless}}, "slot_s of 'long'; it must be a time in s"),
        ({"usbl": {"model": lame}}, r"it must be fixes \(1, 3\)"),
        ({"usbl": {"model": crooked}}, "finite, symmetric and not below 0"),
        ({"usbl": {"model": nothing}}, r"measured None .* it must be fixes"),
    ],
)
def test_what_they_answer_is_checked(changes: dict[str, Any], message: str) -> None:
    """A mistake of theirs names the key, the part, and what it should have been."""
    with pytest.raises(ValueError, match=message) as caught:
        simulate(small(**{**changes, "duration_s": 5.0}), 0)
    assert str(caught.value).startswith(("acoustics.hf.channel", "protocol.ranging", "usbl.model"))

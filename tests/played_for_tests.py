"""Missions by a script: who is where when, who pings and who broadcasts at which instant."""

from collections.abc import Generator, Sequence
from typing import Any

from worlds import QUIET_NAVIGATION, QUIET_USBL, merged, scenario

from bindusbl_des import Scenario, broadcast, ping_group, until

Track = Sequence[Sequence[float]]
SOUND = 1500.0  # m/s
PING = 0.01  # s


def at(x: float, y: float = 0.0, z: float = 0.0) -> Track:
    """Return the track of a vehicle that keeps its place (m)."""
    return moving(x, 0.0, y, z)


def moving(x: float, speed: float, y: float = 0.0, z: float = 0.0) -> Track:
    """Return the track of a vehicle that goes along x for 100 s, at `x` (m) at 0 s."""
    return [(0.0, x, y, z), (100.0, x + 100.0 * speed, y, z)]


def played(
    auvs: Sequence[Track],
    asvs: Sequence[Track],
    *,
    pings: Sequence[tuple[float, int | list[int]]] = (),
    calls: Sequence[tuple[float, int, int]] = (),
    frames: Sequence[tuple[float, int]] = (),
    airtime: float = 0.5,
    **changes: Any,
) -> Scenario:
    """Return a quiet mission of 10 s on the exact clock without loss: vehicles by their tracks,
    pings (when, by whom), calls that nobody answers (when, of which AUV, by which ASV), and frames
    (when, by which ASV) of all fixes made since the last one, of which one fix lasts `airtime` (s).

    HF carries 3 km, MF 500 m.  `changes` may give another `ranging`, which has all AUVs in one
    slot, another `downlink`, and other sections.
    """
    lasts, away = changes.pop("duration_s", 10.0), changes.pop("hf_range", 3000.0)
    metric = changes.pop("metric", "slant")

    def ranging(slot: Any, time: float) -> Generator[Any, Any, None]:
        for instant, who, *asv in sorted([*pings, *calls], key=lambda it: it[0]):
            yield slot.until(instant)
            auvs = who if isinstance(who, list) else [who]
            if asv:
                slot.call(auvs, asv, instant)
            else:
                slot.ping(auvs, instant)

    def downlink(network: Any, turn: Any, time: float) -> Generator[Any, Any, float]:
        slot = ping_group(network, turn, 0, time)
        over = next(slot)
        for instant, _ in frames:
            yield until(network, instant)
            broadcast(network, turn, instant)
        yield over
        return (yield from slot)

    def broadcaster(view: Any) -> int:
        return frames[view.number][1]

    def schedule(view: Any) -> list[list[int]]:
        return [list(range(len(auvs)))]

    def route(plan: Any) -> list[Track]:
        return list(auvs)

    def stations(plan: Any) -> list[tuple[float, float]]:
        return [(track[0][1], track[0][2]) for track in asvs]

    def vessel(way: Any) -> Track:
        return asvs[way.number]

    base: dict[str, Any] = {
        "duration_s": lasts,
        "survey": {"side_m": 60.0},
        "auvs": {"count": len(auvs), "route": {"kind": route}},
        "asvs": {"count": len(asvs), "formation": {"model": stations}, "vehicle": vessel},
        "acoustics": {
            "hf": {"range_m": away, "range_metric": metric},
            "mf": {"range_m": 500.0, "bit_rate_bps": 24 * 16 / airtime},
            "loss": {"law": "none"},
        },
        "protocol": {
            "schedule": schedule, "ranging": changes.pop("ranging", ranging),
            "downlink": changes.pop("downlink", downlink), "broadcaster": broadcaster,
            "tick_rate_hz": None, "shortest_uplink_slot_s": 2.0 * lasts,
        },
        "usbl": QUIET_USBL,
        "navigation": {**QUIET_NAVIGATION, "filter": {"model": "fixed_gain", "gain": 0.5}},
    }  # fmt: skip
    return scenario(**merged(base, changes))

"""The methods that come with the benchmark, and those of its users.

A method is a name here, a user-defined part (`module:object`), or recorded estimates (a Parquet
file, :mod:`.recorded`).
"""

from collections.abc import Generator, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from ...core.mission.mission import Mission
from ...core.navigation.dead_reckoning import Odometry
from ...core.navigation.navigators import Navigator
from ...core.scenario.families import ACCESS
from ...core.scenario.part_choice import own_part
from ...support.arrays import Floats
from ...support.plugins import PluginError, is_plugin
from ...support.wording import did_you_mean
from .tasks import KEYS, Kind, Task


@dataclass
class FilterState:
    """What an AUV knows after a fix: of which instant it is (s), the integrals of the cosine and
    sine of its heading by then (2,), s; since when it knew that (s); the error of its dead
    reckoning and its bias ahead and to starboard (4,), m and m/s, and their covariance.
    """

    valid_at_s: float
    turned: Floats
    since_s: float
    state: Floats
    spread: Floats
    fix: Any


class BiasFilter(Navigator):
    """A Kalman filter of a drift with a constant bias, as papers write it: one that drops fixes
    that come late, or one that buffers and replays.
    """

    def __init__(
        self, reckoning: Any, auvs: int, *, late: Literal["drop", "replay"] = "replay",
        late_s: float = 1.0, bias_sd_m_per_s: float = 0.06, walk_m_per_sqrt_s: float = 0.03,
    ) -> None:  # fmt: skip
        """Take what the errors of dead reckoning are like; a fix is late after `late_s` (s)."""
        self.reckoning, self.drops, self.late_s = reckoning, late == "drop", late_s
        self.walk = np.diag([walk_m_per_sqrt_s**2] * 2 + [0.0] * 2)
        first = np.diag([0.0, 0.0] + [bias_sd_m_per_s**2] * 2)
        begun = FilterState(0.0, np.zeros(2), 0.0, np.zeros(4), first, None)
        self.past = [[begun] for _ in range(auvs)]
        self.known = [[past[0]] for past in self.past]

    def correct(self, fixes: Any, due: Any) -> None:
        """Take in the fixes in rows `due`, each in its place."""
        for fix in fixes[due]:
            if self.drops and fix.delivered_at_s - fix.valid_at_s > self.late_s:
                continue
            past, again = self.past[fix.auv], [fix]
            while len(past) > 1 and past[-1].valid_at_s > fix.valid_at_s:
                again.append(past.pop().fix)
            for one in (again[0], *reversed(again[1:])):
                past.append(self._taken(past[-1], one, fix.delivered_at_s))
            self.known[fix.auv].append(past[-1])

    def _taken(self, held: FilterState, fix: Any, now: float) -> FilterState:
        sensed = self.reckoning.odometry(fix.auv, np.array([fix.valid_at_s]))
        state, spread = self._at(held, fix.valid_at_s, sensed.headings[0])
        noise = np.array(((fix.sd_x_m**2, fix.cov_xy_m2), (fix.cov_xy_m2, fix.sd_y_m**2)))
        off = sensed.position[0] - (fix.x_m, fix.y_m) - state[:2]
        gain = np.linalg.solve(spread[:2, :2] + noise, spread[:2]).T
        left = np.eye(4) - gain @ np.eye(2, 4)
        spread = left @ spread @ left.T + gain @ noise @ gain.T
        state, turned = state + gain @ off, sensed.headings[0]
        return FilterState(float(fix.valid_at_s), turned, float(now), state, spread, fix)

    def _at(self, held: FilterState, time: float, turned: Floats) -> tuple[Floats, Floats]:
        passed, (ahead, aside) = time - held.valid_at_s, turned - held.turned
        move = np.eye(4)
        move[:2, 2:] = (ahead, -aside), (aside, ahead)
        return move @ held.state, move @ held.spread @ move.T + max(passed, 0.0) * self.walk

    def _each(self, auv: int, odometry: Odometry) -> list[tuple[Floats, Floats]]:
        since = np.array([held.since_s for held in self.known[auv]])
        last = np.searchsorted(since, odometry.times, side="right") - 1
        return [
            self._at(self.known[auv][k], time, turned)
            for k, time, turned in zip(last, odometry.times, odometry.headings, strict=True)
        ]

    def estimate(self, auv: int, odometry: Odometry) -> Floats:
        """Return where an AUV believed to be (n, 2), m."""
        errors = [state[:2] for state, _ in self._each(auv, odometry)]
        return odometry.position - np.array(errors).reshape(-1, 2)

    def covariance(self, auv: int, odometry: Odometry) -> Floats:
        """Return how sure it was of that: xx, yy, xy (n, 3), m2."""
        spreads = np.array([spread for _, spread in self._each(auv, odometry)])
        spreads = spreads.reshape(-1, 4, 4)
        return np.column_stack((spreads[:, 0, 0], spreads[:, 1, 1], spreads[:, 0, 1]))


def _filter(late: Literal["drop", "replay"]) -> type[Navigator]:
    class Chosen(BiasFilter):
        def __init__(self, reckoning: Any, auvs: int) -> None:
            super().__init__(reckoning, auvs, late=late)

    Chosen.__name__ = f"{late}_late"
    return Chosen


PEERS: dict[str, Any] = {"every_s": 5}
EACH_S = 0.3  # AUVs that ping as they like have something to send once in so long for each AUV

SHIPPED: dict[Kind, dict[str, dict[str, Any]]] = {
    "navigator": {
        "dead_reckoning": {"navigation.filter": "dead_reckoning"},
        "fixed_gain": {"navigation.filter": {"model": "fixed_gain", "delay_compensation": "none"}},
        "shifted_gain": {
            "navigation.filter": {"model": "fixed_gain", "delay_compensation": "shift"}
        },
        "drop_late": {"navigation.filter": _filter("drop")},
        "replay_late": {"navigation.filter": _filter("replay")},
        "kalman": {"navigation.filter": "kalman"},
        "smoother": {"navigation.filter": "smoother"},
    },
    "peers": {
        "alone": {},
        "naive": {"navigation.peers": {**PEERS, "fusion": "naive"}},
        "intersection": {"navigation.peers": PEERS},
        "raw": {"navigation.peers": {**PEERS, "share": "raw"}},
        "centralised": {"navigation.peers": {**PEERS, "fusion": "centralised"}},
    },
    "schedule": {
        name: {"protocol.schedule": name} for name in ("spatial_reuse", "one_per_slot", "polling")
    }
    | {name: {"protocol.access": name} for name in ("aloha", "csma", "t_lohi", "macau", "dacap")},
    "placement": {
        "ring": {"asvs.formation": {"model": "ring", "radius_m": 75, "angle_deg": 90}},
        "follow": {"asvs.formation": {"model": "follow"}},
        "assign": {"asvs.formation": {"model": "assign"}},
        "zigzag": {"asvs.formation": {"model": "zigzag"}},
    },
}


def method_names(kind: Kind | None = None) -> list[str]:
    """Return the names of the methods of a kind that come with the benchmark, or of all kinds."""
    return [name for each, names in SHIPPED.items() if kind in (None, each) for name in names]


def fits(method: str, task: Task) -> bool:
    """Tell whether a method can enter a task; a user-defined part can enter any."""
    return is_plugin(method) or is_recorded(method) or method in SHIPPED[task.kind]


def is_recorded(method: str) -> bool:
    """Tell whether a method is a file of recorded estimates."""
    return Path(method).suffix == ".parquet"


def check(method: str) -> None:
    """Refuse a name that is no method.

    Raises:
        ValueError: naming what there is.
    """
    known = method_names()
    if not (is_plugin(method) or is_recorded(method) or method in known):
        hint = did_you_mean(method, known) or f"; they are {', '.join(known)}"
        raise ValueError(
            f"no method is named {method!r}{hint}, a part of one's own (module:object), or a file "
            "of estimates (.parquet)"
        )


def _is_program(method: str, task: Task) -> bool:
    """Tell whether a user-defined part returns a generator for a node, as programs of access do.

    Raises:
        PluginError: when it cannot be loaded.
    """
    nodes: list[Any] = []

    def program(node: Any) -> Iterator[Any]:
        nodes.append(node)
        yield node.wait(0.0)

    Mission(task.scenario({"protocol.access": program}), seed=0)
    part = own_part(ACCESS, task.scenario({"protocol.access": method}).protocol.access)
    try:
        return isinstance(part(nodes[0]), Generator)
    except PluginError:  # a node is no view of a schedule
        return False


def filled(method: str, task: Task) -> dict[str, Any]:
    """Return what a method fills of a task's scenario, by dotted keys: a user-defined part that
    returns generators enters tasks of schedules as a program of access.

    Raises:
        PluginError: when a user-defined part cannot be loaded.
    """
    key = KEYS[task.kind]
    if key == "protocol.schedule" and is_plugin(method) and _is_program(method, task):
        key = "protocol.access"
    fills = dict(SHIPPED[task.kind].get(method, {key: method}))
    if "protocol.access" in fills:
        fills["protocol.frame_s"] = EACH_S * task.scenario({}).auvs.count
    array = task.name == "no_anchor" and fills.get("navigation.peers")
    if array:
        fills["navigation.peers"] = {**array, "bearing": "array", "kind": "angles"}
    return fills

"""Random access in ns-3 and here, reception by reception, kept as a reference for the tests.

    pip install 'bindusbl-des[peers]'
    python benchmarks/peers/ns3_access.py > tests/reference/ns3_access.json

Both are given the same places, the same instants at which AUVs have a ping to send, and the
backoffs that ns-3 draws.  `UanMacAloha` leaves out what comes up while a ping is sent, as `aloha`
does, and `UanMacCw` is the rule of `csma`.  Exits with 1 where the two differ.

One thing is kept out of the traffic of csma: what an AUV is to send while it sends.  Of that, where
no slot is drawn, ns-3 makes a ping that begins in the very nanosecond in which the one before it
ends; whether the two overlap where they are heard is then decided by how delays are rounded.
"""

import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from itertools import chain, count, takewhile
from pathlib import Path
from typing import Any

import numpy as np
from ns3_uan import compiled_driver

from bindusbl_des import Mission, Result, Scenario, simulate
from bindusbl_des.models.access.acknowledging import Acknowledging
from bindusbl_des.models.access.aloha import aloha
from bindusbl_des.models.access.csma import CarrierSense, csma

Case = dict[str, Any]
Heard = list[tuple[int, float, str]]

# The end of a mission (s): what is on its way then is left out of the comparison.
DURATION_S, SETTLED_S = 40.0, 0.2

SPEED, PING_S, DEPTH_M = 1500.0, 0.020, 10.0


def cases() -> Iterator[Case]:
    """Yield what is compared: fleets that hear each other, or hardly, at low and high load."""
    for seed, (access, auvs, side, every, window, slot) in enumerate(
        (
            ("aloha", 4, 60.0, 0.5, 1, 0.0),
            ("aloha", 8, 120.0, 0.3, 1, 0.0),
            ("csma", 3, 40.0, 0.3, 1, 0.05),
            ("csma", 4, 60.0, 0.5, 10, 0.02),
            ("csma", 6, 120.0, 0.3, 10, 0.05),
            ("csma", 8, 120.0, 0.2, 4, 0.03),
            ("csma", 10, 60.0, 0.4, 32, 0.04),
        )
    ):
        draw = np.random.default_rng(seed)
        half = side / 2
        yield {
            "access": access,
            "seed": seed,
            "every_s": every,
            "window": window,
            "slot_s": slot,
            "side_m": side,
            "auvs_m": np.round(draw.uniform(-half, half, (auvs, 2)), 3).tolist(),
            "asvs_m": np.round(draw.uniform(-half, half, (3, 2)), 3).tolist(),
            "left_out": [],
        }


def instants_of(case: Case) -> list[list[float]]:
    """Return the Poisson instants (s) of each AUV."""
    found: list[list[float]] = []

    def spy(node: Any) -> Iterator[Any]:
        if not node.is_asv:
            found.append(list(takewhile(lambda it: it < DURATION_S, node.packets)))
        yield node.wait(0.0)

    Mission(scenario_of(case, spy), case["seed"])
    return found


def traffic_of(case: Case) -> list[list[float]]:
    """Return when (s) each AUV has a ping to send: all instants but those that are left out."""
    return [
        [at for number, at in enumerate(own) if [auv, number] not in case["left_out"]]
        for auv, own in enumerate(instants_of(case))
    ]


def scenario_of(case: Case, program: Any) -> Scenario:
    """Return a case as a scenario: nothing is lost but by pings that overlap."""
    return Scenario.model_validate({
        "name": f"{case['access']} {case['seed']}",
        "duration_s": DURATION_S,
        "survey": {"side_m": case["side_m"], "depth_m": DEPTH_M},
        "auvs": {
            "count": len(case["auvs_m"]),
            "route": {"kind": "hold", "positions_m": case["auvs_m"]},
        },
        "asvs": {
            "count": len(case["asvs_m"]),
            "formation": {"positions_m": case["asvs_m"]},
        },
        "environment": {"sound_speed_m_per_s": SPEED},
        "acoustics": {"hf": {"ping_s": PING_S}, "loss": {"law": "none"}},
        "protocol": {"access": program, "frame_s": case["every_s"]},
    })  # fmt: skip


def theirs(case: Case, program: Path) -> tuple[Heard, list[list[int]]]:
    """Return what ns-3 makes of a case, and the backoffs (slots) that each AUV draws."""
    plan = scenario_of(case, case["access"])
    auvs, asvs = case["auvs_m"], case["asvs_m"]
    lines = [
        f"{case['access']} {len(auvs)} {len(asvs)} {plan.acoustics.hf.range_m!r} {SPEED!r} "
        f"{PING_S!r} {case['window']} {case['slot_s']!r} {DURATION_S!r}"
    ]
    lines += [f"{x!r} {y!r} {DEPTH_M!r}" for x, y in auvs]
    lines += [f"{x!r} {y!r} 0.0" for x, y in asvs]
    for auv, own in enumerate(traffic_of(case)):
        lines += [f"{at!r} {auv}" for at in own]
    path = program.with_suffix(".txt")
    path.write_text("\n".join(lines) + "\n")
    done = subprocess.run([str(program), str(path)], capture_output=True, text=True, check=True)
    sent: list[tuple[int, float]] = []
    heard: list[list[int]] = []
    draws: list[list[int]] = [[] for _ in auvs]
    for kind, *words in map(str.split, done.stdout.splitlines()):
        if kind == "draw":
            draws[int(words[0])].append(int(words[1]))
        elif kind == "ping":
            sent.append((int(words[1]), float(words[2])))
            heard.append([])
        else:
            heard[int(words[0])].append(int(words[1]))
    told = [(*it, " ".join(map(str, sorted(by)))) for it, by in zip(sent, heard, strict=True)]
    return _settled(told), draws


class Dealt:
    """Backoffs that were drawn elsewhere, in the place of a stream."""

    def __init__(self, slots: list[int]) -> None:
        self._slots = iter(slots)

    def integers(self, window: int) -> int:
        """Return the next of them."""
        return next(self._slots)


def flown(case: Case, draws: list[list[int]]) -> Result:
    """Fly a case with the backoffs that each AUV is to draw."""
    settings, traffic = {"window": case["window"], "slot_s": case["slot_s"]}, traffic_of(case)

    def program(node: Any) -> Iterator[Any]:
        if not node.is_asv:
            node.packets = chain(traffic[node.number], count(DURATION_S + 1.0))
            node.random = Dealt(draws[node.number])
            yield from (
                csma(node, settings=CarrierSense(**settings))
                if case["access"] == "csma"
                else aloha(node, settings=Acknowledging())
            )

    return simulate(scenario_of(case, program), case["seed"])


def ours(case: Case, draws: list[list[int]]) -> Heard:
    """Return what our mission makes of a case, with the backoffs that each AUV is to draw."""
    tables = flown(case, draws).tables
    pings, met = tables["pings"], tables["receptions"]
    by: dict[int, list[str]] = {number: [] for number in pings.ping}
    for it in met[met.outcome == "heard"].itertuples():
        by[it.ping].append(it.asv[3:])
    told = zip(pings.auv.str[3:].astype(int), pings.sent_at_s, by.values(), strict=True)
    return _settled([(auv, at, " ".join(sorted(own))) for auv, at, own in told])


def own_overlaps(case: Case, draws: list[list[int]]) -> list[list[int]]:
    """Return which of an AUV's instants fall into its own pings, AUV and number of each."""
    pings, found = flown(case, draws).tables["pings"], []
    for auv, own in enumerate(instants_of(case)):
        sent = pings.sent_at_s[pings.auv == f"AUV{auv}"].to_numpy()
        found += [
            [auv, number]
            for number, at in enumerate(own)
            if ((sent < at) & (at < sent + PING_S)).any() and [auv, number] not in case["left_out"]
        ]
    return found


def _settled(pings: Heard) -> Heard:
    return [it for it in pings if it[1] < DURATION_S - SETTLED_S]


def differences(one: Heard, other: Heard) -> int:
    """Return in how many pings two sides differ: who, when (to 1 us), and who hears it."""
    differing = sum(
        a[0] != b[0] or abs(a[1] - b[1]) > 1e-6 or a[2] != b[2]
        for a, b in zip(one, other, strict=False)
    )
    return differing + abs(len(one) - len(other))


def main() -> int:
    """Print what ns-3 makes of all cases; return 1 if ours differ (raises PeerMissing)."""
    found, differing = [], 0
    with tempfile.TemporaryDirectory() as folder:
        program = compiled_driver(Path(folder), Path(__file__).with_suffix(".cc"))
        for case in cases():
            pings, draws = theirs(case, program)
            while case["access"] == "csma" and (more := own_overlaps(case, draws)):
                case["left_out"] += more
            pings, draws = theirs(case, program)
            mine = ours(case, draws)
            differing += differences(pings, mine)
            heard = sum(len(it[2].split()) for it in pings)
            print(
                f"{case['access']} {case['seed']}: {len(pings)} pings, {heard} heard; "
                f"{differences(pings, mine)} differ",
                file=sys.stderr,
            )
            found.append({**case, "draws": draws, "pings": pings})
    print(json.dumps({"ns3": "3.44", "cases": found}, separators=(",", ":")))
    return 1 if differing else 0


if __name__ == "__main__":
    sys.exit(main())

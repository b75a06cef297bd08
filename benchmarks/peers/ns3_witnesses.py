"""Witnesses of the verifier in ns-3: what collides there is what collides here.

    python benchmarks/peers/ns3_witnesses.py > tests/reference/ns3_witnesses.json

The pings and frames of each witness are repeated in ns-3 (UanPhyGen, one transducer per band), and
who decodes what is compared, reception by reception.
"""

import json
import sys
import tempfile
from importlib.metadata import version
from pathlib import Path
from typing import Any

from ns3_uan import Peer, PeerMissing
from traffic import traffic_of

from bindusbl_des import Scenario, verify

# Scenarios that are refused for one-way ranging and sequential rounds, and the bounds they are for
TIGHT = {"uplink_guard_s": 0.0, "shortest_uplink_slot_s": 0.0, "schedule": "one_per_slot"}
REFUSED: dict[str, tuple[dict[str, Any], dict[str, float]]] = {
    "shared slot": ({}, {}),
    "shared slot, six AUVs": ({"auvs": {"count": 6}}, {"max_speed": 2.0}),
    "shared slot, dsatur": ({"protocol": {"schedule": "dsatur"}}, {}),
    "clocks": ({"protocol": TIGHT}, {"clock_error": 0.005}),
    "clocks, one ASV": ({"asvs": {"count": 1}}, {"clock_error": 0.002}),
    "sound speed": ({"survey": {"depth_m": 0.0}, "protocol": TIGHT}, {"sound_speed_error": 30.0}),
}


def witness_in(name: str, peer: Peer | None) -> dict[str, Any]:
    """Return a witness, and of ns-3 (where given) whether it hears the two pings, or else differs.

    Pings are numbered as in its tables.
    """
    data, bounds = REFUSED[name]
    verdict = verify(Scenario.model_validate({"name": name, "duration_s": 60.0, **data}), **bounds)
    witness = verdict.witness
    assert witness is not None
    pings = [int(signal.what.split()[1]) for signal in witness.signals]
    row: dict[str, Any] = {"receiver": witness.receiver, "pings": pings}
    if peer is None:
        return row
    scenario = Scenario.model_validate(witness.plan)
    traffic, heard, meant = traffic_of(scenario, witness.seed)
    found = peer.run(traffic, "stock")[1]
    theirs = {one for one in found if one[0] == "hf" or one in meant}
    asv = scenario.auvs.count + int(str(witness.receiver).removeprefix("ASV"))
    return row | {
        "heard_by_ns3": [("hf", ping, asv) in theirs for ping in pings],
        "transmissions": len(traffic.transmissions),
        "differences": len(theirs ^ heard),
    }


def main() -> None:
    """Print what ns-3 makes of all witnesses, as JSON."""
    with tempfile.TemporaryDirectory() as folder:
        try:
            peer = Peer(Path(folder))
        except PeerMissing as error:
            sys.exit(str(error))
        rows = {name: witness_in(name, peer) for name in REFUSED}
    command = "python benchmarks/peers/ns3_witnesses.py > tests/reference/ns3_witnesses.json"
    print(json.dumps({"command": command, "ns3": version("ns3"), "witnesses": rows}, indent=2))


if __name__ == "__main__":
    main()

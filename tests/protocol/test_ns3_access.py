"""Random access beside ns-3's `UanMacAloha` and `UanMacCw`, reception by reception.

What ns-3 makes of each case was written by `benchmarks/peers/ns3_access.py`.
"""

import json
import sys
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "benchmarks" / "peers"))
ns3_access = import_module("ns3_access")

CASES = json.loads((ROOT / "tests" / "reference" / "ns3_access.json").read_text())["cases"]


def kept(case: dict[str, Any]) -> list[tuple[int, float, str]]:
    """Return the pings that ns-3 sent: by which AUV, when (s), and which ASVs heard them."""
    return [(auv, at, heard) for auv, at, heard in case["pings"]]


@pytest.mark.parametrize("case", CASES, ids=lambda it: f"{it['access']} {it['seed']}")
def test_ns3_sends_and_hears_what_we_do(case: dict[str, Any]) -> None:
    """Every ping at its instant, to the microsecond, heard by the same ASVs."""
    theirs = kept(case)
    assert len(theirs) > 250
    assert ns3_access.differences(theirs, ns3_access.ours(case, case["draws"])) == 0


def test_the_cases_tell_rules_apart() -> None:
    """Other backoffs than those that ns-3 drew, or no carrier sense, lead to other pings."""
    case = next(it for it in CASES if it["access"] == "csma" and it["window"] > 1)
    others = [[(slots + 1) % case["window"] for slots in own] for own in case["draws"]]
    assert ns3_access.differences(kept(case), ns3_access.ours(case, others)) > 10
    deaf = {**case, "access": "aloha"}
    assert ns3_access.differences(kept(case), ns3_access.ours(deaf, case["draws"])) > 10


def test_ns3_itself_says_so(tmp_path: Path) -> None:
    """Where ns-3 is installed it is run again."""
    peer = import_module("ns3_uan")
    try:
        program = peer.compiled_driver(tmp_path, Path(ns3_access.__file__).with_suffix(".cc"))
    except peer.PeerMissing as missing:
        pytest.skip(str(missing))
    case = CASES[-1]
    pings, draws = ns3_access.theirs(case, program)
    assert draws == case["draws"]
    assert ns3_access.differences(pings, kept(case)) == 0

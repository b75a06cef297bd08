"""Witnesses collide in ns-3 as well: as it was recorded, and anew where ns-3 is installed."""

import json
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
RECORDED: dict[str, dict[str, Any]] = json.loads(
    (ROOT / "tests" / "reference" / "ns3_witnesses.json").read_text()
)["witnesses"]


@pytest.fixture
def peers(monkeypatch: pytest.MonkeyPatch) -> Any:
    """The script that made the reference."""
    monkeypatch.syspath_prepend(ROOT / "benchmarks" / "peers")
    import ns3_witnesses

    yield ns3_witnesses
    for name in ("ns3_witnesses", "ns3_uan", "traffic"):
        sys.modules.pop(name, None)


@pytest.mark.parametrize("name", RECORDED)
def test_ns3_hears_neither_of_the_two_pings(name: str, peers: Any) -> None:
    """The witness is still the one that was repeated there; nothing else differed in it."""
    recorded = RECORDED[name]
    assert peers.witness_in(name, None) == {key: recorded[key] for key in ("receiver", "pings")}
    assert recorded["heard_by_ns3"] == [False, False]
    assert recorded["differences"] == 0
    assert recorded["transmissions"] >= 2


@pytest.mark.skipif(find_spec("ns3") is None, reason="ns-3 is not installed (extra `peers`)")
def test_the_recording_is_what_ns3_says(peers: Any, tmp_path: Path) -> None:
    peer = peers.Peer(tmp_path)
    assert {name: peers.witness_in(name, peer) for name in peers.REFUSED} == RECORDED

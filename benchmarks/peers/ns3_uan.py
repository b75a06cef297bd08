"""Ours beside ns-3's UAN module: the same traffic, the same receptions, measured in turn.

    python benchmarks/peers/ns3_uan.py [--only NAME] [--repeats N] [--json]

ns-3 simulates the acoustics alone; ours the whole mission.  Times are processor times: both use
one core, and others at work on the machine do not count.  docs/performance.md tells what each side
does.
"""

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from traffic import Heard, Traffic, traffic_of

from bindusbl_des import Scenario, simulate
from bindusbl_des.benchmarks.bench import machine
from bindusbl_des.benchmarks.missions import standard_missions
from bindusbl_des.benchmarks.timing import clocked, elsewhere

SOURCE = Path(__file__).with_name("ns3_uan.cc")
LIBRARIES = ("uan", "mobility", "network", "energy", "core")
MISSING = "ns-3 is not installed here: pip install 'bindusbl-des[peers]'"

# As ns-3 does it: every device hears every signal.  Generous: only those that listen for it do.
MODES = {"stock": (), "listeners": ("listeners",)}

# Missions whose traffic the export can say, and that ns-3 ends within a minute.
COMPARED = tuple(
    f"{fleet} {vehicle}"
    for fleet in ("(3,1)", "(3,3)", "(10,3)", "(100,10)")
    for vehicle in ("kinematic", "bluerov2")
)


class PeerMissing(Exception):
    """ns-3, or a compiler for the driver, is not there."""


def ns3_home() -> Path:
    """Return the folder of the installed ns-3, which holds headers and libraries.

    Raises:
        PeerMissing: when it is not installed.
    """
    found = find_spec("ns3")
    places = list(found.submodule_search_locations or ()) if found else []
    for place in map(Path, places):
        if (place / "include" / "ns3" / "uan-module.h").is_file():
            return place
    raise PeerMissing(MISSING)


def compiled_driver(folder: Path, source: Path = SOURCE) -> Path:
    """Compile a driver against the installed ns-3; return the program.

    Raises:
        PeerMissing: without ns-3 or g++, with what to do.
    """
    home, program = ns3_home(), folder / source.stem
    libraries = home / "lib64"
    versions = sorted(libraries.glob("libns3*-uan.so"))
    prefix = versions[-1].name.removeprefix("lib").removesuffix("uan.so")
    words = [
        "g++", "-O3", "-march=native", "-std=c++20", f"-I{home / 'include'}", str(source),
        "-o", str(program), f"-L{libraries}", f"-Wl,-rpath,{libraries}",
        *(f"-l{prefix}{library}" for library in LIBRARIES),
    ]  # fmt: skip
    try:
        done = subprocess.run(words, capture_output=True, text=True)
    except FileNotFoundError:
        raise PeerMissing("the driver needs g++: apt install g++") from None
    if done.returncode:
        raise RuntimeError(f"the driver does not compile:\n{done.stderr}")
    return program


class Peer:
    """The compiled driver at work in a folder."""

    def __init__(self, folder: Path) -> None:
        """Compile the driver (raises PeerMissing)."""
        self._folder, self._program = folder, compiled_driver(folder)

    def run(self, traffic: Traffic, mode: str) -> tuple[dict[str, float], Heard]:
        """Return what ns-3 took (ms, events) for some traffic, and who heard what."""
        path, found = self._folder / "traffic.txt", self._folder / "receptions.txt"
        traffic.write(path)
        words = [str(self._program), str(path), str(found), *MODES[mode]]
        done = subprocess.run(words, capture_output=True, text=True, check=True)
        set_up, run, events = map(float, done.stdout.split())
        lines = map(str.split, found.read_text().splitlines())
        heard = {(band, int(number), int(who)) for band, number, who in lines}
        return {"set_up_ms": set_up, "run_ms": run, "events": events}, heard


def compare(scenario: Scenario, peer: Peer, repeats: int) -> dict[str, Any]:
    """Return the times of both sides for one mission, measured in turn.

    Raises:
        RuntimeError: when the two sides do not hear the same.
    """
    traffic, heard, meant = traffic_of(scenario)
    for mode in MODES:
        theirs = {one for one in peer.run(traffic, mode)[1] if one[0] == "hf" or one in meant}
        if theirs != heard:
            raise RuntimeError(
                f"{scenario.name}: ns-3 ({mode}) hears {len(theirs - heard)} that we do not, and "
                f"misses {len(heard - theirs)} of our {len(heard)}"
            )
    simulate(scenario)
    runs = [_turn(scenario, traffic, peer, number) for number in range(1, repeats + 1)]
    row: dict[str, Any] = {key: statistics.median(run[key] for run in runs) for key in runs[0]}
    transmissions = [sent.band for sent in traffic.transmissions]
    return {
        **row,
        "ratio_stock": row["mission_ms"] / row["stock_run_ms"],
        "ratio_listeners": row["mission_ms"] / row["listeners_run_ms"],
        "pings": transmissions.count("hf"),
        "frames": transmissions.count("mf"),
        "pings_heard": sum(1 for one in heard if one[0] == "hf"),
        "frames_reached": sum(1 for one in heard if one[0] == "mf"),
        "repeats": repeats,
    }


def _turn(scenario: Scenario, traffic: Traffic, peer: Peer, number: int) -> dict[str, float]:
    """Return the times (ms) of one turn: ours, then ns-3's in both modes."""
    changed = elsewhere(scenario, number)
    simulate(scenario)  # ns-3 has a run to warm up as well
    times = {
        "mission_ms": 1e3 * clocked(lambda: simulate(scenario, number)).processor,
        "new_configuration_ms": 1e3 * clocked(lambda: simulate(changed)).processor,
    }
    for mode in MODES:
        took, _ = peer.run(traffic, mode)
        times |= {f"{mode}_{key}": value for key, value in took.items()}
    return times


def peers(names: list[str], repeats: int) -> dict[str, Any]:
    """Return the comparison of the missions named (raises PeerMissing)."""
    missions = standard_missions()
    with tempfile.TemporaryDirectory() as folder:
        peer = Peer(Path(folder))
        rows = {name: compare(missions[name], peer, repeats) for name in names}
    return {"machine": machine(), "missions": rows}


def main() -> None:
    """Compare, and print a table or JSON."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--only", default="", help="missions whose name contains this")
    parser.add_argument("--repeats", type=int, default=9)
    parser.add_argument("--json", action="store_true")
    asked = parser.parse_args()
    names = [name for name in COMPARED if asked.only in name]
    if not names:
        parser.error(f"--only {asked.only}: no such mission; there are {', '.join(COMPARED)}")
    try:
        found = peers(names, asked.repeats)
    except PeerMissing as error:
        sys.exit(str(error))
    print(json.dumps(found, indent=2) if asked.json else "\n".join(lines(found)))


def lines(found: dict[str, Any]) -> list[str]:
    """Return the comparison as a table."""
    head = (
        f"{'mission':<20}{'ours, whole':>12}{'ns-3 stock':>12}{'ratio':>7}"
        f"{'ns-3 listeners':>16}{'ratio':>7}{'set-up':>8}   heard by both"
    )
    rows = [
        f"{name:<20}{row['mission_ms']:>9.1f} ms{row['stock_run_ms']:>9.1f} ms"
        f"{row['ratio_stock']:>7.2f}{row['listeners_run_ms']:>13.1f} ms"
        f"{row['ratio_listeners']:>7.2f}{row['stock_set_up_ms']:>5.1f} ms   "
        f"{row['pings']} pings at {row['pings_heard']} ASVs, {row['frames_reached']} fixes"
        for name, row in found["missions"].items()
    ]
    return [head, "-" * len(head), *rows]


if __name__ == "__main__":
    main()

"""Measure this version under a name, keep it in history.json, and write docs/performance.md.

python benchmarks/record.py "0.1.0 after"        measure everything (about a quarter of an hour)
python benchmarks/record.py --keep NAME FILE     keep what `bindusbl-des bench --json` printed
python benchmarks/record.py                      write the page anew
"""

import json
import sys
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
HISTORY = HERE / "history.json"
PAGE = HERE.parent / "docs" / "performance.md"
sys.path[:0] = [str(HERE), str(HERE / "peers")]

# The programs beside this one are found through the path above.
import ns3_uan  # noqa: E402
from page import page  # noqa: E402
from plans import plans  # noqa: E402
from targets import verdicts  # noqa: E402

from bindusbl_des.benchmarks.bench import bench  # noqa: E402
from bindusbl_des.benchmarks.missions import standard_missions  # noqa: E402

REPEATS = 9


def history() -> dict[str, dict[str, Any]]:
    """Return the measurements so far, by name, oldest first."""
    found: dict[str, dict[str, Any]] = json.loads(HISTORY.read_text(encoding="utf-8"))
    return found


def keep(name: str, found: dict[str, Any]) -> None:
    """Add a measurement, or replace the one of the same name."""
    everything = {**history(), name: rounded(found)}
    HISTORY.write_text(json.dumps(everything, indent=1) + "\n", encoding="utf-8")


def rounded(data: Any) -> Any:
    """Return plain data with four digits to each number: no measurement here has more."""
    if isinstance(data, dict):
        return {key: rounded(value) for key, value in data.items()}
    return float(f"{data:.4g}") if isinstance(data, float) else data


def measure() -> dict[str, Any]:
    """Return everything there is to measure; ns-3 is left out where it is missing."""
    found = bench(standard_missions(), quick=False, with_commands=True, told=tell, whole_sweep=True)
    try:
        tell("measuring beside ns-3")
        found["peers"] = ns3_uan.peers(list(ns3_uan.COMPARED), REPEATS)["missions"]
    except ns3_uan.PeerMissing as missing:
        tell(f"{missing}: the comparison is left out")
    found["plans"] = plans(tell)
    return found


def tell(text: str) -> None:
    """Say what is being done."""
    print(text, file=sys.stderr, flush=True)


def main(words: list[str]) -> None:
    """Do what the words ask for, then write the page."""
    if words[:1] == ["--keep"] and len(words) == 3:
        keep(words[1], json.loads(Path(words[2]).read_text(encoding="utf-8")))
    elif len(words) == 1 and not words[0].startswith("-"):
        keep(words[0], found := measure())
        for target, value, verdict in verdicts(found):
            tell(f"{target.what}: {value} {target.unit}, {target.then:g} at most: {verdict}")
    elif words:
        sys.exit((__doc__ or "").strip())
    PAGE.write_text(page(history()), encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])

"""Results with advice that tests make up."""

import json
from pathlib import Path
from typing import Any

from bindusbl_des import Result, load_result


def effect(kind: str, *settings: str, **given: Any) -> dict[str, Any]:
    """Return an effect of a change as advice has it: one that helps, unless given otherwise."""
    return {
        "kind": kind, "words": f"a {kind}", "settings": list(settings), "mean_m": -1.0,
        "low_m": -2.0, "high_m": -0.5, "seeds": 8, "verdict": "helps", **given,
    }  # fmt: skip


def advised(result: Result, folder: Path, **advice: Any) -> Result:
    """Write a result into a folder with advice, of which some keys are given; return it as read."""
    given = {
        "budget_missions": 9, "budget_s": None, "is_cut": False, "missions": 9, "error_m": None,
        "effects": [], "harms": [], "harm_seeds": 0, "inert": [], "needless": [], "dropped": [],
        "untried": [], "shortage": "", "fixed_gain": True, "foreseen": [],
    }  # fmt: skip
    result.write(folder)
    (folder / "advice.json").write_text(json.dumps(given | advice))
    return load_result(folder)

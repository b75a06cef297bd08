"""Results with advice that tests make up."""

import json
from pathlib import Path
from typing import Any

from bindusbl_des import Result, load_result


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

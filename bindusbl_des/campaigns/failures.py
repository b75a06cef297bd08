"""What is kept of missions that failed: a file each, in the folder `failures` of their campaign."""

from pathlib import Path
from typing import Any

from ..core.plain_json import read_json

# What such a file holds.
FAILURE: dict[str, type] = {
    "mission": int, "varied": dict, "seed": object, "error": str, "reproduce": str,
}  # fmt: skip


def failures_in(folder: Path) -> list[dict[str, Any]]:
    """Return what is kept of each mission that failed, in the order of the plan.

    Raises:
        ValueError: when a file is damaged.
    """
    found = [_failure(path) for path in (folder / "failures").glob("*.json")]
    return sorted(found, key=lambda it: int(it["mission"]))


def an_error(folder: Path) -> str:
    """Return the error of one of the missions that failed; "" where nothing is kept of any.

    Raises:
        ValueError: when its file is damaged.
    """
    first = min((folder / "failures").glob("*.json"), default=None)
    return "" if first is None else str(_failure(first)["error"])


def _failure(path: Path) -> dict[str, Any]:
    try:
        found: dict[str, Any] = read_json(path)
        for key, kind in FAILURE.items():
            if not isinstance(found[key], kind):
                raise ValueError(f"{key} is not what it should be")
    except (KeyError, OSError, TypeError, ValueError) as error:
        raise ValueError(
            f"{path} is damaged ({type(error).__name__}: {error}); delete it, then "
            f"`bindusbl-des resume {path.parents[1]} --retry-failed`"
        ) from None
    return found

"""JSON files read with distrust: of bounded size and depth, and with nothing that is no JSON."""

import json
from pathlib import Path
from typing import Any, NoReturn

from .regular_files import regular

# A scenario file has at most 1 MB; spelt out, with all its defaults and warnings, some times that.
LARGEST_FILE = 32_000_000


def read_json(path: Path, most: int = LARGEST_FILE) -> Any:
    """Return what a JSON file holds.

    Raises:
        OSError: when it cannot be read.
        ValueError: when it is no JSON in UTF-8, too large (`most` bytes) or nested too deeply.
    """
    with open(regular(path, None), "rb") as file:
        raw = file.read(most + 1)
    if len(raw) > most:
        raise ValueError(f"it is larger than {most:,} bytes")
    try:
        data = json.loads(raw.decode("utf-8"), parse_constant=_refused)
        json.dumps(data, ensure_ascii=False).encode("utf-8")  # half a letter cannot be written
    except RecursionError:
        raise ValueError("it is nested too deeply") from None
    except UnicodeEncodeError:
        raise ValueError("it has half a letter (a lone surrogate) in a text") from None
    return data


def _refused(name: str) -> NoReturn:
    raise ValueError(f"{name} is no number of JSON")

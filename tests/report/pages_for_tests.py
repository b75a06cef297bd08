"""What tests read in pages: the data that they draw, and the story that they tell."""

import base64
import json
import re
import zlib
from html import unescape
from typing import Any

import numpy as np

from bindusbl_des import Result
from bindusbl_des.apps.report.comparison import comparison_page


def unpacked(place: dict[str, Any], packed: str) -> np.ndarray:
    """Return a column as a page unpacks it."""
    data = zlib.decompress(base64.b64decode(packed), -15)
    start, length = 4 * place["at"], place["length"]
    planes = np.frombuffer(data[start : start + 4 * length], np.uint8).reshape(4, length)
    zigzag = np.ascontiguousarray(planes.T).view(np.uint32).ravel().astype(np.int64)
    steps = (zigzag >> 1) ^ -(zigzag & 1)
    for _ in range(place["order"]):
        steps = np.cumsum(steps)
    steps = (steps + 2**31) % 2**32 - 2**31
    return np.where(steps == -(2**31), np.nan, steps * place["quantum"])


def page_data(of: Result | str) -> dict[str, Any]:
    """Return what the page of a run draws, its columns unpacked."""
    page = of if isinstance(of, str) else of.report()
    packed = re.findall(r'id="packed">(.*?)</script>', page)[0]

    def read(value: Any) -> Any:
        if isinstance(value, dict):
            if "quantum" in value:
                return unpacked(value, packed)
            return {name: read(it) for name, it in value.items()}
        return [read(it) for it in value] if isinstance(value, list) else value

    found: dict[str, Any] = read(json.loads(re.findall(r'id="data">(.*?)</script>', page)[0]))
    return found


def told(result: Result) -> str:
    """Return all sentences of a run's story."""
    page = result.report()
    verdicts = re.findall(r'<p class="verdict[^>]*>(.*?)</p>', page)
    story = page.partition('<section id="story"')[2].partition("</article></div>")[0]
    return "\n".join([*map(unescape, verdicts), story.partition("</h2>")[2]])


def beside(*runs: tuple[str, Result]) -> str:
    """Return the page of runs beside each other, by their names."""
    return comparison_page(list(runs))

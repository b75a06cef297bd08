"""A page: its parts put together in one file that asks the network for nothing.

Numbers are packed: quanta, differences, byte planes, deflate, base64.
"""

import base64
import hashlib
import html
import json
import re
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files
from string import Template
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...support.palette import variables

# What stands for "no value"; a page reads it as NaN.
MISSING = -(2**31)
LARGEST = 2**31 - 1

# Differences of smooth columns are tiny; their own differences often are all zero.
ORDERS = (0, 1, 2)
COMPRESSION = 6


@dataclass
class Packer:
    """Columns of numbers on their way into a page, which gets them back as Float64Array.

    >>> packer = Packer()
    >>> packer.add([0.0, 0.5, 1.0], quantum=0.5)
    {'at': 0, 'length': 3, 'quantum': 0.5, 'order': 2}
    """

    _parts: list[bytes] = field(default_factory=list)
    _length: int = 0

    def add(self, values: ArrayLike, *, quantum: float = 1.0) -> dict[str, Any]:
        """Take a column, rounded to `quantum`; return what the page needs to unpack it.

        Values that are not finite are missing in the page.  Values too large for 31 bits of quanta
        are rounded to a coarser quantum.
        """
        array = np.asarray(values, dtype=np.float64).ravel()
        known = np.isfinite(array)
        largest = float(np.abs(array[known]).max()) if known.any() else 0.0
        quantum = max(quantum, largest / LARGEST)
        whole = np.full(len(array), MISSING, dtype=np.int64)
        whole[known] = np.rint(array[known] / quantum).astype(np.int64)
        steps = whole.astype(np.int32)  # differences wrap around, and back again in the page
        best = min((_planes(steps, order) for order in ORDERS), key=lambda planes: planes[0])
        place = {"at": self._length, "length": len(array), "quantum": quantum, "order": best[1]}
        self._parts.append(best[2])
        self._length += len(array)
        return place

    def text(self) -> str:
        """Return all columns as base64 of a raw deflate stream."""
        packer = zlib.compressobj(COMPRESSION, zlib.DEFLATED, -15)
        return base64.b64encode(packer.compress(b"".join(self._parts)) + packer.flush()).decode()


def _planes(steps: NDArray[np.int32], order: int) -> tuple[int, int, bytes]:
    """Return how large differences of an order are, the order, and their bytes in four planes."""
    differences = steps
    for _ in range(order):
        differences = np.diff(differences, prepend=np.int32(0))
    zigzag = (differences << 1) ^ (differences >> 31)  # small numbers of either sign: small bytes
    planes = zigzag.view(np.uint8).reshape(-1, 4).T
    return int(np.count_nonzero(planes)), order, planes.tobytes()


# Before anything is painted: a reader's theme; without scripts the page has none, and shows tables.
FIRST = (
    'document.documentElement.dataset.theme = matchMedia("(prefers-color-scheme: dark)").matches'
    ' ? "dark" : "light";'
)
# Plots are printed too: uPlot, which asks once, draws at least two dots for each pixel.
RATIO = """\
const ownRatio = Object.getOwnPropertyDescriptor(window, "devicePixelRatio");
const sharp = { configurable: true, value: Math.max(devicePixelRatio, 2) };
Object.defineProperty(window, "devicePixelRatio", sharp);
"""
# A page of texts and tables has this alone.
TEXT_ONLY = "startTheme();\nbindusbl.ready = true;\n"
THEME = (
    '<button id="theme" type="button" aria-label="Switch between light and dark">'
    "◐ <span>theme</span></button>"
)
NOTICE = (
    '<noscript><p class="verdict warning">Maps, playback and plots need JavaScript, which is off '
    "here; the answer and the tables are below.</p></noscript>"
)


@cache
def asset(name: str) -> str:
    """Return the text of a file that belongs to the pages."""
    return (files(__package__) / "assets" / name).read_text(encoding="utf-8")


def assembled(
    title: str,
    body: str,
    scripts: Sequence[str],
    data: Mapping[str, Any],
    packed: str,
    sheets: Sequence[str] = (),
) -> str:
    """Return a whole page: HTML in `body`, the scripts named, JSON `data`, columns `packed`.

    Without scripts it has texts and tables alone.

    `sheets` are style sheets of its own, beside those of all pages.

    The page's policy names the hash of each script and of the style sheet, so that a browser runs
    these and nothing else, whatever stands in the body.
    """
    own_code = [_bare(asset(name)) for name in scripts] or [TEXT_ONLY]
    code = [RATIO, _uplot(), _bare(asset("base.js")), *own_code]
    own = (_bare(asset(name)) for name in ("page.css", *sheets))
    styles = "\n".join((asset("uPlot.min.css"), variables(), *own))
    return Template(asset("page.html")).substitute(
        policy=_policy([FIRST, *code], styles),
        title=html.escape(title),
        first=_script(FIRST),
        styles=styles,
        body=NOTICE + body if scripts else body,
        data=as_script(data),
        packed=packed,
        code="\n".join(map(_script, code)),
    )


def filled(markup: str, **values: object) -> str:
    """Return markup with values put in for the {names} in it: as text, whatever they hold.

    >>> filled("<b>{name}</b>", name="<script>")
    '<b>&lt;script&gt;</b>'
    """
    return markup.format(**{name: html.escape(str(value)) for name, value in values.items()})


def _uplot() -> str:
    """Return the library of the plots with its licence; afterwards dots have their own size."""
    return (
        f"\n/*\nuPlot, drawn from its npm package:\n{asset('uPlot-LICENSE')}\n*/\n"
        f"{asset('uPlot.iife.min.js')}\n"
        'Object.defineProperty(window, "devicePixelRatio", ownRatio);\n'
    )


def _script(code: str) -> str:
    return f"<script>{code}</script>"


def _policy(scripts: Sequence[str], styles: str) -> str:
    """Return the Content-Security-Policy of a page that has these scripts and this style sheet."""
    allowed = " ".join(map(_fingerprint, scripts))
    return (
        f"default-src 'none'; script-src {allowed}; style-src {_fingerprint(styles)}; "
        "base-uri 'none'; form-action 'none'"
    )


def _fingerprint(code: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(code.encode()).digest()).decode()}'"


def _bare(code: str) -> str:
    """Return code without indentation and the comments that have a line of their own.

    >>> _bare("// Why.\\n  f();  // here\\n")
    'f();  // here\\n'
    """
    lines = (line.strip() for line in code.splitlines())
    return "".join(f"{line}\n" for line in lines if line and not line.startswith("//"))


def as_script(data: Mapping[str, Any]) -> str:
    """Return data as JSON that cannot end the script element it stands in."""
    text = json.dumps(data, allow_nan=False, ensure_ascii=False, separators=(",", ":"))
    return re.sub("[<>&\u2028\u2029]", lambda letter: f"\\u{ord(letter[0]):04x}", text)


def table(
    headings: Sequence[tuple[str, str]],
    rows: Sequence[Sequence[str]],
    caption: str,
    looks: Mapping[tuple[int, int], str] = MappingProxyType({}),
) -> str:
    """Return an HTML table: headings with their units, then rows whose first cell names them.

    `looks` are classes of cells (row, column).  Further lines of a cell are small.
    """
    top = "".join(
        f'<th scope="col">{html.escape(name)}<span class="unit">{html.escape(unit)}</span></th>'
        for name, unit in headings
    )
    lines = [
        f'<tr><th scope="row">{html.escape(row[0])}</th>'
        + "".join(
            f"<td{_look(looks.get((place, column)))}>{_lines(cell)}</td>"
            for column, cell in enumerate(row[1:], 1)
        )
        + "</tr>"
        for place, row in enumerate(rows)
    ]
    return (
        f'<div class="scroll" tabindex="0" role="region" aria-label="{html.escape(caption)}">'
        f'<table><caption class="hidden">{html.escape(caption)}</caption>'
        f"<thead><tr>{top}</tr></thead><tbody>{''.join(lines)}</tbody></table></div>"
    )


def _look(name: str | None) -> str:
    return f' class="{name}"' if name else ""


def _lines(cell: str) -> str:
    first, *rest = html.escape(cell).split("\n")
    return first + "".join(f"<small>{line}</small>" for line in rest)

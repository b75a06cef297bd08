"""A page: its parts put together in one file that asks the network for nothing."""

import html
import json
from collections.abc import Container, Mapping, Sequence
from functools import cache
from importlib.resources import files
from string import Template
from typing import Any

from ..palette import variables

MARK = ' class="worst"'


@cache
def asset(name: str) -> str:
    """Return the text of a file that belongs to the pages."""
    return (files(__package__) / "assets" / name).read_text(encoding="utf-8")


def assembled(
    title: str, body: str, scripts: Sequence[str], data: Mapping[str, Any], packed: str
) -> str:
    """Return a whole page: HTML in `body`, the scripts named, JSON `data`, columns `packed`."""
    names = ("base.js", *scripts)
    code = "\n".join(f"<script>\n{_bare(asset(name))}</script>" for name in names)
    return Template(asset("page.html")).substitute(
        title=html.escape(title),
        styles="\n".join((asset("uPlot.min.css"), variables(), _bare(asset("page.css")))),
        library=asset("uPlot.iife.min.js"),
        licence=asset("uPlot-LICENSE"),
        body=body,
        data=as_script(data),
        packed=packed,
        code=code,
    )


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
    return text.replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029")


def table(
    headings: Sequence[tuple[str, str]],
    rows: Sequence[Sequence[str]],
    caption: str,
    worst: Container[tuple[int, int]] = (),
) -> str:
    """Return an HTML table: headings with their units, then rows whose first cell names them.

    The cells (row, column) in `worst` stand out.
    """
    top = "".join(
        f'<th scope="col">{html.escape(name)}<span class="unit">{html.escape(unit)}</span></th>'
        for name, unit in headings
    )
    lines = [
        f'<tr><th scope="row">{html.escape(row[0])}</th>'
        + "".join(
            f"<td{MARK * ((place, column) in worst)}>{html.escape(cell)}</td>"
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


def number(value: Any, digits: int = 2, factor: float = 1.0) -> str:
    """Return a number for the eye; what is not known is a dash.

    >>> number(0.8342, 1, 100), number(None), number(float("nan"))
    ('83.4', '-', '-')
    """
    if value is None or value != value:
        return "-"
    return f"{value * factor:.{digits}f}"

"""How a result is shown: pages and figures are made in rooms above, loaded when first asked for."""

from importlib import import_module
from typing import Any

# The modules of the package, and the functions there, that make of a result
PAGE = "report.run_page:run_page"  # a page (HTML)
FIGURE = "figures.kinds:drawn"  # a figure (matplotlib), given its kind and options


def page(result: Any) -> str:
    """Return the report of a result, one HTML page."""
    text: str = _face(PAGE)(result)
    return text


def figure(result: Any, kind: str, width: float, **options: Any) -> Any:
    """Return a figure of a result, `width` inches wide.

    Raises:
        ValueError: when there is no such figure, or the result lacks the tables that it needs.
    """
    return _face(FIGURE)(result, kind, width, **options)


def _face(home: str) -> Any:
    module, _, name = home.partition(":")
    return getattr(import_module(f"...{module}", __name__), name)

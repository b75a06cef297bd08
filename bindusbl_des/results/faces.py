"""How a result is shown: pages and figures are made in rooms above, loaded when first asked for."""

from importlib import import_module
from typing import Any

# The modules of the package, and the functions there, that make of a result
PAGE = "report.run_page:run_page"  # a page (HTML)
FIGURE = "figures.kinds:drawn"  # a figure (matplotlib), given its kind and width (in)


def face(home: str) -> Any:
    """Return the function that shows something, by its module in the package and its name."""
    module, _, name = home.partition(":")
    return getattr(import_module(f"...{module}", __name__), name)


def page(result: Any) -> str:
    """Return the report of a result, one HTML page."""
    text: str = face(PAGE)(result)
    return text

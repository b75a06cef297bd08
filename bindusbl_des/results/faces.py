"""How a result is shown: its page is made in a room above, which is loaded when first asked for."""

from collections.abc import Callable
from importlib import import_module
from typing import Any

# The module of the package, and the function there that makes a page (HTML) of a result
PAGE = "report.run_page:run_page"


def page(result: Any) -> str:
    """Return the report of a result, one HTML page."""
    module, _, name = PAGE.partition(":")
    make: Callable[[Any], str] = getattr(import_module(f"...{module}", __name__), name)
    return make(result)

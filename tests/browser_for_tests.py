"""A headless browser in which tests open pages, and see what these complain of and ask for."""

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

BROWSERS = ("chromium", "chromium-browser", "google-chrome")
BROWSER = next(filter(None, map(shutil.which, BROWSERS)), None)

without_browser = pytest.mark.skipif(
    BROWSER is None, reason=f"no browser is installed (looked for {', '.join(BROWSERS)})"
)


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """A headless Chromium."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=BROWSER, args=["--no-sandbox"])
        yield chromium
        chromium.close()


class Opened:
    """A page in the browser, with what it complained of and asked for."""

    def __init__(self, browser: Any, path: Path, scheme: str, width: int) -> None:
        self.page = browser.new_page(
            viewport={"width": width, "height": 900}, color_scheme=scheme, reduced_motion="reduce"
        )
        self.complaints: list[str] = []
        self.requests: list[str] = []
        self.page.on("console", lambda message: self.complaints.append(message.text))
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.page.on("request", lambda request: self.requests.append(request.url))
        self.page.goto(path.as_uri())
        self.ask("bindusbl.opened")

    def ask(self, expression: str) -> Any:
        """Return the value of an expression in the page."""
        return self.page.evaluate(expression)

    def until(self, condition: str) -> None:
        """Wait until something holds in the page, whose policy forbids to wait there."""
        for _ in range(200):
            if self.ask(condition):
                return
            self.page.wait_for_timeout(20)
        raise AssertionError(f"{condition}: not in four seconds")

    def painted(self, canvas: str) -> int:
        """Return how many different colours a canvas shows."""
        return int(
            self.ask(
                f"""(() => {{
                    const it = document.querySelector({canvas!r});
                    const data = it.getContext("2d").getImageData(0, 0, it.width, it.height).data;
                    return new Set(new Uint32Array(data.buffer)).size; }})()"""
            )
        )


Open = Callable[..., Opened]


@pytest.fixture
def opened(browser: Any) -> Iterator[Open]:
    """Open pages; after the test, none of them may have complained or asked for another file."""
    pages: list[tuple[Opened, Path]] = []

    def open_page(path: Path, scheme: str = "light", width: int = 1280) -> Opened:
        pages.append((Opened(browser, path, scheme, width), path))
        return pages[-1][0]

    yield open_page
    for it, path in pages:
        assert it.complaints == []
        assert it.requests == [path.as_uri()]
        it.page.close()

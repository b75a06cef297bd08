"""What a page's policy lets a browser run, and what became elements of it."""

import base64
import hashlib
from html.parser import HTMLParser


class Parsed(HTMLParser):
    """The elements of a page with their attributes, its scripts and styles, and its policy."""

    def __init__(self, page: str) -> None:
        super().__init__(convert_charrefs=True)
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.texts: dict[str, list[str]] = {"script": [], "style": []}
        self.policy = ""
        self._inside = ""
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        self.elements.append((tag, given))
        runs = given.get("type") in (None, "module", "text/javascript")
        self._inside = tag if tag == "style" or (tag == "script" and runs) else ""
        if self._inside:
            self.texts[tag].append("")
        if given.get("http-equiv") == "Content-Security-Policy":
            self.policy = given["content"] or ""

    def handle_endtag(self, tag: str) -> None:
        self._inside = ""

    def handle_data(self, data: str) -> None:
        if self._inside:
            self.texts[self._inside][-1] += data


def fingerprint(text: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"


def assert_allows_its_own_alone(page: Parsed) -> None:
    """Check that the policy names each script and style by its hash, and that no data is run."""
    rules = dict(rule.split(" ", 1) for rule in page.policy.split("; "))
    assert rules["default-src"] == rules["base-uri"] == rules["form-action"] == "'none'"
    assert rules["script-src"].split() == list(map(fingerprint, page.texts["script"]))
    assert rules["style-src"].split() == list(map(fingerprint, page.texts["style"]))
    assert not any("owned" in script for script in page.texts["script"])
    for tag, attributes in page.elements:
        assert tag not in ("img", "iframe", "object", "embed", "base", "link", "form")
        assert not [name for name in attributes if name.startswith("on") or name == "style"]

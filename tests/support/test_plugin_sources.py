"""Which files a plug-in is known by: its own, and those that it imports from beside it."""

from pathlib import Path

import pytest

from bindusbl_des.support.plugins import sources_of

FILES = {
    "mine.py": """
import numpy, json, bindusbl_des, sys
import near.deep
from bindusbl_des.core.protocol import schedules
from numbers import lonely

def part(view):
    from lazily import anything
""",
    "near/__init__.py": "",
    "near/deep.py": "from . import left\nfrom .right import *\nfrom ... import beyond\n",
    "near/left.py": "from mine import part\n",
    "near/right.py": "import near.no_such_module\n",
    "near/unused.py": "",
    "lazily.py": "this is no Python\n",
    "lonely.py": "",
    "unused.py": "import mine\n",
}
USED = ["mine.py", "lazily.py", "near/__init__.py", "near/deep.py", "near/left.py", "near/right.py"]


def laid(folder: Path) -> Path:
    """Return a folder with the files."""
    for name, text in FILES.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    return folder


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.syspath_prepend(str(tmp_path))
    return laid(tmp_path)


def found(name: str, home: Path) -> list[str]:
    return [str(file.relative_to(home)) for file in sources_of(name)]


def test_what_is_imported_from_beside_a_plug_in_is_its_own(home: Path) -> None:
    """Also within a function, by packages, in circles; other packages and dead names are not."""
    assert found("mine:part", home) == USED
    assert found("near.right:part", home) == ["near/right.py", "near/__init__.py"]
    assert found("lazily:part", home) == ["lazily.py"]
    assert found("no_such:part", home) == found("mine", home) == []


def test_an_installed_plug_in_is_its_package(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What lies beside it among installed packages is somebody else's."""
    home = laid(tmp_path / "site-packages")
    monkeypatch.syspath_prepend(str(home))
    assert found("mine:part", home) == ["mine.py"]
    assert found("near.left:part", home) == ["near/left.py", "near/__init__.py"]
    assert found("near.deep:part", home)[2:] == ["near/left.py", "near/right.py"]


def test_this_package_is_known_by_its_version() -> None:
    """A part that ships, named as a plug-in, is its file alone."""
    (file,) = sources_of("bindusbl_des.models.schedules.colouring:spatial_reuse")
    assert file.name == "colouring.py"

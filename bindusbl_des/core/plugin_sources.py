"""The files of plug-ins: found, not run, so that missions of two versions are not mixed.

They are those of the plug-in's module, of the packages that it is in, and of what these import
from beside it.  Other packages are not followed, nor what is imported by a name made up at run
time.
"""

import ast
import hashlib
from collections.abc import Iterator
from importlib.machinery import ModuleSpec, PathFinder
from importlib.util import resolve_name
from pathlib import Path

from .plugins import is_plugin

# Folders whose packages have nothing to do with each other, and this package, whose version
# stands for its files.
INSTALLED = ("site-packages", "dist-packages")
THIS = __name__.partition(".")[0]


def source_sha256(name: str) -> str:
    """Return the fingerprint of the files of a ``module:object``, "" where none is found."""
    digests = (hashlib.sha256(file.read_bytes()).digest() for file in sources_of(name))
    together = b"".join(digests)
    return hashlib.sha256(together).hexdigest() if together else ""


def sources_of(name: str) -> list[Path]:
    """Return the file that holds a ``module:object``, and then those that it imports from beside it
    or from its own package; none where it is not found.  Nothing is imported.
    """
    module = name.partition(":")[0]
    if not is_plugin(name) or _file(module) is None:
        return []
    own, found, waiting = _Beside(module), dict[str, Path](), [module]
    while waiting:
        for it in _with_packages(waiting.pop()):
            file = _file(it) if it not in found and it in own else None
            if file is not None:
                found[it] = file
                waiting += _imported(it, file)
    first = found.pop(module)
    return [first, *(found[it] for it in sorted(found))]


class _Beside:
    """The modules that lie where a plug-in's does: in its package, or in the folder of that."""

    def __init__(self, module: str) -> None:
        self._module, self._top = module, module.partition(".")[0]
        self._folder = _folder(self._top)

    def __contains__(self, module: str) -> bool:
        top = module.partition(".")[0]
        if THIS in (top, self._top):
            return module == self._module
        is_shared = self._folder is not None and self._folder.name not in INSTALLED
        return top == self._top or (is_shared and _folder(top) == self._folder)


def _with_packages(module: str) -> Iterator[str]:
    """Yield a module and the packages that it is in, which are run before it."""
    while module:
        yield module
        module = module.rpartition(".")[0]


def _imported(module: str, file: Path) -> Iterator[str]:
    """Yield the names of what a file may import, of which some are no modules."""
    package = module if file.stem == "__init__" else module.rpartition(".")[0]
    try:
        tree = ast.parse(file.read_bytes())
    except (SyntaxError, ValueError):  # it is compiled, or nobody can import it
        return
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (it.name for it in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from _members(node, package)


def _members(node: ast.ImportFrom, package: str) -> tuple[str, ...]:
    """Return what ``from a import b`` may import: the module a, and b where it is one of a's."""
    try:
        base = resolve_name("." * node.level + (node.module or ""), package)
    except ImportError:  # beyond the outermost package
        return ()
    return (base, *(f"{base}.{it.name}" for it in node.names))


def _file(module: str) -> Path | None:
    """Return the file of a dotted module, None where none is found."""
    spec = _spec(module)
    file = Path(spec.origin) if spec and spec.origin else None
    return file if file and file.is_file() else None


def _folder(top: str) -> Path | None:
    """Return the folder in which an outermost package or module is found."""
    spec = _spec(top)
    inside = [*(spec.submodule_search_locations or ()), spec.origin] if spec else []
    return Path(inside[0]).resolve().parent if inside and inside[0] else None


def _spec(module: str) -> ModuleSpec | None:
    """Return where a dotted module lies; the packages that it is in are not imported."""
    spec, places, words = None, None, module.split(".")
    for number in range(1, len(words) + 1):
        spec = PathFinder.find_spec(".".join(words[:number]), places)
        places = spec.submodule_search_locations if spec else None
        if places is None:  # no package: nothing lies in it
            return spec if number == len(words) else None
    return spec

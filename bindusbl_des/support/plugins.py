"""User-defined parts of a mission: named `module:object`, loaded only with permission.

Importing a module runs it, so a foreign scenario must not choose what is imported.  A name is
loaded only if it was admitted: by ``--allow-plugins`` for the files of a command, by
``load_scenario(..., allow_plugins=True)``, or because its object was given in Python; the
environment variable `PERMISSION` admits all names.  Permission belongs to the process, as imported
modules do; no file stores it.
"""

import ast
import hashlib
import os
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cache, cached_property
from importlib import import_module
from importlib.machinery import ModuleSpec, PathFinder
from importlib.util import resolve_name
from inspect import Parameter, signature
from itertools import count
from numbers import Integral
from operator import attrgetter
from pathlib import Path
from traceback import walk_tb
from typing import (
    Any,
    Generic,
    Literal,
    NoReturn,
    TypeVar,
    cast,
    get_args,
    get_origin,
    get_type_hints,
)

from .wording import LONGEST_ERROR, did_you_mean, printable, shortened

# Set to 1, this environment variable admits every plug-in.
PERMISSION = "BINDUSBL_ALLOW_PLUGINS"

# How a user allows a plug-in.
LEAVE = (
    f"Not loaded; if you trust it, use --allow-plugins or {PERMISSION}=1 (in Python "
    "load_scenario(..., allow_plugins=True), or give the object itself)"
)

# Admitted names; loaded parts by name; and parts that no other process could import.
_admitted: set[str] = set()
_loaded: dict[str, Any] = {}
_here: dict[str, Any] = {}
HERE = "__main__"

Answer = TypeVar("Answer")
Record = TypeVar("Record")


@dataclass(frozen=True, eq=False)
class Family(Generic[Record]):
    """The parts that a scenario can name at one key.

    `parts` are shipped: each is ``module:object`` of this package, or its declarations, if other
    modules make it.  If the family `is_open`, a part may be user-defined: it is called with
    `arguments` and with its settings by name, and what it does not declare is as in `undeclared`.
    Every part has the settings of the model `common`; the simulator applies them, and a
    user-defined part does not get them.  Where the key is a section, `word` is the key in it that
    names the part.
    """

    key: str
    noun: str
    arguments: tuple[str, ...]
    parts: Mapping[str, Any]
    undeclared: Record | None = None
    word: str = ""
    common: Any = None
    is_open: bool = True
    models: str = "settings"
    _found: dict[str, Any] = field(default_factory=dict, repr=False)

    @property
    def name_key(self) -> str:
        """The key that names a part."""
        return f"{self.key}.{self.word}" if self.word else self.key

    @cached_property
    def siblings(self) -> tuple[str, ...]:
        """The names of the shipped parts."""
        return tuple(self.parts)

    @cached_property
    def traits(self) -> dict[str, Record]:
        """The declarations of each shipped part."""
        return {name: self.declared(name) for name in self.parts}

    def having(self, has: Callable[[Record], bool]) -> list[str]:
        """Return the names of the shipped parts whose declarations satisfy `has`."""
        return [name for name, traits in self.traits.items() if has(traits)]

    @cached_property
    def settings(self) -> dict[str, Any]:
        """The models of the settings of shipped parts that have any."""
        found = {name: getattr(record, self.models, None) for name, record in self.traits.items()}
        return {name: model for name, model in found.items() if model and model.model_fields}

    def part(self, name: str) -> Any:
        """Return a shipped part; its file is imported when it is first asked for."""
        found = self._found.get(name)
        if found is None:
            found = self.parts[name]
            if isinstance(found, str):
                module, _, path = found.partition(":")
                found = getattr(import_module(f"{THIS}.{module}"), path)
            self._found[name] = found
        return found

    def known(self, name: str) -> Any:
        """Return a shipped part, or a user-defined one that is loaded; else None."""
        return self.part(name) if name in self.parts else loaded(name)

    def declared(self, name: str) -> Record:
        """Return the declarations of a part: of a user-defined one, if loaded, its attributes."""
        if name in self.parts:
            part = self.part(name)
            record: Record = getattr(part, "traits", part)
            return record
        own, usual = loaded(name), cast(Any, self.undeclared)
        if own is None:
            return cast(Record, usual)

        def given() -> Record:
            return cast(Record, replace(usual, **self._attributes(own)))

        return asked(self.key, name, given, when=" as it was asked what it declares")

    def _attributes(self, own: Any) -> dict[str, Any]:
        """Return the declarations that a user-defined part has as attributes."""
        usual: Any = self.undeclared
        names = [each.name for each in fields(usual) if not each.name.endswith("settings")]
        return {name: getattr(own, name) for name in names if hasattr(own, name)}

    def undeclarable(self, name: str) -> "Iterator[PluginError]":
        """Yield an error for each invalid declaration of a user-defined part, if it is loaded."""
        own = loaded(name)
        if own is None or self.undeclared is None:
            return
        hints = get_type_hints(type(self.undeclared))
        for word, value in self._attributes(own).items():
            is_flag = hints[word] is bool
            allowed = (False, True) if is_flag else get_args(hints[word])
            if (is_flag or get_origin(hints[word]) is Literal) and not any(
                type(value) is type(option) and value == option for option in allowed
            ):
                options = ", ".join(map(repr, allowed))
                message = f"{name!r} declares {word} = {value!r}; give one of {options}"
                yield PluginError(self.key, message)


class Ended(SystemExit):
    """A request to end the program, which is no error of the part that was running."""


class PluginError(ValueError):
    """A user-defined part cannot be used; `key` names it in the scenario."""

    def __init__(self, key: str, message: str) -> None:
        self.key, self.message = key, message
        super().__init__(key, message)

    def __str__(self) -> str:
        return f"{self.key}: {self.message}"


def is_plugin(name: str) -> bool:
    """Return whether a name has the form ``module:object``, both dotted Python names.

    >>> is_plugin("my_parts.fast:schedule"), is_plugin("dsatur"), is_plugin("a b:c")
    (True, False, False)
    """
    module, _, path = name.partition(":")
    return all(word.isidentifier() for word in (*module.split("."), *path.split(".")))


def allow(names: Iterable[str]) -> None:
    """Admit names: this process may import their modules."""
    _admitted.update(map(str, names))


def allowed_everywhere() -> bool:
    """Return whether the environment admits every plug-in."""
    return os.environ.get(PERMISSION) == "1"


def is_allowed(name: str) -> bool:
    """Return whether this process may load a plug-in."""
    return name in _admitted or allowed_everywhere()


def refusal(name: str) -> str:
    """Return a message: what would be loaded, and how to allow it."""
    module, _, path = name.partition(":")
    return (
        f"{name!r} is a plug-in: the module {module} would be imported and its {path} called, with "
        f"your rights. {LEAVE}"
    )


def name_of(part: Any) -> str:
    """Return the ``module:object`` of a part given as an object, and admit it.

    A part of a notebook's cell or of a function's body gets a name that holds in this process
    alone, a different one for each object: no other process could import it.
    """
    module, path = (getattr(part, word, None) for word in ("__module__", "__qualname__"))
    name = f"{module}:{path}"
    try:
        known = module != HERE and is_plugin(name)
        found = known and attrgetter(str(path))(import_module(str(module)))
    except Exception:  # a module's own `__getattr__` may raise anything
        found = None
    if found is not part:
        name = _name_here(part)
    allow([name])
    _loaded[name] = part
    return name


def _name_here(part: Any) -> str:
    word = re.sub(r"\W", "_", str(getattr(part, "__name__", type(part).__name__)))
    for number in count(1):
        name = f"{HERE}:{word}" + f"_{number}" * (number > 1)
        if _here.setdefault(name, part) is part:
            return name
    raise AssertionError(part)


def refuse_here(key: str, name: str) -> None:
    """Refuse a part that only this process knows, where worker processes need it.

    Raises:
        PluginError: saying what to do.
    """
    if name in _here:
        raise PluginError(
            key,
            f"{name!r} is known to this process alone, and workers would not find it; put it at "
            "the top of a module of its own and import it from there, or fly missions one by one "
            "(`simulate`)",
        )


def load(family: Family[Any], name: str) -> Any:
    """Import the object that a scenario names as ``module:object`` at the key of a family.

    Raises:
        PluginError: when it is not allowed, when there is no such module or object, or when it
            cannot be called as the family's parts are.
    """
    if not is_allowed(name):
        raise PluginError(family.key, refusal(name))
    module, _, path = name.partition(":")
    try:
        found = _here[name] if name in _here else attrgetter(path)(import_module(module))
    except (KeyboardInterrupt, Ended):
        raise
    except BaseException as error:  # a module may raise anything, and call sys.exit
        remedy = _remedy(family, module, path)
        raise PluginError(
            family.key, f"cannot load {name!r} ({_reason(error, name)}){remedy}"
        ) from None
    asked(family.key, name, _check, family, name, found, when=" as it was looked at")
    _loaded[name] = found
    return found


def loaded(name: str) -> Any:
    """Return a part that this process has loaded or was given, else None; nothing is imported."""
    return _loaded.get(name)


def asked(
    key: str, name: str, verb: Callable[..., Answer], *arguments: Any, when: str = ""
) -> Answer:
    """Call a function of a user-defined part, and blame that part for any exception.

    `when` says in messages when that was.  A PluginError of another part that it called passes.

    Raises:
        PluginError: naming key, part and error, in one line; even if the part called `sys.exit`.
    """
    try:
        return verb(*arguments)
    except (KeyboardInterrupt, Ended, PluginError):
        raise
    except BaseException as error:
        raise PluginError(key, f"{name!r} raised {_told(error, name, when)}") from error


def shown(key: str, name: str, answer: Any, when: str = "") -> str:
    """Return a user-defined part's answer as one short line for a message.

    Raises:
        PluginError: when its `repr` raises.
    """
    return shortened(" ".join(asked(key, name, repr, answer, when=when).split()))


@dataclass(frozen=True)
class OwnPart:
    """A user-defined part with its settings; it is blamed for any exception that it raises.

    The caller checks its answers, and refuses invalid ones.
    """

    key: str
    name: str
    part: Callable[..., Any]

    def __call__(self, *arguments: Any, when: str = "") -> Any:
        """Return the part's answer; `when` says in messages when that was.

        Raises:
            PluginError: when it raises anything.
        """
        return self.ask(self.part, *arguments, when=when)

    def ask(self, verb: Callable[..., Answer], *arguments: Any, when: str = "") -> Answer:
        """Return the answer of a method of the part, or of a reader of its answer:
        :func:`asked`.
        """
        return asked(self.key, self.name, verb, *arguments, when=when)

    def refuse(
        self, answer: Any, needed: str, *, when: str = "", verb: str = "returned"
    ) -> NoReturn:
        """Refuse an answer: the message shows it, and says what it must be.

        Raises:
            PluginError: naming key, part, answer and remedy.
        """
        self.fail(f"{verb} {shown(self.key, self.name, answer, when)}{needed}")

    def fail(self, message: str) -> NoReturn:
        """Refuse the part with a message.

        Raises:
            PluginError: naming key and part.
        """
        raise PluginError(self.key, f"{self.name!r} {message}")


def is_whole(answer: Any) -> bool:
    """Return whether an answer is a whole number, of Python or numpy, and not a truth value.

    >>> is_whole(2), is_whole(2.0), is_whole(True)
    (True, False, False)
    """
    return isinstance(answer, Integral) and not isinstance(answer, bool)


def _check(family: Family[Any], name: str, found: Any) -> None:
    """Refuse an object that cannot be called with the arguments of a family."""
    if not callable(found):
        kind = type(found).__name__
        raise PluginError(
            family.key,
            f"{name!r} is of the type {kind}, which cannot be called; a {family.noun} is called "
            f"with ({', '.join(family.arguments)})",
        )
    try:
        form = signature(found)
    except (TypeError, ValueError):  # compiled functions may have no signature
        return
    try:
        own = [
            parameter
            for parameter in form.parameters.values()
            if parameter.kind is not Parameter.KEYWORD_ONLY
        ]
        form.replace(parameters=own).bind(*family.arguments)
    except TypeError as error:
        raise PluginError(
            family.key,
            f"{name!r} cannot be called as a {family.noun} is, with "
            f"({', '.join(family.arguments)}): {error}{_whose(found)}",
        ) from None


def _whose(found: Any) -> str:
    """Return a remedy for a class that was named in place of one of its objects."""
    is_meant = isinstance(found, type) and "__call__" in vars(found)
    return "; it is a class: name an object of it" if is_meant else ""


def _remedy(family: Family[Any], module: str, path: str) -> str:
    """Return what to write instead of an object that cannot be loaded."""
    if module == HERE:
        return "; it was of a notebook or script that has ended: put it into a module of its own"
    if module.endswith(".py"):
        return f"; write {module.removesuffix('.py')}:{path}, the module without its file's ending"
    known = getattr(sys.modules.get(module), "__dict__", ())
    return did_you_mean(path, [word for word in known if not word.startswith("_")]) or (
        "; name an importable module:object (is its folder on PYTHONPATH?) or one of "
        + ", ".join(family.siblings)
    )


def _reason(error: BaseException, name: str) -> str:
    """Return why an import failed, without the error's type where Python's message suffices."""
    plain = isinstance(error, ImportError | AttributeError)
    return printable(str(error)) + _line(error, name) if plain else _told(error, name)


def _told(error: BaseException, name: str, when: str = "") -> str:
    kind = f"{type(error).__name__}{when}"
    text = shortened(" ".join(str(error).split()), LONGEST_ERROR)
    return printable(f"{kind}: {text}" if text else kind) + _line(error, name)


def _line(error: BaseException, name: str) -> str:
    """Return the last line of a plug-in's own module in a traceback, as ``, at my_parts.py:12``."""
    module = name.partition(":")[0]
    own = [
        f", at {Path(frame.f_code.co_filename).name}:{line}"
        for frame, line in walk_tb(error.__traceback__)
        if frame.f_globals.get("__name__") == module
    ]
    return own[-1] if own else ""


# The source files of plug-ins, by whose fingerprint missions of two versions are told apart.
#
# They are the plug-in's module, its packages, and the modules beside it that these import; they are
# read, not run. Other packages are not followed, nor imports by a name that is made at run time.


# Folders of unrelated packages; and this package, whose files have a fingerprint of their own.
INSTALLED = ("site-packages", "dist-packages")
THIS = __name__.partition(".")[0]


# Folders of this package on which a mission's numbers depend.
MISSIONS = ("support", "core", "models")


@cache
def package_sha256() -> str:
    """Return the fingerprint of the package's files on which missions depend, as first read."""
    package, total = Path(__file__).parents[1], hashlib.sha256()
    for file in sorted(file for folder in MISSIONS for file in (package / folder).rglob("*.py")):
        total.update(f"{file.relative_to(package).as_posix()}\n".encode() + file.read_bytes())
    return total.hexdigest()


def source_sha256(name: str) -> str:
    """Return the fingerprint of the source files of a ``module:object``; "" if none is found."""
    digests = (hashlib.sha256(file.read_bytes()).digest() for file in sources_of(name))
    together = b"".join(digests)
    return hashlib.sha256(together).hexdigest() if together else ""


def sources_of(name: str) -> list[Path]:
    """Return the file of a ``module:object``, then the files that it imports from beside it.

    These lie in its folder or package.  The list is empty if it is not found.  Nothing is imported.
    """
    module = name.partition(":")[0]
    if not is_plugin(name) or _file(module) is None:
        return []
    own, found, waiting = _Beside(module), dict[str, Path](), [module]
    while waiting:
        for dotted in _with_packages(waiting.pop()):
            file = _file(dotted) if dotted not in found and dotted in own else None
            if file is not None:
                found[dotted] = file
                waiting += _imported(dotted, file)
    first = found.pop(module)
    return [first, *(found[dotted] for dotted in sorted(found))]


class _Beside:
    """The modules beside a plug-in: those in its package, or in the folder of its package."""

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
    """Yield a module and then its packages, which Python runs before it."""
    while module:
        yield module
        module = module.rpartition(".")[0]


def _imported(module: str, file: Path) -> Iterator[str]:
    """Yield the names of the modules that a file may import; some are not modules."""
    package = module if file.stem == "__init__" else module.rpartition(".")[0]
    try:
        tree = ast.parse(file.read_bytes())
    except (SyntaxError, ValueError):  # it is compiled, or cannot be imported
        return
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from _members(node, package)


def _members(node: ast.ImportFrom, package: str) -> tuple[str, ...]:
    """Return the modules that ``from a import b`` may import: a, and b if it is a module of a."""
    try:
        base = resolve_name("." * node.level + (node.module or ""), package)
    except ImportError:  # beyond the outermost package
        return ()
    return (base, *(f"{base}.{alias.name}" for alias in node.names))


def _file(module: str) -> Path | None:
    """Return the file of a dotted module; None if it is not found."""
    spec = _spec(module)
    file = Path(spec.origin) if spec and spec.origin else None
    return file if file and file.is_file() else None


def _folder(top: str) -> Path | None:
    """Return the folder of an outermost package or module."""
    spec = _spec(top)
    inside = [*(spec.submodule_search_locations or ()), spec.origin] if spec else []
    return Path(inside[0]).resolve().parent if inside and inside[0] else None


def _spec(module: str) -> ModuleSpec | None:
    """Return the spec of a dotted module, without importing its packages."""
    spec, places, words = None, None, module.split(".")
    for number in range(1, len(words) + 1):
        spec = PathFinder.find_spec(".".join(words[:number]), places)
        places = spec.submodule_search_locations if spec else None
        if places is None:  # no package: nothing lies in it
            return spec if number == len(words) else None
    return spec

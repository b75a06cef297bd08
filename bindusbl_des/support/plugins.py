"""Parts of a mission that somebody else has written: named `module:object`, loaded with leave only.

To import a module is to run it, so a scenario from a stranger must not choose what is imported.  A
name is loaded once it is admitted: by ``--allow-plugins`` for the files of a command, by
``load_scenario(..., allow_plugins=True)``, because its object was given in Python, or all of them
by the environment variable `PERMISSION`.  Leave is the process's, as imported modules are; it is
never kept in a file.
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

# Set to 1, every plug-in that is named is loaded by whoever runs missions.
PERMISSION = "BINDUSBL_ALLOW_PLUGINS"

# How they are allowed.
LEAVE = (
    f"Not loaded; if you trust it, use --allow-plugins or {PERMISSION}=1 (in Python "
    "load_scenario(..., allow_plugins=True), or give the object itself)"
)

# Names that may be loaded, and the parts that this process has by them; among them those that no
# other process could find.
_admitted: set[str] = set()
_loaded: dict[str, Any] = {}
_here: dict[str, Any] = {}
HERE = "__main__"

Answer = TypeVar("Answer")
Record = TypeVar("Record")


@dataclass(frozen=True, eq=False)
class Family(Generic[Record]):
    """The parts that can be named at one key of the scenario.

    `parts` ship: where each stands, as ``module:object`` of this package, or what it declares,
    where other modules make it.  A user-defined one is called with `arguments`, and with its
    settings by name, unless the family is not open to such; what it does not declare is as
    `undeclared` has it.  The `common` settings, of which this is the model, every part has: the
    simulator heeds them, and a user-defined part is not called with them.  Where the key is a
    section, `word` is the one of its keys that names the part.
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
        """The key at which a part is named."""
        return f"{self.key}.{self.word}" if self.word else self.key

    @cached_property
    def siblings(self) -> tuple[str, ...]:
        """The names of the parts that ship."""
        return tuple(self.parts)

    @cached_property
    def traits(self) -> dict[str, Record]:
        """What each of them declares."""
        return {name: self.declared(name) for name in self.parts}

    def having(self, has: Callable[[Record], bool]) -> list[str]:
        """Return the names of those of them of which something is true that they declare."""
        return [name for name, traits in self.traits.items() if has(traits)]

    @cached_property
    def settings(self) -> dict[str, Any]:
        """The models of the settings of those of them that have any."""
        found = {name: getattr(record, self.models, None) for name, record in self.traits.items()}
        return {name: model for name, model in found.items() if model and model.model_fields}

    def part(self, name: str) -> Any:
        """Return a part that ships; its file is imported when it is first asked for."""
        found = self._found.get(name)
        if found is None:
            found = self.parts[name]
            if isinstance(found, str):
                module, _, path = found.partition(":")
                found = getattr(import_module(f"{THIS}.{module}"), path)
            self._found[name] = found
        return found

    def declared(self, name: str) -> Record:
        """Return what a part declares; a user-defined one by its attributes, if it is loaded."""
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
        """Return what a user-defined part declares by its attributes."""
        usual: Any = self.undeclared
        names = [each.name for each in fields(usual) if not each.name.endswith("settings")]
        return {name: getattr(own, name) for name in names if hasattr(own, name)}

    def undeclarable(self, name: str) -> "Iterator[PluginError]":
        """Yield what a user-defined part, which is loaded, declares that no part can."""
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
    """Somebody has asked the program to end: whatever it is doing, that is no part's mistake."""


class PluginError(ValueError):
    """A part of somebody's own cannot be used; `key` names it in the scenario."""

    def __init__(self, key: str, message: str) -> None:
        self.key, self.message = key, message
        super().__init__(key, message)

    def __str__(self) -> str:
        return f"{self.key}: {self.message}"


def is_plugin(name: str) -> bool:
    """Tell whether a name is of the form ``module:object``, both dotted Python names.

    >>> is_plugin("my_parts.fast:schedule"), is_plugin("dsatur"), is_plugin("a b:c")
    (True, False, False)
    """
    module, _, path = name.partition(":")
    return all(word.isidentifier() for word in (*module.split("."), *path.split(".")))


def allow(names: Iterable[str]) -> None:
    """Admit names: whoever runs missions in this process may import their modules."""
    _admitted.update(map(str, names))


def allowed_everywhere() -> bool:
    """Tell whether the environment allows every plug-in."""
    return os.environ.get(PERMISSION) == "1"


def is_allowed(name: str) -> bool:
    """Tell whether a plug-in may be loaded in this process."""
    return name in _admitted or allowed_everywhere()


def refusal(name: str) -> str:
    """Return what would be loaded, and how to allow it."""
    module, _, path = name.partition(":")
    return (
        f"{name!r} is a plug-in: the module {module} would be imported and its {path} called, with "
        f"your rights. {LEAVE}"
    )


def name_of(part: Any) -> str:
    """Return the ``module:object`` of a part that was given as an object, and admit it.

    A part of which no other process could find that, of a notebook's cell or within a function, has
    a name that holds in this process alone: each object another one.
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
    """Refuse a part that this process alone knows, where others are to have it.

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
    """Return the object that a scenario names as ``module:object`` at the key of a family.

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
    """Return a part that this process has loaded or was given; None if not: nothing is imported."""
    return _loaded.get(name)


def asked(
    key: str, name: str, verb: Callable[..., Answer], *arguments: Any, when: str = ""
) -> Answer:
    """Return what a verb of somebody's own answers; whatever it raises is that part's mistake.

    `when` says when that was, in messages.  The mistake of another part that it called stays that
    other's.

    Raises:
        PluginError: naming key, part and error, in one line; even where it called `sys.exit`.
    """
    try:
        return verb(*arguments)
    except (KeyboardInterrupt, Ended, PluginError):
        raise
    except BaseException as error:
        raise PluginError(key, f"{name!r} raised {_told(error, name, when)}") from error


def shown(key: str, name: str, answer: Any, when: str = "") -> str:
    """Return an answer of somebody's own as a message shows it, in one short line.

    Raises:
        PluginError: when it cannot even be written down.
    """
    return shortened(" ".join(asked(key, name, repr, answer, when=when).split()))


@dataclass(frozen=True)
class OwnPart:
    """A user-defined part of a family, with its settings: whatever it raises is its own mistake.

    Whoever asks it checks the answer, and refuses what is none.
    """

    key: str
    name: str
    part: Callable[..., Any]

    def __call__(self, *arguments: Any, when: str = "") -> Any:
        """Return what it answers; `when` says when that was, in messages.

        Raises:
            PluginError: when it raises anything.
        """
        return self.ask(self.part, *arguments, when=when)

    def ask(self, verb: Callable[..., Answer], *arguments: Any, when: str = "") -> Answer:
        """Return what a verb of it, or one that reads its answer, answers (:func:`asked`)."""
        return asked(self.key, self.name, verb, *arguments, when=when)

    def refuse(
        self, answer: Any, needed: str, *, when: str = "", verb: str = "returned"
    ) -> NoReturn:
        """Refuse an answer, which is shown, and say what it must be.

        Raises:
            PluginError: naming key, part, answer and remedy.
        """
        self.fail(f"{verb} {shown(self.key, self.name, answer, when)}{needed}")

    def fail(self, message: str) -> NoReturn:
        """Refuse what it does or is.

        Raises:
            PluginError: naming key and part.
        """
        raise PluginError(self.key, f"{self.name!r} {message}")


def is_whole(answer: Any) -> bool:
    """Tell whether an answer is a whole number, of Python or numpy; True is none.

    >>> is_whole(2), is_whole(2.0), is_whole(True)
    (True, False, False)
    """
    return isinstance(answer, Integral) and not isinstance(answer, bool)


def _check(family: Family[Any], name: str, found: Any) -> None:
    """Refuse what cannot be called with the arguments of a family."""
    if not callable(found):
        kind = type(found).__name__
        raise PluginError(
            family.key,
            f"{name!r} is of the type {kind}, which cannot be called; a {family.noun} is called "
            f"with ({', '.join(family.arguments)})",
        )
    try:
        form = signature(found)
    except (TypeError, ValueError):  # what is compiled need not tell
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
    """Return what to do about a class whose objects are meant."""
    is_meant = isinstance(found, type) and "__call__" in vars(found)
    return "; it is a class: name an object of it" if is_meant else ""


def _remedy(family: Family[Any], module: str, path: str) -> str:
    """Return what to write in the place of an object that cannot be loaded."""
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
    """Return why an import failed; Python's own words for that need no name of the error."""
    plain = isinstance(error, ImportError | AttributeError)
    return printable(str(error)) + _line(error, name) if plain else _told(error, name)


def _told(error: BaseException, name: str, when: str = "") -> str:
    kind = f"{type(error).__name__}{when}"
    text = shortened(" ".join(str(error).split()), LONGEST_ERROR)
    return printable(f"{kind}: {text}" if text else kind) + _line(error, name)


def _line(error: BaseException, name: str) -> str:
    """Return the line of a plug-in's own module that an error came by, as ``, at my_parts.py:12``.

    It is the last such line: what it called may be of another module.
    """
    module = name.partition(":")[0]
    own = [
        f", at {Path(frame.f_code.co_filename).name}:{line}"
        for frame, line in walk_tb(error.__traceback__)
        if frame.f_globals.get("__name__") == module
    ]
    return own[-1] if own else ""


# The files of plug-ins: found, not run, so that missions of two versions are not mixed.
#
# They are those of the plug-in's module, of the packages that it is in, and of what these import
# from beside it. Other packages are not followed, nor what is imported by a name made up at run
# time.


# Folders whose packages have nothing to do with each other, and this package, whose files have a
# fingerprint of their own.
INSTALLED = ("site-packages", "dist-packages")
THIS = __name__.partition(".")[0]


# What missions are made of: folders of this package.
MISSIONS = ("support", "core", "models")


@cache
def package_sha256() -> str:
    """Return the fingerprint of the files that missions are made of, as this process found them."""
    package, total = Path(__file__).parents[1], hashlib.sha256()
    for file in sorted(file for folder in MISSIONS for file in (package / folder).rglob("*.py")):
        total.update(f"{file.relative_to(package).as_posix()}\n".encode() + file.read_bytes())
    return total.hexdigest()


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
        for dotted in _with_packages(waiting.pop()):
            file = _file(dotted) if dotted not in found and dotted in own else None
            if file is not None:
                found[dotted] = file
                waiting += _imported(dotted, file)
    first = found.pop(module)
    return [first, *(found[dotted] for dotted in sorted(found))]


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
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from _members(node, package)


def _members(node: ast.ImportFrom, package: str) -> tuple[str, ...]:
    """Return what ``from a import b`` may import: the module a, and b where it is one of a's."""
    try:
        base = resolve_name("." * node.level + (node.module or ""), package)
    except ImportError:  # beyond the outermost package
        return ()
    return (base, *(f"{base}.{alias.name}" for alias in node.names))


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

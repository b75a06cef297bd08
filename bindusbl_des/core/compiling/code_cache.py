"""Machine code kept on disk for the next process: checked when read, done without if need be.

numba believes whatever lies in its cache folder and stops at whatever goes wrong there.  Here each
file names what it was made of and a digest of its contents, so that a damaged one is compiled anew
and replaced; folders in which others could put code to be run are not used; and no trouble with the
disk ends a mission.  The first trouble is told in one line, by the first process that meets it.
"""

import errno
import hashlib
import io
import os
import pickle
import stat
import sys
from collections.abc import Callable, Iterator, Sequence
from glob import escape
from pathlib import Path
from typing import Any

import llvmlite
import numba
from numba.core.caching import (
    CacheImpl,
    CompileResultCacheImpl,
    FunctionCache,
    UserProvidedCacheLocator,
)
from numba.core.environment import Environment, lookup_environment
from numba.core.runtime.nrt import rtsys as runtime
from numba.core.serialize import NumbaPickler

from ..durable import draft_of
from .linking import Whole, generator_of
from .turns import Turn

# A file of ours: this word, what it was made of, the digest of the code, the code.
WORD, DIGEST_BYTES = b"bindusbl", 32
SUFFIX = ".bindusbl.nbc"

# Tells processes that are started by this one that the user has been told.
TOLD = "BINDUSBL_DES_CODE_CACHE_TOLD"

# numba's: the types of the arguments, the machine, and digests of bytecode and closure.
Key = tuple[object, object, tuple[str, str]]

# What went wrong in this process, a line each, and the folders in which code is kept.
troubles: list[str] = []
folders: set[Path] = set()


def trouble(folder: Path, what: str) -> None:
    """Note what is wrong with a folder of compiled code; tell the user the first time."""
    line = f"{folder}: {what}"
    if line not in troubles:
        troubles.append(line)
    if TOLD not in os.environ:
        os.environ[TOLD] = "1"
        remedy = "what it does not hold is compiled anew; `bindusbl-des doctor` says more"
        print(f"Compiled code in {line}; {remedy}", file=sys.stderr, flush=True)


class Damaged(ValueError):
    """A file of compiled code is not what was written."""


def _sound(path: Path, content: bytes) -> tuple[bytes, bytes]:
    """Return what a file was made of, and its code.

    Raises:
        Damaged: when it is not, whole, what was written.
    """
    start = len(WORD) + 2 * DIGEST_BYTES
    head, code = content[:start], content[start:]
    if not head.startswith(WORD) or not head.endswith(hashlib.sha256(code).digest()):
        raise Damaged(f"{path.name} is damaged")
    return head[len(WORD) : -DIGEST_BYTES], code


def damaged(folder: Path) -> Iterator[Path]:
    """Yield the files of compiled code in a folder that are damaged or cannot be read."""
    for path in sorted(folder.glob(f"*{SUFFIX}")):
        try:
            _sound(path, path.read_bytes())
        except (Damaged, OSError):
            yield path


class Files:
    """Code of one function, in a file for each signature and machine."""

    def __init__(self, folder: Path, name: str, made_of: str, trusted: "Trusted") -> None:
        self._folder, self._name, self._made_of = folder, name, made_of
        self._trusted = trusted

    def _path(self, key: Key) -> Path:
        signature, machine, (_, closure) = key  # an edited function takes its old one's place
        name = _digest(repr((signature, machine, closure))).hex()[:16]
        return self._folder / f"{self._name}.{name}{SUFFIX}"

    def _fingerprint(self, key: Key) -> bytes:
        versions = numba.__version__, llvmlite.__version__, sys.version
        return _digest(repr((versions, self._made_of, key)))

    def load(self, key: Key) -> Any:
        """Return what was kept under a key, or None.

        Raises:
            Damaged: when it is not what was written.
            OSError: when it cannot be read, or was written by somebody else.
        """
        path = self._path(key)
        try:
            with path.open("rb") as file:
                if why := self._trusted(os.fstat(file.fileno())):
                    raise PermissionError(errno.EPERM, f"{path.name} {why}")
                content = file.read()
        except FileNotFoundError:
            return None
        made_of, code = _sound(path, content)
        return pickle.loads(code) if made_of == self._fingerprint(key) else None

    def save(self, key: Key, data: object) -> None:
        """Keep data under a key.

        Raises:
            OSError: when it cannot be written.
        """
        code = _pickled(data)
        head = WORD + self._fingerprint(key) + hashlib.sha256(code).digest()
        with draft_of(self._path(key)) as draft:
            draft.write_bytes(head + code)

    def flush(self) -> None:
        """Delete all that is kept.

        Raises:
            OSError: when it cannot be deleted.
        """
        for path in self._folder.glob(f"{escape(self._name)}.*{SUFFIX}"):
            path.unlink()


def _digest(text: str) -> bytes:
    return hashlib.sha256(text.encode()).digest()


class _Pickler(NumbaPickler):
    """numba's, but for the environments of functions: see `_environment`."""

    def reducer_override(self, obj: Any) -> Any:
        if isinstance(obj, Environment):
            return _environment, (obj.globals["__name__"], obj.consts, obj.env_name)
        return super().reducer_override(obj)  # type: ignore[no-untyped-call]


def _pickled(data: object) -> bytes:
    buffer = io.BytesIO()
    pickler: Any = _Pickler(buffer, protocol=pickle.HIGHEST_PROTOCOL)  # type: ignore[no-untyped-call]
    pickler.dump(data)
    return buffer.getvalue()


def _environment(module: str, constants: Sequence[object], name: str) -> Environment:
    """Return the environment of a function by its name, without loading the function's module.

    Machine code reads constants there and no globals; numba loads the module all the same, and with
    those of its own that work on arrays all of scipy.linalg: 0.3 s and 40 MB in each process.
    """
    found: Environment | None = lookup_environment(name)  # type: ignore[no-untyped-call]
    if found is None:
        found = Environment({"__name__": module})
        found.consts[:] = constants
        found.env_name = name
        Environment._memo[name] = found
    return found


Trusted = Callable[[os.stat_result], str]


def trusted_beside(source: str) -> Trusted:
    """Return what says why a file or folder of code is not to be trusted, or "".

    It must belong to the user, to root, or to whoever owns the source and so could change that.
    """
    owners = {0, os.geteuid(), os.stat(source).st_uid} if hasattr(os, "geteuid") else set()

    def reason(found: os.stat_result) -> str:
        if owners and found.st_uid not in owners:
            return "belongs to another user"
        if owners and found.st_mode & stat.S_IWOTH and not found.st_mode & stat.S_ISVTX:
            return "can be written by everybody"
        return ""

    return reason


class _Checked:
    """Makes a place of numba's one that is passed over when it cannot be used or trusted."""

    _py_file: str
    get_cache_path: Callable[[], str]

    def ensure_cache_path(self) -> None:
        """Make the folder.

        Raises:
            OSError: when it cannot be made or written to, or is not to be trusted.
        """
        folder = Path(self.get_cache_path())
        asked = isinstance(self, UserProvidedCacheLocator)
        root = Path(os.environ.get("NUMBA_CACHE_DIR") or folder)
        try:
            super().ensure_cache_path()  # type: ignore
        except OSError as error:
            if asked:  # others are tried, one after the other, as numba does
                trouble(root, f"cannot be written ({error.strerror})")
            raise
        trusted = trusted_beside(self._py_file)
        for place in {root, folder} if asked else {folder}:
            if why := trusted(place.stat()):
                trouble(place, f"not used, since it {why}")
                raise PermissionError(errno.EPERM, why)


class _Places(CompileResultCacheImpl):
    _locator_classes: list[Any] = [  # noqa: RUF012 (as numba has it)
        type(place.__name__, (_Checked, place), {}) for place in CacheImpl._locator_classes
    ]

    def rebuild(self, target_context: Any, payload: Any) -> Any:
        entered = target_context.subtarget(_internal_codegen=generator_of(Whole))
        return super().rebuild(entered, payload)  # type: ignore[no-untyped-call]


class CodeCache(FunctionCache):
    """numba's cache of one function, none of whose errors reaches the function's callers."""

    _impl_class = _Places

    def __init__(self, function: Callable[..., object], made_of: str) -> None:
        """Find a folder.

        Raises:
            RuntimeError: when there is none.
        """
        super().__init__(function)  # type: ignore[no-untyped-call]
        self._folder = Path(self.cache_path)
        self._cache_file: Any = Files(
            self._folder,
            self._impl.filename_base,
            made_of,
            trusted_beside(function.__code__.co_filename),
        )
        self._turn = Turn(self._folder / f"{self._impl.filename_base}.lock")
        folders.add(self._folder)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the code of a signature, or None where none is kept that can be used.

        What is kept needs numba's runtime, but nothing of what numba knows about equations: that
        takes as long to load as several missions, and who compiles loads it himself.
        """
        try:
            runtime.initialize(target_context)
            found = self._load_overload(sig, target_context)  # type: ignore[no-untyped-call]
            if found is None:
                self._turn.take()
                found = self._load_overload(sig, target_context)  # type: ignore[no-untyped-call]
            return found
        except Exception as error:  # the file may hold anything, and the disk fail in any way
            trouble(self._folder, _said(error))
            return None

    def in_turn(self, compiling: Callable[[Any], Any]) -> Callable[[Any], Any]:
        """Return how a signature is compiled when other processes may want it, too.

        Who finds it not kept has the turn until it is; others find it then.
        """

        def compile_in_turn(sig: Any) -> Any:
            try:
                return compiling(sig)
            finally:
                self._turn.give()

        return compile_in_turn

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep the code of a signature, if possible."""
        try:
            super().save_overload(sig, data)  # type: ignore[no-untyped-call]
        except Exception as error:
            trouble(self._folder, f"cannot be written ({_said(error)})")


def _said(error: Exception) -> str:
    text = getattr(error, "strerror", None) or str(error) or type(error).__name__
    return str(text).partition("\n")[0]

"""Compilation of kernels, and the cache of compiled code on disk.

Functions are compiled into the kernel that calls them, across files and with the law of contact and the drive that
it integrates; a kernel is what is kept on disk.  Numba alone would keep it until the file that it stands in changes.
Here it is kept under a fingerprint of everything that it bakes in (:mod:`~snapbeam.solver.compilation`), with a
check sum (:mod:`~snapbeam.solver.compilation`).
"""

from __future__ import annotations

import gc
import hashlib
import inspect
import logging
import os
import pickle
import stat
import sys
import tempfile
from collections.abc import Callable, Iterable
from contextlib import AbstractContextManager, nullcontext, suppress
from functools import cache
from pathlib import Path
from types import BuiltinFunctionType, CodeType, FunctionType, ModuleType
from typing import Any

import numba
import numpy as np
from numba import njit, typeof
from numba.core import event
from numba.core.caching import CompileResultCacheImpl, FunctionCache, IndexDataCacheFile, _CacheLocator
from numba.core.registry import CPUDispatcher
from numba.extending import overload

_IDLE = frozenset({"inline_inlinables", "inline_overloads", "nopython_rewrites", "with_lifting"})
"""Passes for array expressions, for blocks with a context and for functions that are inlined as source."""
_CHECK = hashlib.sha256
_SIZE = _CHECK().digest_size
_OF_OTHERS = stat.S_IWGRP | stat.S_IWOTH
_warned: set[str] = set()
_LOG = logging.getLogger("snapbeam")
_LONGEST_WAIT = 600.0
"""Seconds to wait for another process that compiles the same kernel, which takes 20 s on a free core."""
_OPTIONS: dict[str, Any] = {"error_model": "numpy", "nogil": True, "_nrt": False}


# How a part of a kernel is compiled: into the kernel that calls it, and nowhere else.
#
# Numba optimises each function and makes machine code of it by itself before it is linked into its callers, where it is
# optimised again.  A kernel has more than a hundred parts that nothing but the kernel calls; done once, with the kernel,
# the same machine code takes half the time to compile.


class _NoLibrary:
    """Placeholder for the code library of a part, which is never called on its own."""

    def set_env(self, name: str, env: Any) -> None:
        """Nowhere to put it."""


def pipeline() -> dict[str, Any]:
    """The option of ``njit`` that compiles a function as a part; none where Numba has been built otherwise."""
    try:
        from llvmlite.binding import Linkage
        from numba.core.codegen import JITCodeLibrary
        from numba.core.compiler import Compiler
    except ImportError:  # a Numba that has moved them
        return {}
    for name in ("finalize", "_get_module_for_linking", "_finalize_dynamic_globals", "codegen"):
        if not hasattr(JITCodeLibrary, name):
            return {}

    class Part(JITCodeLibrary):
        """Code that waits to be linked into the code that calls it."""

        _shared_module: Any = None

        @property
        def codegen(self) -> Any:
            return _NoLibrary()

        def _optimize_functions(self, module: Any) -> None:
            module.data_layout = self._codegen._data_layout

        def finalize(self) -> None:
            """Link nothing: a part of parts would contain all of them, and their callers again."""
            self._raise_if_finalized()
            for library in self._linking_libraries:
                self._reload_init.update(library._reload_init)
            self._finalize_dynamic_globals()
            for function in self._final_module.functions:
                if not function.is_declaration and function.linkage == Linkage.external:
                    function.linkage = "linkonce_odr"
            self._finalized = True

        def _below(self) -> list[Any]:
            """All that the part calls, each after one that calls it, since a linker drops what nobody asks for."""
            found: dict[Any, None] = {}
            waiting = list(reversed(self._linking_libraries))
            while waiting:
                library = waiting.pop()
                if library not in found:
                    found[library] = None
                    if isinstance(library, Part):
                        waiting += reversed(library._linking_libraries)
            return list(found)

        def _get_module_for_linking(self) -> Any:
            """The part with all that it calls, for code that is not a part itself."""
            self._ensure_finalized()
            if self._shared_module is None:
                whole = self._final_module.clone()
                for library in self._below():
                    library._ensure_finalized()
                    own = (
                        library._final_module
                        if isinstance(library, Part)
                        else library._get_module_for_linking()
                    )
                    whole.link_in(own, preserve=True)
                self._shared_module = whole
            return self._shared_module

        def get_pointer_to_function(self, name: str) -> int:
            self._ensure_finalized()
            return 0

    class PartCompiler(Compiler):
        """Numba's own, with the library above, and without the passes that find nothing to do in a part."""

        def define_pipelines(self) -> Any:
            managers = super().define_pipelines()
            for manager in managers:
                manager.passes = [each for each in manager.passes if each[0].name() not in _IDLE]
                manager.finalize()
            return managers

        def _compile_core(self) -> Any:
            state = self.state
            if state.library is None:
                state.library = Part(state.targetctx.codegen(), state.func_id.func_qualname)
            return super()._compile_core()

    return {"pipeline_class": PartCompiler}


# Compiled code on disk: checked before it is loaded, and never a reason for a run to fail.
#
# Machine code that is loaded is run, so a file of it that was damaged could do anything.  Every file here begins with
# the check sum of what follows; one that does not agree counts for nothing, and the code is compiled and written again.
# The check sum does not tell who wrote a file: code is kept only in folders that nobody else can write.  Where there is
# none, it goes into a private folder of the temporary ones, or is not kept at all; that is said once.


def keep_code(dispatcher: Any, mark: str) -> Any:
    """Have what *dispatcher* compiles kept on disk under *mark*, where that is possible; returns it.

    Parameters
    ----------
    dispatcher : a function that Numba compiles
        One that is not, since compilation is switched off, is left as it is.
    mark : str
        What tells this code from the same function's for something else; part of the file's name.
    """
    if not hasattr(dispatcher, "enable_caching"):
        return dispatcher
    try:
        alone = dispatcher.targetoptions.get("_nrt") is False
        dispatcher._cache = _KeptCode(dispatcher.py_func, mark, alone)
    except Exception as error:  # no folder anywhere, or a Numba that keeps code in another way
        _warn_once(f"compiled code is not kept, each start compiles anew ({error})")
    return dispatcher


def _warn_once(words: str) -> None:
    """Once a process."""
    if words not in _warned:
        _warned.add(words)
        _LOG.warning(words)


class _PrivateFolder(_CacheLocator):
    """A folder of this user alone among the temporary ones, for where neither the package nor HOME can be written."""

    def __init__(self, function: Callable[..., Any], file: str) -> None:
        self._file = file
        self._path = private_folder()

    def get_cache_path(self) -> str:
        return self._path

    def get_source_stamp(self) -> tuple[float, int]:
        found = os.stat(self._file)
        return found.st_mtime, found.st_size

    def get_disambiguator(self) -> str:
        return hashlib.sha256(self._file.encode()).hexdigest()[:10]

    @classmethod
    def from_function(cls, function: Callable[..., Any], file: str) -> Any:
        try:
            locator = cls(function, file)
            locator.ensure_cache_path()
        except OSError:
            return None
        return locator


def private_folder() -> str:
    """A folder that nobody else can write, made if it is not there.

    Raises
    ------
    OSError
        If there is none, or what stands in its place belongs to somebody else.
    """
    owner = os.getuid() if hasattr(os, "getuid") else 0
    folder = Path(tempfile.gettempdir()) / f"snapbeam-{owner}"
    folder.mkdir(mode=0o700, exist_ok=True)
    if folder.is_symlink() or not folder.is_dir() or not is_private(folder):
        raise PermissionError(f"{folder} is not this user's alone")
    return str(folder)


def is_private(folder: str | os.PathLike[str], source: str | os.PathLike[str] | None = None) -> bool:
    """Return whether nobody but this user, the administrator and the owner of *source* can write to a folder.

    Members of this user's own group count as the user.  Nobody else may replace the folder either: a folder above it
    that others can write must be sticky, as the temporary one is.
    """
    if os.name == "nt":
        return True
    owners = _trusted_owners(source)
    folder = Path(folder).resolve()
    for at, each in enumerate((folder, *folder.parents)):
        found = each.stat()
        others = _others_write(found) and (at == 0 or not found.st_mode & stat.S_ISVTX)
        if others or (at < 2 and found.st_uid not in owners):
            return False
    return True


def _trusted_owners(source: str | os.PathLike[str] | None) -> set[int]:
    """Users who may write what is run: the present one, the administrator and the owner of *source*."""
    return {os.getuid(), 0} | (
        {os.stat(source).st_uid} if source is not None and os.path.exists(source) else set()
    )


def _others_write(found: os.stat_result) -> bool:
    """Return whether others, or members of a group that is not this user's own, can write to a file or a folder."""
    group = stat.S_IWGRP if found.st_gid not in (os.getgid(), 0) else 0
    return bool(found.st_mode & (stat.S_IWOTH | group))


class _Implementation(CompileResultCacheImpl):
    _locator: Any
    _locator_classes = [*CompileResultCacheImpl._locator_classes, _PrivateFolder]  # noqa: RUF012

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)
        place, source = self._locator.get_cache_path(), inspect.getfile(function)
        why = "neither the package nor HOME can be written"
        if not isinstance(self._locator, _PrivateFolder) and not is_private(place, source):
            why = f"others can write to {place}"
            self._locator = _PrivateFolder.from_function(function, source)
            if self._locator is None:
                raise PermissionError(why)
        if isinstance(self._locator, _PrivateFolder):
            _warn_once(f"compiled code is kept in {self._locator.get_cache_path()}: {why}")


class _KeptCode(FunctionCache):
    """Numba's cache of one function, under a mark, with check sums, and deaf to the disk's troubles."""

    _impl_class = _Implementation

    def __init__(self, function: Callable[..., Any], mark: str, alone: bool) -> None:
        super().__init__(function)
        self._alone = alone
        """True if the code calls no function of the Numba runtime, so that it can be loaded without it."""
        self._cache_file = _CheckedFiles(
            cache_path=self._cache_path,
            filename_base=f"{self._impl.filename_base}-{mark}",
            source_stamp=self._impl.locator.get_source_stamp(),
        )
        self._cache_file.source = inspect.getfile(function)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        try:
            if not self._alone:
                return super().load_overload(sig, target_context)
            # without refreshing the context, which loads what only compiling needs, half a second of each start
            with self._guard_against_spurious_io_errors():
                return self._load_overload(sig, target_context)
        except Exception as error:  # whatever became of the file: compile
            _LOG.debug("compiled code could not be loaded: %s", error)
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        try:
            super().save_overload(sig, data)
        except Exception as error:
            why = getattr(error, "strerror", None) or error
            _warn_once(
                f"compiled code is not kept, each start compiles anew: {self._cache_path} cannot be written "
                f"({why}); set NUMBA_CACHE_DIR to a folder with 20 MB of room"
            )


class _CheckedFiles(IndexDataCacheFile):
    """Files whose contents are preceded by their check sum, and that nobody else can write."""

    source: str | None = None
    """File whose owner is trusted too."""

    def _load_index(self) -> dict[Any, str]:
        data = self._read(self._index_path)
        if data is None:
            return {}
        stamp, overloads = pickle.loads(data)
        return overloads if stamp == self._source_stamp else {}

    def _save_index(self, overloads: dict[Any, str]) -> None:
        self._write(self._index_path, self._dump((self._source_stamp, overloads)))

    def _load_data(self, name: str) -> Any:
        data = self._read(self._data_path(name))
        return None if data is None else pickle.loads(data)

    def _save_data(self, name: str, data: Any) -> None:
        self._write(self._data_path(name), self._dump(data))

    def _write(self, path: str, data: bytes) -> None:
        with self._open_for_write(path) as stream:
            if os.name != "nt":  # whatever the umask: what others can write is not read
                os.fchmod(stream.fileno(), stat.S_IMODE(os.fstat(stream.fileno()).st_mode) & ~_OF_OTHERS)
            stream.write(_CHECK(data).digest() + data)

    def _read(self, path: str) -> bytes | None:
        """Content of a cache file; None if the file is missing, others can write it or its check sum is wrong."""
        try:
            with open(path, "rb", opener=_open_at_once) as file:
                found = os.fstat(file.fileno())
                if not stat.S_ISREG(found.st_mode) or (
                    os.name != "nt"
                    and (_others_write(found) or found.st_uid not in _trusted_owners(self.source))
                ):
                    _warn_once(f"compiled code is compiled again: others can write {path}")
                    return None
                held = file.read()
        except OSError:
            return None
        check, data = held[:_SIZE], held[_SIZE:]
        return data if _CHECK(data).digest() == check else None


def _open_at_once(path: str, flags: int) -> int:
    """Open a file, not what a link names, without waiting for the writer of a pipe."""
    return os.open(path, flags | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0))


# A mark of everything that a kernel bakes in, under which its machine code is kept.


_PACKAGE = Path(__file__).parents[1]
_BAKED_IN = ("util/status_codes.py", "solver/**/*.py")
_CONSTANTS = (int, float, complex, str, bytes, type(None), type(Ellipsis))


class _NoFingerprint(Exception):
    """Something that a kernel may bake in and that has no mark."""


@cache
def _package_mark() -> str:
    digest = hashlib.sha256()
    for pattern in _BAKED_IN:
        for path in sorted(_PACKAGE.glob(pattern)):
            digest.update(path.relative_to(_PACKAGE).as_posix().encode())
            digest.update(path.read_bytes())
    digest.update(f"{sys.version} {numba.__version__} {np.__version__}".encode())
    return digest.hexdigest()


@cache
def fingerprint(kinds: tuple[type, ...]) -> str | None:
    """Fingerprint of everything that a kernel for these laws and drives contains, 20 hexadecimal digits.

    That is every file of the engines, the codes, the versions of Python, Numba and NumPy, and of each law and drive
    its plain attributes and its static methods, with all that those call and every constant that they read.  None if
    some of it cannot be told, as of a class typed at a prompt.
    """
    digest = hashlib.sha256(_package_mark().encode())
    try:
        for kind in kinds:
            for mark in _marks_of_class(kind):
                digest.update(mark.encode() + b"\0")
    except _NoFingerprint:
        return None
    return digest.hexdigest()[:20]


def _marks_of_class(kind: type) -> Iterable[str]:
    """Fingerprint of a class that can be imported by name."""
    module = sys.modules.get(kind.__module__)
    if kind.__module__ == "__main__" or getattr(module, kind.__qualname__, None) is not kind:
        raise _NoFingerprint(kind.__qualname__)
    seen: set[int] = set()
    for each in kind.__mro__[:-1]:
        yield f"{each.__module__}.{each.__qualname__}"
        for name, value in sorted(vars(each).items()):
            if isinstance(value, staticmethod):
                yield name
                yield from _marks(value.__func__, seen)
            elif name == "__annotations__" or isinstance(value, (bool, int, float)) or _is_names(value):
                yield f"{name} {value!r}"


def _is_names(value: Any) -> bool:
    """Return whether a value is a tuple of names, such as the numbers of a drive or the times of its jumps."""
    return isinstance(value, tuple) and all(isinstance(name, str) for name in value)


def _marks(value: Any, seen: set[int]) -> Iterable[str]:
    """Fingerprint of a function with all its references, of a constant, of a module or of a builtin."""
    if isinstance(value, _CONSTANTS):
        yield repr(value)
    elif isinstance(value, tuple):
        for item in value:
            yield from _marks(item, seen)
    elif isinstance(value, ModuleType):
        yield f"{value.__name__} {getattr(value, '__version__', '')}"
    elif isinstance(value, BuiltinFunctionType) or getattr(value, "__module__", None) == "builtins":
        yield repr(value.__qualname__)
    elif isinstance(value, CodeType):
        yield f"{value.co_name} {value.co_code.hex()} {value.co_names} {value.co_freevars}"
        yield from _marks(value.co_consts, seen)
    elif isinstance(value, FunctionType):
        yield from _function_marks(value, seen)
    elif isinstance(getattr(value, "py_func", None), FunctionType):
        yield from _function_marks(value.py_func, seen)
    else:
        raise _NoFingerprint(repr(value))


def _function_marks(function: FunctionType, seen: set[int]) -> Iterable[str]:
    if id(function) in seen:
        return
    seen.add(id(function))
    variables = inspect.getclosurevars(function)
    yield from _marks(function.__code__, seen)
    for name, value in sorted({**variables.globals, **variables.nonlocals}.items()):
        yield name
        yield from _marks(value, seen)


_PART: dict[str, Any] = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True, **pipeline()}
INLINE: dict[str, Any] = {"error_model": "numpy", "forceinline": True}
"""Options of an overload that is to be written into its callers, on every engine."""
INLINE_HERE: dict[str, Any] = {**INLINE, **_PART}
"""The same, for what only the processor's engine calls."""


def overloaded(function: Any) -> Callable[[Any], Any]:
    """Decorate as :func:`numba.extending.overload`; inlined by every solver."""

    def register(implementation: Any) -> Any:
        overload(function, jit_options=INLINE)(implementation)
        overload(function, jit_options=INLINE_HERE, target="cpu")(implementation)
        return implementation

    return register


class _Part(CPUDispatcher):
    """A part of a kernel; Python can call it too, through a kernel that does nothing else."""

    def __call__(self, *arguments: Any) -> Any:
        return _by_itself(self)(*arguments)


@cache
def _by_itself(part: Any) -> Any:
    return njit(**_OPTIONS)(lambda *arguments: part(*arguments))


def compiled(function: Callable[..., Any], **options: Any) -> Any:
    """Compile a function that kernels call: no Python objects, no global lock, division as the processor does it.

    Nor reference counts, which cost an atomic operation whenever an array is passed on: a kernel allocates nothing,
    and its arrays belong to its caller.
    """
    part = njit(**options, **_PART, **_OPTIONS)(function)
    if type(part) is CPUDispatcher:  # under NUMBA_DISABLE_JIT it is the function itself
        part.__class__ = _Part
    return part


def called(function: Callable[..., Any]) -> Any:
    """Compile as :func:`compiled`, without inlining, for long and rarely needed functions.

    What is merely compiled is written into a caller that is inlined itself, since Numba's options pass on from there.
    """
    return compiled(function, forceinline=False)


def inlined(function: Callable[..., Any]) -> Any:
    """Compile as :func:`compiled`, always inlined."""
    return compiled(function, forceinline=True)


@cache
def kernel(function: Callable[..., Any], kinds: tuple[type, ...]) -> Any:
    """A kernel for some laws of contact and drives, kept on disk under the fingerprint of what it bakes in."""
    dispatcher = njit(**_OPTIONS)(function)
    mark = fingerprint(kinds)
    return dispatcher if mark is None else keep_code(dispatcher, mark)


class _CompilationMessage(event.Listener):
    """Says once that a kernel is being compiled."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.shown = False

    def on_start(self, event: Any) -> None:
        if not self.shown:
            self.shown = True
            _LOG.info("compiling %s, once on this machine: 10 to 20 s on a free core", self.name)

    def on_end(self, event: Any) -> None:
        """Do nothing."""


def is_compiled(march: Any, *arguments: Any) -> bool:
    """True if a kernel for such arguments is in memory or on the disk."""
    signature = tuple(typeof(value) for value in arguments)
    return signature in getattr(march, "overloads", ()) or _is_on_disk(march, signature)


def _is_on_disk(march: Any, signature: tuple[Any, ...]) -> bool:
    cache = getattr(march, "_cache", None)
    if not isinstance(cache, _KeptCode):
        return False
    try:
        return cache._index_key(signature, march.targetctx.codegen()) in cache._cache_file._load_index()
    except Exception as error:  # whatever became of the file
        _LOG.debug("the index of compiled code could not be read: %s", error)
        return False


def _turn(march: Any) -> AbstractContextManager[Any]:
    """Lock that the one process holds which compiles a kernel; nothing where the code is not kept.

    A process that waited loads what the other one has compiled.  After the time-out, or where the folder has no locks,
    it compiles for itself.
    """
    from filelock import FileLock

    cache = getattr(march, "_cache", None)
    if not isinstance(cache, _KeptCode):
        return nullcontext()
    lock = FileLock(f"{cache._cache_file._index_path}.lock", timeout=_LONGEST_WAIT)
    with suppress(OSError):
        try:
            return lock.acquire(timeout=0.0)
        except TimeoutError:
            _LOG.info("compiling %s in another process: waiting for it", march.py_func.__name__)
            return lock.acquire()
    return nullcontext()


def ready(march: Any, *arguments: Any) -> None:
    """Compile a kernel for such arguments, or fetch it from the disk, before anything is timed; says so in the log."""
    signature = tuple(typeof(value) for value in arguments)
    if signature in getattr(march, "overloads", ()):
        return
    collecting = gc.isenabled()
    gc.disable()  # a compiler's garbage has no cycles worth a tenth of the time
    try:
        with (
            nullcontext() if _is_on_disk(march, signature) else _turn(march),
            event.install_listener("numba:compile", _CompilationMessage(march.py_func.__name__)),
        ):
            march.compile(signature)
    finally:
        if collecting:
            gc.enable()

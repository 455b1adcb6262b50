"""The decorator that compiles numerical functions: numba's own, and a folder of machine code never stale.

Numba's cache sees an edit of the file that a function stands in, not of the functions, constants and named
tuples that it takes from other files. Its folder is therefore named by a digest of all these files.
"""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import sys
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from threading import Lock
from typing import Any, TypeVar, cast, overload

import llvmlite  # type: ignore[import-untyped]
import numba
import numpy as np
from llvmlite import binding as llvm

from coop_drake.compiling import COMPILING
from coop_drake.files import cache_folder

F = TypeVar("F", bound=Callable[..., object])

_PACKAGE = Path(__file__).parent
_KEPT = 3
"""Versions of a file whose machine code is kept: other branches and running processes may use older ones."""
_DECORATING = Lock()


@overload
def compiled(function: F) -> F: ...
@overload
def compiled(
    *, reassociate: bool = False, inlined: bool = False, borrows: bool = False
) -> Callable[[F], F]: ...
def compiled(
    function: F | None = None, *, reassociate: bool = False, inlined: bool = False, borrows: bool = False
) -> F | Callable[[F], F]:
    """Compile a function of numbers and arrays at its first call, and keep its machine code on disk.

    Compiled functions run without Python's global lock, and a division by zero gives infinity or NaN, as in
    numpy.

    Args:
        function: The function; only what numba can compile.
        reassociate: Whether sums may be added in any order, which is quicker and rounds differently; NaN and
            infinity keep their meaning.
        inlined: Whether its machine code becomes part of that of its callers: for small functions of large
            named tuples, whose arrays would take longer to hand over than to use.
        borrows: Whether all arrays that it uses belong to its caller, so that numba need not count references
            to them: for functions of large named tuples that are called often. They neither make arrays nor
            return any.

    Returns:
        The compiled function, or the decorator if only options are given.
    """
    flags = {"contract", "reassoc"} if reassociate else False
    options = {"nogil": True, "error_model": "numpy", "fastmath": flags, "no_cfunc_wrapper": True}
    options |= {"forceinline": inlined, "_nrt": not borrows}

    def decorate(function: F) -> F:
        if numba.config.DISABLE_JIT:
            return function
        folder = _folder(function.__module__, Path(function.__code__.co_filename))
        # Numba has no argument for the folder, but looks here while it decorates. The environment's variable
        # would be read only once, and would also send the user's own functions there.
        with _DECORATING:
            users, numba.config.CACHE_DIR = numba.config.CACHE_DIR, str(folder)
            try:
                dispatcher = numba.njit(cache=folder is not None, **options)(function)
            finally:
                numba.config.CACHE_DIR = users
        dispatcher.compile = _watched(dispatcher, borrows)
        COMPILING.functions += 1
        return cast(F, dispatcher)

    return decorate if function is None else decorate(function)


def _watched(dispatcher: Any, borrows: bool) -> Callable[[Any], object]:
    """Return what numba shall call to load or compile a function for some types of arguments."""
    compiling = dispatcher.compile

    def load_or_compile(kinds: Any) -> object:
        if not isinstance(kinds, tuple):
            return compiling(kinds)
        # Numba would compile a function anew for each constant with which another one calls it.
        kinds = tuple(map(numba.types.unliteral, kinds))
        overloads, compiled_here = dispatcher.overloads, dispatcher.stats.cache_misses
        with COMPILING.spent():
            try:
                compiling(kinds)
            except Exception:
                # It is no fault of the function if its machine code could not be read, or not be written.
                if kinds in compiled_here and kinds not in overloads:
                    raise
            if kinds not in overloads:
                # A file is damaged. Or two processes wrote at once, and the index of one names the machine
                # code of the other, which is for other types; numba does not look.
                for path in Path(dispatcher.stats.cache_path).glob(f"*.{dispatcher.__qualname__}-*"):
                    path.unlink(missing_ok=True)
            code: object = compiling(kinds)
            if borrows and "array" in str(overloads[kinds].signature.return_type):
                raise TypeError(f"{dispatcher.__qualname__} returns an array, which it may only borrow")
            if kinds in compiled_here:
                COMPILING.announce(dispatcher.__name__)
            return code

    return load_or_compile


@cache
def _folder(module: str, file: Path) -> Path | None:
    """Return the folder for the machine code of a module's functions; None where none can be written.

    It is in the folder that the user names to numba, otherwise beside this file or in the user's cache.
    """
    if not file.is_file():
        return None
    users = numba.config.CACHE_DIR
    for place in [Path(users)] if users else [_PACKAGE / "__pycache__", cache_folder("")]:
        folder = place / "kernels" / module / _digest(module, file)
        with suppress(OSError):
            if not folder.exists():
                folder.mkdir(parents=True)
                versions = sorted(folder.parent.iterdir(), key=lambda version: version.stat().st_mtime)
                for version in versions[:-_KEPT]:
                    shutil.rmtree(version, ignore_errors=True)
            if os.access(folder, os.W_OK):
                return folder
    return None


def _digest(module: str, file: Path) -> str:
    """Return a digest of all that the machine code of a module's functions depends on.

    That is its file, the files of its package and of this one that it imports, directly or not, and what
    compiles. Of a package that it imports names from every file counts.
    """
    root, package = str(file.parents[module.count(".")]), module.partition(".")[0]
    found, new = set[str](), {str(file), __file__}
    while new:
        found |= new
        new = {path for one in new for path in _read(one, root, package)[1]} - found
    parts = [sys.version, numba.__version__, llvmlite.__version__, np.__version__, compiler_settings()]
    parts += [_read(path, root, package)[0] for path in sorted(found)]
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:16]


@cache
def compiler_settings() -> str:
    """Return what the last bits of compiled sums depend on: the processor, and numba's settings."""
    others = {"NUMBA_CACHE_DIR", "NUMBA_NUM_THREADS"}  # No function runs on numba's threads.
    settings = {key: own for key, own in os.environ.items() if key.startswith("NUMBA_") and key not in others}
    features = llvm.get_host_cpu_features().flatten()
    return repr((llvm.get_host_cpu_name(), features, sorted(settings.items())))


@cache
def _read(file: str, root: str, package: str) -> tuple[str, list[str]]:
    """Return a digest of a file, and the files that it imports of a package in ``root`` and of this one."""
    text = Path(file).read_bytes()
    names = {name.decode() for name in re.findall(rb"^ *(?:from|import) ([\w.]+)", text, re.MULTILINE)}
    places = {package: root, _PACKAGE.name: str(_PACKAGE.parent)}
    imported: list[str] = []
    for name in names:
        if (place := places.get(name.partition(".")[0])) is not None:
            path = os.path.join(place, *name.split("."))  # noqa: PTH118 - a third of the time of a Path
            if os.path.isfile(f"{path}.py"):  # noqa: PTH113
                imported.append(f"{path}.py")
            else:
                imported += map(str, Path(path).glob("*.py"))
    return hashlib.sha256(text).hexdigest(), imported

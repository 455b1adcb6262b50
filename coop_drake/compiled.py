"""The one decorator that compiles a numerical function, and the cache of machine code that is never stale."""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import Any, TypeVar, cast, overload

import numba
import numpy as np
from numba import types
from numba.core.caching import FunctionCache, IndexDataCacheFile
from numba.core.registry import CPUDispatcher

F = TypeVar("F", bound=Callable[..., object])

_REASSOCIATED = {"contract", "reassoc"}
"""LLVM's flags for sums in any order: vector units are used; NaN and infinity keep their meaning."""


@overload
def compiled(function: F) -> F: ...
@overload
def compiled(*, reassociate: bool) -> Callable[[F], F]: ...
def compiled(function: F | None = None, *, reassociate: bool = False) -> F | Callable[[F], F]:
    """Compile a function of numbers and arrays at its first call, and keep its machine code on disk.

    Compiled functions run without Python's global lock, and a division by zero gives infinity or NaN, as in
    numpy. The machine code on disk is used again only while ``kernel_stamp`` is the same.

    Args:
        function: The function; only what numba can compile.
        reassociate: Whether sums may be added in any order, which is quicker and rounds differently.

    Returns:
        The compiled function, or the decorator if only options are given.
    """

    def decorate(function: F) -> F:
        flags = _REASSOCIATED if reassociate else False
        options = {"nogil": True, "error_model": "numpy", "fastmath": flags, "no_cfunc_wrapper": True}
        dispatcher = numba.njit(**options)(function)
        if not isinstance(dispatcher, CPUDispatcher):  # NUMBA_DISABLE_JIT is set: nothing is compiled
            return function
        dispatcher._cache = _KernelCache(function, "called from Python")
        # Most functions are called from compiled ones only. Then the wrapper that unpacks Python's arguments,
        # a sixth of the time to compile, is left out.
        inner = numba.njit(no_cpython_wrapper=True, **options)(function)
        inner._cache = _KernelCache(function, "called from compiled functions")
        dispatcher.get_call_template = _by_type_alone(inner.get_call_template)
        dispatcher.get_overload = inner.get_overload
        return cast(F, dispatcher)

    return decorate if function is None else decorate(function)


def _by_type_alone(get_call_template: Callable[..., object]) -> Callable[..., object]:
    """Let calls from compiled code share one version of a function, whatever constants they pass.

    Otherwise numba compiles a function anew for every constant: ``f(x, 1)`` and ``f(x, 2)`` would be two.
    """

    def get(args: Sequence[types.Type], kws: Mapping[str, types.Type]) -> object:
        typed = {name: types.unliteral(value) for name, value in kws.items()}
        return get_call_template(tuple(types.unliteral(value) for value in args), typed)

    return get


def kernel_stamp(function: FunctionType) -> str:
    """Return a digest of all that a function's machine code depends on.

    Numba's own cache looks at the file that holds the function. The machine code also depends on what other
    files define: the compiled functions that it calls, the constants that it reads, and the fields of the
    named tuples that it takes. The stamp therefore holds the stamps, values and definitions of all of these
    that the function's module has imported, by name or as attributes of imported modules.

    Args:
        function: The function before it is compiled; its module's imports have been executed.
    """
    attributes = _names_in(function.__code__)
    parts = [_file_digest(function.__code__.co_filename)]
    for name, value in sorted(function.__globals__.items()):
        if isinstance(value, ModuleType):
            found = {f"{name}.{attribute}": getattr(value, attribute, None) for attribute in attributes}
        else:
            found = {} if name.startswith("__") else {name: value}
        for path, part in sorted(found.items()):
            if (description := _description(part, function.__module__)) is not None:
                parts.append(f"{path}={description}")
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()


def _names_in(code: CodeType) -> list[str]:
    """Return the names of globals and attributes that a function uses, those of nested functions included."""
    nested = (constant for constant in code.co_consts if isinstance(constant, CodeType))
    return sorted({*code.co_names, *(name for part in nested for name in _names_in(part))})


def _description(value: object, module: str) -> str | None:
    """Return what a global adds to the stamp of a module's function; None if machine code cannot hold it."""
    if isinstance(value, CPUDispatcher):
        return None if value.py_func.__module__ == module else str(value._cache.stamp)
    if isinstance(value, type) and issubclass(value, tuple) and hasattr(value, "_fields"):
        defined_in = getattr(sys.modules.get(value.__module__), "__file__", None)
        return f"{value._fields} {_file_digest(defined_in) if defined_in else value.__module__}"
    if isinstance(value, tuple):
        return f"({', '.join(str(_description(item, module)) for item in value)})"
    if isinstance(value, np.ndarray):
        return f"{value.dtype} {value.shape} {hashlib.sha256(value.tobytes()).hexdigest()}"
    return repr(value) if isinstance(value, (bool, int, float, complex, str, np.generic)) else None


@cache
def _file_digest(path: str) -> str:
    return hashlib.sha256(Path(path).read_bytes()).hexdigest()


class _Index(IndexDataCacheFile):  # type: ignore[misc]
    """Numba's index of the machine code of one function, empty where an older version of the code wrote it.

    An index holds the types of arguments. Numba reads them before it compares stamps, which fails if one was
    a class that is no longer there.
    """

    def _load_index(self) -> dict[object, str]:
        try:
            return cast(dict[object, str], super()._load_index())
        except (ImportError, AttributeError):
            return {}


class _KernelCache(FunctionCache):  # type: ignore[misc]
    """Numba's cache on disk with ``kernel_stamp`` in place of the digest of one file.

    Args:
        function: The function.
        use: From where it is called; the machine code of each use is kept apart.
    """

    def __init__(self, function: Any, use: str) -> None:
        super().__init__(function)
        self.stamp, self._use = kernel_stamp(function), use
        self._cache_file = _Index(
            cache_path=self._cache_path, filename_base=self._impl.filename_base, source_stamp=self.stamp
        )

    def _index_key(self, sig: Any, codegen: Any) -> tuple[object, ...]:
        return (*super()._index_key(sig, codegen), self._use)

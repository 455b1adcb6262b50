"""The one decorator that compiles a numerical function, and the cache of machine code that is never stale."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path
from types import FunctionType
from typing import Any, TypeVar, cast, overload

import numba
from numba import types
from numba.core.caching import FunctionCache, IndexDataCacheFile
from numba.core.registry import CPUDispatcher

__all__ = ["compiled", "kernel_stamp"]

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

    Numba's own cache looks at the file that holds the function. A function compiled from another file, or a
    constant imported from one, is part of the machine code too, so the stamp also holds the stamps of all
    compiled functions and the values of all numbers that the function's module has imported.

    Args:
        function: The function before it is compiled; its module's imports have been executed.
    """
    parts = [_file_digest(function.__code__.co_filename)]
    for name, value in sorted(function.__globals__.items()):
        if isinstance(value, CPUDispatcher):
            if value.py_func.__module__ != function.__module__:
                parts.append(f"{name}={value._cache.stamp}")
        elif isinstance(value, (bool, int, float, tuple)):
            parts.append(f"{name}={value!r}")
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()


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

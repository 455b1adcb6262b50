"""The one decorator that compiles a numerical function, and the cache of machine code that is never stale."""

from __future__ import annotations

import hashlib
import inspect
import os
import sys
from collections.abc import Callable, Mapping, Sequence
from functools import cache, cached_property, partial, update_wrapper
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import TYPE_CHECKING, Any, TypeVar, cast, overload

import numpy as np

from coop_drake.files import cache_folder
from coop_drake.kernel_kinds import kind_of, layout_of, words_of
from coop_drake.kernel_times import KERNEL_TIMES

if TYPE_CHECKING:
    from coop_drake.kernel_compiler import NumbaFunction

F = TypeVar("F", bound=Callable[..., object])
R = TypeVar("R")

_REASSOCIATED = {"contract", "reassoc"}
"""LLVM's flags for sums in any order: vector units are used; NaN and infinity keep their meaning."""


MAKERS = "compiled", "kernel_compiler", "kernel_kinds", "machine_code"
"""Files of this package on whose text all machine code depends."""


@overload
def compiled(function: F) -> F: ...
@overload
def compiled(
    *, reassociate: bool = False, inlined: bool = False, whole_program: bool = False
) -> Callable[[F], F]: ...
def compiled(
    function: F | None = None,
    *,
    reassociate: bool = False,
    inlined: bool = False,
    whole_program: bool = False,
) -> F | Callable[[F], F]:
    """Compile a function of numbers and arrays at its first call, and keep its machine code on disk.

    Compiled functions run without Python's global lock, and a division by zero gives infinity or NaN, as in
    numpy. The machine code on disk is used again only while ``kernel_stamp`` is the same.

    Args:
        function: The function; only what numba can compile.
        reassociate: Whether sums may be added in any order, which is quicker and rounds differently.
        inlined: Whether its machine code becomes part of that of its callers: for small functions of large
            named tuples, whose arrays would take longer to hand over than to use.
        whole_program: Whether it is optimised together with copies of all that it calls, when Python calls
            it: for long loops.

    Returns:
        The compiled function, or the decorator if only options are given.
    """
    flags = _REASSOCIATED if reassociate else False
    options = {"nogil": True, "error_model": "numpy", "fastmath": flags, "no_cfunc_wrapper": True}
    options |= {"forceinline": inlined, "whole_program": whole_program}

    def decorate(function: F) -> F:
        if os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0"):  # Nothing is compiled.
            return function
        return cast(F, Kernel(cast(FunctionType, function), options))

    return decorate if function is None else decorate(function)


def prepared(function: Callable[..., R], given: Sequence[object], *like: object) -> Callable[..., R]:
    """Return a compiled function with its first arguments given, for further ones whose types never change.

    Only the first call looks at types. In the functions that a simulation calls most, that would take longer
    than what they compute.

    Args:
        function: The compiled function.
        given: Its first arguments.
        like: For each further argument an example of its type: of numbers, or of an array with this type of
            numbers, this number of dimensions and this order in memory.

    Returns:
        The function; its first call raises a TypeError where the arguments are not of the types stated.
        Machine code would read memory that is not theirs.
    """
    if not isinstance(function, Kernel):
        return partial(function, *given)
    name, expected = function._function.__qualname__, tuple(map(layout_of, like))
    version: Callable[..., R] = function.version((*given, *like))
    prepared_function: partial[R] = partial(function)

    def first(*arguments: object) -> R:
        if (kinds := tuple(map(layout_of, arguments))) != expected:
            raise TypeError(f"{name} was prepared for {expected}; it is called with {kinds}")
        prepared_function.__setstate__((version, tuple(given), {}, {}))  # type: ignore[attr-defined]
        return version(*given, *arguments)

    prepared_function.__setstate__((first, (), {}, {}))  # type: ignore[attr-defined]
    return prepared_function


class Kernel:
    """A compiled function: one version for each list of types that it is called with.

    Numba is imported only where a version has to be compiled.

    Args:
        function: The function.
        options: Numba's options.

    Attributes:
        loaded: How many versions were read from disk.
    """

    def __init__(self, function: FunctionType, options: Mapping[str, object]) -> None:
        update_wrapper(self, function)
        self.loaded = 0
        KERNEL_TIMES.functions += 1
        self._function, self._options = function, options
        self._count = function.__code__.co_argcount
        self._versions: dict[tuple[object, ...], Callable[..., Any]] = {}

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        """Call the version for the types of the arguments."""
        if named or len(arguments) != self._count:
            bound = inspect.signature(self._function).bind(*arguments, **named)
            bound.apply_defaults()
            arguments = bound.args
        return self.version(arguments)(*arguments)

    def version(self, arguments: tuple[Any, ...]) -> Callable[..., Any]:
        """Return the version for the types of all arguments in order; it is loaded or compiled at first."""
        kinds = tuple(map(kind_of, arguments))
        return self._versions.get(kinds) or self._new_version(arguments, kinds)

    def __reduce__(self) -> str:
        """Pickle by name, as a function is."""
        return self._function.__qualname__

    @property
    def _numba_type_(self) -> object:
        """What numba takes this for in the functions that call it."""
        return self._numba.type

    @cached_property
    def _numba(self) -> NumbaFunction:
        from coop_drake.kernel_compiler import NumbaFunction

        return NumbaFunction(self._function, self._options, self.stamp)

    @cached_property
    def stamp(self) -> str:
        """Digest of all that the machine code depends on."""
        return kernel_stamp(self._function, self._options)

    def _new_version(self, arguments: tuple[Any, ...], kinds: tuple[object, ...]) -> Callable[..., Any]:
        words = [words_of(kind) for kind in kinds]
        if None in words:  # Numba knows more types; none of them is kept here.
            return lambda *arguments: self._numba.call(arguments)
        with KERNEL_TIMES.spent():
            if kinds not in self._versions:
                self._versions[kinds] = self._loaded_or_compiled(arguments, " ".join(map(str, words)))
        return self._versions[kinds]

    def _loaded_or_compiled(self, arguments: tuple[Any, ...], words: str) -> Callable[..., Any]:
        from coop_drake.machine_code import load_machine_code, platform_stamp, write_machine_code

        function = self._function
        stamp = _digest(self.stamp, platform_stamp())
        ending = _digest(words)[:16]
        source = Path(function.__code__.co_filename)
        name = f"{source.stem}.{function.__qualname__}.{sys.implementation.cache_tag}.{ending}.kernel"
        path = _folder(source.parent) / name
        version = load_machine_code(path, stamp, function.__name__)
        if version is not None:
            self.loaded += 1
            return version
        version, kept = self._numba.entry(arguments, KERNEL_TIMES.announce)
        if kept is not None:
            write_machine_code(path, stamp, kept)
        return version


def _folder(beside: Path) -> Path:
    """Where the machine code of the functions in a folder is kept: where numba keeps its own."""
    place = f"{beside.name}_{hashlib.sha256(str(beside).encode()).hexdigest()}"
    if named := os.environ.get("NUMBA_CACHE_DIR"):
        return Path(named) / place
    return beside / "__pycache__" if os.access(beside, os.W_OK) else cache_folder("kernels") / place


def kernel_stamp(function: FunctionType, options: Mapping[str, object]) -> str:
    """Return a digest of all that a function's machine code depends on, as this process holds it in memory.

    Numba's own cache looks at the file that holds the function. The machine code also depends on what other
    files define: the compiled functions that it calls, the constants that it reads, and the fields of the
    named tuples that it takes. And a file may be edited after Python has read it; machine code of the old
    text would then be kept as that of the new one. The stamp therefore holds no digest of a file, but the
    function's bytecode, and the stamps, values and definitions of all globals that it uses; only the files
    that compile are taken as files.

    Args:
        function: The function before it is compiled.
        options: The options that it is compiled with.
    """
    names = _names_in(function.__code__)
    ways = [f"{name}: {sorted(way) if isinstance(way, set) else way}" for name, way in options.items()]
    parts = [_makers(), _words_of_code(function.__code__), repr(function.__defaults__), *ways]
    for name in names:
        value = function.__globals__.get(name)
        if isinstance(value, ModuleType):
            found = {f"{name}.{attribute}": getattr(value, attribute, None) for attribute in names}
        else:
            found = {name: value}
        for path, part in found.items():
            calls_itself = isinstance(part, Kernel) and part._function is function
            if not calls_itself and (description := _description(part)) is not None:
                parts.append(f"{path}={description}")
    return _digest(*parts)


@cache
def _makers() -> str:
    """Return a digest of what decides how machine code is made and kept: files, and numpy's version."""
    files = [Path(__file__).with_name(f"{name}.py").read_bytes() for name in MAKERS]
    return hashlib.sha256(b"".join([np.__version__.encode(), *files])).hexdigest()


def _digest(*parts: str) -> str:
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()


def _names_in(code: CodeType) -> list[str]:
    """Return the names of globals and attributes that a function uses, those of nested functions included."""
    nested = (constant for constant in code.co_consts if isinstance(constant, CodeType))
    return sorted({*code.co_names, *(name for part in nested for name in _names_in(part))})


def _words_of_code(code: CodeType) -> str:
    """Return what a function does, in words that are the same in every process; not the place of its text."""
    constants = [
        _words_of_code(constant)
        if isinstance(constant, CodeType)
        else str(sorted(map(repr, constant)) if isinstance(constant, frozenset) else repr(constant))
        for constant in code.co_consts
    ]
    arguments = code.co_argcount, code.co_posonlyargcount, code.co_kwonlyargcount, code.co_flags
    names = code.co_names, code.co_varnames, code.co_freevars, code.co_cellvars
    return repr((code.co_code, code.co_exceptiontable, arguments, names, constants))


def _description(value: object) -> str | None:
    """Return what a global adds to the stamp of a function; None if machine code cannot hold it."""
    if isinstance(value, Kernel):
        return value.stamp
    if isinstance(value, type) and issubclass(value, tuple) and hasattr(value, "_fields"):
        return f"{value.__module__}.{value.__qualname__} {value._fields}"
    if isinstance(value, tuple):
        return f"({', '.join(str(_description(item)) for item in value)})"
    if isinstance(value, np.ndarray):
        return f"{value.dtype} {value.shape} {hashlib.sha256(value.tobytes()).hexdigest()}"
    if isinstance(value, (bool, int, float, complex, str, np.generic)):
        return repr(value)
    # Of what numba itself compiles, such as hypot of math or of numpy, the place is enough.
    name = getattr(value, "__name__", None) if callable(value) else None
    return None if name is None else f"{type(value).__name__} {getattr(value, '__module__', '')}.{name}"

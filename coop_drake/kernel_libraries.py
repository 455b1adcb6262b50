"""How the machine code of a kernel is put together: all functions that it calls are optimised once, as one.

Numba optimises every function with all that it calls, and makes machine code of that, so that a function in
the tenth place of a chain of calls is optimised ten times. Here, a function that only compiled functions call
is kept as LLVM's intermediate code. It is optimised as a part of the kernels that Python calls, in which it
is visible to nobody else: LLVM can put it in the place of its only call, whatever its size, and leave out
arguments that are not used.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from hashlib import sha256
from typing import Any

from llvmlite import binding as llvm  # type: ignore[import-untyped]
from numba.core import itanium_mangler
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler_lock import global_compiler_lock
from numba.core.registry import cpu_target


class PartLibrary(JITCodeLibrary):  # type: ignore[misc]
    """Intermediate code of a function that compiled functions call; it is neither optimised nor loaded."""

    _finalized: bool

    @property
    def codegen(self) -> PartLibrary:
        """What numba asks to set the environment of a function that is loaded."""
        return self

    def set_env(self, name: str, environment: object) -> None:
        """Do nothing: kernels that contain the function set its environment."""

    def get_pointer_to_function(self, name: str) -> int:
        """Return 0: there is no machine code."""
        self._ensure_finalized()
        return 0

    def serialize_using_object_code(self) -> tuple[str, str, bytes]:
        """Return what numba's cache keeps: intermediate code."""
        kept: tuple[str, str, bytes] = self.serialize_using_bitcode()
        return kept

    @classmethod
    def _unserialize(cls, codegen: Any, state: tuple[str, str, Any]) -> JITCodeLibrary:
        if state[1] == "bitcode":
            return super()._unserialize(codegen, state)
        codegen._library_class = WholeLibrary  # It is a kernel that Python calls.
        try:
            return WholeLibrary._unserialize(codegen, state)
        finally:
            codegen._library_class = cls

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True


class WholeLibrary(JITCodeLibrary):  # type: ignore[misc]
    """Machine code of a kernel that Python calls, with all that it calls."""

    _final_module: Any

    def _optimize_final_module(self) -> None:
        for function in self._final_module.functions:
            if function.linkage == llvm.Linkage.linkonce_odr and not function.is_declaration:
                function.linkage = "internal"
        super()._optimize_final_module()


@contextmanager
def parts() -> Iterator[None]:
    """Let numba make a ``PartLibrary`` of all that is compiled or read for compiled functions meanwhile."""
    context = cpu_target.target_context
    maker = context.codegen()
    with global_compiler_lock:
        maker._library_class, context.mangler = PartLibrary, _short_name
        try:
            yield
        finally:
            del maker._library_class, context.mangler


def whole_library(maker: Any, name: str) -> WholeLibrary:
    """Return an empty library for a kernel, whose machine code numba's cache may keep."""
    library = WholeLibrary(maker, name)
    library.enable_object_caching()
    return library


def _short_name(name: str, kinds: Sequence[Any], *, abi_tags: Sequence[str] = (), uid: Any = None) -> str:
    """Return a function's name in machine code, with a digest in place of its arguments' types.

    The types of some named tuples of arrays take thousands of characters, in every call.
    """
    digest = sha256(itanium_mangler.mangle_args(kinds).encode()).hexdigest()[:16]
    mangled: str = itanium_mangler.mangle(name, (), abi_tags=(*abi_tags, digest), uid=uid)
    return mangled

"""Compiling by numba, and numba's own cache of machine code with a stamp that is never stale."""

from __future__ import annotations

import pickle
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from hashlib import sha256
from pathlib import Path
from typing import Any

import numba
from llvmlite import binding as llvm  # type: ignore[import-untyped]
from numba import types
from numba.core import event, ir
from numba.core.caching import CompileResultCacheImpl, FunctionCache, IndexDataCacheFile
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import register_pass
from numba.core.lowering import Lower
from numba.core.typed_passes import NativeLowering

_VIEWS = "getattr", "getitem", "static_getitem"
"""Operations of numba's intermediate code that give a part or a view of an array or a tuple."""


class NumbaFunction:
    """A function as numba knows it: one version for Python, one for compiled functions.

    Most functions are called from compiled ones only. Then the wrapper that unpacks Python's arguments, a
    sixth of the time to compile, is left out.

    Args:
        function: The function.
        options: Numba's options, and ``whole_program`` as in ``compiled``.
        stamp: Digest of all that its machine code depends on.

    Attributes:
        type: The type by which compiled functions call it.
    """

    def __init__(self, function: Callable[..., object], options: Mapping[str, object], stamp: str) -> None:
        options = dict(options)
        outer_compiler = _WholeProgramCompiler if options.pop("whole_program") else _Compiler
        self._outer = numba.njit(pipeline_class=outer_compiler, **options)(function)
        self._outer._cache = _KernelCache(function, stamp, "called from Python")
        self._inner = numba.njit(pipeline_class=_Compiler, no_cpython_wrapper=True, **options)(function)
        self._inner._cache = _KernelCache(function, stamp, "called from compiled functions")
        self._inner.get_call_template = _by_type_alone(self._inner.get_call_template)
        self.type = types.Dispatcher(self._inner)

    def call(self, arguments: Sequence[object]) -> object:
        """Call it with arguments of any types that numba knows."""
        return self._outer(*arguments)

    def entry(
        self, arguments: Sequence[object], compiling: Callable[[str], None]
    ) -> tuple[Callable[..., Any], Sequence[Any] | None]:
        """Compile it for the types of some arguments, or load what numba has kept of that.

        Args:
            arguments: Any arguments of these types.
            compiling: Called with the name of each function before it is compiled.

        Returns:
            The function for just these types; and what numba keeps of it, None if it keeps nothing.
        """
        signature = tuple(map(self._outer.typeof_pyval, arguments))
        with event.install_listener("numba:compile", _Announcer(compiling)):
            self._outer.compile(signature)
        return self._outer.overloads[signature].entry_point, self._outer._cache.kept


class _Compiler(CompilerBase):  # type: ignore[misc]
    """Numba's compiler, with `_Lower` in place of numba's own way to LLVM's intermediate code."""

    def define_pipelines(self) -> list[Any]:
        steps = DefaultPassBuilder.define_nopython_pipeline(self.state)
        steps.passes = [
            (_Lowering if step is NativeLowering else step, purpose) for step, purpose in steps.passes
        ]
        steps.finalize()
        return [steps]


class _WholeProgramCompiler(_Compiler):
    """Compiles a function into a ``_WholeProgram``."""

    def define_pipelines(self) -> list[Any]:
        library = _WholeProgram(self.state.targetctx.codegen(), self.state.func_id.func_qualname)
        library.enable_object_caching()
        self.state.library = library
        return super().define_pipelines()


class _WholeProgram(JITCodeLibrary):  # type: ignore[misc]
    """Machine code of a function with its own copies of all that it calls.

    Nobody else sees these copies. LLVM therefore puts a function that is called once in the place of its
    call, whatever its size, and changes how the others are called.
    """

    _final_module: Any

    def _optimize_final_module(self) -> None:
        for function in self._final_module.functions:
            if function.linkage == llvm.Linkage.linkonce_odr and not function.is_declaration:
                function.linkage = "internal"
        super()._optimize_final_module()
        self._name_copies()

    def _name_copies(self) -> None:
        """Give the copies names of their own.

        The loader of machine code finds functions of the whole process by name, internal ones, too. Under
        their old names, functions compiled later would call these copies as if they were the originals.
        """
        defined = [function for function in self._final_module.functions if not function.is_declaration]
        own = sorted(function.name for function in defined if function.linkage == llvm.Linkage.external)
        program = sha256("\n".join(own).encode()).hexdigest()
        for function in defined:
            if function.linkage == llvm.Linkage.internal:
                function.name = f"{function.name}.of.{program}"


class _Lower(Lower):  # type: ignore[misc]
    """Leaves out the counting of references to arrays that the caller holds until the function returns.

    Numba counts each array of each named tuple when a function begins and when it ends, which takes longer
    than what a small function computes.
    """

    context: Any

    def pre_lower(self) -> None:
        super().pre_lower()
        self._held = _held_by_caller(self.func_ir, self.fndesc.typemap)
        self._uncounted = self.context.subtarget(enable_nrt=False)
        vars(self._uncounted).pop("nrt", None)  # The copy must not have that of the original.

    def lower_inst(self, inst: Any) -> None:
        name = inst.target.name if isinstance(inst, ir.Assign) else getattr(inst, "value", None)
        counted: Any = self.context
        if isinstance(inst, ir.Assign | ir.Del) and name in self._held:
            self.context = self._uncounted
        try:
            super().lower_inst(inst)
        finally:
            self.context = counted


@register_pass(mutates_CFG=True, analysis_only=False)
class _Lowering(NativeLowering):  # type: ignore[misc]
    _name = "lowering_without_counts_of_arguments"
    lowering_class = _Lower


def _held_by_caller(function: Any, kinds: Mapping[str, types.Type]) -> set[str]:
    """Names of variables that are assigned once: arguments, constants, parts, views and tuples of these."""
    blocks = [block for _, block in sorted(function.blocks.items())]
    assigned = [statement for block in blocks for statement in block.find_insts(ir.Assign)]
    times = Counter(statement.target.name for statement in assigned)
    held: set[str] = set()
    for statement in assigned:
        value = statement.value
        if isinstance(value, ir.Expr) and value.op == "build_tuple":
            of_caller = all(item.name in held or _is_number(kinds[item.name]) for item in value.items)
        elif isinstance(value, ir.Expr) and value.op == "exhaust_iter":  # What is to be unpacked.
            of_caller = value.value.name in held and isinstance(kinds[value.value.name], types.BaseTuple)
        elif isinstance(value, ir.Expr):
            of_caller = value.op in _VIEWS and value.value.name in held and _is_view(value, kinds)
        elif isinstance(value, ir.Var):
            of_caller = value.name in held
        else:
            of_caller = isinstance(value, ir.Arg | ir.Global | ir.FreeVar | ir.Const)
        if of_caller and times[statement.target.name] == 1:
            held.add(statement.target.name)
    return held


def _is_number(kind: types.Type) -> bool:
    return isinstance(kind, types.Number | types.Boolean)


def _is_view(taken: Any, kinds: Mapping[str, types.Type]) -> bool:
    """Whether an operation of ``_VIEWS`` makes no new array, as an index that is an array would."""
    if not isinstance(kinds[taken.value.name], types.Array | types.BaseTuple):
        return bool(taken.op == "getattr")
    index = kinds[taken.index.name] if taken.op == "getitem" else types.intp
    parts = index.types if isinstance(index, types.BaseTuple) else (index,)
    return all(isinstance(part, types.Integer | types.SliceType | types.EllipsisType) for part in parts)


class _Announcer(event.Listener):  # type: ignore[misc]
    """Names each function that is compiled."""

    def __init__(self, compiling: Callable[[str], None]) -> None:
        self._compiling = compiling

    def on_start(self, event: Any) -> None:
        self._compiling(event.data["dispatcher"].py_func.__name__)

    def on_end(self, event: Any) -> None:
        pass


def _by_type_alone(get_call_template: Callable[..., object]) -> Callable[..., object]:
    """Let calls from compiled code share one version of a function, whatever constants they pass.

    Otherwise numba compiles a function anew for every constant: ``f(x, 1)`` and ``f(x, 2)`` would be two.
    """

    def get(args: Sequence[types.Type], kws: Mapping[str, types.Type]) -> object:
        typed = {name: types.unliteral(value) for name, value in kws.items()}
        return get_call_template(tuple(types.unliteral(value) for value in args), typed)

    return get


class _Files(IndexDataCacheFile):  # type: ignore[misc]
    """A file for each list of argument types, with the stamp beside the machine code.

    Numba's own class writes an index before the machine code that it names, and overwrites older machine
    code. Another process that reads in between takes the machine code of an older text, or for other types,
    for that which it needs, and may end by a segmentation fault.
    """

    def save(self, key: object, data: object) -> None:
        self._save_data(self._name(key), (self._source_stamp, self._dump((key, data))))

    def load(self, key: object) -> object:
        try:
            stamp, kept = self._load_data(self._name(key))
        except (OSError, ValueError, TypeError, EOFError, pickle.UnpicklingError):
            return None
        # What was written under another stamp may name classes that are no longer there.
        found, data = pickle.loads(kept) if stamp == self._source_stamp else (None, None)
        return data if found == key else None

    def _name(self, key: object) -> str:
        return f"{Path(self._index_name).stem}.{sha256(repr(key).encode()).hexdigest()[:16]}.nbc"


class _KernelCache(FunctionCache):  # type: ignore[misc]
    """Numba's cache on disk with a stamp of ours in place of the digest of one file.

    Args:
        function: The function.
        stamp: Digest of all that its machine code depends on.
        use: From where it is called; the machine code of each use is kept apart.

    Attributes:
        kept: What was read or written last.
    """

    def __init__(self, function: Any, stamp: str, use: str) -> None:
        cache = self

        class Implementation(CompileResultCacheImpl):  # type: ignore[misc]
            """Takes note of what numba keeps of a function."""

            def reduce(self, result: Any) -> Any:
                cache.kept = super().reduce(result)
                return cache.kept

            def rebuild(self, context: Any, kept: Any) -> Any:
                cache.kept = kept
                return super().rebuild(context, kept)

        self._impl_class = Implementation
        super().__init__(function)
        self._use = use
        self.kept: Any = None
        self._cache_file = _Files(
            cache_path=self._cache_path, filename_base=self._impl.filename_base, source_stamp=stamp
        )

    def _index_key(self, sig: Any, codegen: Any) -> tuple[object, ...]:
        return (*super()._index_key(sig, codegen), self._use, tuple(map(_fields, sig)))


def _fields(kind: types.Type) -> tuple[object, ...]:
    """Return the names in a type's named tuples; numba takes types of different names for the same."""
    own = kind.instance_class._fields if isinstance(kind, types.BaseNamedTuple) else ()
    return (own, *map(_fields, kind.types)) if isinstance(kind, types.BaseTuple) else ()

"""Machine code of compiled functions as files, loaded without numba.

Numba compiles the functions and writes machine code that needs nothing of numba but three small libraries in
C. To import numba itself and to prepare its registries takes half a second of every command, to load machine
code with LLVM alone a few milliseconds. Where a library is not as expected, nothing is loaded here, and numba
loads its own copy of the machine code.
"""

from __future__ import annotations

import builtins
import ctypes
import os
import pickle
import re
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import cache
from importlib.machinery import EXTENSION_SUFFIXES
from importlib.util import find_spec, module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

from llvmlite import binding as llvm  # type: ignore[import-untyped]

from coop_drake.files import write_atomically

_LIBRARIES = ("_helperlib", "_dynfunc", "core.runtime._nrt_python")
"""Numba's libraries in C that machine code calls: conversions, functions as Python objects, arrays."""

_MATHEMATICS = {"acos", "acosh", "asin", "asinh", "atan", "atan2", "atanh", "ceil", "cos", "cosh", "exp"}
_MATHEMATICS |= {"expm1", "fabs", "floor", "fmod", "log", "log10", "log1p", "pow", "round", "sin", "sinh"}
_MATHEMATICS |= {"sqrt", "tan", "tanh", "trunc"}
"""Functions that machine code calls by their names in C; numba binds them to those of its first library."""

_TESTED = (0, 61), (0, 68)
"""Oldest and newest minor version of numba whose machine code this file was tested with. That of other
versions is loaded by numba: its layout in memory is no promise of numba's."""

_DAMAGE = (OSError, ImportError, AttributeError, TypeError, ValueError, LookupError, EOFError, RuntimeError)
"""What a file that is damaged, or of other versions, can raise."""


class MachineCode(NamedTuple):
    """Machine code of one function for one list of argument types.

    Attributes:
        stamp: Digest of all that it depends on.
        entry: Name of the function that unpacks Python's arguments.
        constants: For each variable that holds Python objects its name, and the objects; the first one is
            that of the function itself.
        code: An object file.
    """

    stamp: str
    entry: str
    constants: list[tuple[str, list[object]]]
    code: bytes


@cache
def platform_stamp() -> str:
    """Say for what machine code is compiled: versions, processor, and what numba's settings change."""
    version = _version_of_numba()
    status = version.stat()
    package = str(version), status.st_size, status.st_mtime_ns
    return repr((sys.version, llvm.llvm_version_info, *package, processor_stamp()))


@cache
def processor_stamp() -> str:
    """Say what the last bits of compiled sums depend on: the processor, and numba's settings."""
    settings = {k: v for k, v in os.environ.items() if k.startswith("NUMBA_") and k != "NUMBA_CACHE_DIR"}
    return repr((*_processor(), sorted(settings.items())))


@cache
def _processor() -> tuple[str, str]:
    """LLVM's name of the processor, and what it can do."""
    return llvm.get_host_cpu_name(), llvm.get_host_cpu_features().flatten()


def _version_of_numba() -> Path:
    """The file that states numba's version; numba itself is not imported."""
    spec = find_spec("numba")
    return Path(spec.origin if spec is not None and spec.origin else os.devnull).with_name("_version.py")


@cache
def _is_tested() -> bool:
    """Whether the version of numba is one of those that this file was tested with."""
    found = re.search(r'"version": "(\d+)\.(\d+)', _version_of_numba().read_text())
    return found is not None and _TESTED[0] <= (int(found[1]), int(found[2])) <= _TESTED[1]


def write_machine_code(path: Path, stamp: str, payload: Sequence[Any]) -> None:
    """Write what numba's cache holds of a function in the form that `load_machine_code` reads.

    Args:
        path: The file; nothing happens if it cannot be written.
        stamp: Digest of all that the machine code depends on.
        payload: What numba's ``CompileResult._reduce`` returns.
    """
    if not _is_tested():
        return
    (_, kind, (code, _)), description, own, *_, to_run_again, others = payload
    if kind != "object" or to_run_again:
        return
    variables = [own, *(other for other in others if other is not own and other.consts)]
    constants = [(variable.env_name, list(variable.consts)) for variable in variables]
    content = MachineCode(stamp, description.llvm_cpython_wrapper_name, constants, bytes(code))
    with suppress(OSError):
        write_atomically(path, pickle.dumps(tuple(content)))


def load_machine_code(path: Path, stamp: str, name: str) -> Callable[..., Any] | None:
    """Load a function of its file; None if there is none with this stamp."""
    if not _is_tested():
        return None
    try:
        found = MachineCode(*pickle.loads(path.read_bytes()))
        return _loaded(found, name) if found.stamp == stamp else None
    except (*_DAMAGE, pickle.UnpicklingError):
        return None


def _loaded(found: MachineCode, name: str) -> Callable[..., Any]:
    # An engine of its own: two files may give one name to different parts, which numba numbers as they come.
    engine = _engine()
    engine.add_object_file(llvm.ObjectFileRef.from_data(found.code))
    engine.finalize_object()
    functions = _libraries()["_dynfunc"]
    environments = []
    for variable, objects in found.constants:
        environment = functions.Environment({"__name__": __name__})
        environment.consts.extend(objects)
        ctypes.c_void_p.from_address(_known(engine.get_global_value_address(variable))).value = id(
            environment
        )
        environments.append(environment)
    address = _known(engine.get_function_address(found.entry))
    module = sys.modules[__name__]
    made: Callable[..., Any] = functions.make_function(
        module, name, "", address, environments[0], (engine, environments)
    )
    return made


def _known(address: int) -> int:
    """Refuse the address 0 of a name that machine code does not define."""
    if not address:
        raise LookupError
    return address


@ctypes.PYFUNCTYPE(ctypes.py_object, ctypes.c_void_p, ctypes.c_int, ctypes.c_void_p)
def _unpickle(address: int, size: int, _: int) -> object:
    """Return an object that machine code holds pickled, such as numpy's class of arrays."""
    return _unpickled(address, size)


@cache
def _unpickled(address: int, size: int) -> object:
    return pickle.loads(ctypes.string_at(address, size))


@cache
def _target() -> str:
    """LLVM's name of this machine; LLVM is prepared and knows the functions that machine code calls."""
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    libraries = _libraries()
    helpers, functions, arrays = (libraries[name].c_helpers for name in _LIBRARIES)
    symbols = {f"numba_{name}": address for name, address in (*helpers.items(), *functions.items())}
    symbols |= {name: address for name, address in helpers.items() if name.rstrip("f") in _MATHEMATICS}
    symbols |= {(name if name[0] == "_" else f"NRT_{name}"): address for name, address in arrays.items()}
    # Numba's own function imports numba, and keeps objects by their bytes as this one does by their place.
    symbols["numba_unpickle"] = ctypes.cast(_unpickle, ctypes.c_void_p).value
    symbols["_Py_NoneStruct"] = id(None)
    for name, value in vars(builtins).items():
        if isinstance(value, type) and issubclass(value, BaseException):
            symbols[f"PyExc_{name}"] = id(value)
    for name, address in symbols.items():
        llvm.add_symbol(name, address)
    libraries["core.runtime._nrt_python"].memsys_use_cpython_allocator()
    return str(llvm.get_process_triple())


def _engine() -> Any:
    """Memory for the machine code of one file, with the options that numba compiles with."""
    triple = _target()
    x86 = triple.startswith(("x86", "i386", "i686"))
    machine = llvm.Target.from_triple(triple).create_target_machine(
        cpu=_processor()[0],
        features=_processor()[1],
        reloc="static" if x86 else "default",
        codemodel="jitdefault",
        jit=True,
    )
    return llvm.create_mcjit_compiler(llvm.parse_assembly(f'target triple = "{triple}"'), machine)


@cache
def _libraries() -> dict[str, ModuleType]:
    """Numba's libraries in C, without numba's own import."""
    spec = find_spec("numba")
    folders = spec.submodule_search_locations if spec is not None else None
    return {name: _library(name, (folders or [""])[0]) for name in _LIBRARIES}


def _library(name: str, folder: str) -> ModuleType:
    full = f"numba.{name}"
    if full not in sys.modules:
        stem = Path(folder, *name.split("."))
        files = [file for file in (f"{stem}{suffix}" for suffix in EXTENSION_SUFFIXES) if Path(file).exists()]
        spec = spec_from_file_location(full, files[0]) if files else None
        if spec is None or spec.loader is None:
            raise ImportError(f"numba has no library {name} for this Python")
        module = module_from_spec(spec)
        spec.loader.exec_module(module)
        sys.modules[full] = module  # Numba, if it is imported later, uses the same.
    return sys.modules[full]

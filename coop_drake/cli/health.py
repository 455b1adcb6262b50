"""What the doctor looks at, one function each; a test that raises is a finding, too."""

from __future__ import annotations

import os
import platform
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path

import coop_drake
from coop_drake.cli.map_cache import map_cache
from coop_drake.shipped import shipped_scenarios

__all__ = ["Finding", "examine"]

_LEAST_MEMORY = 1.0
"""What a run takes, with room [GB]."""
_PACKAGES = (
    "drake",
    "numpy",
    "scipy",
    "shapely",
    "numba",
    "manifold3d",
    "matplotlib",
    "meshcat",
    "typer",
    "rich",
)


@dataclass(frozen=True)
class Finding:
    """One thing that was looked at.

    Attributes:
        what: Its name.
        state: What was found.
        fine: Whether it is as it should be; None where it works but could be better.
        remedy: What to do where it is not fine.
    """

    what: str
    state: str
    fine: bool | None = True
    remedy: str = ""


def examine() -> list[Finding]:
    """Look at everything."""
    findings = [_python(), *_versions()]
    for what, look, remedy in _LOOKS:
        try:
            findings.append(look())
        except Exception as error:  # Whatever it is, the other findings help to understand it.
            findings.append(Finding(what, f"{type(error).__name__}: {error}", False, remedy))
    return findings


def _python() -> Finding:
    return Finding("Python", platform.python_version(), sys.version_info >= (3, 11), "install 3.11 or newer")


def _versions() -> Iterator[Finding]:
    yield Finding("coop-drake", version("coop-drake"))
    wanted = {line.partition(";")[0].partition(">=")[0]: line.partition(";")[0] for line in _required()}
    for name in _PACKAGES:
        remedy = f"pip install '{wanted.get(name, name)}'"
        try:
            found = version(name)
        except PackageNotFoundError:
            yield Finding(name, "missing", False, remedy)
            continue
        yield Finding(name, found, _at_least(found, wanted.get(name, name)), remedy)


def _required() -> list[str]:
    return [line for line in requires("coop-drake") or [] if "extra ==" not in line]


def _at_least(found: str, requirement: str) -> bool:
    least = requirement.partition(">=")[2].split(",")[0]
    return _numbers(found) >= _numbers(least)


def _numbers(text: str) -> tuple[int, ...]:
    return tuple(int(part) for part in text.split(".") if part.isdigit())


def _drake() -> Finding:
    from pydrake.multibody.plant import MultibodyPlant

    plant = MultibodyPlant(0.0)
    plant.Finalize()
    return Finding("Drake", f"imports, {plant.num_bodies()} body in an empty plant")


def _scenarios() -> Finding:
    from coop_drake.scenario import load_scenario

    names = [load_scenario(path).name for path in shipped_scenarios().values()]
    return Finding("shipped scenarios", ", ".join(names) or "none", bool(names), "install coop-drake anew")


def _meshcat() -> Finding:
    from pydrake.geometry import MeshcatParams

    from coop_drake.viz.server import silent_meshcat

    return Finding("Meshcat", f"opens port {silent_meshcat(MeshcatParams(host='localhost')).port()}")


def _fonts() -> Finding:
    from matplotlib import rcParams
    from matplotlib.font_manager import FontProperties, findfont

    path = findfont(FontProperties(family=rcParams["font.family"]), fallback_to_default=False)
    return Finding("fonts", Path(path).stem)


def _kernels() -> Finding:
    from numba import config

    home = Path(coop_drake.__file__).parent
    folders = [Path(config.CACHE_DIR)] if config.CACHE_DIR else [home]
    compiled = sum(1 for folder in folders for _ in folder.rglob("*.nbi"))
    remedy = "`coop-drake warm` with any scenario compiles them ahead; else the first run does, for a minute"
    return Finding("compiled kernels", f"{compiled} in the cache", True if compiled else None, remedy)


def _memory() -> Finding:
    total = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 1e9
    enough = total >= _LEAST_MEMORY
    return Finding("memory", f"{total:.1f} GB", enough, f"a run takes up to {_LEAST_MEMORY:g} GB")


def _cores() -> Finding:
    return Finding("cores", str(os.cpu_count() or 1))


def _cache() -> Finding:
    store = map_cache()
    store.folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryFile(dir=store.folder):
        pass
    return Finding("cache of maps", f"{len(store.files())} maps in {store.folder}, writable")


def _results() -> Finding:
    with tempfile.TemporaryFile(dir=Path.cwd()):
        pass
    return Finding("folder for results", f"{Path.cwd()}, writable")


_LOOKS: tuple[tuple[str, Callable[[], Finding], str], ...] = (
    (
        "Drake",
        _drake,
        "reinstall with pip install --force-reinstall drake; it needs a 64-bit glibc Linux or macOS",
    ),
    ("shipped scenarios", _scenarios, "install coop-drake anew"),
    ("Meshcat", _meshcat, "free a port from 7000 on; without one there are recordings but no live view"),
    ("fonts", _fonts, "install matplotlib anew"),
    ("compiled kernels", _kernels, "let numba write beside the package, or set NUMBA_CACHE_DIR"),
    ("memory", _memory, ""),
    ("cores", _cores, ""),
    ("cache of maps", _cache, "let COOP_DRAKE_CACHE name a folder that can be written"),
    ("folder for results", _results, "change to a folder that can be written, or use --out"),
)

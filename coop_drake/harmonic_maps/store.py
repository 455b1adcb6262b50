"""Keeps solved maps on disk, by a digest of domain, goal, tolerance and code."""

from __future__ import annotations

import hashlib
import json
import platform
import zipfile
import zlib
from contextlib import suppress
from functools import cache
from importlib.metadata import version
from pathlib import Path
from threading import Lock
from typing import Any

import numpy as np
import shapely
from shapely import Point, Polygon

from coop_drake.files import write_atomically
from coop_drake.harmonic_maps.harmonic_map import HarmonicMap, MapAccuracy, Solution
from coop_drake.jit import compiler_settings

_SUFFIX = ".map.npz"
_DAMAGE = (OSError, ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile, zlib.error)


class MapStore:
    """A folder of solved maps.

    A file is named by a digest of the domain, the goal, the tolerance and of all that computes: the source of
    maps and shapes, the versions of their libraries, the processor. A map is therefore never older than the
    code, and what is read is bit by bit what would be solved. Files are written whole or not at all, so any
    number of processes and threads may share a folder. A damaged file, or one of another question, counts as
    missing and is replaced. Where the folder cannot be written the maps are solved all the same.

    Args:
        folder: The folder; it is made when the first map is kept.
        limit: Size [bytes] to which `trim` reduces the folder, removing the maps used longest ago.

    Attributes:
        found: How many maps were read instead of solved.
    """

    def __init__(self, folder: Path, *, limit: int = 1_000_000_000) -> None:
        self.folder = folder
        self.limit = limit
        self.found, self._lock = 0, Lock()

    def map_of(self, domain: Polygon, goal: Point | Polygon, *, tolerance: float) -> HarmonicMap:
        """Read a map, or solve and keep it; arguments and errors are those of `HarmonicMap`."""
        key = _key(domain, goal, tolerance)
        path = self.folder / (key + _SUFFIX)
        solution = _read(path, key)
        harmonic_map = HarmonicMap(domain, goal, tolerance=tolerance, solution=solution)
        if solution is None:
            _write(path, key, harmonic_map.solution)
        else:
            with self._lock:
                self.found += 1
        return harmonic_map

    def files(self) -> list[Path]:
        """The files of the folder, the one used last at the end."""
        return list(self._sizes())

    def size(self) -> int:
        """Size of all files [bytes]."""
        return sum(self._sizes().values())

    def trim(self) -> None:
        """Remove the maps used longest ago until the rest keeps within the limit."""
        sizes = self._sizes()
        total = sum(sizes.values())
        for path, size in sizes.items():
            if total <= self.limit:
                break
            with suppress(OSError):
                path.unlink()
            total -= size

    def clear(self) -> None:
        """Remove all maps."""
        for path in self.files():
            path.unlink(missing_ok=True)

    def _sizes(self) -> dict[Path, int]:
        """Size of every file [bytes], by the time of its last use, oldest first."""
        rows = []
        for path in self.folder.glob("*" + _SUFFIX):
            with suppress(FileNotFoundError):  # another process has removed it meanwhile
                status = path.stat()
                rows.append((status.st_mtime_ns, status.st_size, path))
        return {path: size for _, size, path in sorted(rows)}


def _key(domain: Polygon, goal: Point | Polygon, tolerance: float) -> str:
    digest = hashlib.sha256(_code())
    for part in (shapely.to_wkb(domain), shapely.to_wkb(goal), repr(float(tolerance)).encode()):
        digest.update(len(part).to_bytes(8, "big") + part)
    return digest.hexdigest()


@cache
def _code() -> bytes:
    """Digest of everything that the numbers in a map depend on except domain, goal and tolerance."""
    digest = hashlib.sha256()
    here = Path(__file__).parent
    shapes, compiling = here.with_name("geometry"), here.with_name("jit.py")
    for path in sorted([*here.glob("*.py"), *shapes.glob("*.py"), compiling]):
        digest.update(path.name.encode() + b"\0" + path.read_bytes())
    for name in ("numpy", "scipy", "numba", "llvmlite", "shapely"):
        digest.update(f"{name} {version(name)}".encode())
    # Compiled sums and BLAS use what the processor has, and what their settings say, which changes last bits.
    digest.update(f"{platform.system()} {platform.machine()} {compiler_settings()}".encode())
    return digest.digest()


def _read(path: Path, key: str) -> Solution | None:
    """Read a solution; None if there is none, or if the file is damaged or of another question."""
    try:
        with path.open("rb") as stream, np.load(stream, allow_pickle=False) as file:
            if file["key"].item() != key:
                return None
            values: dict[str, Any] = json.loads(file["accuracy"].item())
            accuracy = MapAccuracy(**values | {"worst_place": np.array(values["worst_place"])})
            solution = Solution(file["flat"], file["goal_image"], accuracy)
        path.touch()  # used just now
    except _DAMAGE:
        return None
    return solution


def _write(path: Path, key: str, solution: Solution) -> None:
    """Write a solution; nothing happens if the folder cannot be written."""
    flat, image = solution.flat, solution.goal_image
    accuracy = json.dumps(solution.accuracy.plain())
    with suppress(OSError):
        write_atomically(
            path, lambda file: np.savez(file, key=key, flat=flat, goal_image=image, accuracy=accuracy)
        )

"""HarmonicMap: a harmonic map of a polygon to the unit disk, eq. (13), and a store of such maps."""

from __future__ import annotations

import hashlib
import json
import platform
import zipfile
import zlib
from contextlib import suppress
from dataclasses import asdict, dataclass
from functools import cache
from importlib.metadata import version
from math import isfinite
from pathlib import Path
from threading import Lock
from typing import Any, NamedTuple

import numpy as np
import shapely
from numpy.typing import ArrayLike
from shapely import Point, Polygon

from coop_drake.errors import FieldError
from coop_drake.files import write_atomically
from coop_drake.harmonic_maps import TOLERANCE
from coop_drake.harmonic_maps.assemble import pack_layers
from coop_drake.harmonic_maps.evaluate import FlatMap, MapArrays, evaluate_many, flatten, unflatten
from coop_drake.harmonic_maps.outline import Outline, outline_of, region_to_map
from coop_drake.harmonic_maps.panels import Panels, lay_panels, leg_panels
from coop_drake.harmonic_maps.solve import Density, solve_density
from coop_drake.jit import compiler_settings
from coop_drake.tree.arrays import ComplexArray, FloatArray, IntArray

# The harmonic map of a polygon to the unit disk, solved to a tolerance, with an estimate of its error.

_GAIN = 4.0
"""Factor by which the error falls with every further node on a panel, approximately [-]."""
_PROGRESS = 0.7
"""An attempt that leaves more than this fraction of the error is the last: more nodes would not help [-]."""
_LARGE = 2_000
"""Unknowns from which the first attempt, which rarely suffices then, is left out."""
_EPSILON = float(np.finfo(float).eps)
_MAX_UNKNOWNS = 40_000
"""Largest system that is solved: it takes about 7 s and 700 MB."""
#: Chebyshev points [-]: denser than the nodes of a panel, and different from them.
_ON_PANEL = np.sort(np.cos(np.pi * (np.arange(23) + 0.5) / 23))
_ON_RING = np.cos(np.pi * (np.arange(5) + 0.5) / 5)
_RINGS = np.array([0, 1, 2, 3, 5, 8, 13, 21, 33])
"""Dyadic rings of a corner on which the residual is sampled: down to 1e-10 of its legs."""


@dataclass(frozen=True)
class MapAccuracy:
    """How far a computed map is from the true one, as samples of its boundary say.

    The error is harmonic, has no flux around any hole, and on every hole it is a constant up to the residual.
    With M holes it is nowhere larger than (2 M + 1) times the largest residual of all boundary points. The
    largest one of the samples stands for that, so that the result is an estimate, not a bound.

    Attributes:
        residual: Largest distance of the image of a boundary sample from where it belongs.
        error_estimate: (2 M + 1) times that.
        samples: Number of boundary samples.
        unknowns: Size of the linear system.
        condition: Estimate of its condition in the 1-norm.
        worst_place: Where the residual is largest, in W [m], shape (2,).
    """

    residual: float
    error_estimate: float
    samples: int
    unknowns: int
    condition: float
    worst_place: FloatArray

    def plain(self) -> dict[str, Any]:
        """The values by name, for JSON."""
        values = asdict(self)
        return values | {"worst_place": values["worst_place"].tolist()}


_ATTEMPTS = (10, 1.5), (13, 1.5), (16, 1.5), (16, 1.0), (20, 0.7)
"""Resolutions: Gauss nodes on a panel, and longest panel per unit of distance (`leg_panels`). Ten nodes
suffice for most domains, thirteen for most large ones."""


class Solution(NamedTuple):
    """The result of solving: everything that evaluates a map, as plain arrays and numbers.

    Attributes:
        flat: The map for compiled code, see `evaluate`.
        goal_image: q_d, the goal's image in the disk, shape (2,).
        accuracy: How far the map is estimated to be from the true one.
    """

    flat: FlatMap
    goal_image: FloatArray
    accuracy: MapAccuracy

    @property
    def arrays(self) -> MapArrays:
        """The arrays of the map by their names."""
        return unflatten(self.flat)

    @property
    def centre(self) -> FloatArray:
        """Origin of the map's coordinates in W [m], shape (2,)."""
        return self.flat[:2]


def as_points(points: ArrayLike) -> FloatArray:
    """Points as an array of floats, shape (..., 2) [m].

    Raises:
        FieldError: If the last axis is not x, y, or a coordinate is not a finite number.
    """
    try:
        p = np.asarray(points, dtype=float)
    except (TypeError, ValueError) as error:
        raise FieldError(f"points must be numbers of shape (..., 2), got {type(points).__name__}") from error
    if p.ndim == 0 or p.shape[-1] != 2:
        raise FieldError(f"points must have shape (..., 2), got {p.shape}")
    # The sum is quicker than a flag for each: it is finite unless a coordinate is not, or it overflows.
    total = sum(p.tolist()) if p.ndim == 1 else p.sum()
    if not isfinite(total) and not np.isfinite(p).all():
        first = np.argwhere(~np.isfinite(p).all(axis=-1))[0].tolist()
        raise FieldError(f"points must be finite, but point {first or 0} is {p[tuple(first)].tolist()}")
    return p


class HarmonicMap:
    """T = (u, v), both harmonic, from a polygonal domain F to the unit disk.

    The outer ring goes to the unit circle, its angle linear in arc length; every hole collapses to one
    interior point with no net flux. A goal region collapses too: in the interior as a hole of F, on the outer
    ring to a point of the circle. T is a diffeomorphism of the interior of F, so the straight line from T(p)
    to the goal's image, pulled back, is a path from p to the goal for almost every p.

    Example:
        ```
        harmonic_map = HarmonicMap(Polygon([(0, 0), (2, 0), (2, 1), (0, 1)]), Point(1.5, 0.5))
        T, J = harmonic_map([[0.2, 0.3], [1.0, 0.5]])
        ```

    Args:
        domain: The cell, with or without holes [m].
        goal: Point to reach, or region of the domain to collapse.
        tolerance: Largest estimated error of T that is accepted.
        solution: The result of solving with these arguments before; None to solve.

    Attributes:
        region: F: the domain, less a goal region and what lies beyond it [m].
        goal: The goal as it was given [m].
        target: The shape whose image is the goal's: the goal, or its pole if it cannot collapse [m].
        solution: The result of solving.

    Raises:
        FieldError: Or if no attempt reaches the tolerance: names the place where the error is largest.
    """

    def __init__(
        self,
        domain: Polygon,
        goal: Point | Polygon,
        *,
        tolerance: float = TOLERANCE,
        solution: Solution | None = None,
    ) -> None:
        self.goal = goal
        self.region, self.target = region_to_map(domain, goal)
        self.solution = solution or _solve(outline_of(self.region, self.target), self.target, tolerance)

    def __call__(self, points: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """T and its Jacobian.

        On walls the values are the limits from inside, at vertices those of a point just inside (1e-13 of the
        legs); outside of F they are those of the nearest boundary point. They are never NaN.

        Args:
            points: Points in W, shape (..., 2) [m].

        Returns:
            T, shape (..., 2), and J = dT/dp, shape (..., 2, 2) [1/m].
        """
        p = as_points(points)
        T, J = evaluate_many(self.solution.flat, p.reshape(-1, 2) - self.solution.centre)
        return T.reshape(p.shape), J.reshape(*p.shape, 2)

    @property
    def goal_image(self) -> FloatArray:
        """q_d, the goal's image in the disk, shape (2,)."""
        return self.solution.goal_image.copy()

    @property
    def accuracy(self) -> MapAccuracy:
        """How accurate the map is, as sampled on its boundary."""
        return self.solution.accuracy


def _solve(outline: Outline, goal: Point | Polygon, tolerance: float) -> Solution:
    """Solve with more and more nodes until the estimated error is within the tolerance.

    The image of the goal, the target, is looked up if it is a point.

    Raises:
        FieldError: If more nodes do not reduce the error, or would be too many, or the system is so
            close to singular, as narrow gaps make it, that rounding alone may exceed the tolerance.
    """
    best: MapAccuracy | None = None
    last = _ATTEMPTS[0]
    # Rounded, so that equal corners share one operator in the cache.
    angles = np.round(outline.corner_angles, 12)
    for nodes, closeness in _ATTEMPTS:
        if best is not None and closeness == last[1]:
            final = max(other for other, same in _ATTEMPTS if same == closeness)
            if nodes != final and _GAIN ** (nodes - last[0]) < best.error_estimate / tolerance:
                continue
        panels = lay_panels(outline, closeness)
        legs = sum(2 * len(leg_panels(float(angle), closeness)[0]) - 2 for angle in angles)
        unknowns = nodes * (len(panels.edge) + legs)
        if (nodes, closeness) == _ATTEMPTS[0] and _LARGE <= unknowns <= _MAX_UNKNOWNS:
            continue
        if unknowns > _MAX_UNKNOWNS:
            break
        solution = _attempt(outline, goal, panels, angles, nodes, closeness)
        estimate = solution.accuracy.error_estimate
        if estimate <= tolerance:
            return solution
        if best is not None and estimate > _PROGRESS * best.error_estimate:
            break
        best, last = solution.accuracy, (nodes, closeness)
        if _EPSILON * best.condition > tolerance:  # more nodes do not reduce rounding errors
            break
    if best is None:
        raise FieldError(
            f"the harmonic map would take {unknowns} unknowns, at most {_MAX_UNKNOWNS} are allowed; the "
            f"narrowest gap is {panels.gap.min():.3g} m"
        )
    rounding = _EPSILON * best.condition
    why = f", and rounding alone may cost {rounding:.2g}" if rounding > tolerance else ""
    x, y = best.worst_place
    raise FieldError(
        f"the harmonic map is accurate to about {best.error_estimate:.2g}; {tolerance:.2g} was asked for"
        f"{why}; the error is largest at ({x:.6g}, {y:.6g}) m"
    )


def _attempt(
    outline: Outline,
    goal: Point | Polygon,
    panels: Panels,
    angles: FloatArray,
    nodes: int,
    closeness: float,
) -> Solution:
    """Solve with so many nodes on a panel, evaluate the goal's image and estimate the error."""
    density = solve_density(outline, panels, angles, nodes, closeness)
    arrays = pack_layers(outline, panels, angles, density, closeness)
    # Coordinates of points are rounded: a point outside by less than this counts as on the wall.
    rounding = 8.0 * _EPSILON * (abs(outline.centre) + outline.diameter)
    flat = flatten(arrays, np.array([outline.centre.real, outline.centre.imag]), rounding)
    if outline.goal_angle is not None:
        image = np.array([np.cos(outline.goal_angle), np.sin(outline.goal_angle)])
    elif outline.goal_ring is not None:
        image = density.hole_images[outline.goal_ring - 1].copy()
    else:
        image = evaluate_many(flat, np.array(goal.coords)[:, :2] - flat[:2])[0][0]
    return Solution(flat, image, _estimate_accuracy(outline, panels, flat, density))


def _estimate_accuracy(outline: Outline, panels: Panels, flat: FlatMap, density: Density) -> MapAccuracy:
    """Sample the residual on every panel and far down every corner of a map, evaluated as its users do."""
    position, expected, edge = _samples(outline, panels, density.hole_images)
    vertices = np.minimum(np.abs(position - outline.vertices[edge]), np.abs(position - outline.ends[edge]))
    clear = vertices > 100.0 * flat[2]  # rounding would move closer samples across the other wall
    position, expected = position[clear], expected[clear]
    images, _ = evaluate_many(flat, np.column_stack((position.real, position.imag)))
    residuals = np.abs(images[:, 0] + 1j * images[:, 1] - expected)
    residuals = np.where(np.isfinite(residuals), residuals, np.inf)
    worst = int(np.argmax(residuals))
    place = position[worst] + outline.centre
    return MapAccuracy(
        float(residuals[worst]),
        float((2 * outline.holes + 1) * residuals[worst]),
        len(position),
        len(density.weighted) + outline.holes,
        density.condition,
        np.array([place.real, place.imag]),
    )


def _samples(
    outline: Outline, panels: Panels, hole_images: FloatArray
) -> tuple[ComplexArray, ComplexArray, IntArray]:
    """Positions, where the map should send them, and their edges."""
    length = np.abs(outline.ends - outline.vertices)
    half = 0.5 * (panels.end - panels.start)[:, None]
    on_panels = (0.5 * (panels.end + panels.start)[:, None] + half * _ON_PANEL).ravel()
    depth = ((0.75 + 0.25 * _ON_RING) * 0.5 ** _RINGS[:, None]).ravel()
    legs = (panels.legs[:, None] * depth).ravel()
    corners = np.repeat(np.arange(len(length)), depth.size)
    before = outline.preceding[corners]
    edge = np.concatenate((np.repeat(panels.edge, _ON_PANEL.size), corners, before)).astype(np.int64)
    part = np.concatenate((on_panels, legs, length[before] - legs)) / length[edge]
    angle = outline.angle_start[edge] + (outline.angle_end - outline.angle_start)[edge] * part
    constants = np.concatenate(([0.0], hole_images @ np.array([1.0, 1.0j])))
    expected = np.where(outline.ring[edge] == 0, np.exp(1j * angle), constants[outline.ring[edge]])
    return outline.vertices[edge] + (outline.ends - outline.vertices)[edge] * part, expected, edge


# Keeps solved maps on disk, by a digest of domain, goal, tolerance and code.

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

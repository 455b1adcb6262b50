"""Cuts off corners of a domain that are too sharp to map, without leaving the domain."""

from __future__ import annotations

import numpy as np
import shapely
from shapely import Polygon

from coop_drake.errors import FieldError, UnmappableError
from coop_drake.fields.goals import check_polygon
from coop_drake.geometry.boundary import edges_of
from coop_drake.geometry.parts import corners_of, extent_of
from coop_drake.geometry.simplify import vertex_angles
from coop_drake.tree.pose import ComplexArray

_DEPTH = 0.01
"""Distance from the tip at which a spike is cut, per size of the domain [-]."""
_FRACTION = 0.45
"""Largest such distance, per distance to the next vertex or wall: two neighbours leave an edge between them
[-]."""
_SQUARE = np.exp(-1j * np.pi * np.array([0.25, 0.75, 1.25, 1.75]))
"""Corners of a cap, clockwise, at unit distance from its middle [-]."""
_LEAST = 1e-9
"""Smallest such distance, per size of the domain: rounding alone is hardly smaller [-]."""
_ROUNDING = 1e-12
"""Distance, per size of the domain, by which rounding may put new vertices outside [-]."""


def blunted(domain: Polygon, *, sharpest: float = 10.0, depth: float | None = None) -> Polygon:
    """The domain without corners sharper than an angle, inside the domain.

    A spike of the domain loses its tip, across. The tip of a spike that juts into the domain gets a square
    cap, twice as wide as it is deep. Everything farther than ``depth`` from the tips stays as it is.

    Args:
        domain: The cell [m].
        sharpest: Smallest interior angle to keep, and least that one may lack to a full turn, at most 45
            [degrees].
        depth: Farthest from a tip that something is changed [m]; by default a hundredth of the domain's size.

    Returns:
        The blunted polygon; the domain itself if nothing is sharp.

    Raises:
        FieldError: If the domain is no valid polygon, or the angle or depth is out of bounds.
        UnmappableError: If there is no room to blunt a corner, which is named.
    """
    check_polygon(domain, "domain")
    if not 0.0 < sharpest <= 45.0 or (depth is not None and not depth > 0.0):
        raise FieldError(f"sharpest must be in (0, 45] degrees, depth positive, got {sharpest} and {depth}")
    oriented = shapely.orient_polygons(shapely.remove_repeated_points(shapely.force_2d(domain)))
    size, limit = extent_of(domain), np.deg2rad(sharpest)
    angles = vertex_angles(oriented)
    if min(angles.min(), 2.0 * np.pi - angles.max()) >= limit:
        return domain
    walls = edges_of(oriented) @ np.array([[1.0, 0.0], [1.0j, 0.0], [0.0, 1.0], [0.0, 1.0j]])
    rings, first = [], 0
    for ring in (oriented.exterior, *oriented.interiors):
        n = len(ring.coords) - 1
        z, own = walls[first : first + n, 0], angles[first : first + n]
        reach = np.zeros(n)
        for k in np.flatnonzero(np.minimum(own, 2.0 * np.pi - own) < limit).tolist():
            reach[k] = min(depth or _DEPTH * size, _FRACTION * _free(walls, first + k, first + (k - 1) % n))
            if reach[k] <= _LEAST * size:
                _refuse(z[k], own[k])
        corners = np.concatenate([_replacement(z, k, own[k], reach[k]) for k in range(n)])
        rings.append(np.column_stack((corners.real, corners.imag)))
        first += n
    result = Polygon(rings[0], rings[1:])
    _certify(domain, result, _ROUNDING * size, limit)
    return result


def _free(walls: ComplexArray, edge: int, before: int) -> float:
    """Distance from the start of an edge to the nearest other edge or vertex [m]."""
    place, a, b = walls[edge, 0], walls[:, 0], walls[:, 1]
    t = np.clip(np.real(np.conj(b - a) * (place - a)) / np.abs(b - a) ** 2, 0.0, 1.0)
    gap = np.abs(a + t * (b - a) - place)
    gap[[edge, before]] = np.inf
    return float(min(gap.min(), abs(walls[edge, 1] - place), abs(walls[before, 0] - place)))


def _replacement(z: ComplexArray, k: int, angle: float, reach: float) -> ComplexArray:
    """The vertices that replace vertex k: itself, the ends of a cut, or a cap."""
    if reach == 0.0:
        return z[k : k + 1]
    back, out = z[k - 1] - z[k], z[(k + 1) % len(z)] - z[k]
    back, out = back / abs(back), out / abs(out)
    if angle < np.pi:
        return np.array([z[k] + reach * back, z[k] + reach * out])
    half = np.pi - 0.5 * angle  # of the obstacle, whose axis is the direction back turned by this much
    axis = back * np.exp(1j * half)
    across = reach * np.sqrt(0.5) / np.cos(half)
    return np.concatenate(([z[k] + across * back], z[k] + reach * axis * _SQUARE, [z[k] + across * out]))


def _certify(domain: Polygon, result: Polygon, rounding: float, limit: float) -> None:
    """Refuse a result that is no valid polygon in the domain, or the sharpest corner that is left."""
    angles = vertex_angles(result)
    lack = np.minimum(angles, 2.0 * np.pi - angles)
    worst = int(np.argmin(lack))
    if result.is_valid and domain.buffer(rounding).covers(result) and lack[worst] >= limit:
        return
    corners = np.vstack(corners_of(shapely.orient_polygons(result)))
    _refuse(complex(*corners[worst]), angles[worst])


def _refuse(place: complex, angle: float) -> None:
    """Raise an UnmappableError that names a corner which cannot be blunted."""
    x, y, degrees = place.real, place.imag, float(np.rad2deg(angle))
    raise UnmappableError(
        f"no room to blunt the corner at ({x:.6g}, {y:.6g}) m with interior angle {degrees:.3g} degrees",
        (x, y),
        angle=degrees,
    )

"""Positions at which a convex footprint fits into the workspace: the Minkowski difference of eq. (9)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from manifold3d import CrossSection, FillRule
from shapely import MultiPolygon, Polygon
from shapely.geometry.polygon import orient

from coop_drake.geometry.convex import following
from coop_drake.geometry.pose import FloatArray

SAFE_SIDE = 1e-6
"""How far a workspace is shrunk or grown once [m]: a hundred times the clipping library's grid."""


class FreeSpace:
    """A workspace that footprints are subtracted from; it may be non-convex and may have holes.

    A connected footprint F at p lies inside W exactly if one of its points does and it meets no edge e of W,
    so ``W - F = (W - f) minus the union of e + (-F)`` for any f in F. Convex F makes every ``e + (-F)``
    convex. All contours go into one clipping pass: the workspace winds once, each edge's sum unwinds.

    Args:
        rings: Outer rings counter-clockwise, holes clockwise, each of shape (n, 2) [m].

    Attributes:
        region: The workspace itself.
        edges: Its edges (x0, y0, x1, y1), shape (E, 4) [m].
    """

    def __init__(self, rings: Sequence[FloatArray]) -> None:
        self.rings = tuple(rings)
        self.region = CrossSection(list(self.rings), FillRule.Positive)
        tails = [following(ring) for ring in self.rings]
        self._from = np.concatenate(self.rings) if self.rings else np.empty((0, 2))
        self._to = np.concatenate(tails) if tails else np.empty((0, 2))
        self.edges = np.hstack((self._from, self._to))

    @classmethod
    def under(cls, workspace: Polygon | MultiPolygon) -> FreeSpace:
        """The workspace shrunk by a hair, so that rounding never leaves it."""
        return cls(polygon_rings(workspace.buffer(-SAFE_SIDE, join_style="mitre")))

    @classmethod
    def over(cls, workspace: Polygon | MultiPolygon) -> FreeSpace:
        """The workspace grown by a hair, so that rounding never loses a position."""
        return cls(polygon_rings(workspace.buffer(SAFE_SIDE, join_style="mitre")))

    def minus(self, footprint: FloatArray) -> CrossSection:
        """Positions p with p + F inside the workspace.

        Args:
            footprint: Convex polygon F, counter-clockwise, relative to p, shape (n, 2) [m].
        """
        start = footprint[0]
        contours = [ring - start for ring in self.rings]
        contours.extend(self._edge_sums(-footprint))
        return CrossSection(contours, FillRule.Positive)

    def _edge_sums(self, convex: FloatArray) -> FloatArray:
        """Sums of every edge with a convex ring, clockwise, shape (edges, 2 n, 2).

        Vertices between two edges that lead the same way along e shift to the same end of e; at the two
        others the ring opens and takes e in. Repeated vertices do no harm.
        """
        sides = following(convex) - convex
        along = self._to - self._from
        ahead = along[:, None, 0] * sides[:, 1] - along[:, None, 1] * sides[:, 0] > 0.0
        ends = np.where(ahead[..., None], self._to[:, None, :], self._from[:, None, :])
        sums = np.empty((len(along), 2 * len(convex), 2))
        sums[:, 0::2] = convex + np.concatenate((ends[:, -1:], ends[:, :-1]), axis=1)
        sums[:, 1::2] = convex + ends
        clockwise: FloatArray = sums[:, ::-1]
        return clockwise


def polygon_rings(shape: Polygon | MultiPolygon) -> list[FloatArray]:
    """Rings of a polygon or of several, outer ones counter-clockwise, holes clockwise, not closed."""
    parts = shape.geoms if isinstance(shape, MultiPolygon) else [shape]
    rings: list[FloatArray] = []
    for part in parts:
        if part.is_empty:
            continue
        oriented = orient(part)
        rings += [np.asarray(ring.coords)[:-1] for ring in (oriented.exterior, *oriented.interiors)]
    return rings


def to_polygon(component: CrossSection) -> Polygon:
    """One connected region as a shapely polygon.

    Args:
        component: One outline with any number of holes, as ``CrossSection.decompose`` returns it.
    """
    rings = [np.asarray(ring, dtype=float) for ring in component.to_polygons()]
    outer = max(range(len(rings)), key=lambda i: float(np.ptp(rings[i][:, 0]) * np.ptp(rings[i][:, 1])))
    return Polygon(rings[outer], [ring for i, ring in enumerate(rings) if i != outer])

"""Samples a map on the boundary of its region: computed and exact images."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coop_drake.fields.harmonic_map import HarmonicMap
from coop_drake.fields.outline import Outline, outline_of
from coop_drake.tree.pose import FloatArray, IntArray


@dataclass(frozen=True)
class BoundarySamples:
    """Samples along all rings of a region, the outer ring first, the region on the left.

    Attributes:
        points: The samples in W, shape (n, 2) [m].
        ring: Ring of each sample, 0 for the outer one, shape (n,).
        arc_length: Length of the boundary before each, summed over all rings, shape (n,) [m].
        images: Their computed images, shape (n, 2).
        expected: Their exact images: points of the circle, or the one point of a hole, which is not known
            beforehand and taken as the mean of the computed images, shape (n, 2).
        vertices: The corners, shape (m, 2) [m].
        vertex_arc_length: Length of boundary before each corner, shape (m,) [m].
        vertex_images: The exact images of the corners, shape (m, 2).
    """

    points: FloatArray
    ring: IntArray
    arc_length: FloatArray
    images: FloatArray
    expected: FloatArray
    vertices: FloatArray
    vertex_arc_length: FloatArray
    vertex_images: FloatArray

    @property
    def residual(self) -> FloatArray:
        """Distance of every computed image from the exact one, shape (n,)."""
        return np.asarray(np.linalg.norm(self.images - self.expected, axis=1))


def sample_boundary(harmonic_map: HarmonicMap, per_edge: int = 65) -> BoundarySamples:
    """Sample the boundary, so many times on each edge, more densely towards the corners."""
    outline = outline_of(harmonic_map.region, harmonic_map.target)
    part = 0.5 - 0.5 * np.cos(np.pi * (np.arange(per_edge) + 0.5) / per_edge)
    start, side = outline.vertices[:, None], (outline.ends - outline.vertices)[:, None]
    points = _plane((start + part * side).ravel() + outline.centre)
    length = np.abs(side[:, 0])
    before = np.cumsum(length) - length
    ring = np.repeat(outline.ring, per_edge)
    images, _ = harmonic_map(points)
    expected = _expected(outline, ring, part, images)
    return BoundarySamples(
        points=points,
        ring=ring,
        arc_length=(before[:, None] + part * length[:, None]).ravel(),
        images=images,
        expected=expected,
        vertices=_plane(outline.vertices + outline.centre),
        vertex_arc_length=before,
        vertex_images=np.where(
            (outline.ring == 0)[:, None], _plane(np.exp(1j * outline.angle_start)), expected[::per_edge]
        ),
    )


def _expected(outline: Outline, ring: IntArray, part: FloatArray, images: FloatArray) -> FloatArray:
    span = (outline.angle_end - outline.angle_start)[:, None]
    angle = (outline.angle_start[:, None] + part * span).ravel()
    expected = _plane(np.exp(1j * angle))
    for hole in range(1, outline.holes + 1):
        expected[ring == hole] = images[ring == hole].mean(axis=0)
    return expected


def _plane(z: np.ndarray) -> FloatArray:
    """Complex numbers (n,) to points (n, 2)."""
    return np.column_stack((z.real, z.imag))

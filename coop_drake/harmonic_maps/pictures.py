"""Figures of a map: a grid and its image, streamlines and their straight images, the residual."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from string import ascii_uppercase
from typing import Any

import matplotlib as mpl
import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from shapely import LineString, Point

from coop_drake.drawing import draw_polygon, new_figure
from coop_drake.drawing.colours import BLUE, GREEN, GREY, INK, PAPER, VERMILLION, WALL
from coop_drake.harmonic_maps.harmonic_map import HarmonicMap
from coop_drake.harmonic_maps.outline import outline_of
from coop_drake.tree.arrays import ComplexArray, FloatArray, IntArray

_SIDE = 4.2  # height of a panel [in]
_FINE = 400  # points on a grid line across the region
_RIM = 0.06  # room round a region, of its size
_LETTERED = 16  # corners that get letters; more would hide the rest
_FLOOR = 1e-17  # residuals below are drawn here


def grid_figure(harmonic_map: HarmonicMap, *, lines: int = 24) -> Figure:
    """Draw a square grid in the region and its image in the disk.

    Walls have the colour of the place on the circle where they go, corners the letter of theirs.

    Args:
        harmonic_map: The map.
        lines: Grid lines across the longer side of the region.
    """
    figure, (cell, disk) = _two_panels(
        harmonic_map,
        "A square grid in the cell (left) and its image in the disk (right). Every wall keeps its colour, "
        "every corner its letter; the star is the goal.",
    )
    for across, colour in ((0, BLUE), (1, VERMILLION)):
        paths = _grid_lines(harmonic_map, across, lines)
        _draw_paths(cell, paths, colour, 0.7)
        _draw_paths(disk, [harmonic_map(path)[0] for path in paths], colour, 0.7)
    _draw_walls(cell, disk, harmonic_map)
    return figure


def streamline_figure(harmonic_map: HarmonicMap, paths: Sequence[FloatArray]) -> Figure:
    """Draw streamlines in the region and their images, which are straight, in the disk.

    Args:
        harmonic_map: The map.
        paths: Streamlines, each (points, 2) [m].
    """
    figure, (cell, disk) = _two_panels(
        harmonic_map,
        "Ways to the goal in the cell (left) are straight lines in the disk (right). Dots are starts, the "
        "star is the goal; walls have the colour of their place on the circle.",
    )
    images = [harmonic_map(path)[0] for path in paths]
    for ax, lines in ((cell, paths), (disk, images)):
        _draw_paths(ax, lines, BLUE, 1.0)
        ax.plot(*np.array([line[0] for line in lines]).T, "o", color=BLUE, markersize=3, zorder=4)
    _draw_walls(cell, disk, harmonic_map)
    return figure


def residual_figure(harmonic_map: HarmonicMap, tolerance: float) -> Figure:
    """Draw how far each place of the boundary is sent from where it belongs, on a logarithmic scale.

    Args:
        harmonic_map: The map.
        tolerance: The error that was allowed.
    """
    samples = sample_boundary(harmonic_map)
    bound = harmonic_map.accuracy.error_estimate
    figure = new_figure(
        2.0 * _SIDE,
        0.75 * _SIDE,
        "How far the image of each place of the boundary is from where it belongs; the disk has radius 1. "
        f"By the maximum principle the error inside is nowhere above the bound, {bound:.1e}.",
    )
    ax = figure.subplots()
    for ring in range(int(samples.ring.max()) + 1):
        here = samples.ring == ring
        colour, label = (BLUE, "outer wall") if ring == 0 else (VERMILLION, "holes" if ring == 1 else None)
        residual = np.maximum(samples.residual[here], _FLOOR)
        ax.semilogy(samples.arc_length[here], residual, color=colour, linewidth=0.9, label=label)
    ax.axhline(tolerance, color=INK, linestyle="--", linewidth=1.2, label=f"tolerance, {tolerance:.0e}")
    ax.axhline(bound, color=GREEN, linewidth=1.2, label="estimated largest error")
    for place, letter in _letters(samples):
        ax.axvline(samples.vertex_arc_length[place], color=WALL, linewidth=0.8, zorder=0)
        at: dict[str, Any] = {"xycoords": ("data", "axes fraction"), "textcoords": "offset points"}
        x = samples.vertex_arc_length[place]
        ax.annotate(letter, (x, 1.0), xytext=(0, 2), ha="center", fontweight="bold", **at)
    ax.grid(visible=False, axis="x")
    ax.set_xlim(0.0, float(samples.arc_length.max()))
    ax.set_ylim(1e-17, 100.0 * max(tolerance, bound))
    ax.set_xlabel("way along the boundary [m]")
    ax.set_ylabel("error of T on the boundary [-]")
    ax.legend(loc="lower right", ncols=4, framealpha=1.0, frameon=True, edgecolor="none")
    return figure


def _two_panels(harmonic_map: HarmonicMap, caption: str) -> tuple[Figure, tuple[Axes, Axes]]:
    """A figure with the region in its left axes and the disk in its right ones."""
    x0, y0, x1, y1 = harmonic_map.region.bounds
    aspect = min(2.2, max(0.6, (x1 - x0) / (y1 - y0)))
    figure = new_figure(_SIDE * (aspect + 1.0) + 0.8, _SIDE + 0.8, caption)
    cell, disk = figure.subplots(1, 2, width_ratios=[aspect, 1.0])
    rim = _RIM * max(x1 - x0, y1 - y0)
    cell.set(xlim=(x0 - rim, x1 + rim), ylim=(y0 - rim, y1 + rim), xlabel="x [m]", ylabel="y [m]")
    cell.set_facecolor(WALL)
    draw_polygon(cell, harmonic_map.region, facecolor=PAPER, edgecolor="none", zorder=0)
    if not isinstance(harmonic_map.goal, Point):
        draw_polygon(cell, harmonic_map.goal, facecolor=GREEN, edgecolor="none", alpha=0.5, zorder=0.5)
    disk.set(xlim=(-1.3, 1.3), ylim=(-1.2, 1.2), xlabel="u [-]", ylabel="v [-]")
    disk.set(xticks=(-1, 0, 1), yticks=(-1, 0, 1))
    for ax in (cell, disk):
        ax.set_aspect("equal")
        ax.grid(visible=False)
    return figure, (cell, disk)


def _grid_lines(harmonic_map: HarmonicMap, across: int, lines: int) -> list[FloatArray]:
    """Grid lines at constant x (``across`` 0) or y (1), cut by the region's boundary, finely sampled."""
    low, high = np.reshape(harmonic_map.region.bounds, (2, 2))
    size = float((high - low).max())
    spacing = size / lines
    paths: list[FloatArray] = []
    for value in np.arange(low[across] + 0.5 * spacing, high[across], spacing):
        ends = np.array([low, high])
        ends[:, across] = value
        parts = shapely.get_parts(harmonic_map.region.intersection(LineString(ends)))
        found = [part for part in parts if isinstance(part, LineString)]
        paths.extend(shapely.get_coordinates(line.segmentize(size / _FINE)) for line in found)
    return paths


def _draw_paths(ax: Axes, paths: Sequence[FloatArray], colour: str, width: float) -> None:
    ax.add_collection(LineCollection(list(paths), colors=colour, linewidths=width, alpha=0.8, zorder=2))


def _draw_walls(cell: Axes, disk: Axes, harmonic_map: HarmonicMap) -> None:
    """Draw walls and circle in the colours of the circle's angle, letters at corners, and the goal."""
    samples = sample_boundary(harmonic_map)
    outer = samples.ring == 0
    colours = mpl.colormaps["hsv"](np.arctan2(*samples.expected[outer].T[::-1]) / (2.0 * np.pi) % 1.0)
    for ax, points in ((cell, samples.points[outer]), (disk, samples.expected[outer])):
        closed = np.stack((points, np.roll(points, -1, axis=0)), axis=1)
        ax.add_collection(LineCollection(list(closed), colors=colours, linewidths=3.0, zorder=3))
    for hole in range(1, int(samples.ring.max()) + 1):
        here = samples.ring == hole
        cell.fill(*samples.points[here].T, facecolor=GREY, edgecolor=INK, linewidth=1.0, zorder=3)
        disk.plot(*samples.expected[here][0], "o", color=GREY, markeredgecolor=INK, markersize=7, zorder=4)
    _draw_letters(cell, disk, samples)
    goal = shapely.get_coordinates(shapely.point_on_surface(harmonic_map.target))[0]
    for ax, place in ((cell, goal), (disk, harmonic_map.goal_image)):
        ax.plot(*place, "*", color=GREEN, markeredgecolor=INK, markersize=13, zorder=6)


def _draw_letters(cell: Axes, disk: Axes, samples: BoundarySamples) -> None:
    """Letters outside the corners of the outer wall and outside their images; images may coincide."""
    per_edge = len(samples.points) // len(samples.vertices)
    outer = int(np.sum(samples.ring == 0))
    style: dict[str, Any] = {"textcoords": "offset points", "ha": "center", "va": "center"}
    style |= {"fontweight": "bold", "zorder": 7}
    images: dict[tuple[float, float], str] = {}
    for place, letter in _letters(samples):
        first, corner = place * per_edge, samples.vertices[place]
        along = samples.points[first + per_edge // 2] - corner
        back = samples.points[(first - per_edge // 2) % outer] - corner
        outward = -(along / np.hypot(*along) + back / np.hypot(*back))
        if along[0] * back[1] - along[1] * back[0] < 0.0:  # the corner juts into the region
            outward = -outward
        cell.annotate(letter, corner, 9.0 * outward / max(float(np.hypot(*outward)), 1e-9), **style)
        x, y = np.round(samples.vertex_images[place], 9).tolist()
        images[x, y] = images.get((x, y), "") + letter
    for (x, y), letters in images.items():
        reach = 8.0 + 3.0 * len(letters)
        disk.annotate(letters, (x, y), (reach * x, reach * y), **style)


def _letters(samples: BoundarySamples) -> list[tuple[int, str]]:
    """(index, letter) of the outer corners, none if there are too many."""
    per_edge = len(samples.points) // len(samples.vertices)
    corners = int(np.sum(samples.ring == 0)) // per_edge
    return list(enumerate(ascii_uppercase[:corners])) if corners <= _LETTERED else []


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

    def plane(z: ComplexArray) -> FloatArray:
        return np.column_stack((z.real, z.imag))

    outline = outline_of(harmonic_map.region, harmonic_map.target)
    # The first column stands for the corner itself.
    part = np.append(0.0, 0.5 - 0.5 * np.cos(np.pi * (np.arange(per_edge) + 0.5) / per_edge))
    z = outline.centre + outline.vertices[:, None] + part * (outline.ends - outline.vertices)[:, None]
    length = np.abs(outline.ends - outline.vertices)
    along = (np.cumsum(length) - length)[:, None] + part * length[:, None]
    span = outline.angle_end - outline.angle_start
    goes_to = np.exp(1j * (outline.angle_start[:, None] + part * span[:, None]))
    images, _ = harmonic_map(plane(z[:, 1:].ravel()))
    for hole in range(1, outline.holes + 1):
        here = np.repeat(outline.ring == hole, per_edge)
        goes_to[outline.ring == hole] = images[here].mean(axis=0) @ [1.0, 1.0j]
    return BoundarySamples(
        points=plane(z[:, 1:].ravel()),
        ring=np.repeat(outline.ring, per_edge),
        arc_length=along[:, 1:].ravel(),
        images=images,
        expected=plane(goes_to[:, 1:].ravel()),
        vertices=plane(z[:, 0]),
        vertex_arc_length=along[:, 0],
        vertex_images=plane(goes_to[:, 0]),
    )

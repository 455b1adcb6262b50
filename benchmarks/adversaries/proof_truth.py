"""Statements of a proof that are surely false, found with floating point, samples and room for rounding."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from itertools import combinations, product
from math import prod, remainder, tau
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import Point
from shapely.affinity import translate
from shapely.geometry.base import BaseGeometry

from benchmarks.adversaries.collisions import (
    Document,
    FloatArray,
    Team,
    boxes_sampled,
    floor_of,
    polygon_of,
    positions_sampled,
)

SURELY = 1e-8
"""What is wrong by less than this is not called false [m, rad]."""

ANGLES = 24
"""Configurations at which each slice is sampled."""


def proof_fault(question: Document, answer: Document, slices: tuple[int, ...] | None, seed: int) -> str:
    """A statement of a proof that is surely false, empty if none was found.

    Args:
        question: The question's document.
        answer: The proof's document.
        slices: Slices whose witnesses or cells may be wrong; all of them if None.
        seed: Of the samples.
    """
    if not answer["component"] <= len(question["components"]):
        return "a point of no component"
    truth = _ProofTruth(question, answer, np.random.default_rng(seed))
    return truth.tiling() or truth.labels() or truth.witnesses(slices)


class _ProofTruth:
    def __init__(self, question: Document, answer: Document, random: np.random.Generator) -> None:
        self._question, self._answer, self._random = question, answer, random
        self._team, self._slices = Team(question), answer["slices"]
        self._limits = list(zip(question["lower"], question["upper"], strict=True))
        ends = zip(question["goal_lower"], question["goal_upper"], question["tolerances"][1:], strict=True)
        angles, *joints = [(low - room, high + room) for low, high, room in ends]
        within = zip(joints, self._limits, strict=True)
        self._goals = [angles, *[(max(a[0], b[0]), min(a[1], b[1])) for a, b in within]]
        self._component, self._centre = answer["component"], np.array(answer["point"])

    def tiling(self) -> str:
        """Boxes that leave the range, overlap, or are less than the range."""
        boxes = [list(zip(part["lower"], part["upper"], strict=True)) for part in self._slices]
        if not boxes or any(len(box) != 1 + len(self._limits) for box in boxes):
            return "slices have other axes than an angle and all joints"
        ends = min(box[0][0] for box in boxes), max(box[0][1] for box in boxes)
        if abs(ends[1] - ends[0] - tau) > SURELY:
            return "slices are not about a turn"
        whole = [ends, *self._limits]
        wide = [axis for axis, (low, high) in enumerate(whole) if low < high]
        for box in boxes:
            if any(low < least or high > most for (low, high), (least, most) in zip(box, whole, strict=True)):
                return "a slice leaves the range"
        for one, other in combinations(boxes, 2):
            if all(max(one[a][0], other[a][0]) < min(one[a][1], other[a][1]) for a in wide):
                return "slices overlap"
        volumes = [prod(_read(box[a][1]) - _read(box[a][0]) for a in wide) for box in boxes]
        if sum(volumes) != prod(_read(whole[a][1]) - _read(whole[a][0]) for a in wide):
            return "slices leave a gap"
        return ""

    def labels(self) -> str:
        """Cells that touch with two labels; a start that is not reached, a goal that is."""
        cells = [
            [(polygon_of(cell["polygon"]), cell["reached"]) for cell in part["cells"]]
            for part in self._slices
        ]
        for k, m in self._neighbours():
            for (one, first), (other, second) in product(cells[k], cells[m]):
                if first != second and one.intersects(other):
                    return "cells with two labels touch"
        start = np.array([self._question["start"]])
        goals = []
        for z in self._sampled(self._goals) if all(low <= high for low, high in self._goals) else ():
            room, turn = self._question["tolerances"][0], self._random.uniform(0.0, tau)
            away = room * float(self._random.choice([0.0, 0.7, 1.0])) * np.array([np.cos(turn), np.sin(turn)])
            goals.append(np.array([*(np.array(self._question["goal"]) + away), *z]))
        for z, wrong in [(start[0], False), *((z, True) for z in goals)]:
            for k, part in enumerate(self._slices):
                place = self._point(z)
                if self._holds(part, z[2:]) and any(
                    cell.buffer(-SURELY).covers(place) for cell, label in cells[k] if label == wrong
                ):
                    return "a cell with a wrong label holds the start or the goal"
        return ""

    def witnesses(self, chosen: tuple[int, ...] | None) -> str:
        """Polygons that leave their piece, points that are not in both, positions that nothing covers."""
        for k in range(len(self._slices)) if chosen is None else chosen:
            part = self._slices[k]
            angles = np.array(self._sampled(list(zip(part["lower"], part["upper"], strict=True))))
            fault = self._held(part, angles) or self._roomy(part, angles)
            if not fault and all(len(witness["pieces"]) == 1 for witness in part["witnesses"]):
                fault = self._uncovered(part)
            if fault:
                return fault
        return ""

    def _held(self, part: Document, angles: FloatArray) -> str:
        frames = self._frames(angles)
        for witness in part["witnesses"]:
            numbers, corners = tuple(witness["pieces"]), np.array(witness["polygon"])
            if not all(0 <= number < len(self._team.pieces) for number in numbers):
                return "a piece does not exist"
            if len(numbers) != 1 and numbers not in self._team.pairs:
                return "neither one piece nor two that must not meet"
            seen = frames[self._component if len(numbers) == 1 else witness["component"]]
            if len(numbers) == 1:
                points = [corners + p + _turn(self._centre, a) for p, a in zip(*seen, strict=True)]
            else:
                points = [_turn(corners, a) + p for p, a in zip(*seen, strict=True)]
            for piece in (self._team.pieces[number] for number in numbers):
                placed = zip(points, *frames[piece.component], strict=True)
                if _leaves(piece, np.concatenate([_turn(x - p, -a) for x, p, a in placed])):
                    return "a polygon leaves its piece"
        return ""

    def _frames(self, angles: FloatArray) -> list[tuple[FloatArray, FloatArray]]:
        """Origins and angles of all components for the angle of the proof's component and q; p_WL = 0."""
        at_zero = np.column_stack((np.zeros(len(angles)), angles[:, 1:]))
        theta = angles[:, 0] - self._team.frames(at_zero)[self._component][1]
        return self._team.frames(np.column_stack((theta, angles[:, 1:])))

    def _roomy(self, part: Document, angles: FloatArray) -> str:
        """Positions of a squeeze at which both discs are clear of all walls and of each other."""
        floor, frames = floor_of(self._question), self._frames(angles)
        seen = zip(*frames[self._component], strict=True)
        points = np.array([place + _turn(self._centre, angle) for place, angle in seen])
        for squeeze in part.get("squeezes", []):
            pieces = [self._team.pieces[number] for number in squeeze["pieces"]]
            centres = [self._centres(piece, frames) - points for piece in pieces]
            radii = [piece.radius + SURELY for piece in pieces]
            away = np.hypot(*(centres[1] - centres[0]).T) > sum(radii)
            polygon = shapely.MultiPoint(squeeze["polygon"]).convex_hull
            for p in positions_sampled(polygon, self._random, ANGLES):
                clear = away
                for about, radius in zip(centres, radii, strict=True):
                    far = shapely.distance(floor.boundary, shapely.points(about + p)) > radius
                    clear = clear & far & shapely.contains_xy(floor, about + p)
                if clear.any():
                    return "two discs have room where they are said to be squeezed"
        return ""

    @staticmethod
    def _centres(piece: Any, frames: list[tuple[FloatArray, FloatArray]]) -> FloatArray:
        """Places of a disc's centre, p_WL = 0, shape (N, 2) [m]."""
        corner, seen = shapely.get_coordinates(piece.hull)[0], zip(*frames[piece.component], strict=True)
        return np.array([place + _turn(corner, angle) for place, angle in seen])

    def _uncovered(self, part: Document) -> str:
        """Positions outside all cells that are not forbidden, or where cells of two labels would meet."""
        if not part["witnesses"]:
            return "nothing is shown to be blocked"
        floor = floor_of(self._question)
        rings = [self._question["floor"]["outer"], *self._question["floor"]["holes"]]
        walls = np.array([(a, b) for ring in rings for a, b in zip(ring, [*ring[1:], ring[0]], strict=True)])
        sums: list[NDArray[np.object_]] = []
        rest: BaseGeometry = floor.envelope.buffer(1e3)
        for witness in part["witnesses"]:
            ring = np.array(witness["polygon"])
            middle = ring.mean(axis=0)
            rest = rest.intersection(translate(floor, -middle[0], -middle[1]))
            copies = (walls[:, :, None, :] - ring).reshape(len(walls), -1, 2)
            sums.append(shapely.convex_hull(shapely.multipoints(copies)))
        squeezed = [shapely.MultiPoint(one["polygon"]).convex_hull for one in part.get("squeezes", [])]
        left = rest.difference(shapely.union_all([*np.concatenate(sums), *squeezed])).buffer(-SURELY)
        cells = [(polygon_of(cell["polygon"]), cell["reached"]) for cell in part["cells"]]
        if not left.difference(shapely.union_all([cell for cell, _ in cells])).buffer(-SURELY).is_empty:
            return "a position is neither in a cell nor shown to be blocked"
        return "cells of two labels all but touch" if self._parted(left, cells) else ""

    @staticmethod
    def _parted(left: BaseGeometry, cells: list[tuple[BaseGeometry, bool]]) -> bool:
        """Whether a disc holds points of two cells with two labels alone: they touch in it or leave a gap."""
        for i, j in combinations(range(len(cells)), 2):
            (one, first), (other, second) = cells[i], cells[j]
            if first != second and one.dwithin(other, SURELY):
                others = shapely.union_all([cell for k, (cell, _) in enumerate(cells) if k not in (i, j)])
                near = (
                    one.buffer(SURELY)
                    .intersection(other.buffer(SURELY))
                    .intersection(left.buffer(-3.0 * SURELY))
                )
                if not near.difference(others.buffer(4.0 * SURELY)).is_empty:
                    return True
        return False

    def _neighbours(self) -> Iterator[tuple[int, int]]:
        """Slices, and pairs of slices, with boxes that share a facet; theta modulo a turn."""
        low, high = (np.array([part[end] for part in self._slices]) for end in ("lower", "upper"))
        turn = high[:, 0].max() - low[:, 0].min()
        for k in range(len(self._slices)):
            yield k, k
            for by in (0.0, turn):
                ends, begins = high.copy(), low.copy()
                ends[:, 0], begins[:, 0] = ends[:, 0] + by, begins[:, 0] + by
                shared = np.minimum(high[k], ends) - np.maximum(low[k], begins)
                touch = (shared >= -1e-12).all(axis=1) & ((shared <= 1e-12).sum(axis=1) <= 1)
                yield from ((k, int(m)) for m in np.flatnonzero(touch))

    def _sampled(self, box: Any) -> list[list[float]]:
        lower, upper = np.array(box, dtype=float).reshape(-1, 2).T
        return [row.tolist() for row in boxes_sampled(lower, upper, self._random, ANGLES)]

    def _point(self, z: FloatArray) -> Point:
        """Where the point that a proof is about lies at a configuration."""
        (place,), (angle,) = self._team.frames(z[None, 2:])[self._component]
        return Point(z[:2] + place + _turn(self._centre, angle))

    def _holds(self, part: Document, angles: FloatArray) -> bool:
        low, high = np.array(part["lower"]), np.array(part["upper"])
        off = np.array(angles) - 0.5 * (low + high)
        (angle,) = self._team.frames(np.array(angles)[None])[self._component][1]
        off[0] = remainder(off[0] + angle - angles[0], tau)
        return bool((np.abs(off) <= 0.5 * (high - low)).all())


def _read(value: float) -> int:
    """A number as the format reads it, in units of 2^-80."""
    return round(Fraction(value) * 2**80)


def _turn(vectors: FloatArray, angle: float) -> FloatArray:
    c, s = np.cos(angle), np.sin(angle)
    return np.asarray(vectors @ np.array([[c, s], [-s, c]]))


def _leaves(piece: Any, points: FloatArray) -> bool:
    """Whether a point, in the piece's own frame, is surely outside it."""
    away: NDArray[np.float64] = shapely.distance(piece.hull, shapely.points(points))
    return bool((away > piece.radius + SURELY).any())

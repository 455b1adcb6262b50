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
)

__all__ = ["proof_fault"]

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
    whole = len(answer["slices"]) == 1 and answer.get("component", 0) < len(question["components"])
    if answer["kind"] == "disc" and not whole:
        return "a disc of no component, or with other slices than one"
    if answer["kind"] != "blocked goal" and any("cells" not in part for part in answer["slices"]):
        return "a slice says nothing of cells"
    truth = _ProofTruth(question, answer, np.random.default_rng(seed))
    return truth.tiling() or truth.labels() or truth.witnesses(slices)


class _ProofTruth:
    def __init__(self, question: Document, answer: Document, random: np.random.Generator) -> None:
        self._question, self._answer, self._random = question, answer, random
        self._team, self._slices = Team(question), answer["slices"]
        joints = sorted((c["joint"] for c in question["components"] if c["joint"]), key=lambda j: j["index"])
        robots = answer.get("robots", [])
        self._axes = [0, *[1 + k for k, joint in enumerate(joints) if joint["robot"] in robots]]
        self._limits = [(joint["lower"], joint["upper"]) for joint in joints]
        self._disc, self._blocked = answer["kind"] == "disc", answer["kind"] == "blocked goal"
        self._goals = [
            limits if goal is None else (goal, goal)
            for goal, limits in zip(question["goal_joints"], self._limits, strict=True)
        ]

    def tiling(self) -> str:
        """Boxes that leave the range, overlap, or are less than the range."""
        boxes = [list(zip(part["lower"], part["upper"], strict=True)) for part in self._slices]
        if not boxes or any(len(box) != len(self._axes) for box in boxes):
            return "slices have other axes than the kept joints"
        ends = min(box[0][0] for box in boxes), max(box[0][1] for box in boxes)
        if abs(ends[1] - ends[0] - (0.0 if self._blocked else tau)) > SURELY:
            return "slices are not about a turn, or about one angle"
        if self._blocked and abs(remainder(ends[0] - self._question["goal_pose"][2], tau)) > SURELY:
            return "slices are not about the goal's angle"
        joints = self._goals if self._blocked else self._limits
        whole = [ends, *[joints[axis - 1] for axis in self._axes[1:]]]
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
        if self._blocked:
            return ""
        cells = [
            [(polygon_of(cell["polygon"]), cell["reached"]) for cell in part["cells"]]
            for part in self._slices
        ]
        for k, m in self._neighbours():
            for (one, first), (other, second) in product(cells[k], cells[m]):
                if first != second and one.intersects(other):
                    return "cells with two labels touch"
        start = np.array([self._question["start"]])
        goals = np.array([[*self._question["goal_pose"], *q] for q in self._sampled(self._goals)])
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
            box = [tuple(limits) for limits in ((-np.pi, np.pi), *self._limits)]
            for axis, ends in zip(self._axes, zip(part["lower"], part["upper"], strict=True), strict=True):
                box[axis] = ends
            angles = np.array(self._sampled(box))
            fault = self._sweeps(part, angles) or self._overlaps(part, angles)
            if not fault and not part["overlaps"]:
                fault = self._uncovered(part)
            if fault:
                return fault
        return ""

    def _sweeps(self, part: Document, angles: FloatArray) -> str:
        for sweep in part["inner_sweeps"]:
            if not 0 <= sweep["piece"] < len(self._team.pieces):
                return "a piece does not exist"
            piece, corners = self._team.pieces[sweep["piece"]], np.array(sweep["polygon"])
            if self._disc:
                if piece.component != self._answer["component"]:
                    return "a piece of another component"
                centre = np.array(self._answer["centre"])
                turned = [_turn(corners, -angle) + centre for angle in np.linspace(0.0, tau, 3 * ANGLES)]
            else:
                if not set(self._team.axes[piece.component]) <= set(self._axes):
                    return "a piece that a joint moves which is not kept"
                frames = zip(*self._team.frames(angles)[piece.component], strict=True)
                turned = [_turn(corners - place, -angle) for place, angle in frames]
            if _leaves(piece, np.concatenate(turned)):
                return "a polygon leaves its piece"
        return ""

    def _overlaps(self, part: Document, angles: FloatArray) -> str:
        for overlap in part["overlaps"]:
            pair = tuple(overlap["pieces"])
            if pair not in self._team.pairs:
                return "two pieces that may meet"
            frames, pieces = self._team.frames(angles), [self._team.pieces[k] for k in pair]
            common = self._common(*(piece.component for piece in pieces))
            points = np.array(
                [_turn(np.array(overlap["point"]), a) + p for p, a in zip(*frames[common], strict=True)]
            )
            for piece in pieces:
                place, angle = frames[piece.component]
                here = np.array([_turn(x - p, -a) for x, p, a in zip(points, place, angle, strict=True)])
                if _leaves(piece, here):
                    return "a point is not in both pieces"
        return ""

    def _uncovered(self, part: Document) -> str:
        """Positions outside all cells that are not forbidden, or where cells of two labels would meet."""
        if not part["inner_sweeps"]:
            return "nothing is shown to be blocked"
        floor, goal = floor_of(self._question), Point(self._question["goal_pose"][:2])
        rings = [self._question["floor"]["outer"], *self._question["floor"]["holes"]]
        walls = np.array([(a, b) for ring in rings for a, b in zip(ring, [*ring[1:], ring[0]], strict=True)])
        sums: list[NDArray[np.object_]] = []
        rest: BaseGeometry = floor.envelope.buffer(1e3)
        for sweep in part["inner_sweeps"]:
            ring = np.array(sweep["polygon"])
            middle = ring.mean(axis=0)
            rest = rest.intersection(translate(floor, -middle[0], -middle[1]))
            copies = (walls[:, :, None, :] - ring).reshape(len(walls), -1, 2)
            sums.append(shapely.convex_hull(shapely.multipoints(copies)))
        left = rest.difference(shapely.union_all(np.concatenate(sums))).buffer(-SURELY)
        if self._blocked:
            return "the goal's position is not shown to be blocked" if left.covers(goal) else ""
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
        if not self._disc:
            return Point(z[:2])
        place, angle = self._team.frames(z[None, 2:])[self._answer["component"]]
        return Point(z[:2] + place[0] + _turn(np.array(self._answer["centre"]), angle[0]))

    def _holds(self, part: Document, angles: FloatArray) -> bool:
        low, high = np.array(part["lower"]), np.array(part["upper"])
        middle, off = 0.5 * (low + high), np.array(angles)[self._axes]
        off = off - middle
        off[0] = remainder(off[0], tau)
        return bool((np.abs(off) <= 0.5 * (high - low)).all())

    def _common(self, first: int, second: int) -> int:
        chains = []
        for k in (first, second):
            chains.append([k])
            while chains[-1][-1]:
                chains[-1].append(self._question["components"][chains[-1][-1]]["parent"])
        return max(set(chains[0]) & set(chains[1]))


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

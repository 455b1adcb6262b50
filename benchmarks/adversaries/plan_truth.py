"""Statements of a plan that are surely false, found with floating point, samples and room for rounding."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise
from math import dist, isclose, remainder, tau
from typing import Any

import numpy as np
import shapely
from shapely import LineString, Point

from benchmarks.adversaries.collisions import Document, Team, boxes_sampled, polygon_of, positions_sampled

SURELY = 1e-6
"""What is wrong by less than this, relative or in metres and radians, is not called false [-]."""

POSITIONS, ANGLES = 20, 12
"""Positions of each kind, and angles, at which cells are sampled."""

NARROWEST = 1e-9
"""Goal intervals that are narrower by far than this are no intervals [rad, m]."""


def plan_fault(question: Document, answer: Document, cells: Iterable[int] | None, seed: int) -> str:
    """A statement of a plan that is surely false, empty if none was found.

    Args:
        question: The question's document.
        answer: The plan's document.
        cells: The cells that may collide; all of them if None.
        seed: Of the samples.
    """
    count = len(answer["cells"])
    if not count or count != len(answer["transitions"]):
        return "cells and transitions differ in number"
    limits = list(zip(question["lower"], question["upper"], strict=True))
    for cell in answer["cells"]:
        ends = list(zip(cell["lower"], cell["upper"], strict=True))
        if any(low >= high for low, high in ends):
            return "an interval is empty"
        joints = zip(ends[1:], limits, strict=True)
        if any(low < least - SURELY or high > most + SURELY for (low, high), (least, most) in joints):
            return "a joint leaves its limits"
    return (
        _ends(question, answer) or _transitions(question, answer) or _collision(question, answer, cells, seed)
    )


def _ends(question: Document, answer: Document) -> str:
    first, last, start = answer["cells"][0], answer["transitions"][-1], question["start"]
    place = polygon_of(first["tidied"])
    if not all(
        low <= z <= high for low, z, high in zip(first["lower"], start[2:], first["upper"], strict=True)
    ):
        return "the start's angles lie outside"
    if not place.buffer(SURELY).contains(Point(start[:2])):
        return "the start lies outside"
    most, *rooms = question["tolerances"]
    if dist(last["target"], question["goal"]) + last["inradius"] > most + SURELY:
        return "the disc about the last target is beyond the tolerance"
    goals = zip(question["goal_lower"], question["goal_upper"], rooms, strict=True)
    for axis, (low, high, room) in enumerate(goals):
        for value in (last["goal_lower"][axis], last["goal_upper"][axis]):
            off = value - 0.5 * (low + high)
            if abs(off if axis else remainder(off, tau)) > 0.5 * (high - low) + room + SURELY:
                return "a goal interval is beyond the tolerance"
    return ""


def _transitions(question: Document, answer: Document) -> str:
    cells, entry = answer["cells"], question["start"][:2]
    regions = [polygon_of(cell["tidied"]) for cell in cells]
    for k, step in enumerate(answer["transitions"]):
        for axis, (low, high) in enumerate(zip(step["goal_lower"], step["goal_upper"], strict=True)):
            if high - low < 0.5 * NARROWEST:
                return "a goal interval is empty"
            if any(low < c["lower"][axis] or high > c["upper"][axis] for c in cells[k : k + 2]):
                return "a goal interval leaves a cell"
        path = step["path"]
        if len(path) < 2 or path[0] != entry or path[-1] != step["target"]:
            return "a path does not join its ends"
        if min(step["neck"], step["inradius"]) <= 0.0:
            return "a neck or an inradius is not positive"
        for region in regions[k : k + 2]:
            if _inside(region, Point(step["target"])) < step["inradius"] * (1.0 - SURELY):
                return "an inradius is too large"
        if min(_inside(regions[k], LineString(leg)) for leg in pairwise(path)) < step["neck"] * (
            1.0 - SURELY
        ):
            return "a neck is too large"
        if not isclose(step["length"], LineString(path).length, rel_tol=SURELY, abs_tol=SURELY):
            return "a length is not the path's"
        entry = step["target"]
    return ""


def _inside(region: Any, shape: Any) -> float:
    """Distance of a shape inside a region from its boundary, negative if it surely leaves it [m]."""
    distance = float(shapely.distance(region.boundary, shape))
    return distance if region.covers(shape) else -distance


def _collision(question: Document, answer: Document, cells: Iterable[int] | None, seed: int) -> str:
    random, team = np.random.default_rng(seed), Team(question)
    for k in range(len(answer["cells"])) if cells is None else cells:
        cell = answer["cells"][k]
        positions = positions_sampled(polygon_of(cell["tidied"]), random, POSITIONS)
        angles = boxes_sampled(np.array(cell["lower"]), np.array(cell["upper"]), random, ANGLES)
        z = np.column_stack((np.repeat(positions, len(angles), axis=0), np.tile(angles, (len(positions), 1))))
        if team.collides(z).any():
            return "a configuration of a cell collides"
    return ""

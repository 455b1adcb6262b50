"""The inscribed-disc relaxation: if a disc inside the team cannot get from start to goal, the team cannot."""

from __future__ import annotations

from collections.abc import Iterator
from math import cos, pi

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from coop_drake.answers.problem import PlanningProblem, goal_box
from coop_drake.answers.proof import InfeasibilityProof
from coop_drake.geometry.convex import normals
from coop_drake.geometry.minkowski import FreeSpace, to_polygon
from coop_drake.geometry.piece_sweeps import over_piece
from coop_drake.planning.cells.cells import regions_of
from coop_drake.planning.proofs.proof_making import disc_proof
from coop_drake.planning.proofs.witnesses import LEAST_LOSS
from coop_drake.planning.questions.margins import ARC_SEGMENTS
from coop_drake.planning.questions.relaxation import inscribed_disc
from coop_drake.tree.component_tree import ComponentTree, ConvexShape
from coop_drake.tree.pose import FloatArray

_DIRECTIONS = normals(np.arange(0.0, 32.0) * (pi / 16.0))
"""Corners of a regular polygon inside the unit disc, shape (32, 2) [-]: its radius is 0.5 % too small."""


def disc_refuted(problem: PlanningProblem) -> InfeasibilityProof | None:
    """Look for a disc inside one body whose centre cannot get from its start to its goal.

    That is so if start and goal lie in different connected parts of the positions at which the disc fits.

    Args:
        problem: The question, whose margin is zero.

    Returns:
        The proof, or None if no disc is separated from its goal.
    """
    space = FreeSpace.over(problem.workspace)
    for piece, component, disc in _discs(problem.tree):
        centre, radius = disc.vertices[0], disc.radius
        ring = radius * (1.0 - LEAST_LOSS) * _DIRECTIONS
        regions = regions_of(space.minus(ring), over=True)
        start = problem.tree.poses(problem.start)[component].apply(disc.vertices)[0]
        goals = _places(problem, component, centre)
        reached = [to_polygon(region.section) for region in regions if region.holds(start)]
        if not any(polygon.intersects(goals) for polygon in reached):
            found = disc_proof(problem.tree, component, centre, ring, piece, regions, start, goals)
            if found is not None:
                return found
    return None


def _discs(tree: ComponentTree) -> Iterator[tuple[int, int, ConvexShape]]:
    """For every convex piece its number, its component and the largest disc inside the piece."""
    number = -1
    for index, component in enumerate(tree.components):
        for body in component.bodies:
            for shape in body.shapes:
                disc, number = inscribed_disc(shape), number + 1
                if disc.radius > 0.0:
                    yield number, index, disc


def _places(problem: PlanningProblem, component: int, centre: FloatArray) -> BaseGeometry:
    """A convex polygon that holds all places in W where a point of a component can be at the goal."""
    tree, bounds = problem.tree, np.array(goal_box(problem))
    point = tree.arrays._replace(pieces=np.array([[component, 0, 1]]), vertices=centre[None, :].copy())
    ring = over_piece(
        point, 0, bounds[:, 0].copy(), bounds[:, 1].copy(), len(tree.ancestors[component]), False
    )
    places = shapely.MultiPoint(ring + problem.goal_pose[:2]).convex_hull
    return places.buffer(problem.position_tolerance / cos(pi / (4.0 * ARC_SEGMENTS)), quad_segs=ARC_SEGMENTS)

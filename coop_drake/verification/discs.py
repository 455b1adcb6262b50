"""Check that a disc inside one component cannot get from the start to the goal, nor can the team then."""

from __future__ import annotations

import numpy as np
import shapely
from shapely import MultiPoint, Point, Polygon
from shapely.geometry.base import BaseGeometry

from coop_drake.answers.problem import PlanningProblem
from coop_drake.answers.proof import DiscProof
from coop_drake.errors import RefusalError
from coop_drake.tree.component_tree import ConvexShape
from coop_drake.tree.pose import FloatArray
from coop_drake.verification.checks import Check
from coop_drake.verification.covers import check_near_floor, uncovered
from coop_drake.verification.floor_edges import floor_edges
from coop_drake.verification.free_positions import fitting_positions, without_slivers
from coop_drake.verification.inner_sweeps import inscribed_circle
from coop_drake.verification.outer_sweeps import outer_sweep
from coop_drake.verification.problem_match import goal_box
from coop_drake.verification.reachability import TOUCHING, check_labels
from coop_drake.verification.solids import Solid, component_stages

__all__ = ["check_disc"]

ROUNDING = 1e-9
"""A disc may leave its body by this, and is made smaller by twice as much [m]."""

SWEEP = 1e-6
"""How far the region of the centre at the goal may be too large, where a joint is free there [m]."""


def check_disc(proof: DiscProof, problem: PlanningProblem) -> tuple[Check, ...]:
    """Check a proof by one disc.

    Wherever the team is free, the disc, a part of one of its bodies, lies on the floor. The positions of its
    centre at which it does are covered by the cells; touching ones do not lead from start to goal.

    Args:
        proof: The proof.
        problem: The problem.

    Raises:
        RefusalError: The disc leaves its body, a free position is not covered, or start and goal are joined.
    """
    centre, radius = proof.centre, proof.radius
    clearance = _check_inside(proof, problem)
    edges = floor_edges(problem.workspace)
    cells = [cell.polygon for cell in proof.cells]
    check_near_floor(cells, problem, "cells")
    cover = shapely.union_all(cells)

    def outside(tolerance: float) -> BaseGeometry:
        circle = inscribed_circle(radius - 2.0 * ROUNDING, tolerance)
        fits = fitting_positions(edges, circle, problem.workspace.envelope)
        return without_slivers(fits.difference(cover), cover, ROUNDING)

    rest, tolerance = uncovered(outside)
    if not rest.is_empty:
        point = rest.representative_point()
        raise RefusalError("cells", f"none covers ({point.x:.6f}, {point.y:.6f}), where the disc may fit")
    start = _places(proof, problem, problem.start[2:], problem.start[2:], problem.start[:2])
    goal = _places(proof, problem, *goal_box(problem), problem.goal_pose[:2])
    names = [f"cells[{k}]" for k in range(len(cells))]
    pairs = np.array(
        [(i, j) for j in range(len(cells)) for i in range(j) if cells[i].dwithin(cells[j], TOUCHING)]
    )
    at_start, at_goal = (
        {k for k, cell in enumerate(cells) if cell.dwithin(end, TOUCHING)} for end in (start, goal)
    )
    labels = [cell.reached for cell in proof.cells]
    where = f"({centre[0]:.4f}, {centre[1]:.4f})"
    return (
        Check(f"the disc about {where} lies inside its body", 1, clearance, "m to the body's boundary"),
        Check("cells hold all places where the disc may fit", len(cells), tolerance, "m, finest disc needed"),
        check_labels(labels, names, pairs.reshape(-1, 2), at_start, at_goal),
    )


def _check_inside(proof: DiscProof, problem: PlanningProblem) -> float:
    """Clearance between the disc and the boundary of that shape which holds it best [m]."""
    components = problem.tree.components
    if proof.component >= len(components):
        raise RefusalError("component", f"{proof.component} is not below {len(components)}")
    shapes = [shape for body in components[proof.component].bodies for shape in body.shapes]
    best = max((_depth(shape, proof.centre) - proof.radius for shape in shapes), default=-np.inf)
    if best < -ROUNDING:
        raise RefusalError("radius", f"the disc leaves every shape of its component by {-best} m or more")
    return best


def _depth(shape: ConvexShape, point: FloatArray) -> float:
    """Signed distance of a point from the boundary of a shape, positive inside [m]."""
    hull = MultiPoint(shape.vertices).convex_hull
    place = Point(point)
    if isinstance(hull, Polygon) and hull.contains(place):
        return float(hull.exterior.distance(place)) + shape.radius
    return shape.radius - float(hull.distance(place))


def _places(
    proof: DiscProof, problem: PlanningProblem, lower: FloatArray, upper: FloatArray, position: FloatArray
) -> BaseGeometry:
    """Convex region of W that holds the centre at all (theta, q...) between two ends, shape (1 + n,) each."""
    stages = component_stages(problem.tree, proof.component)
    point = Solid("", proof.component, 0, proof.centre[None, :], 0.0, stages)
    places: BaseGeometry = MultiPoint(position + outer_sweep(point, lower, upper, SWEEP)).convex_hull
    return places

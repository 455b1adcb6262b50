"""Whether a disc inside one component cannot get from the start to the goal."""

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
from coop_drake.verification.covers import uncovered
from coop_drake.verification.inner_sweeps import inscribed_circle
from coop_drake.verification.labels import check_spread
from coop_drake.verification.may_be_free import fitting_positions, without_slivers
from coop_drake.verification.outer_sweeps import outer_sweep
from coop_drake.verification.solids import Solid, component_stages
from coop_drake.verification.walls import wall_edges

__all__ = ["check_disc"]

ROUNDING = 1e-9
"""A disc may stand out of its body by this, and is taken smaller by as much [m]."""

SWEEP = 1e-6
"""How far the goal's places may be taken too wide where a joint is free there [m]."""


def check_disc(proof: DiscProof, problem: PlanningProblem) -> tuple[Check, ...]:
    """Check a proof by one disc.

    Args:
        proof: The proof.
        problem: The question.

    Raises:
        RefusalError: The disc leaves its body, a free position is not covered, or start and goal are joined.
    """
    centre, radius = proof.centre, proof.radius
    room = _check_inside(proof, problem)
    walls = wall_edges(problem.workspace)

    cells = [cell.polygon for cell in proof.cells]
    cover = shapely.union_all(cells)

    def outside(tolerance: float) -> BaseGeometry:
        circle = inscribed_circle(radius - 2.0 * ROUNDING, tolerance)
        fits = fitting_positions(walls, circle, problem.workspace.envelope)
        return without_slivers(fits.difference(cover), cover, ROUNDING)

    rest, tolerance = uncovered(outside)
    if not rest.is_empty:
        point = rest.representative_point()
        raise RefusalError("cells", f"none covers ({point.x:.6f}, {point.y:.6f}), where the disc may fit")
    start = _places(proof, problem, problem.start[2:], problem.start[2:], problem.start[:2])
    goal = _goal(proof, problem)
    names = [f"cells[{k}]" for k in range(len(cells))]
    pairs = np.array([(i, j) for j in range(len(cells)) for i in range(j) if cells[i].intersects(cells[j])])
    at_start, at_goal = ({k for k, cell in enumerate(cells) if cell.intersects(end)} for end in (start, goal))
    labels = [cell.reached for cell in proof.cells]
    check_spread(labels, names, pairs.reshape(-1, 2), at_start, at_goal)
    where = f"({centre[0]:.4f}, {centre[1]:.4f})"
    return (
        Check(f"the disc about {where} lies inside its body", 1, room, "m to the body's boundary"),
        Check("cells hold all places where the disc may fit", len(cells), tolerance, "m, finest disc needed"),
        Check("the start is in reached cells, the goal in none", len(at_start) + len(at_goal)),
    )


def _check_inside(proof: DiscProof, problem: PlanningProblem) -> float:
    """Room between the disc and the boundary of the one shape that holds it best [m]."""
    components = problem.tree.components
    if proof.component >= len(components):
        raise RefusalError("component", f"{proof.component} is not below {len(components)}")
    shapes = [shape for body in components[proof.component].bodies for shape in body.shapes]
    rooms = [_depth(shape, proof.centre) - proof.radius for shape in shapes]
    best = max(rooms, default=-np.inf)
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


def _goal(proof: DiscProof, problem: PlanningProblem) -> BaseGeometry:
    """All places where the centre may be at the goal, free joints anywhere in their limits."""
    ends = [(float(problem.goal_pose[2]),) * 2]
    for joint, goal in zip(problem.tree.joints, problem.goal_joints, strict=True):
        ends.append((joint.lower, joint.upper) if goal is None else (goal, goal))
    lower, upper = np.array(ends).T
    return _places(proof, problem, lower, upper, problem.goal_pose[:2])


def _places(
    proof: DiscProof,
    problem: PlanningProblem,
    lower: FloatArray,
    upper: FloatArray,
    position: FloatArray,
) -> BaseGeometry:
    """Hull of the places in W where the centre may be over intervals of (theta, q...)."""
    stages = component_stages(problem.tree, proof.component)
    point = Solid("", proof.component, 0, proof.centre[None, :], 0.0, stages)
    places: BaseGeometry = MultiPoint(position + outer_sweep(point, lower, upper, SWEEP)).convex_hull
    return places

"""Changes of the team or of the goal that would help."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from math import pi

import numpy as np
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from coop_drake.answers import PlanningProblem
from coop_drake.diagnosis.variants import Amounts, Answer, Bracket, BudgetedPlanner, Outcome, bracketed
from coop_drake.planning.sampling.narrow_passages import (
    Eased,
    amount_needed,
    are_free,
    ease_less,
    with_larger_least_clearance,
)
from coop_drake.tree.component_tree import Body, ComponentTree, ConvexShape, TreeJoint
from coop_drake.tree.pose import FloatArray

# Builds changed copies of a team: with smaller bodies, or with wider joint limits.

SLIDE_PER_RADIAN = 0.25
"""Widening of a prismatic joint for every radian of a revolute one: the length of a short link [m/rad]."""


def base_bodies(tree: ComponentTree) -> frozenset[str]:
    """Names of the bases: of every robot the largest body of the components that carry no other one."""
    parents = {component.parent for component in tree.components}
    names = []
    for robot in sorted({joint.robot for joint in tree.joints}):
        bodies = [
            body
            for index, component in enumerate(tree.components)
            for body in component.bodies
            if body.robot == robot and index > 0 and index not in parents
        ]
        if bodies:
            names.append(max(bodies, key=lambda body: float(_outline(body).area)).name)
    return frozenset(names)


def object_bodies(tree: ComponentTree) -> frozenset[str]:
    """Names of the object's own bodies."""
    return frozenset(body.name for body in tree.components[0].bodies if body.robot is None)


def shrunk_bodies(tree: ComponentTree, names: Collection[str], factor: float) -> ComponentTree:
    """Scale some bodies by a factor up to 1 about a point of their footprint; joints and grasps stay.

    The point is the centroid of the convex hull if all of the footprint is visible from there, else the
    centroid of the footprint's kernel, the set of points from which all of it is visible.
    """
    components = tuple(
        replace(
            component,
            bodies=tuple(_scaled(body, factor) if body.name in names else body for body in component.bodies),
        )
        for component in tree.components
    )
    return ComponentTree(components, tree.unchecked_pairs)


def shrink_into_themselves(tree: ComponentTree, names: Collection[str]) -> bool:
    """Whether smaller copies of some bodies lie inside larger ones; a U's, for instance, do not."""
    bodies = [body for component in tree.components for body in component.bodies if body.name in names]
    return not any(_kernel(_outline(body)).is_empty for body in bodies)


def widened_joints(tree: ComponentTree, amount: float) -> ComponentTree:
    """Move both limits of every joint outwards [rad]; a revolute joint never gets more than a whole turn.

    Prismatic joints get 0.25 m for every radian; joints without limits stay as they are.
    """
    components = tuple(
        component if component.joint is None else replace(component, joint=_widened(component.joint, amount))
        for component in tree.components
    )
    return ComponentTree(components, tree.unchecked_pairs)


def _widened(joint: TreeJoint, amount: float) -> TreeJoint:
    if joint.circular:
        return joint
    if joint.kind == "prismatic":
        slide = SLIDE_PER_RADIAN * amount
        return replace(joint, lower=joint.lower - slide, upper=joint.upper + slide)
    turn = min(amount, max(0.0, pi - 0.5 * (joint.upper - joint.lower)))
    return replace(joint, lower=joint.lower - turn, upper=joint.upper + turn)


def _outline(body: Body) -> BaseGeometry:
    return shapely.union_all(
        [shapely.MultiPoint(s.vertices).convex_hull.buffer(s.radius) for s in body.shapes]
    )


def _kernel(outline: BaseGeometry) -> BaseGeometry:
    """Points from which all of an outline is visible: those to the left of all its edges."""
    if not isinstance(outline, Polygon) or outline.interiors:
        return Polygon()
    kernel: BaseGeometry = outline.convex_hull
    corners = shapely.get_coordinates(shapely.orient_polygons(outline))
    reach = 4.0 * float(np.hypot(*np.ptp(corners, axis=0)))
    for first, last in pairwise(corners):
        x, y = reach * (last - first) / np.hypot(*(last - first))
        left = np.array([[-x, -y], [x, y], [x - y, y + x], [-x - y, -y + x]])
        kernel = kernel.intersection(Polygon(first + left))
    return kernel


def _middle(outline: BaseGeometry) -> FloatArray:
    """The point about which an outline is scaled, shape (2,) [m]."""
    centre, kernel = outline.convex_hull.centroid, _kernel(outline)
    place = centre if kernel.is_empty or kernel.covers(centre) else kernel.centroid
    middle: FloatArray = shapely.get_coordinates(place)[0]
    return middle


def _scaled(body: Body, factor: float) -> Body:
    middle = _middle(_outline(body))
    shapes = tuple(
        ConvexShape(middle + factor * (shape.vertices - middle), factor * shape.radius)
        for shape in body.shapes
    )
    return replace(body, shapes=shapes)


# Smaller changes that are enough for a path near the one found: move the path, and prove it free again.

FRACTIONS = (0.1, 0.25, 0.5)
"""A proof is tried at these fractions of the way from the amount that a path needs to the amount that is
known to be enough [-]."""

ROUNDS = 4
"""Paths that are moved and proved one after another [-]."""

MOVES = 6
"""Times that a stretch of a path is moved away from the walls [-]."""

WINDOW = 40
"""Samples on either side of a colliding stretch that are moved with it [-]."""

NO_PROGRESS = 0.25
"""Less than this fraction of the resolution is no progress [-]."""


def least_change(
    eased: Eased, amount: float, outcome: Outcome, planner: BudgetedPlanner, resolution: float
) -> tuple[float, Outcome]:
    """Look for a smaller change that is enough for a path near the one found with an amount.

    ``resolution``: how closely the amount is looked for.

    Returns:
        The smallest amount with which such a path was proved free, and its outcome.
    """
    least = NO_PROGRESS * resolution
    for _ in range(ROUNDS):
        if outcome.path is None or amount <= resolution:
            break
        path, needed = ease_less(eased, outcome.path, amount, least)
        for fraction in FRACTIONS:
            less = needed + fraction * (amount - needed)
            if amount - less > least:
                proved = planner.prove(eased(less), path)
                if proved.answer is Answer.FOUND:
                    amount, outcome = less, proved
                    break
        else:
            break
    return amount, outcome


def clear_elsewhere(eased: Eased, path: FloatArray, enough: float) -> FloatArray:
    """Move a path off the walls wherever it need not leave the floor; the place where it leaves most stays.

    The path, shape (m, 3 + n), is free with the walls moved back by the amount ``enough`` [m].
    """
    floor = eased(0.0)
    _, worst = amount_needed(eased, path, enough)
    for rows in _blocked_runs(floor, path):
        if rows[0] <= worst <= rows[-1]:
            continue
        first, last = max(0, rows[0] - WINDOW), min(len(path) - 1, rows[-1] + WINDOW)
        first, last = (max(first, worst + 1), last) if worst < rows[0] else (first, min(last, worst - 1))
        if last - first < 2:
            continue
        here, ends = slice(first, last + 1), last == len(path) - 1
        for number in range(MOVES):
            needed, _ = amount_needed(eased, path[here], enough)
            part = with_larger_least_clearance(eased(needed), path[here], number, free_end=ends)
            if amount_needed(eased, part, enough)[0] <= needed:
                path = np.concatenate((path[:first], part, path[last + 1 :]))
            if are_free(floor, path[here]).all():
                break
    return path


def _blocked_runs(problem: PlanningProblem, path: FloatArray) -> list[tuple[int, int]]:
    """First and last rows of the runs of samples that are not free."""
    free = are_free(problem, path)
    edges = np.flatnonzero(np.diff(np.concatenate(([1], free.astype(np.int8), [1]))))
    return [(int(a), int(b) - 1) for a, b in zip(edges[::2], edges[1::2], strict=True)]


# Changes to the team that may make a problem feasible, each alone and by as little as is found enough.

MOST_SHRINKAGE, SHRINKAGE_RESOLUTION = 0.7, 0.02
"""Bodies are made smaller by up to this fraction of their size, looked for this closely [-]."""

MOST_WIDENING, WIDENING_RESOLUTION = pi / 2, 0.05
"""Joint ranges are widened by up to this at either limit, looked for this closely [rad]."""

ASKED = 5
"""Amounts of one change that are tried at most [-]."""


@dataclass(frozen=True)
class TeamChange:
    """One kind of change to the team.

    Attributes:
        name: What it is called.
        unit: Unit of its amounts: ``share``, a fraction of all lengths of a body, or ``rad`` at either limit.
        tree: The team with an amount of the change.
        most: Largest amount tried.
        resolution: How closely the least amount is looked for.
        monotone: Whether what is free for an amount is free for every larger one.
    """

    name: str
    unit: str
    tree: Callable[[float], ComponentTree]
    most: float
    resolution: float
    monotone: bool = True


@dataclass(frozen=True)
class Relaxation:
    """What was computed about one change alone.

    Attributes:
        change: The change.
        bracket: Amounts proved not to be enough and found to be enough.
    """

    change: TeamChange
    bracket: Bracket

    @property
    def never_enough(self) -> bool:
        """Whether no amount up to the largest tried is enough, proved."""
        return self.change.monotone and self.bracket.is_refuted


def changes(tree: ComponentTree) -> list[TeamChange]:
    """The changes that make sense for a team."""

    def shrinking(name: str, bodies: frozenset[str]) -> TeamChange:
        return TeamChange(
            name,
            "share",
            lambda amount: shrunk_bodies(tree, bodies, 1.0 - amount),
            MOST_SHRINKAGE,
            SHRINKAGE_RESOLUTION,
            shrink_into_themselves(tree, bodies),
        )

    kinds = (("smaller bases", base_bodies(tree)), ("smaller object", object_bodies(tree)))
    listed = [shrinking(name, bodies) for name, bodies in kinds if bodies]
    if not all(joint.circular for joint in tree.joints):
        name, wider = "wider joint range", partial(widened_joints, tree)
        listed.append(TeamChange(name, "rad", wider, MOST_WIDENING, WIDENING_RESOLUTION))
    return listed


def try_changes(problem: PlanningProblem, planner: BudgetedPlanner, *, refuted: bool) -> list[Relaxation]:
    """Bracket every change alone; the largest amount comes first, as most changes do not help at all.

    ``refuted``: whether the problem was proved infeasible as it is.
    """
    return [
        Relaxation(change, _bracket(problem, change, planner, 0.0 if refuted else None))
        for change in changes(problem.tree)
    ]


def _bracket(
    problem: PlanningProblem, change: TeamChange, planner: BudgetedPlanner, refuted: float | None
) -> Bracket:
    def eased(amount: float) -> PlanningProblem:
        return replace(problem, tree=change.tree(amount))

    def improve(amount: float, outcome: Outcome) -> tuple[float, Outcome]:
        return least_change(eased, amount, outcome, planner, change.resolution)

    return bracketed(
        lambda amount: planner.ask(eased(amount), change.name),
        Amounts(change.most, change.most, change.resolution, asked=ASKED),
        refuted=refuted,
        improve=improve,
    )

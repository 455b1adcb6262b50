"""Why there is no plan: what is found, in which order it is looked for, and changes that would help."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from math import pi

import numpy as np
import shapely
from scipy.stats import qmc
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from coop_drake.answers import PlanningProblem
from coop_drake.answers.plan import MixedCell
from coop_drake.answers.problem import at_goal
from coop_drake.diagnosis.contacts import Contact, Overlap, contacts, deepest, overlaps
from coop_drake.diagnosis.variants import (
    Amounts,
    Answer,
    BlockingPassage,
    Bracket,
    BudgetedPlanner,
    OpenFloor,
    Outcome,
    UniformWidening,
    WidenedFloor,
    blocking_passages,
    bracketed,
    on_open_floor,
)
from coop_drake.planning import Channel, find_channel
from coop_drake.planning.proofs import blocked_goal
from coop_drake.planning.sampling.narrow_passages import (
    Eased,
    amount_needed,
    are_free,
    ease_less,
    with_larger_least_clearance,
)
from coop_drake.progress import Progress
from coop_drake.tree.arrays import FloatArray
from coop_drake.tree.component_tree import Body, ComponentTree, ConvexShape, TreeJoint

# Changes of the team or of the goal that would help.

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


# Why there is no plan: what is found, in which order it is looked for.

# The findings of a diagnosis: plain data, all of it computed.


@dataclass(frozen=True)
class PassageFindings:
    """What blocks every path from start to goal.

    Attributes:
        widening: How far every wall must move back [m].
        path: A path on the floor that is wider by so much, shape (m, 3 + n), None if there is none.
        needed: How far that path leaves the floor as it is, at its configurations, not proved [m].
        passages: The passages that block, in the order of the path.
        are_enough: Whether a channel was found with only these passages widened.
        open_floor: What is known without walls, where no widening was enough.
    """

    widening: Bracket
    path: FloatArray | None = None
    needed: float | None = None
    passages: tuple[BlockingPassage, ...] = ()
    are_enough: bool = False
    open_floor: OpenFloor | None = None


@dataclass(frozen=True)
class BlockedPose:
    """A goal at which the team collides whatever its free joints.

    Attributes:
        configuration: The configuration at the goal with the least collision of those tried, shape (3 + n,).
        contacts: Which bodies leave the floor there.
        overlaps: Bodies that overlap there.
        widening: How far every wall must move back for the team to be free at the goal [m].
    """

    configuration: FloatArray
    contacts: tuple[Contact, ...]
    overlaps: tuple[Overlap, ...]
    widening: Bracket


@dataclass(frozen=True)
class Diagnosis:
    """Why there is no plan, or that there is one.

    Attributes:
        answer: What the planner answers to the problem as it is.
        reason: Its reason in a sentence, empty if it found a channel.
        passages: What blocks every path, None if nothing does or the goal itself is blocked.
        goal: What blocks the goal, None if nothing does.
        relaxations: Changes to the team that were tried.
        mixed: For an undecided problem the cells neither proved free nor blocked, the widest first.
        slices: Slices that the whole diagnosis took.
    """

    answer: Answer
    reason: str
    passages: PassageFindings | None = None
    goal: BlockedPose | None = None
    relaxations: tuple[Relaxation, ...] = ()
    mixed: tuple[MixedCell, ...] = ()
    slices: int = 0


# What collides at a goal that is blocked whatever the free joints: bodies, walls, depths.

TRIED = 256
"""Values of the free joints that are tried, spread evenly over their limits [-]."""

REFINED = 120
"""Configurations that are tried near the best of these [-]."""

STEPS = (0.1, 1e-3)
"""First and smallest step of a joint in these [rad or m]."""

FIRST_AT_GOAL, RESOLUTION_AT_GOAL = 0.02, 0.002
"""First distance by which walls are moved back, and how closely the least one is looked for [m]."""


def blocked_pose(problem: PlanningProblem, floor: WidenedFloor, planner: BudgetedPlanner) -> BlockedPose:
    """Say what collides at the goal, and how far the walls must move back.

    The configuration shown has the least collision of those tried. That walls moved back by some distance are
    not enough is proved by the same sweeps that proved the goal to be blocked.
    """
    z = _least_collision(problem)

    def ask(amount: float) -> Outcome:
        grown = replace(problem, workspace=floor.everywhere(amount))
        blocked, slices = blocked_goal(grown)
        planner.spent += slices
        if blocked:
            return Outcome(Answer.INFEASIBLE)
        free = _worst(grown, _least_collision(grown)) <= 0.0
        return Outcome(Answer.FOUND if free else Answer.UNDECIDED)

    touched = tuple(contacts(problem.workspace, problem.tree, z))
    bracket = bracketed(ask, Amounts(FIRST_AT_GOAL, floor.most, RESOLUTION_AT_GOAL))
    return BlockedPose(z, touched, tuple(overlaps(problem.tree, z)), bracket)


def _worst(problem: PlanningProblem, z: FloatArray) -> float:
    """Depth of the deepest contact or overlap [m]."""
    found: list[Contact | Overlap] = [
        *contacts(problem.workspace, problem.tree, z),
        *overlaps(problem.tree, z),
    ]
    return max((fault.depth for fault in found), default=0.0)


def _least_collision(problem: PlanningProblem) -> FloatArray:
    """The configuration at the goal with the least collision of those tried; ties go to the first."""
    joints = problem.tree.joints
    free = [joint.index for joint in joints if problem.goal_joints[joint.index] is None]
    z = at_goal(problem.goal_pose, problem.goal_joints, 0.0)
    if not free:
        return z
    lower, upper = problem.tree.range_lower[free], problem.tree.range_upper[free]
    columns = [3 + index for index in free]
    spread = qmc.Halton(len(free), scramble=False).random(TRIED)
    tried = []
    for fraction in spread:
        candidate = z.copy()
        candidate[columns] = lower + fraction * (upper - lower)
        tried.append((_worst(problem, candidate), candidate))
    return _refined(problem, *min(tried, key=lambda entry: entry[0]), columns)


def _refined(problem: PlanningProblem, cost: float, z: FloatArray, columns: list[int]) -> FloatArray:
    """Move joints one by one, with steps that are halved whenever no joint helps."""
    lower, upper = problem.tree.joint_lower, problem.tree.joint_upper
    (step, smallest), asked = STEPS, 0
    while asked < REFINED and cost > 0.0 and step > smallest:
        before = cost
        for column in columns:
            for sign in (-1.0, 1.0):
                other = z.copy()
                other[column] = np.clip(z[column] + sign * step, lower[column - 3], upper[column - 3])
                asked += 1
                here = _worst(problem, other)
                if here < cost:
                    cost, z = here, other
        if cost >= before:
            step *= 0.5
    return z


# The diagnosis: plan; move the walls back until there is a path; see where it collides; change the team.

SLICES = 120
"""Budget of every variant [slices]: most have their answer within some dozens."""

TOTAL = 30_000
"""Budget of a whole diagnosis [slices]: some minutes."""

FIRST = 0.05
"""First distance by which the walls are moved back [m]."""

LARGEST = 0.5
"""Largest distance by which the walls are moved back, in units of the team's reach [-]."""

RESOLUTION = 0.0025
"""The distance is bracketed to this [m]."""

ASKED_AT_GOAL = 6
"""Distances that are tried at most [-]."""


def diagnose(problem: PlanningProblem, progress: Progress | None = None) -> Diagnosis:
    """Say why no plan exists or none was found, and what would help; the same for the same problem.

    Amounts of a change that are too little rest on proofs of the planner, amounts that are enough on channels
    that it proved free. What is said about bodies and angles is read off one path and proves nothing.
    """
    answer, report = find_channel(problem, progress)
    if isinstance(answer, Channel):
        return Diagnosis(Answer.FOUND, "", slices=report.slices)
    planner = BudgetedPlanner(SLICES, TOTAL, progress)
    known = Answer.INFEASIBLE if answer.proved else Answer.UNDECIDED
    made = Diagnosis(known, answer.reason, mixed=answer.mixed)
    floor = WidenedFloor(problem.workspace, problem.start[:2], LARGEST * problem.tree.reach)
    if answer.proof is not None and answer.proof.kind == "blocked goal":
        made = replace(made, goal=blocked_pose(problem, floor, planner))
    else:
        made = replace(made, passages=find_passages(problem, floor, planner, refuted=answer.proved))
    relaxations = tuple(try_changes(problem, planner, refuted=answer.proved))
    return replace(made, relaxations=relaxations, slices=report.slices + planner.spent)


def find_passages(
    problem: PlanningProblem, floor: WidenedFloor, planner: BudgetedPlanner, *, refuted: bool
) -> PassageFindings:
    """Move all walls back until there is a path, and find where that path leaves the original floor.

    ``refuted``: whether the problem was proved infeasible as it is.
    """

    def eased(amount: float) -> PlanningProblem:
        return replace(problem, workspace=floor.everywhere(amount))

    def improve(amount: float, outcome: Outcome) -> tuple[float, Outcome]:
        return least_change(eased, amount, outcome, planner, RESOLUTION)

    bracket = bracketed(
        lambda amount: planner.ask(eased(amount), "moving the walls back"),
        Amounts(FIRST, floor.most, RESOLUTION, asked=ASKED_AT_GOAL),
        refuted=0.0 if refuted else None,
        improve=improve,
    )
    if bracket.found is None or bracket.outcome is None:
        return PassageFindings(bracket, open_floor=on_open_floor(problem, planner))
    if bracket.outcome.path is None:
        return PassageFindings(bracket)
    path = clear_elsewhere(eased, bracket.outcome.path, bracket.found)
    needed = max(deepest(problem.workspace, problem.tree, z) for z in path)
    everywhere = UniformWidening(bracket.refuted, bracket.found, path, needed)
    passages, enough = blocking_passages(problem, floor, everywhere, planner)
    return PassageFindings(bracket, path, needed, tuple(passages), enough)

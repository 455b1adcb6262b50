"""Why there is no plan: what is found, in which order it is looked for."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import qmc

from coop_drake.answers import PlanningProblem
from coop_drake.answers.plan import MixedCell
from coop_drake.answers.problem import at_goal
from coop_drake.diagnosis.changes import Relaxation, clear_elsewhere, least_change, try_changes
from coop_drake.diagnosis.contacts import Contact, Overlap, contacts, deepest, overlaps
from coop_drake.diagnosis.variants import (
    Amounts,
    Answer,
    Bracket,
    BudgetedPlanner,
    OpenFloor,
    Outcome,
    bracketed,
    on_open_floor,
)
from coop_drake.diagnosis.widening import BlockingPassage, UniformWidening, WidenedFloor, blocking_passages
from coop_drake.planning import Channel, find_channel
from coop_drake.planning.blocked_goal import blocked_goal
from coop_drake.progress import Progress
from coop_drake.tree.pose import FloatArray

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
            return Outcome(grown, Answer.INFEASIBLE)
        free = _worst(grown, _least_collision(grown)) <= 0.0
        return Outcome(grown, Answer.FOUND if free else Answer.UNDECIDED)

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

ASKED = 6
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
        Amounts(FIRST, floor.most, RESOLUTION, asked=ASKED),
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

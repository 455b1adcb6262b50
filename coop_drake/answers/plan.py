"""The planner's answers: a plan of cells and transitions, within limits or not, a proof, or neither.

The fields of what is written to files stand in the order of the files; their types are checked when read.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import isclose, remainder, tau
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from shapely import Point, Polygon

from coop_drake.answers.budget import Budget, Departures
from coop_drake.answers.document import (
    Document,
    Points,
    Region,
    content_digest,
    problem_digest,
    write_document,
)
from coop_drake.answers.motion import Motion
from coop_drake.answers.problem import PlanningProblem
from coop_drake.answers.proof import InfeasibilityProof
from coop_drake.errors import PlanError
from coop_drake.laws.gains import GainSet, ScheduledGains, TransitionGains
from coop_drake.tree.arrays import FloatArray
from coop_drake.typed_data import EXACT, Bounds, Limits, NotNegative, Number, Positive, Vector, to_plain

if TYPE_CHECKING:
    from coop_drake.laws.ppc import Funnel

# The work that a search did before it answered.


@dataclass(frozen=True)
class SearchReport:
    """The work of a search.

    Attributes:
        slices: Compound slices swept, all attempts together: those of explorations and the boxes that were
            tried along sampled paths.
        first_plan_cpu_seconds: Processor time until a channel was certified, whatever its margin, None if
            none was [s]. It decides nothing and makes no difference between reports.
        improvements: Processor time from the question to each plan that was the quickest so far, and its
            estimated duration, in the order found [s]. Not compared either.
    """

    slices: int
    first_plan_cpu_seconds: float | None = field(default=None, compare=False)
    improvements: tuple[tuple[float, float], ...] = field(default=(), compare=False)


# What an exploration left undecided on its last channel.


@dataclass(frozen=True)
class MixedCell:
    """A set of configurations of which neither freedom nor collision was proved.

    Attributes:
        robots: Robots that take part; the axes are theta and the joints of these robots in the order of q.
        lower: Lower ends of the nominal intervals, shape (1 + m,) [rad, m].
        upper: Upper ends, shape (1 + m,).
        polygon: Positions p_WL outside which nothing is free [m].
        width_fraction: Width of its widest interval divided by the range of that axis [-].
        finest: Whether every interval is below the resolution, so that it will not be halved any more.
    """

    robots: tuple[int, ...]
    lower: FloatArray
    upper: FloatArray
    polygon: Polygon
    width_fraction: float
    finest: bool


# What a plan states of speeds, and which limits of the scenario refuse it.

SLOWEST_AGE = 7.0
"""Gains are for so many times the age of the gain set's commands at most [-]: accelerations fall by up to the
square of the factor, so that it allows for limits of a few tenths."""

Unit = Literal["m", "s", "rad/s^2", "m/s^2"]
"""Units of the limits that can refuse a plan."""


@dataclass(frozen=True)
class SpeedStatement:
    """The limits that a plan keeps, and the largest speeds of the bases that follow from its gains.

    ``speed_limit`` and ``rate_limit`` of the gains bound the speed of the object and the rates of its angle
    and of the joints.

    Attributes:
        base_speed_limits: Limits of the bases' speeds, shape (N,) [m/s].
        turn_rate_limits: Limits of the bases' turn rates, shape (N,) [rad/s].
        joint_rate_limits: Limits of the joints' rates, shape (n,) [rad/s or m/s].
        base_speeds: Largest speed that each base can have, shape (N,) [m/s].
        turn_rates: Largest turn rate that each base can have, shape (N,) [rad/s].
    """

    base_speed_limits: Bounds
    turn_rate_limits: Bounds
    joint_rate_limits: Bounds
    base_speeds: Bounds
    turn_rates: Bounds


@dataclass(frozen=True)
class Refusal:
    """A limit of the scenario with which a plan cannot be carried out.

    Attributes:
        limit: Key of the limit in the scenario, such as ``planner.min_clearance``.
        cell: Index of the cell in which the plan breaks it most.
        value: What the plan has there, or needs, in ``unit``.
        allowed: The limit, in ``unit``.
        unit: Unit of both.
        joint: Name of the joint whose limit it is; empty for limits that concern no joint.
    """

    limit: str
    cell: Annotated[int, Limits(at_least=0), EXACT]
    value: Annotated[NotNegative, EXACT]
    allowed: Annotated[Positive, EXACT]
    unit: Unit
    joint: str = ""

    def describe(self) -> str:
        """Say which limit is broken where, and by how much."""
        what = {
            "planner.min_clearance": "the object's path or its target has a clearance of",
            "planner.max_transition_time": "the transition takes about",
        }.get(self.limit, f"{self.joint} is accelerated by")
        unit, scale = ("mm", 1e3) if self.unit == "m" else (self.unit, 1.0)
        value, allowed = f"{scale * self.value:.3g} {unit}", f"{scale * self.allowed:.3g} {unit}"
        return f"{self.limit}: in cell {self.cell} {what} {value}; the limit is {allowed}"


# The fields of what is written to files stand in the order of the files; their types are checked when read.


@dataclass(frozen=True)
class Cell:
    """One cell of the plan: positions times intervals, all of it free.

    Attributes:
        lower: Lower ends of (theta, q...), theta and joints without limits unwrapped along the plan, shape
            (1 + n,) [rad, m].
        upper: Upper ends, shape (1 + n,).
        tidied: Q_i, positions that are safe for every angle in the intervals, simply connected, fit for a map
            and for the governor [m].
    """

    lower: Vector
    upper: Vector
    tidied: Region


@dataclass(frozen=True)
class Transition:
    """How to leave a cell: one for each cell, the last one ends at the goal.

    Attributes:
        target: Point that the governor steers to, shape (2,) [m].
        goal_lower: Lower ends of the goal intervals of (theta, q...), shape (1 + n,).
        goal_upper: Upper ends, shape (1 + n,).
        inradius: R_i, radius of a disc about the target inside Q_i and Q_(i+1); in the last cell it is within
            the tolerance of the goal [m].
        neck: b_i, widest clearance that a path to the target can keep inside Q_i [m].
        length: Length of ``path`` [m].
        estimated_time: Estimated duration [s].
        only_angles: True where the position is already at the target and only angles move.
        gains: Gains of the governor and of the funnels.
        path: Such a path from where the cell is entered to the target, shape (k, 2) [m].
        governed: Region in which the motion of a plan with a budget stays: the cell less a strip for
            departures; null in a plan without one [m].
    """

    target: Vector
    goal_lower: Vector
    goal_upper: Vector
    inradius: Annotated[Positive, EXACT]
    neck: Annotated[Positive, EXACT]
    length: Annotated[NotNegative, EXACT]
    estimated_time: Annotated[NotNegative, EXACT]
    only_angles: bool
    gains: TransitionGains
    path: Points
    governed: Region | None = None


@dataclass(frozen=True, kw_only=True)
class Plan:
    """A sequence of cells from start to goal, ready to be executed.

    Attributes:
        problem: Digest of the planning problem that it solves; empty for a plan made by hand.
        gain_set: Name of the gain set the gains were scheduled with.
        joint_names: Names of q's entries, length n.
        start: z = (x, y, theta, q...), shape (3 + n,).
        goal_pose: (x, y, theta), theta unwrapped along the plan, shape (3,).
        goal_joints: Goal of each joint, None where free; of joints without limits unwrapped along the plan.
        cells: From the start's cell to the goal's.
        transitions: One for each cell, in the same order.
        budget: Departures from the ideal team under which object and axes provably stay in their cells; null
            if none were asked for.
        speeds: Limits of speed that are kept, and what follows for the bases; null where no limit is known.
        age_factor: The gains are those of the gain set for so many times the age of its commands, so that
            limits of acceleration are kept.
        refused_by: Limits of the scenario that the plan breaks: it shows that a way exists, but cannot be
            carried out. Empty for a plan that can.
        departures: How far a team that follows the motion departs from it under the budget; null without one.
        motion: The nominal motion of a team that passes from cell to cell without a stop; null for one that
            comes to rest in every cell.
    """

    problem: str = ""
    gain_set: str
    joint_names: tuple[str, ...]
    start: Vector
    goal_pose: Vector
    goal_joints: tuple[Number | None, ...]
    cells: tuple[Cell, ...]
    transitions: tuple[Transition, ...]
    budget: Budget | None = None
    speeds: SpeedStatement | None = None
    age_factor: Annotated[Positive, EXACT] = 1.0
    refused_by: tuple[Refusal, ...] = ()
    departures: Departures | None = None
    motion: Motion | None = None

    def governed(self, index: int) -> Polygon:
        """Return the region in which p_G or the motion stays in a cell: Q_i, or less under a budget."""
        return self.transitions[index].governed or self.cells[index].tidied

    def governor_row(self, index: int) -> Vector:
        """Return the governor's gains in a transition, with those from which they start, shape (9,)."""
        before = self.transitions[max(index - 1, 0)].gains
        return self.transitions[index].gains.governor_row(before)

    def funnel(self, index: int) -> Funnel:
        """Return the funnels of a transition, axes (theta, q...), from cell to goal intervals."""
        from coop_drake.laws.ppc import Funnel

        cell, transition = self.cells[index], self.transitions[index]
        goal, gains = (transition.goal_lower, transition.goal_upper), transition.gains
        return Funnel(cell.lower, cell.upper, *goal, gains.decay_rate, gains.funnel)


@dataclass(frozen=True)
class Found:
    """A plan exists, and here it is."""

    plan: Plan
    report: SearchReport


@dataclass(frozen=True)
class BeyondLimits:
    """A way exists, but no plan was found that can be carried out within the scenario's limits.

    Attributes:
        plan: Its cells are proved free and lead from start to goal; ``refused_by`` names the limits.
        report: What the search did.
    """

    plan: Plan
    report: SearchReport

    @property
    def reason(self) -> str:
        """Which limits refuse the plan, and where, in a sentence."""
        broken = "; ".join(refusal.describe() for refusal in self.plan.refused_by)
        return f"a way exists, but it cannot be carried out within the scenario's limits: {broken}"


@dataclass(frozen=True)
class Infeasible:
    """No plan exists: the over-approximations separate start from goal.

    Attributes:
        reason: How, in a sentence.
        report: What the search did.
        proof: The proof, in a form that can be checked again.
    """

    reason: str
    report: SearchReport
    proof: InfeasibilityProof | None = None


@dataclass(frozen=True)
class Undecided:
    """Neither answer was proved within the resolution or the work budget."""

    reason: str
    report: SearchReport


PlanningResult = Found | BeyondLimits | Infeasible | Undecided


# The paper's Table 1 for a plan: the intervals of every cell.


def table_1(plan: Plan) -> str:
    """Return the intervals of theta and of every joint, cell by cell, as a Markdown table.

    Angles are unwrapped along the plan [rad]; prismatic joints are in metres.
    """
    axes = ("theta", *plan.joint_names)
    columns = ["cell", *(f"{axis} {bound}" for axis in axes for bound in ("lower", "upper"))]
    lines = [
        f"Table 1. Intervals of the object's angle and of every joint in the {len(plan.cells)} cells "
        "of the plan [rad, prismatic joints m].",
        "",
        "| " + " | ".join(columns) + " |",
        "|" + " ---: |" * len(columns),
    ]
    for number, cell in enumerate(plan.cells, start=1):
        bounds = [f"{value:.3f}" for pair in zip(cell.lower, cell.upper, strict=True) for value in pair]
        lines.append("| " + " | ".join([str(number), *bounds]) + " |")
    return "\n".join(lines) + "\n"


# The file ``plan.json``: the same bytes for the same plan, every number at full precision.

FORMAT = "coop_drake plan"
"""What the document says it is."""

VERSION = 6
"""Version of its layout; another one is refused."""


def save_plan(plan: Plan, path: Path | str) -> Path:
    """Write a plan so that ``load_plan`` gives the same plan back, and saving that the same bytes.

    The file is written whole or not at all; its path is returned.
    """
    return write_document(path, plan_document(plan), rows=("cells", "transitions"))


def plan_digest(plan: Plan) -> str:
    """Return the digest that ``save_plan`` writes into a plan's file."""
    return content_digest(plan_document(plan))


def plan_document(plan: Plan) -> dict[str, Any]:
    """The content of a plan's file without its digest, as plain data."""
    return {"format": FORMAT, "version": VERSION, **to_plain(plan, Plan)}


def load_plan(path: Path | str) -> Plan:
    """Read a plan that can be executed from a file that ``save_plan`` wrote.

    Raises:
        PlanError: If it is not such a plan: names the file, the key, the value and what is allowed there.
    """
    document = Document.load(path, "a plan")
    plan = read_plan(document)
    check_plan(plan, document.file)
    document.check_digest()
    if plan.refused_by:
        limits = "; ".join(refusal.describe() for refusal in plan.refused_by)
        document.refuse(
            "refused_by",
            limits,
            "no limit that a plan breaks; with other limits `plan` may find one that can be carried out",
        )
    return plan


def read_plan(document: Document) -> Plan:
    """Read a plan from a document; every key, length and number is checked, but not what they mean together.

    Raises:
        PlanError: Names the file, the key, the value and what is allowed there.
    """
    document.check_entry("format", FORMAT)
    document.check_entry("version", VERSION)
    plan = document.read(Plan, head=("format", "version"))
    axes = 1 + len(plan.joint_names)
    if not plan.cells:
        document.refuse("cells", [], "at least one cell")
    document.check_length("start", 2 + axes)
    document.check_length("goal_pose", 3)
    document.check_length("goal_joints", axes - 1)
    document.check_length("transitions", len(plan.cells))
    for k in range(len(plan.cells)):
        document.check_intervals(f"cells[{k}].", axes)
        document.check_intervals(f"transitions[{k}].goal_", axes)
        document.check_length(f"transitions[{k}].target", 2)
        gains = document.entry(f"transitions[{k}].gains")
        for name, value in gains.items():
            if isinstance(value, list):
                document.check_length(f"transitions[{k}].gains.{name}", axes)
    if plan.motion is not None:
        document.check_length("motion.points[0]", 2 + axes)
        document.check_length("motion.windows", len(plan.cells))
        document.check_length("motion.rates", len(plan.cells))
    return plan


# What every executable plan satisfies: targets shared by neighbours, goals inside slices.

ROUNDING = 1e-9
"""Regions and intervals that share a boundary may differ by so much [m, rad]."""


def check_plan(plan: Plan, file: str) -> None:
    """Refuse a plan that could not be executed safely.

    Raises:
        PlanError: Names the file that it comes from, the key and what is allowed.
    """
    _check_ends(plan, file)
    for k in range(len(plan.cells)):
        for m in range(k, min(k + 2, len(plan.cells))):
            _check_handover(plan, k, m, file)


def _check_handover(plan: Plan, k: int, m: int, file: str) -> None:
    """Transition k must end inside cell m, its own or the next one."""
    transition, cell = plan.transitions[k], plan.cells[m]
    if not plan.governed(m).contains(Point(transition.target)):
        region = "cells[{}].tidied" if plan.transitions[m].governed is None else "transitions[{}].governed"
        raise PlanError(
            f"{file}: transitions[{k}].target: {transition.target.tolist()} is not allowed; expected a point "
            f"inside {region.format(m)}"
        )
    inside = (cell.lower - ROUNDING <= transition.goal_lower) & (
        transition.goal_upper <= cell.upper + ROUNDING
    )
    if not inside.all():
        axis = int(np.argmin(inside))
        interval = [float(transition.goal_lower[axis]), float(transition.goal_upper[axis])]
        raise PlanError(
            f"{file}: transitions[{k}].goal_lower, goal_upper: axis {axis}: {interval} is not allowed; "
            f"expected an interval inside cells[{m}]'s [{cell.lower[axis]}, {cell.upper[axis]}]"
        )


def _check_ends(plan: Plan, file: str) -> None:
    first, start = plan.cells[0], plan.start
    if not first.tidied.contains(Point(start[:2])) or not _holds(first.lower, start[2:], first.upper):
        raise PlanError(
            f"{file}: start: {start.tolist()} is not allowed; expected a configuration in cells[0]"
        )


def _holds(lower: np.ndarray, values: np.ndarray, upper: np.ndarray) -> bool:
    return bool(((lower - ROUNDING <= values) & (values <= upper + ROUNDING)).all())


# Whether a plan was made for a planning problem, and for the age of a team's commands.

_SAME_GOAL = 1e-9
"""Difference of goals that rounding explains: an unwrapped angle may be turned by whole turns [m, rad]."""


def check_plan_belongs(plan: Plan, problem: PlanningProblem, path: Path) -> None:
    """Refuse a plan, read from the file at ``path``, that was made for another problem.

    Raises:
        PlanError: Names the first key in which they differ, its value, and the scenario's.
    """
    away = plan.goal_pose - problem.goal_pose
    away[2] = remainder(away[2], tau)
    same_goal = same_goal_joints(plan, problem) and np.abs(away).max() <= _SAME_GOAL
    names = tuple(joint.name for joint in problem.tree.joints)
    digest = problem_digest(problem)
    checks = (
        ("joint_names", plan.joint_names == names, _listed(plan.joint_names), _listed(names), ""),
        ("start", np.array_equal(plan.start, problem.start), plan.start.tolist(), problem.start.tolist(), ""),
        ("goal_pose", same_goal, *(_goal(question) for question in (plan, problem)), ""),
        (
            "problem",
            plan.problem == digest,
            repr(plan.problem),
            repr(digest),
            ": the plan was made for another floor or team, other tolerances or other limits",
        ),
    )
    for key, same, found, expected, reason in checks:
        if not same:
            raise PlanError(
                f"{path}: {key}: {found} is not allowed; expected the scenario's, {expected}{reason}"
            )


def same_goal_joints(plan: Plan, problem: PlanningProblem) -> bool:
    """Whether a plan ends at the problem's values of the joints, those without limits modulo whole turns."""
    if len(plan.goal_joints) != len(problem.goal_joints):
        return False
    goals = zip(problem.tree.joints, plan.goal_joints, problem.goal_joints, strict=True)
    return all(
        abs(remainder(ours - theirs, tau)) <= _SAME_GOAL
        if joint.circular and ours is not None and theirs is not None
        else ours == theirs
        for joint, ours, theirs in goals
    )


def other_age(plan: Plan, gain_set: GainSet | None) -> str:
    """Say that a plan's gains are for another age of commands than the gain set's; empty where they are not.

    A plan belongs to its deployment: delay, control rate, losses and lag make commands older.

    Args:
        plan: The plan.
        gain_set: The scenario's gain set that the plan names; None where it has none.
    """
    if not isinstance(gain_set, ScheduledGains):
        return ""
    first = plan.transitions[0]
    factor = plan.age_factor
    expected = min(gain_set.age_phase / (factor * gain_set.age), gain_set.max_rate_gain)
    if isclose(first.gains.rate_gain, expected, rel_tol=_SAME_GOAL):
        return ""
    found = gain_set.age_phase / (factor * first.gains.rate_gain)
    return (
        f"its gains are for commands that rest on measurements {1e3 * found:.4g} ms old, and the "
        f"`deployment` and `control` of the scenario make these {1e3 * gain_set.age:.4g} ms old; "
        "`coop-drake plan` on this scenario makes the plan for it"
    )


def _listed(names: tuple[str, ...]) -> str:
    return ", ".join(names) or "no joint"


def _goal(question: Plan | PlanningProblem) -> str:
    return f"{question.goal_pose.tolist()} with goal_joints {list(question.goal_joints)}"

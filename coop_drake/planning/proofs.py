"""Proofs that no plan exists, by explorations of a question and of parts of its team and floor."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import combinations
from math import cos, pi

import numpy as np
import shapely
from shapely import MultiPolygon, Point, Polygon
from shapely.errors import ShapelyError

from coop_drake.answers.plan import MixedCell
from coop_drake.answers.problem import PlanningProblem, at_goal, goal_box
from coop_drake.answers.proof import InfeasibilityProof, OverCell, OverSlice, Witness
from coop_drake.errors import GeometryError
from coop_drake.geometry.minkowski import FreeSpace
from coop_drake.geometry.sweeps import normals
from coop_drake.geometry.swept_tree import Interval, Intervals, SweptTree
from coop_drake.planning.cells.cells import CellMaker, FreeBox, Region
from coop_drake.planning.cells.exploration import Exploration, ExplorationResult, Verdict, Watch
from coop_drake.planning.cells.graph import halves
from coop_drake.planning.certificates import FAILURES, Floor, Witnesses, slices_proof
from coop_drake.planning.channel import NoChannel
from coop_drake.planning.questions import (
    EXTRA_FLOOR,
    goal_beyond_limits,
    marginal_workspace,
    nearby,
    relaxed,
    shrunk,
)
from coop_drake.planning.sampling.sampler import Sampler, SubsystemHierarchy
from coop_drake.tree.arrays import FloatArray

TEST_SAMPLES = 8_000
"""Samples for every subsystem where it is tested whether a relaxation has a path: twice those of a first
attempt, because a failure costs an exploration."""

TEST_SEED = 101
"""Seed of these samples, other than those of the search, which have failed already."""

WHOLE_DIVISOR = 2
"""While relaxations are explored too, the whole question gets half of the slices of each [-]: a refutation
of a relaxation needs fewer slices and gives a shorter proof."""

MOST_ROBOTS = 2
"""Robots that a relaxation keeps at most: with more, it needs about as many slices as the whole question."""


OBJECT_RESOLUTION = 0.01
"""Slices of the object alone have one axis; they are split to this fraction of the resolution [-]."""


class Proofs:
    """Tries to prove infeasibility by exploring the question and its relaxations in turns, at margin zero.

    It is deterministic: the same amount of work gives the same answer.

    The whole question is explored in turns with those relaxations to two robots at most for which sampling
    finds no path. A refutation of any of them refutes the question.

    Args:
        problem: The question.
        watch: Called with the events of every exploration.

    Attributes:
        refutation: The proof, once there is one.
    """

    def __init__(self, problem: PlanningProblem, watch: Watch | None = None) -> None:
        self._problem, self._watch = problem, watch
        self._all = tuple(sorted({joint.robot for joint in problem.tree.joints}))
        self._pathless: dict[tuple[int, ...], bool] = {}
        self._explorations: dict[tuple[int, ...], Exploration] = {}
        self._outcomes: dict[tuple[int, ...], ExplorationResult] = {}
        self.refutation: NoChannel | None = None

    @property
    def slices(self) -> int:
        """Compound slices made so far."""
        return sum(outcome.slices for outcome in self._outcomes.values())

    @property
    def blocked_part(self) -> tuple[int, ...] | None:
        """Robots of the smallest relaxation whose exploration has no answer yet; None if there is none.

        Relaxations are explored where sampling has found no path for them.
        """
        undecided = [
            chosen
            for chosen, outcome in self._outcomes.items()
            if chosen != self._all and outcome.verdict in (Verdict.BUDGET, Verdict.RESOLUTION)
        ]
        return min(undecided, key=lambda chosen: (len(chosen), chosen), default=None)

    def run(
        self,
        slices: int,
        robots: int | None = None,
        progress: Callable[[int], None] | None = None,
        *,
        untested: bool = True,
    ) -> Verdict:
        """Continue every exploration until it has an answer or has made its slices.

        When all of them have spent ``planner.max_slices``, the whole question gets so many slices by itself
        where walls squeeze bases of three or more robots together: it may then be proved by few slices more.

        Args:
            slices: Slices of each exploration, those of earlier calls included.
            robots: How many robots a relaxation keeps at most, the whole question being left out; None for
                the whole question and every relaxation for which sampling finds no path.
            progress: Called with the number of slices that an exploration has.
            untested: Whether to explore relaxations to so many robots without the relaxation test.

        Returns:
            INFEASIBLE with ``refutation``; FOUND if the whole question has a free channel; RESOLUTION if its
            exploration cannot be continued; BUDGET if more slices may help.
        """
        for chosen in self._questions(robots):
            if self.refutation is None and self._goes_on(chosen, asked=robots is not None and untested):
                self._explore(chosen, self._most(chosen, slices), progress)
        most = self._problem.settings.max_slices
        if robots is None and self.refutation is None and self.slices >= most and self._may_be_squeezed():
            self._explore(self._all, most, progress)
        if self.refutation is not None:
            return Verdict.INFEASIBLE
        latest = self._outcomes.get(self._all)
        return Verdict.BUDGET if latest is None else latest.verdict

    def _may_be_squeezed(self) -> bool:
        """Whether the whole question is undecided, and of three or more robots two are squeezed in places."""
        latest = self._outcomes.get(self._all)
        undecided = latest is not None and latest.verdict is Verdict.BUDGET
        squeezed = undecided and self._exploration(self._all).maker.squeezed > 0
        return squeezed and len(self._all) > MOST_ROBOTS

    def _explore(self, chosen: tuple[int, ...], slices: int, progress: Callable[[int], None] | None) -> None:
        """Continue one exploration, and write the proof down if there is one."""
        outcome = self._exploration(chosen).run(slices, progress)
        if outcome.verdict is Verdict.INFEASIBLE and not self._refute(chosen):
            outcome = replace(outcome, verdict=Verdict.RESOLUTION)
        self._outcomes[chosen] = outcome

    def boxes(self) -> list[FreeBox]:
        """The boxes of the whole question's free channel."""
        return self._exploration(self._all).boxes(self._outcomes[self._all].path)

    def undecided(self) -> tuple[MixedCell, ...]:
        """Cells that the whole question's exploration left undecided, the widest first; none before a run."""
        latest = self._outcomes.get(self._all)
        return () if latest is None else self._exploration(self._all).undecided(latest.path)

    def _questions(self, most: int | None) -> list[tuple[int, ...]]:
        """Robots of the explorations, fewest first, the whole team last."""
        kept = MOST_ROBOTS if most is None else most
        counts = range(min(1 + kept, len(self._all)))
        parts = [chosen for count in counts for chosen in combinations(self._all, count)]
        return [*parts, self._all] if most is None else parts

    def _most(self, chosen: tuple[int, ...], slices: int) -> int:
        """Slices for one exploration: half of them for the whole question while relaxations are explored."""
        waits = any(
            outcome.verdict is Verdict.BUDGET for part, outcome in self._outcomes.items() if part != chosen
        )
        return slices // WHOLE_DIVISOR if chosen == self._all and waits else slices

    def _goes_on(self, chosen: tuple[int, ...], *, asked: bool) -> bool:
        """Whether to explore a question now.

        The whole question always is. A relaxation is if every smaller one has a channel, and the relaxation
        test finds no path.
        """
        outcome = self._outcomes.get(chosen)
        if outcome is not None:
            return outcome.verdict is Verdict.BUDGET
        if asked or chosen == self._all:
            return True
        less = (part for part in self._outcomes if len(part) < len(chosen) and set(part) < set(chosen))
        if any(self._outcomes[part].verdict is not Verdict.FOUND for part in less):
            return False
        return self._finds_no_path(chosen)

    def _finds_no_path(self, chosen: tuple[int, ...]) -> bool:
        """Whether sampling finds no path for the object with some robots; with one there is no proof."""
        if chosen not in self._pathless:
            floor = shrunk(self._problem.workspace, 0.0)
            sampler = Sampler(SubsystemHierarchy(relaxed(self._problem, chosen)[0]), floor, 0.0, TEST_SEED)
            self._pathless[chosen] = len(sampler.path(TEST_SAMPLES)) == 0
        return self._pathless[chosen]

    def _exploration(self, chosen: tuple[int, ...]) -> Exploration:
        if chosen not in self._explorations:
            question, _ = relaxed(self._problem, chosen)
            if not chosen:
                fine = OBJECT_RESOLUTION * question.settings.angle_resolution
                question = replace(question, settings=replace(question.settings, angle_resolution=fine))
            self._explorations[chosen] = Exploration(question, None, self._watch, self._words(chosen))
        return self._explorations[chosen]

    def _words(self, chosen: tuple[int, ...]) -> str:
        if chosen == self._all:
            return "the whole team"
        return "the object alone" if not chosen else f"the object with robots {list(chosen)} alone"

    def _refute(self, chosen: tuple[int, ...]) -> bool:
        """Write the proof down; return False if that fails, because cells almost touch or geometry fails."""
        question, _ = relaxed(self._problem, chosen)
        exploration = self._exploration(chosen)
        witnesses = Witnesses(self._problem.tree, exploration.swept, exploration.maker)
        proof = slices_proof(question, exploration.slices, exploration.over_leaves(), witnesses)
        if proof is None:
            return False
        reason = f"the over-approximations of {self._words(chosen)} separate start from goal"
        self.refutation = NoChannel(True, reason, proof)
        return True


# Proofs on large floors from the walls near the goal or the start alone: all else counts as free.

MANY_CORNERS = 300
"""On floors with fewer corners [-] the question is explored as it is."""

REACHES_AT_END = 8.0
"""Walls count up to so many reaches of the team from the goal or start, along x and along y [-]."""

OVERLAP_AT_END = 1e-3
"""What counts as free overlaps that part of the floor by this many reaches [-], so that rounding puts no wall
between them."""

REACHES_BEYOND = 4.0
"""It extends so many reaches beyond the floor [-]: no piece of a team off the floor is inside it."""

SLICES_AT_END = 250
"""Slices of each exploration: a second of work."""

ROBOTS_AT_END = 1
"""Robots that are kept in the first explorations."""


def refuted_at_an_end(problem: PlanningProblem, watch: Watch | None = None) -> tuple[NoChannel | None, int]:
    """Look for a proof that the team cannot leave the start, or reach the goal, for walls near it.

    What is proved on a floor that holds the question's floor is proved for the question.

    Args:
        problem: The question.
        watch: Called with the events of explorations.

    Returns:
        The proof, None if there is none or the floor is small, and the slices made.
    """
    slices = 0
    if shapely.get_num_coordinates(problem.workspace) < MANY_CORNERS:
        return None, 0
    for end in (problem.goal_pose[:2], problem.start[:2]):
        question = _opened(problem, end)
        proofs = None if question is None else Proofs(question, watch)
        if proofs is None:
            continue
        for robots in (ROBOTS_AT_END, None):
            if proofs.run(SLICES_AT_END, robots) in (Verdict.FOUND, Verdict.INFEASIBLE):
                break
        slices += proofs.slices
        if proofs.refutation is not None:
            return proofs.refutation, slices
    return None, slices


def _opened(problem: PlanningProblem, centre: FloatArray) -> PlanningProblem | None:
    """The question with a floor that has walls near a point only; None if geometry fails."""
    (x, y), reach = centre, problem.tree.reach
    near, inner = (
        shapely.box(x - half, y - half, x + half, y + half)
        for half in (REACHES_AT_END * reach, (REACHES_AT_END - OVERLAP_AT_END) * reach)
    )
    ends = shapely.MultiPoint([problem.start[:2], problem.goal_pose[:2]])
    hull = shapely.union_all([problem.workspace.envelope, near, ends]).envelope
    try:
        outside = hull.buffer(REACHES_BEYOND * reach, join_style="mitre").difference(inner)
        floor = problem.workspace.intersection(near).union(outside)
    except ShapelyError:
        return None
    return replace(problem, workspace=floor) if isinstance(floor, Polygon) else None


# An upper bound on the clearance of any path: proofs at margins above zero, for undecided questions.

BOUND_CLEARANCES = (0.08, 0.04, 0.02, 0.01)
"""Clearances that are tried, largest first [m]."""

INSIDE_OCTAGON = 0.92
"""Workspaces are shrunk by an octagon about a disc; a disc of this fraction of the clearance has its octagon
inside the disc of the clearance, because cos(pi / 8) is 0.924 [-]."""

BOUND_SLICES = 128
"""Slices of each exploration: enough for a clear case, and little beside the search that went before."""


def clearance_bound(problem: PlanningProblem) -> tuple[float | None, int]:
    """The smallest of some clearances of which it is proved that no path keeps it from the walls.

    The proofs are for the object with at most one robot. The start and the goal may stand closer to a wall:
    near them the clearance is not required.

    Returns:
        The clearance [m], None if none was refuted, and the slices made for the proofs.
    """
    bound, slices = None, 0
    parts: list[tuple[int, ...]] = [(), *[(r,) for r in sorted({j.robot for j in problem.tree.joints})]]
    for clearance in BOUND_CLEARANCES:
        refuted = False
        for chosen in parts:
            question, _ = relaxed(problem, chosen)
            try:
                workspace = marginal_workspace(problem, INSIDE_OCTAGON * clearance)
            except GeometryError:
                return bound, slices
            outcome = Exploration(question, workspace).run(BOUND_SLICES)
            slices += outcome.slices
            refuted = outcome.verdict is Verdict.INFEASIBLE
            if refuted:
                parts = [chosen, *[part for part in parts if part != chosen]]
                break
        if not refuted:
            return bound, slices
        bound = clearance
    return bound, slices


# Goals at which the team is in collision, within all tolerances and for all values of its free joints.

# A blocked goal as a proof: slices of one cell that leaves out positions about the goal, in collision.

NEAR_GOAL = (1e-3, 1e-5, 1e-7)
"""Slices about the goal reach so far from the goals of theta and joints, in the order tried [rad or m]."""

LEAST_DEPTH = 1e-8
"""A goal less deep inside the positions that are in collision counts as touching only [m]."""

CORNERS = (4, 16, 64, 256, 1024)
"""Corners of the polygon about the goal's positions, the fewest that keep enough distance from them [-]."""

TINY = 1e-12
"""The edges of this polygon are further from the goal than the tolerance, by more than is rounded [m]."""

MOST_SLICES = 1024
"""Slices away from the goal that are made at most, until in each a piece is known to hold a polygon [-]."""


def blocked_goal_proof(
    problem: PlanningProblem, boxes: Sequence[Intervals], floor: MultiPolygon, witnesses: Witnesses
) -> InfeasibilityProof | None:
    """Write down that the team is in collision all over its goal.

    Slices about the goal have one cell, which leaves out positions about the goal's; all others have one cell
    that leaves out nothing.

    Args:
        problem: The question with the robots that are kept.
        boxes: Boxes that cover ``goal_box``, in each of which the team is in collision at all of the goal's
            positions; none if the goal of a joint is beyond its limits.
        floor: The floor that the team may meet at the goal.
        witnesses: Makes what shows collisions.

    Returns:
        The proof, None if the team is not known to be in collision by more than a touch.
    """
    writer = _Writer(problem, floor, witnesses)
    for near in NEAR_GOAL:
        whole, goal = writer.ranges(near)
        parts = [writer.near_goal(box, goal) for box in boxes] if len(goal) == len(whole) else []
        if None not in parts:
            rest = writer.rest(whole, goal)
            if rest is not None:
                slices = (*[part for part in parts if part is not None], *rest)
                return InfeasibilityProof("blocked goal", 0, np.zeros(2), slices)
    return None


class _Writer:
    def __init__(self, problem: PlanningProblem, floor: MultiPolygon, witnesses: Witnesses) -> None:
        self._witnesses, self._floor, self._box = witnesses, Floor(FreeSpace.over(floor)), goal_box(problem)
        self._circular = problem.tree.circular
        self._ranges = [(-pi, pi), *[joint.range for joint in problem.tree.joints]]
        self._goal, self._room = problem.goal_pose[:2], problem.position_tolerance
        self._reach = problem.tree.reach
        known = shapely.union(problem.workspace.envelope, Point(self._goal).buffer(self._room))
        (x0, y0, x1, y1), most = known.bounds, 3.0 * self._reach
        self._everywhere = shapely.box(x0 - most, y0 - most, x1 + most, y1 + most)

    def ranges(self, near: float) -> tuple[Intervals, Intervals]:
        """The ranges of all axes, and what is near the goal, up to an axis with nothing near it.

        Where a circular axis has a goal, its range is the turn that begins with what is near the goal.
        """
        whole, goal = list[Interval](), list[Interval]()
        for (low, high), (lower, upper), circular in zip(
            self._box, self._ranges, self._circular, strict=True
        ):
            if circular and high - low < 2.0 * pi:
                lower = low - near
                upper = float(np.nextafter(lower + 2.0 * pi, lower))
            whole.append((lower, upper))
            if len(goal) + 1 == len(whole) and low <= high:
                goal.append((max(low - near, lower), min(high + near, upper)))
        return tuple(whole), tuple(goal)

    def near_goal(self, box: Intervals, goal: Intervals) -> OverSlice | None:
        """A slice about a part of the goal; None if not all positions are in collision in all of it."""
        ends = zip(box, self._box, goal, strict=True)
        intervals = tuple(
            (near[0] if own[0] == all_[0] else own[0], near[1] if own[1] == all_[1] else own[1])
            for own, all_, near in ends
        )
        overlaps = self._witnesses.overlaps(intervals)
        if overlaps:
            return OverSlice(*self._witnesses.ends(intervals), overlaps, ())
        sweeps = self._witnesses.inner_sweeps(intervals, 0.0)
        left_out = self._left_out(sweeps)
        if left_out is None:
            return None
        cell = OverCell(True, Polygon(self._everywhere.exterior, [left_out]))
        return OverSlice(*self._witnesses.ends(intervals), sweeps, (cell,))

    def rest(self, whole: Intervals, goal: Intervals) -> list[OverSlice] | None:
        """Slices of all else, each with a piece that holds a polygon; None if such slices are too small."""
        left, found = list(_around(whole, goal)), list[OverSlice]()
        for _ in range(MOST_SLICES):
            if not left:
                return found
            intervals = left.pop()
            sweeps = self._witnesses.inner_sweeps(intervals, 0.0)
            if sweeps:
                cell = OverCell(True, self._everywhere)
                found.append(OverSlice(*self._witnesses.ends(intervals), sweeps[:1], (cell,)))
            else:
                widths = [upper - lower for lower, upper in intervals]
                left.extend(halves(intervals, widths.index(max(widths))))
        return None

    def _left_out(self, sweeps: Sequence[Witness]) -> FloatArray | None:
        """A polygon about the goal's positions, all of which the sweeps forbid; None if they do not by a bit.

        Its corners lie halfway between the disc of the goal's positions and the nearest that is left free.
        """
        try:
            free = self._floor.not_forbidden(sweeps)
        except FAILURES:
            return None
        depth = min([-float(region.depths(self._goal[None])[0]) for region in free], default=np.inf)
        radius = self._room + min(0.5 * (depth - self._room), self._reach, EXTRA_FLOOR)
        for corners in CORNERS:
            if depth - self._room > LEAST_DEPTH and radius * cos(pi / corners) > self._room + TINY:
                polygon: FloatArray = radius * normals(np.linspace(0.0, 2.0 * pi, corners, endpoint=False))
                return self._goal + polygon
        return None


def _around(whole: Intervals, goal: Intervals) -> Iterator[Intervals]:
    """Boxes of all that is not near the goal: axis by axis below it and above it, near it on axes before."""
    for axis, (low, high) in enumerate(whole):
        before, after = goal[:axis], whole[axis + 1 :]
        if axis == len(goal):
            yield (*before, (low, high), *after)
            return
        for ends in ((low, goal[axis][0]), (goal[axis][1], high)):
            if ends[0] < ends[1]:
                yield (*before, ends, *after)


ALL_BUT_TOUCHING = 1e-5
"""Bodies that are nearer to a wall than this all but touch it [m]."""

MOST_SWEPT = 128
"""Slices of joint intervals that are swept at most for each part of the team: milliseconds of work."""


def blocked_goal(problem: PlanningProblem) -> tuple[InfeasibilityProof | None, int]:
    """Prove by under-sweeps that the team is in collision all over its goal, whatever its free joints are.

    The object is tested first, then each robot alone, then the team: if some of the bodies collide, so
    does the team.

    Args:
        problem: The question, whose margin is zero.

    Returns:
        The proof, None if there is none, and the slices swept for it.
    """
    robots = sorted({joint.robot for joint in problem.tree.joints})
    slices = 0
    for chosen in dict.fromkeys([(), *[(robot,) for robot in robots], tuple(robots)]):
        question = relaxed(problem, chosen)[0]
        swept, floor = SweptTree(question.tree), _floor_at_goal(question)
        beyond = goal_beyond_limits(question) is not None
        boxes, made = ([], 0) if beyond else _blocked(question, CellMaker(swept, floor))
        slices += made
        if boxes or beyond:
            proof = blocked_goal_proof(question, boxes, floor, Witnesses(problem.tree, swept))
            if proof is not None:
                return proof, slices
    return None, slices


def touch_at_goal(problem: PlanningProblem) -> str | None:
    """A sentence about a body that all but touches a wall at the goal pose, None if there is none.

    Only bodies are looked at whose joints all have goals.
    """
    tree, goals = problem.tree, problem.goal_joints
    poses = tree.poses(at_goal(problem.goal_pose, goals, 0.0))
    for index, (component, pose) in enumerate(zip(tree.components, poses, strict=True)):
        joints = [tree.components[k].joint for k in tree.ancestors[index]]
        if any(joint is not None and goals[joint.index] is None for joint in joints):
            continue
        for body in component.bodies:
            for shape in body.shapes:
                hull = shapely.MultiPoint(pose.apply(shape.vertices)).convex_hull
                if hull.distance(problem.workspace.boundary) - shape.radius < ALL_BUT_TOUCHING:
                    return f"at the goal pose {body.name} all but touches a wall, or touches it"
    return None


def _floor_at_goal(question: PlanningProblem) -> MultiPolygon:
    """The part of the floor that the team may meet at its goal; all of it if geometry fails."""
    reach = question.tree.reach + question.position_tolerance
    try:
        near = nearby(question.workspace, question.goal_pose[None, :2], reach)
    except ShapelyError:  # The floor crosses itself.
        near = MultiPolygon()
    return shrunk(question.workspace, 0.0) if near.is_empty else near


def _blocked(question: PlanningProblem, maker: CellMaker) -> tuple[list[Intervals], int]:
    """Boxes that cover ``goal_box``, in each of which the team is in collision at all positions of the goal.

    Intervals are halved until all are blocked, one is free, or the budget is spent; only in the first case
    boxes are returned. The second result is the number of slices swept.
    """
    left: list[Intervals] = [goal_box(question)]
    blocked: list[Intervals] = []
    for made in range(1, MOST_SWEPT + 1):
        intervals = left.pop()
        if _held(maker.over_cells(intervals), question):
            widths = [upper - lower for lower, upper in intervals]
            widest = widths.index(max(widths))
            if widths[widest] == 0.0 or _held(maker.guide_cells(intervals), question):
                return [], made
            left.extend(halves(intervals, widest))
        else:
            blocked.append(intervals)
        if not left:
            return blocked, made
    return [], MOST_SWEPT


def _held(regions: list[Region], question: PlanningProblem) -> bool:
    return any(region.near(question.goal_pose[:2], question.position_tolerance) for region in regions)

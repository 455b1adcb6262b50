"""Variants of a question and their answers, and passages that are too narrow, by how much."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property

import numpy as np
import shapely
from scipy.spatial import QhullError, Voronoi
from shapely import LineString, Point, Polygon, box
from shapely.geometry.base import BaseGeometry

from coop_drake.answers import PlanningProblem
from coop_drake.diagnosis.contacts import CollidingStretch, colliding_stretches
from coop_drake.errors import GeometryError, PlanError
from coop_drake.geometry.polygons import parts_of
from coop_drake.planning.boxes import free_boxes
from coop_drake.planning.cells.exploration import Verdict
from coop_drake.planning.channel import ended, make_channel
from coop_drake.planning.proofs import Proofs
from coop_drake.planning.questions import exact_footprint
from coop_drake.planning.sampled_search import SampledSearch
from coop_drake.planning.sampling.collision import densified
from coop_drake.planning.transitions import path_through
from coop_drake.progress import Progress
from coop_drake.tree.arrays import FloatArray
from coop_drake.tree.component_tree import configuration_scale

# Variants of a question, their answers, and the bracket of the least change that gives another answer.

# A proof that a given path of the whole team is free.


def is_free(problem: PlanningProblem, path: FloatArray) -> tuple[bool, int]:
    """Try to prove a path free, by covering it with free boxes.

    The path, circular axes unwrapped, has shape (m, 3 + n) [m, rad].

    Returns:
        Whether the path is proved free (a failure proves nothing), and how many boxes were tried.
    """
    if not problem.workspace.contains(exact_footprint(problem.tree, path[0])):
        return False, 0  # Boxes show that a path meets no wall, but not on which side of it the path begins.
    tree, floor = problem.tree, problem.workspace
    boxes, tried = free_boxes(tree, floor, configuration_scale(tree), path, smallest=True)
    return boxes is not None, tried


# Variants of the problem, put to the planner within a budget of work; each has one of three answers.

STEP = 0.05
"""Distance of consecutive configurations of the paths that are looked at [m]."""

PATHS = 2
"""Paths that are sampled for a variant before it is explored for a proof [-]."""

BOXES_PER_SLICE = 20
"""Boxes whose certification takes about as long as sweeping one slice [-]."""


class Answer(Enum):
    """What is known about a problem."""

    FOUND = "found"
    INFEASIBLE = "infeasible"
    UNDECIDED = "undecided"


@dataclass(frozen=True)
class Outcome:
    """The answer to a variant.

    Attributes:
        answer: What was computed; INFEASIBLE is a proof.
        path: Configurations from start to goal that are proved free, shape (m, 3 + n); None if there are
            none.
    """

    answer: Answer
    path: FloatArray | None = None


class BudgetedPlanner:
    """Asks the planner at margin zero and counts the work, so that a diagnosis ends.

    Args:
        slices: Budget of each search, in slices.
        total: Budget of all searches together, in slices; when it is spent everything is undecided.
        progress: Called with a stage and the fraction of the total budget that is spent.
    """

    def __init__(self, slices: int, total: int, progress: Progress | None = None) -> None:
        self._slices, self._total, self._progress = slices, total, progress
        self.spent = 0

    def ask(self, problem: PlanningProblem, stage: str) -> Outcome:
        """Sample some paths and explore once: a part of what the planner does, hence as sound.

        The variant's margin and its budget of slices are set here. The stage says what this is done for.
        """
        self._report(stage)
        if self.spent >= self._total:
            return Outcome(Answer.UNDECIDED)
        settings = replace(problem.settings, margin=0.0, max_slices=self._slices)
        variant = replace(problem, settings=settings)
        samples, proofs = SampledSearch(variant), Proofs(variant)
        outcome = self._asked(variant, samples, proofs, stage)
        self.spent += max(1, samples.slices // BOXES_PER_SLICE + proofs.slices)
        return outcome

    def _asked(self, variant: PlanningProblem, samples: SampledSearch, proofs: Proofs, stage: str) -> Outcome:
        for _ in range(PATHS):
            (found,) = samples.attempts(1, progress=lambda _: self._report(stage))
            if found is not None:
                path = densified(found.path, configuration_scale(variant.tree), STEP)
                return Outcome(Answer.FOUND, path)
        verdict = proofs.run(self._slices, progress=lambda _: self._report(stage))
        if verdict is Verdict.INFEASIBLE:
            return Outcome(Answer.INFEASIBLE)
        if verdict is not Verdict.FOUND:
            return Outcome(Answer.UNDECIDED)
        try:
            channel = make_channel(variant, proofs.boxes(), None)
            path = path_through(ended(variant, channel), channel)
        except (GeometryError, PlanError):  # A cell with a cusp: the channel is proved free all the same.
            return Outcome(Answer.FOUND)
        return Outcome(Answer.FOUND, densified(path, configuration_scale(variant.tree), STEP))

    def prove(self, problem: PlanningProblem, path: FloatArray) -> Outcome:
        """Try to prove a given path free in a variant; a failure proves nothing."""
        free, tried = is_free(problem, path)
        self.spent += tried // BOXES_PER_SLICE
        return Outcome(Answer.FOUND if free else Answer.UNDECIDED, path if free else None)

    def _report(self, stage: str) -> None:
        if self._progress is not None:
            self._progress(stage, min(1.0, self.spent / self._total))


# Bounds of the change that is needed: an amount proved too little, and one found to be enough.


@dataclass(frozen=True)
class Bracket:
    """What was computed about the least amount of a change that makes a problem feasible.

    Attributes:
        refuted: Largest amount that was proved not to be enough; None if none was, not even zero.
        found: Smallest amount with which a channel was found, None if there was none.
        most: Largest amount tried.
        outcome: The outcome at ``found``, None if there was none.
    """

    refuted: float | None
    found: float | None
    most: float
    outcome: Outcome | None

    @property
    def is_refuted(self) -> bool:
        """Whether even the largest amount tried was proved not to be enough."""
        return self.refuted is not None and self.refuted >= self.most


@dataclass(frozen=True)
class Amounts:
    """Which amounts of a change to try.

    Attributes:
        first: First amount; doubled until a channel is found.
        most: Largest amount.
        resolution: The bracket is narrowed until its width is at most the larger of ``resolution`` and
            ``fraction`` times the amount found.
        fraction: See ``resolution`` [-].
        asked: Largest number of amounts that are tried.
    """

    first: float
    most: float
    resolution: float
    fraction: float = 0.125
    asked: int = 12


def bracketed(
    ask: Callable[[float], Outcome],
    amounts: Amounts,
    *,
    refuted: float | None = 0.0,
    improve: Callable[[float, Outcome], tuple[float, Outcome]] = lambda amount, outcome: (amount, outcome),
) -> Bracket:
    """Bracket the least amount of a change that is enough, by doubling and then by bisection.

    More of the change must never make a feasible problem infeasible.

    Args:
        ask: Asks about the problem with an amount of the change.
        amounts: Which amounts to try.
        refuted: Amount that is proved not to be enough beforehand, None if nothing is.
        improve: Given an amount that is enough and its outcome, looks for a smaller one.
    """
    found: float | None = None
    outcome: Outcome | None = None
    missed = 0.0  # Largest amount without a channel, proved or not.
    unproved = 0.0  # Smallest amount without a channel and without a proof, 0 if there is none.
    most, asked = 0.0, 0

    def step(amount: float) -> bool:
        """Ask about one amount; returns whether a channel was found."""
        nonlocal found, outcome, missed, unproved, most, asked, refuted
        asked, most = asked + 1, max(most, amount)
        here = ask(amount)
        if here.answer is Answer.FOUND:
            found, outcome = improve(amount, here)
            missed, unproved = min(missed, found), min(unproved, found)
            return True
        missed = max(missed, amount)
        if here.answer is Answer.INFEASIBLE:
            refuted = max(amount, refuted or 0.0)
            unproved = unproved if unproved > amount else 0.0
        else:
            unproved = min(unproved or amount, amount)
        return False

    amount = min(amounts.first, amounts.most)
    while not step(amount) and amount < amounts.most and asked < amounts.asked:
        amount = min(2.0 * amount, amounts.most)
    while found is not None and asked < amounts.asked:
        wanted, proved = max(amounts.resolution, amounts.fraction * found), refuted or 0.0
        if found - missed > wanted:
            step(0.5 * (found + missed))
        elif unproved - proved > wanted:
            step(0.5 * (unproved + proved))
        else:
            break
    return Bracket(refuted, found, most, outcome)


# Whether the team blocks itself: the problem without walls, and with pairs of bodies that may overlap.

OPEN_BEYOND = 2.0
"""The open floor extends beyond the workspace by so many times the team's reach: it can turn anywhere [-]."""

PAIRS = 12
"""Pairs of bodies that are allowed to overlap, one after another; a bound for the work [-]."""


@dataclass(frozen=True)
class OpenFloor:
    """What is known about the problem on a floor without walls.

    Attributes:
        answer: The answer there.
        pairs: Pairs of bodies; if one of these pairs might overlap, there would be a path.
    """

    answer: Answer
    pairs: tuple[tuple[str, str], ...] = ()


def on_open_floor(problem: PlanningProblem, planner: BudgetedPlanner) -> OpenFloor:
    """Ask on an open floor; if that has no path either, let one pair of bodies overlap after another."""
    x_min, y_min, x_max, y_max = problem.workspace.bounds
    rim = OPEN_BEYOND * problem.tree.reach
    bare = replace(problem, workspace=box(x_min - rim, y_min - rim, x_max + rim, y_max + rim))
    answer = planner.ask(bare, "taking the walls away").answer
    if answer is Answer.FOUND:
        return OpenFloor(answer)
    tree, pairs = problem.tree, []
    for (i, j), (k, m) in tree.collision_pairs[:PAIRS]:
        pair = tree.components[i].bodies[j].name, tree.components[k].bodies[m].name
        lenient = replace(bare, tree=replace(tree, unchecked_pairs=tree.unchecked_pairs | {pair}))
        if planner.ask(lenient, "letting bodies overlap").answer is Answer.FOUND:
            pairs.append(pair)
    return OpenFloor(answer, tuple(pairs))


# Passages that are too narrow, by how much: the floor is widened until there is a plan.

# Wider floors: walls moved back, everywhere or around some places, but never removed.

SAMPLES, FINEST = 6_000, 0.01
"""Walls are sampled at this many points, but no closer than this [-, m]."""

OPPOSITE = 1.6
"""Samples on opposite faces are so many times as far apart as from the middle line; 2 at most [-]."""

CORE = 5e-4
"""Half of the thickness that is left of a wall, and tolerance of its middle line [m]."""

TINY = 1e-6
"""Deviation within which corners are left out [m]."""

MITRE = 5.0
"""Corners stay sharp until they move by more than so many times the distance of the walls [-]."""

BEYOND = 1.5
"""A middle line ends at the floor if so many times its distance from the walls further on is floor [-]."""


class WidenedFloor:
    """Moves the walls of a floor back.

    Every wall moves along its normal, and corners stay sharp. Of a wall between two parts of the floor the
    middle line, found by a Voronoi graph of points on the walls, remains however thin the wall is: moving
    walls back never opens a path through them. Where such a line ends at the floor, at the jamb of a door or
    at the end of a partition, it becomes shorter with the wall.

    Args:
        workspace: The floor W [m].
        inside: A point of W that the wider floor must hold, shape (2,) [m].
        most: Largest distance that will be asked for [m].
    """

    def __init__(self, workspace: Polygon, inside: FloatArray, most: float) -> None:
        self._workspace, self._inside, self.most = workspace, Point(inside), most

    def everywhere(self, amount: float) -> Polygon:
        """The floor with every wall moved back [m]."""
        return self._joined(self._grown(amount))

    def around(self, zones: list[tuple[BaseGeometry, float]]) -> Polygon:
        """The floor with walls moved back inside some zones only, in each by its own distance [m]."""
        parts = [self._grown(amount).intersection(zone) for zone, amount in zones if amount > 0.0]
        return self._joined(shapely.union_all([self._workspace, *parts]))

    def _grown(self, amount: float) -> BaseGeometry:
        if amount <= 0.0:
            return self._workspace
        grown = self._workspace.buffer(amount, join_style="mitre", mitre_limit=MITRE)
        return shapely.union(shapely.difference(grown, self._middle_lines(amount)), self._workspace)

    def _middle_lines(self, amount: float) -> BaseGeometry:
        """The walls' middle lines, shortened where the ends of walls recede by more than half a wall.

        Args:
            amount: How far walls move back [m].
        """
        lines, ends = self._spine
        receded = [end.buffer(amount - half) for end, half in ends if amount > half]
        left = shapely.difference(lines, shapely.union_all(receded)) if receded else lines
        return left.buffer(CORE, quad_segs=1)

    def _joined(self, shape: BaseGeometry) -> Polygon:
        """The part that holds the start, without superfluous corners."""
        best = max(parts_of(shape), key=lambda part: (part.contains(self._inside), part.area))
        tidy = best.simplify(TINY)
        return tidy if isinstance(tidy, Polygon) and tidy.is_valid else best

    @cached_property
    def _spine(self) -> tuple[BaseGeometry, list[tuple[Point, float]]]:
        """Middle lines of the walls, and their ends at the floor, each with half of the wall's thickness [m].

        A line that ends because the wall becomes too thick is extended half-way to the floor beyond.
        """
        edges, halves = self._ridges
        if len(edges) == 0:
            return LineString(), []
        corners = edges.reshape(-1, 2)
        _, first, counts = np.unique(np.round(corners, 9), axis=0, return_index=True, return_counts=True)
        free_ends, extensions = [], []
        for index in first[counts == 1]:
            end, half = corners[index], float(halves[index // 2])
            ahead = self._ahead(end, corners, half)
            if self._workspace.contains(Point(end + BEYOND * half * ahead)):
                free_ends.append((Point(end), half))
            else:
                extensions.append(self._onwards(end, ahead))
        lines = shapely.union_all([*(LineString(edge) for edge in edges), *extensions])
        return shapely.line_merge(lines).simplify(CORE), free_ends

    @staticmethod
    def _ahead(end: FloatArray, corners: FloatArray, half: float) -> FloatArray:
        """Direction in which a middle line ends, shape (2,)."""
        near = corners[np.hypot(*(corners - end).T) <= 2.0 * max(half, FINEST)]
        back = end - near.mean(axis=0)
        ahead: FloatArray = back / max(float(np.hypot(*back)), 1e-12)
        return ahead

    def _onwards(self, end: FloatArray, ahead: FloatArray) -> LineString:
        """Segment from an end half-way to the floor beyond, if there is any."""
        ray = LineString([end, end + 2.0 * self.most * ahead])
        blocked = shapely.intersection(ray, self._workspace)
        length = 2.0 * self.most if blocked.is_empty else blocked.distance(Point(end))
        return LineString([end, end + 0.5 * length * ahead])

    @cached_property
    def _ridges(self) -> tuple[FloatArray, FloatArray]:
        """Voronoi edges between opposite faces of walls, (n, 2, 2), and half the walls' thickness, (n,)."""
        samples = self._samples()
        try:
            graph = Voronoi(samples)
        except (QhullError, ValueError):
            return np.empty((0, 2, 2)), np.empty(0)
        ends = np.array(graph.ridge_vertices)
        faces = np.array(graph.ridge_points)
        kept = (ends >= 0).all(axis=1)
        edges, faces = graph.vertices[ends[kept]], faces[kept]
        middles = edges.mean(axis=1)
        half = np.hypot(*(middles - samples[faces[:, 0]]).T)
        apart = np.hypot(*(samples[faces[:, 1]] - samples[faces[:, 0]]).T)
        near = (half <= self.most) & (apart >= OPPOSITE * half)
        edges, half = edges[near], half[near]
        outside = ~shapely.contains_xy(self._workspace, edges[:, 0]) & ~shapely.contains_xy(
            self._workspace, edges[:, 1]
        )
        return edges[outside], half[outside]

    def _samples(self) -> FloatArray:
        """Points of the walls, shape (n, 2)."""
        boundary = self._workspace.boundary
        spacing = max(FINEST, boundary.length / SAMPLES)
        points = shapely.get_coordinates(shapely.segmentize(boundary, spacing))
        return np.unique(np.round(points, 9), axis=0)


# Which passages must be widened, and each by how much.

MOST = 4
"""Passages that are widened together at most [-]."""

SLACKS = (1.0, 2.0, 4.0)
"""Amounts tried beyond what the path needs in a passage, in units of the slack that it has everywhere [-]."""


@dataclass(frozen=True)
class BlockingPassage:
    """A passage that blocks.

    Attributes:
        stretch: The stretch of the path in it: where, which bodies collide, at which angles.
        enough: A distance of moving its walls back with which a channel was found, the other passages widened
            by theirs [m].
        refuted: A distance that was proved not to be enough, whatever is done elsewhere up to ``enough``
            there; None if nothing was proved [m].
    """

    stretch: CollidingStretch
    enough: float
    refuted: float | None


@dataclass(frozen=True)
class UniformWidening:
    """What is known about moving all walls back by one distance.

    Attributes:
        refuted: Largest distance that was proved not to be enough, None if none was [m].
        enough: A distance with which a channel was found [m].
        path: A path in that channel, away from the walls where it can be, shape (m, 3 + n).
        needed: How far that path leaves the floor as it is [m].
    """

    refuted: float | None
    enough: float
    path: FloatArray
    needed: float


def blocking_passages(
    problem: PlanningProblem, floor: WidenedFloor, everywhere: UniformWidening, planner: BudgetedPlanner
) -> tuple[list[BlockingPassage], bool]:
    """Choose the passages that have to be widened, and say by how much.

    Those in which the path leaves the floor most are widened first, until a channel is found.

    Returns:
        The passages in the order of the path, and whether a channel was found with only these widened.
    """
    found = colliding_stretches(problem, everywhere.path)
    choice = _Choice(problem, floor, everywhere, planner)
    ranked = sorted(range(len(found)), key=lambda k: (-found[k].bodies[0].depth, k))
    for count in range(1, min(len(ranked), MOST) + 1):
        chosen = [found[k] for k in sorted(ranked[:count])]
        amounts = choice.enough(chosen)
        if amounts is not None:
            return choice.needed(chosen, amounts), True
    return [BlockingPassage(stretch, everywhere.enough, None) for stretch in found], False


@dataclass(frozen=True)
class _Choice:
    """Asks about floors that are widened around some stretches only."""

    problem: PlanningProblem
    floor: WidenedFloor
    everywhere: UniformWidening
    planner: BudgetedPlanner

    def enough(self, chosen: Sequence[CollidingStretch]) -> list[float] | None:
        """Amounts with which a channel is found, along the known path or anywhere; None if none are."""
        most = self.everywhere.enough
        slack = most - self.everywhere.needed
        for factor in SLACKS:
            amounts = [min(most, stretch.bodies[0].depth + factor * slack) for stretch in chosen]
            outcome = self.planner.prove(self._widened(chosen, amounts), self.everywhere.path)
            if outcome.answer is Answer.FOUND:
                return amounts
        amounts = [most] * len(chosen)
        return amounts if self._ask(chosen, amounts) is Answer.FOUND else None

    def needed(self, chosen: Sequence[CollidingStretch], amounts: Sequence[float]) -> list[BlockingPassage]:
        """The passages without those that need no widening once the others are widened."""
        if len(chosen) == 1:
            return [BlockingPassage(chosen[0], amounts[0], self.everywhere.refuted)]
        passages = []
        for k, (stretch, amount) in enumerate(zip(chosen, amounts, strict=True)):
            others = [*chosen[:k], *chosen[k + 1 :]], [*amounts[:k], *amounts[k + 1 :]]
            answer = self._ask(*others)
            if answer is Answer.FOUND:
                return self.needed(*others)
            passages.append(BlockingPassage(stretch, amount, 0.0 if answer is Answer.INFEASIBLE else None))
        return passages

    def _ask(self, chosen: Sequence[CollidingStretch], amounts: Sequence[float]) -> Answer:
        return self.planner.ask(self._widened(chosen, amounts), "widening the passages").answer

    def _widened(self, chosen: Sequence[CollidingStretch], amounts: Sequence[float]) -> PlanningProblem:
        zones = [(stretch.zone, amount) for stretch, amount in zip(chosen, amounts, strict=True)]
        return replace(self.problem, workspace=self.floor.around(zones))

"""Variants of a question, their answers, and the bracket of the least change that gives another answer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum

from shapely import box

from coop_drake.answers import PlanningProblem
from coop_drake.errors import GeometryError, PlanError
from coop_drake.geometry.swept_tree import BodyPairs, SweptTree
from coop_drake.planning.boxes import Certifier
from coop_drake.planning.cells.exploration import Verdict
from coop_drake.planning.channel import ended, make_channel
from coop_drake.planning.proofs import Proofs
from coop_drake.planning.questions import exact_footprint, marginal_workspace
from coop_drake.planning.sampled_search import SampledSearch
from coop_drake.planning.sampling.collision import densified
from coop_drake.planning.transitions import path_through
from coop_drake.progress import Progress
from coop_drake.tree.component_tree import configuration_scale
from coop_drake.tree.pose import FloatArray

# A proof that a given path of the whole team is free.


def is_free(problem: PlanningProblem, path: FloatArray) -> tuple[bool, int]:
    """Try to prove a path free at margin zero, by covering it with free boxes.

    The path, circular axes unwrapped, has shape (m, 3 + n) [m, rad].

    Returns:
        Whether the path is proved free (a failure proves nothing), and how many boxes were tried.
    """
    if not problem.workspace.contains(exact_footprint(problem.tree, path[0])):
        return False, 0  # Boxes show that a path meets no wall, but not on which side of it the path begins.
    swept = SweptTree(problem.tree)
    try:
        workspace, scale = marginal_workspace(problem, 0.0), configuration_scale(problem.tree)
        certifier = Certifier(swept, BodyPairs(swept), workspace, scale, 0.0)
        proved = certifier.boxes(path, longest=True, smallest=True) is not None
    except GeometryError:
        return False, 0
    return proved, certifier.trials


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
    """A variant and its answer.

    Attributes:
        problem: The variant.
        answer: What was computed; INFEASIBLE is a proof.
        path: Configurations from start to goal that are proved free, shape (m, 3 + n); None if there are
            none.
    """

    problem: PlanningProblem
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
            return Outcome(problem, Answer.UNDECIDED)
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
                return Outcome(variant, Answer.FOUND, path)
        verdict = proofs.run(self._slices, progress=lambda _: self._report(stage))
        if verdict is Verdict.INFEASIBLE:
            return Outcome(variant, Answer.INFEASIBLE)
        if verdict is not Verdict.FOUND:
            return Outcome(variant, Answer.UNDECIDED)
        try:
            channel = make_channel(variant, proofs.boxes(), 0.0, None)
            path = path_through(ended(variant, channel), channel)
        except (GeometryError, PlanError):  # A cell with a cusp: the channel is proved free all the same.
            return Outcome(variant, Answer.FOUND)
        return Outcome(variant, Answer.FOUND, densified(path, configuration_scale(variant.tree), STEP))

    def prove(self, problem: PlanningProblem, path: FloatArray) -> Outcome:
        """Try to prove a given path free in a variant; a failure proves nothing."""
        free, tried = is_free(problem, path)
        self.spent += tried // BOXES_PER_SLICE
        return Outcome(problem, Answer.FOUND if free else Answer.UNDECIDED, path if free else None)

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
    search = _Bracketing(ask, improve, refuted)
    amount = min(amounts.first, amounts.most)
    while not search.step(amount) and amount < amounts.most and search.asked < amounts.asked:
        amount = min(2.0 * amount, amounts.most)
    while search.found is not None and search.asked < amounts.asked:
        wanted = max(amounts.resolution, amounts.fraction * search.found)
        if search.found - search.missed > wanted:
            search.step(0.5 * (search.found + search.missed))
        elif search.unproved - search.proved > wanted:
            search.step(0.5 * (search.unproved + search.proved))
        else:
            break
    return Bracket(search.refuted, search.found, search.most, search.outcome)


class _Bracketing:
    """The amounts asked so far."""

    def __init__(
        self,
        ask: Callable[[float], Outcome],
        improve: Callable[[float, Outcome], tuple[float, Outcome]],
        refuted: float | None,
    ) -> None:
        self._ask, self._improve = ask, improve
        self.refuted = refuted
        self.found: float | None = None
        self.outcome: Outcome | None = None
        self.missed = 0.0  # Largest amount without a channel, proved or not.
        self.unproved = 0.0  # Smallest amount without a channel and without a proof, 0 if there is none.
        self.most, self.asked = 0.0, 0

    @property
    def proved(self) -> float:
        """Largest amount that is proved not to be enough, 0 if there is none."""
        return self.refuted or 0.0

    def step(self, amount: float) -> bool:
        """Ask about one amount; returns whether a channel was found."""
        self.asked += 1
        self.most = max(self.most, amount)
        outcome = self._ask(amount)
        if outcome.answer is Answer.FOUND:
            self.found, self.outcome = self._improve(amount, outcome)
            self.missed, self.unproved = min(self.missed, self.found), min(self.unproved, self.found)
            return True
        self.missed = max(self.missed, amount)
        if outcome.answer is Answer.INFEASIBLE:
            self.refuted = max(amount, self.proved)
            self.unproved = self.unproved if self.unproved > amount else 0.0
        else:
            self.unproved = min(self.unproved or amount, amount)
        return False


# Whether the team blocks itself: the problem without walls, and with pairs of bodies that may overlap.

BEYOND = 2.0
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
    rim = BEYOND * problem.tree.reach
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

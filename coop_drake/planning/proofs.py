"""Proofs that no plan exists, by explorations of a question and of parts of its team and floor."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import combinations

import shapely
from shapely import Polygon
from shapely.errors import ShapelyError

from coop_drake.answers.plan import MixedCell
from coop_drake.answers.problem import PlanningProblem
from coop_drake.answers.proof import InfeasibilityProof
from coop_drake.errors import GeometryError
from coop_drake.planning.cells.cells import FreeBox
from coop_drake.planning.cells.exploration import Exploration, ExplorationResult, Verdict, Watch
from coop_drake.planning.certificates import Witnesses, slices_proof
from coop_drake.planning.questions import marginal_workspace, relaxed, shrunk
from coop_drake.planning.sampling.sampler import Sampler, SubsystemHierarchy
from coop_drake.tree.pose import FloatArray

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


@dataclass(frozen=True)
class Refutation:
    """A proof that no plan exists.

    Attributes:
        reason: Why, in a sentence.
        robots: Robots that the proof is about, with the object.
        proof: The proof in a form that can be checked again.
    """

    reason: str
    robots: tuple[int, ...]
    proof: InfeasibilityProof


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
        self.refutation: Refutation | None = None

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
        witnesses = Witnesses(self._problem.tree, exploration.swept, exploration.pairs, exploration.maker)
        proof = slices_proof(question, exploration.slices, exploration.over_leaves(), witnesses)
        if proof is None:
            return False
        reason = f"the over-approximations of {self._words(chosen)} separate start from goal"
        self.refutation = Refutation(reason, chosen, proof)
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


def refuted_at_an_end(problem: PlanningProblem, watch: Watch | None = None) -> tuple[Refutation | None, int]:
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

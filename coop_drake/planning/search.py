"""The search for a channel of free boxes, or for a proof that none exists: which method runs when.

1. Paths are sampled and covered with boxes that are proved free; most questions end here.
2. It is tested whether the goal is in collision for all values of its free joints.
3. Explorations of cells for few robots, more samples, and paths through narrow passages take turns.
4. Explorations of the whole team and of its relaxations take turns with more samples, with twice the slices
   in every round, until one of them answers or the budget is spent.

A sampled path is then moved away from the walls and covered again.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from functools import cached_property
from time import thread_time

from shapely.errors import ShapelyError

from coop_drake.answers.plan import SearchReport
from coop_drake.answers.problem import PlanningProblem
from coop_drake.errors import GeometryError, PatienceError, PlanError
from coop_drake.planning.cells.as_printed import PaperExploration
from coop_drake.planning.cells.exploration import Exploration, Verdict, Watch
from coop_drake.planning.certificates import Witnesses, slices_proof
from coop_drake.planning.channel import (
    Channel,
    CoveredPath,
    NoChannel,
    make_channel,
    middle_of,
)
from coop_drake.planning.proofs import Proofs, blocked_goal, clearance_bound, refuted_at_an_end, touch_at_goal
from coop_drake.planning.questions import (
    check_question,
    goal_beyond_limits,
    within_limits,
)
from coop_drake.planning.rescaling import Rescaling
from coop_drake.planning.sampled_search import SampledSearch, ending_freely
from coop_drake.progress import Progress
from coop_drake.tree.arrays import FloatArray
from coop_drake.tree.component_tree import usual_unit

FURTHER_ATTEMPTS, ATTEMPTS_PER_ROUND = 2, 3
"""Sampled attempts after the first one, and those in every round of explorations."""

ROUTED_ATTEMPTS = 2
"""Sampled attempts along a route, one for each clearance."""

ENOUGH_BLOCKED_ATTEMPTS = 2
"""If so many attempts in a row find no path for the object alone, a proof is more likely than a path."""

OBJECT_BUDGET_DIVISOR = 2
"""An exploration of an object that seems blocked may make this fraction of all slices, one half."""

SHORT_EXPLORATION = 400
"""Slices of an exploration of the object that is interposed because sampling failed: half a second."""

FIRST_EXPLORATION = 250
"""Slices of each exploration in the first round; every further round doubles it."""

FEW_ROBOTS = 1
"""Robots that are kept in explorations before paths through narrow passages are sampled."""

NARROW_ATTEMPTS = 3
"""Attempts to find paths through narrow passages, one in each round at first: one of three robots takes four
seconds, and a round of explorations ten or more."""


def find_channel(
    problem: PlanningProblem, progress: Progress | None = None, watch: Watch | None = None
) -> tuple[Channel | NoChannel, SearchReport]:
    """Find a channel or prove that there is none; like ``find_path`` with the channel made.

    Returns:
        The channel, or why there is none, and a report.
    """
    answer, report = find_path(problem, progress, watch)
    if not isinstance(answer, CoveredPath):
        return answer, report
    try:
        return answer.channel(), report
    except GeometryError as error:
        return NoChannel(False, str(error)), report


def find_path(
    problem: PlanningProblem,
    progress: Progress | None = None,
    watch: Watch | None = None,
    *,
    route: FloatArray | None = None,
) -> tuple[CoveredPath | Channel | NoChannel, SearchReport]:
    """Find a path that boxes cover, or prove that there is none; then move it away from the walls.

    Only explorations of cells may answer "infeasible". Budgets are counted in
    samples and slices, never in time, so the same question has the same answer.

    Args:
        problem: The question.
        progress: Called with a phase and the fraction of it that is done.
        watch: Called with the events of explorations.
        route: Route for a disc, along which alone paths are sampled, shape (k, 2) [m]; it proves nothing.

    Returns:
        A sampled path, the channel of an exploration, or why there is neither, and a report.

    Raises:
        PlanError: If the question has no meaning; names the entry and what is allowed.
    """
    check_question(problem)
    beyond = goal_beyond_limits(problem)
    if beyond is not None:
        proof, slices = blocked_goal(problem)
        return NoChannel(True, beyond, proof), SearchReport(slices)
    unit = usual_unit(problem.tree)
    scale = None if unit == 1.0 else Rescaling(problem, unit)
    question, seen = (problem, watch) if scale is None else (scale.question(), scale.watched(watch))
    answer: CoveredPath | Channel | NoChannel
    if problem.settings.strategy != "portfolio":
        answer, report = search_by_cells(question, progress, seen)
    else:
        route = None if route is None else route / unit
        answer, report = _Search(question, progress, seen, unit, route=route).run()
    return (answer if scale is None else scale.answer(answer)), report


class _Search:
    """One search by samples and by cells in turns.

    Args:
        problem: The question.
        progress: Called with a phase and the fraction of it that is done.
        watch: Called with the events of explorations.
        unit: The question's unit of length, for sentences [m].
        route: Route along which alone paths are sampled, shape (k, 2).
    """

    def __init__(
        self,
        problem: PlanningProblem,
        progress: Progress | None,
        watch: Watch | None,
        unit: float,
        *,
        route: FloatArray | None,
    ) -> None:
        self._began, self._unit, self._route = thread_time(), unit, route
        self._first_plan: float | None = None
        self._problem, self._progress, self._watch = problem, progress, watch
        self._samples = SampledSearch(within_limits(problem), route)
        self._explored_slices = self._other_slices = self._narrow_attempts = 0

    @cached_property
    def _proofs(self) -> Proofs:
        """Explorations; most questions need none."""
        return Proofs(self._problem, self._watch)

    def run(self) -> tuple[CoveredPath | Channel | NoChannel, SearchReport]:
        """Sample, then prove and sample in turns."""
        return self._answer(), SearchReport(self._slices(), self._first_plan)

    def _answer(self) -> CoveredPath | Channel | NoChannel:
        found = self._sampled(1 if self._route is None else ROUTED_ATTEMPTS)
        if found is not None:
            return self._with_margin(found)
        if self._route is not None:
            return NoChannel(False, "no path along a route was found")
        blocked, slices = blocked_goal(self._problem)
        self._other_slices += slices
        if blocked:
            reason = (
                "at the goal, within all its tolerances, the team collides for all values of its free joints"
            )
            return NoChannel(True, reason, blocked)
        elsewhere = ending_freely(self._problem)
        if elsewhere is not None:
            self._samples = SampledSearch(elsewhere)
            found = self._sampled(1)
            if found is not None:
                return self._with_margin(found)
        refutation, slices = refuted_at_an_end(self._problem, self._watch)
        self._other_slices += slices
        if refutation is not None:
            return refutation
        budget = self._problem.settings.max_slices
        each, short = min(FIRST_EXPLORATION, budget), min(SHORT_EXPLORATION, budget)
        object_blocked = self._samples.object_blocked > 0
        if not object_blocked or self._explored(short, robots=0) is not Verdict.INFEASIBLE:
            found = self._sampled(FURTHER_ATTEMPTS, self._proofs.blocked_part)
            object_blocked = found is None and self._samples.object_blocked >= ENOUGH_BLOCKED_ATTEMPTS
        if found is None and self._proofs.refutation is None:
            found = self._narrow(short if object_blocked else each, object_blocked)
        if found is None and object_blocked and self._proofs.refutation is None:
            self._explored(budget // OBJECT_BUDGET_DIVISOR, robots=0)
        while found is None:
            before = self._proofs.blocked_part
            verdict = self._explored(each)
            if self._proofs.refutation is not None:
                return self._proofs.refutation
            if verdict is Verdict.FOUND:
                self._first_plan = thread_time() - self._began
                return self._around(make_channel(self._problem, self._proofs.boxes(), None))
            found = self._sampled(ATTEMPTS_PER_ROUND, before)
            if found is None and 0 < self._narrow_attempts < NARROW_ATTEMPTS:
                found = self._narrow_sampled()
            if found is None and (verdict is Verdict.RESOLUTION or self._proofs.slices >= budget):
                return self._undecided(verdict)
            each = min(2 * each, budget)
        return self._with_margin(found)

    def _sampled(self, attempts: int, part: tuple[int, ...] | None = None) -> CoveredPath | None:
        """Sample paths, of a part of the team first, and cover them; fewer times if the object is blocked."""
        report = self._phase("sampling paths")
        report(0.0)
        for found in self._samples.attempts(attempts, report, part):
            if found is not None:
                self._first_plan = thread_time() - self._began
                return found
            if self._samples.object_blocked == ENOUGH_BLOCKED_ATTEMPTS:
                return None
        return None

    def _narrow(self, slices: int, object_blocked: bool) -> CoveredPath | None:
        """Look for narrow passages, unless a short exploration of few robots answers the question."""
        robots = 0 if object_blocked else FEW_ROBOTS
        verdict = self._explored(slices, robots, untested=object_blocked)
        return None if verdict in (Verdict.INFEASIBLE, Verdict.FOUND) else self._narrow_sampled()

    def _narrow_sampled(self) -> CoveredPath | None:
        """Sample paths through narrow passages, other ones each time."""
        phase, first = self._phase("sampling narrow passages"), self._proofs.blocked_part == ()
        found = self._samples.narrow_attempt(self._narrow_attempts, phase, object_first=first)
        self._narrow_attempts += 1
        if found is not None:
            self._first_plan = thread_time() - self._began
        return found

    def _around(self, channel: Channel) -> CoveredPath | Channel:
        """A sampled path around a channel if one is found: slices leave narrower passages free."""
        with suppress(GeometryError, PlanError, ShapelyError):
            found = self._samples.around(middle_of(channel, self._problem.start))
            return channel if found is None else self._with_margin(found)
        return channel

    def _explored(self, slices: int, robots: int | None = None, *, untested: bool = True) -> Verdict:
        report = self._phase("exploring slices")
        most = self._problem.settings.max_slices
        verdict = self._proofs.run(slices, robots, lambda count: report(count / most), untested=untested)
        self._explored_slices = self._proofs.slices
        return verdict

    def _with_margin(self, found: CoveredPath) -> CoveredPath:
        """The best path, moved away from the walls."""
        try:
            self._phase("moving the path away from the walls")(0.0)
            return self._samples.with_margin(found, min(1.0, self._problem.settings.effort))
        except (GeometryError, ShapelyError, PatienceError):
            return found

    def _undecided(self, verdict: Verdict) -> NoChannel:
        bound, slices = clearance_bound(self._problem)
        self._other_slices += slices
        reason = verdict.explanation(self._slices())
        if bound is not None:
            reason += f"; it is proved that no path keeps {self._unit * bound:g} m from the walls"
        touch = touch_at_goal(self._problem)
        reason += "" if touch is None else f"; {touch}"
        return NoChannel(False, reason, mixed=self._proofs.undecided())

    def _slices(self) -> int:
        return self._other_slices + self._samples.slices + self._explored_slices

    def _phase(self, name: str) -> Callable[[float], None]:
        """A function that reports the fraction of a phase that is done."""
        progress = self._progress
        return (lambda fraction: None) if progress is None else (lambda fraction: progress(name, fraction))


# Search by cells alone, without samples: with our order of splits, or as the paper prints it.


def search_by_cells(
    problem: PlanningProblem, progress: Progress | None = None, watch: Watch | None = None
) -> tuple[Channel | NoChannel, SearchReport]:
    """Search by cells alone, at margin zero.

    Args:
        problem: The question; its strategy is ``cells`` or ``paper``.
        progress: Called with a phase and the fraction of the slices that are made.
        watch: Called with the events of the exploration.

    Returns:
        The channel, or why there is none, and a report.
    """
    explore = PaperExploration if problem.settings.strategy == "paper" else Exploration
    exploration, most = explore(problem, None, watch), problem.settings.max_slices
    outcome = exploration.run(
        most, None if progress is None else lambda count: progress("exploring slices", count / most)
    )
    report = SearchReport(outcome.slices)
    if outcome.verdict is Verdict.FOUND:
        return make_channel(problem, exploration.boxes(outcome.path), None), report
    if outcome.verdict is not Verdict.INFEASIBLE:
        reason = outcome.verdict.explanation(outcome.slices)
        return NoChannel(False, reason, mixed=exploration.undecided(outcome.path)), report
    witnesses = Witnesses(problem.tree, exploration.swept, exploration.maker)
    proof = slices_proof(problem, exploration.slices, exploration.over_leaves(), witnesses)
    if proof is None:
        return NoChannel(False, "a proof of infeasibility was found but cannot be written down"), report
    reason = f"the over-approximations of {outcome.slices} slices separate start from goal"
    return NoChannel(True, reason, proof), report

"""Find a channel of free boxes from start to goal, or prove that there is none; margin first (rule 1)."""

from __future__ import annotations

from collections.abc import Callable
from time import process_time

from shapely.errors import ShapelyError

from coop_drake.answers.problem import PlanningProblem
from coop_drake.answers.proof import InfeasibilityProof
from coop_drake.answers.search_report import SearchReport
from coop_drake.errors import GeometryError
from coop_drake.planning.boxes.channel import Channel, NoChannel, Way
from coop_drake.planning.cells.events import Watch
from coop_drake.planning.cells.exploration import Verdict
from coop_drake.planning.proofs.blocked_goals import blocked_goal
from coop_drake.planning.proofs.clearance_bound import clearance_bound
from coop_drake.planning.proofs.proofs import Proofs
from coop_drake.planning.questions.question_checks import check_question, goal_beyond_limits
from coop_drake.planning.search.attempts import Chain, SampledAttempts
from coop_drake.planning.search.rescaling import Rescaling
from coop_drake.planning.search.strategies import explored_channel
from coop_drake.tree.usual_unit import usual_unit

Progress = Callable[[str, float], None]
_TRIES = 4
_OBJECT_TRIES = 2
_OBJECT_SHARE = 2
_SHORT_SHARE = 120
_FIRST_SHARE = 250
_FEW_ROBOTS = 1


def find_channel(
    problem: PlanningProblem, progress: Progress | None = None, watch: Watch | None = None
) -> tuple[Channel | NoChannel, SearchReport]:
    """Find a channel at any margin or prove that there is none; ``find_way`` with its channel made.

    Args:
        problem: The question.
        progress: Called with a phase and the share of it that is done.
        watch: Called with the events of explorations.

    Returns:
        The channel, or why there is none, and a report.
    """
    answer, report = find_way(problem, progress, watch)
    if not isinstance(answer, Way):
        return answer, report
    try:
        return answer.channel(), report
    except GeometryError as error:
        return NoChannel(False, str(error)), report


def find_way(
    problem: PlanningProblem, progress: Progress | None = None, watch: Watch | None = None
) -> tuple[Way | Channel | NoChannel, SearchReport]:
    """Find a way at any margin or prove that there is none, then look for a larger margin.

    Sampled paths that are covered with proved boxes come first, explorations by cells in turns with more of
    them later; only these may answer "infeasible", and only at margin zero. Budgets are counted in samples
    and slices, never in time, so the same question has the same answer.

    Args:
        problem: The question.
        progress: Called with a phase and the share of it that is done.
        watch: Called with the events of explorations.

    Returns:
        A sampled way, the channel of an exploration, or why there is neither, and a report.

    Raises:
        PlanError: If the question cannot be meant; names the entry and what is allowed.
    """
    check_question(problem)
    beyond = goal_beyond_limits(problem)
    if beyond is not None:
        proof, slices = blocked_goal(problem)
        report = SearchReport(slices, 0, 0, ((0.0, Verdict.INFEASIBLE.value),))
        return NoChannel(True, beyond, proof), report
    unit = usual_unit(problem.tree)
    if unit == 1.0:
        return _answered(problem, progress, watch)
    scale = Rescaling(problem, unit)
    answer, report = _answered(scale.question(), progress, scale.watched(watch), unit)
    return scale.answer(answer), scale.report(report)


def _answered(
    problem: PlanningProblem, progress: Progress | None, watch: Watch | None, unit: float = 1.0
) -> tuple[Way | Channel | NoChannel, SearchReport]:
    if problem.settings.strategy != "portfolio":
        return explored_channel(problem, progress, watch)
    return _Search(problem, progress, watch, unit).run()


class _Search:
    """One search: its two halves and what they took; its unit of length in metres, for words."""

    def __init__(
        self, problem: PlanningProblem, progress: Progress | None, watch: Watch | None, unit: float
    ) -> None:
        self._began, self._unit = process_time(), unit
        self._first: float | None = None
        self._problem, self._progress = problem, progress
        self._attempts = SampledAttempts(problem)
        self._proofs = Proofs(problem, watch)
        self._tried: list[tuple[float, str]] = []
        self._goal_slices = self._bound_slices = 0

    def run(self) -> tuple[Way | Channel | NoChannel, SearchReport]:
        """Sample, then prove and sample in turns; see ``find_way``."""
        chain = self._sampled(1)
        if chain is not None:
            return self._with_margin(chain)
        blocked, self._goal_slices = blocked_goal(self._problem)
        if blocked:
            return self._refuted("the team collides at the goal pose whatever its free joints", blocked)
        budget = self._problem.settings.max_slices
        share, short = min(_FIRST_SHARE, budget), min(_SHORT_SHARE, budget)
        doubted = self._attempts.object_blocked > 0
        if not doubted or self._explored(short, robots=0) is not Verdict.INFEASIBLE:
            chain = self._sampled(_TRIES - 2)
            doubted = chain is None and self._attempts.object_blocked >= _OBJECT_TRIES
        if chain is None and self._proofs.refutation is None:
            chain = self._squeezed(short if doubted else share, doubted)
        if chain is None and doubted and self._proofs.refutation is None:
            self._explored(budget // _OBJECT_SHARE, robots=0)
        while chain is None:
            verdict = self._explored(share)
            refutation = self._proofs.refutation
            if refutation is not None:
                return self._refuted(refutation.reason, refutation.proof)
            if verdict is Verdict.FOUND:
                return self._explored_channel()
            chain = self._sampled(_TRIES)
            if chain is None and (verdict is Verdict.RESOLUTION or self._proofs.slices >= budget):
                return self._undecided(verdict)
            share = min(2 * share, budget)
        return self._with_margin(chain)

    def _sampled(self, tries: int) -> Chain | None:
        """Boxes along sampled paths, proved; no proof of anything if there are none."""
        told = self._teller("sampling paths")
        told(0.0)
        for _ in range(tries):
            chain = self._attempts.first(told)
            if chain is not None:
                self._first = process_time() - self._began
                return chain
            if self._attempts.object_blocked == _OBJECT_TRIES:
                return None
        return None

    def _squeezed(self, share: int, doubted: bool) -> Chain | None:
        """A chain near one for a larger floor, unless a short exploration of few robots has the answer."""
        verdict = self._explored(share, 0 if doubted else _FEW_ROBOTS, doubted=doubted)
        if verdict in (Verdict.INFEASIBLE, Verdict.FOUND):
            return None
        chain = self._attempts.squeezed(self._teller("squeezing paths through"))
        if chain is not None:
            self._first = process_time() - self._began
        return chain

    def _explored(self, share: int, robots: int | None = None, *, doubted: bool = True) -> Verdict:
        told = self._teller("exploring slices")
        most = self._problem.settings.max_slices
        return self._proofs.run(share, robots, lambda count: told(count / most), doubted=doubted)

    def _with_margin(self, chain: Chain) -> tuple[Way, SearchReport]:
        """The way at the largest margin that is found."""

        def told(margin: float, share: float) -> None:
            self._teller(f"searching at margin {self._unit * margin:.3f} m")(share)

        try:
            best = self._attempts.with_margin(chain, self._tried, told)
        except (GeometryError, ShapelyError):
            best = chain
            self._tried.append((0.0, "found"))
        return self._attempts.way(best, chain), self._report(len(best.boxes), 0)

    def _explored_channel(self) -> tuple[Channel, SearchReport]:
        self._first = process_time() - self._began
        self._tried.append((0.0, Verdict.FOUND.value))
        channel = self._attempts.channel_of(self._proofs.boxes())
        return channel, self._report(*self._proofs.counts())

    def _refuted(self, reason: str, proof: InfeasibilityProof | None) -> tuple[NoChannel, SearchReport]:
        self._tried.append((0.0, Verdict.INFEASIBLE.value))
        return NoChannel(True, reason, proof), self._report(0, 0)

    def _undecided(self, verdict: Verdict) -> tuple[NoChannel, SearchReport]:
        self._tried.append((0.0, verdict.value))
        mixed = self._proofs.undecided()
        resolution = max((cell.share for cell in mixed), default=None)
        bound, self._bound_slices = clearance_bound(self._problem)
        reason = f"no answer after {self._slices()} slices: {verdict.value}"
        if bound is not None:
            reason += f"; it is proved that no way keeps {self._unit * bound:g} m from the walls"
        return NoChannel(False, reason, mixed=mixed), self._report(*self._proofs.counts(), resolution)

    def _slices(self) -> int:
        return self._goal_slices + self._bound_slices + self._attempts.slices + self._proofs.slices

    def _report(self, free: int, mixed: int, resolution: float | None = None) -> SearchReport:
        tried = tuple(self._tried)
        return SearchReport(self._slices(), free, mixed, tried, resolution, self._first)

    def _teller(self, phase: str) -> Callable[[float], None]:
        """Tell the share of a phase, or nobody."""
        progress = self._progress
        return (lambda share: None) if progress is None else (lambda share: progress(phase, share))

"""The chain for Python: plan, verify, explain and show a scenario, each with one call."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from coop_drake.answers.plan import BeyondLimits, Found, Infeasible, Plan, PlanningResult, Undecided
from coop_drake.answers.problem import PlanningProblem
from coop_drake.answers.proof import InfeasibilityProof
from coop_drake.errors import PlanError
from coop_drake.laws.gains import GainSet, ScheduledGains
from coop_drake.progress import Progress

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from coop_drake.answers.log import SimulationLog
    from coop_drake.diagnosis import Diagnosis
    from coop_drake.scenario import Scenario
    from coop_drake.verification import Verified

_SCHEDULED = "scheduled"
"""Name of the gain set of a problem that comes without a scenario."""


def plan(
    question: Scenario | PlanningProblem,
    gains: str | None = None,
    *,
    effort: float | None = None,
    progress: Progress | None = None,
) -> PlanningResult:
    """Find a plan for a scenario or a planning problem, or prove that none exists.

    The plan holds under the budget that the scenario's ``deployment.budget`` requires.

    Args:
        question: A scenario, or a planning problem, which is planned with scheduled gains.
        gains: Name of one of the scenario's gain sets, or a file that holds one; None for the one that the
            scenario selects.
        effort: Work spent on a quicker transport, as a share of the default; None for the question's own.
        progress: Called with a stage and the fraction of it that is done.

    Returns:
        `Found` with the plan in ``plan``, `BeyondLimits` with one that limits refuse, `Infeasible` with the
        reason and a proof, or `Undecided` with what stood in the way.

    Raises:
        ScenarioError: The scenario's models make no team, or there is no gain set of that name.
        ValueError: The effort is negative or no number.
    """
    from coop_drake.planning.planner import plan as plan_problem

    ask = partial(plan_problem, effort=effort, progress=progress)
    if isinstance(question, PlanningProblem):
        return ask(question, ScheduledGains(), gain_set_name=_SCHEDULED)
    from coop_drake.plant import planning_problem
    from coop_drake.plant.facts import budget_of
    from coop_drake.scenario import with_gains

    scenario = with_gains(question, gains)
    name = scenario.selected_gains
    problem = planning_problem(scenario)
    budget = budget_of(None, scenario, problem)
    return ask(problem, scenario.gain_sets[name], gain_set_name=name, budget=budget)


def verify(
    answer: PlanningResult | Plan | InfeasibilityProof | Path | str,
    question: Scenario | PlanningProblem,
    *,
    progress: Progress | None = None,
) -> Verified:
    """Check a plan or a proof of infeasibility by code of its own; only the rule of the gains is shared.

    The log of a run is checked by `verify_run`.

    Args:
        answer: What `plan` returned, its plan or its proof, or a file that holds one.
        question: The scenario or the planning problem that it answers.
        progress: Called with a stage and the fraction of it that is done.

    Returns:
        What was checked, and how close it came to being refused.

    Raises:
        PlanError: The answer is undecided, or the file holds neither a plan nor a proof.
        RefusalError: Names the first claim that does not hold.
    """
    from coop_drake.verification import verify_file, verify_plan, verify_proof

    problem, gain_sets = _problem_and_gains(question)
    budgets = None
    if not isinstance(question, PlanningProblem):
        from coop_drake.plant.facts import scenario_budgets

        budgets = scenario_budgets(question, problem)
    if isinstance(answer, Path | str):
        return verify_file(answer, problem, gain_sets, progress, budgets=budgets)
    if isinstance(answer, Found | BeyondLimits):
        answer = answer.plan
    if isinstance(answer, Plan):
        return verify_plan(answer, problem, gain_sets, progress, budgets=budgets)
    proof = answer.proof if isinstance(answer, Infeasible) else answer
    if proof is None or isinstance(proof, Undecided):
        raise PlanError("an undecided answer proves nothing; expected a plan or a proof of infeasibility")
    return verify_proof(proof, problem, progress)


def verify_run(
    log: SimulationLog | Path | str,
    plan: Plan | Path | str,
    scenario: Scenario,
    *,
    braked: bool = False,
    progress: Progress | None = None,
) -> Verified:
    """Check a plan, and then by the log of a run that it was followed and nothing touched.

    Args:
        log: What `simulate` returned, or the file of a log.
        plan: The plan that was followed, or its file.
        scenario: The scenario that was simulated.
        braked: Whether all drives braked in the run: it is then not checked that the plan was followed.
        progress: Called with a stage and the fraction of it that is done.

    Returns:
        What was checked, and how close it came to being refused.

    Raises:
        PlanError: A file holds no log or no plan.
        RefusalError: Names the first claim that does not hold; of a log array, index and time.
    """
    from coop_drake.answers.log import SimulationLog
    from coop_drake.answers.plan import load_plan
    from coop_drake.plant import planning_problem, run_setup
    from coop_drake.plant.facts import scenario_budgets
    from coop_drake.verification import verify_plan
    from coop_drake.verification.runs import verify_log

    log = log if isinstance(log, SimulationLog) else SimulationLog.load(log)
    plan = plan if isinstance(plan, Plan) else load_plan(plan)
    problem = planning_problem(scenario)
    budgets = scenario_budgets(scenario, problem)
    of_plan = verify_plan(plan, problem, scenario.gain_sets, progress, budgets=budgets)
    verified = verify_log(log, plan, problem, run_setup(scenario), progress, braked=braked)
    return replace(verified, checks=(*of_plan.checks, *verified.checks))


def why(question: Scenario | PlanningProblem, *, progress: Progress | None = None) -> Diagnosis:
    """Explain why no plan exists or none was found, and what would help.

    Args:
        question: The scenario or the planning problem.
        progress: Called with a stage and the fraction of the work's budget that is spent.

    Returns:
        The diagnosis; `sentences_of` and `diagnosis_figure` put it into words and into a picture.
    """
    from coop_drake.diagnosis import diagnose

    return diagnose(_problem_and_gains(question)[0], progress)


def show(question: Scenario | PlanningProblem, plan: Plan | None = None, caption: str = "") -> Figure:
    """Draw the floor, the team at start and goal, and the cells of a plan if given, with a caption below."""
    from coop_drake.drawing import house_style
    from coop_drake.viz.figures import overview_figure

    with house_style():
        return overview_figure(_problem_and_gains(question)[0], plan, caption)


def _problem_and_gains(
    question: Scenario | PlanningProblem,
) -> tuple[PlanningProblem, dict[str, GainSet]]:
    if isinstance(question, PlanningProblem):
        return question, {_SCHEDULED: ScheduledGains()}
    from coop_drake.plant import planning_problem

    return planning_problem(question), dict(question.gain_sets)

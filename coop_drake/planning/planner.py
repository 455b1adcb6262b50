"""The planner: search for a path and make a plan of it, or prove that none exists."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from functools import partial
from math import ceil, inf
from time import thread_time
from typing import TYPE_CHECKING

import numpy as np
from shapely.errors import ShapelyError

from coop_drake.answers.budget import Budget
from coop_drake.answers.document import problem_digest
from coop_drake.answers.motion import Motion, cell_times, pull_gains
from coop_drake.answers.plan import (
    SLOWEST_AGE,
    BeyondLimits,
    Found,
    Infeasible,
    Plan,
    PlanningResult,
    SearchReport,
    Undecided,
)
from coop_drake.answers.problem import PlanningProblem, TeamLimits
from coop_drake.errors import GeometryError, PatienceError, PlanError, StallError, TooQuickError, TooSlowError
from coop_drake.laws import GainSet, ScheduledGains
from coop_drake.planning.cell_selection import quickest_plan
from coop_drake.planning.channel import Channel, CoveredPath, NoChannel, ended
from coop_drake.planning.duration import plan_time
from coop_drake.planning.limits import limit_too_low, refusals, without_limits
from coop_drake.planning.questions import SAME_END
from coop_drake.planning.sampling.routes import local_question
from coop_drake.planning.search import find_path
from coop_drake.progress import Progress
from coop_drake.tree.component_tree import nearest_turn

if TYPE_CHECKING:
    from coop_drake.planning.tolerance import BeyondBudget

FINER_ATTEMPTS = 2
"""Number of further searches after a path that cannot be executed, each with half the margin."""

_FAILURES = (GeometryError, PlanError, StallError, ShapelyError)
"""What is raised where no plan can be made along a way."""

AGE_FACTORS = (1.0, 1.5, 2.0, 3.0, 4.5, SLOWEST_AGE)
"""Gains are tried for so many times the age of the gain set's commands until no limit of acceleration acts
[-]."""


def plan(
    problem: PlanningProblem,
    gain_set: GainSet,
    *,
    gain_set_name: str,
    budget: Budget | None = None,
    effort: float | None = None,
    progress: Progress | None = None,
) -> PlanningResult:
    """Find a plan, or prove that none exists.

    A path may be found that cannot be executed, because a passage is less than a millimetre wide or takes
    minutes. The search is then repeated with a smaller margin, which gives other cells. If that does not
    help, the answer is a plan for a team without limits, and the limits that it breaks.

    On a large floor a plan is looked for near a short route first, so that time grows with the length of the
    way. What is free on that part of the floor is free on the floor.

    Args:
        problem: What is asked.
        gain_set: Gains, fixed or to be scheduled.
        gain_set_name: Name under which the scenario knows them.
        budget: Departures from the ideal team that the plan shall tolerate; only of a team that passes.
        effort: As ``PlannerSettings`` has it, in place of that of the problem.
        progress: Called with a phase and the fraction of it that is done. If it raises PatienceError, a plan
            is finished along the way that is certified by then; without one, the error goes to the caller.

    Raises:
        ValueError: The effort is negative or no number, the team shall rest in every cell under a budget, or
            pass from cell to cell with bases that are not known.

    Returns:
        Found with the plan, BeyondLimits with a plan that limits refuse, Infeasible or Undecided.
    """
    if effort is not None:
        if not 0.0 <= effort < inf:
            raise ValueError(f"effort is {effort}; allowed are numbers of 0 or more")
        problem = replace(problem, settings=replace(problem.settings, effort=effort))
    if problem.passes and not problem.limits.base_components:
        raise ValueError("a team that passes from cell to cell needs limits.base_components")
    if not problem.passes and budget is not None:
        raise ValueError("a budget needs a team that passes from cell to cell")
    # Floors are remembered by question, and the caller may change the arrays of a question between two calls.
    problem = replace(problem, start=problem.start.copy(), goal_pose=problem.goal_pose.copy())
    local, near = local_question(problem), None
    if local is not None:
        part, route = local
        near = _answer(part, gain_set, gain_set_name, budget, progress, partial(find_path, route=route))
        if isinstance(near, Found | BeyondLimits):
            near = replace(near, plan=replace(near.plan, problem=problem_digest(problem)))
        if isinstance(near, Found):
            return near
    answer = _answer(problem, gain_set, gain_set_name, budget, progress, find_path)
    return near if isinstance(answer, Undecided) and isinstance(near, BeyondLimits) else answer


def _answer(
    problem: PlanningProblem,
    gain_set: GainSet,
    gain_set_name: str,
    budget: Budget | None,
    progress: Progress | None,
    search: Callable[..., tuple[CoveredPath | Channel | NoChannel, SearchReport]],
) -> PlanningResult:
    """Answer a question by a search, with smaller margins where its paths cannot be executed."""
    began = thread_time()
    question, report, stall, too_quick, way = problem, SearchReport(0), "", False, None
    for _ in range(1 + FINER_ATTEMPTS):
        answer, latest = search(question, progress)
        report = _added(report, latest)
        if isinstance(answer, NoChannel):
            if answer.proved:
                return Infeasible(answer.reason, report, answer.proof)
            stall = stall or answer.reason
            break
        way, asked = answer, ended(question, answer)
        make = partial(_made, asked, gain_set, gain_set_name, budget)
        try:
            try:
                made = make(answer, progress)
            except PatienceError:  # The way is certified: its plan is finished.
                made = make(answer, None)
        except TooSlowError as error:  # Other cells do not help.
            return Undecided(str(error), report)
        except _FAILURES as error:
            stall = f"a free path exists, but a plan along it cannot be executed: {error}"
            too_quick = isinstance(error, TooQuickError)
            if answer.margin == 0.0 or too_quick:
                break
            question = replace(question, settings=replace(question.settings, margin=0.5 * answer.margin))
        else:
            latest = replace(report, improvements=())
            found = _found(asked, answer, made, make, latest, began, progress)
            return replace(found, plan=_stated(problem, found.plan)) if isinstance(found, Found) else found
    refused = way and _without_limits(problem, way, gain_set, gain_set_name, slowly=too_quick)
    return BeyondLimits(refused, report) if refused else Undecided(stall, report)


def _found(
    problem: PlanningProblem,
    way: Channel | CoveredPath,
    made: Plan | BeyondBudget,
    make: Callable[[CoveredPath], Plan | BeyondBudget],
    report: SearchReport,
    began: float,
    progress: Progress | None,
) -> Found | Undecided:
    """The quickest of a plan and of those along other sampled paths, while the effort asked for lasts.

    The first plan has taken 1 of the effort, and every other path takes at most 1. A way that was found
    without a path has no others. If ``progress`` raises PatienceError, no further path is tried.

    Returns:
        The plan; Undecided if all are beyond the budget.
    """
    best = made if isinstance(made, Plan) else None
    times = [] if best is None else [(thread_time() - began, plan_time(best))]
    effort = problem.settings.effort
    for number in range(1, ceil(effort)):
        if isinstance(way, Channel):
            break
        if progress is not None:
            so_far = f"; the transport takes {times[-1][1]:.1f} s so far" if times else ""
            try:
                progress(f"trying another path{so_far}", number / effort)
            except PatienceError:
                break
        with suppress(*_FAILURES):
            other = way.another(number, min(1.0, effort - number))
            new = None if other is None else make(other)
            if isinstance(new, Plan) and (best is None or plan_time(new) < plan_time(best)):
                best = new
                times.append((thread_time() - began, plan_time(new)))
    if best is None:
        assert not isinstance(made, Plan)
        return Undecided(made.describe(), report)
    return Found(best, replace(report, improvements=tuple(times)))


def _without_limits(
    problem: PlanningProblem, found: Channel | CoveredPath, gain_set: GainSet, name: str, *, slowly: bool
) -> Plan | None:
    """A plan for a team that rests in every cell, without limits, and the limits that refuse it, if any."""
    problem, factor = replace(problem, passes=False), 1.0
    if slowly and isinstance(gain_set, ScheduledGains):
        factor, gain_set = AGE_FACTORS[-1], gain_set.slowed(AGE_FACTORS[-1])
    asked = ended(problem, found)
    try:
        made = quickest_plan(without_limits(asked), found, gain_set, gain_set_name=name)
    except _FAILURES:
        return None
    broken = refusals(asked, made)
    return _stated(problem, replace(made, age_factor=factor, refused_by=broken)) if broken else None


def _stated(problem: PlanningProblem, made: Plan) -> Plan:
    """A plan as an answer to a question, in whose goal it ends, though not always in its middle."""
    values = zip(
        (float(made.goal_pose[2]), *made.goal_joints),
        (float(problem.goal_pose[2]), *problem.goal_joints),
        problem.tree.circular,
        strict=True,
    )
    angle, *joints = [
        _turned(goal, own) if circular and own is not None and goal is not None else goal
        for own, goal, circular in values
    ]
    pose = np.array([*problem.goal_pose[:2], angle])
    return replace(made, problem=problem_digest(problem), goal_pose=pose, goal_joints=tuple(joints))


def _turned(goal: float, near: float) -> float:
    """A goal on a circle after whole turns, nearest to where a plan ends, that itself if rounded [rad]."""
    away = nearest_turn(goal - near)
    return near if abs(away) <= SAME_END else near + away


def _made(
    problem: PlanningProblem,
    gain_set: GainSet,
    name: str,
    budget: Budget | None,
    found: Channel | CoveredPath,
    progress: Progress | None = None,
) -> Plan | BeyondBudget:
    if problem.passes:
        return _passing(problem, found, gain_set, name, budget, progress)
    return _slow_enough(problem, found, gain_set, name, progress)


def _passing(
    problem: PlanningProblem,
    found: Channel | CoveredPath,
    gain_set: GainSet,
    name: str,
    budget: Budget | None,
    progress: Progress | None,
) -> Plan | BeyondBudget:
    """The plan of a team that passes from cell to cell, with its motion: this keeps the limits."""
    from coop_drake.planning.motion import quickest_motion  # Here: it imports scipy.
    from coop_drake.planning.motion_limits import motion_limits
    from coop_drake.planning.tolerance import tolerant_motion

    made: Plan | BeyondBudget
    if budget is not None:
        made = tolerant_motion(problem, found, gain_set, gain_set_name=name, budget=budget, progress=progress)
        if not isinstance(made, Plan):
            return made
    else:
        made = quickest_plan(problem, found, gain_set, gain_set_name=name, progress=progress)
        if progress is not None:
            with suppress(PatienceError):  # The plan is certified: it gets its motion.
                progress("planning the motion through all cells", 0.0)
        age = gain_set.age if isinstance(gain_set, ScheduledGains) else 0.0
        for room in (None, np.zeros(len(made.start) - 2)):  # Narrow cells leave less room.
            find = partial(quickest_motion, made, problem, gains=pull_gains(age), room=room)
            try:
                motion = find(limits=motion_limits(problem.limits))
                break
            except (PlanError, np.linalg.LinAlgError) as error:
                why = error
        else:
            raise StallError(
                f"no motion through its cells without a stop was found: {why}; "
                "there is a plan for a team that rests in every cell (--gains scheduled)"
            ) from why
        _refuse_low_limits(problem, float(cell_times(motion).max()), find)
        made = replace(made, motion=motion)
    assert made.motion is not None  # by both ways
    seconds, longest = cell_times(made.motion), problem.settings.max_transition_time
    if seconds.max() > longest:
        raise StallError(
            f"cell {seconds.argmax()} is refused by planner.max_transition_time: from its entry to the next "
            f"the motion takes {seconds.max():.0f} s; expected at most {longest:.0f} s"
        )
    steps = zip(made.transitions, seconds.tolist(), strict=True)
    timed = tuple(replace(step, estimated_time=time) for step, time in steps)
    return replace(made, transitions=timed)


def _refuse_low_limits(problem: PlanningProblem, seconds: float, find: Callable[..., Motion]) -> None:
    """Refuse a limit that alone makes a cell last longer than is allowed; says with which value it would not.

    Args:
        problem: What was asked.
        seconds: The longest time of a cell [s].
        find: Finds the motion within other limits.
    """
    from coop_drake.planning.motion_limits import motion_limits  # Here: it imports scipy.

    def slowest(limits: TeamLimits) -> float:
        try:
            return float(cell_times(find(limits=motion_limits(limits))).max())
        except (PlanError, np.linalg.LinAlgError):
            return inf

    longest = problem.settings.max_transition_time
    if seconds > longest and (said := limit_too_low(problem.kept_limits, seconds, longest, slowest)):
        raise TooSlowError(said)


def _slow_enough(
    problem: PlanningProblem,
    found: Channel | CoveredPath,
    gain_set: GainSet,
    name: str,
    progress: Progress | None,
) -> Plan:
    """The plan with the quickest gains for which no limit of acceleration acts."""
    last = 1.0
    if isinstance(gain_set, ScheduledGains):
        for factor in AGE_FACTORS[:-1]:
            with suppress(TooQuickError):
                gains = gain_set.slowed(factor)
                made = quickest_plan(problem, found, gains, gain_set_name=name, progress=progress)
                return replace(made, age_factor=factor)
        last, gain_set = AGE_FACTORS[-1], gain_set.slowed(AGE_FACTORS[-1])
    made = quickest_plan(problem, found, gain_set, gain_set_name=name, progress=progress)
    return replace(made, age_factor=last)


def _added(before: SearchReport, latest: SearchReport) -> SearchReport:
    """The latest report with the work of the earlier attempts added."""
    first = before.first_plan_cpu_seconds
    return replace(
        latest,
        slices=before.slices + latest.slices,
        first_plan_cpu_seconds=latest.first_plan_cpu_seconds if first is None else first,
    )

"""Verify what a run's log states, from the log alone, its plan and its scenario.

Each function raises a RefusalError at the first entry for which a statement does not hold, with the name of
the array, the index and the time:

1. It belongs to the plan and the scenario: ``check_belonging`` below.
2. Every number is finite, time passes, cells follow one another: ``rows.check_complete``.
3. It begins at the plan's start and ends at the goal: ``ends``.
4. Rates are the derivatives of positions: ``between.check_motion``.
5. Every state lay in its cell and in its funnel: ``cells.check_cells``, ``funnels.check_funnels``.
6. Robots report what their states say, and cells were entered one by one when all were ready: ``readiness``,
   ``handovers``.
7. Bases, wrenches and efforts go with the motion: ``grasps``, ``mechanics``.
8. Bases and joints kept their limits: ``speeds.check_run_speeds``, ``speeds.check_run_efforts``.
9. Nothing touched: ``clearances.check_clearances``.
10. Nothing departed by more than a budget of the plan states: ``tube.check_budget_used``. Delta E and reports
    are those of its nominal motions: ``nominal_reports``.

Of a run in which all drives braked, statements 5, 6 and 10 are left aside: they are about the plan's laws.
Arrays that no check computes again, or ties to others, are named in the answer.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace

import numpy as np

from coop_drake.answers.log import SimulationLog
from coop_drake.answers.plan import Plan
from coop_drake.answers.plan_file import plan_digest
from coop_drake.answers.problem import PlanningProblem
from coop_drake.errors import RefusalError
from coop_drake.progress import Progress
from coop_drake.verification.checks import Check, Verified
from coop_drake.verification.runs.between import Between, check_motion
from coop_drake.verification.runs.cells import check_cells
from coop_drake.verification.runs.clearances import check_clearances
from coop_drake.verification.runs.ends import check_arrival, check_start
from coop_drake.verification.runs.funnels import check_funnels, check_stated_funnels
from coop_drake.verification.runs.grasps import check_grasps, check_wrenches
from coop_drake.verification.runs.handovers import check_handovers
from coop_drake.verification.runs.holds import check_clock
from coop_drake.verification.runs.mechanics import check_mechanics
from coop_drake.verification.runs.nominal_reports import check_nominal_reports
from coop_drake.verification.runs.readiness import check_energy_margin, check_reference, check_reports
from coop_drake.verification.runs.rows import Rows, check_complete
from coop_drake.verification.runs.setup import RunSetup
from coop_drake.verification.runs.speeds import check_run_efforts, check_run_speeds
from coop_drake.verification.runs.tube import check_budget_used

_FORCES = "the equations of motion, for more than actuators, damping and rigid grasps acts on the bodies"


def verify_log(
    log: SimulationLog,
    plan: Plan,
    problem: PlanningProblem,
    setup: RunSetup,
    progress: Progress | None = None,
    *,
    braked: bool = False,
) -> Verified:
    """Check everything that a log states about a run that arrived.

    Args:
        log: The log.
        plan: The plan that it followed; ``verify_plan`` checks it.
        problem: The problem that the plan solves.
        setup: What the scenario says besides.
        progress: Called with a phase and the fraction of it that is done.
        braked: Whether all drives braked in the run, so that the team did not follow the plan all the time.

    Returns:
        What was checked.

    Raises:
        RefusalError: Names the first entry for which a statement does not hold.
    """
    rows = Rows(log, plan)
    heard = setup.one_hold or not log.held.any()  # without a hold nobody can miss one
    setup = replace(setup, one_hold=heard, one_clock=heard and setup.one_clock, alike=heard and setup.alike)
    checks = [check_belonging(rows, problem, setup), check_complete(rows), check_arrival(rows, problem)]
    checks.append(check_start(rows, setup.displacement))
    between = Between.of(rows)
    checks.append(check_motion(rows, between))
    if not braked:
        checks += _check_laws(rows, between, problem, setup)
    checks += [check_grasps(rows, problem, setup), check_wrenches(rows, setup)]
    if setup.mechanics:
        checks.append(check_mechanics(rows, problem, setup))
    kept = check_run_speeds(rows, problem)
    checks += [] if kept is None else [kept]
    checks += check_run_efforts(rows, problem)
    checks += check_clearances(rows, between, problem, progress)
    if not braked:
        checks += check_budget_used(rows)
        robots = [joint.robot for joint in problem.tree.joints]
        checks += check_nominal_reports(rows, robots) if setup.alike else []
    stayed = "" if braked else ", and the team stayed in cells and funnels"
    aside = _left_aside(setup, braked=braked)
    if log.held.any() and plan.budget is not None and plan.budget.axes and not braked:
        aside.append("how far the axes departed from their nominal motions, for the team was held")
    return Verified(
        "arrived",
        f"run of {log.times[-1]:.2f} s in {len(log.times)} rows",
        tuple(checks),
        f"in this run nothing touched{stayed}, between the rows, too",
        "; ".join(
            [
                *aside,
                *_taken_as_logged(log, checks),
                "that p_G moved along the cells' maps; other runs; that the robots are as in their models",
            ]
        ),
    )


def _taken_as_logged(log: SimulationLog, checks: Sequence[Check]) -> list[str]:
    """Name the arrays of which numbers can be altered without being refused; nothing where there is none."""
    tied = {name for check in checks for name in check.arrays}
    arrays = [field.name for field in fields(log) if isinstance(getattr(log, field.name), np.ndarray)]
    free = [name for name in arrays if name not in tied]
    return [f"these arrays, which are read as they are logged: {', '.join(free)}"] if free else []


def _check_laws(rows: Rows, between: Between, problem: PlanningProblem, setup: RunSetup) -> list[Check]:
    """Check what a run states about the plan's laws: cells, funnels, reports and entries into cells."""
    checks = [*check_cells(rows, between), check_stated_funnels(rows)]
    never_held = not setup.can_be_held and rows.plan.budget is None
    checks.append(check_clock(rows, one_hold=setup.one_hold, never_held=never_held))
    if setup.one_clock:
        checks += check_funnels(rows, between)
    if setup.exact:
        checks += [check_energy_margin(rows), check_reference(rows), check_reports(rows, problem)]
    return [*checks, *check_handovers(rows, exact=setup.exact)]


def _left_aside(setup: RunSetup, *, braked: bool) -> list[str]:
    """What is not checked of a team that departs from the ideal one."""
    if braked:
        laws = (
            "that the team followed the plan: its cells, funnels, reports and budget, for the drives braked"
        )
        return [laws] if setup.mechanics else [laws, _FORCES]
    return [] if setup.mechanics else [_FORCES]


def check_belonging(rows: Rows, problem: PlanningProblem, setup: RunSetup) -> Check:
    """Check that a log is of this plan and of this scenario, and has their joints and robots.

    Raises:
        RefusalError: Names the entry and both values.
    """
    log, plan = rows.log, rows.plan
    joints = tuple(joint.name for joint in problem.tree.joints)
    for where, found, expected in (
        ("plan_digest", log.plan_digest, plan_digest(plan)),
        ("scenario_digest", log.scenario_digest, setup.scenario_digest),
        ("joint_names", log.joint_names, joints),
        ("robot_names", log.robot_names, setup.robot_names),
    ):
        if found != expected:
            raise RefusalError(where, f"{found!r} is not that of the plan and the scenario, {expected!r}")
    if len(log.times) < 2 or log.accelerations.shape[1] != 3 + len(joints):
        raise RefusalError("times", f"has {len(log.times)} rows; expected the rows of a run of this team")
    return Check("the log is of this plan and this scenario", 1)

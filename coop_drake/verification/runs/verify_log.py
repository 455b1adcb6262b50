"""Verify what a run's log states, from the log alone, its plan and its scenario.

Each function raises a RefusalError at the first entry for which a statement does not hold, with the name of
the array, the index and the time:

1. It belongs to the plan and the scenario, begins at the plan's start and ends at the goal: below.
2. Every number is finite, time passes, cells follow one another; rates are the derivatives of positions:
   ``rows``.
3. Every state lay in its cell; robots report what their states say, and cells were entered one by one: while
   the plan's motion lay in both, ``motion``, or in funnels, when all were ready, ``laws``.
4. Bases, wrenches and efforts go with the motion, bases and joints kept their limits: ``bodies``.
5. Nothing touched: ``bodies``.
6. Nothing departed from the motion by more than a budget of the plan states: ``budget``.

Of a run in which all drives braked, statements 3 and 6 are left aside: they are about the plan's laws. Arrays
that no check computes again, or ties to others, are named in the answer.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from coop_drake.answers.log import SimulationLog
from coop_drake.answers.plan import Plan, plan_digest
from coop_drake.answers.problem import PlanningProblem
from coop_drake.errors import RefusalError
from coop_drake.progress import Progress
from coop_drake.tree.arrays import FloatArray
from coop_drake.verification.checks import Check, Verified
from coop_drake.verification.runs import bodies
from coop_drake.verification.runs.budget import check_budget_used
from coop_drake.verification.runs.laws import (
    check_cells,
    check_clock,
    check_energy_margin,
    check_funnels,
    check_handovers,
    check_reference,
    check_reports,
    check_stated_funnels,
)
from coop_drake.verification.runs.motion import check_followed
from coop_drake.verification.runs.rows import Between, Rows, RunSetup, check_complete, check_motion

SAME = 1e-9
"""A run may begin this far from the plan's start [m, rad, and per s]: rounding."""


def check_start(rows: Rows, displacement: FloatArray) -> Check:
    """Check that the run begins at rest where the scenario says, with p_G at the plan's start.

    Under a budget the team may stand off the plan's start by the largest errors of measurement, as a team
    does that has come to rest with constant ones.

    Args:
        rows: The log.
        displacement: How far the team stands off the plan's start, shape (3 + n,) [m, rad].

    Raises:
        RefusalError: Names the entry and the value.
    """
    plan, start = rows.plan, rows.plan.start + displacement
    for name, expected in (
        ("object_pose", start[:3]),
        ("joints", start[3:]),
        ("object_twist", np.zeros(3)),
        ("joint_rates", np.zeros(len(start) - 3)),
        ("governor_position", plan.start[:2]),
    ):
        rows.require_same(name, expected[None], SAME)
    away = float(np.hypot(*displacement[:2])), float(np.abs(displacement[2:]).max())
    if (budget := plan.budget) is not None:
        most = budget.position_noise, budget.angle_noise if budget.axes else np.inf
        for name, found, allowed in zip(("object_pose[0]", "joints[0]"), away, most, strict=True):
            if not found <= allowed + SAME:
                told = f"is off the plan's start by {found:.6g} m or rad; the budget has {allowed:.6g}"
                raise RefusalError(name, told)
    return Check("the run begins at rest, at the plan's start", 1, away[0], "m from the plan's start")


def check_arrival(rows: Rows, problem: PlanningProblem) -> Check:
    """Check that the run states its arrival, and that it ends at the goal within the tolerances.

    Raises:
        RefusalError: Names the entry and the value.
    """
    log, plan = rows.log, rows.plan
    if not log.reached or log.violation:
        raise RefusalError("reached", f"is {log.reached}: {log.violation or 'the run did not arrive'}")
    last = len(log.times) - 1
    away = float(np.hypot(*(rows.z[-1, :2] - plan.goal_pose[:2])))
    if not away <= problem.position_tolerance:
        allowed = f"{problem.position_tolerance} m are tolerated"
        raise RefusalError(f"object_pose[{last}]", f"is {away:.6g} m from the goal; {allowed}")
    goals = (float(plan.goal_pose[2]), *plan.goal_joints)
    tolerances = (problem.angle_tolerance, *[problem.joint_tolerance] * len(plan.goal_joints))
    for axis, (goal, tolerance) in enumerate(zip(goals, tolerances, strict=True)):
        if goal is not None and not abs(rows.z[-1, 2 + axis] - goal) <= tolerance:
            name = f"object_pose[{last}, 2]" if axis == 0 else f"joints[{last}, {axis - 1}]"
            found = f"is {rows.z[-1, 2 + axis]:.6g}; the goal is {goal} within {tolerance}"
            raise RefusalError(name, found)
    return Check("the run ends at the goal", 1, away, "m from the goal's position")


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
    checks += [bodies.check_grasps(rows, problem, setup), bodies.check_wrenches(rows, setup)]
    if setup.mechanics:
        checks.append(bodies.check_mechanics(rows, problem, setup))
    kept = bodies.check_run_speeds(rows, problem)
    checks += [] if kept is None else [kept]
    checks += bodies.check_run_efforts(rows, problem)
    checks += bodies.check_clearances(rows, between, problem, progress)
    if not braked:
        checks += check_budget_used(rows)
    where = "cells and funnels" if plan.motion is None else "cells"
    stayed = "" if braked else f", and the team stayed in {where}"
    aside = _left_aside(setup, braked=braked)
    return Verified(
        "arrived",
        f"run of {log.times[-1]:.2f} s in {len(log.times)} rows",
        tuple(checks),
        f"in this run nothing touched{stayed}, between the rows, too",
        "; ".join(
            [
                *aside,
                *_taken_as_logged(log, checks),
                *([] if plan.motion else ["that p_G moved along the cells' maps"]),
                "other runs",
                "that the robots are as in their models",
            ]
        ),
    )


def _taken_as_logged(log: SimulationLog, checks: Sequence[Check]) -> list[str]:
    """Name the arrays of which numbers can be altered without being refused; nothing where there is none."""
    tied = {name for check in checks for name in check.arrays}
    arrays = [name for name, array in vars(log).items() if isinstance(array, np.ndarray) and array.size]
    free = [name for name in arrays if name not in tied]
    return [f"these arrays, which are read as they are logged: {', '.join(free)}"] if free else []


def _check_laws(rows: Rows, between: Between, problem: PlanningProblem, setup: RunSetup) -> list[Check]:
    """Check what a run states about the plan's laws: cells, funnels, reports and entries into cells."""
    checks = [*check_cells(rows, between), check_stated_funnels(rows)]
    if rows.plan.motion is not None:
        return [*checks, *check_followed(rows, problem, exact=setup.exact)]
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
        laws = "that the team followed the plan: its cells, its laws and its budget, for the drives braked"
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

"""Compiles what the loops call: ``python -m coop_drake.compiled_loop.warm_up``."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from shapely import box

from coop_drake.answers.plan import Cell, Plan, Transition
from coop_drake.answers.problem import PlanningProblem
from coop_drake.compiled_loop import prepare, run
from coop_drake.laws import ScheduledGains, transition_gains
from coop_drake.plant import planning_problem
from coop_drake.scenario import load_scenario
from coop_drake.simulation import build_maps, simulate

_RATE = 200.0
"""Control rate of the team that the compiled loop runs [Hz]; any will do."""

_SIMULATED_SECONDS = 0.05
"""Simulated time after which every kernel of a loop has been called [s]."""


def main() -> None:
    """Move the team of ``base`` for some samples, in Drake's loop and in the compiled one."""
    scenario = load_scenario("base")
    plan = _plan(planning_problem(scenario))
    maps = build_maps(plan)
    brief = replace(scenario, simulator=replace(scenario.simulator, max_time=_SIMULATED_SECONDS))
    simulate(brief, plan, maps)
    sampled = replace(brief, deployment=replace(brief.deployment, control_rate=_RATE))
    run(prepare(sampled, plan, maps))


def _plan(problem: PlanningProblem) -> Plan:
    """Return a plan of two equal cells around the start, for which no planner has to be compiled.

    The walls do not count: they are too far away to end such a short run.
    """
    start, names = problem.start, tuple(joint.name for joint in problem.tree.joints)
    lower, upper, target = start[2:] - 0.3, start[2:] + 0.3, start[:2] + 0.2
    cell = Cell(lower, upper, box(*(start[:2] - 1.0), *(start[:2] + 1.0)))
    gains = transition_gains(
        ScheduledGains(), clearance=0.5, slice_lower=lower, slice_upper=upper, goal_lower=lower + 0.1,
        goal_upper=upper - 0.1, resting=start[2:],
    )  # fmt: skip
    transition = Transition(
        target=target, goal_lower=lower + 0.1, goal_upper=upper - 0.1, inradius=0.01, neck=0.5, length=0.3,
        estimated_time=1.0, only_angles=False, gains=gains, path=np.array([start[:2], target]),
    )  # fmt: skip
    return Plan(
        cells=(cell, cell),
        transitions=(transition, transition),
        start=start,
        goal_pose=np.array([*target, start[2]]),
        goal_joints=(None,) * len(names),
        joint_names=names,
        gain_set="scheduled",
    )


if __name__ == "__main__":
    main()

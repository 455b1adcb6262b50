"""Compile the planner's kernels into the cache on disk: ``python -m coop_drake.planning.warm_up``."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from shapely import Polygon, box

from coop_drake.answers.budget import Budget
from coop_drake.answers.problem import PlannerSettings, PlanningProblem, TeamLimits
from coop_drake.geometry.passage import PassageFinder
from coop_drake.geometry.sweeps import normals
from coop_drake.laws import ScheduledGains
from coop_drake.planning.planner import plan
from coop_drake.planning.proofs import Proofs
from coop_drake.tree.component_tree import Body, Component, ComponentTree, ConvexShape, PlanarPose, TreeJoint

BUDGET = Budget(
    control_rate=200.0, delay=0.01, lag=0.005, angle_noise=2e-4, rate_noise=2e-3, position_noise=3e-4,
    velocity_noise=3e-3, model_error=0.1, acceleration_error=0.1, report_age=0.025, base_force=900.0,
    grasp_noise=0.01, turn_noise=0.006, bases=((1, 0.0, 0.0),), rotors=(0.1,), dampings=(0.1,),
    bodies=((0, 3.0, 0.0, 0.0, 0.1, 0), (1, 9.0, 0.0, 0.0, 0.3, 0)),
)  # fmt: skip
"""Departures of every kind that a plan can tolerate."""

LIMITS = TeamLimits(
    (1,), ((0.0, 0.0),), np.ones(1), np.ones(1), joint_rates=np.ones(1), joint_accelerations=np.ones(1)
)
"""Limits of the team that passes from cell to cell."""

SLICES = 8
"""Slices of an exploration: its kernels are called in the first one."""


def main() -> None:
    """Plan for a square with one arm on an empty floor, and find a passage around a corner.

    Together these call every kernel.
    """
    square = Body("object", None, (ConvexShape(0.2 * normals(np.array([0.0, 0.5, 1.0, 1.5]) * np.pi)),))
    base = Body("base", 0, (ConvexShape(np.zeros((1, 2)), 0.1),))
    joint = TreeJoint("arm", "revolute", 0, 0, PlanarPose(0.5), 1.0, (1.0, 0.0), -1.0, 1.0)
    tree = ComponentTree(
        (Component("object", None, None, (square,)), Component("base", 0, joint, (base,))), frozenset()
    )
    question = PlanningProblem(
        box(-2.0, -2.0, 2.0, 2.0),
        tree,
        np.zeros(4),
        np.array([0.5, 0.2, 0.3]),
        (None,),
        settings=PlannerSettings(margin=0.1),
    )
    passing = replace(question, passes=True, limits=LIMITS)
    for asked, budget in ((question, None), (passing, None), (passing, BUDGET)):
        plan(asked, ScheduledGains(), gain_set_name="scheduled", budget=budget)
    Proofs(question).run(SLICES)
    bent = Polygon([(0.0, 0.0), (3.0, 0.0), (3.0, 1.0), (1.0, 1.0), (1.0, 3.0), (0.0, 3.0)])
    PassageFinder(bent).find((2.5, 0.5), (0.5, 2.5))


if __name__ == "__main__":
    main()

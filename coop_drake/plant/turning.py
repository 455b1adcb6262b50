"""How much the joints of a team are accelerated by the object's turning."""

from __future__ import annotations

import numpy as np

from coop_drake.plant.chain import limits_of
from coop_drake.plant.configuration import set_configuration
from coop_drake.plant.team import TeamPlant

CONFIGURATIONS = 3000
"""Number of configurations that are tried [-]: ten times as many give 4 % more for `elbow`."""


def turning_coupling(team: TeamPlant) -> float:
    """Return the largest acceleration of a joint over the square of the rate at which the object turns [-].

    Nothing is commanded, and nothing but the object turns: joint i then has the acceleration -(M^-1 C)_i.
    The largest of ``CONFIGURATIONS`` between the joints' limits, drawn with a fixed seed, is a lower bound; a
    gain set of scheduled gains should state no less as its ``turning_coupling``.

    Args:
        team: A team of robots as one tree.
    """
    plant, context, turning = team.plant, team.plant.CreateDefaultContext(), team.velocity_index
    limits = np.array([limits_of(joint) for robot in team.robots for joint in robot.joints]).reshape(-1, 2)
    rates, largest = np.zeros(plant.num_velocities()), 0.0
    rates[turning[2]] = 1.0
    for joints in np.random.default_rng(0).uniform(limits[:, 0], limits[:, 1], (CONFIGURATIONS, len(limits))):
        set_configuration(team, context, np.array([0.0, 0.0, 0.0, *joints]))
        plant.SetVelocities(context, rates)
        free = np.linalg.solve(plant.CalcMassMatrix(context), plant.CalcBiasTerm(context))
        largest = max(largest, float(np.abs(free[turning[3:]]).max(initial=0.0)))
    return largest

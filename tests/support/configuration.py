"""Reads configurations of a team from its plant."""

import numpy as np
from pydrake.systems.framework import Context

from coop_drake.plant import TeamPlant


def get_configuration(team: TeamPlant, context: Context) -> np.ndarray:
    """z = (x, y, theta, q...), shape (3 + n,)."""
    return np.asarray(team.plant.GetPositions(context)[team.position_index])


def get_rates(team: TeamPlant, context: Context) -> np.ndarray:
    """The rates of z, shape (3 + n,)."""
    return np.asarray(team.plant.GetVelocities(context)[team.velocity_index])

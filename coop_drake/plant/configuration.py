"""Writes configurations z of the team into a plant's context, and reads the bases' poses from it."""

import numpy as np
from pydrake.systems.framework import Context

from coop_drake.plant.chain import planar_pose
from coop_drake.plant.team import TeamPlant
from coop_drake.scenario import Deployment
from coop_drake.tree.pose import FloatArray


def set_configuration(
    team: TeamPlant, context: Context, z: FloatArray, z_rate: FloatArray | None = None
) -> None:
    """Put the team into a configuration.

    Args:
        team: The team.
        context: The plant's context.
        z: (x, y, theta, q...), shape (3 + n,) [m, rad].
        z_rate: Rates of z, shape (3 + n,); at rest if None.
    """
    rates = np.zeros(len(z)) if z_rate is None else z_rate
    team.plant.SetPositionsAndVelocities(context, team.plant_state(z, rates))


def base_poses(team: TeamPlant, context: Context) -> FloatArray:
    """Read the pose (x, y, angle) of every base in W, shape (N, 3) [m, rad], angles in (-pi, pi]."""
    poses = [planar_pose(robot.base_body.EvalPoseInWorld(context)) for robot in team.robots]
    return np.array([(pose.x, pose.y, pose.angle) for pose in poses])


def displacement(deployment: Deployment, axes: int) -> FloatArray:
    """Return how far a team with so many (x, y, theta, q...) stands away from the plan's start [m, rad]."""
    offset = deployment.start_offset
    return np.array([offset.x, offset.y, offset.theta, *(offset.joints or (0.0,) * (axes - 3))])

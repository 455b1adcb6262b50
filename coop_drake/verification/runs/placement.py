"""Where the team's solids and frames are in every row of a log: forward kinematics of the checker's own."""

from __future__ import annotations

import numpy as np

from coop_drake.tree.pose import FloatArray
from coop_drake.verification.solids import Stage


def points_in_world(points: FloatArray, stages: tuple[Stage, ...], z: FloatArray) -> FloatArray:
    """Carry points of one component to W by its stages.

    Args:
        points: Points in the component's frame, shape (m, 2) [m].
        stages: What moves the component: its own joint first, theta last.
        z: Configurations (x, y, theta, q...), shape (T, 3 + n) [m, rad].

    Returns:
        Shape (T, m, 2) [m].
    """
    carried = np.broadcast_to(points, (len(z), *points.shape))
    for stage in stages:
        values = stage.scale * z[:, 2 + stage.axis]
        if stage.kind == "prismatic":
            carried = carried + values[:, None, None] * stage.direction
        else:
            c, s = np.cos(values)[:, None], np.sin(values)[:, None]
            x, y = carried[..., 0], carried[..., 1]
            carried = np.stack((c * x - s * y, s * x + c * y), axis=-1)
        carried = stage.X_PJ.apply(carried)
    placed: FloatArray = carried + z[:, None, :2]
    return placed


def turns(stages: tuple[Stage, ...], z: FloatArray) -> FloatArray:
    """Angles of one component in W, not wrapped, shape (T,) [rad]; arguments as above."""
    angles = np.zeros(len(z))
    for stage in stages:
        angles += stage.X_PJ.angle
        if stage.kind == "revolute":
            angles += stage.scale * z[:, 2 + stage.axis]
    return angles


def levers(reach: float, stages: tuple[Stage, ...], z: FloatArray) -> FloatArray:
    """Bound how far a point of a component moves for each unit of every stage, at all configurations.

    Args:
        reach: Largest distance of the component's points from its frame's origin [m].
        stages: The stages that count: its own joint first.
        z: Configurations of the log, which bound how far joints slide, shape (T, 3 + n) [m, rad].

    Returns:
        One bound for each stage, shape (stages,) [m for each rad, or m for each m].
    """
    bounds = []
    for stage in stages:
        if stage.kind == "prismatic":
            slide = float(np.hypot(*stage.direction))
            bounds.append(slide)
            reach += slide * float(np.abs(z[:, 2 + stage.axis]).max())
        else:
            bounds.append(reach)
        reach += float(np.hypot(stage.X_PJ.x, stage.X_PJ.y))
    return np.array(bounds)

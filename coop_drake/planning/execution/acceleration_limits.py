"""The accelerations that a plan may command of its joints, and whether the estimated transport needs more."""

from __future__ import annotations

import numpy as np

from coop_drake.answers.limits import TeamLimits
from coop_drake.answers.plan import Plan
from coop_drake.errors import TooQuickError
from coop_drake.planning.execution.estimate import estimated
from coop_drake.planning.execution.speed_shares import KEPT
from coop_drake.tree.pose import FloatArray


def planned_accelerations(limits: TeamLimits) -> FloatArray | None:
    """Return the largest accelerations of (theta, q...) that may be commanded, None without any limit.

    Returns:
        ``KEPT`` of the joints' limits, infinity for the angle, shape (1 + n,) [rad/s^2 or m/s^2].
    """
    known = np.isfinite(limits.joint_accelerations).any()
    return np.array([np.inf, *(KEPT * limits.joint_accelerations)]) if known else None


def check_accelerations(plan: Plan, most: FloatArray) -> None:
    """Refuse a plan in whose estimated transport the limit of a joint's acceleration acts.

    That an axis stays in its funnel is shown for the law without this limit.

    Args:
        plan: The plan.
        most: Largest accelerations of (theta, q...), shape (1 + n,) [rad/s^2 or m/s^2].

    Raises:
        TooQuickError: Names the first cell in which one acts, the joint and the limit.
    """
    acting = estimated(plan)[2] >= most
    if acting.any():
        cell, axis = np.argwhere(acting)[0]
        raise TooQuickError(
            f"cell {cell}: {plan.joint_names[axis - 1]} would be accelerated by more than {most[axis]:.3g}, "
            "what its limit of acceleration leaves; expected a larger limit, or gains for older commands"
        )

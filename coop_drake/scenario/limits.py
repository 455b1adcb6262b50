"""Limits that a scenario states for its robots, besides those in the robots' models."""

from dataclasses import dataclass

from coop_drake.typed_data import Positive

ALL_ROBOTS = "*"
"""Name that stands for all robots without an entry of their own."""


@dataclass(frozen=True)
class RobotLimits:
    """Limits of one robot; each replaces what the robot's model says, null keeps that.

    Attributes:
        base_speed: Largest speed of the base's frame Bk in W [m/s].
        base_turn_rate: Largest rate of the base's angle in W [rad/s].
        joint_rates: Largest rates of the joints, from the base to the end effector; a single one counts for
            all joints [rad/s or m/s].
        joint_accelerations: Largest accelerations of the joints, in the same way [rad/s^2 or m/s^2].
    """

    base_speed: Positive | None = None
    base_turn_rate: Positive | None = None
    joint_rates: tuple[Positive | None, ...] = ()
    joint_accelerations: tuple[Positive | None, ...] = ()

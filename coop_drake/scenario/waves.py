"""Errors of measurements that are bounded: square waves, the same in all robots."""

from dataclasses import dataclass, field, fields
from typing import Annotated

from coop_drake.typed_data import Limits, NotNegative


@dataclass(frozen=True)
class Wave:
    """An error that is a number for half a period, and its opposite for the other half.

    Attributes:
        size: Magnitude of the error, in the unit of what is measured; 0 for no error.
        period: Time from one change to the positive error to the next; the error is constant if the transport
            takes no longer than a half of it [s].
        phase: How much of a period has passed at the start [-].
    """

    size: NotNegative = 0.0
    period: Annotated[float, Limits(above=0.0, at_most=1000.0)] = 1.0
    phase: Annotated[float, Limits(at_least=0.0, at_most=1.0)] = 0.0


@dataclass(frozen=True)
class Waves:
    """Bounded errors of what robots measure, which all robots have alike.

    Attributes:
        x: Of the object's position along x of W [m].
        y: Of the object's position along y of W [m].
        angle: Of the object's angle [rad].
        joints: Of the position of every joint [rad or m].
        velocity_x: Of the velocity of every base along x of W [m/s].
        velocity_y: Of the velocity of every base along y of W [m/s].
        turn_rate: Of the angular rate of every base [rad/s].
        joint_rates: Of the rate of every joint [rad/s or m/s].
    """

    x: Wave = field(default_factory=Wave)
    y: Wave = field(default_factory=Wave)
    angle: Wave = field(default_factory=Wave)
    joints: Wave = field(default_factory=Wave)
    velocity_x: Wave = field(default_factory=Wave)
    velocity_y: Wave = field(default_factory=Wave)
    turn_rate: Wave = field(default_factory=Wave)
    joint_rates: Wave = field(default_factory=Wave)

    def __bool__(self) -> bool:
        """Whether there is an error."""
        return any(getattr(self, one.name).size > 0.0 for one in fields(self))

    def of_port(self, name: str, size: int) -> list[Wave]:
        """Return the wave of every component of a measured port.

        Args:
            name: ``object_pose`` for (x, y, angle), else the robot's state (x, y, yaw, joints..., their
                rates), in which positions and yaw of the base have none: the object's are those of its pose.
            size: Number of components.
        """
        if name == "object_pose":
            return [self.x, self.y, self.angle]
        joints = size // 2 - 3
        rates = [self.velocity_x, self.velocity_y, self.turn_rate, *[self.joint_rates] * joints]
        return [*[Wave()] * 3, *[self.joints] * joints, *rates]

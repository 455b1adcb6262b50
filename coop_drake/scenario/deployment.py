"""What keeps a real team from the ideal one: sampling, noise, delays, limits, errors, lost messages."""

from dataclasses import dataclass, field
from typing import Annotated

from coop_drake.typed_data import Limits, NotNegative, Positive

# No `from __future__ import annotations` here: `typed_data` reads the types of the fields.

Delay = Annotated[float, Limits(at_least=0.0, at_most=10.0)]
"""A delay [s]; after ten seconds without news no controller of this kind could hold anything."""

Probability = Annotated[float, Limits(at_least=0.0, at_most=1.0)]


@dataclass(frozen=True)
class Measurements:
    """How robots perceive the object's pose and their own state, anew in every control period.

    Attributes:
        position_noise: Standard deviation of every measured position [m].
        angle_noise: Standard deviation of every measured angle and of every joint's position [rad or m].
        rate_noise: Standard deviation of every measured rate [m/s or rad/s].
        delay: Age of what is measured, rounded up to whole control periods [s].
    """

    position_noise: NotNegative = 0.0
    angle_noise: NotNegative = 0.0
    rate_noise: NotNegative = 0.0
    delay: Delay = 0.0


@dataclass(frozen=True)
class ActuatorLimits:
    """What actuators give at most; no limit where nothing is given.

    Attributes:
        base_force: Along each axis of W, at every base [N].
        base_torque: At every base [N m].
        joint_effort: At every joint [N m or N].
    """

    base_force: Positive | None = None
    base_torque: Positive | None = None
    joint_effort: Positive | None = None


@dataclass(frozen=True)
class Messages:
    """How ready reports travel, one a control period from every robot.

    Attributes:
        loss: Probability that a report is lost [-].
        repeat: Probability that a report arrives a second time, one delay later [-].
        delay: Time that a report travels, rounded up to whole control periods [s].
    """

    loss: Probability = 0.0
    repeat: Probability = 0.0
    delay: Delay = 0.0


@dataclass(frozen=True)
class Deployment:
    """The team as it would be built; left away, it is ideal and controlled in continuous time.

    Attributes:
        control_rate: How often controllers compute, holding their effort meanwhile; null for always [Hz].
        mass_error: By how much robots overestimate all masses and inertias, relative; may be negative [-].
        measurements: What robots perceive; needs a control rate.
        actuators: What their actuators give.
        messages: How their reports travel; needs a control rate.
        seed: Of noise and losses.
    """

    control_rate: Annotated[float, Limits(at_least=1.0, at_most=1e4)] | None = None
    mass_error: Annotated[float, Limits(at_least=-0.9, at_most=10.0)] = 0.0
    measurements: Measurements = field(default_factory=Measurements)
    actuators: ActuatorLimits = field(default_factory=ActuatorLimits)
    messages: Messages = field(default_factory=Messages)
    seed: Annotated[int, Limits(at_least=0)] = 0

    @property
    def ideal(self) -> bool:
        """Whether the law's equations hold exactly: nothing of it all is switched on."""
        return self == Deployment(seed=self.seed)

    @property
    def period(self) -> float | None:
        """Time between two computations of a controller [s], None for continuous time."""
        return None if self.control_rate is None else 1.0 / self.control_rate

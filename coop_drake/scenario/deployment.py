"""Departures of a real team from the ideal one: sampling, noise, delays, limits, model errors, lost messages.

This file holds the values alone. They are applied in one place, :mod:`coop_drake.diagram.deployment`, which
puts blocks between every controller and the plant; only ``mass_error`` acts elsewhere, where the controllers'
model of the team is made (:mod:`coop_drake.diagram.knowledge`). A new departure is a field here, a block
there, tests in ``tests/diagram/test_deployment.py``, a mild and a harsh case in
``tests/closed_loop/test_deployment.py``, a row of ``docs/how_to/deployment.md``, wrong values for it in
``tests/support/mutants/values.py``, and ``docs/reference/scenario.md``, which ``python -m docs.generate``
writes. ``scenario/validation.py`` refuses measurements and messages that are set without a control rate.
Fused blocks refuse every departure that ``coop_drake/diagram/fused.py`` does not list.
"""

from dataclasses import dataclass, field
from math import ceil
from typing import Annotated

from coop_drake.typed_data import Limits, NotNegative, Positive

Delay = Annotated[float, Limits(at_least=0.0, at_most=10.0)]
"""A delay [s]; the loop is lost after fractions of a second, so that a longer one is a typing error."""

Lag = Annotated[float, Limits(at_least=0.0, at_most=10.0)]
"""A time constant [s]; limited as a delay is."""

Probability = Annotated[float, Limits(at_least=0.0, at_most=1.0)]

ControlRate = Annotated[float, Limits(at_least=1.0, at_most=1e4)]
"""A control rate [Hz]; beyond 10 kHz it would only be a slow way to simulate continuous time."""

MassError = Annotated[float, Limits(at_least=-0.9, at_most=10.0)]
"""A relative error of masses [-]; at -1 the model would be massless."""


@dataclass(frozen=True)
class Measurements:
    """How robots measure the object's pose and their own state, once in every control period.

    Attributes:
        position_noise: Standard deviation of every measured position [m].
        angle_noise: Standard deviation of every measured angle and of every joint's position [rad or m].
        rate_noise: Standard deviation of every measured rate [m/s or rad/s].
        delay: Age of a measurement when the controller gets it, rounded up to whole control periods [s].
    """

    position_noise: NotNegative = 0.0
    angle_noise: NotNegative = 0.0
    rate_noise: NotNegative = 0.0
    delay: Delay = 0.0


@dataclass(frozen=True)
class ActuatorLimits:
    """Largest efforts of the actuators, null for no limit, and how quickly they follow their commands.

    Attributes:
        base_force: Largest force of every base along each axis of W [N].
        base_torque: Largest torque of every base [N m].
        joint_effort: Largest effort of every joint [N m or N].
        lag: Time constant with which every effort follows its command, as a first-order low pass [s]; 0 for
            actuators that follow at once.
    """

    base_force: Positive | None = None
    base_torque: Positive | None = None
    joint_effort: Positive | None = None
    lag: Lag = 0.0


@dataclass(frozen=True)
class Messages:
    """How ready reports travel; every robot sends one in each control period.

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
    """The team as it would be built; without this section it is ideal and controlled in continuous time.

    Attributes:
        control_rate: How often controllers compute a new effort, which is held in between; null for
            controllers in continuous time [Hz].
        mass_error: By how much robots overestimate all masses and inertias, relative; may be negative [-].
        measurements: Noise and delay of what robots measure; needs a control rate.
        actuators: Largest efforts of the actuators.
        messages: Losses and delay of ready reports; needs a control rate.
        seed: Seed of noise and losses.
    """

    control_rate: ControlRate | None = None
    mass_error: MassError = 0.0
    measurements: Measurements = field(default_factory=Measurements)
    actuators: ActuatorLimits = field(default_factory=ActuatorLimits)
    messages: Messages = field(default_factory=Messages)
    seed: Annotated[int, Limits(at_least=0)] = 0

    @property
    def ideal(self) -> bool:
        """Whether nothing is switched on, so that the equations of the control law hold exactly."""
        return self == Deployment(seed=self.seed)

    @property
    def command_age(self) -> float:
        """Mean age of the measurements on which an effort rests: delay, half a period and lag [s].

        A delay is rounded up to whole periods, see ``whole_periods`` of the systems.
        """
        lag = self.actuators.lag
        if self.period is None:
            return lag
        return (ceil(self.measurements.delay / self.period - 1e-9) + 0.5) * self.period + lag

    @property
    def period(self) -> float | None:
        """Control period [s], None in continuous time."""
        return None if self.control_rate is None else 1.0 / self.control_rate

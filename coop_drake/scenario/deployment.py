"""Departures of a real team from the ideal one: what is sampled, noisy, late, limited, wrong, lost or pushed.

This file holds the values alone; :mod:`coop_drake.scenario.checks` refuses values that do not fit
together. Three files apply them: :mod:`coop_drake.diagram.deployment` puts blocks between every controller
and the plant, :mod:`coop_drake.systems.forces` has the forces of the world for both loops, and
:mod:`coop_drake.diagram.robot_controller` makes the controllers' model of the team, in which
``mass_error`` acts. A new departure is a field here, a block there, tests in
``tests/diagram/test_deployment.py``, a mild and a harsh case in ``tests/closed_loop/test_departures.py``, a
row of ``docs/how_to/deployment.md``, and ``docs/reference/scenario.md``, which ``python -m docs.generate``
writes. The compiled loop takes departures of robots from ``coop_drake/compiled_loop/running.py``, and refuses
those that it does not know.
"""

from dataclasses import dataclass, field, fields, replace
from math import sqrt
from typing import Annotated, Any, Literal

from coop_drake.laws.measurements import whole_periods
from coop_drake.typed_data import Limits, NotNegative, Positive, Real

Delay = Annotated[float, Limits(at_least=0.0, at_most=10.0)]
"""A delay [s]; the loop is lost after fractions of a second, so that a longer one is a typing error."""

Lag = Annotated[float, Limits(at_least=0.0, at_most=10.0)]
"""A time constant [s]; limited as a delay is."""

Probability = Annotated[float, Limits(at_least=0.0, at_most=1.0)]

ControlRate = Annotated[float, Limits(at_least=1.0, at_most=1e4)]
"""A control rate [Hz]; beyond 10 kHz it would only be a slow way to simulate continuous time."""

RelativeError = Annotated[float, Limits(at_least=-0.9, at_most=10.0)]
"""A relative error [-]; at -1 a model would be massless, and a measured rate always zero."""

_ALMOST_ALL = 0.99
"""Largest probability of losses for which gains are scheduled [-]; where all is lost no gain would help."""

ALL_ROBOTS = "*"
"""Name that stands for all robots without an entry of their own."""

Preset = Literal["mobile_base"]
"""The name of a usual team's departures."""

PRESETS: dict[str, dict[str, Any]] = {
    "mobile_base": {
        "control_rate": 200.0,
        "mass_error": 0.2,
        "measurements": {"position_noise": 0.001, "angle_noise": 0.0005, "rate_noise": 0.01, "delay": 0.01},
        "actuators": {"base_force": 650.0, "lag": 0.005},
        "messages": {"loss": 0.2, "delay": 0.025},
        "clock_error": 0.002,
    }
}
"""What each preset says, in the units of ``deployment``. Mobile base: a robot that computes on board, and
measures poses by laser or camera."""


def with_preset(data: dict[str, Any]) -> dict[str, Any]:
    """Return the data of a section with the departures of its preset in place of the preset's name.

    Keys beside the preset replace its own. The name of a preset that does not exist stays.
    """
    preset = data.get("preset")
    if not isinstance(preset, str) or preset not in PRESETS:
        return data
    return _replaced(PRESETS[preset], {name: value for name, value in data.items() if name != "preset"})


def _replaced(data: dict[str, Any], changes: dict[str, Any]) -> dict[str, Any]:
    """Return nested mappings with other entries; an entry that is no mapping replaces what stood there."""
    nested = {
        name: _replaced(data[name], entry)
        for name, entry in changes.items()
        if isinstance(entry, dict) and isinstance(data.get(name), dict)
    }
    return {**data, **changes, **nested}


@dataclass(frozen=True)
class Wave:
    """An error that is a number for half a period, and its opposite for the other half.

    Attributes:
        size: Magnitude, in the unit of what is measured.
        period: Time after which the error repeats itself [s].
        phase: Share of a period that has passed at the start [-].
    """

    size: NotNegative = 0.0
    period: Annotated[float, Limits(above=0.0, at_most=1000.0)] = 1.0
    phase: Annotated[float, Limits(at_least=0.0, at_most=1.0)] = 0.0


@dataclass(frozen=True)
class Waves:
    """Bounded errors of what robots measure, which all robots have alike.

    Attributes:
        x: Error of the position along x of W [m].
        y: Error of the position along y of W [m].
        angle: Error of the object's angle [rad].
        joints: Error of every joint [rad or m].
        velocity_x: Error of every base's velocity along x of W [m/s].
        velocity_y: Error of every base's velocity along y of W [m/s].
        turn_rate: Error of every base's turn rate [rad/s].
        joint_rates: Error of every joint's rate [rad/s or m/s].
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


@dataclass(frozen=True)
class Measurements:
    """How robots measure the object's pose and their own state, once in every control period.

    Attributes:
        position_noise: Standard deviation of every measured position [m].
        angle_noise: Standard deviation of measured angles and joint positions [rad or m].
        rate_noise: Standard deviation of measured rates [m/s or rad/s].
        delay: Age of a measurement when the controller gets it [s].
        loss: Probability that a measurement, pose or own state, is lost and the last one is used again [-].
        late: Probability that a measurement arrives late; it is used unless a newer one has arrived [-].
        late_by: Delay of a late measurement [s].
        waves: Bounded errors that change their sign.
    """

    position_noise: NotNegative = 0.0
    angle_noise: NotNegative = 0.0
    rate_noise: NotNegative = 0.0
    delay: Delay = 0.0
    loss: Probability = 0.0
    late: Probability = 0.0
    late_by: Delay = 0.0
    waves: Waves = field(default_factory=Waves)


@dataclass(frozen=True)
class ActuatorLimits:
    """Largest efforts of the actuators, null for no limit, and how quickly they follow their commands.

    Attributes:
        base_force: Largest force of every base, as the length of a vector [N].
        base_torque: Largest torque of every base [N m].
        joint_effort: Largest effort of every joint [N m or N].
        lag: Time constant of a first-order lag of every effort behind its command [s].
    """

    base_force: Positive | None = None
    base_torque: Positive | None = None
    joint_effort: Positive | None = None
    lag: Lag = 0.0


@dataclass(frozen=True)
class Messages:
    """How ready reports or words travel; every robot sends one in each control period.

    Attributes:
        loss: Probability that a report is lost [-].
        repeat: Probability that a report arrives twice, one delay apart, which changes nothing for words [-].
        delay: Time that a report travels [s].
    """

    loss: Probability = 0.0
    repeat: Probability = 0.0
    delay: Delay = 0.0


@dataclass(frozen=True)
class PoseBias:
    """Constant error of a measured pose of the object.

    Attributes:
        x: Error of the first coordinate in W [m].
        y: Error of the second coordinate in W [m].
        theta: Error of the angle [rad].
    """

    x: Real = 0.0
    y: Real = 0.0
    theta: Real = 0.0


@dataclass(frozen=True)
class Silence:
    """A robot that sends nothing for a while; its motors may fail with it.

    Attributes:
        begin: When it falls silent [s].
        duration: For how long; null for the rest of the run [s].
        motors: ``working``: motors go on as they are told; ``held``: they give their last effort; ``limp``:
            they give none.
    """

    begin: NotNegative
    duration: Positive | None = None
    motors: Literal["working", "held", "limp"] = "working"


@dataclass(frozen=True)
class Deafness:
    """A robot that hears nothing of the hold supervisor, or no words, for a while.

    Attributes:
        begin: When it hears nothing any more [s].
        duration: For how long; null for the rest of the run [s].
    """

    begin: NotNegative
    duration: Positive | None = None


@dataclass(frozen=True)
class BlockedWheels:
    """Wheels that block: they stop their base within some tenths of a second, and it then stands still.

    The floor holds it, whatever pulls at it; what the robot asks of its base has no effect, and its joints go
    on. No budget counts this.

    Attributes:
        begin: When the wheels block [s].
        duration: For how long; null for the rest of the run [s].
    """

    begin: NotNegative
    duration: Positive | None = None


@dataclass(frozen=True)
class WheelSlip:
    """Wheels that slip: a share of the base's force and torque does not reach the floor.

    No budget counts this.

    Attributes:
        begin: When they begin to slip [s].
        share: The share that is lost, 1 for wheels without any grip [-].
        duration: For how long; null for the rest of the run [s].
    """

    begin: NotNegative
    share: Probability
    duration: Positive | None = None


@dataclass(frozen=True)
class RobotDepartures:
    """What is wrong with a single robot.

    Attributes:
        pose_bias: Constant error of the object's measured pose.
        odometry_scale: By how much it overestimates the rates of its base, relative [-].
        sample_offset: By how much later than the others it measures and computes, less than a period [s].
        clock_error: By how much its clock is ahead of the others' [s].
        switch_delay: How much later than the others it hears of a new cell, or all words [s].
        silence: When it sends no reports, null for never.
        deaf: When it hears nothing of the hold supervisor, null for never.
        blocked: When the wheels of its base are blocked, null for never.
        slip: When the wheels of its base slip, null for never.
    """

    pose_bias: PoseBias = field(default_factory=PoseBias)
    odometry_scale: RelativeError = 0.0
    sample_offset: Delay = 0.0
    clock_error: Annotated[float, Limits(at_least=-10.0, at_most=10.0)] = 0.0
    switch_delay: Delay = 0.0
    silence: Silence | None = None
    deaf: Deafness | None = None
    blocked: BlockedWheels | None = None
    slip: WheelSlip | None = None

    @property
    def counted(self) -> "RobotDepartures":
        """The same without wheels that are blocked or slip: faults, beyond every budget."""
        return replace(self, blocked=None, slip=None)


@dataclass(frozen=True)
class Floor:
    """Forces of the floor on the team.

    Attributes:
        coulomb_friction: Friction force on every base, whatever its speed [N].
        viscous_friction: Friction force on every base for each unit of its speed [N s/m].
        slope: Angle by which the floor falls along the x axis of W [rad].
    """

    coulomb_friction: NotNegative = 0.0
    viscous_friction: NotNegative = 0.0
    slope: Annotated[float, Limits(at_least=-1.0, at_most=1.0)] = 0.0


@dataclass(frozen=True)
class JointFriction:
    """Friction of every joint, beside the damping that its model has.

    Attributes:
        coulomb: Friction whatever the rate; a joint at rest is held by up to as much [N m or N].
        viscous: Friction for each unit of the rate [N m s or N s/m].
    """

    coulomb: NotNegative = 0.0
    viscous: NotNegative = 0.0


@dataclass(frozen=True)
class Push:
    """A constant force from outside on one body for a while.

    Attributes:
        body: The object or a robot, pushed at the origin of L or Bk.
        force: Force in W [N].
        torque: Torque about the vertical axis [N m].
        time: When the push begins [s].
        duration: How long it lasts; at least ``simulator.max_step_size`` [s].
    """

    body: str
    force: tuple[Real, Real]
    time: NotNegative
    duration: Positive
    torque: Real = 0.0


@dataclass(frozen=True)
class StartOffset:
    """How far the team stands away from the plan's start, at rest; its robots do not know.

    Attributes:
        x: Of the object, along x of W [m].
        y: Of the object, along y of W [m].
        theta: Of the object's angle [rad].
        joints: Offset of every joint, robot by robot; empty for none [rad or m].
    """

    x: Real = 0.0
    y: Real = 0.0
    theta: Real = 0.0
    joints: tuple[Real, ...] = ()


@dataclass(frozen=True)
class Deployment:
    """The team as it would be built; without this section it is ideal and controlled in continuous time.

    Attributes:
        preset: The departures of a usual team, which the keys beside it replace one by one. ``mobile_base``:
            200 Hz, measurements 10 ms late with noise of 1 mm, 0.5 mrad and 0.01 /s, masses believed 20 % too
            large, base forces up to 650 N, actuators that lag by 5 ms, messages 25 ms late of which a fifth
            is lost, clocks 2 ms off.
        control_rate: How often controllers compute a new effort; null for continuous time, which excludes
            noise, delays, losses, silence, wrong clocks and budgets. Delays are rounded up to whole periods
            [Hz].
        mass_error: By how much robots overestimate all masses and inertias, relative [-].
        measurements: Noise and delay of what robots measure.
        actuators: Largest efforts of the actuators.
        messages: Losses and delay of ready reports.
        robots: What is wrong with single robots, by name; ``"*"`` for all without an entry.
        floor: Friction and slope of the floor.
        joint_friction: Friction of every joint, which no robot knows of.
        pushes: Forces from outside.
        start_offset: How far the team stands off the plan's start.
        clock_error: Largest error of a robot's clock, drawn for each: robots believe to measure at another
            time. The pose has stamps of one time in a team that passes [s].
        budget: Under which budget of these departures a plan must hold: ``position`` for the object's
            position alone, ``all`` for angles and joints, too.
        seed: Seed of noise and losses.
    """

    preset: Preset | None = None
    control_rate: ControlRate | None = None
    mass_error: RelativeError = 0.0
    measurements: Measurements = field(default_factory=Measurements)
    actuators: ActuatorLimits = field(default_factory=ActuatorLimits)
    messages: Messages = field(default_factory=Messages)
    robots: dict[str, RobotDepartures] = field(default_factory=dict)
    floor: Floor = field(default_factory=Floor)
    joint_friction: JointFriction = field(default_factory=JointFriction)
    pushes: tuple[Push, ...] = ()
    start_offset: StartOffset = field(default_factory=StartOffset)
    clock_error: Delay = 0.0
    budget: Literal["none", "position", "all"] = "none"
    seed: Annotated[int, Limits(at_least=0)] = 0

    completed = staticmethod(with_preset)

    @property
    def ideal(self) -> bool:
        """Whether nothing is switched on, so that the equations of the control law hold exactly."""
        return self == Deployment(budget=self.budget, seed=self.seed)

    def of_robot(self, name: str) -> RobotDepartures:
        """Return what is wrong with a robot."""
        return self.robots.get(name, self.robots.get(ALL_ROBOTS, RobotDepartures()))

    @property
    def whole_delay(self) -> float:
        """Delay of measurements, rounded up to whole periods [s]."""
        period = self.period
        return 0.0 if period is None else whole_periods(self.measurements.delay, period) * period

    @property
    def held_age(self) -> float:
        """How much older measurements are where some are lost or late: mean and two standard deviations [s].

        With the probability p that a measurement is not there in time, the one in use is k periods older with
        the probability (1 - p) p^k. Late ones are at most as much older as they are late.
        """
        m, period = self.measurements, self.period or 0.0
        missing = min(m.loss + (1.0 - m.loss) * m.late, _ALMOST_ALL)
        age = period * (missing + 2.0 * sqrt(missing)) / (1.0 - missing)
        return age if m.loss > 0.0 else min(age, max(m.late_by, period))

    @property
    def command_age(self) -> float:
        """Age of the measurements on which an effort rests: delay, losses, half a period and lag [s].

        Clocks may hide a part of it.
        """
        age = self.whole_delay + self.held_age + 0.5 * (self.period or 0.0) + self.actuators.lag
        return age + self.clock_error

    @property
    def period(self) -> float | None:
        """Control period [s], None in continuous time."""
        return None if self.control_rate is None else 1.0 / self.control_rate

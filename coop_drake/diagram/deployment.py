"""A robot's controller with sensors, actuators and radio, where the team is not ideal."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import inf
from typing import TypeAlias

import numpy as np
from pydrake.systems import primitives
from pydrake.systems.framework import Context, Diagram, DiagramBuilder, InputPort, LeafSystem, OutputPort
from pydrake.trajectories import PiecewisePolynomial

from coop_drake import systems
from coop_drake.laws.measurements import NOTHING, uniform_pair, whole_periods
from coop_drake.scenario import Deafness, Deployment, Messages, PoseBias, RobotDepartures, Silence
from coop_drake.tree.arrays import FloatArray


def build_radio(deployment: Deployment, robot: int, use: int = 0) -> systems.MessageChannel:
    """Build the channel of a robot's reports in a sampled team.

    The use of the seed is 3 for its requests to the hold supervisor, and 4 for what it hears of this.
    """
    messages = deployment.messages
    return systems.MessageChannel(
        deployment.period or 0.0,
        delay=messages.delay,
        loss=messages.loss,
        repeat=messages.repeat,
        seed=seed_of(deployment, robot, use),
    )


def seed_of(deployment: Deployment, robot: int, use: int = 0) -> int:
    """Return the seed of what is drawn for a robot; each use has its own.

    The use is 0 for losses of reports, 1 and 2 for those of measurements of the object and of the robot, 3
    and 4 for those of messages about holds, 5 and 6 for the noise of these measurements, 7 for the clock.
    """
    words = [deployment.seed, robot, use] if use else [deployment.seed, robot]
    return int(np.random.SeedSequence(words).generate_state(1)[0])


TELEMETRY = (
    "object_state",
    "governor_position",
    "energy_margin",
    "funnels",
    "object_acceleration",
    "hand_command",
)
"""Outputs of blocks that are exported for the log and for users."""

WORD_USE = 8
"""First use of the seeds of the words that a robot, or the supervisor, hears of everybody."""


def radio_of(deployment: Deployment, names: Sequence[str], row: int) -> systems.Radio:
    """Return how a robot hears and speaks the words of a team that passes, or the supervisor, the last row.

    Args:
        deployment: What is switched on.
        names: Names of all robots.
        row: Number of the robot.
    """
    period, messages, robots = deployment.period, deployment.messages, len(names)
    if period is None:
        return systems.Radio(row, robots)
    own = [*map(deployment.of_robot, names), RobotDepartures()]
    late = [whole_periods(messages.delay + one.switch_delay, period) for one in own]
    return systems.Radio(
        row,
        robots,
        kept=1 + max(late),
        late=late[row],
        loss=messages.loss,
        seeds=[seed_of(deployment, row, WORD_USE + sender) for sender in range(1 + robots)],
        clock_error=own[row].clock_error + (clock_shift(deployment, row) if row < robots else 0.0),
        offset=own[row].sample_offset,
        deaf=interval_of(own[row].deaf),
        mute=interval_of(own[row].silence),
    )


def interval_of(fault: Silence | Deafness | None) -> tuple[float, float]:
    """Return begin and end of a fault [s], infinite where there is none or it does not end."""
    if fault is None:
        return inf, inf
    return fault.begin, inf if fault.duration is None else fault.begin + fault.duration


# The blocks that a deployment puts between one robot's controller and the rest of the loop.


Holding: TypeAlias = (
    primitives.DiscreteTimeDelay
    | primitives.ZeroOrderHold
    | systems.LossyMeasurement
    | systems.ShiftedMeasurement
)
"""Blocks that hold measurements."""

NOISE_USES = {"object_pose": 5, "robot_state": 6}
"""Uses of the seeds of the noise of what is measured, see ``seed_of``."""

CLOCK_USE = 7
"""Use of the seed of a robot's clock."""

LOSS_USES = {"object_pose": 1, "robot_state": 2}
"""Uses of the seeds of its losses."""

_STRONGEST = 1e5
"""Limit of every effort where the scenario gives none [N, N m]. A controller outside its funnel may ask for
any effort; without a limit the plant's state would overflow, which ends the process instead of the run."""

_CLOCK = PiecewisePolynomial.FirstOrderHold([0.0, 1e6], [[0.0, 1e6]])
"""The time as a function of itself [s]."""

_KILO = 1e3
"""Unit of the lagging efforts [N, N m]. The integrator's error control compares states of all units with one
number; efforts in newtons would ask for a thousandth of a newton, and for very short steps."""


class Wrapping:
    """Adds to a builder the blocks that a deployment asks for round one robot's controller."""

    def __init__(
        self, builder: DiagramBuilder, deployment: Deployment, robot: int, name: str, *, passes: bool
    ) -> None:
        self._builder, self._deployment, self._robot, self._passes = builder, deployment, robot, passes
        self._own = deployment.of_robot(name)
        self.delays: list[Holding] = []
        self.heard: list[Holding] = []

    def measure(self, entry: InputPort) -> None:
        """Export an input of the controller with its constant errors, noise, delay and losses."""
        name, size = entry.get_name(), entry.size()
        self._lead(entry, self._sensed(name, size) + self._carried(name, size))

    def measure_stamped(self, entry: InputPort) -> OutputPort:
        """Do the same, and return when what the controller gets was measured [s].

        The time of the measurement goes with it through all that delays or loses it.
        """
        name, size = entry.get_name(), entry.size()
        joined, parted, sensed = (
            primitives.Multiplexer([size, 1]),
            primitives.Demultiplexer([size, 1]),
            self._sensed(name, size),
        )
        carried = [(f"{name}_stamped", joined), *self._carried(name, 1 + size), (f"{name}_parted", parted)]
        self._lead(entry, sensed + carried)
        clock = self._builder.AddNamedSystem(f"{name}_clock", primitives.TrajectorySource(_CLOCK))
        shifted = _affine(np.ones(1), np.array([-clock_shift(self._deployment, self._robot)]))
        stamp = self._append(clock.get_output_port(0), [(f"{name}_instant", shifted)])
        self._builder.Connect(stamp, joined.get_input_port(1))
        return parted.get_output_port(1)

    def _sensed(self, name: str, size: int) -> list[tuple[str, LeafSystem]]:
        """Return the blocks of a measurement's errors."""
        period, shift = self._deployment.period, clock_shift(self._deployment, self._robot)
        blocks: list[tuple[str, LeafSystem | None]]
        blocks = [(f"{name}_biased", _distortion(self._own, name, size))]
        # The pose has stamps of one time for all robots of a team that passes.
        if period is not None and shift and not (self._passes and name == "object_pose"):
            shifted = systems.ShiftedMeasurement(size, shift / period, period, self._own.sample_offset)
            blocks.append((f"{name}_shifted", shifted))
            self.delays.append(shifted)
        if period is not None:
            blocks.append((f"{name}_measured", self._noise(name, size, period)))
        return [(label, block) for label, block in blocks if block is not None]

    def _carried(self, name: str, size: int) -> list[tuple[str, LeafSystem]]:
        """Return the blocks that delay or lose a measurement on its way."""
        measurements, period = self._deployment.measurements, self._deployment.period
        if period is None:
            return []
        delays = self._delays(size, whole_periods(measurements.delay, period))
        blocks = [*((f"{name}_delay{i or ''}", delay) for i, delay in enumerate(delays))]
        if (lossy := self._losses(name, size, period)) is not None:
            blocks.append((f"{name}_received", lossy))
        self.delays.extend(block for _, block in blocks if isinstance(block, Holding))
        return blocks

    def hear(self, entry: InputPort) -> None:
        """Export the input of the current cell, which a robot may hear late and time by a wrong clock."""
        blocks: list[tuple[str, LeafSystem]] = []
        if self._own.clock_error:
            blocks.append(("clock_error", _affine(np.ones(2), np.array([0.0, -self._own.clock_error]))))
        if self._deployment.period is not None:
            delays = self._delays(2, whole_periods(self._own.switch_delay, self._deployment.period))
            self.heard.extend(delays)
            blocks.extend((f"switch_delay{i or ''}", delay) for i, delay in enumerate(delays))
        self._lead(entry, blocks)

    def obey(self, entry: InputPort) -> None:
        """Export the input of the hold supervisor's messages, which may be lost, late or not heard."""
        blocks: list[tuple[str, LeafSystem]] = []
        if self._deployment.messages != Messages():
            blocks.append(("holds_radio", build_radio(self._deployment, self._robot, 4)))
        if (deaf := self._own.deaf) is not None:
            blocks.append(("deafness", self._interruption(entry.size(), deaf, held=True)))
        self._lead(entry, blocks)

    def command(self, effort: OutputPort) -> OutputPort:
        """Return the effort that a robot asks of its actuators in each period: after failures, held."""
        size, period, silence = effort.size(), self._deployment.period, self._own.silence
        if period is None:
            return effort
        blocks: list[tuple[str, LeafSystem]] = []
        if silence is not None and silence.motors != "working":
            blocks.append(("motors", self._interruption(size, silence, held=silence.motors == "held")))
        blocks.append(("effort_hold", primitives.ZeroOrderHold(period, size, self._own.sample_offset)))
        return self._append(effort, blocks)

    def actuate(self, effort: OutputPort) -> OutputPort:
        """Return the effort of the actuators: after limits and lag."""
        size = effort.size()
        limits = effort_limits(self._deployment, size - 3)
        blocks: list[tuple[str, LeafSystem]] = [("actuator_limits", systems.LimitedEffort(limits))]
        lag, period = self._deployment.actuators.lag, self._deployment.period
        if lag and period is not None:
            blocks.append(("actuator_lag", systems.LaggingEffort(size, lag, period, self._own.sample_offset)))
        elif lag:
            blocks.append(("effort_in_kilonewtons", primitives.Gain(1.0 / _KILO, size)))
            blocks.append(("actuator_lag", primitives.FirstOrderLowPassFilter(lag, size)))
            blocks.append(("lagged_effort", primitives.Gain(_KILO, size)))
        return self._append(effort, blocks)

    def send(self, message: OutputPort, name: str = "reports", use: int = 0) -> OutputPort:
        """Return the reports of a robot as the cell planner receives them, or its requests likewise.

        Args:
            message: The port that sends.
            name: What the messages are called in the names of blocks.
            use: Of the seed of what is lost, see ``seed_of``.
        """
        period, silence, offset = self._deployment.period, self._own.silence, self._own.sample_offset
        if period is None:
            return message
        blocks: list[tuple[str, LeafSystem]] = []
        if silence is not None:
            before = NOTHING if use == 0 else 0.0
            blocks.append((name, self._interruption(message.size(), silence, held=True, before=before)))
        if offset:
            blocks.append((f"{name}_of_samples", primitives.ZeroOrderHold(period, message.size(), offset)))
        radio = build_radio(self._deployment, self._robot, use)
        return self._append(message, [*blocks, ("radio" if use == 0 else f"{name}_radio", radio)])

    def _append(self, port: OutputPort, blocks: Iterable[tuple[str, LeafSystem]]) -> OutputPort:
        """Add blocks one after the other behind an output, and return the last one's output."""
        for name, block in blocks:
            self._builder.AddNamedSystem(name, block)
            self._builder.Connect(port, block.get_input_port(0))
            port = block.get_output_port(0)
        return port

    def _lead(self, entry: InputPort, blocks: Sequence[tuple[str, LeafSystem]]) -> None:
        """Add blocks one after the other before an input, and export the first one's input by its name."""
        name = entry.get_name()
        for label, block in reversed(blocks):
            if not self._builder.HasSubsystemNamed(label):
                self._builder.AddNamedSystem(label, block)
            self._builder.Connect(block.get_output_port(0), entry)
            entry = block.get_input_port(0)
        self._builder.ExportInput(entry, name)

    def _noise(self, name: str, size: int, period: float) -> systems.MeasurementNoise | None:
        """Return the block that adds noise and waves to a measured port, None if there are neither."""
        deviations = measurement_deviations(self._deployment, name, size)
        waves = measurement_waves(self._deployment, name, size, period)
        if not deviations.any() and not waves[:, 0].any():
            return None
        seed = seed_of(self._deployment, self._robot, NOISE_USES[name])
        return systems.MeasurementNoise(deviations, waves, period, seed)

    def _delays(self, size: int, periods: int) -> list[Holding]:
        """Return the blocks that delay a signal by a number of control periods.

        Controllers compute at the instant at which a block takes its next sample, and before it does: one
        period of the delay is already this.
        """
        period, offset = self._deployment.period, self._own.sample_offset
        assert period is not None
        if periods == 0:
            return []
        if offset == 0.0:
            return [primitives.DiscreteTimeDelay(period, periods - 1, size)]
        return [primitives.ZeroOrderHold(period, size, offset) for _ in range(periods)]

    def _losses(self, name: str, size: int, period: float) -> systems.LossyMeasurement | None:
        m = self._deployment.measurements
        if m.loss == 0.0 and m.late == 0.0:
            return None
        return systems.LossyMeasurement(
            size,
            period,
            loss=m.loss,
            late=m.late,
            late_by=m.late_by,
            offset=self._own.sample_offset,
            seed=seed_of(self._deployment, self._robot, LOSS_USES[name]),
        )

    def _interruption(
        self, size: int, silence: Silence | Deafness, *, held: bool, before: float = 0.0
    ) -> systems.Interruption:
        return systems.Interruption(
            size,
            self._deployment.period or 0.0,
            begin=silence.begin,
            duration=silence.duration,
            held=held,
            offset=self._own.sample_offset,
            before=before,
        )


def clock_shift(deployment: Deployment, robot: int) -> float:
    """Return by how much earlier a robot's sensors measure than it takes them to [s]; negative for later.

    It is drawn once for the run. Nothing is measured later than it is used.
    """
    most = deployment.clock_error
    if not most:
        return 0.0
    drawn = uniform_pair(seed_of(deployment, robot, CLOCK_USE), 0)[0]
    return max((2.0 * drawn - 1.0) * most, -deployment.whole_delay)


def measurement_deviations(deployment: Deployment, name: str, size: int) -> FloatArray:
    """Return the standard deviations of (x, y, angle), or of (x, y, angle, joints..., their rates)."""
    m = deployment.measurements
    count = 3 if name == "object_pose" else size // 2
    positions = [m.position_noise, m.position_noise, *[m.angle_noise] * (count - 2)]
    return np.array([*positions, *[m.rate_noise] * (size - count)])


def measurement_waves(deployment: Deployment, name: str, size: int, period: float) -> FloatArray:
    """Return size, length in periods and phase of the waves of these components, shape (size, 3)."""
    waves = deployment.measurements.waves.of_port(name, size)
    return np.array([[wave.size, wave.period / period, wave.phase] for wave in waves])


def _distortion(own: RobotDepartures, name: str, size: int) -> primitives.AffineSystem | None:
    """Return the block of the constant errors of what a robot measures; None if it has none."""
    factors, offsets = np.ones(size), np.zeros(size)
    if name == "object_pose":
        offsets += own.pose_bias.x, own.pose_bias.y, own.pose_bias.theta
    else:
        rates = size // 2
        factors[rates : rates + 3] += own.odometry_scale
    return None if own.pose_bias == PoseBias() and own.odometry_scale == 0.0 else _affine(factors, offsets)


def _affine(factors: FloatArray, offsets: FloatArray) -> primitives.AffineSystem:
    """Return Drake's block of y_i = f_i u_i + o_i, which has no state."""
    n, none = len(factors), np.zeros(0)
    return primitives.AffineSystem(
        A=np.zeros((0, 0)), B=np.zeros((0, n)), f0=none, C=np.zeros((n, 0)), D=np.diag(factors), y0=offsets
    )


def effort_limits(deployment: Deployment, joints: int) -> FloatArray:
    """Return the largest force and torque of a base and the largest efforts of joints, shape (2 + n,)."""
    limits = deployment.actuators
    force, torque, effort = (
        _STRONGEST if limit is None else limit
        for limit in (limits.base_force, limits.base_torque, limits.joint_effort)
    )
    return np.array([force, torque, *[effort] * joints])


# A robot's controller with sensors, actuators and radio, where the team is not ideal.


@dataclass(frozen=True)
class DeployedController:
    """A controller behind its radio, and behind its sensors and actuators unless these are part of the world.

    Attributes:
        diagram: The whole; it has the same ports as the controller inside.
        controller: The controller inside.
        delays: Blocks that hold measurements, in the order of the signals.
        heard: Blocks that hold the current cell, in this order.
    """

    diagram: Diagram
    controller: Diagram
    delays: tuple[Holding, ...]
    heard: tuple[Holding, ...] = ()

    def prepare(self, root: Context, p_WG: FloatArray) -> None:
        """Set p_G to the object's position at the plan's start [m], and held measurements to their values."""
        if self.controller.HasSubsystemNamed("governor_state"):
            governor = self.controller.GetSubsystemByName("governor_state")
            governor.set_integral_value(governor.GetMyMutableContextFromRoot(root), p_WG)
        _prepare(self.delays, root)

    def begin(self, root: Context, cell: int, object_pose: FloatArray, joints: FloatArray) -> None:
        """Set all states to those of a robot that is at rest in a cell.

        Args:
            root: The context, of this Diagram alone, in which the inputs are set.
            cell: Index of the cell, which is also that of the input ``current_cell``.
            object_pose: Where the object rests, the same for all robots, (x, y, angle) in W.
            joints: Where the robot's own joints rest [rad or m].
        """
        time = root.get_time()
        self.diagram.SetDefaultContext(root)
        root.SetTime(time)
        self.keep_position(root, object_pose[:2])
        self.command_axes(root, cell, np.zeros(1 + len(joints)))

    def command_axes(self, root: Context, cell: int, jumps: FloatArray) -> None:
        """Set what a switch to a cell leaves of the accelerations of the angle and of the joints.

        Args:
            root: The context, in which the cell is entered now.
            cell: Index of the cell.
            jumps: Shape (1 + n,) [rad/s^2 or m/s^2].
        """
        _prepare(self.heard, root)
        block = self.controller.GetSubsystemByName("axis_ppc")
        state = block.GetMyMutableContextFromRoot(root).get_mutable_discrete_state_vector()
        state.SetFromVector([cell, *jumps])

    def keep_position(self, root: Context, position: FloatArray) -> None:
        """Set p_G to rest at a position, shape (2,) [m]."""
        if self.controller.HasSubsystemNamed("governor_state"):
            governor = self.controller.GetSubsystemByName("governor_state")
            governor.set_integral_value(governor.GetMyMutableContextFromRoot(root), position)


def _prepare(delays: tuple[Holding, ...], root: Context) -> None:
    """Set held measurements to their values at the start."""
    for delay in delays:
        context = delay.GetMyMutableContextFromRoot(root)
        now, state = delay.get_input_port(0).Eval(context), context.get_mutable_discrete_state_vector()
        lossy = isinstance(delay, systems.LossyMeasurement)
        at_rest = delay.state_at_rest(now) if lossy else np.tile(now, state.size() // len(now))
        state.SetFromVector(at_rest)


@dataclass(frozen=True)
class Body:
    """The sensors and actuators of a robot whose controller runs elsewhere.

    ======= ======================== ========= ==========================================================
    input   ``object_pose``          3         the object's pose
    input   ``robot_state``          2 (3 + n) the robot's state
    input   ``effort_command``       3 + n     what its controller asks for, held between samples
    output  ``measured_object_pose`` 3         as the controller gets it
    output  ``measured_robot_state`` 2 (3 + n) as the controller gets it
    output  ``object_pose_stamp``    1         when the pose was measured that the controller gets [s]
    output  ``robot_state_stamp``    1         when the state was measured that the controller gets [s]
    output  ``robot_effort``         3 + n     what the actuators give
    ======= ======================== ========= ==========================================================

    Attributes:
        diagram: The whole.
        delays: Blocks that hold measurements, in the order of the signals.
    """

    diagram: Diagram
    delays: tuple[Holding, ...]

    def prepare(self, root: Context) -> None:
        """Set held measurements to their values at the start."""
        _prepare(self.delays, root)


_MEASURED = ("object_pose", "robot_state")
"""What a controller measures."""


def build_body(deployment: Deployment, robot: int, name: str, joints: int, *, passes: bool) -> Body:
    """Build the sensors and actuators of a robot with a number of joints; see :func:`deploy`.

    ``passes`` says whether its team passes from cell to cell.
    """
    builder, sizes = DiagramBuilder(), {"object_pose": 3, "robot_state": 2 * (3 + joints)}
    wrapping = Wrapping(builder, deployment, robot, name, passes=passes)
    for entry in _MEASURED:
        elements = {f"measured_{entry}": [(0, i) for i in range(sizes[entry])]}
        given = builder.AddNamedSystem(
            f"given_{entry}", systems.build_selector({entry: sizes[entry]}, elements)
        )
        builder.ExportOutput(wrapping.measure_stamped(given.get_input_port(0)), f"{entry}_stamp")
        builder.ExportOutput(given.get_output_port(0), f"measured_{entry}")
    command = builder.AddNamedSystem("effort_command", primitives.PassThrough(3 + joints))
    builder.ExportInput(command.get_input_port(), "effort_command")
    builder.ExportOutput(wrapping.actuate(command.get_output_port()), "robot_effort")
    return Body(builder.Build(), tuple(wrapping.delays))


def deploy(
    controller: Diagram, deployment: Deployment, robot: int, name: str, *, bodiless: bool = False
) -> DeployedController:
    """Add an effort limit to a robot's controller, and what else a deployment puts round it.

    In the order of the signals: ``robot_state`` and ``object_pose`` get their constant errors, noise, a delay
    and losses; ``current_cell`` gets the error of the clock and a delay; ``robot_effort`` fails where the
    motors do, is held for a period, then limited, then lags; ``ready`` stops where the robot is silent, then
    goes through a :class:`MessageChannel`; so do messages about holds, to the supervisor and back. The limit
    is always there: that of the actuators, or where none is given, one so high that only a diverging run
    reaches it.

    Args:
        controller: From :func:`build_robot_controller`, with the same period.
        deployment: What is switched on.
        robot: Index k of the robot; every robot has noise and losses of its own.
        name: Name of the robot.
        bodiless: Whether sensors, limits and lag are those of a :class:`Body` in another Diagram.
    """
    builder = DiagramBuilder()
    builder.AddNamedSystem("controller", controller)
    wrapping = Wrapping(builder, deployment, robot, name, passes=controller.HasOutputPort("phase"))
    for entry in _MEASURED:
        if bodiless:
            builder.ExportInput(controller.GetInputPort(entry), entry)
        else:
            wrapping.measure(controller.GetInputPort(entry))
    effort = wrapping.command(controller.GetOutputPort("robot_effort"))
    builder.ExportOutput(effort if bodiless else wrapping.actuate(effort), "robot_effort")
    if controller.HasOutputPort("said"):  # Its words have a radio of their own.
        builder.ExportInput(controller.GetInputPort("words"), "words")
        builder.ExportOutput(controller.GetOutputPort("said"), "said")
    else:
        wrapping.hear(controller.GetInputPort("current_cell"))
        builder.ExportOutput(wrapping.send(controller.GetOutputPort("ready")), "ready")
    held = controller.HasOutputPort("hold_request")
    if held:
        wrapping.obey(controller.GetInputPort("hold_message"))
        request = wrapping.send(controller.GetOutputPort("hold_request"), "requests", 3)
        builder.ExportOutput(request, "hold_request")
    for output in (*TELEMETRY, *(["clock"] if held else [])):
        builder.ExportOutput(controller.GetOutputPort(output), output)
    return DeployedController(builder.Build(), controller, tuple(wrapping.delays), tuple(wrapping.heard))

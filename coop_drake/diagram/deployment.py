"""Sensors, actuators and radio of a robot when the team is not ideal."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydrake.common import RandomDistribution, RandomGenerator
from pydrake.systems.framework import Context, Diagram, DiagramBuilder, OutputPort
from pydrake.systems.primitives import (
    Adder,
    DiscreteTimeDelay,
    FirstOrderLowPassFilter,
    Gain,
    LinearSystem,
    RandomSource,
    Saturation,
    ZeroOrderHold,
)

from coop_drake.diagram.robot_controller import TELEMETRY
from coop_drake.scenario import Deployment, Messages
from coop_drake.systems import MessageChannel, clear_channel, whole_periods
from coop_drake.tree.pose import FloatArray

__all__ = ["DeployedController", "build_radio", "deploy"]


_STRONGEST = 1e5
"""Limit of every effort where the scenario gives none [N, N m]. A controller outside its funnel may ask for
any effort; without a limit the plant's state would overflow, which ends the process instead of the run."""

_KILO = 1e3
"""Unit of the lagging efforts [N, N m]. The integrator's error control compares states of all units with one
number; efforts in newtons would ask for a thousandth of a newton, and for very short steps."""


@dataclass(frozen=True)
class DeployedController:
    """A controller behind its sensors, actuators and radio.

    Attributes:
        diagram: The whole; it has the same ports as the controller inside.
        controller: The controller inside.
        noises: Sources of noise.
        delays: For each measured port the block that delays it.
        seed: Of the sources of noise.
    """

    diagram: Diagram
    controller: Diagram
    noises: tuple[RandomSource, ...]
    delays: dict[str, DiscreteTimeDelay]
    seed: int

    def prepare(self, root: Context) -> None:
        """Seed the noise, and set p_G and delayed measurements to their values at the start."""
        pose = self.diagram.GetInputPort("object_pose").Eval(self.diagram.GetMyContextFromRoot(root))
        governor = self.controller.GetSubsystemByName("governor_state")
        governor.set_integral_value(governor.GetMyMutableContextFromRoot(root), pose[:2])
        generator = RandomGenerator(self.seed)
        for noise in self.noises:
            noise.SetRandomContext(noise.GetMyMutableContextFromRoot(root), generator)
        for name, delay in self.delays.items():
            now = self.diagram.GetInputPort(name).Eval(self.diagram.GetMyContextFromRoot(root))
            buffer = delay.GetMyMutableContextFromRoot(root).get_mutable_discrete_state_vector()
            buffer.SetFromVector(np.tile(now, buffer.size() // len(now)))


def deploy(controller: Diagram, deployment: Deployment, robot: int) -> DeployedController:
    """Add an effort limit to a robot's controller, and the noise, delays, hold and radio of a deployment.

    In the order of the signals: ``robot_state`` and ``object_pose`` get noise, then a delay; ``robot_effort``
    is held for a period, then limited, then lags; ``ready`` goes through a :class:`MessageChannel`, or a
    hold where nothing is lost or late. The limit is always there: that of the actuators, or where none is
    given, one so high that only a diverging run reaches it.

    Args:
        controller: From :func:`build_robot_controller`, with the same period.
        deployment: What is switched on.
        robot: Index k of the robot; every robot has noise and losses of its own.
    """
    builder = DiagramBuilder()
    builder.AddNamedSystem("controller", controller)
    wrapping = _Wrapping(builder, deployment)
    joints = (controller.GetInputPort("robot_state").size() - 6) // 2
    wrapping.measure(controller, "object_pose", _noise(deployment, 0)[:3])
    wrapping.measure(controller, "robot_state", _noise(deployment, joints))
    builder.ExportInput(controller.GetInputPort("current_cell"), "current_cell")
    effort = wrapping.actuate(controller.GetOutputPort("robot_effort"), joints)
    builder.ExportOutput(effort, "robot_effort")
    builder.ExportOutput(wrapping.send(controller.GetOutputPort("ready"), robot), "ready")
    for name in TELEMETRY:
        builder.ExportOutput(controller.GetOutputPort(name), name)
    return DeployedController(
        builder.Build(), controller, tuple(wrapping.noises), wrapping.delays, _seed(deployment, robot)
    )


def build_radio(deployment: Deployment, robot: int) -> MessageChannel | LinearSystem:
    """Build the channel of a robot's reports in a sampled team."""
    messages, period = deployment.messages, deployment.period or 0.0
    if messages == Messages():
        return clear_channel(period)
    return MessageChannel(
        period,
        delay=messages.delay,
        loss=messages.loss,
        repeat=messages.repeat,
        seed=_seed(deployment, robot),
    )


def _seed(deployment: Deployment, robot: int) -> int:
    return int(np.random.SeedSequence([deployment.seed, robot]).generate_state(1)[0])


class _Wrapping:
    """Adds to a builder the blocks that a deployment asks for.

    Args:
        builder: Receives them.
        deployment: What is switched on.
    """

    def __init__(self, builder: DiagramBuilder, deployment: Deployment) -> None:
        self._builder, self._deployment = builder, deployment
        self.noises: list[RandomSource] = []
        self.delays: dict[str, DiscreteTimeDelay] = {}

    def measure(self, controller: Diagram, name: str, deviations: FloatArray) -> None:
        """Export an input of the controller with its noise and its delay."""
        entry, period = controller.GetInputPort(name), self._deployment.period
        size = entry.size()
        if period is not None and self._deployment.measurements.delay > 0.0:
            # Controllers compute at the instant at which the delay takes its next sample, and before it does:
            # one period of the measurements' age is already this.
            steps = whole_periods(self._deployment.measurements.delay, period) - 1
            delay = self._builder.AddNamedSystem(f"{name}_delay", DiscreteTimeDelay(period, steps, size))
            self._builder.Connect(delay.get_output_port(), entry)
            self.delays[name], entry = delay, delay.get_input_port()
        if period is not None and deviations.any():
            adder = self._builder.AddNamedSystem(f"{name}_measured", Adder(2, size))
            noise = self._builder.AddNamedSystem(
                f"{name}_noise", RandomSource(RandomDistribution.kGaussian, size, period)
            )
            scale = self._builder.AddNamedSystem(f"{name}_deviations", Gain(deviations))
            self._builder.Connect(noise.get_output_port(), scale.get_input_port())
            self._builder.Connect(scale.get_output_port(), adder.get_input_port(1))
            self._builder.Connect(adder.get_output_port(), entry)
            self.noises.append(noise)
            entry = adder.get_input_port(0)
        self._builder.ExportInput(entry, name)

    def actuate(self, effort: OutputPort, joints: int) -> OutputPort:
        """Return the effort after hold and limits."""
        if self._deployment.period is not None:
            hold = self._builder.AddNamedSystem(
                "effort_hold", ZeroOrderHold(self._deployment.period, 3 + joints)
            )
            self._builder.Connect(effort, hold.get_input_port())
            effort = hold.get_output_port()
        limits = _limits(self._deployment, joints)
        saturation = self._builder.AddNamedSystem("actuator_limits", Saturation(-limits, limits))
        self._builder.Connect(effort, saturation.get_input_port())
        return self._lag(saturation.get_output_port())

    def _lag(self, effort: OutputPort) -> OutputPort:
        """Return what actuators give that follow their commands with a lag."""
        if (lag := self._deployment.actuators.lag) == 0.0:
            return effort
        chain = (
            ("effort_in_kilonewtons", Gain(1.0 / _KILO, effort.size())),
            ("actuator_lag", FirstOrderLowPassFilter(lag, effort.size())),
            ("lagged_effort", Gain(_KILO, effort.size())),
        )
        for name, block in chain:
            self._builder.AddNamedSystem(name, block)
            self._builder.Connect(effort, block.get_input_port())
            effort = block.get_output_port()
        return effort

    def send(self, ready: OutputPort, robot: int) -> OutputPort:
        """Return the reports of a robot as the cell planner receives them."""
        if self._deployment.period is None:
            return ready
        channel = self._builder.AddNamedSystem("radio", build_radio(self._deployment, robot))
        self._builder.Connect(ready, channel.get_input_port())
        return channel.get_output_port()


def _noise(deployment: Deployment, joints: int) -> FloatArray:
    """Return the standard deviations of (x, y, angle, joints..., their rates), shape (2 (3 + n),)."""
    m = deployment.measurements
    positions = [m.position_noise, m.position_noise, *[m.angle_noise] * (1 + joints)]
    return np.array([*positions, *[m.rate_noise] * (3 + joints)])


def _limits(deployment: Deployment, joints: int) -> FloatArray:
    """Return the largest base wrench and joint torques, shape (3 + n,)."""
    limits = deployment.actuators
    force, torque, effort = (
        _STRONGEST if limit is None else limit
        for limit in (limits.base_force, limits.base_torque, limits.joint_effort)
    )
    return np.array([force, force, torque, *[effort] * joints])

"""A robot's controller with sensors, actuators and radio, where the team is not ideal."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.systems.framework import Context, Diagram, DiagramBuilder
from pydrake.systems.primitives import PassThrough

from coop_drake.diagram.robot_controller import TELEMETRY
from coop_drake.diagram.wrapping import Holding, Wrapping
from coop_drake.scenario import Deployment
from coop_drake.systems import LossyMeasurement, build_selector
from coop_drake.tree.pose import FloatArray


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
        axes = np.array([object_pose[2], *joints])
        self._rest(root, "nominal_axes", axes)
        self._rest(root, "departure_monitor", object_pose[:2], axes, cell)
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

    def nominal_axes(self, root: Context) -> FloatArray | None:
        """Return nominal angle and joints, then their rates, shape (2, 1 + n); None where there are none."""
        if not self.controller.HasSubsystemNamed("nominal_axes"):
            return None
        block = self.controller.GetSubsystemByName("nominal_axes")
        return block.states_of(block.GetMyContextFromRoot(root))[:2].copy()

    def nominal_position(self, root: Context) -> FloatArray | None:
        """Return the object's nominal position, shape (2,) [m]; None where there is none."""
        if not self.controller.HasSubsystemNamed("nominal_governor"):
            return None
        context = self.controller.GetSubsystemByName("nominal_governor").GetMyContextFromRoot(root)
        return np.array(context.get_discrete_state_vector().value()[:2])

    def keep_position(self, root: Context, position: FloatArray) -> None:
        """Set p_G, and where it has one its nominal motion, to rest at a position, shape (2,) [m]."""
        if self.controller.HasSubsystemNamed("governor_state"):
            governor = self.controller.GetSubsystemByName("governor_state")
            governor.set_integral_value(governor.GetMyMutableContextFromRoot(root), position)
        self._rest(root, "nominal_governor", position)

    def _rest(self, root: Context, name: str, *values: Any) -> None:
        """Set the state of a block, where there is one of this name, to its state at rest."""
        if self.controller.HasSubsystemNamed(name):
            block = self.controller.GetSubsystemByName(name)
            state = block.GetMyMutableContextFromRoot(root).get_mutable_discrete_state_vector()
            state.SetFromVector(block.state_at_rest(*values))


def _prepare(delays: tuple[Holding, ...], root: Context) -> None:
    """Set held measurements to their values at the start."""
    for delay in delays:
        context = delay.GetMyMutableContextFromRoot(root)
        now, state = delay.get_input_port(0).Eval(context), context.get_mutable_discrete_state_vector()
        lossy = isinstance(delay, LossyMeasurement)
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


def build_body(deployment: Deployment, robot: int, name: str, joints: int) -> Body:
    """Build the sensors and actuators of a robot with a number of joints; arguments as for :func:`deploy`."""
    builder, sizes = DiagramBuilder(), {"object_pose": 3, "robot_state": 2 * (3 + joints)}
    wrapping = Wrapping(builder, deployment, robot, name)
    for entry in _MEASURED:
        elements = {f"measured_{entry}": [(0, i) for i in range(sizes[entry])]}
        given = builder.AddNamedSystem(f"given_{entry}", build_selector({entry: sizes[entry]}, elements))
        builder.ExportOutput(wrapping.measure_stamped(given.get_input_port(0)), f"{entry}_stamp")
        builder.ExportOutput(given.get_output_port(0), f"measured_{entry}")
    command = builder.AddNamedSystem("effort_command", PassThrough(3 + joints))
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
    goes through a :class:`MessageChannel`, or a hold where nothing is lost or late; so do messages about
    holds, to the supervisor and back. The limit is always
    there: that of the actuators, or where none is given, one so high that only a diverging run reaches it.

    Args:
        controller: From :func:`build_robot_controller`, with the same period.
        deployment: What is switched on.
        robot: Index k of the robot; every robot has noise and losses of its own.
        name: Name of the robot.
        bodiless: Whether sensors, limits and lag are those of a :class:`Body` in another Diagram.
    """
    builder = DiagramBuilder()
    builder.AddNamedSystem("controller", controller)
    wrapping = Wrapping(builder, deployment, robot, name)
    for entry in _MEASURED:
        if bodiless:
            builder.ExportInput(controller.GetInputPort(entry), entry)
        else:
            wrapping.measure(controller.GetInputPort(entry))
    wrapping.hear(controller.GetInputPort("current_cell"))
    effort = wrapping.command(controller.GetOutputPort("robot_effort"))
    builder.ExportOutput(effort if bodiless else wrapping.actuate(effort), "robot_effort")
    builder.ExportOutput(wrapping.send(controller.GetOutputPort("ready")), "ready")
    held = controller.HasOutputPort("hold_request")
    if held:
        wrapping.obey(controller.GetInputPort("hold_message"))
        request = wrapping.send(controller.GetOutputPort("hold_request"), "requests", 3)
        builder.ExportOutput(request, "hold_request")
    for output in (*TELEMETRY, *(["clock"] if held else [])):
        builder.ExportOutput(controller.GetOutputPort(output), output)
    return DeployedController(builder.Build(), controller, tuple(wrapping.delays), tuple(wrapping.heard))

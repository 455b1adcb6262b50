"""The transport station: the simulated team with sensors, actuators and disturbances; loops round it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from math import inf, pi, sin
from typing import Any, NamedTuple

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import Propeller, PropellerInfo
from pydrake.systems.framework import Context, Diagram, DiagramBuilder, OutputPort, System
from pydrake.systems.primitives import (
    Adder,
    ConstantValueSource,
    Demultiplexer,
    MatrixGain,
    Selector,
    TrajectorySource,
)
from pydrake.trajectories import PiecewisePolynomial

from coop_drake.answers.plan import Plan
from coop_drake.errors import ScenarioError
from coop_drake.plant import (
    SeparateTeam,
    TeamPlant,
    build_separate_team,
    build_team_plant,
    read_component_tree,
    read_team_tree,
    set_configuration,
)
from coop_drake.scenario import Deployment, Floor, JointFriction, Push, Scenario
from coop_drake.systems import (
    FloorFriction,
    Sticking,
    TeamSensor,
    WheelSlips,
    build_selector,
    build_separate_sensor,
)
from coop_drake.systems.block import release_all
from coop_drake.tree.pose import FloatArray

_GRAVITY = 9.80665
"""Standard acceleration of gravity [m/s^2]."""


def tilt_floor(team: TeamPlant, floor: Floor) -> None:
    """Let gravity pull all bodies of a plant down the slope of the floor, along x of W."""
    if floor.slope:
        team.plant.mutable_gravity_field().set_gravity_vector([downhill(floor.slope), 0.0, 0.0])


def downhill(slope: float) -> float:
    """Return the acceleration of gravity along a floor [m/s^2], which falls by an angle [rad]."""
    return _GRAVITY * sin(slope)


def add_disturbances(
    builder: DiagramBuilder,
    team: TeamPlant,
    deployment: Deployment,
    states: Sequence[OutputPort],
    wrenches: OutputPort,
    torques: OutputPort,
) -> OutputPort:
    """Add friction and pushes to the wrenches on all bases, and pushes on the object behind them.

    Slipping wheels take their share off what the actuators give; blocked ones act on the sum of all, and so
    does the friction of joints, which the plant gets as generalized forces.

    Args:
        builder: Receives the blocks.
        team: The team.
        deployment: What is switched on.
        states: True state of every robot.
        wrenches: Wrenches on all bases in W, of size 3 N.
        torques: Torques of all joints, of size n.

    Returns:
        Wrenches on all bases, and where there are pushes, the one on the object at L: size 3 N or 3 N + 3.

    Raises:
        ScenarioError: Wheels are blocked or joints have friction in a team with springs.
    """
    floor, size, own = deployment.floor, wrenches.size(), [robot.name for robot in team.robots]
    slips, blocked = wheel_slips(deployment, own), blocked_times(deployment, own)
    if np.isfinite(slips[0]).any():
        slipping = builder.AddNamedSystem("wheel_slips", WheelSlips(slips))
        builder.Connect(wrenches, slipping.get_input_port())
        wrenches = slipping.get_output_port()
    if floor.coulomb_friction or floor.viscous_friction:
        joints = [len(robot.joints) for robot in team.robots]
        friction = builder.AddNamedSystem(
            "floor_friction", FloorFriction(joints, floor.coulomb_friction, floor.viscous_friction)
        )
        for k, state in enumerate(states):
            builder.Connect(state, friction.get_input_port(k))
        wrenches = _sum(builder, "wrenches_less_friction", wrenches, friction.get_output_port())
    if deployment.pushes:
        names = [*own, team.scenario.object]
        on_object = builder.AddNamedSystem("wrenches_with_object", MatrixGain(np.eye(size + 3, size)))
        builder.Connect(wrenches, on_object.get_input_port())
        pushes = builder.AddNamedSystem("pushes", TrajectorySource(_pushes(deployment.pushes, names)))
        wrenches = _sum(builder, "pushed", on_object.get_output_port(), pushes.get_output_port())
    if np.isfinite(blocked[0]).any() or deployment.joint_friction != JointFriction():
        wrenches = _stick(builder, team, blocked, wrenches, torques)
    return wrenches


def blocked_times(deployment: Deployment, names: Sequence[str]) -> FloatArray:
    """Return when the wheels of every robot are blocked from and until, inf for never, shape (2, N) [s]."""
    found = [deployment.of_robot(name).blocked for name in names]
    return np.array([
        (inf, inf) if one is None else (one.begin, inf if one.duration is None else one.begin + one.duration)
        for one in found
    ]).T.copy()  # fmt: skip


def wheel_slips(deployment: Deployment, names: Sequence[str]) -> FloatArray:
    """Return when the wheels of every robot slip from and until [s], and the share [-], shape (3, N)."""
    found = [deployment.of_robot(name).slip for name in names]
    return np.array([
        (inf, inf, 0.0)
        if one is None
        else (one.begin, inf if one.duration is None else one.begin + one.duration, one.share)
        for one in found
    ]).T.copy()  # fmt: skip


def _stick(
    builder: DiagramBuilder, team: TeamPlant, times: FloatArray, wrenches: OutputPort, torques: OutputPort
) -> OutputPort:
    """Add the wrenches of the floor on bases with blocked wheels, and the friction of joints.

    Raises:
        ScenarioError: The team has springs.
    """
    deployment = team.scenario.deployment
    friction, gravity = deployment.joint_friction, downhill(deployment.floor.slope)
    if team.plant.num_force_elements() > 1:  # every plant has gravity
        key, value = ("joint_friction", friction) if friction != JointFriction() else ("robots", "blocked")
        allowed = "none: blocked wheels and friction of joints are simulated for models without springs alone"
        raise ScenarioError(str(team.scenario.path), f"deployment.{key}", value, allowed)
    whole = read_team_tree(team, read_component_tree(team))
    levels, size = (friction.coulomb, friction.viscous), wrenches.size()
    block = Sticking(whole, team.velocity_index[3:], times, levels, gravity, size)
    builder.AddNamedSystem("sticking", block)
    parts = builder.AddNamedSystem("sticking_parts", Demultiplexer([size, team.plant.num_velocities()]))
    builder.Connect(team.plant.get_state_output_port(), block.GetInputPort("team_state"))
    if team.joints:
        builder.Connect(torques, block.GetInputPort("joint_torques"))
    builder.Connect(wrenches, block.GetInputPort("asked"))
    builder.Connect(block.get_output_port(), parts.get_input_port())
    builder.Connect(parts.get_output_port(1), team.plant.get_applied_generalized_force_input_port())
    return parts.get_output_port(0)


def _sum(builder: DiagramBuilder, name: str, first: OutputPort, second: OutputPort) -> OutputPort:
    adder = builder.AddNamedSystem(name, Adder(2, first.size()))
    builder.Connect(first, adder.get_input_port(0))
    builder.Connect(second, adder.get_input_port(1))
    return adder.get_output_port()


def _pushes(pushes: Sequence[Push], names: Sequence[str]) -> PiecewisePolynomial:
    """Return the sum of all pushes on each of the bodies named, as a function of time."""
    times = sorted({0.0, *(push.time for push in pushes), *(push.time + push.duration for push in pushes)})
    # The last sample is zero, and its value holds for ever.
    values = np.zeros((3 * len(names), len(times)))
    for push in pushes:
        at = 3 * names.index(push.body)
        lasting = [push.time <= time < push.time + push.duration for time in times]
        values[at : at + 3, lasting] += np.array([[*push.force, push.torque]]).T
    return PiecewisePolynomial.ZeroOrderHold([*times, times[-1] + 1.0], np.c_[values, values[:, -1]])


# The transport station: the simulated team with its sensors and actuators.


@dataclass(frozen=True)
class TransportStation:
    """The station and the team inside it.

    Attributes:
        diagram: The station.
        team: Its plant, with names for the parts.
    """

    diagram: Diagram
    team: TeamPlant


def build_station(scenario: Scenario) -> TransportStation:
    """Build the team's plant as in the scenario, with an actuation and a state port for each robot.

    ======= =========================== ========== =========================================================
    input   ``robot_<k>_effort``        3 + n_k    base wrench and joint torques of robot k
    output  ``object_pose``             3          pose of L in W
    output  ``robot_<k>_state``         2(3+n_k)   z_k and its rate
    output  ``generalized_acceleration``  3+n      the plant's accelerations, for the log alone; 3 more for
                                                   each base where robots are trees of their own
    output  ``query_object``            abstract   geometry, for visualization
    ======= =========================== ========== =========================================================

    Raises:
        ScenarioError: The models do not make a team.
    """
    builder = DiagramBuilder()
    team = (build_team_plant if scenario.plant.ideal else build_separate_team)(scenario, builder)
    plant = team.plant
    tilt_floor(team, scenario.deployment.floor)
    states = _measure(builder, team)
    _drive_robots(builder, team, states)
    builder.ExportOutput(plant.get_generalized_acceleration_output_port(), "generalized_acceleration")
    builder.ExportOutput(team.scene_graph.get_query_output_port(), "query_object")
    return TransportStation(builder.Build(), team)


def _measure(builder: DiagramBuilder, team: TeamPlant) -> list[OutputPort]:
    """Add the sensors of the object's pose and of every robot's own state; return the latter."""
    names = ["object_pose", *(f"robot_{robot.index}_state" for robot in team.robots)]
    if isinstance(team, SeparateTeam):
        sensor = parts = builder.AddNamedSystem("team_sensor", build_separate_sensor(team))
    else:
        sensor = builder.AddNamedSystem("team_sensor", TeamSensor(team))
        parts = builder.AddNamedSystem("measurements", Demultiplexer(sensor.sizes))
        builder.Connect(sensor.get_output_port(), parts.get_input_port())
    builder.Connect(team.plant.get_state_output_port(), sensor.GetInputPort("team_state"))
    for i, name in enumerate(names):
        builder.ExportOutput(parts.get_output_port(i), name)
    return [parts.get_output_port(i) for i in range(1, len(names))]


def _drive_robots(builder: DiagramBuilder, team: TeamPlant, states: Sequence[OutputPort]) -> None:
    """Add inputs for the effort of every robot: wrenches in W on the bases, torques on the joints."""
    plant, efforts = team.plant, builder.AddNamedSystem("efforts", _efforts(team))
    for i in range(efforts.num_input_ports()):
        builder.ExportInput(efforts.get_input_port(i), efforts.get_input_port(i).get_name())
    wrenches = add_disturbances(
        builder,
        team,
        team.scenario.deployment,
        states,
        efforts.GetOutputPort("base_wrenches"),
        efforts.GetOutputPort("joint_torques"),
    )
    thrusters = _add_thrusters(builder, team, with_object=wrenches.size() > 3 * len(team.robots))
    # Thrusters push along the axes of the poses that they receive. These are the identity, so that they push
    # along the axes of W, however the bases turn.
    axes = AbstractValue.Make([RigidTransform()] * plant.num_bodies())
    world = builder.AddNamedSystem("world_axes", ConstantValueSource(axes))
    builder.Connect(world.get_output_port(), thrusters.get_body_poses_input_port())
    builder.Connect(wrenches, thrusters.get_command_input_port())
    if team.joints:
        builder.Connect(efforts.GetOutputPort("joint_torques"), plant.get_actuation_input_port())


def _efforts(team: TeamPlant) -> Selector:
    """Build the block that sorts the efforts of all robots into wrenches on bases and torques of joints."""
    sizes = [3 + len(robot.joints) for robot in team.robots]
    return build_selector(
        {f"robot_{robot.index}_effort": size for robot, size in zip(team.robots, sizes, strict=True)},
        {
            "base_wrenches": [(k, i) for k in range(len(sizes)) for i in range(3)],
            "joint_torques": [(k, i) for k, size in enumerate(sizes) for i in range(3, size)],
        },
    )


def _add_thrusters(builder: DiagramBuilder, team: TeamPlant, *, with_object: bool) -> Propeller:
    """Add Drake's Propeller for the wrenches on bases: thrusts along x and y, a moment about z.

    A base wrench given as a generalized force would move the team in the same way, but the reaction at the
    grasp could then not be read from the plant. The object may have three thrusters at L of its own, behind
    those of the bases.
    """
    places = [(robot.base_body.index(), np.zeros(3)) for robot in team.robots]
    if with_object:
        X_BL = team.object_frame.GetFixedPoseInBodyFrame()
        places.append((team.object_body.index(), X_BL.translation()))
    thrusters = [
        PropellerInfo(body, RigidTransform(R_BP, p_BP), thrust, moment)
        for body, p_BP in places
        for R_BP, thrust, moment in (
            (RotationMatrix.MakeYRotation(0.5 * pi), 1.0, 0.0),
            (RotationMatrix.MakeXRotation(-0.5 * pi), 1.0, 0.0),
            (RotationMatrix(), 0.0, 1.0),
        )
    ]
    bases = builder.AddNamedSystem("base_thrusters", Propeller(thrusters))
    builder.Connect(bases.get_spatial_forces_output_port(), team.plant.get_applied_spatial_force_input_port())
    return bases


# What all loops of a simulated team have in common, and how their ports are read for the log.


class PortRow:
    """The values of many ports in one row.

    Args:
        root: Context of the whole diagram; every reading is of its present content.
    """

    def __init__(self, root: Context) -> None:
        self._root = root
        self._readers: list[Callable[[], FloatArray]] = []
        self._size = 0

    def add(self, system: System, output: str) -> Any:
        """Append an output and return its indices in the row."""
        first = self._size
        self._readers.append(
            partial(system.GetOutputPort(output).Eval, system.GetMyContextFromRoot(self._root))
        )
        self._size += system.GetOutputPort(output).size()
        return np.arange(first, self._size)

    def read(self) -> FloatArray:
        """The present values of all ports."""
        return np.concatenate([read() for read in self._readers])


class Places(NamedTuple):
    """Indices in a row of ports of the parts of a sample, as integer arrays of the parts' shapes."""

    instant: Any
    base_poses: Any
    governors: Any
    funnel_lower: Any
    funnel_upper: Any
    energy_margins: Any
    commanded_wrenches: Any
    base_wrenches: Any
    joint_torques: Any
    accelerations: Any
    realised: Any
    ready_margins: Any
    clock_lag: Any
    causes: Any
    alarms: Any


@dataclass(frozen=True)
class Loop(ABC):
    """A simulated team with all that drives it.

    Attributes:
        diagram: The Diagram of everything.
        station: The simulated team.
        plan: The plan that is followed.
        start: Where the team stands at first, shape (3 + n,) [m, rad].
    """

    diagram: Diagram
    station: TransportStation
    plan: Plan
    start: FloatArray

    @property
    def team(self) -> TeamPlant:
        """The simulated team."""
        return self.station.team

    def create_context(self) -> Context:
        """Create a context of a team at rest."""
        context = self.diagram.CreateDefaultContext()
        team = self.team
        set_configuration(team, team.plant.GetMyMutableContextFromRoot(context), self.start)
        return context

    @abstractmethod
    def places(self, ports: PortRow) -> Places:
        """Add all outputs that are logged to a row, and return where they stand."""

    def realised(self, ports: PortRow) -> Any:
        """Add the accelerations of z in the plant to a row, and return where they stand, shape (3 + n,)."""
        return ports.add(self.station.diagram, "generalized_acceleration")[self.team.velocity_index]

    def release(self) -> None:
        """Free all memory after the last context is gone; no part of the loop may be used any more."""
        release_all(self.diagram)

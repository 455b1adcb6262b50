"""Forces on a team that are not its own: floor, failing wheels, friction of joints, pushes from outside."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf, sin

import numpy as np
from pydrake.systems.framework import DiagramBuilder, OutputPort
from pydrake.systems.primitives import Adder, Demultiplexer, MatrixGain, TrajectorySource
from pydrake.trajectories import PiecewisePolynomial

from coop_drake.errors import ScenarioError
from coop_drake.plant import TeamPlant, read_component_tree, read_team_tree
from coop_drake.scenario import Deployment, Floor, JointFriction, Push
from coop_drake.systems import FloorFriction, Sticking, WheelSlips
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

"""What acts on a team: efforts of its robots, what actuators give of them, and what the world does besides.

A departure of the world has its key in ``scenario/deployment.py``, its numbers for a run and its law, which
both loops call, in ``laws/departures.py``, and its block here. The law is not here, because compiled
functions are compiled anew after an edit of any file that theirs imports.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from math import inf, sin

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiagramBuilder, DiscreteValues, OutputPort
from pydrake.systems.primitives import Adder, Demultiplexer

from coop_drake.errors import ScenarioError
from coop_drake.laws.actuators import lag_behind, limit_efforts
from coop_drake.laws.departures import WorldDepartures, act_on_wrenches, without_departures
from coop_drake.laws.robot_dynamics import end_effector_command, motion_room, robot_effort
from coop_drake.laws.team_dynamics import stick, sticking_room, team_work
from coop_drake.plant import RobotPlant, TeamPlant, read_component_tree, read_team_tree, robot_chain
from coop_drake.plant.facts import TeamTree
from coop_drake.scenario import BlockedWheels, Deployment, Floor, JointFriction, WheelSlip
from coop_drake.systems.block import Block, Law
from coop_drake.tree.arrays import FloatArray, IntArray

# What a robot asks of its actuators, and what these give.


class WrenchLaw(Law):
    """Turns the object's desired acceleration into one robot's share of the load: (21), (28) and (31).

    ======= ======================= ===== ====================================================== =====
    input   ``object_state``        6     pose and twist of L                                    W
    input   ``governor_command``    4     rate of p_G, not used here; desired acceleration of    W
                                          L's origin [m/s^2]
    input   ``axis_acceleration``   1 + n desired angular acceleration [rad/s^2]; those of the   W
                                          joints, not used here
    output  ``object_acceleration`` 3     the desired accelerations of L [m/s^2, rad/s^2]         W
    output  ``hand_command``        6     acceleration of Ek that goes with it [m/s^2, rad/s^2], W
                                          then the wrench on the object at Ek [N, N m]
    ======= ======================= ===== ====================================================== =====

    No state.

    Args:
        p_LE: The grasp in L, shape (2,) [m].
        p_LLcm: The object's centre of mass in L, shape (2,) [m].
        mass: M_L [kg].
        inertia: I_L about the centre of mass [kg m^2].
        share: The robot's share of the load, in [0, 1]; the team's shares sum to one.
        joints: Number of the robot's joints n.

    Raises:
        ValueError: Mass or inertia is not positive, or the share is not in [0, 1].
    """

    def __init__(
        self, p_LE: FloatArray, *, p_LLcm: FloatArray, mass: float, inertia: float, share: float, joints: int
    ) -> None:
        if not (mass > 0.0 and inertia > 0.0):
            raise ValueError(f"WrenchLaw needs positive mass and inertia, not {mass} and {inertia}")
        if not 0.0 <= share <= 1.0:
            raise ValueError(f"WrenchLaw's share must lie in [0, 1], not {share}")
        load = np.array([*p_LE, *p_LLcm, mass, inertia, share], dtype=float)
        super().__init__(
            {"object_state": 6, "governor_command": 4, "axis_acceleration": 1 + joints},
            {
                "object_acceleration": (3, _write_accelerations),
                "hand_command": (6, partial(_write_hand_command, load)),
            },
        )


def _write_accelerations(_: FloatArray, governor: FloatArray, axes: FloatArray, given: FloatArray) -> None:
    given[:2], given[2] = governor[2:], axes[0]


def _write_hand_command(
    load: FloatArray, object_state: FloatArray, governor: FloatArray, axes: FloatArray, given: FloatArray
) -> None:
    end_effector_command(load, object_state, governor[2:], axes, given)


class RobotEffort(Law):
    """Actuation M z'' + C z' + G + J^T tau_e of one robot from its own model, state and commands: (22)-(34).

    ======= ======================== ========== ======================================================= =====
    input   ``robot_state``          2 (3 + n)  z_k and its rate, z_k = (x, y, yaw of Bk, q_k)          W
    input   ``hand_command``         6          acceleration of Ek wanted [m/s^2, rad/s^2],
                                                then the wrench on the object at Ek [N, N m]            W
    input   ``axis_acceleration``    1 + n      acceleration of the object's angle, not used here; those
                                                of the joints wanted [rad/s^2 or m/s^2]
    output  ``robot_effort``         3 + n      base wrench at Bk, joint torques [N, N m]               W
    ======= ======================== ========== ======================================================= =====

    No state.

    Args:
        robot: The robot's model of itself; only its scratch context changes.
    """

    def __init__(self, robot: RobotPlant) -> None:
        size, chain = 3 + len(robot.joints), robot_chain(robot)
        compute = partial(robot_effort, chain, motion_room(chain))

        def write(state: FloatArray, hand: FloatArray, axes: FloatArray, effort: FloatArray) -> None:
            compute(state, hand, axes, effort)
            robot.set_state(state[:size], state[size:])
            effort += robot.spring_effort()

        super().__init__(
            {"robot_state": 2 * size, "hand_command": 6, "axis_acceleration": size - 2},
            {"robot_effort": (size, write if robot.has_springs else compute)},
        )


class LimitedEffort(Law):
    """Cuts the efforts of one robot to its limits: the base's force by its length, all others one by one.

    ======= ========== ===== ===================================================================
    input   ``asked``  3 + n base wrench and joint torques that are asked for [N, N m]
    output  ``given``  3 + n those that the actuators give [N, N m]
    ======= ========== ===== ===================================================================

    No state.

    Args:
        limits: Largest force and torque of the base, and efforts of the joints, shape (2 + n,) [N, N m].

    Raises:
        ValueError: A limit is not positive.
    """

    def __init__(self, limits: FloatArray) -> None:
        if not (limits > 0.0).all():
            raise ValueError(f"LimitedEffort needs positive limits, not {limits.tolist()}")

        def write(asked: FloatArray, given: FloatArray) -> None:
            given[:] = asked
            limit_efforts(limits, given)

        super().__init__({"asked": limits.size + 1}, {"given": (limits.size + 1, write)})


class LaggingEffort(Block):
    """Follows an effort that is held between samples as a first-order low pass, exactly.

    ======= ========== ==== ===================================================================
    input   ``held``   m    effort asked for, constant between samples [N, N m]
    output  ``given``  m    effort that acts [N, N m]; zero before the first sample
    ======= ========== ==== ===================================================================

    State: one discrete group, updated every ``period``: time of the last sample, the effort that acted then.

    Drake's ``FirstOrderLowPassFilter`` is integrated numerically, which takes several steps for each period
    where the time constant is about a period long.

    Args:
        size: Size m of the effort.
        lag: Time constant [s].
        period: Time between two samples [s].
        offset: Time of the first sample [s].

    Raises:
        ValueError: The lag or the period is not positive.
    """

    def __init__(self, size: int, lag: float, period: float, offset: float = 0.0) -> None:
        super().__init__()
        if not lag > 0.0 or not period > 0.0:
            raise ValueError(f"LaggingEffort needs a positive lag and period, not {lag} and {period}")
        self._follow = partial(lag_behind, lag)
        self._held = self.DeclareVectorInputPort("held", size)
        self.DeclareDiscreteState(np.zeros(1 + size))
        self.DeclareVectorOutputPort("given", size, self._write_given)
        self.declare_update(self._remember, period, offset)

    def _write_given(self, context: Context, output: BasicVector) -> None:
        self._write(context, output.get_mutable_value())

    def _remember(self, context: Context, discrete_state: DiscreteValues) -> None:
        following = discrete_state.get_mutable_vector().get_mutable_value()
        following[0] = context.get_time()
        self._write(context, following[1:])

    def _write(self, context: Context, given: FloatArray) -> None:
        state = self.kept(context)
        self._follow(context.get_time() - float(state[0]), self._held.Eval(context), state[1:], given)


# What the world does beside the actuators: wheels that slip or block, friction, slopes and pushes.


_STILL = np.empty((0, 2))
"""Velocities of bases, where no friction of the floor reads them."""

_GRAVITY = 9.80665
"""Standard acceleration of gravity [m/s^2]."""


def world_departures(deployment: Deployment, robots: Sequence[str]) -> WorldDepartures:
    """Return the departures of the world for robots of these names; others that are pushed are the object."""
    own, floor = [deployment.of_robot(name) for name in robots], deployment.floor
    slips = [(*_times(one.slip), 0.0 if one.slip is None else one.slip.share) for one in own]
    bodies = {name: k for k, name in enumerate(robots)}
    pushes = [
        (bodies.get(push.body, len(own)), *push.force, push.torque, push.time, push.time + push.duration)
        for push in deployment.pushes
    ]
    return WorldDepartures(
        slips=np.array(slips).T.copy(),
        floor=np.array([floor.coulomb_friction, floor.viscous_friction, downhill(floor.slope)]),
        pushes=np.array(pushes, dtype=float).reshape(-1, 6),
        blocked=np.array([_times(one.blocked) for one in own]).T.copy(),
        friction=np.array([deployment.joint_friction.coulomb, deployment.joint_friction.viscous]),
    )


def _times(fault: WheelSlip | BlockedWheels | None) -> tuple[float, float]:
    """Return when a fault begins and ends [s]."""
    if fault is None:
        return inf, inf
    return fault.begin, inf if fault.duration is None else fault.begin + fault.duration


def tilt_floor(team: TeamPlant, floor: Floor) -> None:
    """Let gravity pull all bodies of a plant down the slope of the floor, along x of W."""
    if floor.slope:
        team.plant.mutable_gravity_field().set_gravity_vector([downhill(floor.slope), 0.0, 0.0])


def downhill(slope: float) -> float:
    """Return the acceleration of gravity along a floor [m/s^2], which falls by an angle [rad]."""
    return _GRAVITY * sin(slope)


class WheelSlips(Law):
    """Takes a share off the wrenches of bases while their wheels slip; part of the world, not of a robot.

    ======= ========== ==== ============================================== =====
    input   ``driven`` 3 N  wrenches that the actuators of all bases give  W
    output  ``passed`` 3 N  what the floor takes up of them [N, N m]       W
    ======= ========== ==== ============================================== =====

    No state.

    Args:
        slips: When the wheels of every base slip from and until [s], and the share that is lost then [-],
            shape (3, N).
    """

    def __init__(self, slips: FloatArray) -> None:
        size, world = 3 * slips.shape[1], without_departures(slips.shape[1])._replace(slips=slips)

        def write(time: float, driven: FloatArray, passed: FloatArray) -> None:
            passed[:] = driven
            act_on_wrenches(world, time, time, _STILL, passed.reshape(-1, 3))

        super().__init__({"driven": size}, {"passed": (size, write)}, timed=True)


class FloorFriction(Law):
    """Gives the friction force on every base, see ``act_on_wrenches``; part of the world, not of a robot.

    ======= ===================== ========= ===================================================== =====
    input   ``robot_<k>_state``   2 (3+n_k) z_k and its rate, z_k = (x, y, yaw of Bk, q_k)         W
    output  ``friction_wrenches`` 3 N       force and zero torque on every base at Bk [N, N m]     W
    ======= ===================== ========= ===================================================== =====

    No state.

    Args:
        joints: Number of joints of every robot.
        coulomb: Coulomb friction of a base [N].
        viscous: Viscous friction of a base [N s/m].

    Raises:
        ValueError: A friction is negative.
    """

    def __init__(self, joints: Sequence[int], coulomb: float, viscous: float) -> None:
        if not (coulomb >= 0.0 and viscous >= 0.0):
            raise ValueError(f"FloorFriction needs no negative friction, not {coulomb} and {viscous}")
        world = without_departures(len(joints))._replace(floor=np.array([coulomb, viscous, 0.0]))

        def write(*given: FloatArray) -> None:
            *states, wrenches = given
            rates = np.array([state[3 + n : 5 + n] for state, n in zip(states, joints, strict=True)])
            wrenches[:] = 0.0
            act_on_wrenches(world, 0.0, 0.0, rates, wrenches.reshape(-1, 3))

        super().__init__(
            {f"robot_{k}_state": 2 * (3 + n) for k, n in enumerate(joints)},
            {"friction_wrenches": (3 * len(joints), write)},
        )


class Pushes(Law):
    """Adds pushes on bases and object to the wrenches on all bases; part of the world, not of a robot.

    ======= ========== ======= ================================================ =====
    input   ``asked``  3 N     wrenches on all bases [N, N m]                   W
    output  ``pushed`` 3 N + 3 the same with the pushes, then that on the object W
    ======= ========== ======= ================================================ =====

    No state.

    Args:
        robots: Number of robots N.
        pushes: Of every push the robot whose base is pushed, N for the object, its force [N] and torque
            [N m], begin and end [s], shape (., 6).
    """

    def __init__(self, robots: int, pushes: FloatArray) -> None:
        size, world = 3 * robots, without_departures(robots)._replace(pushes=pushes)

        def write(time: float, asked: FloatArray, pushed: FloatArray) -> None:
            pushed[:size], pushed[size:] = asked, 0.0
            act_on_wrenches(world, time, time, _STILL, pushed.reshape(-1, 3))

        super().__init__({"asked": size}, {"pushed": (size + 3, write)}, timed=True)


class Sticking(Law):
    """Adds what the floor does to bases with blocked wheels, and the friction of joints.

    See ``laws/team_dynamics.py``. It is part of the world, not of a robot.

    ======= ================= ========== ==================================================== =====
    input   ``team_state``    2 (3 + n)  the plant's positions and velocities, its own order
    input   ``joint_torques`` n          torques of all joints in the order of q [N m or N]
    input   ``asked``         3 N or 3   wrenches on all bases without the floor's, and where  W
                              more       there are pushes, the one on the object [N, N m]
    output  ``forces``        as asked,  the same with the floor's; then the friction of every W
                              and 3 + n  joint at the place of its rate in the plant
    ======= ================= ========== ==================================================== =====

    No state.

    Args:
        whole: The team's plant in the plane.
        rates: Where the rates of the joints stand among those of the plant, in the order of q, shape (n,).
        world: The departures.
        size: Number of the wrenches' components.
    """

    def __init__(self, whole: TeamTree, rates: IntArray, world: WorldDepartures, size: int) -> None:
        links, robots, rows = len(whole.tree), world.blocked.shape[1], size // 3
        known = whole.tree, whole.bases[:rows].copy(), whole.places[:rows].copy()
        self._known, self._rates, self._world, self._strongest = known, rates, world, whole.strongest
        self._room = team_work(whole.tree), sticking_room(links, robots), np.empty(links + 2)
        inputs = {"team_state": 2 * (links + 2), "joint_torques": len(rates), "asked": size}
        super().__init__(inputs, {"forces": (size + links + 2, self._write_forces)}, timed=True)

    def _write_forces(
        self, time: float, state: FloatArray, torques: FloatArray, asked: FloatArray, forces: FloatArray
    ) -> None:
        world, given = self._world, np.zeros(forces.size - asked.size)
        given[self._rates] = np.clip(torques, -self._strongest, self._strongest)
        efforts, wrenches = given.copy(), asked.reshape(-1, 3).copy()
        stick(
            *self._known,
            world.blocked,
            time,
            world.friction,
            efforts,
            float(world.floor[2]),
            state,
            *self._room,
            wrenches,
        )
        forces[: asked.size], forces[asked.size :] = wrenches.ravel(), efforts - given


def add_departures(
    builder: DiagramBuilder, team: TeamPlant, states: Sequence[OutputPort], wrenches: OutputPort,
    torques: OutputPort,
) -> OutputPort:  # fmt: skip
    """Add the departures of the world that a team's scenario switches on.

    Slipping wheels take their share off what the actuators give; then friction and pushes are added; blocked
    wheels act on the sum of all, and so does the friction of joints, which the plant gets as generalized
    forces.

    Args:
        builder: Receives the blocks.
        team: The team.
        states: True state of every robot.
        wrenches: Wrenches on all bases in W, of size 3 N.
        torques: Torques of all joints, of size n.

    Returns:
        Wrenches on all bases, and where there are pushes, the one on the object at L: size 3 N or 3 N + 3.

    Raises:
        ScenarioError: Wheels are blocked or joints have friction in a team with springs.
    """
    world = world_departures(team.scenario.deployment, [robot.name for robot in team.robots])
    if np.isfinite(world.slips[0]).any():
        slipping = builder.AddNamedSystem("wheel_slips", WheelSlips(world.slips))
        builder.Connect(wrenches, slipping.get_input_port())
        wrenches = slipping.get_output_port()
    if world.floor[:2].any():
        joints = [len(robot.joints) for robot in team.robots]
        friction = builder.AddNamedSystem("floor_friction", FloorFriction(joints, *world.floor[:2].tolist()))
        for k, state in enumerate(states):
            builder.Connect(state, friction.get_input_port(k))
        less = builder.AddNamedSystem("wrenches_less_friction", Adder(2, wrenches.size()))
        builder.Connect(wrenches, less.get_input_port(0))
        builder.Connect(friction.get_output_port(), less.get_input_port(1))
        wrenches = less.get_output_port()
    if len(world.pushes):
        pushes = builder.AddNamedSystem("pushes", Pushes(len(team.robots), world.pushes))
        builder.Connect(wrenches, pushes.get_input_port())
        wrenches = pushes.get_output_port()
    if np.isfinite(world.blocked[0]).any() or world.friction.any():
        wrenches = _stick(builder, team, world, wrenches, torques)
    return wrenches


def _stick(
    builder: DiagramBuilder, team: TeamPlant, world: WorldDepartures, wrenches: OutputPort,
    torques: OutputPort,
) -> OutputPort:  # fmt: skip
    """Add the wrenches of the floor on bases with blocked wheels, and the friction of joints.

    Raises:
        ScenarioError: The team has springs.
    """
    friction = team.scenario.deployment.joint_friction
    if team.plant.num_force_elements() > 1:  # every plant has gravity
        key, value = ("joint_friction", friction) if friction != JointFriction() else ("robots", "blocked")
        allowed = "none: blocked wheels and friction of joints are simulated for models without springs alone"
        raise ScenarioError(str(team.scenario.path), f"deployment.{key}", value, allowed)
    whole, size = read_team_tree(team, read_component_tree(team)), wrenches.size()
    block = builder.AddNamedSystem("sticking", Sticking(whole, team.velocity_index[3:], world, size))
    parts = builder.AddNamedSystem("sticking_parts", Demultiplexer([size, team.plant.num_velocities()]))
    builder.Connect(team.plant.get_state_output_port(), block.GetInputPort("team_state"))
    builder.Connect(torques, block.GetInputPort("joint_torques"))
    builder.Connect(wrenches, block.GetInputPort("asked"))
    builder.Connect(block.get_output_port(), parts.get_input_port())
    builder.Connect(parts.get_output_port(1), team.plant.get_applied_generalized_force_input_port())
    return parts.get_output_port(0)

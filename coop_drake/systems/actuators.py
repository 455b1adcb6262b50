"""What a robot asks of its actuators, and what these give."""

from __future__ import annotations

from functools import partial

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues

from coop_drake.laws.actuators import lag_behind, limit_efforts
from coop_drake.laws.robot_dynamics import end_effector_command, motion_room, robot_effort
from coop_drake.plant import RobotPlant, robot_chain
from coop_drake.systems.block import Block, Law
from coop_drake.tree.arrays import FloatArray


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

"""What robots measure, with its errors, what they make of it, and what they watch by it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, EventStatus
from pydrake.systems.primitives import Selector

from coop_drake.laws import readiness
from coop_drake.laws.measurements import (
    NOTHING,
    TURN,
    carry_measurements,
    observe,
    period_of,
    predict,
    uniform_pair,
    wanted_accelerations,
    whole_periods,
    write_errors,
)
from coop_drake.laws.robot_dynamics import estimate_object, motion_room, read_robot
from coop_drake.plant import RobotPlant, SeparateTeam, TeamPlant, base_chain, robot_chain
from coop_drake.systems.block import ALARM_SIZE, CURRENT_CELL_SIZE, Block, Law, build_selector, index_of
from coop_drake.systems.passing import STAMPED
from coop_drake.tree.arrays import FloatArray


class TeamSensor(Law):
    """Reads the object's pose and every robot's own state from a plant whose one tree begins at the object.

    ======= ================ =================== =================================================== =====
    input   ``team_state``   2 (3 + n)           the plant's positions and velocities, its own order
    output  ``measurements`` 3 + sum 2 (3 + n_k) pose of L, then of each robot z_k and its rate,     W
                                                 z_k = (x, y, yaw of Bk, q_k) [m, rad]
    ======= ================ =================== =================================================== =====

    No state. The object's angle and joints are unwrapped; yaws are in (-pi, pi]. All sensors are one block,
    because one call costs less than many; a demultiplexer gives each robot its own part.

    Args:
        team: The team whose plant gives the state.
    """

    def __init__(self, team: TeamPlant) -> None:
        pose, chains = team.position_index[:3], [base_chain(team, robot) for robot in team.robots]
        motion = max((motion_room(chain.chain) for chain in chains), key=len)
        #: Sizes of the measurements' parts: the object's, then each robot's.
        self.sizes = [3, *(2 * (3 + chain.joints.shape[1]) for chain in chains)]

        def write(state: FloatArray, measured: FloatArray) -> None:
            measured[:3], end = state[pose], 3
            for chain, size in zip(chains, self.sizes[1:], strict=True):
                begin, end = end, end + size
                read_robot(chain.chain, chain.yaw, chain.joints, motion, state, measured[begin:end])

        super().__init__(
            {"team_state": team.plant.num_multibody_states()},
            {"measurements": (sum(self.sizes), write)},
        )


def build_separate_sensor(team: SeparateTeam) -> Selector:
    """Measures the same in a plant in which every robot is a tree of its own: its state holds all of it.

    ======= ===================== ============== ====================================================== =====
    input   ``team_state``        plant's states the plant's positions and velocities
    output  ``object_pose``       3              pose of L, angle unwrapped [m, rad]                    W
    output  ``robot_<k>_state``   2 (3 + n_k)    z_k and its rate, z_k = (x, y, yaw of Bk, q_k), yaw    W
                                                 unwrapped [m, rad]
    ======= ===================== ============== ====================================================== =====

    Args:
        team: The team whose plant gives the state.
    """
    rates = team.plant.num_positions()
    places = {"object_pose": [int(place) for place in team.position_index[:3]]}
    for robot, base in zip(team.robots, team.base_joints, strict=True):
        places[f"robot_{robot.index}_state"] = [
            *(base.position_start() + i for i in range(3)),
            *(joint.position_start() for joint in robot.joints),
            *(rates + base.velocity_start() + i for i in range(3)),
            *(rates + joint.velocity_start() for joint in robot.joints),
        ]
    return build_selector(
        {"team_state": team.plant.num_multibody_states()},
        {name: [(0, place) for place in chosen] for name, chosen in places.items()},
    )


class ObjectEstimator(Law):
    """Joins the object's pose with its twist A_k^-1 J_k z_k' from the robot's own motion: (27) and (29).

    ======= ================= ========== ===================================================== =====
    input   ``robot_state``   2 (3 + n)  z_k and its rate, z_k = (x, y, yaw of Bk, q_k)        W
    input   ``object_pose``   3          pose of L, angle unwrapped [m, rad]                   W
    output  ``object_state``  6          that pose, velocity of L's origin, angular rate       W
    ======= ================= ========== ===================================================== =====

    No state. No other robot's state is needed.

    Args:
        robot: The robot's model of itself.
        p_LE: The grasp in L, shape (2,) [m].
    """

    def __init__(self, robot: RobotPlant, p_LE: FloatArray) -> None:
        chain = robot_chain(robot)
        estimate = partial(estimate_object, chain, np.array(p_LE, dtype=float), motion_room(chain))
        super().__init__(
            {"robot_state": 2 * (3 + len(robot.joints)), "object_pose": 3}, {"object_state": (6, estimate)}
        )


class MeasurementNoise(Law):
    """Adds normal noise and square waves to what a sensor measures; they change when a period begins.

    ======= ============ ==== ====================================
    input   ``exact``    n    what there is to measure
    output  ``measured`` n    the same with errors
    ======= ============ ==== ====================================

    No state: the noise is drawn from the seed and the number of the period.

    Args:
        deviations: Standard deviation of every component, shape (n,).
        waves: Size, length in periods and phase of every component's wave, shape (n, 3).
        period: Time between two measurements [s].
        seed: Seed of the noise, from 0 to 2^32 - 1.

    Raises:
        ValueError: The period or the length of a wave is not positive, or a deviation is negative.
    """

    def __init__(self, deviations: FloatArray, waves: FloatArray, period: float, seed: int) -> None:
        if not period > 0.0 or not (deviations >= 0.0).all() or not (waves[:, 1] > 0.0).all():
            given = f"{period}, {deviations} and {waves[:, 1]}"
            raise ValueError(
                "MeasurementNoise needs a positive period, no negative deviation and waves of positive "
                f"length, not {given}"
            )
        n, known = len(deviations), (seed, np.array(deviations, dtype=float), np.array(waves, dtype=float))

        def write(time: float, exact: FloatArray, measured: FloatArray) -> None:
            write_errors(*known, period_of(time, period), measured)
            measured += exact

        super().__init__({"exact": n}, {"measured": (n, write)}, timed=True)


class ShiftedMeasurement(Block):
    """Shows what there was to measure a part of a period before, or will be after.

    Between two samples, and as much beyond, motions are taken for uniform, so that nothing is shifted by more
    than the shift times the largest rate in this period.

    ======= ============ ==== ===============================================
    input   ``exact``    n    what there is to measure
    output  ``measured`` n    the same at the instant of the wrong clock
    ======= ============ ==== ===============================================

    The third number is an angle, which may jump by a turn.

    State: one discrete group (n), updated every period: what there was to measure then.

    Args:
        size: n.
        share: By how much earlier it is measured, in periods; may be negative [-].
        period: Time between two measurements [s].
        offset: Time of the first measurement [s].
    """

    def __init__(self, size: int, share: float, period: float, offset: float = 0.0) -> None:
        super().__init__()
        self._share = share
        self._exact = self.DeclareVectorInputPort("exact", size)
        self.DeclareDiscreteState(np.zeros(size))
        self.DeclareVectorOutputPort("measured", size, self._write_measured)
        self.declare_update(self._remember, period, offset)

    def _write_measured(self, context: Context, output: BasicVector) -> None:
        exact = self._exact.Eval(context)
        moved = exact - self.kept(context)
        moved[2:3] -= TURN * np.rint(moved[2:3] / TURN)
        output.SetFromVector(exact - self._share * moved)

    def _remember(self, context: Context, discrete_state: DiscreteValues) -> None:
        discrete_state.get_mutable_vector().SetFromVector(self._exact.Eval(context))


class LossyMeasurement(Block):
    """Passes measurements on, one each period, of which some are lost and some arrive late.

    ======= ============ ==== ===============================================================
    input   ``measured`` n    what a sensor measures now
    output  ``received`` n    the newest measurement that has arrived
    ======= ============ ==== ===============================================================

    State: one discrete group, updated every ``period``: (number of the measurement, values) of the newest
    that will have arrived by the next period, then of what arrives in each of the periods after it, with the
    number -1 where nothing does. A measurement that is lost leaves the last one standing; a late one is used
    when it arrives, unless a newer one has arrived. What is lost or late is drawn from the seed and the
    number of the period.

    Args:
        size: Size n of a measurement.
        period: Time between two measurements [s].
        loss: Probability that a measurement is lost [-].
        late: Probability that one which is not lost arrives late [-].
        late_by: How much later, rounded up to whole periods, at least one [s].
        offset: Time of the first measurement [s].
        seed: Seed of the random losses, from 0 to 2^32 - 1.

    Raises:
        ValueError: The period is not positive, the delay negative, or a probability not in [0, 1].
    """

    def __init__(
        self,
        size: int,
        period: float,
        *,
        loss: float = 0.0,
        late: float = 0.0,
        late_by: float = 0.0,
        offset: float = 0.0,
        seed: int = 0,
    ) -> None:
        super().__init__()
        if not period > 0.0 or not late_by >= 0.0:
            raise ValueError(
                f"LossyMeasurement needs a positive period and no negative delay, not {period} and {late_by}"
            )
        if not (0.0 <= loss <= 1.0 and 0.0 <= late <= 1.0):
            raise ValueError(f"LossyMeasurement's probabilities must lie in [0, 1], not {loss} and {late}")
        self._period, self._offset, self._loss, self._late, self._seed = period, offset, loss, late, seed
        self._rows = max(whole_periods(late_by, period), 1)
        self._measured = self.DeclareVectorInputPort("measured", size)
        self.DeclareDiscreteState(self.state_at_rest(np.zeros(size)))
        self.DeclareVectorOutputPort("received", size, self._write_received)
        self.declare_update(self._receive, period, offset)

    def state_at_rest(self, value: FloatArray) -> FloatArray:
        """Return the state when measurements have always been ``value``, shape (n,)."""
        return np.tile([NOTHING, *value], self._rows)

    def _thrown(self, context: Context) -> tuple[int, bool, bool]:
        """Return the number of the present measurement, whether it is lost, and whether it is late if not."""
        number = period_of(context.get_time(), self._period, self._offset)
        lost, late = uniform_pair(self._seed, number)
        return number, lost < self._loss, late < self._late

    def _receive(self, context: Context, discrete_state: DiscreteValues) -> None:
        kept = self.kept(context).reshape(self._rows, -1)
        number, lost, late = self._thrown(context)
        following = np.empty_like(kept)
        carry_measurements(kept, number, self._measured.Eval(context), lost, late, following)
        discrete_state.get_mutable_vector().SetFromVector(following.ravel())

    def _write_received(self, context: Context, output: BasicVector) -> None:
        _, lost, late = self._thrown(context)
        if lost or late:
            output.SetFromVector(self.kept(context)[1 : 1 + output.size()])
        else:
            output.SetFromVector(self._measured.Eval(context))


class StatePredictor(Block):
    """Integrates a robot's own commands over the known delay of its measurements; no message is needed.

    The law gives the object, the base and the joints the accelerations that it asks for; robots that follow
    one plan ask for the same motion of the object. The prediction errs by what the commands do not contain:
    errors of the model, disturbances, and what other robots want otherwise.

    ======= ====================== ========== ====================================================== =====
    input   ``robot_state``        2 (3 + n)  z_k and its rate, as they were ``periods`` ago         W
    input   ``object_pose``        3          pose of L, of the same age                             W
    input   ``governor_command``   4          rate of p_G, not used here; acceleration wanted for L  W
    input   ``axis_acceleration``  1 + n      accelerations wanted for the object's angle and joints W
    output  ``predicted_state``    2 (3 + n)  z_k and its rate now                                   W
    output  ``predicted_pose``     3          pose of L now                                          W
    ======= ====================== ========== ====================================================== =====

    State: one discrete group, updated every ``period``: the accelerations of the object (3), of the base (3)
    and of the joints (n) in each of the last ``periods`` periods, the oldest first.

    Args:
        robot: The robot's model of itself.
        load: Its load, as ``end_effector_command`` takes it, shape (7,); the grasp in L first.
        periods: Age of the measurements, in control periods.
        period: Control period [s].
        offset: Time of the first sample [s].

    Raises:
        ValueError: There is no delay, or the period is not positive.
    """

    def __init__(
        self, robot: RobotPlant, load: FloatArray, periods: int, period: float, *, offset: float = 0.0
    ) -> None:
        super().__init__()
        if periods < 1 or not period > 0.0:
            raise ValueError(
                f"StatePredictor needs a delay of one period or more, and a positive period, not {periods} "
                f"and {period}"
            )
        self._chain, self._load, self._period = robot_chain(robot), np.array(load, dtype=float), period
        n = len(robot.joints)
        self._robot = self.DeclareVectorInputPort("robot_state", 2 * (3 + n))
        self._pose = self.DeclareVectorInputPort("object_pose", 3)
        self._governor = self.DeclareVectorInputPort("governor_command", 4)
        self._axes = self.DeclareVectorInputPort("axis_acceleration", 1 + n)
        self._shape = periods, 6 + n
        self.DeclareDiscreteState(np.zeros(periods * (6 + n)))
        # Without these tickets the commands, which depend on the prediction, would close an algebraic loop.
        used = {
            self.xd_ticket(),
            *(self.input_port_ticket(port.get_index()) for port in (self._robot, self._pose)),
        }
        self.DeclareVectorOutputPort("predicted_state", 2 * (3 + n), self._write_state, used)
        self.DeclareVectorOutputPort("predicted_pose", 3, self._write_pose, used)
        self.declare_update(self._keep, period, offset)

    def _predict(self, context: Context) -> tuple[FloatArray, FloatArray]:
        """Return the robot's state and the object's pose now."""
        robot, pose = self._robot.Eval(context), self._pose.Eval(context)
        kept = self.kept(context).reshape(self._shape)
        predicted, predicted_pose = np.empty_like(robot), np.empty(3)
        predict(self._chain, self._load[:2], robot, pose, kept, self._period, predicted, predicted_pose)
        return predicted, predicted_pose

    def _keep(self, context: Context, discrete_state: DiscreteValues) -> None:
        kept = self.kept(context).reshape(self._shape)
        now = np.empty(self._shape[1])
        wanted_accelerations(
            self._chain,
            self._load,
            *self._predict(context),
            self._governor.Eval(context)[2:],
            self._axes.Eval(context),
            now,
        )
        discrete_state.get_mutable_vector().SetFromVector(np.vstack([kept[1:], now]).ravel())

    def _write_state(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self._predict(context)[0])

    def _write_pose(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self._predict(context)[1])


class DisturbanceObserver(Law):
    """Estimates slow disturbances from a robot's own motion, and takes them off its commands.

    Friction, a slope or a push change the acceleration of the object and of the joints. Every robot sees it
    in the object's twist, which it knows from its own motion, and in the rates of its joints. All robots
    together give what the object lacks, each by its share, because each takes off the same acceleration.

    ======= ========================= ========== ====================================================== =====
    input   ``object_state``          6          pose and twist of L                                    W
    input   ``robot_state``           2 (3 + n)  z_k and its rate, of which rates of joints are used    W
    input   ``governor_command``      4          rate of p_G; acceleration wanted for L's origin        W
    input   ``axis_acceleration``     1 + n      accelerations wanted for the object's angle and joints W
    input   ``observed_rates``        3 + n      the observer's state, kept by an integrator outside
    output  ``observer_rate``         3 + n      its rate
    output  ``compensated_command``   4          governor_command less the disturbance                  W
    output  ``compensated_axes``      1 + n      axis_acceleration less the disturbance                 W
    output  ``disturbance``           3 + n      estimated acceleration beside the commands, of (x, y,  W
                                                 theta) of L and of the joints
    ======= ========================= ========== ====================================================== =====

    No state: an integrator outside keeps it.

    Args:
        joints: Number n of the robot's joints.
        gain: Gain of ``observe`` [1/s].
        leak: Leak of ``observe`` [1/s].

    Raises:
        ValueError: The gain is not positive, or the leak is negative.
    """

    def __init__(self, joints: int, gain: float, leak: float) -> None:
        if not (gain > 0.0 and leak >= 0.0):
            raise ValueError(
                f"DisturbanceObserver needs a positive gain and no negative leak, not {gain} and {leak}"
            )
        size = 3 + joints

        def observed(
            object_state: FloatArray, robot: FloatArray, governor: FloatArray, axes: FloatArray,
            state: FloatArray,
        ) -> tuple[FloatArray, FloatArray]:  # fmt: skip
            """Return the rate of the state, and the disturbance."""
            rates = np.concatenate([object_state[3:], robot[3 + size :]])
            wanted = np.concatenate([governor[2:], axes])
            state_rate, disturbance = np.empty(size), np.empty(size)
            observe(rates, wanted, state, gain, leak, state_rate, disturbance)
            return state_rate, disturbance

        def write_rate(*given: FloatArray) -> None:
            given[-1][:] = observed(*given[:-1])[0]

        def write_command(*given: FloatArray) -> None:
            given[-1][:] = given[2]
            given[-1][2:] -= observed(*given[:-1])[1][:2]

        def write_axes(*given: FloatArray) -> None:
            given[-1][:] = given[3] - observed(*given[:-1])[1][2:]

        def write_disturbance(*given: FloatArray) -> None:
            given[-1][:] = observed(*given[:-1])[1]

        super().__init__(
            {
                "object_state": 6, "robot_state": 2 * size, "governor_command": 4,
                "axis_acceleration": 1 + joints, "observed_rates": size,
            },
            {
                "observer_rate": (size, write_rate), "compensated_command": (4, write_command),
                "compensated_axes": (1 + joints, write_axes), "disturbance": (size, write_disturbance),
            },
        )  # fmt: skip


# What a robot watches: departures from the nominal motion, and its arrival.


LONG_AGO = -1e9
"""When something was above its level the last time, before anything was [s]."""


@dataclass(frozen=True)
class MonitoredRobot:
    """What a monitor needs to know.

    Attributes:
        chain: From the robot's base to its end effector.
        p_LE: The grasp in L, shape (2,) [m].
        mounting: See ``place_on_axes``, shape (1 + n,).
        levels: Of position, velocity, grasp, angle of the base, infinite where there is none, and of where
            the position goes, shape (5,).
        unseen: How far ahead that is [s].
        axis_alarms: Of the axes (theta, q_k), of their rates, and of where both take them, shape (3, 1 + n).
        period: T [s].
        offset: Time of the first computation [s].
    """

    chain: FloatArray
    p_LE: FloatArray  # noqa: N815
    mounting: FloatArray
    levels: FloatArray
    unseen: float
    axis_alarms: FloatArray
    period: float
    offset: float = 0.0


class DepartureMonitor(Block):
    """Compares a robot's raw measurements with the motion at their time stamp, see ``laws/readiness.py``.

    ======= ================== ========== ============================================================ =====
    input   ``robot_state``    2 (3 + n)  z_k and its rate as measured, not predicted                  W
    input   ``object_pose``    3          pose of L as measured, not predicted                         W
    input   ``nominal_motion`` 9 (3 + n)  what ``MotionFollower`` shows                                W
    output  ``alarm``          3          0, 1 for a hold or 2 for brakes; the largest departure over
                                          its level, and the number of this level [-]
    ======= ================== ========== ============================================================ =====

    State: one discrete group, updated every period: when something was above its level the last time.

    Args:
        robot: What it needs to know; its levels hold in all cells and at all times.
        joints: Where the robot's joints stand in (x, y, theta, q).
        coordinates: Number of coordinates of the motion, 3 + n.
    """

    def __init__(self, robot: MonitoredRobot, joints: Sequence[int], coordinates: int) -> None:
        super().__init__()
        self._robot, self._axes, self._shape = robot, [2, *joints], (3, 3, coordinates)
        motion = motion_room(robot.chain)
        self._estimate = partial(estimate_object, robot.chain, robot.p_LE, motion)
        self._largest = partial(readiness.largest_departure, robot.p_LE, robot.mounting, motion[-1])
        self._state = self.DeclareVectorInputPort("robot_state", 2 * (2 + robot.mounting.size))
        self._pose = self.DeclareVectorInputPort("object_pose", 3)
        self._nominal = self.DeclareVectorInputPort("nominal_motion", 9 * coordinates)
        self.DeclareDiscreteState(np.array([LONG_AGO]))
        self._alarm = self.DeclareVectorOutputPort("alarm", ALARM_SIZE, self._write_alarm)
        self.declare_update(self._remember, robot.period, robot.offset)

    def _write_alarm(self, context: Context, output: BasicVector) -> None:
        robot, measured, seen = self._robot, self._state.Eval(context), np.empty(6)
        nominal = self._nominal.Eval(context).reshape(self._shape)[STAMPED]
        self._estimate(measured, self._pose.Eval(context), seen)
        led, axes = nominal[:2, :2].ravel(), np.ascontiguousarray(nominal[:2, self._axes])
        levels = robot.levels, robot.axis_alarms, robot.unseen
        share, which = self._largest(measured, seen, led, axes, *levels)
        last = float(self.kept(context)[0])
        output.SetFromVector([readiness.alarm_at(share, context.get_time(), last), share, float(which)])

    def _remember(self, context: Context, discrete_state: DiscreteValues) -> EventStatus:
        if not self._alarm.Eval(context)[1] > 1.0:
            return EventStatus.DidNothing()
        discrete_state.get_mutable_vector().SetAtIndex(0, context.get_time())
        return EventStatus.Succeeded()


class ArrivalMonitor(Block):
    """Averages what a robot measures in the last cell and compares it with the goal, see ``arrival_margin``.

    ======= ================ ========== ======================================================== =====
    input   ``robot_state``  2 (3 + n)  z_k and its rate as measured, not predicted              W
    input   ``object_pose``  3          pose of L as measured, not predicted                     W
    input   ``current_cell`` 2          index of the current cell, time of its entry [-, s]
    output  ``arrival``      1          margin with which the goal is reached; negative before
                                        the last cell [-]
    ======= ================ ========== ======================================================== =====

    State: one discrete group, updated every ``period`` in the last cell: the pose and the joints of the last
    2 W samples there, the oldest ones first; infinite before there are so many.

    Args:
        goal: What they are compared with.
        cells: Number of cells of the plan.
        period: Time between samples [s].
        offset: Time of the first sample [s].
    """

    def __init__(self, goal: readiness.ArrivalGoal, cells: int, period: float, offset: float = 0.0) -> None:
        super().__init__()
        self._shape, self._cells = (2 * readiness.mean_samples(period), goal.place.size), cells
        self._margin = partial(readiness.arrival_margin, *goal)
        self._state = self.DeclareVectorInputPort("robot_state", 2 * goal.place.size)
        self._pose = self.DeclareVectorInputPort("object_pose", 3)
        self._cell = self.DeclareVectorInputPort("current_cell", CURRENT_CELL_SIZE)
        group = self.DeclareDiscreteState(np.full(self._shape[0] * self._shape[1], np.inf))
        read = {self.discrete_state_ticket(group), self.input_port_ticket(self._cell.get_index())}
        self.DeclareVectorOutputPort("arrival", 1, self._write_arrival, read)
        self.declare_update(self._remember, period, offset)

    def _is_last(self, context: Context) -> bool:
        return index_of(self._cell.Eval(context), self._cells) + 1 == self._cells

    def _remember(self, context: Context, discrete_state: DiscreteValues) -> EventStatus:
        if not self._is_last(context):
            return EventStatus.DidNothing()
        state, pose = self.kept(context), self._pose.Eval(context)
        joints = self._state.Eval(context)[3 : self._shape[1]]
        discrete_state.get_mutable_vector().SetFromVector(
            np.concatenate([state[self._shape[1] :], pose, joints])
        )
        return EventStatus.Succeeded()

    def _write_arrival(self, context: Context, output: BasicVector) -> None:
        if not self._is_last(context):
            output.SetFromVector([readiness.FAR])
            return
        recent = self.kept(context).reshape(self._shape)
        output.SetFromVector([self._margin(recent, self._shape[0] - 1)])

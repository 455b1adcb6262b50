"""One robot of a team that passes from cell to cell: it follows a motion that all robots know."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from pydrake.systems.framework import BasicVector, Context

from coop_drake.answers.motion import Motion
from coop_drake.laws.motion import motion_at, place_on_axes, pull
from coop_drake.systems import kernels
from coop_drake.systems.block import CURRENT_CELL_SIZE, PHASE_SIZE, Block, index_of
from coop_drake.systems.governor import GovernedCell
from coop_drake.systems.ppc import AxisLaw
from coop_drake.systems.readiness import ReadyMonitor
from coop_drake.tree.arrays import FloatArray

NOW, STAMPED, AHEAD = range(3)
"""Of which time the motion is: now, when what is used was measured, when commands act on average."""


class MotionFollower(Block):
    """Leads the object, and every joint of one robot, along the nominal motion, see ``laws/motion.py``.

    ======= ======================== ========== ==================================================== =====
    input   ``object_state``         6          pose and twist of L, angle unwrapped                 W
    input   ``robot_state``          2 (3 + n)  z_k and its rate, z_k = (x, y, yaw of Bk, q_k)       W
    input   ``current_cell``         2          index of the current cell, time of its entry [-, s]
    input   ``phase``                3          phase [s], pace [-] and its rate [1/s] now
    input   ``stamped_phase``        3          those when states were measured; only with ``mounting``
    input   ``phase_ahead``          3          those when commands act, on average; likewise
    output  ``nominal_motion``                  nominal (x, y, theta, q), their rates and            W
                                                accelerations, of one time or of all three
    output  ``pulled``               3 + n      desired accelerations of (x, y, theta) and of the    W
                                                joints [m/s^2, rad/s^2]
    output  ``governor_command``     4          nominal velocity of L's origin now [m/s], its        W
                                                desired acceleration [m/s^2]
    output  ``governor_position``    2          nominal position of L's origin now [m]               W
    output  ``energy_margin``        1          Delta E of (15) of the departure from it [m^2/s^2]
    output  ``axis_acceleration``    1 + n      desired angular acceleration of the object           W
                                                [rad/s^2], of the joints [rad/s^2 or m/s^2]
    output  ``funnels``              2 (1 + n)  lower, then upper ends of the cell [rad or m]
    output  ``object_ahead``         6          ``object_state`` with nominal angle and rate of the  W
                                                time at which commands act; only with ``mounting``
    output  ``robot_ahead``          2 (3 + n)  ``robot_state`` likewise, with those of base and     W
                                                joints
    ======= ======================== ========== ==================================================== =====

    No state; ``robot_state`` is not read where the robot has no joints.

    Args:
        motion: The motion.
        cells: One entry for each cell of the plan.
        laws: The axes (theta, q_k) in each cell; their cells alone are read.
        joints: Where the robot's joints stand in (x, y, theta, q).
        mounting: Of a sampled robot: see ``place_on_axes``. None in continuous time, where all times are one.
    """

    def __init__(
        self,
        motion: Motion,
        cells: Sequence[GovernedCell],
        laws: Sequence[AxisLaw],
        joints: Sequence[int],
        mounting: FloatArray | None = None,
    ) -> None:
        super().__init__()
        self._motion, self._gains = motion, np.ravel(motion.gains)
        self._joints, self._mounting = np.array(joints, dtype=np.int64), mounting
        self._edges = [cell.clearance.edges for cell in cells]
        self._bounds = [np.concatenate([law.funnel.slice_lower, law.funnel.slice_upper]) for law in laws]
        axes, coordinates = 1 + len(joints), motion.points.shape[1]
        state = 2 * (2 + axes)
        self._object = self.DeclareVectorInputPort("object_state", 6)
        self._robot = self.DeclareVectorInputPort("robot_state", state)
        self._current = self.DeclareVectorInputPort("current_cell", CURRENT_CELL_SIZE)
        names = ["phase"] if mounting is None else ["phase", "stamped_phase", "phase_ahead"]
        self._phases = [self.DeclareVectorInputPort(name, PHASE_SIZE) for name in names]
        phased = {self.input_port_ticket(port.get_index()) for port in self._phases}
        self._shape = len(names), 3, coordinates
        self._nominal = self.DeclareVectorOutputPort(
            "nominal_motion", int(np.prod(self._shape)), self._write_nominal, phased
        )
        ports = self._object, self._robot, self._current
        seen, own, cell = ({self.input_port_ticket(port.get_index())} for port in ports)
        read = phased | seen | (own if joints else set())
        self._pulled = self.DeclareVectorOutputPort("pulled", 2 + axes, self._write_pulled, read)
        self.DeclareVectorOutputPort("governor_command", 4, self._write_command, read)
        self.DeclareVectorOutputPort("governor_position", 2, self._write_position, phased)
        self.DeclareVectorOutputPort("energy_margin", 1, self._write_margin, phased | seen | cell)
        self.DeclareVectorOutputPort("axis_acceleration", axes, self._write_axes, read)
        self.DeclareVectorOutputPort("funnels", 2 * axes, self._write_bounds, cell)
        if mounting is not None:
            self.DeclareVectorOutputPort("object_ahead", 6, self._write_object, phased | seen)
            self.DeclareVectorOutputPort("robot_ahead", state, self._write_robot, phased | own)

    def _write_nominal(self, context: Context, output: BasicVector) -> None:
        nominal = output.get_mutable_value().reshape(self._shape)
        for port, rows in zip(self._phases, nominal, strict=True):
            phase, pace, rate = port.Eval(context).tolist()
            motion_at(self._motion.points, self._motion.period, phase, pace, rate, rows)

    def _at(self, context: Context, time: int) -> FloatArray:
        """Return the nominal configuration, its rate and its acceleration, shape (3, 3 + n)."""
        nominal: FloatArray = self._nominal.Eval(context).reshape(self._shape)[min(time, self._shape[0] - 1)]
        return nominal

    def _write_pulled(self, context: Context, output: BasicVector) -> None:
        seen = self._object.Eval(context)
        robot = self._robot.Eval(context) if self._joints.size else seen
        ahead, expected = self._at(context, AHEAD), self._at(context, STAMPED)
        pull(ahead, expected, self._joints, self._gains, seen, robot, output.get_mutable_value())

    def _write_command(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector([*self._at(context, NOW)[1, :2], *self._pulled.Eval(context)[:2]])

    def _write_position(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self._at(context, NOW)[0, :2])

    def _write_margin(self, context: Context, output: BasicVector) -> None:
        nominal, departing = self._at(context, STAMPED), self._object.Eval(context).copy()
        departing[3:5] -= nominal[1, :2]
        edges = self._edges[index_of(self._current.Eval(context), len(self._edges))]
        output[0] = kernels.cell_margin(edges, float(self._gains[0]), departing, nominal[0, :2].copy())[0]

    def _write_axes(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self._pulled.Eval(context)[2:])

    def _write_bounds(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self._bounds[index_of(self._current.Eval(context), len(self._bounds))])

    def _write_object(self, context: Context, output: BasicVector) -> None:
        shown, ahead = output.get_mutable_value(), self._at(context, AHEAD)
        shown[:] = self._object.Eval(context)
        shown[2], shown[5] = ahead[:2, 2]

    def _write_robot(self, context: Context, output: BasicVector) -> None:
        shown, ahead = output.get_mutable_value(), self._at(context, AHEAD)
        assert self._mounting is not None  # the port is declared with it alone
        shown[:] = self._robot.Eval(context)
        place_on_axes(np.ascontiguousarray(ahead[:2, [2, *self._joints]]), self._mounting, shown)


class PassingMonitor(ReadyMonitor):
    """Reports that it is time to enter the next cell along the motion; in the last one, that all is done.

    ======= ======================== ========== ==================================================== =====
    input   ``object_state``         6          pose and twist of L                                  W
    input   ``robot_state``          2 (3 + n)  z_k and its rate, z_k = (x, y, yaw of Bk, q_k)       W
    input   ``governor_position``    2          nominal position of L's origin [m]                   W
    input   ``current_cell``         2          index of the current cell, time of its entry [-, s]
    input   ``arrival``              1          what ``ArrivalMonitor`` shows; only with ``measured``
    input   ``phase``                3          phase [s], pace [-] and its rate [1/s] now
    output  ``ready``                2          index of the cell that the report is about, margin
    ======= ======================== ========== ==================================================== =====

    No state. The margin is the phase less that at which the motion enters the next cell [s]; in the last one
    it is that of ``ReadyMonitor`` once the motion has ended.

    Args:
        motion: The motion.
        others: Those of ``ReadyMonitor``.
    """

    def __init__(self, motion: Motion, *others: object, **named: object) -> None:
        super().__init__(*others, **named)  # type: ignore[arg-type]
        self._begins = [*motion.windows[1:, 0].tolist(), motion.duration]
        self._phase = self.DeclareVectorInputPort("phase", PHASE_SIZE)

    def _write_ready(self, context: Context, output: BasicVector) -> None:
        index = index_of(self._current.Eval(context), len(self._begins))
        since = self._phase.Eval(context)[0] - self._begins[index]
        if index + 1 < len(self._begins):
            output.SetFromVector([index, since])
        else:
            super()._write_ready(context, output)
            output[1] = min(output[1], since) if since < 0.0 else output[1]

"""The blocks of a team that rests in every cell: governor, funnels, ready reports, cell planner."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, EventStatus

from coop_drake.answers.plan import Plan
from coop_drake.geometry.polygons import BoundaryDistance
from coop_drake.harmonic_maps import VelocityField
from coop_drake.laws.axis_table import (
    FADING_TIME,
    axis_table,
    first_jumps,
    track_axes,
    write_bounds,
    write_jumps,
)
from coop_drake.laws.gains import TransitionGains
from coop_drake.laws.ppc import Funnel, governed_gains
from coop_drake.systems import kernels
from coop_drake.systems.block import CLOCK_SIZE, CURRENT_CELL_SIZE, READY_SIZE, Block, clock_of, index_of
from coop_drake.tree.arrays import FloatArray

# The governors of the object's position: by what is measured, and by a model that all robots share.


@dataclass(frozen=True)
class GovernedCell:
    """The data of one cell that the governor needs.

    Attributes:
        clearance: Signed distance to the boundary of the governed set [m].
        field: Velocity field that leads to the cell's target; None where the team follows a motion.
        gains: Gains of the transition.
        before: Gains of the transition before; its own if there is none.
    """

    clearance: BoundaryDistance
    field: VelocityField | None
    gains: TransitionGains
    before: TransitionGains | None = None

    @cached_property
    def row(self) -> FloatArray:
        """The governor's row, see ``governed_gains``, shape (9,)."""
        return self.gains.governor_row(self.before or self.gains)

    @property
    def known(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """What compiled laws of the cell take first: the row, edges of the governed set, and the field."""
        assert self.field is not None  # Governors stand only where no motion is followed.
        return self.row, self.clearance.edges, *self.field.kernel_arguments


class ReferenceGovernor(Block):
    """Leads the object to the cell's target, slow enough to stay in the cell: (13)-(16).

    ======= =========================== ==== ====================================================== =====
    input   ``object_state``            6    pose and twist of L                                    W
    input   ``governor_position``       2    p_G, kept by an integrator outside [m]                 W
    input   ``current_cell``            2    index of the current cell, time of its entry [-, s]
    input   ``clock``                   3    the funnels' clock: its lag [s], its pace [-] and the
                                             derivative of the pace [1/s]; only where ``paced``
    output  ``governor_command``        4    rate of p_G [m/s], desired acceleration of L's origin  W
                                             [m/s^2]
    output  ``energy_margin``           1    Delta E [m^2/s^2]
    ======= =========================== ==== ====================================================== =====

    No state: an integrator outside keeps p_G; its rate is that of (14) times the pace. One output holds both
    parts of (14), because evaluating two outputs takes twice as long.

    Args:
        cells: One entry for each cell of the plan.
        paced: Whether p_G moves by a clock that may slow down.

    Raises:
        ValueError: There is no cell.
    """

    def __init__(self, cells: Sequence[GovernedCell], *, paced: bool = False) -> None:
        super().__init__()
        if not cells:
            raise ValueError("ReferenceGovernor needs at least one cell")
        self._govern = [partial(kernels.govern, *cell.known) for cell in cells]
        self._gains = [partial(governed_gains, cell.row) for cell in cells]
        self._margin = [partial(kernels.cell_margin, cell.clearance.edges) for cell in cells]
        self._object = self.DeclareVectorInputPort("object_state", 6)
        self._governor = self.DeclareVectorInputPort("governor_position", 2)
        self._current = self.DeclareVectorInputPort("current_cell", CURRENT_CELL_SIZE)
        self._clock = self.DeclareVectorInputPort("clock", CLOCK_SIZE) if paced else None
        self.DeclareVectorOutputPort("governor_command", 4, self._write_command)
        self.DeclareVectorOutputPort("energy_margin", 1, self._write_margin)

    def _write_command(self, context: Context, output: BasicVector) -> None:
        current = self._current.Eval(context)
        index, time = index_of(current, len(self._govern)), context.get_time() - current[1]
        state, governor = self._object.Eval(context), self._governor.Eval(context)
        command = output.get_mutable_value()
        self._govern[index](time, state, governor, command)
        if self._clock is not None:
            command[:2] *= self._clock.Eval(context)[1]

    def _write_margin(self, context: Context, output: BasicVector) -> None:
        current, state = self._current.Eval(context), self._object.Eval(context)
        index = index_of(current, len(self._margin))
        stiffness = self._gains[index](context.get_time() - current[1])[0]
        output[0] = self._margin[index](stiffness, state, self._governor.Eval(context))[0]


# Prescribed performance control of the object's angle and of the joints, and their nominal motion.


@dataclass(frozen=True)
class AxisLaw:
    """Prescribed performance control of m axes in one cell.

    Attributes:
        funnel: Funnels of these axes, from the cell's slice to the transition's goal intervals.
        gains: Gains of the transition, per-axis arrays of shape (m,).
    """

    funnel: Funnel
    gains: TransitionGains

    @cached_property
    def table(self) -> FloatArray:
        """The ``axis_table`` of these axes, shape (m, ``LAW_COLUMNS``)."""
        return axis_table(self.funnel, self.gains)

    @property
    def axes(self) -> int:
        """Number of axes m."""
        return int(self.funnel.goal_lower.size)


def axis_laws(plan: Plan, axes: Sequence[int]) -> tuple[AxisLaw, ...]:
    """Return the laws of some axes in every cell of a plan.

    Args:
        plan: The plan.
        axes: Indices into (theta, q...), in the order wanted.

    Raises:
        ValueError: The plan has no such axis.
    """
    count = len(plan.joint_names) + 1
    if any(not 0 <= axis < count for axis in axes):
        raise ValueError(f"axes {list(axes)} are not all in 0 to {count - 1}, the axes of the plan")
    chosen = np.array(axes, dtype=np.intp)
    return tuple(
        AxisLaw(plan.funnel(index).select(chosen), transition.gains.select(chosen))
        for index, transition in enumerate(plan.transitions)
    )


class AxisPpc(Block):
    """Keeps the object's angle and every joint of one robot in their funnels: (17)-(20) and (35)-(39).

    ======= ======================== ========== ====================================================== =====
    input   ``object_state``         6          pose and twist of L, angle unwrapped                   W
    input   ``robot_state``          2 (3 + n)  z_k and its rate, z_k = (x, y, yaw of Bk, q_k)         W
    input   ``current_cell``         2          index of the current cell, time of its entry [-, s]
    input   ``ready``                2          the robot's own report: cell index, margin [-]
    input   ``clock``                3          the funnels' clock: its lag since entry [s], its pace [-]
                                                and its derivative [1/s]; only where ``paced``
    output  ``axis_acceleration``    1 + n      desired angular acceleration of the object [rad/s^2],  W
                                                of the joints [rad/s^2 or m/s^2]
    output  ``funnels``              2 (1 + n)  lower, then upper funnel bounds now [rad or m]
    ======= ======================== ========== ====================================================== =====

    State: one discrete group (index of a cell, jumps of the accelerations at the switch to it). As long as
    the robot reports that it is ready, the jumps of a switch now are written there, at the start of every
    step of the simulator or every ``period``. In the cell they fade, see ``track_axes``.

    The law is the same for all axes, so one block computes all axes of a robot; ``robot_state`` is not read
    where the robot has no joints, ``ready`` not where there is one cell.

    Args:
        laws: One law of the axes (theta, q_k) for each cell of the plan.
        start: Where the axes rest at the beginning, shape (1 + n,); None for accelerations that are those of
            the first cell's law from the beginning.
        period: Time between updates [s], None for every step.
        offset: Time of the first update where there is a period [s].
        paced: Whether the funnels move by a clock that may slow down.

    Raises:
        ValueError: There is no law, or the laws differ in their number of axes or have none.
    """

    def __init__(
        self,
        laws: Sequence[AxisLaw],
        *,
        start: FloatArray | None = None,
        period: float | None = None,
        offset: float = 0.0,
        paced: bool = False,
    ) -> None:
        super().__init__()
        if not laws or len({law.axes for law in laws}) != 1 or laws[0].axes < 1:
            raise ValueError("AxisPpc needs one law for each cell, all of the same axes, the angle first")
        self._tables = [law.table for law in laws]
        self._track = [partial(track_axes, table) for table in self._tables]
        self._bounds = [partial(write_bounds, table) for table in self._tables]
        axes = laws[0].axes
        self._fading = [float(table[0, FADING_TIME]) for table in self._tables]
        self._none, self._nothing = np.zeros(axes), EventStatus.DidNothing()
        self._object = self.DeclareVectorInputPort("object_state", 6)
        self._robot = self.DeclareVectorInputPort("robot_state", 2 * (2 + axes))
        self._cell = self.DeclareVectorInputPort("current_cell", CURRENT_CELL_SIZE)
        self._ready = self.DeclareVectorInputPort("ready", READY_SIZE)
        self._clock = self.DeclareVectorInputPort("clock", CLOCK_SIZE) if paced else None
        self.DeclareDiscreteState(self.state_at_rest(0, start))
        timed = [self._cell, self._clock] if self._clock is not None else [self._cell]
        read = {self.time_ticket(), *(self.input_port_ticket(port.get_index()) for port in timed)}
        states = {self.input_port_ticket(port.get_index()) for port in (self._object, self._robot)}
        # The robot's report is not among them: only the update reads it.
        self.DeclareVectorOutputPort(
            "axis_acceleration", axes, self._write_acceleration, read | states | {self.xd_ticket()}
        )
        self.DeclareVectorOutputPort("funnels", 2 * axes, self._write_funnels, read)
        if len(laws) > 1:
            self.declare_update(self._remember, period, offset)

    def state_at_rest(self, cell: int, axes: FloatArray | None) -> FloatArray:
        """Return the state where a cell is begun at rest at these axes; None for no jumps."""
        return np.array([cell, *first_jumps(self._tables[cell], axes)])

    def _states(self, context: Context, axes: int) -> tuple[FloatArray, FloatArray]:
        object_state = self._object.Eval(context)
        return object_state, self._robot.Eval(context) if axes > 1 else object_state

    def _jumps(self, context: Context, index: int, time: float) -> FloatArray:
        """Return the jumps that fade in a cell ``time`` [s] after its entry, shape (1 + n,)."""
        if time >= self._fading[index]:  # To read the state in vain would take as long as the law.
            return self._none
        memory = self.kept(context)
        return memory[1:] if memory[0] == index else self._none

    def _write_acceleration(self, context: Context, output: BasicVector) -> None:
        cell, clock = self._cell.Eval(context), clock_of(self._clock, context)
        index, time = index_of(cell, len(self._track)), context.get_time() - cell[1]
        jumps = self._jumps(context, index, time)
        states = self._states(context, len(jumps))
        self._track[index](time, clock, jumps, *states, output.get_mutable_value())

    def _write_funnels(self, context: Context, output: BasicVector) -> None:
        cell = self._cell.Eval(context)
        write = self._bounds[index_of(cell, len(self._bounds))]
        lag = clock_of(self._clock, context)[0]
        write(context.get_time() - cell[1] - lag, output.get_mutable_value())

    def _remember(self, context: Context, discrete_state: DiscreteValues) -> EventStatus:
        index, margin = self._ready.Eval(context)
        following = int(index) + 1
        if not margin >= 0.0 or following >= len(self._tables):
            return self._nothing
        time, table = context.get_time() - self._cell.Eval(context)[1], self._tables[following - 1]
        memory = discrete_state.get_mutable_vector().get_mutable_value()
        memory[0] = following
        states, clock = self._states(context, len(table)), clock_of(self._clock, context)
        write_jumps(table, self._tables[following], time, clock, *states, memory[1:])
        return EventStatus.Succeeded()


# When the team goes on to the next cell: every robot's report, and the supervisor that hears them.


class ReadyMonitor(Block):
    """Reports whether object and own joints may enter the next cell; in the last cell, whether they arrived.

    ======= ====================== ========== ====================================================== =====
    input   ``object_state``       6          pose and twist of L, angle unwrapped                   W
    input   ``robot_state``        2 (3 + n)  z_k and its rate, z_k = (x, y, yaw of Bk, q_k)         W
    input   ``governor_position``  2          p_G as the robot keeps it [m]                          W
    input   ``current_cell``       2          index of the current cell, time of its entry [-, s]
    input   ``arrival``            1          what ``ArrivalMonitor`` shows; only with ``measured``
    output  ``ready``              2          index of the current cell, signed margin [-]
    ======= ====================== ========== ====================================================== =====

    The report is all that a robot sends to others: whether it is ready, and for which cell.

    No state.

    Args:
        cells: Governor's data of every cell.
        laws: Laws of the axes (theta, q_k) in every cell.
        inradii: R of every transition [m].
        goal_position: Where the object shall end, shape (2,) [m].
        position_tolerance: How close to it counts as arrived [m].
        measured: Whether the robot is sampled: it judges its arrival by the means of what it measures.

    Raises:
        ValueError: The sequences are empty or differ in length, or the tolerance is not positive.
    """

    def __init__(
        self,
        cells: Sequence[GovernedCell],
        laws: Sequence[AxisLaw],
        inradii: Sequence[float],
        goal_position: FloatArray,
        position_tolerance: float,
        *,
        measured: bool = False,
    ) -> None:
        super().__init__()
        if not cells or not len(cells) == len(laws) == len(inradii):
            raise ValueError(
                "ReadyMonitor needs one governed cell, one law and one inradius for each cell, not "
                f"{len(cells)}, {len(laws)} and {len(inradii)}"
            )
        if not position_tolerance > 0.0:
            raise ValueError(f"ReadyMonitor's position tolerance must be positive, not {position_tolerance}")
        conditions = kernels.ready_conditions(
            [law.table for law in laws],
            [cell.clearance.edges for cell in cells],
            [cell.row for cell in cells],
            inradii,
            goal_position,
            position_tolerance,
        )
        self._ready = [partial(kernels.robot_ready, known) for known in conditions]
        n = laws[0].axes - 1
        self._object = self.DeclareVectorInputPort("object_state", 6)
        self._state = self.DeclareVectorInputPort("robot_state", 2 * (3 + n))
        self._governor = self.DeclareVectorInputPort("governor_position", 2)
        self._current = self.DeclareVectorInputPort("current_cell", CURRENT_CELL_SIZE)
        self._arrival = self.DeclareVectorInputPort("arrival", 1) if measured else None
        self.DeclareVectorOutputPort("ready", READY_SIZE, self._write_ready)

    def _write_ready(self, context: Context, output: BasicVector) -> None:
        current, report = self._current.Eval(context), output.get_mutable_value()
        index = index_of(current, len(self._ready))
        report[0] = index
        seen, robot = self._object.Eval(context), self._state.Eval(context)
        if self._arrival is not None and index + 1 == len(self._ready):
            report[1] = self._arrival.Eval(context)[0]
        else:
            time, governor = context.get_time() - current[1], self._governor.Eval(context)
            report[1] = self._ready[index](time, seen, robot, governor)


class CellPlanner(Block):
    """Advances to the next cell of the plan when all robots are ready to leave the current one.

    A robot is ready when its report carries the current cell's index and a margin that is not negative.
    A report about another cell is stale and never counts, so that no report switches twice; a channel that
    holds samples starts at index -1 for the same reason. All robots read one output and switch together.

    ======= =================== ==== =================================================================
    input   ``robot_<k>_ready`` 2    cell index that the report of robot k is about, its margin [-]
    input   ``paused``          1    1 while the cell must not be left, else 0 [-]; may be left out
    output  ``current_cell``    2    index of the current cell, time at which it was entered [-, s]
    output  ``arrived``         1    1 when all robots are ready to leave the last cell, else 0 [-]
    ======= =================== ==== =================================================================

    State: one discrete group (cell index, entry time). It is updated at the start of every step of the
    simulator, so that a switch is late by at most one step; or every ``period`` where one is given.

    Args:
        robots: Number of robots N.
        cells: Number of cells of the plan.
        period: Time between updates [s], None for every step.

    Raises:
        ValueError: A count is not positive, or the period is not.
    """

    def __init__(self, robots: int, cells: int, *, period: float | None = None) -> None:
        super().__init__()
        if robots < 1 or cells < 1:
            raise ValueError(f"CellPlanner needs at least one robot and one cell, not {robots} and {cells}")
        if period is not None and not period > 0.0:
            raise ValueError(f"CellPlanner's period must be positive, not {period}")
        self._cells, self._nothing = cells, EventStatus.DidNothing()
        self._ready = tuple(
            self.DeclareVectorInputPort(f"robot_{k}_ready", READY_SIZE) for k in range(robots)
        )
        self._paused = self.DeclareVectorInputPort("paused", 1)
        self.DeclareDiscreteState([0.0, 0.0])
        # It depends on the state alone: the ready reports, which depend on it, close no algebraic loop.
        self.declare_kept("current_cell", CURRENT_CELL_SIZE)
        self.DeclareVectorOutputPort("arrived", 1, self._write_arrived)
        self.declare_update(self._advance, period)

    def _left_by_all(self, context: Context) -> float:
        """Return the index of the cell that all robots are ready to leave, -1 if some robot is not ready."""
        cell = -1.0
        for k, port in enumerate(self._ready):
            index, margin = port.Eval(context)
            # Most steps end here, at the first robot; reading the state first would cost time in every step.
            if not margin >= 0.0 or (k > 0 and index != cell):
                return -1.0
            cell = index
        return cell

    def _advance(self, context: Context, discrete_state: DiscreteValues) -> EventStatus:
        cell = self._left_by_all(context)
        leaves = 0.0 <= cell < self._cells - 1 and cell == self.kept(context)[0]
        if leaves and not (self._paused.HasValue(context) and self._paused.Eval(context)[0] > 0.0):
            discrete_state.get_mutable_vector().SetFromVector([cell + 1.0, context.get_time()])
            return EventStatus.Succeeded()
        # "Did nothing" keeps the cached values that depend on the state valid.
        return self._nothing

    def _write_arrived(self, context: Context, output: BasicVector) -> None:
        cell = self.kept(context)[0]
        arrived = cell == self._cells - 1 and cell == self._left_by_all(context)
        output.SetFromVector([1.0 if arrived else 0.0])

"""The reference governor of the object's position as a block."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial

from pydrake.systems.framework import BasicVector, Context

from coop_drake.geometry.polygons import BoundaryDistance
from coop_drake.harmonic_maps import VelocityField
from coop_drake.laws.gains import TransitionGains
from coop_drake.laws.governor import driving_margin, governor_velocity, steady_clearance
from coop_drake.laws.hand_over import SPEED_LIMIT, governed_gains
from coop_drake.systems.block import Block
from coop_drake.systems.current_cell import CURRENT_CELL_SIZE, index_of
from coop_drake.systems.funnel_clock import CLOCK_SIZE
from coop_drake.systems.governor_kernels import accelerate_object, cell_margin, govern
from coop_drake.tree.pose import FloatArray

__all__ = ["GovernedCell", "ReferenceGovernor"]


@dataclass(frozen=True)
class GovernedCell:
    """The data of one cell that the governor needs.

    Attributes:
        clearance: Signed distance to the boundary of the governed set [m].
        field: Velocity field that leads to the cell's target, (2,) -> (2,) [m/s].
        gains: Gains of the transition.
        before: Gains of the transition before; its own if there is none.
    """

    clearance: BoundaryDistance
    field: Callable[[FloatArray], FloatArray]
    gains: TransitionGains
    before: TransitionGains | None = None

    @cached_property
    def row(self) -> FloatArray:
        """The governor's row, see ``governed_gains``, shape (9,)."""
        return self.gains.governor_row(self.before or self.gains)

    def prepared_law(self) -> Callable[[float, FloatArray, FloatArray, FloatArray], object]:
        """Return ``govern`` below; compiled as a whole where the field is that of a harmonic map."""
        if not isinstance(self.field, VelocityField):
            return self.govern
        known = self.row, self.clearance.edges, *self.field.kernel_arguments
        return partial(govern, *known)

    def govern(
        self, time: float, object_state: FloatArray, governor_position: FloatArray, command: FloatArray
    ) -> None:
        """Write p_G' and the desired acceleration, both of (14), in this cell, with any velocity field.

        Args:
            time: Time since the cell was entered [s].
            object_state: Pose and twist of the object, shape (6,).
            governor_position: p_G, shape (2,) [m].
            command: Receives both, shape (4,) [m/s, m/s^2].
        """
        gains, edges = governed_gains(self.row, time), self.clearance.edges
        clearance, limit = self.clearance(governor_position), self.row[SPEED_LIMIT]
        margin = cell_margin(edges, gains[0], object_state, governor_position)
        driving = driving_margin(margin, clearance, steady_clearance(limit, *gains), gains[0])
        vx, vy = (float(part) for part in self.field(governor_position))
        command[:2] = governor_velocity(vx, vy, driving, gains[0], gains[2], self.gains.smoothing)
        accelerate_object(gains, limit, object_state, governor_position, command[2:])


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
        self._govern = [cell.prepared_law() for cell in cells]
        self._gains = [partial(governed_gains, cell.row) for cell in cells]
        self._margin = [partial(cell_margin, cell.clearance.edges) for cell in cells]
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
        output[0] = self._margin[index](stiffness, state, self._governor.Eval(context))

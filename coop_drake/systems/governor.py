"""The governors of the object's position: by what is measured, and by a model that all robots share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, partial

from pydrake.systems.framework import BasicVector, Context

from coop_drake.geometry.polygons import BoundaryDistance
from coop_drake.harmonic_maps import VelocityField
from coop_drake.laws.gains import TransitionGains
from coop_drake.laws.ppc import governed_gains
from coop_drake.systems import kernels
from coop_drake.systems.block import CLOCK_SIZE, CURRENT_CELL_SIZE, Block, index_of
from coop_drake.tree.arrays import FloatArray


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

"""The reference governor of the object's position as a block."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from pydrake.systems.framework import BasicVector, Context

from coop_drake.control import kernels
from coop_drake.control.gains import TransitionGains
from coop_drake.control.governor import energy_margin, tracking_energy
from coop_drake.fields import VelocityField
from coop_drake.geometry.boundary import BoundaryDistance
from coop_drake.geometry.pose import FloatArray
from coop_drake.systems.block import Block
from coop_drake.systems.current_cell import CURRENT_CELL_SIZE, index_of
from coop_drake.systems.governor_kernels import VELOCITY_STEP, cell_margin, lead

__all__ = ["VELOCITY_STEP", "GovernedCell", "ReferenceGovernor"]


@dataclass(frozen=True)
class GovernedCell:
    """What the governor needs to know of one cell.

    Attributes:
        clearance: Signed distance to the boundary of the governed set [m].
        field: Velocity field that leads to the cell's target, (2,) -> (2,) [m/s].
        gains: Gains of the transition.
    """

    clearance: BoundaryDistance
    field: Callable[[FloatArray], FloatArray]
    gains: TransitionGains

    def energy_margin(
        self, position: FloatArray, velocity: FloatArray, governor_position: FloatArray
    ) -> float:
        """Delta E of (15) in this cell [m^2/s^2]."""
        stiffness = self.gains.stiffness
        energy = tracking_energy(position, velocity, governor_position, stiffness=stiffness)
        return energy_margin(energy, self.clearance(governor_position), stiffness=stiffness)

    @cached_property
    def gain_row(self) -> FloatArray:
        """What the compiled governor reads of the gains: (K, zeta, K_G, c)."""
        gains = self.gains
        return np.array([gains.stiffness, gains.damping, gains.governor_gain, gains.smoothing])

    @cached_property
    def _leading(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray] | None:
        """What the compiled governor reads of the cell, if its field is that of a harmonic map."""
        if not isinstance(self.field, VelocityField):
            return None
        return self.gain_row, self.clearance.edges, *self.field.kernel_arguments

    def lead(self, state: FloatArray, governor_position: FloatArray, velocity: FloatArray) -> None:
        """Write p_G' of (14) in this cell.

        Args:
            state: Pose and twist of the object, shape (6,).
            governor_position: p_G, shape (2,) [m].
            velocity: Receives p_G', shape (2,) [m/s].
        """
        if self._leading is not None:
            lead(*self._leading, state, governor_position, velocity)
            return
        stiffness, _, gain, smoothing = self.gain_row
        margin = cell_margin(self.clearance.edges, stiffness, state, governor_position)
        vx, vy = self.field(governor_position)
        kernels.governor_velocity(vx, vy, margin, stiffness, gain, smoothing, velocity)


class ReferenceGovernor(Block):
    """Leads the object to the cell's target no faster than is safe: (13)-(16).

    ======= =========================== ==== ====================================================== =====
    input   ``object_state``            6    pose and twist of L                                    W
    input   ``governor_position``       2    p_G, kept by an integrator outside [m]                 W
    input   ``current_cell``            2    index of the current cell, time of its entry [-, s]
    output  ``governor_velocity``       2    rate of p_G [m/s]                                      W
    output  ``position_acceleration``   2    desired acceleration of L's origin [m/s^2]             W
    output  ``energy_margin``           1    Delta E [m^2/s^2]
    ======= =========================== ==== ====================================================== =====

    No state of its own: p_G lives in the integrator that ``governor_velocity`` feeds.

    Args:
        cells: One entry for each cell of the plan.

    Raises:
        ValueError: There is no cell.
    """

    def __init__(self, cells: Sequence[GovernedCell]) -> None:
        super().__init__()
        if not cells:
            raise ValueError("ReferenceGovernor needs at least one cell")
        self._cells = tuple(cells)
        self._object = self.DeclareVectorInputPort("object_state", 6)
        self._governor = self.DeclareVectorInputPort("governor_position", 2)
        self._current = self.DeclareVectorInputPort("current_cell", CURRENT_CELL_SIZE)
        self.DeclareVectorOutputPort("governor_velocity", 2, self._write_velocity)
        self.DeclareVectorOutputPort("position_acceleration", 2, self._write_acceleration)
        self.DeclareVectorOutputPort("energy_margin", 1, self._write_margin)

    def _cell(self, context: Context) -> GovernedCell:
        return self._cells[index_of(self._current.Eval(context), len(self._cells))]

    def _write_velocity(self, context: Context, output: BasicVector) -> None:
        cell, state = self._cell(context), self._object.Eval(context)
        cell.lead(state, self._governor.Eval(context), output.get_mutable_value())

    def _write_acceleration(self, context: Context, output: BasicVector) -> None:
        gains, state = self._cell(context).gains, self._object.Eval(context)
        governor, acceleration = self._governor.Eval(context), output.get_mutable_value()
        kernels.governed_acceleration(state, governor, gains.stiffness, gains.damping, acceleration)

    def _write_margin(self, context: Context, output: BasicVector) -> None:
        cell, state = self._cell(context), self._object.Eval(context)
        output[0] = cell_margin(
            cell.clearance.edges, cell.gains.stiffness, state, self._governor.Eval(context)
        )

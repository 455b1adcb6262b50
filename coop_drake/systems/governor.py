"""The governors of the object's position: by what is measured, and by a model that all robots share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, EventStatus

from coop_drake.answers.budget import PositionTube
from coop_drake.geometry.polygons import BoundaryDistance
from coop_drake.harmonic_maps import VelocityField
from coop_drake.laws.gains import TransitionGains
from coop_drake.laws.nominal import nominal_flow, track_nominal
from coop_drake.laws.ppc import governed_gains
from coop_drake.systems import kernels
from coop_drake.systems.block import CLOCK_SIZE, CURRENT_CELL_SIZE, Block, clock_of, index_of
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


@dataclass(frozen=True)
class NominalMotion:
    """What a nominal governor needs to know beside the cells.

    Attributes:
        tube: The plan's position tube.
        start: Where the object is at rest at the beginning, shape (2,) [m].
        targets: Where p_G goes in every cell, shape (cells, 2) [m].
        period: T, the control period [s].
        report_periods: For how many periods a report of readiness is used [-].
        measurement_periods: Age of the measurements of the object's state in periods [-].
        offset: Time of the first computation [s].
    """

    tube: PositionTube
    start: FloatArray
    targets: FloatArray
    period: float
    report_periods: int
    measurement_periods: int
    offset: float = 0.0

    def tracking_row(self, cell: GovernedCell) -> FloatArray:
        """Return K, zeta, K_t and zeta_t, shape (4,)."""
        own = cell.gains.stiffness, cell.gains.damping
        return np.array([*own, self.tube.tracking_stiffness, self.tube.tracking_damping])


class NominalGovernor(Block):
    """Leads a nominal motion to the cell's target, and the object along it, see ``laws/nominal.py``.

    ======= =========================== ==== ====================================================== =====
    input   ``object_state``            6    pose and twist of L as measured                        W
    input   ``current_cell``            2    index of the current cell, time of its entry [-, s]
    input   ``clock``                   3    the funnels' clock: its lag [s], its pace [-] and the
                                             derivative of the pace [1/s]; only where ``paced``
    output  ``governor_command``        4    mean velocity of p_G in the last period [m/s], desired W
                                             acceleration of L's origin [m/s^2]
    output  ``governor_position``       2    p_G [m]                                                W
    output  ``energy_margin``           1    Delta E of the nominal motion [m^2/s^2]
    output  ``nominal``                 6    p^ [m], p^' [m/s], Delta E [m^2/s^2], and how far p_G  W
                                             can go while a report of now is used [m]
    ======= =========================== ==== ====================================================== =====

    State: one discrete group (p^, p^', p_G, p_G a period before, then p^ and p^' of the last m samples, m
    being the age of measurements in periods), updated every period.

    Args:
        cells: One entry for each cell of the plan, all with the same K, zeta and K_G.
        motion: What else it needs.
        paced: Whether p_G moves by a clock that may slow down.

    Raises:
        ValueError: There is no cell, or not one target for each, or K changes.
        TypeError: A cell's velocity field is not that of a harmonic map.
    """

    def __init__(self, cells: Sequence[GovernedCell], motion: NominalMotion, *, paced: bool = False) -> None:
        super().__init__()
        if not cells or len(cells) != len(motion.targets):
            found = f"{len(motion.targets)} for {len(cells)}"
            raise ValueError(f"NominalGovernor needs one target for each cell, not {found}")
        gains = cells[0].gains
        if any(cell.gains.stiffness != gains.stiffness for cell in cells):
            raise ValueError("NominalGovernor needs the same K in all cells")
        flow = nominal_flow(gains.stiffness, gains.damping, motion.period)
        self._motion = motion
        flowing = flow, motion.period, motion.tube.speed
        self._steps = [partial(kernels.step_nominal, *cell.known, *flowing) for cell in cells]
        tracking = motion.tracking_row(cells[0])
        self._accelerate = partial(track_nominal, tracking)
        regions = [(cell.clearance.edges, gains.stiffness) for cell in cells]
        self._margins = [partial(kernels.nominal_margins, *region) for region in regions]
        self._shows = [
            partial(kernels.show_nominal, *region, target, *_reports_of(motion))
            for region, target in zip(regions, motion.targets, strict=True)
        ]
        self._object = self.DeclareVectorInputPort("object_state", 6)
        self._current = self.DeclareVectorInputPort("current_cell", CURRENT_CELL_SIZE)
        self._clock = self.DeclareVectorInputPort("clock", CLOCK_SIZE) if paced else None
        self.DeclareDiscreteState(self.state_at_rest(motion.start))
        self.DeclareVectorOutputPort("governor_command", 4, self._write_command)
        self.declare_kept("governor_position", 2, first=4)
        self.DeclareVectorOutputPort("energy_margin", 1, self._write_margin)
        self.DeclareVectorOutputPort("nominal", kernels.NOMINAL_SIZE, self._write_nominal)
        self.declare_update(self._step, motion.period, motion.offset)

    def state_at_rest(self, position: FloatArray) -> FloatArray:
        """Return the state of a motion that begins at rest, where p_G is at the object [m]."""
        at_rest = np.array([*position, 0.0, 0.0])
        past = np.tile(at_rest, self._motion.measurement_periods)
        return np.array([*at_rest, *position, *position, *past])

    def _write_command(self, context: Context, output: BasicVector) -> None:
        state, command = self.kept(context), output.get_mutable_value()
        command[:2] = (state[4:6] - state[6:8]) / self._motion.period
        expected = state[-4:] if self._motion.measurement_periods else state
        measured = self._object.Eval(context)
        self._accelerate(measured, state[4:6], state, expected, command[2:])

    def _write_margin(self, context: Context, output: BasicVector) -> None:
        index, state = index_of(self._current.Eval(context), len(self._margins)), self.kept(context)
        output[0] = self._margins[index](state[:4], state[4:6])[0]

    def _write_nominal(self, context: Context, output: BasicVector) -> None:
        index = index_of(self._current.Eval(context), len(self._shows))
        self._shows[index](self.kept(context)[: kernels.STATE_SIZE], output.get_mutable_value())

    def _step(self, context: Context, discrete_state: DiscreteValues) -> EventStatus:
        motion, state = self._motion, self.kept(context)
        index = index_of(self._current.Eval(context), len(self._steps))
        following = discrete_state.get_mutable_vector().get_mutable_value()
        pace = float(clock_of(self._clock, context)[1])
        self._steps[index](pace, state[: kernels.STATE_SIZE], following[: kernels.STATE_SIZE])
        following[6:8] = state[4:6]
        if motion.measurement_periods:
            following[8:12], following[12:] = state[:4], state[8:-4]
        return EventStatus.Succeeded()


def _reports_of(motion: NominalMotion) -> tuple[float, float, float]:
    """Return the control period [s], for how many of them a report is used [-], and p_G's speed [m/s]."""
    return motion.period, float(motion.report_periods), motion.tube.speed

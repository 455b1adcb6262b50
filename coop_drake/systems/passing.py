"""The blocks of a team that passes from cell to cell: words between robots, and a motion that all follow."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, State

from coop_drake.answers.motion import Motion
from coop_drake.laws import readiness
from coop_drake.laws.measurements import period_of, uniform_pair
from coop_drake.laws.motion import motion_at, place_on_axes, pull
from coop_drake.laws.words import (
    ARRIVED,
    ASKS,
    BRAKES,
    DEPARTS,
    EPOCH,
    HELD,
    HOLD,
    KIND,
    MOTION_SIZE,
    PHASE,
    QUIET,
    REST,
    STAMP,
    THERE,
    WAITS,
    WORD_SIZE,
    Schedule,
    first_motion,
    first_words,
    hear,
    phase_at,
    robot_step,
    supervisor_step,
)
from coop_drake.systems import kernels
from coop_drake.systems.block import ALARM_SIZE, CURRENT_CELL_SIZE, PHASE_SIZE, READY_SIZE, Block, index_of
from coop_drake.systems.messages import ASKED, BRAKED, SILENT, TOLD
from coop_drake.systems.resting import AxisLaw, GovernedCell, ReadyMonitor
from coop_drake.tree.arrays import FloatArray

# What the team says: one block for each robot, and one for the supervisor.


_EARLY = 1e-6
"""Share of a period by which an interval begins and ends earlier: times of samples round [-]."""

CELL, SAID, PAST = MOTION_SIZE, MOTION_SIZE + CURRENT_CELL_SIZE, MOTION_SIZE + CURRENT_CELL_SIZE + 1
"""Where in a robot's state, behind words and motion, the current cell stands, what the monitor says, and the
last phases."""

_ALARMS = {readiness.QUIET: QUIET, readiness.ASKS: ASKS}
"""What a monitor of departures says, as the words have it; all else lets the drives brake."""


@dataclass(frozen=True)
class Radio:
    """How one robot, or the supervisor, hears and speaks.

    Attributes:
        row: Its row of the words, N for the supervisor.
        robots: Number of robots N.
        kept: How many of everybody's last rows are under way at most [-].
        late: By how many samples later it hears a row than without delay [-].
        loss: Probability with which a row is lost [-].
        seeds: Of the losses of the words of everybody.
        clock_error: By how much its clock is ahead [s].
        offset: When it samples first [s].
        deaf: When it hears nothing: begin and end [s].
        mute: When nothing that it says reaches anybody: begin and end [s].
    """

    row: int
    robots: int
    kept: int = 1
    late: int = 0
    loss: float = 0.0
    seeds: Sequence[int] = ()
    clock_error: float = 0.0
    offset: float = 0.0
    deaf: tuple[float, float] = (inf, inf)
    mute: tuple[float, float] = (inf, inf)


class _Speaker(Block):
    """Hears, decides and speaks once in a period; a subclass decides.

    All decide in unrestricted updates, which Drake makes before the discrete ones of the same instant, each
    with what the others said a period before. So a robot measures and commands by what it has just decided.
    """

    def __init__(self, schedule: Schedule, radio: Radio, more: FloatArray) -> None:
        super().__init__()
        self._schedule, self._radio = schedule, radio
        words, nodes = first_words(schedule, radio.robots), radio.robots + 1
        sent = np.tile(words[radio.row], radio.kept)
        self._heard = words.size
        self._more = words.size + sent.size
        self._words = self.DeclareVectorInputPort("words", nodes * sent.size)
        self.DeclareDiscreteState(np.concatenate([words.ravel(), sent, more]))
        self.declare_kept("said", sent.size, first=words.size)
        self.DeclarePeriodicUnrestrictedUpdateEvent(
            schedule.period, radio.offset, self._loosely(self._hear_and_speak)
        )
        self.DeclareForcedUnrestrictedUpdateEvent(self._loosely(self._hear_and_speak))  # For processes.

    def _decide(self, context: Context, words: FloatArray, more: FloatArray) -> None:
        """Change the own row of the words, and the rest of the state."""
        raise NotImplementedError

    def _hear_and_speak(self, context: Context, state: State) -> None:
        values = state.get_mutable_discrete_state().get_mutable_vector().get_mutable_value()
        words, radio = values[: self._heard].reshape(-1, WORD_SIZE), self._radio
        now = context.get_time() + _EARLY * self._schedule.period
        if not radio.deaf[0] <= now < radio.deaf[1]:
            said = np.array(self._words.Eval(context)).reshape(len(words), radio.kept, WORD_SIZE)
            number = period_of(context.get_time(), self._schedule.period, radio.offset)
            for sender in range(len(words)):
                if sender != radio.row and not self._loses(sender, number):
                    hear(words, sender, said[sender, radio.late])
        self._decide(context, words, values[self._more :])
        sent = values[self._heard : self._more].reshape(-1, WORD_SIZE)
        sent[1:] = sent[:-1].copy()
        if not radio.mute[0] <= now < radio.mute[1]:
            sent[0] = words[radio.row]

    def _loses(self, sender: int, number: int) -> bool:
        loss = self._radio.loss
        return loss > 0.0 and uniform_pair(self._radio.seeds[sender], number)[0] < loss


class RobotWords(_Speaker):
    """Where on the motion a robot is: it hears the others, and says what it does, see ``laws/words.py``.

    ======= ================== ============ =============================================================
    input   ``words``          (N + 1) m 9  the last m rows that everybody sent, the newest first
    input   ``ready``          2            the robot's own report: cell index, margin
    input   ``alarm``          3            what ``DepartureMonitor`` says; only with ``alarmed``
    output  ``said``           9 m          the last m rows that the robot sent
    output  ``phase``          3            phase sigma [s], pace rho [-] and its rate [1/s] now
    output  ``current_cell``   2            index of the cell that the phase was in at the last sample, and
                                            the time of the sample at which that was entered [-, s]
    output  ``stamped_phase``  3            the phase when what is used now was measured, with pace and rate;
                                            only with ``ahead``
    output  ``phase_ahead``    3            those at the time at which commands of now act; likewise
    ======= ================== ============ =============================================================

    State: one discrete group. Words are updated every period before others measure and command: all words
    that were heard, the rows that were sent, the motion (see ``MOTION_SIZE``), the cell and its entry, then
    phase, pace and rate at the last samples. What the monitor says is taken after that, for the next period.

    Args:
        schedule: What the plan states.
        radio: How the robot hears and speaks.
        alarmed: Whether a monitor of departures asks for holds.
        ahead: How long after a sample its commands act, on average [s]; None in continuous time.
        age: Age of the measurements in samples [-].
    """

    def __init__(
        self, schedule: Schedule, radio: Radio, *, alarmed: bool = False, ahead: float | None = None,
        age: int = 0,
    ) -> None:  # fmt: skip
        first = [*first_motion(), 0.0, 0.0, float(QUIET), *[0.0] * (1 + age) * PHASE_SIZE]
        super().__init__(schedule, radio, np.array(first))
        self._last, self._ahead = schedule.ends.size - 1, ahead
        self._ready = self.DeclareVectorInputPort("ready", READY_SIZE)
        self._alarm = self.DeclareVectorInputPort("alarm", ALARM_SIZE) if alarmed else None
        timed = {self.xd_ticket(), self.time_ticket()}
        self.DeclareVectorOutputPort("phase", PHASE_SIZE, self._write_phase, timed)
        self.declare_kept("current_cell", CURRENT_CELL_SIZE, first=self._more + CELL)
        if ahead is not None:
            self.declare_kept("stamped_phase", PHASE_SIZE, first=self._more + PAST + age * PHASE_SIZE)
            self.DeclareVectorOutputPort("phase_ahead", PHASE_SIZE, self._write_ahead, timed)
        self.declare_update(self._judge, schedule.period, radio.offset)

    def _decide(self, context: Context, words: FloatArray, more: FloatArray) -> None:
        schedule, radio, time = self._schedule, self._radio, context.get_time()
        clock, motion, cell, past = time + radio.clock_error, more[:CELL], more[CELL:SAID], more[PAST:]
        phase = robot_step(schedule, clock, int(more[SAID]), radio.row, motion, words)[0]
        past[PHASE_SIZE:] = past[:-PHASE_SIZE].copy()
        past[:PHASE_SIZE] = phase_at(schedule, motion, time)  # Stamps are of one time for all robots.
        index = max(int(np.searchsorted(schedule.begins, phase, side="right")) - 1, 0)
        if index != cell[0]:
            cell[:] = index, time

    def _judge(self, context: Context, discrete_state: DiscreteValues) -> None:
        index, margin = self._ready.Eval(context)
        said = THERE if index == self._last and margin >= 0.0 else QUIET
        if self._alarm is not None and (level := self._alarm.Eval(context)[0]) > readiness.QUIET:
            said = _ALARMS.get(level, BRAKES)
        discrete_state.get_mutable_vector().get_mutable_value()[self._more + SAID] = said

    def rest_at(self, context: Context, phase: float, like: FloatArray | None = None) -> None:
        """Let the robot rest from now on where its drives bring it.

        Args:
            context: Its context.
            phase: Where on the motion that is [s].
            like: What somebody else says who rests, whose epoch and cell it takes over; None for its own.
        """
        values = context.get_mutable_discrete_state_vector().get_mutable_value()
        words, more, row = values[: self._heard].reshape(-1, WORD_SIZE), values[self._more :], self._radio.row
        if like is not None:
            words[row] = like
        words[row, KIND], words[row, PHASE], words[row, HOLD] = REST, phase, phase
        index = max(int(np.searchsorted(self._schedule.begins, phase, side="right")) - 1, 0)
        more[:CELL], more[CELL] = first_motion(phase), index
        more[PAST:] = np.tile([phase, 0.0, 0.0], (more.size - PAST) // PHASE_SIZE)

    def ask(self, context: Context, *, at_most: bool = False) -> None:
        """Let the robot ask for a hold at the next sample, at least; ``at_most`` where its drives brake."""
        values, said = context.get_mutable_discrete_state_vector(), self._more + SAID
        values[said] = float(ASKS) if at_most else max(values[said], float(ASKS))

    def _phase(self, context: Context, later: float) -> tuple[float, float, float]:
        motion = np.array(self.kept(context)[self._more : self._more + MOTION_SIZE])
        return phase_at(self._schedule, motion, context.get_time() + self._radio.clock_error + later)

    def _write_phase(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self._phase(context, 0.0))

    def _write_ahead(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self._phase(context, self._ahead or 0.0))


class WordPlanner(_Speaker):
    """The cell planner of a team that does not stop at every cell: it starts the team, and knows its arrival.

    ======= =========== ============ ====================================================================
    input   ``words``   (N + 1) m 9  the last m rows that everybody sent, the newest first
    input   ``order``   1            1 where the team is told to hold, else 0 [-]; may be left out
    output  ``said``    9 m          the last m rows that it sent
    output  ``arrived`` 1            1 when all robots rest at the goal, else 0 [-]
    output  ``causes``  1 + N        why the team rests, as of ``HoldSupervisor``; of a robot also 4 where it
                                     lets the drives brake [-]
    ======= =========== ============ ====================================================================

    State: one discrete group, updated every period: all words that it heard, the rows that it sent, what it
    sees (see ``GOES``), and the robot that this is about.

    Args:
        schedule: What the plan states.
        radio: How it hears and speaks.
    """

    def __init__(self, schedule: Schedule, radio: Radio) -> None:
        super().__init__(schedule, radio, np.array([0.0, -1.0]))
        self._order = self.DeclareVectorInputPort("order", 1)
        self.DeclareVectorOutputPort("arrived", 1, self._write_arrived, {self.xd_ticket()})
        self.DeclareVectorOutputPort("causes", 1 + radio.robots, self._write_causes, {self.xd_ticket()})

    def forget(self, context: Context) -> None:
        """Know nothing of a team that may be under way: another supervisor spoke to it before."""
        words, radio = first_words(self._schedule, self._radio.robots, again=True), self._radio
        first = [*words.ravel(), *np.tile(words[radio.row], radio.kept)]
        context.get_mutable_discrete_state_vector().get_mutable_value()[: self._more] = first

    def _decide(self, context: Context, words: FloatArray, more: FloatArray) -> None:
        wanted = not (self._order.HasValue(context) and self._order.Eval(context)[0] > 0.0)
        more[:] = supervisor_step(self._schedule, context.get_time(), wanted, words)

    def _write_arrived(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector([float(self.kept(context)[self._more] == ARRIVED)])

    def _write_causes(self, context: Context, output: BasicVector) -> None:
        state, causes = self.kept(context), output.get_mutable_value()
        words, (seen, robot) = state[: self._heard].reshape(-1, WORD_SIZE), state[self._more :]
        braked = (words[:-1, HOLD] == -inf) & (words[:-1, EPOCH] == words[-1, EPOCH])
        causes[:] = TOLD if seen == HELD else 0.0, *np.where(braked, BRAKED, 0.0)
        # By W all robots have heard each other, and are fit; by 2 W the supervisor has heard this of all.
        if seen in (DEPARTS, WAITS) and words[-1, STAMP] > 2.0 * self._schedule.window:
            causes[1 + int(robot)] = ASKED if seen == DEPARTS else SILENT


# One robot follows the motion that all robots know.


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

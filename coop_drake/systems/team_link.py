"""The place in a world's Diagram at which robots and supervisor are connected that run elsewhere."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues

from coop_drake.systems.block import Block
from coop_drake.systems.current_cell import CURRENT_CELL_SIZE, READY_SIZE
from coop_drake.systems.departure_monitor import ALARM_SIZE
from coop_drake.systems.funnel_clock import CLOCK_SIZE
from coop_drake.tree.pose import FloatArray


def robot_record(joints: int, *, holds: bool, monitored: bool = False) -> dict[str, int]:
    """Return the names and sizes of the outputs of a robot with n joints that are logged."""
    return {
        "governor_position": 2,
        "energy_margin": 1,
        "funnels": 2 * (1 + joints),
        "object_acceleration": 3,
        "hand_command": 6,
        "ready": READY_SIZE,
        "clock": CLOCK_SIZE if holds else 0,
        "alarm": ALARM_SIZE if monitored else 0,
    }


def supervisor_record(robots: int, *, holds: bool) -> dict[str, int]:
    """Return the names and sizes of the outputs of the supervisor of N robots that are logged."""
    return {"current_cell": CURRENT_CELL_SIZE, "arrived": 1, "causes": 1 + robots if holds else 0}


class Exchange(Protocol):
    """What carries measurements, efforts and what is logged between the world, robots and the supervisor."""

    def step(
        self, time: float, measured: Sequence[FloatArray], stamps: Sequence[FloatArray] | None = None
    ) -> Sequence[FloatArray]:
        """Hand over a sample, for which everybody computes once, and return the effort of every robot.

        Args:
            time: Time of the sample [s].
            measured: For every robot its own state and the object's pose as it measures them, shape
                (2 (3 + n_k) + 3,).
            stamps: For every robot when the pose and the state were measured, shape (2,) [s]; None for now.
        """
        ...

    def trouble(self) -> str:
        """Return why the run cannot go on, such as who is missing since when; empty where it can."""
        ...

    def stopped(self) -> bool:
        """Return whether the drives brake, or the team returns to its cell: nobody follows the plan then."""
        ...

    def look(
        self, time: float, measured: Sequence[FloatArray], stamps: Sequence[FloatArray] | None = None
    ) -> FloatArray:
        """Return what everybody would log at an instant: all robots' records, then the supervisor's."""
        ...


class TeamLink(Block):
    """Stands for the robots' controllers and the supervisor in the Diagram of a world.

    ======= ============================ ========== ========================================================
    input   ``robot_<k>_state``          2(3+n_k)   own state of robot k as it measures it
    input   ``robot_<k>_object_pose``    3          the object's pose as robot k measures it
    input   ``robot_<k>_pose_stamp``     1          when that pose was measured [s]
    input   ``robot_<k>_state_stamp``    1          when that state was measured [s]
    output  ``robot_<k>_effort_command`` 3 + n_k    what robot k asked for in the last sample, held
    output  ``records``                             records of all robots, then that of the supervisor
    ======= ============================ ========== ========================================================

    State: one discrete group, the efforts, updated every ``period``, when all measurements go out.

    Args:
        joints: Number of joints of every robot.
        period: Control period [s].
        exchange: Carries what is exchanged.
        record_size: Size of ``records``.
    """

    def __init__(self, joints: Sequence[int], period: float, exchange: Exchange, record_size: int) -> None:
        super().__init__()
        self._exchange = exchange
        sizes = [3 + n for n in joints]
        states = [self.DeclareVectorInputPort(f"robot_{k}_state", 2 * size) for k, size in enumerate(sizes)]
        poses = [self.DeclareVectorInputPort(f"robot_{k}_object_pose", 3) for k in range(len(sizes))]
        self._inputs = [*zip(states, poses, strict=True)]
        stamped = [
            [self.DeclareVectorInputPort(f"robot_{k}_{part}_stamp", 1) for k in range(len(sizes))]
            for part in ("pose", "state")
        ]
        self._stamps = [*zip(*stamped, strict=True)]
        self.DeclareDiscreteState(np.zeros(sum(sizes)))
        ends = np.cumsum(sizes)
        for k, (size, end) in enumerate(zip(sizes, ends, strict=True)):
            self._declare_effort(f"robot_{k}_effort_command", slice(int(end) - size, int(end)))
        self.DeclareVectorOutputPort("records", record_size, self._write_records)
        self.DeclarePeriodicDiscreteUpdateEvent(period_sec=period, offset_sec=0.0, update=self._sample)

    @property
    def trouble(self) -> str:
        """Why the run cannot go on; empty where it can."""
        return self._exchange.trouble()

    @property
    def stopped(self) -> bool:
        """Whether the drives brake, or the team returns to its cell: nobody follows the plan then."""
        return self._exchange.stopped()

    def _declare_effort(self, name: str, part: slice) -> None:
        def write(context: Context, output: BasicVector) -> None:
            output.SetFromVector(context.get_discrete_state_vector().value()[part])

        self.DeclareVectorOutputPort(name, part.stop - part.start, write, {self.xd_ticket()})

    def _measured(self, context: Context) -> list[FloatArray]:
        return [np.concatenate([port.Eval(context) for port in ports]) for ports in self._inputs]

    def _stamped(self, context: Context) -> list[FloatArray]:
        return [np.concatenate([port.Eval(context) for port in ports]) for ports in self._stamps]

    def _sample(self, context: Context, discrete_state: DiscreteValues) -> None:
        given = self._measured(context), self._stamped(context)
        efforts = self._exchange.step(context.get_time(), *given)
        discrete_state.get_mutable_vector().SetFromVector(np.concatenate(efforts))

    def _write_records(self, context: Context, output: BasicVector) -> None:
        given = self._measured(context), self._stamped(context)
        output.SetFromVector(self._exchange.look(context.get_time(), *given))

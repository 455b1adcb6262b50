"""A sampled team's controllers, sensors, messages and actuators as one block of Drake's loop."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues

from coop_drake.compiled import prepared
from coop_drake.compiled_loop.arrays import LoopCells, LoopDepartures, LoopMemory, LoopNominal
from coop_drake.compiled_loop.looping import update
from coop_drake.compiled_loop.robots import robot_room
from coop_drake.compiled_loop.telling import SHOWN, tell
from coop_drake.laws.actuators import lag_behind
from coop_drake.laws.sampling import period_of
from coop_drake.systems import Block
from coop_drake.systems.block import NUMBER, VECTOR
from coop_drake.systems.team_kernels import FusedTeam
from coop_drake.tree.pose import FloatArray


class SampledTeam(Block):
    """Computes at every sample what all robots, their sensors, messages and the cell planner compute.

    It calls the functions of the compiled loop, and so the laws that the robots' own blocks call; what it
    shows agrees with theirs to rounding. With M = N + n axes:

    ======= ============== ============== ============================================================ =====
    input   ``team_state`` 2 (3 + n)      the plant's positions and velocities, its own order
    output  ``efforts``    3 N + n        what the actuators of every robot give: its base wrench and  W
                                          its joint torques [N, N m]
    output  ``telemetry``  3 + 20 N + 2 M index of the cell, time of its entry [s], 1 where the team   W
                                          has arrived; what ``telling`` lists of every robot; lower,
                                          then upper bounds of the funnels of all axes
    ======= ============== ============== ============================================================ =====

    State: one discrete group, updated every period: number of samples so far, time of the last one, then all
    fields of ``LoopMemory`` but the plant's state, one after the other.

    Args:
        cells: The plan's cells.
        team: The robots' models.
        nominal: The nominal motions.
        departures: What departs.
        memory: What is remembered at the start.
    """

    def __init__(
        self, cells: LoopCells, team: FusedTeam, nominal: LoopNominal, departures: LoopDepartures,
        memory: LoopMemory,
    ) -> None:  # fmt: skip
        super().__init__()
        known, self._robots, self._axes = (
            (cells, team, nominal, departures),
            team.yaws.size,
            memory.jumps.size,
        )
        self._period, lag = float(departures.times[0]), float(departures.times[2])
        kept = memory._asdict()
        del kept["state"]
        ends = 2 + np.cumsum([part.size for part in kept.values()])
        self._parts = {
            name: (slice(int(end) - part.size, int(end)), part.shape)
            for (name, part), end in zip(kept.items(), ends, strict=True)
        }
        self._efforts = self._parts["efforts"][0]
        shown, bounds = np.empty((self._robots, SHOWN)), np.empty((2, self._axes))
        self._tell = prepared(tell, known, memory, 0, 0, NUMBER, VECTOR, shown, bounds)
        self._update = prepared(update, (*known, robot_room(memory)), memory, 0)
        self._follow = prepared(lag_behind, [lag], NUMBER, VECTOR, VECTOR, VECTOR)
        self._state = self.DeclareVectorInputPort("team_state", memory.state.size)
        start = np.concatenate([[0.0, 0.0], *(part.ravel() for part in kept.values())])
        group = self.discrete_state_ticket(self.DeclareDiscreteState(start))
        timed = {group, self.time_ticket()} if lag > 0.0 else {group}
        self.DeclareVectorOutputPort("efforts", memory.efforts.shape[1], self._write_efforts, timed)
        size = 3 + shown.size + bounds.size
        self.DeclareVectorOutputPort("telemetry", size, self._write_telemetry)
        self.declare_update(self._step, self._period)

    def _remembered(self, flat: FloatArray, team_state: FloatArray) -> LoopMemory:
        """Return the fields of ``LoopMemory`` as views of the state."""
        views = {name: flat[part].reshape(shape) for name, (part, shape) in self._parts.items()}
        return LoopMemory(state=team_state, **views)

    def _write_efforts(self, context: Context, output: BasicVector) -> None:
        flat = context.get_discrete_state_vector().value()
        held, before = flat[self._efforts].reshape(2, -1)
        self._follow(context.get_time() - float(flat[1]), held, before, output.get_mutable_value())

    def _write_telemetry(self, context: Context, output: BasicVector) -> None:
        flat, now = context.get_discrete_state_vector().value().copy(), context.get_time()
        told, begin = output.get_mutable_value(), 3 + self._robots * SHOWN
        self._tell(
            self._remembered(flat, self._state.Eval(context)),
            int(flat[0]),
            period_of(now, self._period),
            now,
            told[:3],
            told[3:begin].reshape(-1, SHOWN),
            told[begin:].reshape(2, -1),
        )

    def _step(self, context: Context, discrete_state: DiscreteValues) -> None:
        flat, now = discrete_state.get_mutable_vector().get_mutable_value(), context.get_time()
        memory = self._remembered(flat, self._state.Eval(context))
        held, before = memory.efforts
        self._follow(now - float(flat[1]), held, before, before)
        self._update(memory, int(flat[0]))
        flat[0], flat[1] = flat[0] + 1.0, now

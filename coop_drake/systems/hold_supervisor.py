"""The supervisor that holds the team: when it is told to, a robot asks for it, or a robot is not heard."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiscreteValues, EventStatus

from coop_drake.laws.departure import ASKS
from coop_drake.laws.hold import SETTLING_TIME
from coop_drake.systems.block import Block
from coop_drake.systems.hold_monitor import REQUEST_SIZE

TOLD, ASKED, SILENT, BRAKED = 1.0, 2.0, 3.0, 4.0
"""Causes of a hold."""


class HoldSupervisor(Block):
    """Holds the team while there is a cause, and tells all robots by one bit.

    ======= ===================== ===== ================================================================
    input   ``order``             1     1 where the team is told to hold, else 0 [-]
    input   ``robot_<k>_request`` 2     the request of robot k that arrived last, see ``HoldMonitor``
    output  ``hold``              1     1 where the team is held, else 0 [-]
    output  ``hold_message``      2     the same for the robots, and the number of the message, which tells
                                        them that it is a new one [-]
    output  ``paused``            1     1 while the funnels' clock does not run as usual, else 0: the
                                        cell must not be left [-]
    output  ``causes``            1 + N first the order (0, or 1 where the team is told to hold), then each
                                        robot: 0 for no cause, 2 where it asks, 3 where it is not heard, 4
                                        where it says that the drives shall brake [-]
    ======= ===================== ===== ================================================================

    State: one discrete group, updated at the start of every step, or every ``period``: the time at which the
    last hold ended, the causes, for each robot the number of its last message and the time at which that
    message arrived, and the number of the supervisor's own message.

    Args:
        robots: Number of robots N.
        silence: Longest time without a new message of a robot [s]; None to wait for ever.
        period: Time between updates [s], None for every step.
    """

    def __init__(self, robots: int, *, silence: float | None = None, period: float | None = None) -> None:
        super().__init__()
        self._silence = np.inf if silence is None else silence
        self._order = self.DeclareVectorInputPort("order", 1)
        self._requests = [
            self.DeclareVectorInputPort(f"robot_{k}_request", REQUEST_SIZE) for k in range(robots)
        ]
        self.DeclareDiscreteState(np.array([-SETTLING_TIME, *np.zeros(2 + 3 * robots)]))
        self._robots = robots
        self.DeclareVectorOutputPort("hold", 1, self._write_hold, {self.xd_ticket()})
        self.DeclareVectorOutputPort("hold_message", REQUEST_SIZE, self._write_message, {self.xd_ticket()})
        self.DeclareVectorOutputPort("paused", 1, self._write_paused, {self.xd_ticket(), self.time_ticket()})
        self.DeclareVectorOutputPort("causes", 1 + robots, self._write_causes, {self.xd_ticket()})
        self.declare_update(self._decide, period)

    def _decide(self, context: Context, discrete_state: DiscreteValues) -> EventStatus:
        state, now = np.array(context.get_discrete_state_vector().value()), context.get_time()
        causes, heard = state[1 : 2 + self._robots], state[2 + self._robots : -1].reshape(-1, 2)
        held = causes.any()
        causes[0] = TOLD if self._order.Eval(context)[0] > 0.0 else 0.0
        for k, port in enumerate(self._requests):
            asks, number = port.Eval(context)
            if number != heard[k, 0]:
                heard[k] = number, now
            silent = SILENT if now - heard[k, 1] > self._silence else 0.0
            causes[1 + k] = BRAKED if asks > ASKS else ASKED if asks > 0.0 else silent
        if held and not causes.any():
            state[0] = now
        state[-1] += 1.0
        discrete_state.get_mutable_vector().SetFromVector(state)
        return EventStatus.Succeeded()

    def _held(self, context: Context) -> bool:
        return bool(context.get_discrete_state_vector().value()[1 : 2 + self._robots].any())

    def _write_hold(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector([float(self._held(context))])

    def _write_message(self, context: Context, output: BasicVector) -> None:
        number = context.get_discrete_state_vector().value()[-1]
        output.SetFromVector([float(self._held(context)), number])

    def _write_paused(self, context: Context, output: BasicVector) -> None:
        ended = context.get_discrete_state_vector().value()[0]
        paused = self._held(context) or context.get_time() - ended < SETTLING_TIME
        output.SetFromVector([float(paused)])

    def _write_causes(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(context.get_discrete_state_vector().value()[1 : 2 + self._robots])

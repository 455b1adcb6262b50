"""Robots, supervisor and world apart from each other in one process: only plain values cross."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from coop_drake.answers.log import SimulationLog
from coop_drake.answers.plan import Plan
from coop_drake.apart.membership import Membership, Processes
from coop_drake.apart.messages import name_of
from coop_drake.apart.node import MOVES, RETURNS, STANDS, Stillness
from coop_drake.apart.processes import SupervisorNode
from coop_drake.apart.robot import RobotNode
from coop_drake.diagram import brakes_of, build_world, control_period
from coop_drake.diagram.robot_controller import hold_of, robot_knowledge
from coop_drake.harmonic_maps import HarmonicMap
from coop_drake.laws.actuators import Brake, braking_effort
from coop_drake.scenario import Scenario
from coop_drake.simulation import Sample, run_loop
from coop_drake.tree.arrays import FloatArray


class DirectExchange:
    """Carries plain values between nodes of the same process, sample by sample.

    In a sample, all robots and the supervisor compute from what they have measured and heard before. Then
    their messages are handed over, and count from the next instant on. In gaps nobody gets a sample, and the
    drives brake, as those of robots in processes of their own do under a budget.

    Args:
        gaps: First sample of every gap, and the first after it.

    Attributes:
        messages: Every message of the team so far: number of the sample, sender (None for the supervisor).
        membership: Whether the drives brake.
        damping: With which the drives of each robot brake, see ``laws.actuators``.
    """

    def __init__(self, gaps: Sequence[tuple[int, int]] = ()) -> None:
        self.robots: Sequence[RobotNode] = ()
        self.supervisor: SupervisorNode | None = None
        self.messages: list[tuple[float, int | None, Any]] = []
        self.membership = Membership(rejoin=0.0, processes=Processes(), tell=lambda words: None)
        self.brakes: Sequence[Brake] = ()
        self._gaps, self._number, self._efforts = gaps, 0, list[FloatArray]()
        self._stillness: Stillness | None = None

    def step(
        self, time: float, measured: Sequence[FloatArray], stamps: Sequence[FloatArray] | None = None
    ) -> list[FloatArray]:
        """See ``Exchange``."""
        away = any(first <= self._number < last for first, last in self._gaps)
        self._see(time, measured, away=away)
        self._number += 1
        if not away:
            self._efforts = self._computed(time, measured, stamps)
        if not self.membership.stopped:
            return self._efforts
        braked = zip(measured, self.brakes, self.robots, strict=True)
        return [braking_effort(own[:-3], brake, robot.rest) for own, brake, robot in braked]

    def _see(self, time: float, measured: Sequence[FloatArray], *, away: bool) -> None:
        """Let the drives brake from the first sample of a gap on."""
        self._stillness = self._stillness or Stillness(self.robots[0].period)
        rests = self._stillness.sees_rest(np.concatenate([own[(len(own) - 3) // 2 : -3] for own in measured]))
        states = {k: STANDS if away else robot.state for k, robot in enumerate(self.robots)}
        self.membership.see(time, states, rests=rests)

    def _computed(
        self, time: float, measured: Sequence[FloatArray], stamps: Sequence[FloatArray] | None
    ) -> list[FloatArray]:
        """Let everybody compute, and hand their messages over."""
        assert self.supervisor is not None
        stopped = self.membership.stopped
        done = [
            robot.step(time, own, stopped=stopped, stamps=None if stamps is None else tuple(stamps[k]))
            for k, (robot, own) in enumerate(zip(self.robots, measured, strict=True))
        ]
        told = self.supervisor.step(time, stopped=stopped)
        for robot, place in self.supervisor.answers():
            self.robots[robot].hear([place])
        for k, (node, (_, said)) in enumerate(zip(self.robots, done, strict=True)):
            node.hear(told)
            self.supervisor.hear(k, said)
            self.messages += ((time, k, message) for message in said)
        self.messages += ((time, None, message) for message in told)
        if stopped and all(robot.state in MOVES for robot in self.robots):
            self.membership.close_line(time, returns=self._returns())
        return [effort for effort, _ in done]

    def _returns(self) -> bool:
        return any(robot.state == RETURNS for robot in self.robots)

    def trouble(self) -> str:
        """See ``Exchange``; without gaps a run ends where a robot wants the drives to brake."""
        braking = () if self._gaps else [k for k, robot in enumerate(self.robots) if robot.state == STANDS]
        names = " and ".join(name_of(k) for k in braking)
        return self.membership.trouble or (f"{names} lets the drives brake" if names else "")

    def stopped(self) -> bool:
        """See ``Exchange``."""
        return self.membership.stopped or self._returns()

    def look(
        self, time: float, measured: Sequence[FloatArray], stamps: Sequence[FloatArray] | None = None
    ) -> FloatArray:
        """See ``Exchange``."""
        assert self.supervisor is not None
        records = [robot.look(time, own) for robot, own in zip(self.robots, measured, strict=True)]
        return np.concatenate([*records, self.supervisor.look(time)])


def simulate_apart(
    scenario: Scenario,
    plan: Plan,
    maps: Sequence[HarmonicMap],
    *,
    exchange: DirectExchange | None = None,
    observer: Callable[[Sample], None] | None = None,
) -> SimulationLog:
    """Simulate a sampled team whose controllers, supervisor and world have nothing in common but messages."""
    carried = DirectExchange() if exchange is None else exchange
    period, world = control_period(scenario), build_world(scenario, plan, carried)
    deployment = scenario.deployment
    known = robot_knowledge(scenario, plan, maps, world.team)
    carried.brakes = brakes_of(scenario, world.team)
    carried.robots = [RobotNode(own, deployment, k, world.team.robots[k].name) for k, own in enumerate(known)]
    carried.supervisor = SupervisorNode(len(known), len(plan.cells), period, hold_of(scenario, plan))
    try:
        return run_loop(world, scenario, observer=observer)
    finally:
        world.release()
        nodes: list[RobotNode | SupervisorNode] = [*carried.robots, carried.supervisor]
        for node in nodes:
            node.release()

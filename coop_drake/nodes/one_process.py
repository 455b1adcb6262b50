"""Robots, supervisor and world apart from each other in one process: only plain values cross."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from coop_drake.answers.log import SimulationLog
from coop_drake.answers.plan import Plan
from coop_drake.diagram import build_world, control_period
from coop_drake.diagram.knowledge import hold_of, robot_knowledge
from coop_drake.fields import HarmonicMap
from coop_drake.messages import name_of
from coop_drake.nodes.robot_node import RobotNode
from coop_drake.nodes.states import STANDS
from coop_drake.nodes.supervisor_node import SupervisorNode
from coop_drake.scenario import Scenario
from coop_drake.simulation import Sample, run_loop
from coop_drake.tree.pose import FloatArray


class DirectExchange:
    """Carries plain values between nodes of the same process, sample by sample.

    In a sample, all robots and the supervisor compute from what they have measured and heard before. Then
    their messages are handed over, and count from the next instant on.

    Attributes:
        messages: Every message of the team so far: number of the sample, sender (None for the supervisor).
    """

    def __init__(self) -> None:
        self.robots: Sequence[RobotNode] = ()
        self.supervisor: SupervisorNode | None = None
        self.messages: list[tuple[float, int | None, Any]] = []

    def step(self, time: float, measured: Sequence[FloatArray]) -> list[FloatArray]:
        """See ``Exchange``."""
        assert self.supervisor is not None
        done = [robot.step(time, own) for robot, own in zip(self.robots, measured, strict=True)]
        told = self.supervisor.step(time)
        for k, (robot, (_, said)) in enumerate(zip(self.robots, done, strict=True)):
            robot.hear(told)
            self.supervisor.hear(k, said)
            self.messages += ((time, k, message) for message in said)
        self.messages += ((time, None, message) for message in told)
        return [effort for effort, _ in done]

    def trouble(self) -> str:
        """See ``Exchange``; nobody can be missing, but a robot may want the drives to brake."""
        names = " and ".join(name_of(k) for k, robot in enumerate(self.robots) if robot.state == STANDS)
        return f"{names} lets the drives brake" if names else ""

    def stopped(self) -> bool:
        """See ``Exchange``; nobody can be missing."""
        return False

    def look(self, time: float, measured: Sequence[FloatArray]) -> FloatArray:
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
    carried.robots = [RobotNode(own, deployment, k, world.team.robots[k].name) for k, own in enumerate(known)]
    carried.supervisor = SupervisorNode(len(known), len(plan.cells), period, hold_of(scenario, plan))
    try:
        return run_loop(world, scenario, observer=observer)
    finally:
        world.release()
        nodes: list[RobotNode | SupervisorNode] = [*carried.robots, carried.supervisor]
        for node in nodes:
            node.release()

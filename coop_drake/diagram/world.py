"""The world alone: the team with its sensors and actuators, without controllers and without a supervisor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pydrake.systems.framework import Context, DiagramBuilder

from coop_drake.answers.plan import Plan
from coop_drake.diagram.closed_loop import Loop, Outputs, PortRow, build_station
from coop_drake.diagram.deployment import Body, build_body, effort_limits
from coop_drake.diagram.robot_controller import hold_of
from coop_drake.errors import ScenarioError
from coop_drake.laws.actuators import Brake, braking_damping
from coop_drake.plant import TeamPlant
from coop_drake.plant.team import base_inertia, displacement
from coop_drake.scenario import Scenario
from coop_drake.systems import Exchange, TeamLink, robot_record, supervisor_record
from coop_drake.tree.arrays import IntArray


@dataclass(frozen=True)
class World(Loop):
    """A team whose controllers and supervisor run elsewhere.

    Attributes:
        bodies: Sensors and actuators of every robot.
        link: The block that is connected to the controllers and the supervisor.
        records: Names and sizes of what each robot reports for the log, then of what the supervisor does.
    """

    bodies: tuple[Body, ...]
    link: TeamLink
    records: tuple[dict[str, int], ...]

    def create_context(self) -> Context:
        """Create a context of a team at rest."""
        context = super().create_context()
        for body in self.bodies:
            body.prepare(context)
        return context

    def outputs(self, ports: PortRow) -> Outputs:
        """Add what robots and supervisor report for the log to a row, and return where it stands."""
        added, records, at = ports.add(self.link, "records"), list[dict[str, IntArray]](), 0
        for names in self.records:
            ends = at + np.cumsum([*names.values()])
            parts = zip(names, np.split(added[at : ends[-1]], ends[:-1] - at), strict=True)
            records.append({name: part for name, part in parts if part.size})
            at = ends[-1]
        efforts = [ports.add(body.diagram, "robot_effort") for body in self.bodies]
        return Outputs(records[:-1], records[-1], efforts)


def control_period(scenario: Scenario) -> float:
    """Return the control period of a team whose robots compute apart from each other [s].

    Raises:
        ScenarioError: Robots compute in continuous time, or not all at the same time.
    """
    deployment, period = scenario.deployment, scenario.deployment.period
    if period is None:
        allowed = "a number of Hz, such as 200: controllers apart from each other compute at samples"
        raise ScenarioError(str(scenario.path), "deployment.control_rate", None, allowed)
    for name, departures in deployment.robots.items():
        if departures.sample_offset:
            key = f"deployment.robots.{name}.sample_offset"
            allowed = "0: robots apart from each other compute at the same samples"
            raise ScenarioError(str(scenario.path), key, departures.sample_offset, allowed)
    return period


def record_sizes(scenario: Scenario, plan: Plan, joints: Sequence[int]) -> tuple[dict[str, int], ...]:
    """Return names and sizes of what robots with numbers of joints, then their supervisor, report."""
    holds, passes = hold_of(scenario, plan) is not None, plan.motion is not None
    monitored = plan.departures is not None
    robots = (robot_record(n, holds=holds, monitored=monitored, passes=passes) for n in joints)
    return (*robots, supervisor_record(len(joints), holds=holds or passes, passes=passes))


def brakes_of(scenario: Scenario, team: TeamPlant) -> list[Brake]:
    """Return how the drives of each robot brake, with no more than its actuators can give."""
    return [
        Brake(
            braking_damping(*base_inertia(robot), len(robot.joints)),
            effort_limits(scenario.deployment, len(robot.joints)),
        )
        for robot in team.robots
    ]


def build_world(scenario: Scenario, plan: Plan, exchange: Exchange) -> World:
    """Build the world of a scenario.

    Args:
        scenario: The scenario.
        plan: The plan that the robots follow.
        exchange: Carries measurements to the robots and brings their efforts.

    Raises:
        ScenarioError: The models do not make a team, or robots do not compute at common samples.
    """
    period, builder = control_period(scenario), DiagramBuilder()
    station = build_station(scenario)
    team = station.team
    builder.AddNamedSystem("transport_station", station.diagram)
    joints = [len(robot.joints) for robot in team.robots]
    records = record_sizes(scenario, plan, joints)
    size = sum(sum(record.values()) for record in records)
    link = builder.AddNamedSystem("team_link", TeamLink(joints, period, exchange, size))
    bodies = []
    for k, robot in enumerate(team.robots):
        passes = plan.motion is not None
        body = build_body(scenario.deployment, k, robot.name, joints[k], passes=passes)
        diagram = builder.AddNamedSystem(f"robot_{k}_body", body.diagram)
        for output, receiver in (
            (station.diagram.GetOutputPort("object_pose"), diagram.GetInputPort("object_pose")),
            (station.diagram.GetOutputPort(f"robot_{k}_state"), diagram.GetInputPort("robot_state")),
            (
                diagram.GetOutputPort("measured_object_pose"),
                link.GetInputPort(f"robot_{k}_object_pose"),
            ),
            (diagram.GetOutputPort("measured_robot_state"), link.GetInputPort(f"robot_{k}_state")),
            (diagram.GetOutputPort("object_pose_stamp"), link.GetInputPort(f"robot_{k}_pose_stamp")),
            (diagram.GetOutputPort("robot_state_stamp"), link.GetInputPort(f"robot_{k}_state_stamp")),
            (
                link.GetOutputPort(f"robot_{k}_effort_command"),
                diagram.GetInputPort("effort_command"),
            ),
            (
                diagram.GetOutputPort("robot_effort"),
                station.diagram.GetInputPort(f"robot_{k}_effort"),
            ),
        ):
            builder.Connect(output, receiver)
        bodies.append(body)
    start = plan.start + displacement(scenario.deployment, len(plan.start))
    return World(builder.Build(), station, plan, start, tuple(bodies), link, records)

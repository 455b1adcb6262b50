"""The closed loop: station, cell planner, and one controller for each robot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pydrake.systems.framework import Context, Diagram, DiagramBuilder

from coop_drake.answers.plan import Plan
from coop_drake.diagram.deployment import DeployedController, deploy
from coop_drake.diagram.hold import add_supervisor
from coop_drake.diagram.knowledge import hold_of, robot_knowledge
from coop_drake.diagram.robot_controller import TELEMETRY, Replacements, build_robot_controller
from coop_drake.diagram.station import Loop, Places, PortRow, build_station
from coop_drake.harmonic_maps import HarmonicMap
from coop_drake.plant.configuration import displacement
from coop_drake.scenario import Scenario
from coop_drake.systems import CellPlanner, HoldSupervisor
from coop_drake.systems.departure_monitor import ALARM_SIZE


@dataclass(frozen=True)
class ClosedLoop(Loop):
    """The closed loop and its parts.

    Attributes:
        cell_planner: The supervisor.
        controllers: One sub-Diagram for each robot, as the others see it.
        deployed: Controllers with sensors, actuators and radio, empty where the team is ideal.
        supervisor: What holds the team, None where nothing can ask for it.
    """

    cell_planner: CellPlanner
    controllers: tuple[Diagram, ...]
    deployed: tuple[DeployedController, ...]
    supervisor: HoldSupervisor | None

    @property
    def bare_controllers(self) -> tuple[Diagram, ...]:
        """The controllers alone, without the sensors, actuators and radio of a deployment."""
        return tuple(deployed.controller for deployed in self.deployed) or self.controllers

    def create_context(self) -> Context:
        """Create a context of a team at rest, in the first cell, with every p_G at the plan's start."""
        context = super().create_context()
        for deployed in self.deployed:
            deployed.prepare(context, self.plan.start[:2])
        return context

    def places(self, ports: PortRow) -> Places:
        """Add all outputs that are logged to a row, and return where they stand."""
        robots = self.team.robots
        states = [ports.add(self.station.diagram, f"robot_{robot.index}_state") for robot in robots]
        efforts = [ports.add(controller, "robot_effort") for controller in self.controllers]
        logged = [name for name in TELEMETRY if name != "object_state"]
        of = {name: [ports.add(law, name) for law in self.bare_controllers] for name in ("ready", *logged)}
        clock = [] if self.supervisor is None else ports.add(self.bare_controllers[0], "clock")
        causes = [] if self.supervisor is None else ports.add(self.supervisor, "causes")
        monitored = [law for law in self.bare_controllers if law.HasOutputPort("alarm")]
        alarms = [ports.add(law, "alarm") for law in monitored]
        # Every robot has bounds for the angle; they are equal, and the first robot's are taken.
        bounds = [np.split(funnels, 2) for funnels in of["funnels"]]
        return Places(
            instant=np.concatenate(
                [ports.add(self.cell_planner, name) for name in ("current_cell", "arrived")]
            ),
            base_poses=np.array([state[:3] for state in states]),
            governors=np.array(of["governor_position"]),
            funnel_lower=np.concatenate([bounds[0][0][:1], *(lower[1:] for lower, _ in bounds)]),
            funnel_upper=np.concatenate([bounds[0][1][:1], *(upper[1:] for _, upper in bounds)]),
            energy_margins=np.concatenate(of["energy_margin"]),
            commanded_wrenches=np.array(of["hand_command"])[:, 3:],
            base_wrenches=np.array([effort[:3] for effort in efforts]),
            joint_torques=np.concatenate([effort[3:] for effort in efforts]),
            accelerations=np.array(of["object_acceleration"]),
            realised=self.realised(ports),
            ready_margins=np.array([margin for _, margin in of["ready"]]),
            clock_lag=np.array(clock[:1], dtype=np.intp),
            causes=np.array(causes, dtype=np.intp),
            alarms=np.array(alarms, dtype=np.intp).reshape(-1, ALARM_SIZE),
        )


def build_closed_loop(
    scenario: Scenario,
    plan: Plan,
    maps: Sequence[HarmonicMap],
    *,
    replacements: Replacements | None = None,
) -> ClosedLoop:
    """Build the closed loop; only ready reports, and requests for a hold if any, cross between robots.

    Args:
        scenario: The scenario.
        plan: A plan for it.
        maps: The harmonic map of every transition.
        replacements: Blocks of a user's own in every robot's controller, see `build_robot_controller`.

    Raises:
        PlanError: The plan belongs to another team, or the number of maps is not the number of cells.
        ScenarioError: The models do not make a team.
        ValueError: A replacement for a block that does not exist.
    """
    builder = DiagramBuilder()
    station = build_station(scenario)
    team = station.team
    knowledge = robot_knowledge(scenario, plan, maps, team)
    start = plan.start + displacement(scenario.deployment, len(plan.start))
    builder.AddNamedSystem("transport_station", station.diagram)
    planner = builder.AddNamedSystem(
        "cell_planner", CellPlanner(len(team.robots), len(plan.cells), period=scenario.deployment.period)
    )
    hold, supervisor = hold_of(scenario, plan), None
    if hold is not None:
        supervisor = add_supervisor(builder, hold, planner, len(team.robots), scenario.deployment.period)
    built, deployed = [], []
    for k, known in enumerate(knowledge):
        controller = build_robot_controller(known, replacements)
        if not scenario.deployment.ideal:
            deployed.append(deploy(controller, scenario.deployment, k, team.robots[k].name))
            controller = deployed[-1].diagram
        builder.AddNamedSystem(f"robot_{k}_controller", controller)
        _connect(builder, station.diagram, planner, controller, k)
        if supervisor is not None:
            message = supervisor.GetOutputPort("hold_message")
            builder.Connect(message, controller.GetInputPort("hold_message"))
            builder.Connect(
                controller.GetOutputPort("hold_request"), supervisor.GetInputPort(f"robot_{k}_request")
            )
        built.append(controller)
    return ClosedLoop(
        builder.Build(), station, plan, start, planner, tuple(built), tuple(deployed), supervisor
    )


def _connect(
    builder: DiagramBuilder, station: Diagram, planner: CellPlanner, controller: Diagram, k: int
) -> None:
    builder.Connect(station.GetOutputPort("object_pose"), controller.GetInputPort("object_pose"))
    builder.Connect(station.GetOutputPort(f"robot_{k}_state"), controller.GetInputPort("robot_state"))
    builder.Connect(planner.GetOutputPort("current_cell"), controller.GetInputPort("current_cell"))
    builder.Connect(controller.GetOutputPort("ready"), planner.GetInputPort(f"robot_{k}_ready"))
    builder.Connect(controller.GetOutputPort("robot_effort"), station.GetInputPort(f"robot_{k}_effort"))

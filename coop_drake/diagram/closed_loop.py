"""The closed loop: station, cell planner, and one controller for each robot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pydrake.systems.framework import Context, Diagram, DiagramBuilder, System
from pydrake.systems.primitives import ConstantVectorSource, TrajectorySource
from pydrake.trajectories import PiecewisePolynomial

from coop_drake.answers.plan import Plan
from coop_drake.diagram.deployment import DeployedController, deploy
from coop_drake.diagram.knowledge import hold_of, robot_knowledge
from coop_drake.diagram.robot_controller import Replacements, build_robot_controller
from coop_drake.diagram.station import Loop, Outputs, PortRow, build_station
from coop_drake.harmonic_maps import HarmonicMap
from coop_drake.plant.team import displacement
from coop_drake.scenario import Hold, Scenario
from coop_drake.systems import CellPlanner, HoldSupervisor, robot_record


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

    def outputs(self, ports: PortRow) -> Outputs:
        """Add the outputs of robots and supervisor to a row, and return where they stand."""
        names = robot_record(0, holds=True, monitored=True)
        supervisor = {name: ports.add(self.cell_planner, name) for name in ("current_cell", "arrived")}
        if self.supervisor is not None:
            supervisor["causes"] = ports.add(self.supervisor, "causes")
        return Outputs(
            [
                {name: ports.add(law, name) for name in names if law.HasOutputPort(name)}
                for law in self.bare_controllers
            ],
            supervisor,
            [ports.add(controller, "robot_effort") for controller in self.controllers],
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


def add_supervisor(
    builder: DiagramBuilder, hold: Hold, planner: CellPlanner, robots: int, period: float | None
) -> HoldSupervisor:
    """Add the supervisor with the scheduled order, and keep the team in its cell while it is held.

    Args:
        builder: Holds the cell planner.
        hold: When the team is held.
        planner: The cell planner.
        robots: Number of robots whose requests are heard.
        period: Control period [s], None in continuous time.
    """
    supervisor = builder.AddNamedSystem(
        "hold_supervisor", HoldSupervisor(robots, silence=hold.silence, period=period)
    )
    order = builder.AddNamedSystem("hold_order", _order(hold))
    builder.Connect(order.get_output_port(0), supervisor.GetInputPort("order"))
    builder.Connect(supervisor.GetOutputPort("paused"), planner.GetInputPort("paused"))
    return supervisor


def _order(hold: Hold) -> System:
    """Return the source of the order: 1 from each of the times on for the duration, else 0."""
    if not hold.at:
        return ConstantVectorSource([0.0])
    begins = np.array(sorted(hold.at))
    events = np.unique(
        np.concatenate([[0.0], begins, begins + hold.duration, [begins[-1] + 2.0 * hold.duration]])
    )
    told = [float(any(begin <= time < begin + hold.duration for begin in begins)) for time in events]
    return TrajectorySource(PiecewisePolynomial.ZeroOrderHold(events, np.array([told])))

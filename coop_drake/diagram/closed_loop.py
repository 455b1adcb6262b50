"""The closed loop: station, cell planner, and one controller for each robot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from pydrake.systems.framework import Context, Diagram, DiagramBuilder

from coop_drake.answers.plan import Plan
from coop_drake.diagram.deployment import DeployedController, deploy
from coop_drake.diagram.fused import FusedControllers, add_fused_controllers
from coop_drake.diagram.hold import add_supervisor
from coop_drake.diagram.knowledge import hold_of, robot_knowledge
from coop_drake.diagram.loop import Loop
from coop_drake.diagram.robot_controller import Replacements, build_robot_controller
from coop_drake.diagram.station import build_driven_station, build_station
from coop_drake.harmonic_maps import HarmonicMap
from coop_drake.plant.configuration import displacement
from coop_drake.scenario import Scenario
from coop_drake.systems import CellPlanner, HoldSupervisor

Blocks = Literal["named", "fused"]
"""How the controllers are built: a block for each law of each robot, or one block for them all."""


@dataclass(frozen=True)
class ClosedLoop(Loop):
    """The closed loop and its parts.

    Attributes:
        cell_planner: The supervisor.
        controllers: One sub-Diagram for each robot, as the others see it.
        deployed: Controllers with sensors, actuators and radio, empty where the team is ideal.
        supervisor: What holds the team, None where nothing can ask for it.
        fused: The block that drives the team in the fused mode, which has no controllers of single robots.
    """

    cell_planner: CellPlanner
    controllers: tuple[Diagram, ...]
    deployed: tuple[DeployedController, ...]
    supervisor: HoldSupervisor | None
    fused: FusedControllers | None

    @property
    def bare_controllers(self) -> tuple[Diagram, ...]:
        """The controllers alone, without the sensors, actuators and radio of a deployment."""
        return tuple(deployed.controller for deployed in self.deployed) or self.controllers

    def create_context(self) -> Context:
        """Create a context of a team at rest, in the first cell, with every p_G at the plan's start."""
        context = super().create_context()
        if self.fused is not None:
            governor = self.fused.integrator
            governor.set_integral_value(governor.GetMyMutableContextFromRoot(context), self.plan.start[:2])
        for deployed in self.deployed:
            deployed.prepare(context, self.plan.start[:2])
        return context


def build_closed_loop(
    scenario: Scenario,
    plan: Plan,
    maps: Sequence[HarmonicMap],
    *,
    blocks: Blocks = "named",
    replacements: Replacements | None = None,
) -> ClosedLoop:
    """Build the closed loop; only ready reports, and requests for a hold if any, cross between robots.

    Args:
        scenario: The scenario.
        plan: A plan for it.
        maps: The harmonic map of every transition.
        blocks: ``named`` for the law as blocks of every robot; ``fused`` for speed alone: one block drives
            the team in continuous time, and nothing shows any more that robots need no state of each other.
            One block for a sampled team is that of :mod:`coop_drake.compiled_loop`.
        replacements: Blocks of a user's own in every robot's controller, see `build_robot_controller`; with
            named blocks only.

    Raises:
        PlanError: The plan belongs to another team, or the number of maps is not the number of cells.
        ScenarioError: The models do not make a team, or fused blocks do not know what the scenario wants.
        ValueError: Replacements for fused blocks, or for a block that does not exist.
    """
    if replacements and blocks == "fused":
        raise ValueError("replacements: fused blocks cannot be replaced; expected blocks='named'")
    builder = DiagramBuilder()
    station = build_station(scenario) if blocks == "named" else build_driven_station(scenario)
    team = station.team
    knowledge = robot_knowledge(scenario, plan, maps, team)
    start = plan.start + displacement(scenario.deployment, len(plan.start))
    builder.AddNamedSystem("transport_station", station.diagram)
    planner = builder.AddNamedSystem(
        "cell_planner", CellPlanner(len(team.robots), len(plan.cells), period=scenario.deployment.period)
    )
    hold, supervisor = hold_of(scenario, plan), None
    if hold is not None:
        heard = len(team.robots) if blocks == "named" else 0
        supervisor = add_supervisor(builder, hold, planner, heard, scenario.deployment.period)
    if blocks == "fused":
        controllers = add_fused_controllers(builder, scenario, station, planner, supervisor, knowledge)
        return ClosedLoop(builder.Build(), station, plan, start, planner, (), (), supervisor, controllers)
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
        builder.Build(), station, plan, start, planner, tuple(built), tuple(deployed), supervisor, None
    )


def _connect(
    builder: DiagramBuilder, station: Diagram, planner: CellPlanner, controller: Diagram, k: int
) -> None:
    builder.Connect(station.GetOutputPort("object_pose"), controller.GetInputPort("object_pose"))
    builder.Connect(station.GetOutputPort(f"robot_{k}_state"), controller.GetInputPort("robot_state"))
    builder.Connect(planner.GetOutputPort("current_cell"), controller.GetInputPort("current_cell"))
    builder.Connect(controller.GetOutputPort("ready"), planner.GetInputPort(f"robot_{k}_ready"))
    builder.Connect(controller.GetOutputPort("robot_effort"), station.GetInputPort(f"robot_{k}_effort"))

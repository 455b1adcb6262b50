"""The closed loop: station, cell planner, and one controller for each robot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from pydrake.systems.framework import Context, Diagram, DiagramBuilder

from coop_drake.control import slowdown_radius
from coop_drake.diagram.deployment import DeployedController, deploy
from coop_drake.diagram.robot_controller import RobotKnowledge, build_robot_controller
from coop_drake.diagram.station import TransportStation, build_station
from coop_drake.errors import PlanError
from coop_drake.fields import HarmonicMap, VelocityField
from coop_drake.geometry.boundary import BoundaryDistance
from coop_drake.planning.plan import Plan
from coop_drake.plant import RobotPlant, TeamPlant, build_robot_plant, set_configuration
from coop_drake.scenario import Scenario
from coop_drake.systems import CellPlanner, GovernedCell

__all__ = ["ClosedLoop", "build_closed_loop"]

FIELD_SPEED = 1.0
"""Largest magnitude of the velocity fields [m/s]; the governor scales it and bounds it by Delta E."""


@dataclass(frozen=True)
class ClosedLoop:
    """The wired loop and handles on its parts.

    Attributes:
        diagram: The whole.
        station: The simulated team.
        cell_planner: The supervisor.
        controllers: One sub-Diagram for each robot, as the others see it.
        deployed: What stands round the controllers, empty where the team is ideal.
        plan: The plan that they follow.
    """

    diagram: Diagram
    station: TransportStation
    cell_planner: CellPlanner
    controllers: tuple[Diagram, ...]
    deployed: tuple[DeployedController, ...]
    plan: Plan

    @property
    def laws(self) -> tuple[Diagram, ...]:
        """The controllers themselves, without what a deployment puts round them."""
        return tuple(deployed.controller for deployed in self.deployed) or self.controllers

    @property
    def team(self) -> TeamPlant:
        """The simulated team."""
        return self.station.team

    def create_context(self) -> Context:
        """A context at the plan's start: at rest, in the first cell, every governor on the object."""
        context = self.diagram.CreateDefaultContext()
        team = self.team
        set_configuration(team, team.plant.GetMyMutableContextFromRoot(context), self.plan.start)
        for deployed in self.deployed:
            deployed.prepare(context)
        return context


def build_closed_loop(scenario: Scenario, plan: Plan, maps: Sequence[HarmonicMap]) -> ClosedLoop:
    """Wire the loop; nothing but ready reports crosses between robots.

    Args:
        scenario: The scenario.
        plan: A plan for it.
        maps: The harmonic map of every transition.

    Raises:
        PlanError: The plan belongs to another team, or the number of maps is not the number of cells.
        ScenarioError: The models do not make a team.
    """
    builder = DiagramBuilder()
    station = build_station(scenario)
    team = station.team
    _check(plan, maps, team)
    builder.AddNamedSystem("transport_station", station.diagram)
    planner = builder.AddNamedSystem(
        "cell_planner", CellPlanner(len(team.robots), len(plan.cells), period=scenario.deployment.period)
    )
    controllers, deployed = [], []
    for k, knowledge in enumerate(_knowledge(scenario, plan, maps, team)):
        controller = build_robot_controller(knowledge)
        if not scenario.deployment.ideal:
            deployed.append(deploy(controller, scenario.deployment, k))
            controller = deployed[-1].diagram
        builder.AddNamedSystem(f"robot_{k}_controller", controller)
        _connect(builder, station.diagram, planner, controller, k)
        controllers.append(controller)
    return ClosedLoop(builder.Build(), station, planner, tuple(controllers), tuple(deployed), plan)


def _connect(
    builder: DiagramBuilder, station: Diagram, planner: CellPlanner, controller: Diagram, k: int
) -> None:
    builder.Connect(station.GetOutputPort("object_pose"), controller.GetInputPort("object_pose"))
    builder.Connect(station.GetOutputPort(f"robot_{k}_state"), controller.GetInputPort("robot_state"))
    builder.Connect(planner.GetOutputPort("current_cell"), controller.GetInputPort("current_cell"))
    builder.Connect(controller.GetOutputPort("ready"), planner.GetInputPort(f"robot_{k}_ready"))
    builder.Connect(controller.GetOutputPort("robot_effort"), station.GetInputPort(f"robot_{k}_effort"))


def _knowledge(
    scenario: Scenario, plan: Plan, maps: Sequence[HarmonicMap], team: TeamPlant
) -> list[RobotKnowledge]:
    cells = [
        GovernedCell(
            BoundaryDistance(cell.tidied), _field(field_map, transition.gains.governor_gain), transition.gains
        )
        for cell, transition, field_map in zip(plan.cells, plan.transitions, maps, strict=True)
    ]
    factor = 1.0 + scenario.deployment.mass_error
    return [
        RobotKnowledge(
            robot=_robot(scenario, robot.index, factor),
            X_LE=robot.X_LE,
            joints=robot.q_slice,
            object_inertia=team.object_inertia.scaled(factor),
            load_share=scenario.load_share(robot.name, len(team.robots)),
            plan=plan,
            cells=cells,
            position_tolerance=scenario.goal.tolerances.position,
            period=scenario.deployment.period,
        )
        for robot in team.robots
    ]


def _robot(scenario: Scenario, index: int, factor: float) -> RobotPlant:
    robot = build_robot_plant(scenario, index)
    if factor != 1.0:
        robot.scale_masses(factor)
    return robot


def _field(harmonic_map: HarmonicMap, governor_gain: float) -> VelocityField:
    radius = slowdown_radius(FIELD_SPEED, governor_gain=governor_gain)
    return VelocityField(harmonic_map, FIELD_SPEED, slowdown_radius=radius)


def _check(plan: Plan, maps: Sequence[HarmonicMap], team: TeamPlant) -> None:
    if plan.joint_names != team.joint_names:
        raise PlanError(
            f"the plan moves the joints {', '.join(plan.joint_names)}; the scenario's team has "
            f"{', '.join(team.joint_names)}"
        )
    if len(maps) != len(plan.cells):
        raise PlanError(f"a plan of {len(plan.cells)} cells needs as many maps, not {len(maps)}")

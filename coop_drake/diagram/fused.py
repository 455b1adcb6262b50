"""The fused mode in continuous time: one block drives the whole team."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import Demultiplexer, Integrator

from coop_drake.diagram.robot_controller import RobotKnowledge
from coop_drake.diagram.station import TransportStation
from coop_drake.errors import ScenarioError
from coop_drake.harmonic_maps import VelocityField
from coop_drake.plant import TeamPlant, base_chain, robot_chain
from coop_drake.scenario import Control, Deployment, Hold, Scenario
from coop_drake.systems import (
    READY_SIZE,
    CellPlanner,
    FunnelClock,
    FusedCell,
    FusedTeam,
    HoldSupervisor,
    TeamController,
    axis_laws,
)
from coop_drake.systems.nominal_kernels import NOTHING


@dataclass(frozen=True)
class FusedControllers:
    """The parts that drive a team in the fused mode.

    Attributes:
        driver: The block that computes all controllers.
        integrator: The integrator of p_G.
        clock: The funnels' clock, None where a scenario has no holds.
    """

    driver: TeamController
    integrator: Integrator
    clock: FunnelClock | None


def add_fused_controllers(
    builder: DiagramBuilder,
    scenario: Scenario,
    station: TransportStation,
    planner: CellPlanner,
    supervisor: HoldSupervisor | None,
    knowledge: Sequence[RobotKnowledge],
) -> FusedControllers:
    """Add the block that drives a team and the integrator of p_G, and connect them.

    Args:
        builder: Holds station and planner.
        scenario: The scenario.
        station: Built for the fused mode.
        planner: The cell planner.
        supervisor: What holds the team, None where a scenario has no holds.
        knowledge: What every robot knows before the run.

    Raises:
        ScenarioError: The scenario asks for what only named blocks do.
    """
    _check(scenario, knowledge)
    team, robots = station.team, len(knowledge)
    driver = builder.AddNamedSystem("team_controller", build_team_controller(team, knowledge))
    sizes = [3 * robots, len(team.joints), 2]
    parts = builder.AddNamedSystem("command_parts", Demultiplexer([size for size in sizes if size]))
    governor = builder.AddNamedSystem("governor_state", Integrator(2))
    reports = builder.AddNamedSystem("reports", Demultiplexer([READY_SIZE] * robots))
    builder.Connect(driver.GetOutputPort("team_command"), parts.get_input_port())
    builder.Connect(station.diagram.GetOutputPort("team_state"), driver.GetInputPort("team_state"))
    builder.Connect(planner.GetOutputPort("current_cell"), driver.GetInputPort("current_cell"))
    builder.Connect(parts.get_output_port(parts.num_output_ports() - 1), governor.get_input_port())
    builder.Connect(governor.get_output_port(), driver.GetInputPort("governor_position"))
    builder.Connect(driver.GetOutputPort("ready"), reports.get_input_port())
    for k in range(robots):
        builder.Connect(reports.get_output_port(k), planner.GetInputPort(f"robot_{k}_ready"))
    builder.Connect(parts.get_output_port(0), station.diagram.GetInputPort("base_forces"))
    if team.joints:
        builder.Connect(parts.get_output_port(1), station.diagram.GetInputPort("joint_torques"))
    clock = None if supervisor is None else _add_clock(builder, supervisor, planner, driver)
    return FusedControllers(driver, governor, clock)


def _add_clock(
    builder: DiagramBuilder,
    supervisor: HoldSupervisor,
    planner: CellPlanner,
    driver: TeamController,
) -> FunnelClock:
    """Add the clock that all robots would have."""
    clock = builder.AddNamedSystem("funnel_clock", FunnelClock())
    builder.Connect(supervisor.GetOutputPort("hold"), clock.GetInputPort("hold"))
    builder.Connect(planner.GetOutputPort("current_cell"), clock.GetInputPort("current_cell"))
    builder.Connect(clock.GetOutputPort("clock"), driver.GetInputPort("clock"))
    return clock


def build_team_controller(team: TeamPlant, knowledge: Sequence[RobotKnowledge]) -> TeamController:
    """Build the block that computes what the controllers of all robots compute.

    Args:
        team: The simulated team, one tree rooted at the object.
        knowledge: What every robot knows before the run.
    """
    known = knowledge[0]
    axes = [i for robot in team.robots for i in (0, *range(1 + robot.q_slice.start, 1 + robot.q_slice.stop))]
    laws = axis_laws(known.plan, axes)
    cells = []
    for cell, law in zip(known.cells, laws, strict=True):
        if not isinstance(cell.field, VelocityField):
            raise TypeError("fused blocks need the velocity fields of harmonic maps")
        cells.append(FusedCell(cell.row, cell.clearance.edges, *cell.field.kernel_arguments, law.table))
    return TeamController(
        cells,
        fused_team(team, knowledge),
        [transition.inradius for transition in known.plan.transitions],
        known.plan.goal_pose[:2],
        known.position_tolerance,
        start=known.plan.start[2:][np.array(axes)],
        paced=known.hold is not None,
    )


def fused_team(team: TeamPlant, knowledge: Sequence[RobotKnowledge]) -> FusedTeam:
    """Return the models of all robots as arrays.

    Args:
        team: The simulated team, one tree rooted at the object.
        knowledge: What every robot knows before the run.
    """
    chains = [robot_chain(known.robot) for known in knowledge]
    bases, motion = [base_chain(team, robot) for robot in team.robots], knowledge[0].motion
    counts = [
        [len(chain) for chain in chains],
        [len(base.chain) for base in bases],
        [robot.q_slice.stop - robot.q_slice.start for robot in team.robots],
    ]
    return FusedTeam(
        places=np.array([team.position_index, team.plant.num_positions() + team.velocity_index]),
        first=np.array([[0, *np.cumsum(row)] for row in counts]),
        chains=np.vstack(chains),
        base_chains=np.vstack([base.chain for base in bases]),
        yaws=np.array([base.yaw for base in bases]),
        loads=np.array([known.load for known in knowledge]),
        tracking=NOTHING if motion is None else motion.tracking_row(knowledge[0].cells[0]),
    )


def _check(scenario: Scenario, knowledge: Sequence[RobotKnowledge]) -> None:
    deployment = scenario.deployment
    allowed = Deployment(
        mass_error=deployment.mass_error, start_offset=deployment.start_offset, seed=deployment.seed
    )
    refused: tuple[str, object] | None = None
    if not scenario.plant.ideal:
        refused = "plant.grasps", scenario.plant.grasps
    elif deployment != allowed:
        refused = "deployment", deployment
    elif scenario.control != Control(hold=scenario.control.hold):
        refused = "control", scenario.control
    elif (hold := scenario.control.hold) is not None and hold != Hold(hold.at, hold.duration):
        refused = "control.hold", scenario.control.hold
    elif any(robot.robot.has_springs for robot in knowledge):
        refused = "directives", "a robot with springs"
    if refused is not None:
        raise ScenarioError(
            str(scenario.path),
            *refused,
            "rigid grasps (`grasps: joints`), models without springs, no predictor or observer, holds only "
            "at times that the scenario states, of deployment only mass_error, start_offset and seed: fused "
            "blocks in continuous time support only these; use `--blocks named` for the rest",
        )

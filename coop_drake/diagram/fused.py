"""The fused mode: one block drives the whole team."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pydrake.systems.framework import DiagramBuilder, OutputPort
from pydrake.systems.primitives import (
    Demultiplexer,
    DiscreteTimeIntegrator,
    Integrator,
    Multiplexer,
    ZeroOrderHold,
)

from coop_drake.diagram.radio import build_radio
from coop_drake.diagram.robot_controller import RobotKnowledge
from coop_drake.diagram.station import TransportStation
from coop_drake.errors import ScenarioError
from coop_drake.fields import VelocityField
from coop_drake.plant import TeamPlant, base_chain, robot_chain
from coop_drake.scenario import Control, Deployment, Hold, Scenario
from coop_drake.systems import (
    READY_SIZE,
    CellPlanner,
    FunnelClock,
    FusedCell,
    FusedTeam,
    HoldSupervisor,
    NominalGovernor,
    TeamController,
    axis_laws,
)
from coop_drake.systems.nominal_kernels import NOTHING


@dataclass(frozen=True)
class FusedControllers:
    """The parts that drive a team in the fused mode.

    Attributes:
        driver: The block that computes all controllers.
        governor_position: The output that holds p_G.
        integrator: The integrator of p_G, None where a nominal governor keeps it.
        clock: The funnels' clock, None where a scenario has no holds.
        efforts: The held effort of each robot in a sampled loop; empty in continuous time.
    """

    driver: TeamController
    governor_position: OutputPort
    integrator: Integrator | DiscreteTimeIntegrator | None
    clock: FunnelClock | None
    efforts: tuple[OutputPort, ...]


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
    team, robots, period = station.team, len(knowledge), scenario.deployment.period
    driver = builder.AddNamedSystem("team_controller", build_team_controller(team, knowledge))
    sizes = [3 * robots, len(team.joints), 2]
    parts = builder.AddNamedSystem("command_parts", Demultiplexer([size for size in sizes if size]))
    builder.Connect(driver.GetOutputPort("team_command"), parts.get_input_port())
    builder.Connect(station.diagram.GetOutputPort("team_state"), driver.GetInputPort("team_state"))
    builder.Connect(planner.GetOutputPort("current_cell"), driver.GetInputPort("current_cell"))
    clock = None if supervisor is None else _add_clock(builder, supervisor, planner, driver, period)
    governor = _add_governor(builder, knowledge[0], driver, parts, planner, clock)
    nominal = isinstance(governor, NominalGovernor)
    position = governor.GetOutputPort("governor_position") if nominal else governor.get_output_port()
    integrator = None if isinstance(governor, NominalGovernor) else governor
    builder.Connect(position, driver.GetInputPort("governor_position"))
    _report(builder, scenario.deployment, planner, driver, robots)
    if period is not None:
        efforts = _hold(builder, station, parts, period)
        return FusedControllers(driver, position, integrator, clock, efforts)
    builder.Connect(parts.get_output_port(0), station.diagram.GetInputPort("base_forces"))
    if team.joints:
        builder.Connect(parts.get_output_port(1), station.diagram.GetInputPort("joint_torques"))
    return FusedControllers(driver, position, integrator, clock, ())


def _add_governor(
    builder: DiagramBuilder,
    known: RobotKnowledge,
    driver: TeamController,
    parts: Demultiplexer,
    planner: CellPlanner,
    clock: FunnelClock | None,
) -> Integrator | DiscreteTimeIntegrator | NominalGovernor:
    """Add what keeps p_G: an integrator of its rate, or the nominal governor that all robots would have."""
    period = known.period
    if known.motion is None:
        integrator = Integrator(2) if period is None else DiscreteTimeIntegrator(2, period)
        state = builder.AddNamedSystem("governor_state", integrator)
        builder.Connect(parts.get_output_port(parts.num_output_ports() - 1), state.get_input_port())
        return state
    block = NominalGovernor(known.cells, known.motion, paced=clock is not None)
    governor = builder.AddNamedSystem("nominal_governor", block)
    builder.Connect(planner.GetOutputPort("current_cell"), governor.GetInputPort("current_cell"))
    builder.Connect(governor.GetOutputPort("nominal"), driver.GetInputPort("nominal"))
    if clock is not None:
        builder.Connect(clock.GetOutputPort("clock"), governor.GetInputPort("clock"))
    return governor


def _add_clock(
    builder: DiagramBuilder,
    supervisor: HoldSupervisor,
    planner: CellPlanner,
    driver: TeamController,
    period: float | None,
) -> FunnelClock:
    """Add the clock that all robots would have."""
    clock = builder.AddNamedSystem("funnel_clock", FunnelClock(period))
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
        period=known.period,
        on_bases=known.period is None,
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


def _report(
    builder: DiagramBuilder, deployment: Deployment, planner: CellPlanner, driver: TeamController, robots: int
) -> None:
    reports = builder.AddNamedSystem("reports", Demultiplexer([READY_SIZE] * robots))
    builder.Connect(driver.GetOutputPort("ready"), reports.get_input_port())
    for k in range(robots):
        heard = reports.get_output_port(k)
        if deployment.period is not None:
            radio = builder.AddNamedSystem(f"radio_{k}", build_radio(deployment, k))
            builder.Connect(heard, radio.get_input_port())
            heard = radio.get_output_port()
        builder.Connect(heard, planner.GetInputPort(f"robot_{k}_ready"))


def _hold(
    builder: DiagramBuilder, station: TransportStation, parts: Demultiplexer, period: float
) -> tuple[OutputPort, ...]:
    """Hold every robot's effort between samples; base wrenches are in W, as the station's inputs.

    The holds connect to the station directly: Drake would evaluate a block behind them at every step.
    """
    joints = [len(robot.joints) for robot in station.team.robots]
    bases = _split(builder, "base_wrenches", parts.get_output_port(0), [3] * len(joints))
    torques: list[OutputPort | None] = [None] * len(joints)
    if any(joints):
        torques = _split(builder, "joint_torques", parts.get_output_port(1), joints)
    efforts = []
    for k, (base, torque) in enumerate(zip(bases, torques, strict=True)):
        ports = [port for port in (base, torque) if port is not None]
        sizes = [port.size() for port in ports]
        effort = builder.AddNamedSystem(f"robot_{k}_effort", Multiplexer(sizes))
        for i, port in enumerate(ports):
            builder.Connect(port, effort.get_input_port(i))
        hold = builder.AddNamedSystem(f"robot_{k}_hold", ZeroOrderHold(period, sum(sizes)))
        builder.Connect(effort.get_output_port(), hold.get_input_port())
        builder.Connect(hold.get_output_port(), station.diagram.GetInputPort(f"robot_{k}_effort"))
        efforts.append(hold.get_output_port())
    return tuple(efforts)


def _split(
    builder: DiagramBuilder, name: str, whole: OutputPort, sizes: Sequence[int]
) -> list[OutputPort | None]:
    """Split a port; parts of size zero are None."""
    split = builder.AddNamedSystem(name, Demultiplexer([size for size in sizes if size]))
    builder.Connect(whole, split.get_input_port())
    ports = iter(range(split.num_output_ports()))
    return [split.get_output_port(next(ports)) if size else None for size in sizes]


def _check(scenario: Scenario, knowledge: Sequence[RobotKnowledge]) -> None:
    deployment = scenario.deployment
    if any(known.axis_motion is not None for known in knowledge):
        blocks = "named, for a plan with a budget for angles and joints"
        raise ScenarioError(str(scenario.path), "--blocks", "fused", blocks)
    allowed = Deployment(
        control_rate=deployment.control_rate,
        mass_error=deployment.mass_error,
        messages=deployment.messages,
        start_offset=deployment.start_offset,
        budget=deployment.budget,
        seed=deployment.seed,
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
            "an ideal plant without springs, no predictor or observer, holds only at times that the scenario "
            "states, of deployment only control_rate, "
            "mass_error, messages, start_offset and seed: "
            "fused blocks support only these; use `--blocks named` for the rest",
        )

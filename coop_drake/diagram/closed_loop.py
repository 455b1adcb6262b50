"""The closed loop: the simulated team in its station, a cell planner, and one controller for each robot."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from math import pi
from typing import NamedTuple

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import Propeller, PropellerInfo
from pydrake.systems.framework import Context, Diagram, DiagramBuilder, OutputPort, System
from pydrake.systems.primitives import (
    ConstantValueSource,
    ConstantVectorSource,
    Demultiplexer,
    Multiplexer,
    Selector,
    TrajectorySource,
)
from pydrake.trajectories import PiecewisePolynomial

from coop_drake.answers.plan import Plan
from coop_drake.diagram.deployment import (
    Body,
    DeployedController,
    build_body,
    deploy,
    effort_limits,
    radio_of,
)
from coop_drake.diagram.robot_controller import (
    Replacements,
    build_robot_controller,
    hold_of,
    robot_knowledge,
    team_schedule,
)
from coop_drake.errors import ScenarioError
from coop_drake.harmonic_maps import HarmonicMap
from coop_drake.laws.actuators import Brake, braking_damping
from coop_drake.plant import SeparateTeam, TeamPlant, build_separate_team, build_team_plant, set_configuration
from coop_drake.plant.team import base_inertia, displacement
from coop_drake.scenario import Hold, Scenario
from coop_drake.systems import (
    CellPlanner,
    Exchange,
    HoldSupervisor,
    TeamLink,
    TeamSensor,
    WordPlanner,
    build_selector,
    build_separate_sensor,
    robot_record,
    supervisor_record,
)
from coop_drake.systems.block import release_all
from coop_drake.systems.forces import add_departures, tilt_floor
from coop_drake.tree.arrays import FloatArray, IntArray

# The transport station: the simulated team with sensors, actuators and disturbances.


@dataclass(frozen=True)
class TransportStation:
    """The station and the team inside it.

    Attributes:
        diagram: The station.
        team: Its plant, with names for the parts.
    """

    diagram: Diagram
    team: TeamPlant


def build_station(scenario: Scenario) -> TransportStation:
    """Build the team's plant as in the scenario, with an actuation and a state port for each robot.

    ======= =========================== ========== =========================================================
    input   ``robot_<k>_effort``        3 + n_k    base wrench and joint torques of robot k
    output  ``object_pose``             3          pose of L in W
    output  ``robot_<k>_state``         2(3+n_k)   z_k and its rate
    output  ``generalized_acceleration``  3+n      the plant's accelerations, for the log alone; 3 more for
                                                   each base where robots are trees of their own
    output  ``query_object``            abstract   geometry, for visualization
    ======= =========================== ========== =========================================================

    Raises:
        ScenarioError: The models do not make a team.
    """
    builder = DiagramBuilder()
    team = (build_team_plant if scenario.plant.ideal else build_separate_team)(scenario, builder)
    plant = team.plant
    tilt_floor(team, scenario.deployment.floor)
    states = _measure(builder, team)
    _drive_robots(builder, team, states)
    builder.ExportOutput(plant.get_generalized_acceleration_output_port(), "generalized_acceleration")
    builder.ExportOutput(team.scene_graph.get_query_output_port(), "query_object")
    return TransportStation(builder.Build(), team)


def _measure(builder: DiagramBuilder, team: TeamPlant) -> list[OutputPort]:
    """Add the sensors of the object's pose and of every robot's own state; return the latter."""
    names = ["object_pose", *(f"robot_{robot.index}_state" for robot in team.robots)]
    if isinstance(team, SeparateTeam):
        sensor = parts = builder.AddNamedSystem("team_sensor", build_separate_sensor(team))
    else:
        sensor = builder.AddNamedSystem("team_sensor", TeamSensor(team))
        parts = builder.AddNamedSystem("measurements", Demultiplexer(sensor.sizes))
        builder.Connect(sensor.get_output_port(), parts.get_input_port())
    builder.Connect(team.plant.get_state_output_port(), sensor.GetInputPort("team_state"))
    for i, name in enumerate(names):
        builder.ExportOutput(parts.get_output_port(i), name)
    return [parts.get_output_port(i) for i in range(1, len(names))]


def _drive_robots(builder: DiagramBuilder, team: TeamPlant, states: Sequence[OutputPort]) -> None:
    """Add inputs for the effort of every robot: wrenches in W on the bases, torques on the joints."""
    plant, efforts = team.plant, builder.AddNamedSystem("efforts", _efforts(team))
    for i in range(efforts.num_input_ports()):
        builder.ExportInput(efforts.get_input_port(i), efforts.get_input_port(i).get_name())
    torques = efforts.GetOutputPort("joint_torques")
    wrenches = add_departures(builder, team, states, efforts.GetOutputPort("base_wrenches"), torques)
    thrusters = _add_thrusters(builder, team, with_object=wrenches.size() > 3 * len(team.robots))
    # Thrusters push along the axes of the poses that they receive. These are the identity, so that they push
    # along the axes of W, however the bases turn.
    axes = AbstractValue.Make([RigidTransform()] * plant.num_bodies())
    world = builder.AddNamedSystem("world_axes", ConstantValueSource(axes))
    builder.Connect(world.get_output_port(), thrusters.get_body_poses_input_port())
    builder.Connect(wrenches, thrusters.get_command_input_port())
    if team.joints:
        builder.Connect(torques, plant.get_actuation_input_port())


def _efforts(team: TeamPlant) -> Selector:
    """Build the block that sorts the efforts of all robots into wrenches on bases and torques of joints."""
    sizes = [3 + len(robot.joints) for robot in team.robots]
    return build_selector(
        {f"robot_{robot.index}_effort": size for robot, size in zip(team.robots, sizes, strict=True)},
        {
            "base_wrenches": [(k, i) for k in range(len(sizes)) for i in range(3)],
            "joint_torques": [(k, i) for k, size in enumerate(sizes) for i in range(3, size)],
        },
    )


def _add_thrusters(builder: DiagramBuilder, team: TeamPlant, *, with_object: bool) -> Propeller:
    """Add Drake's Propeller for the wrenches on bases: thrusts along x and y, a moment about z.

    A base wrench given as a generalized force would move the team in the same way, but the reaction at the
    grasp could then not be read from the plant. The object may have three thrusters at L of its own, behind
    those of the bases.
    """
    places = [(robot.base_body.index(), np.zeros(3)) for robot in team.robots]
    if with_object:
        X_BL = team.object_frame.GetFixedPoseInBodyFrame()
        places.append((team.object_body.index(), X_BL.translation()))
    thrusters = [
        PropellerInfo(body, RigidTransform(R_BP, p_BP), thrust, moment)
        for body, p_BP in places
        for R_BP, thrust, moment in (
            (RotationMatrix.MakeYRotation(0.5 * pi), 1.0, 0.0),
            (RotationMatrix.MakeXRotation(-0.5 * pi), 1.0, 0.0),
            (RotationMatrix(), 0.0, 1.0),
        )
    ]
    bases = builder.AddNamedSystem("base_thrusters", Propeller(thrusters))
    builder.Connect(bases.get_spatial_forces_output_port(), team.plant.get_applied_spatial_force_input_port())
    return bases


# What all loops of a simulated team have in common, and how their ports are read for the log.


class PortRow:
    """The values of many ports in one row.

    Args:
        root: Context of the whole diagram; every reading is of its present content.
    """

    def __init__(self, root: Context) -> None:
        self._root = root
        self._readers: list[Callable[[], FloatArray]] = []
        self._size = 0

    def add(self, system: System, output: str) -> IntArray:
        """Append an output and return its indices in the row."""
        first = self._size
        self._readers.append(
            partial(system.GetOutputPort(output).Eval, system.GetMyContextFromRoot(self._root))
        )
        self._size += system.GetOutputPort(output).size()
        return np.arange(first, self._size)

    def read(self) -> FloatArray:
        """The present values of all ports."""
        return np.concatenate([read() for read in self._readers])


class Outputs(NamedTuple):
    """Where in a row of ports the outputs stand of robots and supervisor, wherever these are computed.

    Attributes:
        robots: For every robot the places of its outputs, by their names in ``robot_record``.
        supervisor: The same for the supervisor, by the names in ``supervisor_record``.
        efforts: What the actuators of every robot give.
    """

    robots: Sequence[Mapping[str, IntArray]]
    supervisor: Mapping[str, IntArray]
    efforts: Sequence[IntArray]


@dataclass(frozen=True)
class Loop(ABC):
    """A simulated team with all that drives it.

    Attributes:
        diagram: The Diagram of everything.
        station: The simulated team.
        plan: The plan that is followed.
        start: Where the team stands at first, shape (3 + n,) [m, rad].
    """

    diagram: Diagram
    station: TransportStation
    plan: Plan
    start: FloatArray

    @property
    def team(self) -> TeamPlant:
        """The simulated team."""
        return self.station.team

    def create_context(self) -> Context:
        """Create a context of a team at rest."""
        context = self.diagram.CreateDefaultContext()
        team = self.team
        set_configuration(team, team.plant.GetMyMutableContextFromRoot(context), self.start)
        return context

    @abstractmethod
    def outputs(self, ports: PortRow) -> Outputs:
        """Add the outputs of robots and supervisor to a row, and return where they stand."""

    def release(self) -> None:
        """Free all memory after the last context is gone; no part of the loop may be used any more."""
        release_all(self.diagram)


# The station with cell planner, controllers and supervisor.


@dataclass(frozen=True)
class ClosedLoop(Loop):
    """The closed loop and its parts.

    Attributes:
        cell_planner: The supervisor.
        controllers: One sub-Diagram for each robot, as the others see it.
        deployed: Controllers with sensors, actuators and radio, empty where the team is ideal.
        supervisor: What holds the team, None where nothing can ask for it.
    """

    cell_planner: CellPlanner | WordPlanner
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
        names = robot_record(0, holds=True, monitored=True, passes=True)
        sources = [self.cell_planner, *([] if self.supervisor is None else [self.supervisor])]
        supervisor = {
            name: ports.add(source, name)
            for name in supervisor_record(0, holds=True)
            for source in sources
            if source.HasOutputPort(name)
        }
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
    """Build the closed loop; only words, or ready reports and requests for a hold, cross between robots.

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
    passes, period = team_schedule(scenario, plan), scenario.deployment.period
    planner: CellPlanner | WordPlanner
    if passes is None:
        planner = CellPlanner(len(team.robots), len(plan.cells), period=period)
    else:
        names = [robot.name for robot in team.robots]
        planner = WordPlanner(passes, radio_of(scenario.deployment, names, len(names)))
    builder.AddNamedSystem("cell_planner", planner)
    hold, supervisor = hold_of(scenario, plan), None
    if hold is not None:
        supervisor = add_supervisor(builder, hold, planner, len(team.robots), period)
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
    if passes is not None:
        _add_network(builder, [*built, planner], scenario.control.hold)
    return ClosedLoop(
        builder.Build(), station, plan, start, planner, tuple(built), tuple(deployed), supervisor
    )


def _connect(
    builder: DiagramBuilder,
    station: Diagram,
    planner: CellPlanner | WordPlanner,
    controller: Diagram,
    k: int,
) -> None:
    builder.Connect(station.GetOutputPort("object_pose"), controller.GetInputPort("object_pose"))
    builder.Connect(station.GetOutputPort(f"robot_{k}_state"), controller.GetInputPort("robot_state"))
    if isinstance(planner, CellPlanner):
        builder.Connect(planner.GetOutputPort("current_cell"), controller.GetInputPort("current_cell"))
        builder.Connect(controller.GetOutputPort("ready"), planner.GetInputPort(f"robot_{k}_ready"))
    builder.Connect(controller.GetOutputPort("robot_effort"), station.GetInputPort(f"robot_{k}_effort"))


def _add_network(builder: DiagramBuilder, speakers: Sequence[System], hold: Hold | None) -> None:
    """Let robots and the supervisor, the last one, hear what everybody sends."""
    network = builder.AddNamedSystem(
        "network", Multiplexer([one.GetOutputPort("said").size() for one in speakers])
    )
    for i, one in enumerate(speakers):
        builder.Connect(one.GetOutputPort("said"), network.get_input_port(i))
        builder.Connect(network.get_output_port(), one.GetInputPort("words"))
    add_order(builder, hold, speakers[-1])


def add_order(builder: DiagramBuilder, hold: Hold | None, supervisor: System) -> None:
    """Tell the supervisor when the scenario holds the team, if it does."""
    if hold is not None:
        order = builder.AddNamedSystem("hold_order", _order(hold))
        builder.Connect(order.get_output_port(0), supervisor.GetInputPort("order"))


def add_supervisor(
    builder: DiagramBuilder, hold: Hold, planner: System, robots: int, period: float | None
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
    add_order(builder, hold, supervisor)
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


# The world alone: the team with its sensors and actuators, without controllers and without a supervisor.


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

"""Drake's loop with the functions of the compiled loop as one block, to compare them with robots' own blocks.

The block stands for the controllers, sensors, messages and actuators of a whole sampled team.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from pydrake.systems.framework import BasicVector, Context, DiagramBuilder, DiscreteValues
from pydrake.systems.primitives import Demultiplexer

from coop_drake.answers.log import SimulationLog
from coop_drake.compiled_loop import CompiledTransport, arrays
from coop_drake.compiled_loop.loop import update
from coop_drake.compiled_loop.robots import compute, heard_cell
from coop_drake.compiled_loop.running import believed, departures_of, memory_of, nominal_of
from coop_drake.compiled_loop.watching import left_by_all
from coop_drake.diagram import closed_loop as stations
from coop_drake.jit import compiled
from coop_drake.laws import words
from coop_drake.laws.actuators import lag_behind
from coop_drake.laws.axis_table import bounds_of
from coop_drake.laws.measurements import period_of
from coop_drake.laws.motion import motion_at
from coop_drake.laws.robot_dynamics import read_robot
from coop_drake.plant import build_team_plant
from coop_drake.plant.team import displacement
from coop_drake.scenario import Deployment, Scenario
from coop_drake.simulation import run_loop
from coop_drake.systems import Block
from coop_drake.systems.block import ALARM_SIZE
from coop_drake.systems.departures import tilt_floor
from coop_drake.systems.holds import ASKED, BRAKED, SILENT, TOLD
from coop_drake.tree.arrays import FloatArray

SHOWN = 23
"""Numbers that a robot shows: pose of its base (3), p_G (2), Delta E, its report (2), what its monitor says
(3), its phase where the team passes (3), from ``WANTED`` on the object's desired acceleration (3) and the
command of the end effector (6)."""

POSE, GOVERNOR, MARGIN, READY, ALARM, PHASE, WANTED = 0, 3, 5, 6, 8, 11, 14
"""Where they stand."""


@compiled
def tell(
    cells: arrays.LoopCells, team: arrays.LoopTeam, nominal: arrays.LoopNominal,
    departures: arrays.LoopDepartures, room: arrays.RobotRoom, memory: arrays.LoopMemory, sample: int,
    number: int, now: float, instant: FloatArray, shown: FloatArray, bounds: FloatArray,
) -> None:  # fmt: skip
    """Write what the blocks of all robots and the cell planner would show now, before a sample's updates.

    ``memory`` is changed as by a sample, so that it must be a copy; ``number`` is that of the control period
    that ``now`` [s] is in. ``instant`` receives index of the cell, time of its entry [s], 1 where the team
    has arrived, and why it is held, (4 + N,); ``shown`` what ``SHOWN`` lists of every robot;
    ``bounds`` the lower and upper bounds of the funnels of all axes, (2, M) [rad or m].
    """
    current, robots = memory.current[sample % memory.current.shape[0]], team.yaws.size
    cell = int(current[0])
    arrived = cell + 1 == cells.rows.shape[0] and left_by_all(cell, memory.channels)
    passes, point = nominal.points.size > 0, np.empty((3, 3 + cells.slices.shape[2]))
    if passes:
        seen, who, known = int(memory.supervised[0]), int(memory.supervised[1]), memory.words[robots]
        arrived = seen == words.ARRIVED
        instant[3] = TOLD if seen == words.HELD else 0.0
        for k in range(robots):
            braked = known[k, words.HOLD] == -np.inf and known[k, words.EPOCH] == known[robots, words.EPOCH]
            instant[4 + k] = BRAKED if braked else 0.0
        if (
            seen in (words.DEPARTS, words.WAITS)
            and known[robots, words.STAMP] > 2.0 * nominal.schedule.window
        ):
            instant[4 + who] = ASKED if seen == words.DEPARTS else SILENT
    instant[0], instant[1], instant[2] = current[0], current[1], 1.0 if arrived else 0.0
    robot, governors = np.empty(memory.state.size), memory.governors.copy()
    compute(sample, number, now, True, cells, team, nominal, departures, room, memory)
    for k in range(robots):
        row, begin = shown[k], k + team.first[2, k]
        end = begin + 1 + team.first[2, k + 1] - team.first[2, k]
        heard, time = heard_cell(k, sample, now, departures.hearing, memory.current)
        joints = team.places[:, 3 + team.first[2, k] : 3 + team.first[2, k + 1]]
        base = team.base_chains[team.first[1, k] : team.first[1, k + 1]]
        read_robot(base, team.yaws[k], joints, room.motion, memory.state, robot)
        row[POSE : POSE + 3] = robot[:3]
        row[GOVERNOR : GOVERNOR + 2] = governors[k]
        row[MARGIN] = room.told[k, arrays.ENERGY]
        if passes:
            heard, clock = int(memory.reports[0, k, 0]), now + departures.hearing[0, k]
            row[PHASE], row[PHASE + 1], row[PHASE + 2] = words.phase_at(
                nominal.schedule, memory.motions[k], clock
            )
            motion_at(nominal.points, nominal.span, row[PHASE], row[PHASE + 1], row[PHASE + 2], point)
            row[GOVERNOR : GOVERNOR + 2] = point[0, :2]
        row[READY : READY + 2] = memory.reports[0, k]
        row[ALARM : ALARM + 3] = memory.alarms[k, :3]
        row[WANTED:] = room.told[k, arrays.ACCELERATION : arrays.COMMAND + 6]
        for i in range(begin, end):
            axis = team.first[2, k] + i - begin if i > begin else 0
            if passes:
                bounds[0, i], bounds[1, i] = cells.slices[0, heard, axis], cells.slices[1, heard, axis]
            else:
                bounds[0, i], bounds[1, i] = bounds_of(cells.tables[heard, i], time)[:2]


class SampledTeam(Block):
    """Computes at every sample what all robots, their sensors, messages and the cell planner compute.

    It calls the functions of the compiled loop, and so the laws that the robots' own blocks call; what it
    shows agrees with theirs to rounding. With M = N + n axes:

    ======= ============== ============== ============================================================ =====
    input   ``team_state`` 2 (3 + n)      the plant's positions and velocities, its own order
    output  ``efforts``    3 N + n        what the actuators of every robot give: its base wrench and  W
                                          its joint torques [N, N m]
    output  ``telemetry``  4 + 24 N + 2 M index of the cell, time of its entry [s], 1 where the team   W
                                          has arrived, why it is held (1 + N); what ``SHOWN`` lists of
                                          every robot; lower, then upper bounds of the funnels of all
                                          axes
    ======= ============== ============== ============================================================ =====

    State: one discrete group, updated every period: number of samples so far, time of the last one, then all
    fields of ``LoopMemory`` but the plant's state, one after the other.
    """

    def __init__(
        self, cells: arrays.LoopCells, team: arrays.LoopTeam, nominal: arrays.LoopNominal,
        departures: arrays.LoopDepartures, memory: arrays.LoopMemory,
    ) -> None:  # fmt: skip
        super().__init__()
        known, self._robots, self._axes = (
            (cells, team, nominal, departures),
            team.yaws.size,
            memory.jumps.size,
        )
        self._period, lag = float(departures.times[0]), float(departures.times[2])
        kept = memory._asdict()
        del kept["state"]
        ends = 2 + np.cumsum([part.size for part in kept.values()])
        self._parts = {
            name: (slice(int(end) - part.size, int(end)), part.shape)
            for (name, part), end in zip(kept.items(), ends, strict=True)
        }
        self._efforts = self._parts["efforts"][0]
        shown, bounds = np.empty((self._robots, SHOWN)), np.empty((2, self._axes))
        self._tell = partial(tell, *known, arrays.robot_room(team, memory))
        self._update = partial(update, *known, arrays.robot_room(team, memory))
        self._follow = partial(lag_behind, lag)
        self._state = self.DeclareVectorInputPort("team_state", memory.state.size)
        start = np.concatenate([[0.0, 0.0], *(part.ravel() for part in kept.values())])
        group = self.discrete_state_ticket(self.DeclareDiscreteState(start))
        timed = {group, self.time_ticket()} if lag > 0.0 else {group}
        self.DeclareVectorOutputPort("efforts", memory.efforts.shape[1], self._write_efforts, timed)
        size = 4 + self._robots + shown.size + bounds.size
        self.DeclareVectorOutputPort("telemetry", size, self._write_telemetry)
        self.declare_update(self._step, self._period)

    def _remembered(self, flat: FloatArray, team_state: FloatArray) -> arrays.LoopMemory:
        """Return the fields of ``LoopMemory`` as views of the state."""
        views = {name: flat[part].reshape(shape) for name, (part, shape) in self._parts.items()}
        return arrays.LoopMemory(state=team_state, **views)

    def _write_efforts(self, context: Context, output: BasicVector) -> None:
        flat = context.get_discrete_state_vector().value()
        held, before = flat[self._efforts].reshape(2, -1)
        self._follow(context.get_time() - float(flat[1]), held, before, output.get_mutable_value())

    def _write_telemetry(self, context: Context, output: BasicVector) -> None:
        flat, now = context.get_discrete_state_vector().value().copy(), context.get_time()
        first = 4 + self._robots
        told, begin = output.get_mutable_value(), first + self._robots * SHOWN
        self._tell(
            self._remembered(flat, self._state.Eval(context)),
            int(flat[0]),
            period_of(now, self._period),
            now,
            told[:first],
            told[first:begin].reshape(-1, SHOWN),
            told[begin:].reshape(2, -1),
        )

    def _step(self, context: Context, discrete_state: DiscreteValues) -> None:
        flat, now = discrete_state.get_mutable_vector().get_mutable_value(), context.get_time()
        memory = self._remembered(flat, self._state.Eval(context))
        held, before = memory.efforts
        self._follow(now - float(flat[1]), held, before, before)
        self._update(memory, int(flat[0]))
        flat[0], flat[1] = flat[0] + 1.0, now


@dataclass(frozen=True)
class SampledLoop(stations.Loop):
    """Drake's plant, and one block that computes what a sampled team computes."""

    controllers: SampledTeam

    def outputs(self, ports: stations.PortRow) -> stations.Outputs:
        """Add all outputs that are logged, and return where they stand."""
        joints = [len(robot.joints) for robot in self.team.robots]
        told, efforts = ports.add(self.controllers, "telemetry"), ports.add(self.controllers, "efforts")
        first, passes = 4 + len(joints), self.plan.motion is not None
        ends = first + SHOWN * len(joints)
        shown, bounds = told[first:ends].reshape(-1, SHOWN), told[ends:].reshape(2, -1)
        of_axes = np.split(bounds, np.cumsum([1 + n for n in joints])[:-1], axis=1)
        robots = [
            {
                "governor_position": own[GOVERNOR : GOVERNOR + 2],
                "energy_margin": own[MARGIN : MARGIN + 1],
                "funnels": funnels.ravel(),
                "object_acceleration": own[WANTED : WANTED + 3],
                "hand_command": own[SHOWN - 6 :],
                "ready": own[READY : READY + 2],
                "alarm": own[ALARM : ALARM + ALARM_SIZE],
                **({"phase": own[PHASE : PHASE + 3]} if passes else {}),
            }
            for own, funnels in zip(shown, of_axes, strict=True)
        ]
        supervisor = {"current_cell": told[:2], "arrived": told[2:3]}
        if passes:
            supervisor["causes"] = told[3:first]
        return stations.Outputs(
            robots, supervisor, np.split(efforts, np.cumsum([3 + n for n in joints])[:-1])
        )


def build_sampled_loop(transport: CompiledTransport, deployment: Deployment | None = None) -> SampledLoop:
    """Drake's loop of a transport with one block in place of sensors, controllers and messages."""
    deployment = transport.scenario.deployment if deployment is None else deployment
    departures = departures_of(transport, deployment)
    block = SampledTeam(
        transport.cells,
        believed(transport.team, deployment.mass_error),
        nominal_of(transport, deployment),
        departures,
        memory_of(transport, departures),
    )
    builder = DiagramBuilder()
    station = _driven_station(replace(transport.scenario, deployment=deployment))
    diagram, robots = station.diagram, station.team.robots
    builder.AddNamedSystem("transport_station", diagram)
    builder.AddNamedSystem("sampled_team", block)
    parts = builder.AddNamedSystem("efforts", Demultiplexer([3 + len(robot.joints) for robot in robots]))
    builder.Connect(diagram.GetOutputPort("team_state"), block.GetInputPort("team_state"))
    builder.Connect(block.GetOutputPort("efforts"), parts.get_input_port())
    for k in range(len(robots)):
        builder.Connect(parts.get_output_port(k), diagram.GetInputPort(f"robot_{k}_effort"))
    start = transport.plan.start + displacement(deployment, len(transport.plan.start))
    return SampledLoop(builder.Build(), station, transport.plan, start, block)


def simulate_sampled(transport: CompiledTransport, deployment: Deployment | None = None) -> SimulationLog:
    """The log of that loop, which agrees with that of ``simulate`` to rounding."""
    deployment = transport.scenario.deployment if deployment is None else deployment
    loop = build_sampled_loop(transport, deployment)
    try:
        return run_loop(loop, replace(transport.scenario, deployment=deployment))
    finally:
        loop.release()


def _driven_station(scenario: Scenario) -> stations.TransportStation:
    """Build the ideal team's plant as a station that also shows the plant's state, for the block."""
    builder = DiagramBuilder()
    team = build_team_plant(scenario, builder)
    tilt_floor(team, scenario.deployment.floor)
    stations._drive_robots(builder, team, stations._measure(builder, team))
    builder.ExportOutput(team.plant.get_state_output_port(), "team_state")
    builder.ExportOutput(team.plant.get_generalized_acceleration_output_port(), "generalized_acceleration")
    builder.ExportOutput(team.scene_graph.get_query_output_port(), "query_object")
    return stations.TransportStation(builder.Build(), team)

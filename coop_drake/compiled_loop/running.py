"""Runs of the compiled loop: one transport, with departures of its own in each run."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf, nan, sqrt

import numpy as np

from coop_drake.compiled_loop import arrays, watching
from coop_drake.compiled_loop.loop import run_loop
from coop_drake.compiled_loop.preparing import NO_SCHEDULE, CompiledTransport
from coop_drake.diagram.deployment import (
    clock_shift,
    effort_limits,
    interval_of,
    measurement_deviations,
    measurement_waves,
    seed_of,
)
from coop_drake.diagram.robot_controller import team_schedule
from coop_drake.errors import ScenarioError
from coop_drake.laws.axis_table import first_jumps
from coop_drake.laws.measurements import NOTHING, channel_rows, whole_periods
from coop_drake.laws.readiness import departing_name, mean_samples
from coop_drake.laws.robot_dynamics import INERTIA, MASS
from coop_drake.laws.words import WORD_SIZE, first_motion, first_words
from coop_drake.plant.team import displacement
from coop_drake.scenario import Deployment
from coop_drake.systems.block import READY_SIZE
from coop_drake.systems.forces import world_departures
from coop_drake.systems.measurements import LONG_AGO
from coop_drake.tree.arrays import FloatArray, IntArray

_USES = 8
"""Number of uses of seeds, see ``seed_of``."""

_MOTORS = {"working": 0.0, "held": 1.0, "limp": 2.0}
_MASS, _INERTIA = 4, 5
"""Where mass and inertia of the object stand in a robot's load, see ``end_effector_command``."""


def check_deployment(transport: CompiledTransport, deployment: Deployment) -> float:
    """Return the control period of a run [s].

    Raises:
        ScenarioError: The compiled loop does not know what departs.
    """
    where = str(transport.scenario.path)
    if deployment.period is None:
        allowed = "a number of Hz: the compiled loop knows sampled teams alone"
        raise ScenarioError(where, "deployment.control_rate", None, allowed)
    for name in transport.robot_names:
        own, key = deployment.of_robot(name), f"deployment.robots.{name}"
        if own.sample_offset:
            allowed = "0: all robots of the compiled loop compute at the same instants"
            raise ScenarioError(where, f"{key}.sample_offset", own.sample_offset, allowed)
    return deployment.period


def departures_of(transport: CompiledTransport, deployment: Deployment) -> arrays.LoopDepartures:
    """Return what departs in a run.

    Raises:
        ScenarioError: The compiled loop does not know what departs.
    """
    period, names = check_deployment(transport, deployment), transport.robot_names
    m, messages = deployment.measurements, deployment.messages
    robots = [deployment.of_robot(name) for name in names]
    joints = np.diff(transport.team.first[2])
    sizes = [("object_pose", 3), *(("robot_state", 2 * (3 + int(n))) for n in joints)]
    errors = [
        np.c_[measurement_deviations(deployment, *port), measurement_waves(deployment, *port, period)]
        for port in sizes
    ]
    lateness = [*(own.switch_delay for own in robots), 0.0]
    shifts = [clock_shift(deployment, k) for k in range(len(names))]
    ahead = shifts if transport.plan.motion is not None else [0.0] * len(names)
    hearing = [[*(own.clock_error + shift for own, shift in zip(robots, ahead, strict=True)), 0.0]]
    hearing.append([whole_periods(late, period) for late in lateness])
    hearing.append([whole_periods(messages.delay + late, period) for late in lateness])
    hold = transport.scenario.control.hold
    pauses = [] if hold is None else [(at, at + hold.duration) for at in hold.at]
    return arrays.LoopDepartures(
        times=np.array([period, transport.scenario.simulator.max_time, deployment.actuators.lag]),
        periods=np.array([
            whole_periods(m.delay, period),
            max(whole_periods(m.late_by, period), 1),
            whole_periods(messages.delay, period),
        ]),
        seeds=np.array([[seed_of(deployment, k, use) for use in range(_USES)] for k in range(len(names))]),
        probabilities=np.array([m.loss, m.late, messages.loss, messages.repeat]),
        errors=np.concatenate(errors),
        biases=np.array([[own.pose_bias.x, own.pose_bias.y, own.pose_bias.theta] for own in robots]),
        odometry=np.array([1.0 + own.odometry_scale for own in robots]),
        shifts=np.array(shifts) / period,
        limits=np.concatenate([effort_limits(deployment, n) for n in joints]),
        hearing=np.array(hearing, dtype=float),
        silences=_silences(deployment, names),
        links=_links(transport, deployment),
        pauses=np.array(pauses, dtype=float).reshape(-1, 2),
        world=world_departures(deployment, names),
    )  # fmt: skip


def _links(transport: CompiledTransport, deployment: Deployment) -> IntArray:
    nodes = len(transport.robot_names) + 1
    links = np.zeros((nodes, nodes), dtype=np.int64)
    if transport.plan.motion is not None and deployment.messages.loss > 0.0:
        for node, sender in np.ndindex(links.shape):
            links[node, sender] = seed_of(deployment, node, _USES + sender)
    return links


def _silences(deployment: Deployment, names: tuple[str, ...]) -> FloatArray:
    rows = [(inf, inf, 0.0, inf, inf)] * (len(names) + 1)
    for k, name in enumerate(names):
        own = deployment.of_robot(name)
        motors = 0.0 if own.silence is None else _MOTORS[own.silence.motors]
        rows[k] = (*interval_of(own.silence), motors, *interval_of(own.deaf))
    return np.array(rows).T.copy()


def believed(team: arrays.LoopTeam, mass_error: float) -> arrays.LoopTeam:
    """Return the robots' models as they believe them to be: all masses and inertias wrong by a factor."""
    factor, chains, loads = 1.0 + mass_error, team.chains.copy(), team.loads.copy()
    chains[:, [MASS, INERTIA]] *= factor
    loads[:, [_MASS, _INERTIA]] *= factor
    return team._replace(chains=chains, loads=loads)


def nominal_of(transport: CompiledTransport, deployment: Deployment) -> arrays.LoopNominal:
    """Return the nominal motions of a run.

    Raises:
        ScenarioError: Words of a team that passes travel for longer than its plan has time for.
    """
    period, nominal = check_deployment(transport, deployment), transport.nominal
    budget = transport.plan.budget
    schedule = team_schedule(replace(transport.scenario, deployment=deployment), transport.plan)
    if schedule is not None:
        lag = deployment.actuators.lag if budget is None else budget.lag
        return nominal._replace(schedule=schedule, ahead=0.5 * period + lag)
    return nominal


def memory_of(transport: CompiledTransport, departures: arrays.LoopDepartures) -> arrays.LoopMemory:
    """Return the state of a run at its start: at rest, with nothing measured and nothing heard."""
    robots, M = len(transport.robot_names), len(transport.first_axes)
    states, efforts = 2 * (2 * robots + M), 2 * robots + M
    ring, rows = int(departures.periods[0]) + 2, int(departures.periods[1])
    start, widest = transport.plan.start, int(2 * (3 + np.diff(transport.team.first[2]).max()))
    channels = channel_rows(int(departures.periods[2]))
    passing = robots if transport.plan.motion is not None else 0
    nodes, oldest = passing + (passing > 0), int(departures.hearing[2].max()) + 2
    return arrays.LoopMemory(
        state=transport.start.copy(),
        current=np.zeros((int(departures.hearing[1].max()) + ring, 2)),
        poses=np.zeros((ring, robots, 3)),
        states=np.zeros((ring, states)),
        exact=np.zeros((2, 3 * robots + states)),
        lines=np.zeros((robots, 2, rows, 1 + widest)),
        governors=np.tile(start[:2], (robots, 1)),
        jumps=first_jumps(transport.cells.tables[0], transport.first_axes),
        jumped=np.zeros(robots),
        recent=np.full((2 * mean_samples(float(departures.times[0])), efforts), inf),
        efforts=np.zeros((2, efforts)),
        channels=np.full((robots, channels, READY_SIZE), NOTHING),
        reports=np.full((2, robots, READY_SIZE), NOTHING),
        alarms=np.tile([0.0, 0.0, 0.0, LONG_AGO, 0.0], (robots, 1)),
        words=np.tile(first_words(NO_SCHEDULE, robots), (nodes, 1, 1)),
        said=np.full((oldest, nodes, WORD_SIZE), NOTHING),
        motions=np.tile(first_motion(), (passing, 1)),
        phases=np.zeros((ring, passing, 4)),
        supervised=np.zeros(4),
    )


# One run of the compiled loop.


@dataclass(frozen=True)
class RunOutcome:
    """What a run of the compiled loop leaves. Margins are the smallest ones at all samples.

    Attributes:
        arrived: Whether the object came to rest at the goal and nothing was violated.
        reason: Why it did not arrive; empty if it did.
        time: Duration of the transport [s].
        steps: Number of samples.
        cell: The cell at the end.
        funnel_margin: Distance of an axis to a bound of its funnel [rad or m].
        funnel_axis: The axis: ``angle`` or a joint's name.
        funnel_cell: The cell.
        cell_margin: Distance of the object's position to the boundary of its cell's region [m].
        wall_clearance: Distance of any body to any wall [m].
        body_clearance: Distance between bodies that must not touch [m].
        budget_share: Largest share used of what the plan's budget states: of the departures of position,
            velocity, axes and their rates from the nominal ones, or the least distance of an axis to its
            funnel's bounds over the one that it kept; NaN for a plan without a budget [-].
        alarm_share: Largest measured departure from the nominal motion over its level; NaN for a plan without
            a budget [-].
        spread: Largest distance of the nominal positions of two robots of a team that passes [m].
        held: How often such a team came to rest before the end of its motion.
        peak_force: Largest force of a base [N].
        peak_torque: Largest effort of a joint [N m or N]; NaN for a team without joints.
        peak_base_torque: Largest torque of a base [N m].
        force_rate: Largest change of a base's force from sample to sample, over the period [N/s].
        mean_force: Root mean square force over samples and bases [N].
        peak_turning: Largest mean angular acceleration of the object over a period [rad/s^2].
    """

    arrived: bool
    reason: str
    time: float
    steps: int
    cell: int
    funnel_margin: float
    funnel_axis: str
    funnel_cell: int
    cell_margin: float
    wall_clearance: float
    body_clearance: float
    budget_share: float
    alarm_share: float
    spread: float
    held: int
    peak_force: float
    peak_torque: float
    peak_base_torque: float
    force_rate: float
    mean_force: float
    peak_turning: float

    @property
    def clearance(self) -> float:
        """Smallest distance of any body to a wall, or to another body that it must not touch [m]."""
        return min(self.wall_clearance, self.body_clearance)


def run(
    transport: CompiledTransport, deployment: Deployment | None = None, *, seed: int | None = None
) -> RunOutcome:
    """Run a transport once.

    Args:
        transport: What ``prepare`` returned.
        deployment: The departures; None for those of the scenario that was prepared.
        seed: Seed of noise and losses; None for that of the deployment.

    Raises:
        ScenarioError: The compiled loop does not know what departs.
    """
    deployment = transport.scenario.deployment if deployment is None else deployment
    deployment = deployment if seed is None else replace(deployment, seed=seed)
    departures = departures_of(transport, deployment)
    period, memory = float(departures.times[0]), memory_of(transport, departures)
    memory.state[transport.order] += displacement(deployment, len(transport.order))
    team, plant, figures = (
        believed(transport.team, deployment.mass_error),
        transport.plant,
        watching.begin_figures(),
    )
    run_loop(
        transport.cells,
        team,
        plant,
        nominal_of(transport, deployment),
        departures,
        memory,
        arrays.robot_room(team, memory),
        arrays.plant_room(team, plant),
        arrays.watch_room(plant),
        figures,
    )
    return _outcome(transport, figures, period)


def _outcome(transport: CompiledTransport, figures: FloatArray, period: float) -> RunOutcome:
    axes = ("angle", *transport.plan.joint_names)
    arrived = figures[watching.ENDED] == watching.ARRIVED
    return RunOutcome(
        arrived=bool(arrived),
        reason="" if arrived else _reason(transport, figures, axes, period),
        time=float(figures[watching.SAMPLES] * period),
        steps=int(figures[watching.SAMPLES]),
        cell=int(figures[watching.CELL]),
        funnel_margin=float(figures[watching.FUNNEL]),
        funnel_axis=axes[int(figures[watching.FUNNEL_AXIS])],
        funnel_cell=int(figures[watching.FUNNEL_CELL]),
        cell_margin=float(figures[watching.REGION]),
        wall_clearance=float(figures[watching.WALL]),
        body_clearance=float(figures[watching.BODY]),
        budget_share=float(figures[watching.SHARE]),
        alarm_share=float(figures[watching.ALARM]),
        spread=float(figures[watching.SPREAD]),
        held=int(figures[watching.HOLDS]),
        peak_force=float(figures[watching.FORCE]),
        peak_torque=float(figures[watching.EFFORT]) if transport.plan.joint_names else nan,
        peak_base_torque=float(figures[watching.TORQUE]),
        force_rate=float(figures[watching.STEP]) / period,
        mean_force=sqrt(figures[watching.SQUARES] / (figures[watching.SAMPLES] + 1.0)),
        peak_turning=float(figures[watching.TURN]) / period,
    )


def _reason(transport: CompiledTransport, figures: FloatArray, axes: tuple[str, ...], period: float) -> str:
    """Return why a run ended, as the log of Drake's loop says it."""
    time, cell, value = (
        figures[watching.SAMPLES] * period,
        int(figures[watching.CELL]),
        figures[watching.VALUE],
    )
    if figures[watching.ENDED] == watching.BRAKED:
        k = int(figures[watching.ROBOT])
        robot, (first, last) = transport.robot_names[k], transport.team.first[2, k : k + 2].tolist()
        what = departing_name(int(figures[watching.PLACE]), axes[1 + first : 1 + last])
        said = f"{robot} lets the drives brake: {what} departs {value:.3g} times as far as its level allows"
        return f"at t = {time:.6g} s in cell {cell}: {said}, as {robot} measures it"
    axis = axes[int(figures[watching.PLACE])]
    text = {
        watching.ASTRAY: "the team says that it has arrived, "
        f"{value:.3g} times the tolerance away from the goal",
        watching.STALLED: f"stalled, {value:.6g} s after its entry",
        watching.LATE: "no arrival within max_time",
        watching.OUT_OF_FUNNEL: f"distance of {axis} to its funnel is {value:.3g} rad or m",
        watching.OUT_OF_SLICE: f"distance of {axis} to its slice is {value:.3g} rad or m",
        watching.OUT_OF_REGION: f"distance of the object to the boundary of cell {cell} is {value:.3g} m",
        watching.AT_WALL: f"clearance between a body and the walls is {value:.3g} m",
        watching.AT_BODY: f"clearance between two bodies is {value:.3g} m",
    }
    return f"at t = {time:.6g} s in cell {cell}: {text[int(figures[watching.ENDED])]}"

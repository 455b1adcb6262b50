"""Runs of the compiled loop: one, or many of one transport."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from math import nan, sqrt

from coop_drake.compiled_loop.departing import believed, departures_of, memory_of, nominal_of
from coop_drake.compiled_loop.looping import run_loop
from coop_drake.compiled_loop.preparing import CompiledTransport
from coop_drake.compiled_loop.watching import (
    ALARM,
    ARRIVED,
    ASTRAY,
    AT_BODY,
    AT_WALL,
    BODY,
    CELL,
    EFFORT,
    ENDED,
    FORCE,
    FUNNEL,
    FUNNEL_AXIS,
    FUNNEL_CELL,
    HELD,
    LATE,
    OUT_OF_FUNNEL,
    OUT_OF_REGION,
    OUT_OF_SLICE,
    PLACE,
    REGION,
    ROBOT,
    SAMPLES,
    SHARE,
    SQUARES,
    STALLED,
    STEP,
    TORQUE,
    TURN,
    VALUE,
    WALL,
)
from coop_drake.laws.departure import departing_name
from coop_drake.plant.configuration import displacement
from coop_drake.scenario import Deployment
from coop_drake.tree.pose import FloatArray


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
    figures = run_loop(
        transport.cells,
        believed(transport.team, deployment.mass_error),
        transport.plant,
        nominal_of(transport, period),
        departures,
        memory,
    )
    return _outcome(transport, figures, period)


def run_many(transport: CompiledTransport, deployments: Iterable[Deployment]) -> Iterator[RunOutcome]:
    """Run a transport once for each deployment, in their order; arguments and errors as for ``run``."""
    return (run(transport, deployment) for deployment in deployments)


def _outcome(transport: CompiledTransport, figures: FloatArray, period: float) -> RunOutcome:
    axes = ("angle", *transport.plan.joint_names)
    arrived = figures[ENDED] == ARRIVED
    return RunOutcome(
        arrived=bool(arrived),
        reason="" if arrived else _reason(transport, figures, axes, period),
        time=float(figures[SAMPLES] * period),
        steps=int(figures[SAMPLES]),
        cell=int(figures[CELL]),
        funnel_margin=float(figures[FUNNEL]),
        funnel_axis=axes[int(figures[FUNNEL_AXIS])],
        funnel_cell=int(figures[FUNNEL_CELL]),
        cell_margin=float(figures[REGION]),
        wall_clearance=float(figures[WALL]),
        body_clearance=float(figures[BODY]),
        budget_share=float(figures[SHARE]),
        alarm_share=float(figures[ALARM]),
        peak_force=float(figures[FORCE]),
        peak_torque=float(figures[EFFORT]) if transport.plan.joint_names else nan,
        peak_base_torque=float(figures[TORQUE]),
        force_rate=float(figures[STEP]) / period,
        mean_force=sqrt(figures[SQUARES] / (figures[SAMPLES] + 1.0)),
        peak_turning=float(figures[TURN]) / period,
    )


def _reason(transport: CompiledTransport, figures: FloatArray, axes: tuple[str, ...], period: float) -> str:
    """Return why a run ended, as the log of Drake's loop says it."""
    time, cell, value = figures[SAMPLES] * period, int(figures[CELL]), figures[VALUE]
    if figures[ENDED] == HELD:
        k = int(figures[ROBOT])
        robot, (first, last) = transport.robot_names[k], transport.team.first[2, k : k + 2].tolist()
        what = departing_name(int(figures[PLACE]), axes[1 + first : 1 + last])
        said = f"{robot} asks for a hold: {what} departs {value:.3g} times as far as its level allows"
        return f"at t = {time:.6g} s in cell {cell}: {said}, as {robot} measures it"
    axis = axes[int(figures[PLACE])]
    text = {
        ASTRAY: f"the team says that it has arrived, {value:.3g} times the tolerance away from the goal",
        STALLED: f"stalled, {value:.6g} s after its entry",
        LATE: "no arrival within max_time",
        OUT_OF_FUNNEL: f"distance of {axis} to its funnel is {value:.3g} rad or m",
        OUT_OF_SLICE: f"distance of {axis} to its slice is {value:.3g} rad or m",
        OUT_OF_REGION: f"distance of the object to the boundary of cell {cell} is {value:.3g} m",
        AT_WALL: f"clearance between a body and the walls is {value:.3g} m",
        AT_BODY: f"clearance between two bodies is {value:.3g} m",
    }
    return f"at t = {time:.6g} s in cell {cell}: {text[int(figures[ENDED])]}"

"""Estimates how long a transport takes, before its maps are solved and it is simulated."""

from __future__ import annotations

from dataclasses import replace
from math import isfinite

import numpy as np

from coop_drake.answers.plan import Plan
from coop_drake.geometry.boundary import edges_of
from coop_drake.laws import TransitionGains
from coop_drake.laws.axis_table import axis_table, first_jumps
from coop_drake.laws.governor import steady_clearance
from coop_drake.laws.hand_over import SPEED_LIMIT
from coop_drake.planning.execution.transport_kernels import cross_cell
from coop_drake.planning.travel_time import transition_time
from coop_drake.tree.pose import FloatArray

__all__ = [
    "estimated",
    "plan_time",
    "speed_per_clearance",
    "timed",
]

LONGEST = 120.0
"""A transition that takes longer is not integrated to its end [s]; such a plan is of no use."""


def speed_per_clearance(gains: TransitionGains) -> float:
    """Return the speed of the governed object in a long aisle over its clearance there, v / d [1/s]."""
    return 1.0 / steady_clearance(1.0, gains.stiffness, gains.damping, gains.governor_gain)


def plan_time(plan: Plan) -> float:
    """Return the estimated duration of the whole transport [s]."""
    return sum(transition.estimated_time for transition in plan.transitions)


def timed(plan: Plan) -> Plan:
    """Return the plan with the times of ``estimated``."""
    return estimated(plan)[0]


def estimated(plan: Plan) -> tuple[Plan, FloatArray, FloatArray]:
    """Estimate the time of every transition of a plan, and the largest speeds and accelerations.

    The closed loop is integrated from cell to cell: a point mass behind the governor (14)-(16) with the exact
    distance to the boundary of Q_i, a double integrator in its funnel for every axis, and the conditions of
    readiness. The state is kept from cell to cell, because object and axes do not stop at a switch. p_G
    follows the widest path instead of a harmonic map, which would have to be solved first.

    Args:
        plan: The plan; its present estimates are not read.

    Returns:
        The plan with estimates; ``transition_time`` where a transition is not left within two minutes. And
        the largest speed of the object, then those of the axes (theta, q...), shape (2 + n,) [m/s, rad/s];
        and the largest accelerations of the axes in every cell, shape (cells, 1 + n) [rad/s^2 or m/s^2].
    """
    crossings = [
        (
            np.ascontiguousarray(edges_of(plan.governed(index))),
            _governor_row(plan, index),
            axis_table(plan.funnel(index), transition.gains),
        )
        for index, transition in enumerate(plan.transitions)
    ]
    jumps = first_jumps(crossings[0][2], plan.start[2:])
    following = [*crossings[1:], crossings[-1]]
    state = _at_rest(plan.start[:2], plan.start[2:])
    m = len(plan.start) - 2
    transitions, speeds, accelerations = [], np.zeros(1 + m), np.zeros((len(crossings), m))
    for index, (transition, (edges, gains, table)) in enumerate(
        zip(plan.transitions, crossings, strict=True)
    ):
        last, peaks = index + 1 == len(crossings), np.zeros(1 + 2 * m)
        next_edges, next_gains, next_table = following[index]
        seconds = cross_cell(
            state, jumps, edges, transition.path, gains, table, transition.inradius,
            next_edges, next_gains, next_table, last, LONGEST, peaks,
        )  # fmt: skip
        speeds, accelerations[index] = np.maximum(speeds, peaks[: 1 + m]), peaks[1 + m :]
        if not isfinite(seconds):
            speed = speed_per_clearance(transition.gains)
            seconds = LONGEST + transition_time(transition.length, transition.neck, speed)
            state = _at_rest(transition.target, 0.5 * (transition.goal_lower + transition.goal_upper))
            jumps[:] = 0.0
        transitions.append(replace(transition, estimated_time=seconds))
    return replace(plan, transitions=tuple(transitions)), speeds, accelerations


def _governor_row(plan: Plan, index: int) -> FloatArray:
    """Return the governor's row; the largest speed of p_G counts as one of the object."""
    row = plan.governor_row(index)
    if plan.tube is not None:
        row[SPEED_LIMIT] = min(row[SPEED_LIMIT], plan.tube.speed)
    return row


def _at_rest(position: FloatArray, axes: FloatArray) -> FloatArray:
    """Return the state (p, p', p_G, axes, axis rates) at rest."""
    return np.concatenate([position, np.zeros(2), position, axes, np.zeros(len(axes))])

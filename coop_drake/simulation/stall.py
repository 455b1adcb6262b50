"""How long a transition is waited for, and which condition keeps a team from going on."""

from __future__ import annotations

from math import inf

import numpy as np

from coop_drake.answers.plan import Plan
from coop_drake.geometry.boundary import BoundaryDistance
from coop_drake.laws.arrival import ArrivalGoal
from coop_drake.laws.axis_table import ENERGY_BOUND, REST_RATE, axis_table, track_row
from coop_drake.laws.hand_over import governed_gains
from coop_drake.laws.readiness import (
    EROSION,
    axis_ready,
    clearance_margin,
    funnel_margin,
    interval_margin,
    position_arrival,
    rest_margin,
)
from coop_drake.simulation.telemetry import Sample
from coop_drake.systems.governor_kernels import cell_margin
from coop_drake.systems.hold_supervisor import ASKED, BRAKED, SILENT, TOLD
from coop_drake.tree.pose import FloatArray

PATIENCE_FACTOR = 10.0
"""A transition may take this many times its estimated time [-]: estimates are within a factor of two."""

PATIENCE_ALLOWANCE = 20.0
"""And this much longer [s], for transitions that are estimated at a fraction of a second."""


def patience(plan: Plan, cell: int) -> float:
    """Return the longest time that a transition is waited for [s]."""
    return PATIENCE_FACTOR * plan.transitions[cell].estimated_time + PATIENCE_ALLOWANCE


def blocking_margin(plan: Plan, sample: Sample, goal: ArrivalGoal) -> str:
    """Return the condition that is furthest from being met in the current cell, as a phrase with its margin.

    Args:
        plan: The plan.
        sample: The present instant.
        goal: The goal of the whole team; the tolerances count, no errors.
    """
    if sample.held:
        return f"the hold ends: {_causes_of(sample)}"
    last = sample.cell == len(plan.cells) - 1
    margins = _arrival(plan, sample, goal) if last else _readiness(plan, sample)
    if last and min(margins.values()) >= 0.0 > min(sample.ready_margins):
        k = int(np.argmin(sample.ready_margins))
        return f"robot {k} measures that the goal is reached (margin {sample.ready_margins[k]:.3g})"
    if min(margins.values()) >= 0.0:
        return "the cell planner receives the robots' reports; all robots are ready"
    name = min(margins, key=lambda key: margins[key])
    return f"{name} (margin {margins[name]:.3g})"


def _causes_of(sample: Sample) -> str:
    """Return why the team is held, as a phrase."""
    words = {
        TOLD: "it is told so",
        ASKED: "asks for it",
        SILENT: "is not heard",
        BRAKED: "lets the drives brake",
    }
    names = ["", *(f"robot {k} " for k in range(len(sample.causes) - 1))]
    found = [name + words[cause] for name, cause in zip(names, sample.causes, strict=True) if cause]
    return ", ".join(found)


def narrowest_funnel(plan: Plan, sample: Sample) -> str:
    """Return the axis that is nearest to a bound of its funnel, as a phrase with its margin and its rate."""
    axes = sample.z[2:]
    margins = np.minimum(axes - sample.funnel_lower, sample.funnel_upper - axes)
    i = int(np.argmin(margins))
    return f"{_axes(plan)[i]} (margin {margins[i]:.3g} rad or m, rate {sample.rates[2 + i]:.3g} per second)"


def _axes(plan: Plan) -> tuple[str, ...]:
    return ("the object's angle", *plan.joint_names)


def _intervals(plan: Plan, sample: Sample) -> dict[str, float]:
    transition = plan.transitions[sample.cell]
    return {
        f"{name} reaches its goal interval": interval_margin(position, lower, upper)
        for name, position, lower, upper in zip(
            _axes(plan), sample.z[2:], transition.goal_lower, transition.goal_upper, strict=True
        )
    }


def _readiness(plan: Plan, sample: Sample) -> dict[str, float]:
    following = sample.cell + 1
    gains = plan.transitions[following].gains
    stiffness = governed_gains(plan.governor_row(following), 0.0)[0]
    margin = cell_margin(
        BoundaryDistance(plan.governed(following)).edges,
        stiffness,
        np.concatenate([sample.z[:3], sample.rates[:3]]),
        sample.governor_position,
    )
    margins = _intervals(plan, sample) if plan.transitions[sample.cell].gains.rest is None else {}
    margins["the object's position is safe in the next cell (Delta E)"] = clearance_margin(
        margin, stiffness, plan.transitions[sample.cell].inradius
    )
    own = axis_table(plan.funnel(sample.cell), plan.transitions[sample.cell].gains)
    table = axis_table(plan.funnel(following), gains)
    for i, name in enumerate(_axes(plan)):
        if own[i, REST_RATE] > 0.0:
            margins[f"{name} rests in the middle of its goal interval"] = axis_ready(
                own[i], table[i], sample.z[2 + i], sample.rates[2 + i]
            )
            continue
        energy = track_row(table[i], 0.0, sample.z[2 + i], sample.rates[2 + i])[1]
        margins[f"the energy of {name} falls below the next funnel's bound"] = funnel_margin(
            energy, table[i, ENERGY_BOUND]
        )
    return margins


def off_goal(goal: ArrivalGoal, z: FloatArray) -> float:
    """Return how far object and joints are from the goal, over what is tolerated, whatever was measured.

    Args:
        goal: That of the whole team.
        z: Where they are, shape (3 + n,) [m, rad].
    """
    away = np.abs(z - goal.place)
    return float(max(np.hypot(*away[:2]) / goal.tolerances[0], *(away[2:] / goal.tolerances[1:])))


def _arrival(plan: Plan, sample: Sample, goal: ArrivalGoal) -> dict[str, float]:
    tolerance, axes = float(goal.tolerances[0]), zip(_axes(plan), sample.z[2:], goal.place[2:], strict=True)
    margins = {
        f"{name} reaches its goal": 1.0 - abs(position - place) / ((1.0 - EROSION) * room)
        for (name, position, place), room in zip(axes, goal.tolerances[1:], strict=True)
        if room < inf
    }
    distance = float(np.hypot(*(sample.z[:2] - goal.place[:2])))
    margins["the object reaches its goal position"] = position_arrival(distance, 0.0, tolerance)
    speed = float(np.hypot(*sample.rates[:2]))
    margins["the object and the joints come to rest"] = min(
        position_arrival(0.0, speed, tolerance), rest_margin(float(np.abs(sample.rates[2:]).max()))
    )
    return margins

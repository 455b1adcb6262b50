"""Notices that a run no longer gets anywhere, and says what it waits for."""

from __future__ import annotations

import numpy as np

from coop_drake.answers.plan import Plan
from coop_drake.geometry.boundary import BoundaryDistance
from coop_drake.laws.governor import energy_margin, tracking_energy
from coop_drake.laws.ready import arrival_margin, clearance_margin, funnel_margin, interval_margin
from coop_drake.simulation.telemetry import Sample
from coop_drake.systems import axis_laws
from coop_drake.tree.pose import FloatArray

__all__ = ["blocking_margin", "narrowest_funnel", "patience"]

#: A transition may take this many times its estimate ...
PATIENCE_FACTOR = 10.0
#: ... and this much more [s].
PATIENCE_ALLOWANCE = 20.0


def patience(plan: Plan, cell: int) -> float:
    """Longest time that a transition is waited for [s]."""
    return PATIENCE_FACTOR * plan.transitions[cell].estimated_time + PATIENCE_ALLOWANCE


def blocking_margin(plan: Plan, sample: Sample, position_tolerance: float) -> str:
    """The condition that keeps the team longest in its current cell, as a phrase with its margin.

    Args:
        plan: The plan.
        sample: The present instant.
        position_tolerance: How close to the goal counts as arrived [m].
    """
    last = sample.cell == len(plan.cells) - 1
    margins = _arrival(plan, sample, position_tolerance) if last else _readiness(plan, sample)
    if min(margins.values()) >= 0.0:
        return "the cell planner hears that every robot is ready"
    name = min(margins, key=lambda key: margins[key])
    return f"{name} (margin {margins[name]:.3g})"


def narrowest_funnel(plan: Plan, sample: Sample) -> str:
    """The axis that is nearest to a wall of its funnel, as a phrase with its margin and its rate.

    Args:
        plan: The plan.
        sample: The present instant.
    """
    axes = sample.z[2:]
    margins = np.minimum(axes - sample.funnel_lower, sample.funnel_upper - axes)
    i = int(np.argmin(margins))
    return f"{_axes(plan)[i]} (margin {margins[i]:.3g} rad or m, rate {sample.rates[2 + i]:.3g} per second)"


def _axes(plan: Plan) -> tuple[str, ...]:
    return ("the object's angle", *plan.joint_names)


def _intervals(plan: Plan, sample: Sample) -> dict[str, float]:
    transition = plan.transitions[sample.cell]
    return {
        f"{name} reaches its goal interval": interval_margin(
            sample.z[2 + i : 3 + i], transition.goal_lower[i : i + 1], transition.goal_upper[i : i + 1]
        )
        for i, name in enumerate(_axes(plan))
    }


def _readiness(plan: Plan, sample: Sample) -> dict[str, float]:
    cell, stiffness = plan.cells[sample.cell + 1], plan.transitions[sample.cell + 1].gains.stiffness
    clearance = BoundaryDistance(cell.tidied)(sample.governor_position)
    energy = tracking_energy(sample.z[:2], sample.rates[:2], sample.governor_position, stiffness=stiffness)
    margins = _intervals(plan, sample)
    margins["the object's position is safe in the next cell (Delta E)"] = clearance_margin(
        energy_margin(energy, clearance, stiffness=stiffness),
        stiffness=stiffness,
        inradius=plan.transitions[sample.cell].inradius,
    )
    for i, name in enumerate(_axes(plan)):
        law = axis_laws(plan, [i])[sample.cell + 1]
        margins[f"the energy of {name} falls below the next funnel's bound"] = funnel_margin(
            sample.z[2 + i : 3 + i], sample.rates[2 + i : 3 + i], funnel=law.funnel, gains=law.gains
        )
    return margins


def _arrival(plan: Plan, sample: Sample, position_tolerance: float) -> dict[str, float]:
    margins = _intervals(plan, sample)
    transition = plan.transitions[sample.cell]

    def judge(position: FloatArray, rates: FloatArray) -> float:
        return arrival_margin(
            position=position,
            velocity=rates[:2],
            target=plan.goal_pose[:2],
            axis_position=0.5 * (transition.goal_lower + transition.goal_upper),
            axis_rate=rates[2:],
            goal_lower=transition.goal_lower,
            goal_upper=transition.goal_upper,
            position_tolerance=position_tolerance,
        )

    margins["the object reaches its goal position"] = judge(sample.z[:2], np.zeros_like(sample.rates))
    margins["the object and the joints come to rest"] = judge(plan.goal_pose[:2], sample.rates)
    return margins

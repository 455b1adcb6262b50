"""Numbers that say how a plan and a run went, by the names machines read."""

from __future__ import annotations

from collections.abc import Sequence
from math import pi, remainder
from typing import TYPE_CHECKING, Any

import numpy as np

from coop_drake.answers import Found, Infeasible, Plan, PlanningResult

if TYPE_CHECKING:
    from coop_drake.fields import HarmonicMap
    from coop_drake.simulation import SimulationLog

__all__ = ["answer_of", "map_measures", "plan_measures", "planning_measures", "simulation_measures"]


def answer_of(result: PlanningResult) -> str:
    """Return ``found``, ``infeasible`` or ``undecided``."""
    if isinstance(result, Found):
        return "found"
    return "infeasible" if isinstance(result, Infeasible) else "undecided"


def planning_measures(result: PlanningResult) -> dict[str, Any]:
    """Return what the planner answered and what it took."""
    report = result.report
    facts: dict[str, Any] = {"answer": answer_of(result), "cells": 0, "slices": report.slices}
    first = report.first_plan_cpu_seconds
    facts["first_plan_cpu_seconds"] = None if first is None else round(first, 4)
    if isinstance(result, Found):
        facts.update(plan_measures(result.plan))
    else:
        facts["reason"] = result.reason
    return facts


def plan_measures(plan: Plan) -> dict[str, Any]:
    """Return the size of a plan and what it promises."""
    return {
        "cells": len(plan.cells),
        "margin_m": plan.margin,
        "narrowest_neck_m": min(transition.neck for transition in plan.transitions),
        "estimated_seconds": sum(transition.estimated_time for transition in plan.transitions),
        "gains": plan.gain_set,
    }


def map_measures(maps: Sequence[HarmonicMap]) -> dict[str, Any]:
    """Return how well the maps are certified."""
    certificates = [harmonic_map.certificate for harmonic_map in maps]
    return {
        "maps": len(maps),
        "max_map_residual": max(certificate.residual for certificate in certificates),
        "max_map_error_bound": max(certificate.error_bound for certificate in certificates),
        "max_map_unknowns": max(certificate.unknowns for certificate in certificates),
        "max_map_condition": max(certificate.condition for certificate in certificates),
    }


def simulation_measures(plan: Plan, log: SimulationLog) -> dict[str, Any]:
    """Return how the run went: errors at its end, smallest margins and peaks over all accepted steps."""
    x, y, theta = log.object_pose[-1] - plan.goal_pose
    from coop_drake.simulation import communication  # here, for it brings Drake, which planning does without

    ledger = communication(log)
    base_forces = np.hypot(log.base_wrenches[..., 0], log.base_wrenches[..., 1])
    return {
        "reached": log.reached,
        "violations": int(bool(log.violation)),
        "violation": log.violation,
        "simulated_seconds": float(log.times[-1]),
        "accepted_steps": len(log.times),
        "final_position_error_m": float(np.hypot(x, y)),
        "final_angle_error_rad": abs(remainder(float(theta), 2 * pi)),
        "min_clearance_m": float(min(log.workspace_clearance.min(), log.body_clearance.min())),
        "min_workspace_clearance_m": float(log.workspace_clearance.min()),
        "min_body_clearance_m": float(log.body_clearance.min()),
        "min_cell_clearance_m": float(log.cell_clearance.min()),
        "min_funnel_margin": float(log.funnel_margin.min()),
        "min_slice_margin": float(log.slice_margin.min()),
        "min_delta_e": float(log.energy_margin.min()),
        "max_acceleration_error": float(log.acceleration_error.max()),
        "max_wrench_error_n": float(log.wrench_error.max()),
        "max_grasp_error_m": float(log.grasp_error.max()),
        "max_governor_spread_m": float(log.governor_spread.max()),
        "messages": ledger.messages,
        "message_bytes": ledger.message_bytes,
        "peak_base_wrench_n": float(base_forces.max()),
        "peak_base_torque_nm": float(np.abs(log.base_wrenches[..., 2]).max()),
        "peak_joint_torque_nm": float(np.abs(log.joint_torques).max(initial=0.0)),
        "peak_speed_m_s": float(np.hypot(log.object_twist[:, 0], log.object_twist[:, 1]).max()),
    }

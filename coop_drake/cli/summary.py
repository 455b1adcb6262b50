"""The closing table of a command, and the facts about a plan, its maps and its run that it shows.

``--json`` gives machines all facts; the table shows people those that `_ROWS` lists, with ``--verbose`` more.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from math import inf, pi, remainder
from string import Formatter
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from coop_drake.answers import Plan, PlanningProblem, PlanningResult
    from coop_drake.answers.log import SimulationLog
    from coop_drake.harmonic_maps import HarmonicMap

_ROWS = (
    ("answer", "{answer}"),
    ("transport", "{outcome}"),
    ("cells", "{cells}"),
    ("planning took", "{planning_wall_seconds:.2f} s"),
    ("estimated transport", "{estimated_seconds:.1f} s"),
    ("its budget holds for", "{budget_holds_for}"),
    ("simulated transport", "{simulated_seconds:.2f} s, estimated {estimated_seconds:.1f} s"),
    ("smallest clearance to walls", "{min_workspace_clearance_m:.4f} m"),
    ("smallest clearance between bodies", "{min_body_clearance_m:.4f} m"),
    ("peak speed of the object", "{peak_speed_m_s:.2f} m/s"),
    ("peak base force", "{peak_base_wrench_n:.1f} N"),
    (
        "nearest to a limit of force",
        "{force_of}, {force_n:.1f} N, limit {force_limit_n:.1f} ({force_by})",
    ),
    ("nearest to a limit of motion", "{nearest_to_a_limit}"),
    ("error at the end", "{final_position_error_m:.4f} m, {final_angle_error_rad:.4f} rad"),
    ("used of the plan's budget", "{budget_used:.0%}: {budget_used_by} at {budget_used_at:.2f} s"),
)
"""Label and format, with the names of its facts, of every row of the closing table, in its order. A row has a
place where all its facts are known."""

_UNTIL_RUN = ("answer", "planning took", "estimated transport")
"""Rows that make room for those of a simulation, but for ``--verbose``."""

_MORE_ROWS = (
    ("departure of the object under its budget", "{tube_radius_m:.4f} m at most"),
    ("base force under it", "{budget_base_force_n:.1f} N at most"),
    ("slices made", "{slices}"),
    ("smallest path clearance in a cell", "{narrowest_neck_m:.3f} m"),
    ("gains", "{gains}"),
    ("first plan certified after", "{first_plan_cpu_seconds:.2f} s"),
    ("mapping took", "{mapping_wall_seconds:.2f} s"),
    ("maps read from the cache", "{maps_read}"),
    ("largest map residual", "{max_map_residual:.1e}"),
    ("unknowns of the largest map", "{max_map_unknowns}"),
    ("simulating took", "{simulation_wall_seconds:.2f} s"),
    ("smallest energy margin", "{min_delta_e:.2e} m²/s²"),
    ("smallest funnel margin", "{min_funnel_margin:.4f} rad"),
    ("largest acceleration error", "{max_acceleration_error:.1e} m/s²"),
    ("largest wrench error", "{max_wrench_error_n:.1e} N"),
    ("largest grasp error", "{max_grasp_error_m:.1e} m"),
    ("messages in the team", "{messages}"),
    ("peak rate of base forces", "{peak_base_force_rate_n_s:.0f} N/s"),
    ("peak joint torque", "{peak_joint_torque_nm:.1f} N m"),
    ("near stops between start and goal", "{near_stops}"),
    ("time below a quarter of the mean speed", "{slow_seconds:.2f} s"),
    ("peak memory", "{peak_memory_mb:.0f} MB"),
)
"""Rows that ``--verbose`` adds."""


def summary_rows(facts: Mapping[str, Any], *, verbose: bool = False) -> list[tuple[str, str]]:
    """Return label and value of every row whose facts are known; of more rows if ``verbose``.

    Clearances between bodies that are never compared are infinite: they have no row.
    """
    known = {key: value for key, value in facts.items() if value not in (None, inf)}
    speeds = facts.get("peak_speeds", ())
    limited = [speed for speed in speeds if speed["limit"]]
    if limited:
        nearest = max(limited, key=lambda speed: speed["peak"] / speed["limit"])
        known["nearest_to_a_limit"] = f"{nearest['name']}, {_beside_limit(nearest)}"
    rows = [
        (label, form.format_map(known))
        for label, form in (*_ROWS, *_MORE_ROWS)[: None if verbose else len(_ROWS)]
        if known.keys() >= {field for _, field, _, _ in Formatter().parse(form) if field}
        and (verbose or "outcome" not in known or label not in _UNTIL_RUN)
    ]
    every = [(f"peak {speed['name']}", _beside_limit(speed)) for speed in speeds if verbose]
    return rows + every


def _beside_limit(speed: Mapping[str, Any]) -> str:
    limit = "no limit known" if speed["limit"] is None else f"limit {speed['limit']:g}"
    return f"{speed['peak']:.2f} {speed['unit']}, {limit}"


def beyond_limits(facts: Mapping[str, Any]) -> str:
    """Return which limit a run exceeded most, and how many others, in a sentence; empty for none."""
    over = [one for one in facts["peak_speeds"] if one["limit"] and one["peak"] > one["limit"]]
    if not over:
        return ""
    most = max(over, key=lambda one: one["peak"] / one["limit"])
    others = f", and {len(over) - 1} other{'s' * (len(over) > 2)}, see --verbose" if len(over) > 1 else ""
    said = f"{most['name']}, {most['peak']:.6g} {most['unit']}, limit {most['limit']:g}"
    return f"A limit was exceeded: {said}{others}"


def process_lines(facts: Mapping[str, Any]) -> list[str]:
    """Return a line for each process of a run apart, and one for the ages of its commands."""
    lines = [
        f"{process['name']}: {process['state']}, {process['team_messages']} messages sent to the team, "
        f"{process['refused']} refused"
        for process in facts.get("processes", ())
    ]
    for name, count in facts.get("restarts", {}).items():
        lines.append(f"{name}: started again {'once' if count == 1 else f'{count} times'}")
    lines += map(_stop_line, facts.get("stops", ()))
    if refused := sum(facts.get("refused", {}).values()):
        lines.append(f"the world: {refused} messages refused")
    if ages := facts.get("command_ages"):
        times = [1e3 * ages[key] for key in ("median", "high", "largest", "allowed")]
        lines.append(
            "Ages of commands: median {:.1f} ms, 99.9 % below {:.1f} ms, largest {:.1f} ms; "
            "allowed {:.1f} ms, exceeded by {} of {}".format(*times, ages["late"], ages["count"])
        )
        lines.append(f"The wall clock was {ages['slipped']:.2f} s ahead of the simulated time at the end")
    return lines


def _stop_line(stop: Mapping[str, Any]) -> str:
    """Return what happened in one time in which all drives braked."""
    line = f"All drives braked from t = {stop['since']:.2f} s on because of {stop['cause']}"
    if stop["rested"] is not None:
        line += f"; the team rested {stop['rested'] - stop['since']:.2f} s later"
    if stop["resumed"] is not None:
        line += f", and went on at t = {stop['resumed']:.2f} s"
        if stop["returned"]:
            line += ", first slowly to its cell on a way that no plan has proved free"
    return line


def answer_of(result: PlanningResult) -> str:
    """Return ``found``, ``beyond limits``, ``infeasible`` or ``undecided``."""
    return {"BeyondLimits": "beyond limits"}.get(type(result).__name__, type(result).__name__.lower())


def planning_facts(result: PlanningResult) -> dict[str, Any]:
    """Return what the planner answered and what it took."""
    from coop_drake.answers import BeyondLimits, Found

    report = result.report
    facts: dict[str, Any] = {"answer": answer_of(result), "cells": 0, "slices": report.slices}
    first = report.first_plan_cpu_seconds
    facts["first_plan_cpu_seconds"] = None if first is None else round(first, 4)
    facts["improvements"] = [[round(seconds, 4), estimate] for seconds, estimate in report.improvements]
    if isinstance(result, Found | BeyondLimits):
        facts.update(plan_facts(result.plan))
    if isinstance(result, BeyondLimits):
        facts["refused_by"] = [asdict(refusal) for refusal in result.plan.refused_by]
    if not isinstance(result, Found):
        facts["reason"] = result.reason
    return facts


def plan_facts(plan: Plan) -> dict[str, Any]:
    """Return the size of a plan and what it promises."""
    budgeted: dict[str, Any] = {}
    if plan.budget is not None and plan.departures is not None:
        covered = "position, angles and joints" if plan.budget.axes else "the position, not angles and joints"
        budgeted = {"budget_holds_for": covered, "tube_radius_m": float(plan.departures.position[0])}
        if plan.budget.base_force is not None:
            budgeted["budget_base_force_n"] = float(plan.departures.effort[: plan.budget.robots].max())
    return {
        **budgeted,
        "cells": len(plan.cells),
        "narrowest_neck_m": min(transition.neck for transition in plan.transitions),
        "estimated_seconds": plan.motion.run_time
        if plan.motion
        else sum(transition.estimated_time for transition in plan.transitions),
        "gains": None if plan.motion else plan.gain_set,
    }


def map_facts(maps: Sequence[HarmonicMap]) -> dict[str, Any]:
    """Return how accurate the maps are."""
    accuracies = [harmonic_map.accuracy for harmonic_map in maps]
    return {
        "maps": len(maps),
        "max_map_residual": max(accuracy.residual for accuracy in accuracies),
        "max_map_error_estimate": max(accuracy.error_estimate for accuracy in accuracies),
        "max_map_unknowns": max(accuracy.unknowns for accuracy in accuracies),
        "max_map_condition": max(accuracy.condition for accuracy in accuracies),
    }


def budget_facts(plan: Plan, log: SimulationLog, until: float = inf) -> dict[str, Any]:
    """Return how much of a plan's budget a run used until some time [s], nothing without one."""
    from coop_drake.verification.runs import Rows, largest_departure

    largest = largest_departure(Rows(log, plan), until)
    if largest is None:
        return {}
    return {
        "budget_used": largest.share,
        "budget_used_by": largest.what,
        "budget_used_at": largest.time,
    }


def beyond_budget(facts: Mapping[str, Any]) -> str:
    """Return in a sentence which stated departure a run exceeded, empty if none."""
    if not facts.get("budget_used", 0.0) > 1.0:
        return ""
    return (
        "{budget_used_by} departed by {budget_used:.2f} times what the plan's budget states, at t = "
        "{budget_used_at:.6g} s"
    ).format_map(facts)


def _force_facts(log: SimulationLog, problem: PlanningProblem) -> dict[str, Any]:
    """Return which base came nearest to its limit of force, and what sets this limit."""
    import numpy as np

    from coop_drake.planning.motion_limits import largest_forces

    most, limits = largest_forces(problem.limits), problem.limits
    peaks = np.hypot(log.base_wrenches[..., 0], log.base_wrenches[..., 1]).max(axis=0)
    k = int(np.argmax(peaks / most))
    by_drives = bool(most[k] == limits.base_forces[k])
    return {
        "force_of": log.robot_names[k],
        "force_n": float(peaks[k]),
        "force_limit_n": float(most[k]),
        "force_by": "base_force" if by_drives else "friction",
    }


def simulation_facts(plan: Plan, log: SimulationLog, problem: PlanningProblem) -> dict[str, Any]:
    """Return how the run went: errors at its end, smallest margins and peaks over all accepted steps."""
    import numpy as np

    from coop_drake.answers.speeds import peak_speeds, steadiness
    from coop_drake.simulation import communication

    x, y, theta = log.object_pose[-1] - plan.goal_pose
    near_stops, slow_seconds = steadiness(log)
    of_force = {} if plan.motion is None else _force_facts(log, problem)
    base_forces = np.hypot(log.base_wrenches[..., 0], log.base_wrenches[..., 1])
    return {
        "outcome": "arrived" if log.reached and not log.violation else "failed",
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
        "messages": communication(log).messages,
        "peak_base_wrench_n": float(base_forces.max()),
        **of_force,
        "peak_base_force_rate_n_s": log.peak_force_rate,
        "peak_base_torque_nm": float(np.abs(log.base_wrenches[..., 2]).max()),
        "peak_joint_torque_nm": float(np.abs(log.joint_torques).max(initial=0.0)),
        "peak_speed_m_s": float(np.hypot(log.object_twist[:, 0], log.object_twist[:, 1]).max()),
        "near_stops": near_stops,
        "slow_seconds": slow_seconds,
        "peak_speeds": [asdict(speed) for speed in peak_speeds(log, problem)],
    }

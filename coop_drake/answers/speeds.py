"""The speeds, accelerations and efforts of the bases and joints in a run, beside their limits."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

import numpy as np

from coop_drake.answers.log import SimulationLog
from coop_drake.answers.problem import PlanningProblem
from coop_drake.tree.arrays import FloatArray

SHORTEST = 0.005
"""Speeds of bases are means over at least this time [s]: between rows that are nearer to each other, rounding
of their poses would count."""

STOPPED, SLOW = 0.1, 0.25
"""Speeds of the object below which it has nearly stopped, and is slow, over its mean speed in a run [-]."""


@dataclass(frozen=True)
class PeakSpeed:
    """The largest speed, acceleration or effort of one base or joint in a run.

    Attributes:
        name: What moved.
        peak: The largest.
        limit: Its limit, None where none is known.
        unit: Such as ``m/s``, ``rad/s²`` or ``N m``.
    """

    name: str
    peak: float
    limit: float | None
    unit: str


def base_speeds(log: SimulationLog) -> tuple[FloatArray, FloatArray]:
    """Return how fast bases moved and turned, from their poses.

    Returns:
        The ends of intervals of ``SHORTEST`` or longer, shape (R,) [s]; in each of them mean speed [m/s] and
        mean magnitude of the turn rate [rad/s] of every base, shape (R, N, 2).
    """
    rows, last = [0], 0
    for row in range(1, len(log.times)):
        if log.times[row] - log.times[last] >= SHORTEST:
            rows.append(row)
            last = row
    times, poses = log.times[rows], log.base_poses[rows]
    moved = np.diff(poses, axis=0)
    turned = np.diff(np.unwrap(poses[..., 2], axis=0), axis=0)
    steps = np.diff(times)[:, None]
    return times[1:], np.stack((np.hypot(moved[..., 0], moved[..., 1]) / steps, np.abs(turned) / steps), -1)


def steadiness(log: SimulationLog) -> tuple[int, float]:
    """Return how often the object nearly stopped between start and goal, and how long it was slow [s].

    Both are judged by its speed over its mean speed, the length of its path over the time that it took.
    """
    steps = np.diff(log.times, append=log.times[-1])
    speed = np.hypot(log.object_twist[:, 0], log.object_twist[:, 1])
    path = np.hypot(*np.diff(log.object_pose[:, :2], axis=0).T).sum()
    mean = float(path / log.times[-1]) if log.times[-1] > 0.0 else 0.0
    stopped = speed < STOPPED * mean
    begun = np.count_nonzero(stopped[1:] & ~stopped[:-1])
    # The stop at the goal is none on the way; that at the start has no beginning.
    slow = steps[speed < SLOW * mean].sum()
    return int(begun - bool(begun and stopped[-1])), float(slow)


def peak_speeds(log: SimulationLog, problem: PlanningProblem) -> list[PeakSpeed]:
    """Return the largest speeds of a run: of every base, then of every joint in q's order.

    Then the largest accelerations and efforts of the joints, and the acceleration of the object, that have
    limits.
    """
    peaks, limits, found = base_speeds(log)[1].max(axis=0, initial=0.0), problem.kept_limits, []
    for k, name in enumerate(log.robot_names):
        found.append(_peak(f"speed of {name}", peaks[k, 0], limits.base_speeds[k], "m/s"))
        found.append(_peak(f"turn rate of {name}", peaks[k, 1], limits.turn_rates[k], "rad/s"))
    rates = np.abs(log.joint_rates).max(axis=0, initial=0.0)
    for joint, rate, limit in zip(problem.tree.joints, rates, limits.joint_rates, strict=True):
        found.append(_peak(f"rate of {joint.name}", rate, limit, f"{joint.unit}/s"))
    accelerations, efforts = (
        np.abs(values).max(axis=0, initial=0.0) for values in (log.accelerations[:, 3:], log.joint_torques)
    )
    for i, joint in enumerate(problem.tree.joints):
        effort = "N m" if joint.kind == "revolute" else "N"
        for what, peaks, most, unit in (
            ("acceleration", accelerations, limits.joint_accelerations, f"{joint.unit}/s²"),
            ("effort", efforts, limits.joint_efforts, effort),
        ):
            if np.isfinite(most[i]):
                found.append(_peak(f"{what} of {joint.name}", peaks[i], most[i], unit))
    if np.isfinite(limits.object_acceleration).any():
        peak, most = np.hypot(*log.accelerations[:, :2].T).max(initial=0.0), limits.object_acceleration
        found.append(_peak("acceleration of the object", peak, most[0], "m/s²"))
    return found


def _peak(name: str, peak: float, limit: float, unit: str) -> PeakSpeed:
    return PeakSpeed(name, float(peak), float(limit) if limit < inf else None, unit)

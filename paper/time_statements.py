"""Figures 6 to 13: position, angle, joints, velocities and the wrench on the object over time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from coop_drake.answers import PlanningProblem
from coop_drake.laws.readiness import RATE_TOLERANCE, SPEED_TOLERANCE
from coop_drake.simulation import WRENCH_TOLERANCE
from coop_drake.tree.arrays import FloatArray
from paper.exhibits import Statement
from paper.runs import Run
from paper.stated import CELLS, GOAL

__all__ = [
    "angle_statements",
    "joint_statements",
    "position_statements",
    "rate_statements",
    "wrench_statements",
]

_FUNNELS = ("E17a", "E17b", "E18", "E20")


def position_statements(problem: PlanningProblem, runs: Sequence[Run]) -> tuple[Statement, ...]:
    """Compare the position over time with Figure 6."""
    switches = [int(np.count_nonzero(np.diff(run.log.cell_index))) for run in runs]
    ends = [run.log.object_pose[-1, :2] for run in runs]
    return (
        Statement(
            f"Cells change {CELLS - 1} times.",
            tuple(f"{count}" for count in switches),
            all(count == CELLS - 1 for count in switches),
            ("R1", "R9"),
        ),
        Statement(
            f"The position ends at ({GOAL[0]:g}, {GOAL[1]:g}).",
            tuple(f"({x:.3f}, {y:.3f})" for x, y in ends),
            all(float(np.hypot(*(end - GOAL[:2]))) <= problem.position_tolerance for end in ends),
            ("R5",),
        ),
        Statement(
            "duration of the transport", tuple(f"{run.log.times[-1]:.1f} s" for run in runs), None, ("R1",)
        ),
    )


def angle_statements(problem: PlanningProblem, runs: Sequence[Run]) -> tuple[Statement, ...]:
    """Compare the angle over time with Figure 7."""
    ends = [float(run.log.object_pose[-1, 2]) for run in runs]
    offs = [abs(np.remainder(end - GOAL[2] + np.pi, 2.0 * np.pi) - np.pi) for end in ends]
    return (
        _between("The angle stays between its performance functions.", runs, 0, _FUNNELS),
        Statement(
            f"It ends at {GOAL[2]} rad, whole turns aside.",
            tuple(f"{end:.3f} rad, {1e3 * off:.1f} mrad away" for end, off in zip(ends, offs, strict=True)),
            all(off <= problem.angle_tolerance for off in offs),
            ("R5", "R8"),
        ),
    )


def joint_statements(runs: Sequence[Run], joint: int) -> tuple[Statement, ...]:
    """Compare a joint over time with Figure 10 or 11.

    Args:
        runs: One for every gain set.
        joint: Index of the joint in the plan's order.
    """
    spans = [run.log.joints[:, joint] for run in runs]
    return (
        _between(
            "The joint stays between the bounds of its cells.",
            runs,
            1 + joint,
            (*_FUNNELS, "E35", "E39", "R6"),
        ),
        Statement(
            "how far it moves",
            tuple(f"{span.min():.2f} to {span.max():.2f} rad" for span in spans),
            None,
            ("R1", "R9"),
        ),
    )


def rate_statements(runs: Sequence[Run], *, angular: bool) -> tuple[Statement, ...]:
    """Compare the object's linear or angular velocity over time with Figure 8 or 9."""
    unit = "rad/s" if angular else "m/s"
    columns, tolerance = (slice(2, 3), RATE_TOLERANCE) if angular else (slice(0, 2), SPEED_TOLERANCE)
    speeds = [np.linalg.norm(run.log.object_twist[:, columns], axis=1) for run in runs]
    return (
        Statement(
            "The object comes to rest at the end: switching cells costs no convergence.",
            tuple(f"{speed[-1]:.1g} {unit} at the end" for speed in speeds),
            all(run.log.reached and speed[-1] <= tolerance for run, speed in zip(runs, speeds, strict=True)),
            ("E10", "R5", "R7"),
        ),
        Statement("largest speed", tuple(f"{speed.max():.2f} {unit}" for speed in speeds), None, ("R1",)),
    )


def wrench_statements(runs: Sequence[Run], *, torque: bool) -> tuple[Statement, ...]:
    """Compare the total force or torque over time with Figure 12 or 13."""
    unit = "N m" if torque else "N"
    columns = slice(2, 3) if torque else slice(0, 2)
    peaks = [np.linalg.norm(run.log.object_wrench[:, columns], axis=1).max() for run in runs]
    errors = [float(run.log.wrench_error.max()) for run in runs]
    return (
        Statement(
            "What the robots apply adds up to what the controllers ask for.",
            tuple(f"largest difference in a grasp {error:.0e} {unit}" for error in errors),
            max(errors) <= WRENCH_TOLERANCE,
            ("E21", "E23"),
        ),
        Statement(
            "largest torque" if torque else "largest force",
            tuple(f"{peak:.3g} {unit}" for peak in peaks),
            None,
            ("R1", "E18") if torque else ("R1",),
        ),
    )


def _between(paper: str, runs: Sequence[Run], axis: int, because: tuple[str, ...]) -> Statement:
    """State whether an axis (theta, q...) stayed inside its funnel, and its smallest distance to a bound."""
    margins = [_margin(run, axis) for run in runs]
    return Statement(
        paper, tuple(f"nearest {1e3 * margin:.1f} mrad" for margin in margins), min(margins) > 0.0, because
    )


def _margin(run: Run, axis: int) -> float:
    log = run.log
    values: FloatArray = log.object_pose[:, 2] if axis == 0 else log.joints[:, axis - 1]
    return float(np.minimum(values - log.funnel_lower[:, axis], log.funnel_upper[:, axis] - values).min())

"""Figures 3 to 5: approximations, start and goal, and the path of the object over the floor."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from shapely import distance, points

from coop_drake.answers import PlanningProblem
from coop_drake.tree.arrays import FloatArray
from paper.approximation import Approximation
from paper.exhibits import Statement
from paper.runs import Run
from paper.stated import GOAL, START

__all__ = ["approximation_statements", "end_statements", "path_statements"]


def approximation_statements(made: Sequence[Approximation]) -> tuple[Statement, ...]:
    """Compare the approximations of the four slices with (6).

    Args:
        made: In the order of the panels.
    """
    compared = sum(len(one.exact) for one in made)
    gaps = [one.gap for one in made]
    over = (
        " > ".join(f"{gap:.2f}" for gap in (gaps[0], gaps[1]))
        + "; "
        + " > ".join(f"{gap:.2f}" for gap in (gaps[2], gaps[3]))
    )
    return (
        Statement(
            "Every configuration of a slice lies inside the over-approximation and covers the "
            "under-approximation.",
            (f"holds at all {compared} configurations tried",),
            all(one.encloses for one in made),
            ("E6", "E9", "R2"),
        ),
        Statement(
            "Narrower slices bring the two closer: (c) within (b), (e) within (d).",
            (f"area between them in m²: {over}",),
            gaps[1] < gaps[0] and gaps[3] < gaps[2],
        ),
    )


def end_statements(problem: PlanningProblem) -> tuple[Statement, ...]:
    """Compare start and goal with those of the paper.

    Args:
        problem: The reconstruction.
    """
    robots = {joint.robot for joint in problem.tree.joints}
    return (
        Statement(
            "Two mobile manipulators with a joint each hold the object.",
            (f"{len(robots)} robots, {len(problem.tree.joints)} joints",),
            len(robots) == 2 == len(problem.tree.joints),
            ("R2",),
            copied=True,
        ),
        Statement(
            f"The start is {_listed(START)}: x, y, θ and both joints.",
            (_listed(problem.start),),
            bool(np.array_equal(problem.start, START)),
            copied=True,
        ),
        Statement(
            f"The goal is {_listed(GOAL)}: x, y and θ.",
            (_listed(problem.goal_pose),),
            bool(np.array_equal(problem.goal_pose, GOAL)),
            ("R4",),
            copied=True,
        ),
    )


def path_statements(problem: PlanningProblem, runs: Sequence[Run]) -> tuple[Statement, ...]:
    """State where the object's path ended, and the smallest distances of bodies to walls and to each other.

    Args:
        problem: The reconstruction.
        runs: One for every gain set.
    """
    offs = [float(np.hypot(*(run.log.object_pose[-1, :2] - GOAL[:2]))) for run in runs]
    walls = [float(run.log.workspace_clearance.min()) for run in runs]
    bodies = [float(run.log.body_clearance.min()) for run in runs]
    narrow = [_tight_fraction(problem, run) for run in runs]
    lengths = [float(np.hypot(*np.diff(run.log.object_pose[:, :2], axis=0).T).sum()) for run in runs]
    return (
        Statement(
            "The team arrives at the goal.",
            tuple(f"{1e3 * off:.1f} mm from it" for off in offs),
            all(
                run.log.reached and off <= problem.position_tolerance
                for run, off in zip(runs, offs, strict=True)
            ),
            ("R5", "E15a", "E15b"),
        ),
        Statement(
            "No body touches a wall on the way.",
            tuple(f"nearest {wall:.3f} m" for wall in walls),
            min(walls) > 0.0,
            ("E4", "E9", "E10"),
        ),
        Statement(
            "The robots do not touch the object or one another.",
            tuple(f"nearest {body:.3f} m" for body in bodies),
            min(bodies) > 0.0,
        ),
        Statement(
            "part of the way on which the straight team has no room to turn",
            tuple(f"{share:.0%}" for share in narrow),
            None,
            ("R1", "R2"),
        ),
        Statement(
            "length of the object's way", tuple(f"{length:.2f} m" for length in lengths), None, ("R1",)
        ),
    )


def _tight_fraction(problem: PlanningProblem, run: Run) -> float:
    """Return the fraction of the path on which a wall is within the straight team's reach."""
    way = run.log.object_pose[:, :2]
    lengths = np.hypot(*np.diff(way, axis=0).T)
    middles = points(0.5 * (way[1:] + way[:-1]))
    narrow = distance(problem.workspace.boundary, middles) < problem.tree.reach
    return float(lengths[narrow].sum() / lengths.sum())


def _listed(values: Sequence[float] | FloatArray) -> str:
    return "(" + ", ".join(f"{value:g}" for value in values) + ")"

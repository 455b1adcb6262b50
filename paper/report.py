"""The exhibits of the report: all tables and figures of the paper's example, in the paper's order."""

from __future__ import annotations

from collections.abc import Sequence

from paper.exhibits import Exhibit, Picture, Statement
from paper.floor_statements import (
    approximation_statements,
    end_statements,
    path_statements,
)
from paper.material import Material
from paper.runs import GAIN_SETS
from paper.table_statements import (
    interval_statements,
    parameter_statements,
    played_statements,
)
from paper.time_statements import (
    angle_statements,
    joint_statements,
    position_statements,
    rate_statements,
    wrench_statements,
)

__all__ = ["exhibits"]


def exhibits(material: Material) -> tuple[Exhibit, ...]:
    """Compare every table and figure with our runs.

    Args:
        material: Of a team of two robots with a joint each.
    """
    return (*_tables(material), *_floor_figures(material), *_time_figures(material))


def _tables(material: Material) -> tuple[Exhibit, ...]:
    return (
        Exhibit(
            "Table 1",
            "the cells of the plan",
            "Intervals of the object's angle and of both joints in the thirty cells that the planner found.",
            interval_statements(material.runs[0].plan),
            (Picture("table_1.png"),),
            ("table_1.md",),
        ),
        Exhibit(
            "Table 1, played",
            "the paper's own cells in the closed loop",
            "Not shown in the paper: its thirty cells, with positions made up, through our controllers.",
            played_statements(material.played),
            (),
            ("table_1_gains.json",),
        ),
        Exhibit(
            "Table 2",
            "parameters of the simulation",
            "Mass and inertia of the object, and the gains. We copied them into the gain set table_2.",
            parameter_statements(material.table_2, material.inertia),
            (),
            ("table_2.md",),
        ),
    )


def _floor_figures(material: Material) -> tuple[Exhibit, ...]:
    return (
        Exhibit(
            "Figure 3",
            "over- and under-approximations",
            "A system of two components, and for four slices what encloses it and what it always covers.",
            approximation_statements(material.made),
            (Picture("fig03_approximations.png"),),
        ),
        Exhibit(
            "Figure 4",
            "start and goal",
            "The floor with the team at the start and at the goal, which are copied; the floor is ours.",
            end_statements(material.problem),
            (Picture(f"{material.runs[0].gains}/fig04_start_and_goal.png"),),
        ),
        Exhibit(
            "Figure 5",
            "the way over the floor",
            "The paper draws the object's path and footprints of the team along it. Ours: the path black, "
            "the object brown, every robot in a colour of its own.",
            path_statements(material.problem, material.runs),
            _both("fig05_path"),
        ),
    )


def _time_figures(material: Material) -> tuple[Exhibit, ...]:
    problem, runs = material.problem, material.runs
    robots = runs[0].log.robot_names
    return (
        _over_time(
            "6", "position", "The object's position; dashed lines where cells change.",
            position_statements(problem, runs), "fig06_position",
        ),
        _over_time(
            "7", "angle", "The object's angle between its performance functions.",
            angle_statements(problem, runs), "fig07_angle",
        ),
        _over_time(
            "8", "linear velocity", "The object's linear velocity; no number is stated.",
            rate_statements(runs, angular=False), "fig08_velocity",
        ),
        _over_time(
            "9", "angular velocity", "The object's angular velocity; no number is stated.",
            rate_statements(runs, angular=True), "fig09_angular_velocity",
        ),
        *(
            _over_time(
                f"{10 + joint}", f"joint q_{1 + joint},1", "The joint with the bounds of every cell.",
                joint_statements(runs, joint), f"fig{10 + joint}_joints_{robots[joint]}",
            )
            for joint in range(2)
        ),
        _over_time(
            "12", "force on the object", "The total force that the robots apply; no number is stated.",
            wrench_statements(runs, torque=False), "fig12_force",
        ),
        _over_time(
            "13", "torque on the object", "The total torque that the robots apply; no number is stated.",
            wrench_statements(runs, torque=True), "fig13_torque",
        ),
    )  # fmt: skip


def _over_time(
    number: str, title: str, caption: str, statements: Sequence[Statement], picture: str
) -> Exhibit:
    return Exhibit(f"Figure {number}", title, caption, tuple(statements), _both(picture))


def _both(picture: str) -> tuple[Picture, ...]:
    """Return one picture per gain set."""
    return tuple(Picture(f"{gains}/{picture}.png", heading) for gains, heading in GAIN_SETS.items())

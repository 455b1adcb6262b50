"""The paper's Table 1 for a plan: the intervals of every cell."""

from __future__ import annotations

from coop_drake.answers.plan import Plan


def table_1(plan: Plan) -> str:
    """Return the intervals of theta and of every joint, cell by cell, as a Markdown table.

    Angles are unwrapped along the plan [rad]; prismatic joints are in metres.
    """
    axes = ("theta", *plan.joint_names)
    columns = ["cell", *(f"{axis} {bound}" for axis in axes for bound in ("lower", "upper"))]
    lines = [
        f"Table 1. Intervals of the object's angle and of every joint in the {len(plan.cells)} cells "
        "of the plan [rad, prismatic joints m].",
        "",
        "| " + " | ".join(columns) + " |",
        "|" + " ---: |" * len(columns),
    ]
    for number, cell in enumerate(plan.cells, start=1):
        bounds = [f"{value:.3f}" for pair in zip(cell.lower, cell.upper, strict=True) for value in pair]
        lines.append("| " + " | ".join([str(number), *bounds]) + " |")
    return "\n".join(lines) + "\n"

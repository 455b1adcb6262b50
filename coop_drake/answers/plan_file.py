"""The file ``plan.json``: the same bytes for the same plan, every number at full precision."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from coop_drake.answers.digest import as_json
from coop_drake.answers.document import Document, Head, document_text
from coop_drake.answers.plan import Plan
from coop_drake.answers.plan_checks import check_plan
from coop_drake.files import write_atomically
from coop_drake.laws import TransitionGains

__all__ = ["FORMAT", "load_plan", "read_plan", "save_plan"]

FORMAT = "coop_drake plan"
"""What the document says it is."""

VERSION = 2
"""Version of its layout; another one is refused."""


def save_plan(plan: Plan, path: Path | str) -> Path:
    """Write a plan so that ``load_plan`` gives the same plan back, and saving that the same bytes.

    The file is written whole or not at all.

    Args:
        plan: The plan.
        path: Where to write it.

    Returns:
        The path written.
    """
    head = {"format": FORMAT, "version": VERSION, **as_json(plan)}
    rows = {key: head.pop(key) for key in ("cells", "transitions")}
    return write_atomically(path, document_text(head, rows).encode())


def load_plan(path: Path | str) -> Plan:
    """Read a plan that can be executed.

    Args:
        path: A file that ``save_plan`` wrote.

    Raises:
        PlanError: If it is not such a plan: names the file, the key, the value and what is allowed there.
    """
    document = Document.load(path, "a plan")
    plan = read_plan(document)
    check_plan(plan, document.file)
    document.check_digest()
    return plan


def read_plan(document: Document) -> Plan:
    """Read a plan from a document; every key, length and number is checked, but not what they mean together.

    Args:
        document: The whole document.

    Raises:
        PlanError: Names the file, the key, the value and what is allowed there.
    """
    head = document.read_head(Head, format=[FORMAT], version=[VERSION])
    plan = document.read(Plan, head)
    axes = 1 + len(plan.joint_names)
    document.check_length("start", plan.start, 2 + axes)
    document.check_length("goal_pose", plan.goal_pose, 3)
    document.check_length("goal_joints", plan.goal_joints, axes - 1)
    document.check_length("transitions", plan.transitions, len(plan.cells))
    for k, cell in enumerate(plan.cells):
        document.check_intervals(f"cells[{k}].", cell.lower, cell.upper, axes)
    for k, transition in enumerate(plan.transitions):
        where = f"transitions[{k}]."
        document.check_intervals(f"{where}goal_", transition.goal_lower, transition.goal_upper, axes)
        document.check_length(f"{where}target", transition.target, 2)
        _check_gains(document, f"{where}gains.", transition.gains, axes)
    return plan


def _check_gains(document: Document, key: str, gains: TransitionGains, axes: int) -> None:
    """Gains are positive, one of each or one for every axis; the smoothing may be zero."""
    for name, gain in vars(gains).items():
        if isinstance(gain, np.ndarray):
            document.check_length(f"{key}{name}", gain, axes)
            for axis in np.flatnonzero(gain <= 0.0):
                document.refuse(f"{key}{name}[{axis}]", "a finite number > 0.0")
        elif isinstance(gain, float) and (gain < 0.0 or (gain == 0.0 and name != "smoothing")):
            document.refuse(f"{key}{name}", f"a finite number {'>=' if name == 'smoothing' else '>'} 0.0")

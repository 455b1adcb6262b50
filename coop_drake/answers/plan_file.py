"""Plans on disk: JSON, the same bytes for the same plan, every number at full precision."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

from coop_drake.answers.document import Entry
from coop_drake.answers.document_text import document_text, polygon_entry
from coop_drake.answers.plan import Cell, Plan, Transition
from coop_drake.answers.plan_checks import check_plan
from coop_drake.answers.plan_reader import FORMAT, VERSION, read_plan
from coop_drake.files import write_atomically

__all__ = ["load_plan", "save_plan"]


def save_plan(plan: Plan, path: Path | str) -> Path:
    """Write a plan so that ``load_plan`` gives the same plan back, and saving that the same bytes.

    The file is written whole or not at all.

    Args:
        plan: The plan.
        path: Where to write it.

    Returns:
        The path written.
    """
    return write_atomically(path, _text(plan).encode())


def load_plan(path: Path | str) -> Plan:
    """Read a plan.

    Args:
        path: A file that ``save_plan`` wrote.

    Raises:
        PlanError: If the file is not a plan: names the file, the key, the value and what is allowed there.
    """
    root = Entry.load(path, "a plan")
    plan = read_plan(root)
    check_plan(plan, root.file)
    root.check_digest()
    return plan


def _text(plan: Plan) -> str:
    """One line for every cell and every transition: fit for eyes and for diffs."""
    head: dict[str, Any] = {
        "format": FORMAT,
        "version": VERSION,
        "problem": plan.problem,
        "gain_set": plan.gain_set,
        "margin": plan.margin,
        "joint_names": plan.joint_names,
        "start": plan.start.tolist(),
        "goal_pose": plan.goal_pose.tolist(),
        "goal_joints": plan.goal_joints,
    }
    rows = {
        "cells": [_cell_entry(cell) for cell in plan.cells],
        "transitions": [_transition_entry(transition) for transition in plan.transitions],
    }
    return document_text(head, rows)


def _cell_entry(cell: Cell) -> dict[str, Any]:
    return {
        "lower": cell.lower.tolist(),
        "upper": cell.upper.tolist(),
        "safe": polygon_entry(cell.safe),
        "core": polygon_entry(cell.core),
        "tidied": polygon_entry(cell.tidied),
    }


def _transition_entry(transition: Transition) -> dict[str, Any]:
    gains = asdict(transition.gains)
    for key in ("decay_rate", "log_gain", "energy_bound"):
        gains[key] = gains[key].tolist()
    return {
        "target": transition.target.tolist(),
        "goal_lower": transition.goal_lower.tolist(),
        "goal_upper": transition.goal_upper.tolist(),
        "inradius": transition.inradius,
        "neck": transition.neck,
        "length": transition.length,
        "estimated_time": transition.estimated_time,
        "only_angles": transition.only_angles,
        "gains": gains,
        "goal_region": polygon_entry(transition.goal_region),
    }

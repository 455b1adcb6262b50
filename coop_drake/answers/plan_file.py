"""The file ``plan.json``: the same bytes for the same plan, every number at full precision."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from coop_drake.answers.digest import content_digest
from coop_drake.answers.document import Document, write_document
from coop_drake.answers.plan import Plan
from coop_drake.answers.plan_checks import check_plan
from coop_drake.typed_data import to_plain

FORMAT = "coop_drake plan"
"""What the document says it is."""

VERSION = 4
"""Version of its layout; another one is refused."""


def save_plan(plan: Plan, path: Path | str) -> Path:
    """Write a plan so that ``load_plan`` gives the same plan back, and saving that the same bytes.

    The file is written whole or not at all; its path is returned.
    """
    return write_document(path, plan_document(plan), rows=("cells", "transitions"))


def plan_digest(plan: Plan) -> str:
    """Return the digest that ``save_plan`` writes into a plan's file."""
    return content_digest(plan_document(plan))


def plan_document(plan: Plan) -> dict[str, Any]:
    """The content of a plan's file without its digest, as plain data."""
    return {"format": FORMAT, "version": VERSION, **to_plain(plan, Plan)}


def load_plan(path: Path | str) -> Plan:
    """Read a plan that can be executed from a file that ``save_plan`` wrote.

    Raises:
        PlanError: If it is not such a plan: names the file, the key, the value and what is allowed there.
    """
    document = Document.load(path, "a plan")
    plan = read_plan(document)
    check_plan(plan, document.file)
    document.check_digest()
    if plan.refused_by:
        limits = "; ".join(refusal.describe() for refusal in plan.refused_by)
        document.refuse(
            "refused_by",
            limits,
            "no limit that a plan breaks; with other limits `plan` may find one that can be carried out",
        )
    return plan


def read_plan(document: Document) -> Plan:
    """Read a plan from a document; every key, length and number is checked, but not what they mean together.

    Raises:
        PlanError: Names the file, the key, the value and what is allowed there.
    """
    document.check_entry("format", FORMAT)
    document.check_entry("version", VERSION)
    plan = document.read(Plan, head=("format", "version"))
    axes = 1 + len(plan.joint_names)
    if not plan.cells:
        document.refuse("cells", [], "at least one cell")
    document.check_length("start", 2 + axes)
    document.check_length("goal_pose", 3)
    document.check_length("goal_joints", axes - 1)
    document.check_length("transitions", len(plan.cells))
    for k in range(len(plan.cells)):
        document.check_intervals(f"cells[{k}].", axes)
        document.check_intervals(f"transitions[{k}].goal_", axes)
        document.check_length(f"transitions[{k}].target", 2)
        gains = document.entry(f"transitions[{k}].gains")
        parts = {"gains": gains, "gains.rest": gains.get("rest")}
        parts["tolerance"] = document.entry(f"transitions[{k}]").get("tolerance")
        for part, content in parts.items():
            for name, value in (content or {}).items():
                if isinstance(value, list) and name != "effort":  # it has other entries
                    document.check_length(f"transitions[{k}].{part}.{name}", axes)
    return plan

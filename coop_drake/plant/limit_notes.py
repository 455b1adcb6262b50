"""Names joints whose kind and limits differ: continuous ones should have no limits, revolute ones two."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree import ElementTree

from coop_drake.answers.problem import PlanningProblem
from coop_drake.scenario import Scenario, assemble

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element


def limit_notes(root: Element, among: Collection[str] | None = None) -> list[str]:
    """Say of which joints of a model limits are kept or left aside although their kind says otherwise.

    ``root`` is that of the model's file, and ``among`` are the names of the joints that count, None for all.
    """
    endless, limited = list[str](), list[str]()
    for joint in root.iter("joint"):
        limit, kind, name = next(joint.iter("limit"), None), joint.get("type"), str(joint.get("name"))
        known = limit is not None and any(limit.get(k) or limit.findtext(k) for k in ("lower", "upper"))
        if among is None or name in among:
            endless += [name] if kind == "revolute" and not known else []
            limited += [name] if kind == "continuous" and known else []
    kept = "do not count" if root.tag == "sdf" else "are kept, so that these are no circles"
    notes = {
        "revolute joints without limits are circles, as continuous ones": endless,
        f"limits of continuous joints {kept}": limited,
    }
    return [f"{note}: {', '.join(names)}" for note, names in notes.items() if names]


def joint_notes(scenario: Scenario, problem: PlanningProblem) -> tuple[str, ...]:
    """Say the same of the joints that a scenario's team moves, each with the model's file."""
    moved = {joint.name.rpartition("::")[2] for joint in problem.tree.joints}
    models = [directive.add_model for directive in assemble(scenario).directives]
    files = dict.fromkeys(Path(model.file.removeprefix("file://")) for model in models if model)
    return tuple(
        f"{path.name}: {note}"
        for path in files
        for note in limit_notes(ElementTree.parse(path).getroot(), moved)
    )

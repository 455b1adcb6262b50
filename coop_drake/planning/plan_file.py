"""Plans on disk: JSON, the same bytes for the same plan, every number at full precision."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import shapely
from shapely import Polygon

from coop_drake.errors import PlanError
from coop_drake.files import write_atomically
from coop_drake.planning.document import Entry
from coop_drake.planning.plan import Cell, Plan, Transition
from coop_drake.planning.plan_checks import check_plan
from coop_drake.planning.plan_reader import FORMAT, VERSION, read_plan

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
    file = str(path)
    try:
        text = Path(path).read_text(encoding="utf-8")
        document = json.loads(text)
    except (OSError, UnicodeDecodeError, RecursionError) as error:
        raise PlanError(f"{file}: cannot be read: {error}") from error
    except json.JSONDecodeError as error:
        raise PlanError(f"{file}: line {error.lineno}: {error.msg}; expected the JSON of a plan") from error
    plan = read_plan(Entry(file, "", document))
    check_plan(plan, file)
    return plan


def _text(plan: Plan) -> str:
    """One line for every cell and every transition: fit for eyes and for diffs."""
    head: dict[str, Any] = {
        "format": FORMAT,
        "version": VERSION,
        "gain_set": plan.gain_set,
        "margin": plan.margin,
        "joint_names": plan.joint_names,
        "start": plan.start.tolist(),
        "goal_pose": plan.goal_pose.tolist(),
        "goal_joints": plan.goal_joints,
    }
    lines = [f' "{key}": {_line(value)}' for key, value in head.items()]
    for key, entries in (
        ("cells", [_cell_entry(cell) for cell in plan.cells]),
        ("transitions", [_transition_entry(transition) for transition in plan.transitions]),
    ):
        lines.append(f' "{key}": [\n  ' + ",\n  ".join(_line(entry) for entry in entries) + "\n ]")
    return "{\n" + ",\n".join(lines) + "\n}\n"


def _line(value: Any) -> str:
    return json.dumps(value, allow_nan=False, ensure_ascii=False)


def _polygon_entry(polygon: Polygon) -> dict[str, Any]:
    outer, *holes = (
        shapely.get_coordinates(ring)[:-1].tolist() for ring in (polygon.exterior, *polygon.interiors)
    )
    return {"outer": outer, "holes": holes}


def _cell_entry(cell: Cell) -> dict[str, Any]:
    return {
        "lower": cell.lower.tolist(),
        "upper": cell.upper.tolist(),
        "safe": _polygon_entry(cell.safe),
        "core": _polygon_entry(cell.core),
        "tidied": _polygon_entry(cell.tidied),
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
        "goal_region": _polygon_entry(transition.goal_region),
    }

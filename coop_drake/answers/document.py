"""JSON documents that hold a dataclass: their regions and digests, and how they are written and read."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Annotated, Any, NoReturn, TypeVar

import numpy as np
import shapely
from shapely import Polygon

from coop_drake.answers.problem import PlanningProblem, TeamLimits
from coop_drake.errors import PlanError, ScenarioError, shortened
from coop_drake.files import check_readable, write_atomically
from coop_drake.geometry.polygons import corners_of
from coop_drake.tree.arrays import FloatArray
from coop_drake.tree.component_tree import Component, ComponentTree, ConvexShape, TreeJoint
from coop_drake.typed_data import Codec, DataError, Number, convert, convert_class, to_plain

# Regions in files: the rings of a polygon, without their closing corners.

Pairs = tuple[tuple[Number, Number], ...]


def _of_points(least: int) -> Codec:
    """Return the codec of a list of points, shape (n, 2) [m]."""

    def read(pairs: Pairs) -> FloatArray:
        if len(pairs) < least:
            allowed = f"a list of at least {least} {'corners' if least > 2 else 'points'}"
            raise DataError("", [list(pair) for pair in pairs], allowed)
        return np.array(pairs, dtype=np.float64)

    return Codec(Pairs, read, np.ndarray.tolist)


Ring = Annotated[FloatArray, _of_points(3)]

Corners = Annotated[FloatArray, _of_points(1)]
"""Corners of a convex polygon, or a single point [m]."""

Points = Annotated[FloatArray, _of_points(2)]
"""A polyline that a file holds as the list of its points [m]."""


@dataclass(frozen=True)
class Rings:
    """A polygon as it stands in a file.

    Attributes:
        outer: Corners of the outer ring [m].
        holes: Corners of the inner rings [m].
    """

    outer: Ring
    holes: tuple[Ring, ...]


def _read_region(rings: Rings) -> Polygon:
    polygon = Polygon(rings.outer, rings.holes)
    if not polygon.is_valid or polygon.area <= 0.0:
        reason = shapely.is_valid_reason(polygon)
        allowed = f"rings that cross neither themselves nor each other, but found: {reason}"
        raise DataError("", _write_region(polygon), allowed)
    return polygon


def _write_region(polygon: Polygon) -> object:
    outer, *holes = (corners.tolist() for corners in corners_of(polygon))
    return {"outer": outer, "holes": holes}


Region = Annotated[Polygon, Codec(Rings, _read_region, _write_region)]
"""A polygon that a file holds as its rings [m]."""


# Digests: which question a file answers, and whether its content is still what was written.

MOTION_LIMITS = ("base_accelerations", "turn_accelerations", "base_jerks", "object_acceleration")
"""Limits that are part of a question where they are stated."""

DECIMALS = 9
"""Decimals of a problem's numbers that its digest sees [m, rad]: last bits differ between libraries."""


def content_digest(document: Mapping[str, Any]) -> str:
    """SHA-256 over all of a JSON document but its entry ``digest``, whatever its layout; in hexadecimal."""
    return _digest({key: value for key, value in document.items() if key != "digest"})


def problem_digest(problem: PlanningProblem) -> str:
    """SHA-256 over what is asked: floor, team, start, goal, tolerances and limits; not how hard to try."""
    rings = (problem.workspace.exterior, *problem.workspace.interiors)
    return _digest(
        {
            "workspace": [_rounded(shapely.get_coordinates(ring).tolist()) for ring in rings],
            "team": tree_document(problem.tree),
            "start": _rounded(problem.start.tolist()),
            "goal_pose": _rounded(problem.goal_pose.tolist()),
            "goal_joints": _rounded(list(problem.goal_joints)),
            "tolerances": _rounded(
                [
                    problem.position_tolerance,
                    problem.angle_tolerance,
                    *np.atleast_1d(problem.joint_tolerance).tolist(),
                ]
            ),
            **_limits(problem.limits),
        }
    )


def tree_document(tree: ComponentTree) -> dict[str, Any]:
    """A component tree as plain data with rounded numbers."""
    return {
        "components": [_component(component) for component in tree.components],
        "sharing_joint": sorted(sorted(pair) for pair in tree.unchecked_pairs),
    }


def _limits(limits: TeamLimits) -> dict[str, Any]:
    """Limits of speed and of acceleration, if there are any; efforts are not part of the question."""
    stated, document = to_plain(limits, TeamLimits), {}
    accelerations = stated.pop("joint_accelerations")
    frictions = stated.pop("frictions")
    for name in ("joint_efforts", "base_forces", "bodies"):
        del stated[name]
    of_motions = {name: stated.pop(name) for name in MOTION_LIMITS}
    if limits.any:
        document["limits"] = _rounded(list(stated.values()))
    if np.isfinite(limits.joint_accelerations).any():
        document["accelerations"] = _rounded(accelerations)
    if any(np.isfinite(getattr(limits, name)).any() for name in MOTION_LIMITS):
        document["motion"] = _rounded(list(of_motions.values()))
    if np.isfinite(limits.frictions).any():
        document["frictions"] = _rounded(frictions)
    return document


def _digest(value: Any) -> str:
    text = json.dumps(value, sort_keys=True, separators=(",", ":"), ensure_ascii=True)
    return sha256(text.encode()).hexdigest()


def _rounded(value: Any) -> Any:
    """The same nested lists with rounded numbers, without negative zeros."""
    if isinstance(value, list):
        return [_rounded(entry) for entry in value]
    return None if value is None else round(float(value), DECIMALS) + 0.0


def _component(component: Component) -> dict[str, Any]:
    return {
        "name": component.name,
        "parent": component.parent,
        "joint": None if component.joint is None else _joint(component.joint),
        "bodies": [
            [body.name, body.robot, [_shape(shape) for shape in body.shapes]] for body in component.bodies
        ],
    }


def _joint(joint: TreeJoint) -> list[Any]:
    X = joint.X_PJ
    numbers = [X.x, X.y, X.angle, joint.sign, *joint.axis, joint.lower, joint.upper]
    return [joint.name, joint.kind, joint.robot, joint.index, _rounded(numbers)]


def _shape(shape: ConvexShape) -> list[Any]:
    return [_rounded(shape.vertices.tolist()), _rounded(shape.radius)]


# Documents: written in one way only, and read with every value checked.

_LARGEST = 1000.0
"""Largest file of a plan or a proof [MB]; those of the shipped scenarios have a few."""
Content = TypeVar("Content")

DIGITS = 300
"""Digits of the longest integer that is read as it is; a float cannot hold one of more than 308 digits."""


@dataclass(frozen=True)
class Document:
    """The content of a JSON file. Refusals are PlanErrors with the file, key, value and what is allowed.

    Attributes:
        file: The file's path as the user wrote it.
        content: What the file holds.
    """

    file: str
    content: Any

    @classmethod
    def load(cls, path: Path | str, what: str) -> Document:
        """Read a JSON file that should hold ``what``; every key may stand once in a mapping."""
        file, expected = str(path), f"expected the JSON of {what}"
        try:
            text = check_readable(Path(path), _LARGEST).read_text(encoding="utf-8")
            return cls(file, json.loads(text, object_pairs_hook=_mapping, parse_int=_whole_number))
        except json.JSONDecodeError as error:
            raise PlanError(f"{file}: line {error.lineno}: {error.msg}; {expected}") from error
        except DataError as error:
            cls(file, None).refuse(error.key, error.value, error.allowed)
        except (OSError, RecursionError, UnicodeDecodeError) as error:
            raise PlanError(f"{file}: cannot be read: {error}; {expected}") from error

    def refuse(self, key: str, value: object, allowed: str) -> NoReturn:
        """Say what stands at a key, such as ``cells[3].upper``, and what is allowed there."""
        place = key or "document"
        raise PlanError(f"{self.file}: {place}: {shortened(value)} is not allowed; expected {allowed}")

    def check_entry(self, key: str, *allowed: object) -> Any:
        """Return one of the document's own entries; only some values are allowed for it."""
        if not isinstance(self.content, dict):
            self.refuse("", self.content, "a mapping")
        value, expected = self.content.get(key), [repr(entry) for entry in allowed]
        if repr(value) not in expected:  # Unlike the values themselves, the texts of True and 1 differ.
            self.refuse(key, value, " or ".join(expected))
        return value

    def read(self, kind: type[Content], head: Collection[str]) -> Content:
        """Read a dataclass from all entries but those of the head and the digest; no key may be unknown."""
        body = {key: value for key, value in self.content.items() if key not in ("digest", *head)}
        try:
            for key in ("problem", "digest"):
                convert(self.content.get(key), str, key)
            return convert_class(body, kind)
        except DataError as error:
            raise PlanError(str(ScenarioError.of(self.file, error.faults))) from error

    def entry(self, key: str) -> Any:
        """Return what stands at a key, such as ``cells[3].upper``."""
        value = self.content
        for step in re.findall(r"\w+", key):
            value = value[int(step)] if isinstance(value, list) else value[step]
        return value

    def check_length(self, key: str, count: int) -> None:
        """Refuse a list that has another number of entries."""
        values = self.entry(key)
        if len(values) != count:
            self.refuse(key, values, f"{count} entries, not {len(values)}")

    def check_intervals(self, key: str, axes: int, *, points: bool = False) -> None:
        """Refuse ends at ``key`` + lower, upper unless lower < upper on every axis (<= with points)."""
        for end in ("lower", "upper"):
            self.check_length(f"{key}{end}", axes)
        ends = (map(float, self.entry(f"{key}{end}")) for end in ("lower", "upper"))
        for axis, (lower, upper) in enumerate(zip(*ends, strict=True)):
            if lower > upper or (lower == upper and not points):
                least = f"{lower} or more" if points else f"more than {key}lower[{axis}], {lower}"
                self.refuse(f"{key}upper[{axis}]", upper, least)

    def check_digest(self) -> None:
        """Refuse a document whose entry ``digest`` is not that of its other entries."""
        found, expected = self.content["digest"], content_digest(self.content)
        if found != expected:
            self.refuse("digest", found, f"'{expected}': the content is not what was written")


def write_document(path: Path | str, content: Mapping[str, Any], rows: Collection[str]) -> Path:
    """Write a document so that people and tools that compare texts can follow it; whole or not at all.

    Args:
        path: Where to write it; it is returned.
        content: Plain data; the entry ``digest`` is added.
        rows: Keys of the entries that are lists, with one line for every item; they stand last.
    """
    entries = {key: _line(value) for key, value in content.items() if key not in rows}
    entries["digest"] = _line(content_digest(content))
    lists = {key: ",\n  ".join(map(_line, content[key])) for key in rows if key in content}
    entries |= {key: f"[\n  {lines}\n ]" for key, lines in lists.items()}
    text = ",\n".join(f' "{key}": {entry}' for key, entry in entries.items())
    return write_atomically(path, f"{{\n{text}\n}}\n".encode())


def _line(value: Any) -> str:
    return json.dumps(value, allow_nan=False, ensure_ascii=False)


def _mapping(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    mapping = dict(pairs)
    names = [name for name, _ in pairs]
    for name in mapping if len(mapping) < len(pairs) else ():
        if names.count(name) > 1:
            raise DataError(name, mapping[name], "each key at most once; a mapping has this one twice")
    return mapping


def _whole_number(text: str) -> int | float:
    return int(text) if len(text) <= DIGITS else math.inf

"""Keeps on disk what the models of a scenario give to the planner, so that later commands need no Drake.

A file holds the component tree, limits of speed, and the digests of all files that these were read from. It
is used only while every one of these files, and the code that read them, is the same.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
import re
from collections.abc import Iterator
from contextlib import suppress
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

import coop_drake
from coop_drake.answers.digest import content_digest
from coop_drake.answers.limits import TeamLimits
from coop_drake.answers.problem import PlanningProblem
from coop_drake.files import write_atomically
from coop_drake.plant.stated_problem import stated_problem
from coop_drake.scenario.model import Scenario
from coop_drake.tree.component_tree import Body, Component, ComponentTree, ConvexShape, TreeJoint
from coop_drake.tree.pose import PlanarPose
from coop_drake.typed_data import convert_class, to_plain

_DAMAGE = (OSError, ValueError, KeyError, TypeError, AttributeError)
"""What reading a file that is missing, cut off or of another layout can raise."""

_ADDRESS = re.compile(
    rb"<(?:\w+:)?uri[^>]*>\s*([^<]+?)\s*<|filename\s*=\s*[\"']([^\"']+)|\"uri\"\s*:\s*\"([^\"]+)"
)
"""Addresses of other files in SDF, in URDF, and in glTF."""

_WITH_ADDRESSES = (".sdf", ".urdf", ".gltf")
"""Files in which addresses of other files are looked for; other meshes are complete in themselves."""


def kept_problem(scenario: Scenario, folder: Path) -> PlanningProblem | None:
    """Return the planning problem of a scenario if its models were read before and nothing has changed.

    A scenario with a kept problem is known to be valid.

    Args:
        scenario: As it was read from its file; it need not have been validated.
        folder: Where problems are kept.
    """
    try:
        content = json.loads(_file(scenario, folder).read_bytes())
        if content["digest"] != content_digest(content) or content["code"] != _code():
            return None
        if any(file_digest(Path(path)) != digest for path, digest in content["files"].items()):
            return None
        # A floor plan may have been read from a file that only its reader knows.
        if content["workspace"] != repr(scenario.workspace):
            return None
        limits = convert_class(content["limits"], TeamLimits)
        return stated_problem(scenario, _tree(content["tree"]), content["joints"], limits)
    except _DAMAGE:
        return None


def keep_problem(scenario: Scenario, problem: PlanningProblem, folder: Path) -> None:
    """Keep the problem of a scenario; nothing happens if the folder cannot be written.

    Args:
        scenario: As it was read from its file.
        problem: Its planning problem.
        folder: Where problems are kept; it is made when the first one is written.
    """
    files = source_files(scenario)
    if files is None:
        return
    counts = [
        sum(joint.robot == index for joint in problem.tree.joints) for index in range(len(files.robots))
    ]
    content = {
        "code": _code(),
        "files": {str(path): file_digest(path) for path in sorted(files.paths)},
        "workspace": repr(scenario.workspace),
        "joints": dict(zip(files.robots, counts, strict=True)),
        "tree": _plain(problem.tree),
        "limits": to_plain(problem.limits, TeamLimits),
    }
    text = json.dumps({**content, "digest": content_digest(content)})
    with suppress(OSError):
        write_atomically(_file(scenario, folder), text.encode())


def _file(scenario: Scenario, folder: Path) -> Path:
    """The file of a scenario; an edited scenario replaces its old one."""
    name = hashlib.sha256(str(scenario.path.resolve()).encode()).hexdigest()
    return folder / f"{name}.problem.json"


@cache
def _code() -> str:
    """Versions of Drake and of this package's sources, by the sizes and times of change of its files."""
    digest, drake = hashlib.sha256(), find_spec("pydrake")
    files = sorted(Path(coop_drake.__file__).parent.rglob("*.py"))
    if drake is not None and drake.origin is not None:
        files.append(Path(drake.origin).parent / "doc" / "drake" / "VERSION.TXT")
    for path in files:
        status = path.stat()
        digest.update(f"{path} {status.st_size} {status.st_mtime_ns}\n".encode())
    return digest.hexdigest()


def file_digest(path: Path) -> str:
    """SHA-256 of a file, an empty text where there is none."""
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else ""


@dataclasses.dataclass(frozen=True)
class Sources:
    """What a scenario's models were read from.

    Attributes:
        robots: Names of the robots in their order.
        paths: All files, those included that were looked for and do not exist.
    """

    robots: tuple[str, ...]
    paths: frozenset[Path]


def source_files(scenario: Scenario) -> Sources | None:
    """The files of a scenario, or None if it names a folder, whose content is not followed."""
    from coop_drake.scenario.assembly import assemble
    from coop_drake.scenario.packages import package_files

    assembly = assemble(scenario)
    models = [Path(d.add_model.file.removeprefix("file://")) for d in assembly.directives if d.add_model]
    found = {scenario.path.resolve(), *package_files(scenario.path), *assembly.nested}
    waiting = list(models)
    while waiting:
        path = waiting.pop()
        if path.is_dir():
            return None
        if path not in found:
            found.add(path)
            waiting += _named_in(path, assembly.packages)
    return Sources(tuple(robot.name for robot in assembly.robots), frozenset(found))


def _named_in(path: Path, packages: Any) -> Iterator[Path]:
    """Files that a model or a mesh names; addresses in packages that are not known are left out."""
    if path.suffix.lower() not in _WITH_ADDRESSES or not path.is_file():
        return
    for groups in _ADDRESS.findall(path.read_bytes()):
        scheme, separator, rest = b"".join(groups).decode(errors="replace").rpartition("://")
        if scheme in ("package", "model"):
            package, _, inside = rest.partition("/")
            if packages.Contains(package):
                yield Path(packages.GetPath(package)) / inside
        elif scheme in ("", "file") and not rest.startswith("data:"):
            yield path.parent / rest if not separator else Path(rest)


def _plain(tree: ComponentTree) -> dict[str, Any]:
    """A tree as data that JSON holds without rounding."""
    components = dataclasses.asdict(tree)["components"]
    for shape in (s for component in components for body in component["bodies"] for s in body["shapes"]):
        shape["vertices"] = shape["vertices"].tolist()
    return {"components": components, "unchecked_pairs": sorted(tree.unchecked_pairs)}


def _tree(data: dict[str, Any]) -> ComponentTree:
    """The tree of such data."""
    pairs = frozenset((first, second) for first, second in data["unchecked_pairs"])
    return ComponentTree(tuple(map(_component, data["components"])), pairs)


def _component(data: dict[str, Any]) -> Component:
    joint, bodies = data["joint"], []
    if joint is not None:
        joint = TreeJoint(**{**joint, "X_PJ": PlanarPose(**joint["X_PJ"]), "axis": tuple(joint["axis"])})
    for body in data["bodies"]:
        shapes = tuple(ConvexShape(np.array(s["vertices"]), s["radius"]) for s in body["shapes"])
        bodies.append(Body(body["name"], body["robot"], shapes))
    return Component(data["name"], data["parent"], joint, tuple(bodies))

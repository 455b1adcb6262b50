"""Robot models that others wrote: joints that fit, hulls in place of meshes, a frame for the gripper."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from math import atan2, isfinite, nan, pi
from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree import ElementTree

import numpy as np
import yaml
from defusedxml.ElementTree import fromstring
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import BodyIndex, Joint
from pydrake.systems.framework import Context

from coop_drake.errors import ScenarioError
from coop_drake.files import check_readable
from coop_drake.plant.chain import TILT, axis_in_world, is_circle, is_upright, limits_of
from coop_drake.plant.parsing import joints_of
from coop_drake.plant.problem import limit_notes
from coop_drake.tree.arrays import FloatArray

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

# Imports robot models: everything in one folder, meshes as convex hulls that Drake can read.

_LARGEST_MODEL, _LARGEST_MESH = 20.0, 200.0
"""Largest files [MB]: models of whole robots have less than one, their meshes some tens."""
_DRAKE = "http://drake.mit.edu"
_DROPPED: tuple[str, ...] = ("calibration", "safety_controller", "verbose", "transmission", "gazebo")
_DROPPED += ("ros2_control", "plugin", "sensor", "mimic")
_GROUP = "own_links"
_NEARLY_RIGHT = 1e-5
"""Largest error of a right angle in a file, which is corrected: tilted axes would leave the plane [rad]."""

_MOMENTS = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")


@dataclass(frozen=True)
class ImportedRobot:
    """An imported model with all files that it needs.

    Attributes:
        name: Name of the model file, without a folder.
        files: Contents by paths relative to one folder, the model's own among them.
        notes: Sentences about what was changed.
    """

    name: str
    files: dict[str, bytes]
    notes: tuple[str, ...]


def import_robot(path: Path, packages: Mapping[str, Path] | None = None) -> ImportedRobot:
    """Read a URDF or SDF file and make it self-contained.

    Every mesh becomes its convex hull, which Drake's proximity queries and the footprints use in any case.
    Links with visual but no collision geometry get the hull of the visual one. Seen from above the links of
    one robot mostly cover each other, so collisions between them are filtered: the joints' limits must
    exclude them. Sensors, transmissions and mimics are left out.

    Args:
        path: The model.
        packages: Folders of ``package://`` addresses; folders above the model are known by their names.

    Raises:
        ScenarioError: The model or a mesh cannot be read; with file, element and what is allowed.
    """
    root = _parse(path)
    work = _Work(path, dict(packages or {}))
    work.drop(root)
    links = list(root.iter("link"))
    if not links:
        raise ScenarioError(str(path), "the file", path.name, "a model with links")
    for link in links:
        work.make_solid(link)
        work.mend_inertia(link)
    _filter_own(root, [str(link.get("name")) for link in links])
    text = ElementTree.tostring(root, encoding="unicode")
    work.files[path.name] = f'<?xml version="1.0"?>\n{text}\n'.encode()
    return ImportedRobot(path.name, work.files, (*limit_notes(root), *work.notes()))


def _parse(path: Path) -> Element:
    from defusedxml import DefusedXmlException
    from defusedxml.ElementTree import ParseError, fromstring

    ElementTree.register_namespace("drake", _DRAKE)
    if path.suffix not in (".urdf", ".sdf"):
        raise ScenarioError(str(path), "the name", path.name, "a .urdf or .sdf file (run xacro before)")
    try:
        root: Element = fromstring(check_readable(path, _LARGEST_MODEL).read_bytes())
    except (OSError, ParseError, DefusedXmlException, ValueError) as error:
        raise ScenarioError(str(path), "the file", str(error), "a readable URDF or SDF model") from error
    return root


@dataclass
class _Work:
    """A model while it is imported, with the files and notes so far."""

    path: Path
    packages: dict[str, Path]
    files: dict[str, bytes] = field(default_factory=dict)
    dropped: set[str] = field(default_factory=set)
    thickened: list[str] = field(default_factory=list)
    mended: list[str] = field(default_factory=list)
    squared: int = 0

    def notes(self) -> Iterator[str]:
        """Yield sentences about what was changed."""
        if self.dropped:
            yield f"left out: {', '.join(sorted(self.dropped))}"
        if self.thickened:
            yield f"made solid by their pictures' hulls: {', '.join(self.thickened)}"
        if self.mended:
            yield f"impossible inertia made round: {', '.join(self.mended)}"
        if self.squared:
            yield f"{self.squared} angles within {_NEARLY_RIGHT:g} rad of a right angle made right"
        yield "links of the robot are filtered from colliding with one another"

    def drop(self, element: Element) -> None:
        """Remove elements that no planar rigid body needs."""
        for child in list(element):
            colour = child.get("rgba") if child.tag == "color" else None
            if child.tag in _DROPPED or (colour is not None and len(colour.split()) != 4):
                self.dropped.add(str(child.tag))
                element.remove(child)
            else:
                if child.tag == "dynamics" and self._number(child.attrib.pop("friction", "0"), child.tag):
                    self.dropped.add("friction")
                if child.tag == "origin" and "rpy" in child.attrib:
                    child.set("rpy", self._squared(child.attrib["rpy"]))
                if child.tag == "link":
                    child.attrib.pop("type", None)
                self.drop(child)

    def _squared(self, rpy: str) -> str:
        """The angles, with rounded right angles corrected."""
        angles = []
        for text in rpy.split():
            angle = self._number(text, "rpy")
            quarters = round(angle / (0.5 * pi))
            near = 0.0 < abs(angle - quarters * 0.5 * pi) <= _NEARLY_RIGHT
            self.squared += near
            angles.append(repr(quarters * 0.5 * pi) if near else text)
        return " ".join(angles)

    def _number(self, text: str, where: str) -> float:
        """A finite number of the file."""
        try:
            number = float(text)
        except ValueError:
            number = nan
        if not isfinite(number):
            raise ScenarioError(str(self.path), where, text, "a finite number")
        return number

    def make_solid(self, link: Element) -> None:
        """Replace a link's meshes by hulls; without collision geometry its visual geometry is copied."""
        name = str(link.get("name"))
        for kind in ("collision", "visual"):
            for place, element in enumerate(link.findall(kind)):
                for mesh in element.iter("mesh"):
                    self._make_hull(mesh, f"{name}_{kind}_{place}")
        visuals = link.findall("visual")
        if visuals and link.find("collision") is None:
            self.thickened.append(name)
            for place, visual in enumerate(visuals):
                copy = ElementTree.SubElement(link, "collision", {"name": f"{name}_shown_{place}"})
                copy.extend(child for child in visual if child.tag in ("origin", "pose", "geometry"))

    def mend_inertia(self, link: Element) -> None:
        """Give a body that no mass distribution has the same greatest moment about every axis."""
        inertia = link.find("inertial/inertia")
        if inertia is None:
            return
        said = {key: inertia.get(key) or inertia.findtext(key) or "0" for key in _MOMENTS}
        name = str(link.get("name"))
        xx, yy, zz, xy, xz, yz = (self._number(said[key], f"{key} of {name}") for key in _MOMENTS)
        moments = np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        if moments[0] >= 0.0 and moments[0] + moments[1] >= moments[2] * (1.0 - 1e-9):
            return
        self.mended.append(name)
        for key in _MOMENTS:
            value = f"{max(moments[2], 0.0):.9g}" if key in _MOMENTS[:3] else "0"
            child = inertia.find(key)
            if child is None:
                inertia.set(key, value)
            else:
                child.text = value

    def _make_hull(self, mesh: Element, name: str) -> None:
        uri = mesh.find("uri")
        address = mesh.get("filename") if uri is None else (uri.text or "").strip()
        scale = mesh.get("scale") or mesh.findtext("scale") or "1 1 1"
        try:
            factors = np.array([float(part) for part in scale.split()])
            points = _vertices(self._found(address or "")) * factors
            content = _hull(points)
        except (ScenarioError, ModuleNotFoundError):
            raise
        except Exception as error:  # Readers of meshes raise whatever they like.
            message = f"{type(error).__name__}: {' '.join(str(error).split())[:200]}"
            raise ScenarioError(
                str(self.path), f"mesh of {name}", address, f"a readable mesh ({message})"
            ) from error
        file = f"meshes/{name.replace('/', '_')}.obj"
        self.files[file] = content
        if uri is None:
            mesh.set("filename", file)
            mesh.attrib.pop("scale", None)
        else:
            uri.text = file
            for child in mesh.findall("scale"):
                mesh.remove(child)

    def _found(self, address: str) -> Path:
        """Path of the file of a mesh."""
        if address.startswith(("package://", "model://")):
            package, _, inside = address.partition("://")[2].partition("/")
            folders = [folder for folder in self.path.resolve().parents if folder.name == package]
            known = self.packages.get(package, folders[0] if folders else None)
            if known is None:
                allowed = f"a package that is known: say --package {package}=FOLDER"
                raise ScenarioError(str(self.path), "mesh", address, allowed)
            found = known / inside
        else:
            found = self.path.parent / address.removeprefix("file://")
        if not found.is_file():
            raise ScenarioError(str(self.path), "mesh", address, f"a file that exists (looked for {found})")
        return found


def _vertices(path: Path) -> FloatArray:
    """Vertices of a mesh, shape (n, 3) [m]."""
    import trimesh

    mesh = trimesh.load_mesh(check_readable(path, _LARGEST_MESH), process=False)
    points = np.asarray(mesh.vertices, dtype=float)
    if not len(points) or not np.isfinite(points).all():
        raise ValueError("it has no corners, or some that are not finite")
    return np.unique(points, axis=0)


def _hull(points: FloatArray) -> bytes:
    """The convex hull as an OBJ file; flat points get a thickness of a millimetre."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        hull = ConvexHull(points)
    except QhullError:
        around = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * 5e-4
        points = (points[:, None] + around[None]).reshape(-1, 3)
        hull = ConvexHull(points)
    number = {int(vertex): place + 1 for place, vertex in enumerate(sorted(hull.vertices))}
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in points[sorted(hull.vertices)].tolist()]
    for simplex, normal in zip(hull.simplices, hull.equations[:, :3], strict=True):
        a, b, c = points[simplex]
        outwards = float(np.cross(b - a, c - a) @ normal) > 0.0
        corners = simplex if outwards else simplex[::-1]
        lines.append("f " + " ".join(str(number[int(vertex)]) for vertex in corners))
    return ("\n".join(lines) + "\n").encode()


def _filter_own(root: Element, links: list[str]) -> None:
    """Filter collisions between the robot's own links."""
    is_sdf = root.tag == "sdf"
    model = root.find("model") if is_sdf else root
    if model is None:
        return
    group = ElementTree.SubElement(model, f"{{{_DRAKE}}}collision_filter_group", {"name": _GROUP})
    for link in links:
        member = ElementTree.SubElement(group, f"{{{_DRAKE}}}member")
        if is_sdf:
            member.text = link
        else:
            member.set("link", link)
    ignored = ElementTree.SubElement(group, f"{{{_DRAKE}}}ignored_collision_filter_group")
    if is_sdf:
        ignored.text = _GROUP
    else:
        ignored.set("name", _GROUP)


# A robot from elsewhere: its joints, and where its gripper is.


@dataclass(frozen=True)
class SurveyedJoint:
    """One joint that can move.

    Attributes:
        name: Its name in the model.
        kind: Drake's name for its type.
        axis: In the base's frame, as text.
        limits: As text [rad or m].
        verdict: ``planar``, ``fix it`` for what leaves the plane, or ``fixed`` where a value was given.
        rest: The value that was given, or else the one between the limits that is nearest to zero [rad or m].
    """

    name: str
    kind: str
    axis: str
    limits: str
    verdict: str
    rest: float = 0.0


def survey_joints(path: Path, values: Mapping[str, float] | None = None) -> tuple[SurveyedJoint, ...]:
    """Judge every movable joint of a model, with meshes that Drake reads, whose base stands upright.

    ``values`` say where some joints are fixed; all others stand at zero [rad or m].

    Raises:
        ScenarioError: Drake cannot read the model, or a value is for no joint of it.
    """
    plant, context = plant_at(path, values or {})
    return tuple(_judged(joint, context, joint.name() in (values or {})) for joint in _movable(plant))


def plant_at(path: Path, values: Mapping[str, float]) -> tuple[MultibodyPlant, Context]:
    """Parse a model that stands alone, and place some of its joints, by name [rad or m].

    Raises:
        ScenarioError: Drake cannot read the model, or a value is for no joint of it.
    """
    plant = MultibodyPlant(0.0)
    try:
        Parser(plant).AddModels(str(path))
        plant.Finalize()
    except RuntimeError as error:
        message = " ".join(str(error).split())
        raise ScenarioError(str(path), "the model", path.name, f"what Drake can read ({message})") from error
    context = plant.CreateDefaultContext()
    known = {joint.name(): joint for joint in _movable(plant)}
    for name, value in values.items():
        if name not in known or known[name].num_positions() != 1:
            movable = ", ".join(known) or "none"
            raise ScenarioError(str(path), "--fix", name, f"a joint that can be fixed, one of {movable}")
        positions = plant.GetPositions(context)
        positions[known[name].position_start()] = value
        plant.SetPositions(context, positions)
    return plant, context


def _movable(plant: MultibodyPlant) -> list[Joint]:
    return [joint for joint in joints_of(plant) if joint.type_name() not in ("weld", "quaternion_floating")]


def _judged(joint: Joint, context: Context, fixed: bool) -> SurveyedJoint:
    kind = str(joint.type_name())
    if kind not in ("revolute", "prismatic"):
        return SurveyedJoint(joint.name(), kind, "", "", "fixed" if fixed else "fix it")
    axis = axis_in_world(joint, context)
    planar = is_upright(axis) if kind == "revolute" else abs(float(axis[2])) <= TILT
    lower, upper = limits_of(joint)
    circle = is_circle(joint)
    endless = not (circle or (isfinite(lower) and isfinite(upper)))
    return SurveyedJoint(
        joint.name(),
        kind,
        "(" + ", ".join(f"{value + 0.0:.3g}" for value in np.round(axis, 6)) + ")",
        "no limits, a circle" if circle else f"{lower:.4g} to {upper:.4g}",
        "fixed" if fixed else "planar" if planar and not endless else "fix it",
        float(joint.GetOnePosition(context)) if fixed else min(max(0.0, lower), upper),
    )


# Adds a gripper frame to a model from elsewhere, and words the lines of a scenario that use the model.


GRIPPER = "gripper"
"""Name of the frame, as in the shipped models."""

_SMALLEST_REACH = 1e-3
"""A link nearer to the base's axis than this has no direction back to it [m]."""


def has_gripper(model: Path) -> bool:
    """Whether a model has a frame or link of that name."""
    return plant_at(model, {})[0].HasFrameNamed(GRIPPER)


def with_gripper(model: Path, link: str, values: Mapping[str, float]) -> bytes:
    """Add the frame ``gripper`` at the origin of a link, upright, with x pointing back to the base.

    Args:
        model: A URDF or SDF file that Drake reads, without such a frame.
        link: Name of the link whose origin is held at the object.
        values: Where joints stand when the frame is upright [rad or m]; all others stand at zero.

    Returns:
        The content of the file with the frame.

    Raises:
        ScenarioError: There is no such link, or it lies above the base.
    """
    plant, context = plant_at(model, values)
    bodies = [plant.get_body(BodyIndex(number)) for number in range(1, plant.num_bodies())]
    if link not in (names := [body.name() for body in bodies]):
        raise ScenarioError(str(model), "--gripper", link, f"a link of the model, one of {', '.join(names)}")
    X_WL = bodies[names.index(link)].EvalPoseInWorld(context)
    base = next(body for body in bodies if body.is_floating_base_body())
    back = (base.EvalPoseInWorld(context).translation() - X_WL.translation())[:2]
    if np.hypot(*back) < _SMALLEST_REACH:
        raise ScenarioError(str(model), "--gripper", link, "a link that is not above the base's origin")
    upright = RotationMatrix.MakeZRotation(atan2(back[1], back[0]))
    X_LG = X_WL.inverse() @ RigidTransform(upright, X_WL.translation())
    root = fromstring(model.read_bytes())
    (_add_to_urdf if root.tag == "robot" else _add_to_sdf)(root, link, X_LG)
    return f'<?xml version="1.0"?>\n{ElementTree.tostring(root, encoding="unicode")}\n'.encode()


def scenario_lines(model: Path, joints: Sequence[SurveyedJoint], gripper: str) -> str:
    """The lines with which a scenario uses a model, as YAML: directives, start, fixed joints.

    Args:
        model: Path of the model, relative to the scenario.
        joints: All its movable joints.
        gripper: The frame that is welded to the object.
    """
    name = "robot_0"
    lines: dict[str, object] = {
        "directives": [
            {"add_model": {"name": name, "file": model.as_posix()}},
            {"add_weld": {"parent": "object::grasp_0", "child": f"{name}::{gripper}"}},
        ],
        "start": {"joints": {name: [joint.rest for joint in joints if joint.verdict == "planar"]}},
    }
    if fixed := {joint.name: joint.rest for joint in joints if joint.verdict != "planar"}:
        lines["fixed_joints"] = {name: fixed}
    text: str = yaml.safe_dump(lines, default_flow_style=None, sort_keys=False, width=1000)
    return text


def _add_to_urdf(root: ElementTree.Element, link: str, X_LG: RigidTransform) -> None:
    ElementTree.SubElement(root, "link", {"name": GRIPPER})
    joint = ElementTree.SubElement(root, "joint", {"name": f"{GRIPPER}_mount", "type": "fixed"})
    ElementTree.SubElement(joint, "parent", {"link": link})
    ElementTree.SubElement(joint, "child", {"link": GRIPPER})
    ElementTree.SubElement(joint, "origin", {"xyz": _words(X_LG.translation()), "rpy": _angles(X_LG)})


def _add_to_sdf(root: ElementTree.Element, link: str, X_LG: RigidTransform) -> None:
    model = next(root.iter("model"))
    frame = ElementTree.SubElement(model, "frame", {"name": GRIPPER, "attached_to": link})
    ElementTree.SubElement(frame, "pose").text = f"{_words(X_LG.translation())} {_angles(X_LG)}"


def _angles(X_LG: RigidTransform) -> str:
    return _words(RollPitchYaw(X_LG.rotation()).vector())


def _words(numbers: Sequence[float]) -> str:
    return " ".join(f"{number + 0.0:.16g}" for number in numbers)

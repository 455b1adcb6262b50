"""Imports robot models: everything in one folder, meshes as convex hulls that Drake can read."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from math import isfinite, nan, pi
from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree import ElementTree

import numpy as np

from coop_drake.errors import ScenarioError
from coop_drake.files import check_readable
from coop_drake.plant.problem import limit_notes
from coop_drake.tree.pose import FloatArray

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

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

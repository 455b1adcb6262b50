"""Reads the lines of an SVG drawing: the shapes that are seen, with all their transforms and clips."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from math import hypot, inf
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from coop_drake.errors import FloorPlanError
from coop_drake.floor_plans.settings import FloorPlanSettings
from coop_drake.floor_plans.svg_style import (
    INITIAL,
    LABEL,
    NUMBER,
    SVG,
    Cascade,
    SvgPage,
    Values,
    length,
    name_of,
    numbers,
    opacity,
    paints,
    read_svg_page,
    view_box,
)
from coop_drake.floor_plans.walls import Drawing, Wall, flatten, refuse_many
from coop_drake.tree.arrays import FloatArray

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

_PATH_DATA = re.compile(rf"\s*[Mm](?:[MmZzLlHhVvCcSsQqTtAa]|{NUMBER}|[\s,])*")
_TRANSFORM = re.compile(r"(matrix|translate|scale|rotate|skewX|skewY)\s*\(([^()]*)\)[\s,]*")
_COUNTS = {
    "matrix": (6,),
    "translate": (1, 2),
    "scale": (1, 2),
    "rotate": (1, 3),
    "skewX": (1,),
    "skewY": (1,),
}
"""How many numbers the functions of the attribute ``transform`` take."""

_GROUPS = ("svg", "g", "a", "switch", "symbol")
_SHAPES = ("path", "rect", "circle", "ellipse", "line", "polyline", "polygon")
_TOLD = ("text", "image", "foreignObject", "script", "animate", "animateMotion", "animateTransform", "set")
"""Elements that make no walls, and are counted in a note."""
_NOT_SHOWN: tuple[str, ...] = (
    "defs",
    "symbol",
    "clipPath",
    "mask",
    "marker",
    "pattern",
    "hatch",
    "linearGradient",
    "filter",
)
_NOT_SHOWN += (
    "radialGradient",
    "meshgradient",
    "solidcolor",
    "metadata",
    "title",
    "desc",
    "style",
    "view",
    "font",
)
"""Elements whose content is not shown where they stand."""

_HREFS = ("href", "{http://www.w3.org/1999/xlink}href")
_LENGTHS = {
    "rect": ("x", "y", "width", "height", "rx", "ry"),
    "circle": ("cx", "cy", "r"),
    "ellipse": ("cx", "cy", "rx", "ry"),
    "line": ("x1", "y1", "x2", "y2"),
}
_ALONG_X = ("x", "width", "cx", "rx", "x1", "x2")
_ALONG_Y = ("y", "height", "cy", "ry", "y1", "y2")
"""Lengths of which percentages refer to the width and to the height of the page."""
_NEVER_NEGATIVE = ("width", "height", "rx", "ry", "r")
_ASPECT = re.compile(r"none|x(?:Min|Mid|Max)Y(?:Min|Mid|Max)(?: (?:meet|slice))?")

_SIMILAR = 1e-9
"""Ratio by which a transform may stretch one direction more than another and count as one that does not."""
_MOST_ELEMENTS = 100_000
"""Elements that are read at most, counted again in every clone."""
_MOST_CLONES = 2_000
"""Clones that are read at most: clones of clones can multiply without end."""
_DEEPEST = 100
"""Levels of elements inside each other that are allowed."""


def read_svg(path: Path, settings: FloorPlanSettings) -> Drawing:
    """Read all lines that are seen; the width of a stroke is part of the wall.

    Raises:
        FloorPlanError: The file is damaged, or contains something that the reader could only guess.
    """
    page = read_svg_page(path, settings)
    walk = _Walk(str(path), page, settings)
    walls = tuple(walk.walls(page.root, _Style(viewport=page.size)))
    for layer in settings.layers:
        if layer not in walk.layers:
            known = ", ".join(sorted(walk.layers)) or "none"
            raise FloorPlanError(
                walk.file, "layers", f"no group has the label or id {layer!r}", f"known: {known}"
            )
    return Drawing(walls, tuple(walk.notes()))


@dataclass(frozen=True)
class _Style:
    """What an element passes on to those inside it.

    Attributes:
        values: The properties that elements inherit.
        transform: From its coordinates to those of the page.
        viewport: Width and height that percentages refer to, in its coordinates; None if they are not known.
        clip: What clip paths and inner pages let be seen, in W [m]; None for all.
        chosen: Whether it is part of a layer that is to be read.
        depth: Number of elements around it.
    """

    values: Values = field(default_factory=lambda: INITIAL)
    transform: str = ""
    viewport: tuple[float, float] | None = None
    clip: BaseGeometry | None = None
    chosen: bool = False
    depth: int = 0

    def cut(self, clip: BaseGeometry) -> _Style:
        """Return this style with less to be seen."""
        return replace(self, clip=clip if self.clip is None else self.clip.intersection(clip))


@dataclass
class _Walk:
    """One pass through the tree, with counts of what was left out."""

    file: str
    page: SvgPage
    settings: FloorPlanSettings
    layers: set[str] = field(default_factory=set)
    told: Counter[str] = field(default_factory=Counter)
    count: int = 0
    clones: int = 0
    points: int = 0

    def __post_init__(self) -> None:
        self.cascade = Cascade(self.file, self.page)
        self.by_id: dict[str, Element] = {}
        for element in self.page.root.iter():
            self.by_id.setdefault(element.get("id", ""), element)

    def notes(self) -> Iterator[str]:
        """Yield sentences about what was left out or assumed."""
        said = {
            "seen": "shapes left out because they are not seen",
            "dashed": "dashed shapes read as whole ones",
        }
        for what, count in sorted(self.told.items()):
            yield f"{said[what]}: {count}" if what in said else f"{count} <{what}> left out"

    def refuse(self, element: Element, finding: str, remedy: str) -> FloorPlanError:
        """An error that names the element."""
        return FloorPlanError(self.file, name_of(element), finding, remedy)

    def walls(self, element: Element, outer: _Style, use: Element | None = None) -> Iterator[Wall]:
        """Yield all lines of an element and of the elements inside it; ``use`` is what clones it."""
        self.count += 1
        if self.count > _MOST_ELEMENTS or outer.depth > _DEEPEST:
            finding = f"more than {_MOST_ELEMENTS:,} elements, or {_DEEPEST} levels of them"
            raise self.refuse(element, finding, "unlink clones that hold themselves; choose layers")
        tag = str(element.tag).removeprefix(SVG)
        if tag not in (*_GROUPS, *_SHAPES, "use") or (tag == "symbol" and use is None):
            self._leave_out(element, tag)
            return
        style, shown = self._style(element, tag, outer)
        if not shown or "requiredExtensions" in element.attrib:
            self.told["seen"] += sum(str(e.tag).removeprefix(SVG) in _SHAPES for e in element.iter())
        elif tag in _SHAPES:
            if style.chosen or not self.settings.layers:
                yield from self._shape(element, tag, style)
        elif tag == "use":
            yield from self._clone(element, style)
        else:
            if tag in ("svg", "symbol") and element is not self.page.root:
                style = self._inner_page(element, style, use)
            for child in self._chosen(element) if tag == "switch" else element:
                yield from self.walls(child, style)

    def _leave_out(self, element: Element, tag: str) -> None:
        """Count an element that makes no walls; refuse one that is not known and holds shapes."""
        if tag in _TOLD:
            self.told[tag] += 1
        elif tag in _NOT_SHOWN or tag.startswith("{"):
            return
        elif any(str(inside.tag).removeprefix(SVG) in _SHAPES for inside in element.iter()):
            raise self.refuse(element, "the reader knows no such element, and it holds shapes", "ungroup it")

    def _style(self, element: Element, tag: str, outer: _Style) -> tuple[_Style, bool]:
        """What an element looks like, and whether it and what is inside are shown at all."""
        values = self.cascade.values(element, outer.values)
        names = {name for name in (element.get(LABEL), element.get("id")) if name}
        if tag in _GROUPS:
            self.layers |= names
        for key in ("filter", "mask"):
            if values[key] != "none":
                raise self.refuse(element, f"a {key} decides what is seen of it", f"remove the {key}")
        if element.get("systemLanguage") is not None:
            raise self.refuse(
                element, "it is shown to readers of some languages only", "remove systemLanguage"
            )
        if element is self.page.root and values["transform"].strip() not in ("", "none"):
            raise self.refuse(element, "the page has a transform", "move it to a group")
        style = replace(
            outer,
            values=values,
            transform=f"{outer.transform} {self._transform(element, values['transform'])}",
            chosen=outer.chosen or bool(names & set(self.settings.layers)),
            depth=outer.depth + 1,
        )
        if values["clip-path"] != "none":
            style = style.cut(self._clip(element, style))
        return style, values["display"] != "none" and opacity(values["opacity"]) > 0.0

    def _transform(self, element: Element, text: str) -> str:
        """A transform in the words that SVG 1.1 has for it."""
        text = "" if text.strip() == "none" else text.strip()
        try:
            known = all(len(numbers(inside)) in _COUNTS[name] for name, inside in _TRANSFORM.findall(text))
        except ValueError:
            known = False
        if not known or _TRANSFORM.sub("", text):
            raise self.refuse(element, f"transform {text!r} is none that SVG knows", "ungroup it")
        return text

    def _chosen(self, switch: Element) -> Iterator[Element]:
        """The first element inside a switch that is not for others to show, as a list of at most one."""
        for child in switch:
            if isinstance(child.tag, str) and "requiredExtensions" not in child.attrib:
                yield child
                return

    def _clone(self, use: Element, style: _Style) -> Iterator[Wall]:
        self.clones += 1
        if self.clones > _MOST_CLONES:
            finding = f"more than {_MOST_CLONES:,} clones, counted with those inside clones"
            raise self.refuse(use, finding, "unlink them, or choose layers")
        address = next((use.attrib[key] for key in _HREFS if key in use.attrib), "")
        target = self.by_id.get(address[1:]) if address[:1] == "#" and len(address) > 1 else None
        if target is None:
            raise self.refuse(use, f"it shows {address!r}, which is not in the file", "unlink the clone")
        self.cascade.check_clone(target)
        x, y = (self._length(use, key, style) for key in ("x", "y"))
        moved = replace(style, transform=f"{style.transform} translate({x!r}, {y!r})")
        yield from self.walls(target, moved, use)

    def _inner_page(self, element: Element, style: _Style, use: Element | None) -> _Style:
        """The style inside an ``svg`` or ``symbol``: its page is laid into its place, and cut off there."""
        from svgelements import Viewbox

        if element.get("refX", element.get("refY")) is not None:
            raise self.refuse(element, "it has a point of reference", "unlink the clone")
        x, y = (self._length(element, key, style) for key in ("x", "y"))
        width, height = (
            self._length(use if use is not None and key in use.attrib else element, key, style, "100%")
            if style.viewport or key in element.attrib or (use is not None and key in use.attrib)
            else inf
            for key in ("width", "height")
        )
        if min(width, height) < 0.0:
            raise self.refuse(element, "its size is negative", "ungroup it")
        box, aspect = view_box(self.file, element), element.get("preserveAspectRatio", "xMidYMid").strip()
        overflow = style.values["overflow"]
        if overflow not in ("visible", "auto", "hidden", "scroll", "clip"):
            raise self.refuse(element, f"overflow: {overflow} is not read", "ungroup it")
        is_cut = overflow not in ("visible", "auto")
        if max(width, height) == inf and (box or is_cut):
            raise self.refuse(
                element, "an inner page without a size", "ungroup it, or state width and height"
            )
        if not _ASPECT.fullmatch(aspect):
            raise self.refuse(element, f"preserveAspectRatio {aspect!r} is none that SVG knows", "ungroup it")
        if is_cut:
            corners = np.array([(x, y), (x + width, y), (x + width, y + height), (x, y + height)])
            style = style.cut(Polygon(self._placed(corners, self._matrix(style))))
        laid = f"translate({x!r}, {y!r})"
        if box:
            laid = Viewbox.viewbox_transform(x, y, width, height, *box, aspect)
        size = box[2:] if box else None if width == inf else (width, height)
        return replace(style, transform=f"{style.transform} {laid}", viewport=size)

    def _clip(self, element: Element, style: _Style) -> BaseGeometry:
        """What the clip path of an element lets be seen, in W [m]; no less than that."""
        match = re.fullmatch(r"url\(\s*[\"']?#([^\"')]+)[\"']?\s*\)", style.values["clip-path"])
        clip = self.by_id.get(match[1]) if match else None
        remedy = "cut the lines off in the drawing program, and remove the clip path"
        if clip is None or str(clip.tag).removeprefix(SVG) != "clipPath":
            raise self.refuse(element, f"its clip path {style.values['clip-path']} is not read", remedy)
        inside = self.cascade.values(clip, INITIAL)
        if clip.get("clipPathUnits", "userSpaceOnUse") != "userSpaceOnUse" or inside["clip-path"] != "none":
            raise self.refuse(clip, "it is cut itself, or is a part of what it cuts", remedy)
        outer = f"{style.transform} {self._transform(clip, inside['transform'])}"
        seen: list[Polygon] = []
        for child in clip:
            tag, values = str(child.tag).removeprefix(SVG), self.cascade.values(child, inside)
            if tag in ("title", "desc", "metadata") or values["display"] == "none":
                continue
            if tag not in _SHAPES or values["clip-path"] != "none":
                raise self.refuse(clip, f"it holds {name_of(child)}, which is not read in clip paths", remedy)
            if values["visibility"] == "visible":
                own = replace(style, transform=f"{outer} {self._transform(child, values['transform'])}")
                seen += self._areas(child, tag, own, remedy)
        return shapely.union_all(seen) if seen else Polygon()

    def _areas(self, element: Element, tag: str, style: _Style, remedy: str) -> list[Polygon]:
        """The areas inside a shape of a clip path, in W [m], grown by what chords miss of its curves."""
        areas: list[Polygon] = []
        for pieces, _ in self._curves(element, tag, style):
            points, strays = self._flat(pieces, style)
            area = Polygon(points) if len(points) > 2 else Polygon()
            if not area.is_valid or any(area.intersects(other) for other in areas):
                raise self.refuse(element, "a clip path whose outlines meet is not read", remedy)
            areas.append(area.buffer(1.02 * strays, join_style="mitre") if strays else area)
        return areas

    def _shape(self, element: Element, tag: str, style: _Style) -> Iterator[Wall]:
        values = style.values
        width = self._stroke_width(element, style)
        stroked, filled = paints(values, "stroke") and width > 0.0, tag != "line" and paints(values, "fill")
        if values["visibility"] in ("hidden", "collapse") or not (stroked or filled):
            self.told["seen"] += 1
            return
        if stroked and values["vector-effect"] != "none":
            finding = f"vector-effect: {values['vector-effect']} gives its stroke a width of its own"
            raise self.refuse(element, finding, "remove it")
        self.told.update(self._assumed(values, tag, stroked=stroked))
        curves = self._curves(element, tag, style)
        # The factors by which the transform stretches the directions that it stretches most and least.
        most, least = np.linalg.svd(self._matrix(style)[:, :2], compute_uv=False).tolist()
        even = most - least <= _SIMILAR * most
        for pieces, closed in curves:
            points, strays = self._flat(pieces, style)
            if closed and (points[0] == points[-1]).all():
                points = points[:-1]
            closed = closed and len(points) > 2
            # The end of a curve, or of what is stretched, is no edge at a right angle to the last chord.
            plain = even and strays == 0.0
            square = 1.0 if plain or values["stroke-linecap"] != "square" else 2.0**0.5
            half_width = 0.5 * width * square * most * self.page.metre + strays if stroked else strays
            yield Wall(
                points,
                half_width,
                closed,
                name_of(element),
                flat=plain and values["stroke-linecap"] == "butt",
                mitre=self._mitre(points, closed, values, most / least if least else inf) if stroked else 2.0,
                clip=style.clip,
            )
            if filled and len(points) > 2:
                yield from self._edges(element, points, closed, style)

    def _edges(self, element: Element, points: FloatArray, closed: bool, style: _Style) -> Iterator[Wall]:
        """Edges of a filled area beside its outline: where that is open, and where the area is cut off."""
        if not closed:
            ends, place = np.array([points[-1], points[0]]), f"{name_of(element)}, whose fill ends here"
            yield Wall(ends, 0.0, closed=False, place=place, clip=style.clip)
        if style.clip is not None:
            cuts = shapely.make_valid(Polygon(points)).intersection(style.clip.boundary)
            for part in shapely.get_parts(shapely.get_parts(cuts)):
                if part.length > 0.0 and part.geom_type == "LineString":
                    place = f"{name_of(element)}, where it is cut off"
                    yield Wall(shapely.get_coordinates(part), 0.0, closed=False, place=place)

    def _assumed(self, values: Values, tag: str, *, stroked: bool) -> Iterator[str]:
        """Yield the words of what is left out of a shape, or read as more than it is."""
        if stroked and values["stroke-dasharray"] != "none":
            yield "dashed"
        marked = any(values[name] != "none" for name in values if name.startswith("marker"))
        if marked and tag in ("path", "line", "polyline", "polygon"):
            yield "marker"

    def _mitre(self, points: FloatArray, closed: bool, values: Values, stretch: float) -> float:
        """How far the sharpest mitred corner of a stroke reaches, over half its width [-]; two at least."""
        if values["stroke-linejoin"] in ("round", "bevel"):
            return 2.0
        try:
            limit = float(values["stroke-miterlimit"])
        except ValueError:
            limit = inf
        ring = np.vstack([points[-1:], points, points[:1]]) if closed else points
        steps = np.diff(ring, axis=0)
        steps = steps[np.hypot(*steps.T) > 0.0]
        directions = np.arctan2(steps[:, 1], steps[:, 0])
        # A corner that turns by a reaches 1 / cos(a / 2) half widths; SVG cuts those beyond the limit.
        with np.errstate(divide="ignore"):
            reach = 1.0 / np.abs(np.cos(0.5 * np.diff(directions)))
        mitred = reach[reach <= 1.01 * limit * min(stretch, 1e3)]
        return 1.01 * float(mitred.max(initial=2.0))

    def _stroke_width(self, element: Element, style: _Style) -> float:
        whole = hypot(*style.viewport) / 2.0**0.5 if style.viewport else None
        place = f"{name_of(element)} stroke-width"
        width = length(style.values["stroke-width"], self.file, place, whole)
        if width < 0.0:
            raise FloorPlanError(self.file, place, "it is negative", "give a positive width")
        return width

    def _length(self, element: Element, key: str, style: _Style, usual: str = "0") -> float:
        """A length of an element, in its coordinates."""
        whole = None
        if style.viewport:
            width, height = style.viewport
            whole = (
                width if key in _ALONG_X else height if key in _ALONG_Y else hypot(width, height) / 2.0**0.5
            )
        text = element.get(key, usual)
        return length(usual if text == "auto" else text, self.file, f"{name_of(element)} {key}", whole)

    def _curves(self, element: Element, tag: str, style: _Style) -> list[tuple[list[Any], bool]]:
        """Control points of the pieces of each outline, in the shape's coordinates; whether it is closed."""
        from svgelements import Path as Outline

        try:
            outline = Outline(self._outline(element, tag, style))
            curves = [_pieces(subpath) for subpath in outline.as_subpaths()]
        except (ValueError, TypeError, IndexError, ZeroDivisionError, OverflowError) as error:
            raise self.refuse(
                element, f"its numbers make no shape ({error})", "draw it anew or delete it"
            ) from error
        return [(pieces, closed) for pieces, closed in curves if pieces]

    def _flat(self, pieces: list[Any], style: _Style) -> tuple[FloatArray, float]:
        """The points of an outline in W [m], and how far its curves stray from its chords [m]."""
        matrix = self._matrix(style)
        placed = [self._placed(np.array(piece, dtype=float), matrix) for piece in pieces]
        points, strays = flatten(placed, self.settings.sagitta, from_arcs=True)
        self.points += len(points)
        refuse_many(self.file, self.points)
        return points, strays

    def _matrix(self, style: _Style) -> FloatArray:
        """From (x, y, 1) of an element to the coordinates of the page, shape (2, 3)."""
        from svgelements import Matrix

        m = Matrix(style.transform)
        return np.array([[m.a, m.c, m.e], [m.b, m.d, m.f]], dtype=float)

    def _placed(self, points: FloatArray, matrix: FloatArray) -> FloatArray:
        """Points of an element's coordinates in W [m]."""
        return self.page.place(points @ matrix[:, :2].T + matrix[:, 2])

    def _outline(self, element: Element, tag: str, style: _Style) -> Any:
        import svgelements

        if tag == "path":
            data = element.get("d", "").strip()
            if data in ("", "none"):
                return ""
            if not _PATH_DATA.fullmatch(data):
                raise self.refuse(element, "its path data holds what SVG does not know", "draw it anew")
            return data
        if tag in ("polyline", "polygon"):
            values = numbers(element.get("points", ""))
            if len(values) % 2:
                raise self.refuse(element, "an odd number of coordinates", "draw it anew or delete it")
            corners = [complex(*pair) for pair in zip(values[::2], values[1::2], strict=True)]
            kind = svgelements.Polygon if tag == "polygon" else svgelements.Polyline
            return kind(*corners) if len(corners) > 1 else ""
        sizes = {
            key: self._length(element, key, style)
            for key in _LENGTHS[tag]
            if element.get(key, "auto") != "auto"
        }
        if wrong := [key for key in _NEVER_NEGATIVE if sizes.get(key, 0.0) < 0.0]:
            raise self.refuse(element, f"{wrong[0]} is negative", "draw it anew or delete it")
        kinds = {"rect": "Rect", "circle": "Circle", "ellipse": "Ellipse", "line": "SimpleLine"}
        return getattr(svgelements, kinds[tag])(**sizes)


def _pieces(subpath: Any) -> tuple[list[Any], bool]:
    """Control points of every piece of a subpath, and whether it is closed."""
    from svgelements import Arc, Close, Move

    pieces: list[Any] = []
    closed = False
    for segment in subpath:
        if isinstance(segment, Move):
            continue
        curves = segment.as_cubic_curves() if isinstance(segment, Arc) else (segment,)
        for curve in curves:
            controls = [getattr(curve, name, None) for name in ("control", "control1", "control2")]
            ends = [curve.start, *(c for c in controls if c is not None), curve.end]
            if None in ends:
                raise ValueError("a piece without a start")
            pieces.append([(float(p.x), float(p.y)) for p in ends])
        closed = closed or isinstance(segment, Close)
    return pieces, closed

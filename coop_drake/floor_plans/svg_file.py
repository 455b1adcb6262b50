"""Reads the lines of an SVG drawing: paths and shapes with all their transforms."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from coop_drake.errors import FloorPlanError
from coop_drake.floor_plans.curves import flatten
from coop_drake.floor_plans.settings import FloorPlanSettings
from coop_drake.floor_plans.svg_page import SVG, SvgPage, length, read_svg_page
from coop_drake.floor_plans.walls import Drawing, Wall, refuse_many

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_PATH_DATA = re.compile(rf"\s*[Mm](?:[MmZzLlHhVvCcSsQqTtAa]|{_NUMBER}|[\s,])*")
_TRANSFORMS = re.compile(
    rf"\s*(?:(?:matrix|translate|scale|rotate|skewX|skewY)\s*\((?:\s*{_NUMBER}[\s,]*)+\)[\s,]*)*"
)
_GROUPS = ("svg", "g", "a", "switch", "symbol")
_SHAPES = ("path", "rect", "circle", "ellipse", "line", "polyline", "polygon")
_IGNORED = ("text", "image", "foreignObject")
_LABEL = "{http://www.inkscape.org/namespaces/inkscape}label"
_HREFS = ("href", "{http://www.w3.org/1999/xlink}href")
_LENGTHS = {
    "rect": ("x", "y", "width", "height", "rx", "ry"),
    "circle": ("cx", "cy", "r"),
    "ellipse": ("cx", "cy", "rx", "ry"),
    "line": ("x1", "y1", "x2", "y2"),
}
_NEVER_NEGATIVE = ("width", "height", "rx", "ry", "r")
_MOST_ELEMENTS = 100_000
"""Elements that are read at most, counted again in every clone."""
_MOST_CLONES = 2_000
"""Clones that are read at most: clones of clones can multiply without end."""
_DEEPEST = 100
"""Levels of elements inside each other that are allowed."""


def read_svg(path: Path, settings: FloorPlanSettings) -> Drawing:
    """Read all visible lines; the width of a stroke is part of the wall.

    Raises:
        FloorPlanError: The file is damaged, or contains something that the reader could only guess.
    """
    page = read_svg_page(path, settings)
    walk = _Walk(str(path), page, settings)
    walls = tuple(walk.walls(page.root, _Style()))
    for layer in settings.layers:
        if layer not in walk.layers:
            known = ", ".join(sorted(walk.layers)) or "none"
            raise FloorPlanError(
                walk.file, "layers", f"no group has the label or id {layer!r}", f"known: {known}"
            )
    notes = [f"{count} <{tag}> left out" for tag, count in sorted(walk.ignored.items())]
    if any(element.tag == f"{SVG}style" for element in page.root.iter()):
        notes.append("style sheets are not read; strokes count with the width that elements state themselves")
    return Drawing(walls, tuple(notes))


@dataclass(frozen=True)
class _Style:
    """The attributes that an element passes on to those inside it."""

    transform: str = ""
    stroke: str = "none"
    stroke_width: str = "1"
    shown: bool = True
    visibility: str = "visible"
    chosen: bool = False
    depth: int = 0


@dataclass
class _Walk:
    """One pass through the tree, with counts of what was left out."""

    file: str
    page: SvgPage
    settings: FloorPlanSettings
    layers: set[str] = field(default_factory=set)
    ignored: Counter[str] = field(default_factory=Counter)
    count: int = 0
    clones: int = 0
    points: int = 0

    def __post_init__(self) -> None:
        self.by_id = {element.get("id"): element for element in self.page.root.iter() if element.get("id")}

    def refuse(self, element: Element, finding: str, remedy: str) -> FloorPlanError:
        """An error that names the element."""
        return FloorPlanError(self.file, _name(element), finding, remedy)

    def walls(self, element: Element, outer: _Style, *, used: bool = False) -> Iterator[Wall]:
        """Yield all lines of an element and of the elements inside it."""
        self.count += 1
        if self.count > _MOST_ELEMENTS or outer.depth > _DEEPEST:
            finding = f"more than {_MOST_ELEMENTS:,} elements, or {_DEEPEST} levels of them"
            raise self.refuse(element, finding, "unlink clones that hold themselves; choose layers")
        tag = str(element.tag).removeprefix(SVG)
        if tag == "symbol" and not used:
            return
        if tag not in (*_GROUPS, *_SHAPES, "use"):
            if tag in _IGNORED:
                self.ignored[tag] += 1
            return
        style = self._style(element, outer)
        if not style.shown:
            return
        if tag in _SHAPES:
            visible = style.visibility not in ("hidden", "collapse")
            if visible and (style.chosen or not self.settings.layers):
                yield from self._shape(element, tag, style)
        elif tag == "use":
            self.clones += 1
            if self.clones > _MOST_CLONES:
                finding = f"more than {_MOST_CLONES:,} clones, counted with those inside clones"
                raise self.refuse(element, finding, "unlink them, or choose layers")
            moved = self._moved(element, style)
            yield from self.walls(self._target(element), moved, used=True)
        else:
            if tag in ("svg", "symbol") and element is not self.page.root:
                if element.get("viewBox"):
                    raise self.refuse(element, "an inner page with a viewBox of its own", "ungroup it")
                style = self._moved(element, style)
            for child in element:
                yield from self.walls(child, style)

    def _style(self, element: Element, outer: _Style) -> _Style:
        own = {key.strip(): value.strip() for key, value in _declarations(element.get("style", ""))}
        said = {**element.attrib, **own}
        names = {name for name in (element.get(_LABEL), element.get("id")) if name}
        if str(element.tag).removeprefix(SVG) in _GROUPS:
            self.layers |= names
        transform = said.get("transform", "")
        if transform == "none":
            transform = ""
        if not _TRANSFORMS.fullmatch(transform):
            raise self.refuse(element, f"transform {transform!r} is none that SVG knows", "ungroup it")
        return _Style(
            transform=f"{outer.transform} {transform}",
            stroke=said.get("stroke", outer.stroke),
            stroke_width=said.get("stroke-width", outer.stroke_width),
            shown=said.get("display") != "none",
            visibility=said.get("visibility", outer.visibility),
            chosen=outer.chosen or bool(names & set(self.settings.layers)),
            depth=outer.depth + 1,
        )

    def _moved(self, element: Element, style: _Style) -> _Style:
        x, y = (length(element.get(key, "0"), self.file, f"{_name(element)} {key}") for key in ("x", "y"))
        return replace(style, transform=f"{style.transform} translate({x!r}, {y!r})")

    def _target(self, element: Element) -> Element:
        address = next((element.attrib[key] for key in _HREFS if key in element.attrib), "")
        target = self.by_id.get(address.removeprefix("#")) if address.startswith("#") else None
        if target is None:
            raise self.refuse(element, f"it shows {address!r}, which is not in the file", "unlink the clone")
        return target

    def _shape(self, element: Element, tag: str, style: _Style) -> Iterator[Wall]:
        from svgelements import Matrix
        from svgelements import Path as Outline

        try:
            matrix = Matrix(style.transform)
            outline = Outline(self._outline(element, tag)) * matrix
            outline.reify()
            curves = [_pieces(subpath) for subpath in outline.as_subpaths()]
        except (ValueError, IndexError, ZeroDivisionError, OverflowError) as error:
            raise self.refuse(
                element, f"its numbers make no shape ({error})", "draw it anew or delete it"
            ) from error
        stroke = 0.0
        if style.stroke != "none":
            widest = float(np.linalg.norm([[matrix.a, matrix.c], [matrix.b, matrix.d]], 2))
            width = length(style.stroke_width, self.file, f"{_name(element)} stroke-width")
            stroke = 0.5 * abs(width) * widest * self.page.metre
        for pieces, closed in curves:
            if pieces:
                yield self._wall(element, pieces, closed, stroke)

    def _wall(self, element: Element, pieces: list[Any], closed: bool, stroke: float) -> Wall:
        placed = [self.page.place(np.array(piece, dtype=float)) for piece in pieces]
        points, strays = flatten(placed, self.settings.sagitta, from_arcs=True)
        self.points += len(points)
        refuse_many(self.file, self.points)
        closed = closed or (len(points) > 3 and bool((points[0] == points[-1]).all()))
        if closed and bool((points[0] == points[-1]).all()):
            points = points[:-1]
        return Wall(points, stroke + strays, closed and len(points) > 2, _name(element))

    def _outline(self, element: Element, tag: str) -> Any:
        import svgelements

        if tag == "path":
            data = element.get("d", "").strip()
            if data in ("", "none"):
                return ""
            if not _PATH_DATA.fullmatch(data):
                raise self.refuse(element, "its path data holds what SVG does not know", "draw it anew")
            return data
        if tag in ("polyline", "polygon"):
            numbers = [float(n) for n in re.split(r"[\s,]+", element.get("points", "").strip()) if n]
            if len(numbers) % 2:
                raise self.refuse(element, "an odd number of coordinates", "draw it anew or delete it")
            corners = [complex(*pair) for pair in zip(numbers[::2], numbers[1::2], strict=True)]
            kind = svgelements.Polygon if tag == "polygon" else svgelements.Polyline
            return kind(*corners) if len(corners) > 1 else ""
        sizes = {
            key: length(element.attrib[key], self.file, f"{_name(element)} {key}")
            for key in _LENGTHS[tag]
            if element.get(key, "auto") != "auto"
        }
        if wrong := [key for key in _NEVER_NEGATIVE if sizes.get(key, 0.0) < 0.0]:
            raise self.refuse(element, f"{wrong[0]} is negative", "draw it anew or delete it")
        kinds = {"rect": "Rect", "circle": "Circle", "ellipse": "Ellipse", "line": "SimpleLine"}
        return getattr(svgelements, kinds[tag])(**sizes)


def _declarations(style: str) -> Iterator[tuple[str, str]]:
    for declaration in style.split(";"):
        key, colon, value = declaration.partition(":")
        if colon:
            yield key, value


def _name(element: Element) -> str:
    label = element.get(_LABEL) or element.get("id")
    tag = str(element.tag).removeprefix(SVG)
    return f"<{tag}> {label!r}" if label else f"<{tag}>"


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

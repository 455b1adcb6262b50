"""Parses an SVG file safely, and places its page in W."""

from __future__ import annotations

import re
from dataclasses import dataclass
from math import isclose, isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree.ElementTree import TreeBuilder

import numpy as np

from coop_drake.errors import FloorPlanError
from coop_drake.floor_plans.settings import UNITS, FloorPlanSettings
from coop_drake.tree.pose import FloatArray

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

SVG = "{http://www.w3.org/2000/svg}"
"""Namespace of SVG elements."""

LABEL = "{http://www.inkscape.org/namespaces/inkscape}label"
"""Attribute by which Inkscape names a layer."""
NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
"""A number as SVG writes it."""
_LENGTH = re.compile(rf"\s*({NUMBER})\s*(px|pt|pc|mm|cm|in|%)?\s*", re.IGNORECASE)
_PIXELS = {"px": 1.0, "pt": 96.0 / 72.0, "pc": 16.0, "mm": 96.0 / 25.4, "cm": 96.0 / 2.54, "in": 96.0}
_PHYSICAL = ("mm", "cm", "in", "pt", "pc")
_PIXEL = UNITS["in"] / 96.0
"""Length of a pixel by the CSS standard, 96 to an inch [m]."""


@dataclass(frozen=True)
class SvgPage:
    """The parsed file and its page.

    Attributes:
        root: The ``svg`` element.
        metre: Length of one user unit in W [m].
        left: First coordinate of the page's left edge, in user units.
        bottom: Second coordinate of the lower edge, in user units; y points down in SVG.
        size: Width and height that percentages refer to, in user units; None if the file does not say them.
    """

    root: Element
    metre: float
    left: float
    bottom: float
    size: tuple[float, float] | None

    def place(self, points: FloatArray) -> FloatArray:
        """Points of the root's coordinates in W: the origin is the page's lower left corner, y points up."""
        return np.column_stack([points[:, 0] - self.left, self.bottom - points[:, 1]]) * self.metre


def read_svg_page(path: Path, settings: FloorPlanSettings) -> SvgPage:
    """Parse a file without opening anything that it names, and without expanding entities.

    Raises:
        FloorPlanError: The file is no SVG, is damaged, declares entities, or does not say its size.
    """
    from defusedxml import DefusedXmlException
    from defusedxml.ElementTree import DefusedXMLParser, ParseError

    file = str(path)
    try:
        builder = _Builder()
        parser = DefusedXMLParser(target=builder, forbid_entities=True, forbid_external=True)
        parser.feed(path.read_bytes())
        root = parser.close()
    except DefusedXmlException as error:
        finding = "it declares entities, which can blow up a small file or open others"
        raise FloorPlanError(
            file, "the head", finding, "save it anew as plain SVG from the drawing program"
        ) from error
    except ParseError as error:
        line, column = error.position
        raise FloorPlanError(
            file,
            f"line {line}, column {column + 1}",
            f"no well-formed XML ({str(error).partition(':')[0]}); the file may be cut short",
            "save it anew as plain SVG",
        ) from error
    except (ValueError, LookupError) as error:
        raise FloorPlanError(file, "the file", f"no XML ({error})", "save it anew as plain SVG") from error
    if root.tag not in (f"{SVG}svg", "svg"):
        raise FloorPlanError(file, "the root", f"<{root.tag}> is no SVG drawing", "name an SVG file")
    if builder.sheets:
        finding = "it names a style sheet in another file"
        raise FloorPlanError(file, "<?xml-stylesheet?>", finding, "save it anew as plain SVG")
    return _page(file, root, settings)


class _Builder(TreeBuilder):
    """Builds the tree, and counts style sheets that processing instructions name."""

    sheets = 0

    def pi(self, target: str, text: str | None = None) -> Any:
        """Take note of a processing instruction."""
        self.sheets += target == "xml-stylesheet"


def name_of(element: Element) -> str:
    """The name of an element for messages: its tag, and its label or id."""
    label = element.get(LABEL) or element.get("id")
    tag = str(element.tag).removeprefix(SVG)
    return f"<{tag}> {label!r}" if label else f"<{tag}>"


def length(text: str, file: str, place: str, whole: float | None = None) -> float:
    """A length in pixels, which are user units inside the page.

    ``whole`` is the length that percentages refer to, None if it is not known.

    Raises:
        FloorPlanError: The text is no number with an absolute unit, or with % of a known length.
    """
    match = _LENGTH.fullmatch(text)
    unit = (match[2] or "px").lower() if match else ""
    if not match or (unit == "%" and whole is None):
        finding = (
            f"{text!r} is no length" if not match else f"{text!r} is a part of a size that is not stated"
        )
        raise FloorPlanError(file, place, finding, "give a number, with px, mm, cm, in, pt or pc if any unit")
    value = float(match[1]) * (0.01 * (whole or 0.0) if unit == "%" else _PIXELS[unit])
    if not isfinite(value):
        raise FloorPlanError(file, place, f"{text!r} is no finite length", "give a finite number")
    return value


def _page(file: str, root: Element, settings: FloorPlanSettings) -> SvgPage:
    sizes = [root.get("width"), root.get("height")]
    known = [size for size in sizes if size and not size.strip().endswith("%")]
    pixels = [length(size, file, "<svg> width and height") for size in known]
    box = view_box(file, root)
    view = box or (None if len(pixels) < 2 else (0.0, 0.0, pixels[0], pixels[1]))
    if view is None:
        metre = settings.metres(_PIXEL if _physical(known) else None, file)
        return SvgPage(root, metre, 0.0, 0.0, None)
    physical = None
    if _physical(known) and len(pixels) == 2 and settings.unit is None:
        factors = [pixels[0] / view[2], pixels[1] / view[3]]
        if not isclose(*factors, rel_tol=1e-3):
            finding = "width, height and viewBox stretch the drawing in one direction"
            raise FloorPlanError(file, "<svg> viewBox", finding, "make their ratios equal, or name the unit")
        physical = min(factors) * _PIXEL
    return SvgPage(root, settings.metres(physical, file), view[0], view[1] + view[3], view[2:])


def _physical(sizes: list[str]) -> bool:
    return bool(sizes) and all(size.strip().endswith(_PHYSICAL) for size in sizes)


def view_box(file: str, element: Element) -> tuple[float, float, float, float] | None:
    """The viewBox (x, y, width, height) of an element, None if it has none.

    Raises:
        FloorPlanError: It is none, or has no area.
    """
    text, place = element.get("viewBox"), f"{name_of(element)} viewBox"
    if text is None:
        return None
    try:
        x, y, width, height = numbers(text)
    except ValueError:
        raise FloorPlanError(
            file, place, f"{text!r} is no box", "give four numbers: x, y, width, height"
        ) from None
    if not (all(map(isfinite, (x, y, width, height))) and width > 0.0 and height > 0.0):
        raise FloorPlanError(file, place, f"{text!r} has no area", "give a positive width and height")
    return x, y, width, height


def numbers(text: str) -> list[float]:
    """The numbers of a list, which may follow each other without a blank, as in ``-5-3.5.5``.

    Raises:
        ValueError: There is something else in it.
    """
    if not re.fullmatch(rf"\s*(?:{NUMBER}\s*(?:,\s*)?)*", text):
        raise ValueError(f"{text!r} is no list of numbers")
    return [float(number) for number in re.findall(NUMBER, text)]

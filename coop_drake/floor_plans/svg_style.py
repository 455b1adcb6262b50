"""Pages and styles of SVG drawings: what is drawn, where, how wide."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from math import isclose, isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple
from xml.etree.ElementTree import TreeBuilder

import numpy as np

from coop_drake.errors import FloorPlanError
from coop_drake.floor_plans.settings import UNITS, FloorPlanSettings
from coop_drake.tree.arrays import FloatArray

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

# Parses an SVG file safely, and places its page in W.

SVG = "{http://www.w3.org/2000/svg}"
"""Namespace of SVG elements."""

LABEL = "{http://www.inkscape.org/namespaces/inkscape}label"
"""Attribute by which Inkscape names a layer."""
NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
"""A number as SVG writes it."""
_PAGE_LENGTH = re.compile(rf"\s*({NUMBER})\s*(px|pt|pc|mm|cm|in|%)?\s*", re.IGNORECASE)
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
    match = _PAGE_LENGTH.fullmatch(text)
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


# What elements of an SVG drawing look like: attributes, style sheets, inheritance, as CSS combines them.

INHERITED = {
    "color": "black",
    "fill": "black",
    "fill-opacity": "1",
    "marker": "none",
    "marker-end": "none",
    "marker-mid": "none",
    "marker-start": "none",
    "stroke": "none",
    "stroke-dasharray": "none",
    "stroke-linecap": "butt",
    "stroke-linejoin": "miter",
    "stroke-miterlimit": "4",
    "stroke-opacity": "1",
    "stroke-width": "1",
    "visibility": "visible",
}
"""Properties that an element passes on to those inside it, with what they are where nothing says so."""

OWN = {
    "clip-path": "none",
    "display": "inline",
    "filter": "none",
    "mask": "none",
    "opacity": "1",
    "overflow": "hidden",
    "transform": "none",
    "vector-effect": "none",
}
"""Properties of an element alone; ``overflow`` is read of inner pages, which hide it by default."""

INITIAL = {**INHERITED, **OWN}

_GEOMETRY = ("d", "x", "y", "width", "height", "cx", "cy", "r", "rx", "ry")
_NOT_READ: tuple[str, ...] = ("all", "clip", "offset", "offset-path", "rotate", "scale", "translate", "zoom")
_NOT_READ += ("content-visibility",)
_ORIGIN = ("transform-box", "transform-origin")
"""Properties that would move, hide or change shapes; they are refused."""

_WITHOUT_EFFECT = ("counter-style", "font-face", "keyframes", "-webkit-keyframes", "page", "property")
"""Rules of a style sheet that change no shape of a drawing at rest."""

_PSEUDO = {"root", "first-child", "last-child", "only-child", "first-of-type", "last-of-type"}
_PSEUDO |= {"only-of-type", "empty", "nth-child", "nth-last-child", "nth-of-type", "nth-last-of-type"}
_PSEUDO |= {"not", "is", "where", "hover", "active", "focus", "focus-visible", "focus-within"}
"""Pseudo-classes that the library of selectors decides as SVG does; the last ones never hold on paper."""

_XHTML = "{http://www.w3.org/1999/xhtml}"
_NOT_TURNED = ("none", "inherit", "initial", "unset")
"""What a style may say of ``transform``; its functions are read as an attribute alone."""


class _Said(NamedTuple):
    """One declaration: a property, its text, and whether it is marked as important."""

    name: str
    text: str
    important: bool


Values = Mapping[str, str]
"""What every property of ``INITIAL`` is, as text in lower case, but for addresses."""


class Cascade:
    """All that decides how the elements of a drawing look.

    Presentation attributes count least, then the rules of style sheets by the specificity of their selectors
    and their order, then the attribute ``style``; what is marked as important goes before all else.

    Args:
        file: The file, for messages.
        page: The drawing.

    Raises:
        FloorPlanError: A style sheet has a rule or a selector that is not read.
    """

    def __init__(self, file: str, page: SvgPage) -> None:
        from cssselect2 import ElementWrapper, Matcher

        self._file = file
        self._matcher, self._rules = Matcher(), 0
        self._checked: set[Element] = set()
        self._styles: dict[str, list[_Said]] = {}
        for element in page.root.iter():
            if element.tag in ("style", f"{SVG}style", f"{_XHTML}style"):
                self._read_sheet(element)
            elif element.tag == f"{_XHTML}link":
                raise self._refuse(name_of(element), "it names a style sheet in another file")
        wrapped = ElementWrapper.from_xml_root(page.root).iter_subtree()
        self._wrapped = {one.etree_element: one for one in wrapped} if self._rules else {}

    def values(self, element: Element, outer: Values) -> Values:
        """Return what the properties of an element are, inside an element with other ones.

        Raises:
            FloorPlanError: The element has a style that is not read.
        """
        place, said = name_of(element), {key: element.attrib[key] for key in INITIAL if key in element.attrib}
        own = self._own(element.get("style", ""), place)
        sheets = [declaration for rule in self._matching(element) for declaration in rule]
        for important in (False, True):
            for name, text, is_important in (*sheets, *own):
                if is_important == important:
                    if name == "transform" and text.strip().lower() not in _NOT_TURNED:
                        remedy = "apply it in the drawing program, or state it as the attribute transform"
                        raise self._refuse(place, f"the property transform: {text} is not read", remedy)
                    said[name] = text
        self._check(element, said, place)
        return {name: self._computed(name, said, outer, place) for name in INITIAL}

    def check_clone(self, root: Element) -> None:
        """Refuse a clone of an element if rules select parts of it by what stands around the original.

        Raises:
            FloorPlanError: It would look different by SVG 1.1 and by SVG 2.
        """
        from cssselect2 import ElementWrapper

        if not self._rules or root in self._checked:
            return
        self._checked.add(root)
        for alone in ElementWrapper.from_xml_root(root).iter_subtree():
            original = self._wrapped[alone.etree_element]
            if self._matcher.match(alone) != self._matcher.match(original):
                finding = "a style sheet selects it by what stands around it, and a clone of it is shown"
                raise self._refuse(name_of(alone.etree_element), finding, "unlink the clone")

    def _refuse(self, place: str, finding: str, remedy: str = "") -> FloorPlanError:
        remedy = remedy or "save the drawing as plain SVG, with attributes in place of style sheets"
        return FloorPlanError(self._file, place, finding, remedy)

    def _read_sheet(self, sheet: Element) -> None:
        import tinycss2

        kind, media = (sheet.get(key, "").strip().lower() for key in ("type", "media"))
        if kind not in ("", "text/css") or media not in ("", "all", "screen"):
            raise self._refuse("<style>", f"a style sheet of the kind {kind or media!r} is not read")
        for rule in tinycss2.parse_stylesheet("".join(sheet.itertext()), True, True):
            where = f"<style>, line {rule.source_line}"
            if rule.type == "qualified-rule":
                self._read_rule(rule, where)
            elif rule.type == "error":
                raise self._refuse(where, f"it is no style sheet ({rule.message})")
            elif rule.lower_at_keyword not in _WITHOUT_EFFECT:
                raise self._refuse(where, f"@{rule.at_keyword} is not read")

    def _read_rule(self, rule: Any, where: str) -> None:
        from cssselect2 import SelectorError, compile_selector_list
        from tinycss2 import serialize

        declarations = self._declarations(rule.content, where)
        if not declarations:
            return
        selector = serialize(rule.prelude).strip()
        try:
            unknown = [name for name in _pseudo(rule.prelude) if name not in _PSEUDO]
            compiled = [] if unknown else compile_selector_list(rule.prelude)
        except (SelectorError, NotImplementedError) as error:
            raise self._refuse(where, f"the selector {selector!r} is not read ({error})") from error
        if unknown:
            raise self._refuse(where, f"the selector {selector!r} is not read (:{unknown[0]})")
        for one in compiled:
            self._rules += 1
            self._matcher.add_selector(one, declarations)

    def _own(self, style: str, place: str) -> list[_Said]:
        """Return the declarations of an attribute ``style``; many elements of a drawing have the same."""
        if style not in self._styles:
            self._styles[style] = self._declarations(style, f"{place} style")
        return self._styles[style]

    def _declarations(self, content: Any, where: str) -> list[_Said]:
        """Return the declarations of a rule or of an attribute ``style`` that matter for what is drawn."""
        import tinycss2

        said = []
        for one in tinycss2.parse_blocks_contents(content, skip_comments=True, skip_whitespace=True):
            if one.type != "declaration":
                finding = getattr(one, "message", "rules inside rules are not read")
                raise self._refuse(where, f"its style is not read ({finding})")
            text = tinycss2.serialize([t for t in one.value if t.type != "comment"]).strip()
            if one.lower_name in (*INITIAL, *_NOT_READ, *_ORIGIN, *_GEOMETRY):
                if re.search(r"\b(?:var|env|attr)\(", text):
                    raise self._refuse(where, f"{one.lower_name}: {text} is not read")
                said.append(_Said(one.lower_name, text, one.important))
            elif re.sub(r"^-\w+-", "", one.lower_name) in ("clip-path", "filter", "mask", "transform"):
                raise self._refuse(where, f"{one.lower_name} is not read")
        return said

    def _matching(self, element: Element) -> Iterator[list[_Said]]:
        """Yield the declarations of the rules that select an element, those that count most at the end."""
        if self._rules:
            for _, _, pseudo, declarations in self._matcher.match(self._wrapped[element]):
                if pseudo is None:
                    yield declarations

    def _check(self, element: Element, said: dict[str, str], place: str) -> None:
        """Refuse properties that move or change shapes, and that no attribute of SVG 1.1 has."""
        is_page = element.tag in ("svg", f"{SVG}svg")  # Its size on a screen is not that of the drawing.
        turned = said.get("transform", "none").strip() not in ("", "none")
        for name in (*_NOT_READ, *(() if is_page else _GEOMETRY), *(_ORIGIN if turned else ())):
            text = said.get(name, element.get(name, "none") if name in _ORIGIN else "none")
            if text.strip().lower() not in ("none", "auto", "normal", "visible", "1"):
                raise self._refuse(place, f"the property {name}: {text} is not read")

    def _computed(self, name: str, said: Mapping[str, str], outer: Values, place: str) -> str:
        text = said.get(name, "unset").strip()
        text = text if name == "transform" or "url(" in text.lower() else text.lower()
        if text.startswith("revert"):
            raise self._refuse(place, f"{name}: {text} is not read")
        if text == "inherit" or (text == "unset" and name in INHERITED):
            return outer[name]
        return INITIAL[name] if text in ("initial", "unset", "") else text


def paints(values: Values, kind: str) -> bool:
    """Whether a shape's ``fill`` or ``stroke`` is seen; what is not known to be transparent is."""
    paint = values[kind]
    if paint == "none" or opacity(values[f"{kind}-opacity"]) == 0.0:
        return False
    return _opacity_of_colour(values["color"] if paint == "currentcolor" else paint) > 0.0


@lru_cache(maxsize=1000)
def _opacity_of_colour(paint: str) -> float:
    from tinycss2.color4 import parse_color

    return float(getattr(parse_color(paint), "alpha", 1.0))


def opacity(text: str) -> float:
    """Return an opacity from 0 to 1; a text that is none does not count, and is 1."""
    match = re.fullmatch(rf"({NUMBER})(%?)", text)
    value = float(match[1]) / (100.0 if match[2] else 1.0) if match else 1.0
    return min(max(value, 0.0), 1.0)


def _pseudo(tokens: Any) -> Iterator[str]:
    """Yield the names of the pseudo-classes of a selector, those inside functions included."""
    for before, token in zip([None, *tokens], tokens, strict=False):
        if getattr(before, "value", None) == ":" and token.type in ("ident", "function"):
            yield token.lower_value if token.type == "ident" else token.lower_name
        for inside in (getattr(token, "arguments", None), getattr(token, "content", None)):
            yield from _pseudo(inside or [])

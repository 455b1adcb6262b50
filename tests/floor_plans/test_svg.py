"""SVG drawings: shapes, units, layers, style sheets as CSS means them, and what is refused by name."""

from __future__ import annotations

from io import StringIO

import numpy as np
import pytest
from shapely import LineString, MultiPoint, Point, Polygon, box, contains_xy
from shapely.affinity import affine_transform
from svgelements import SVG, Matrix, Shape
from svgelements import Path as SvgPath

from coop_drake.errors import FloorPlanError
from coop_drake.floor_plans import FloorPlanSettings, read_floor_plan
from tests.support.floor_plan_files import HALL, write_svg

METRES = FloorPlanSettings(unit="m", tolerance=0.0)


def floor(folder, body, settings=METRES, inside=None, **head):
    return read_floor_plan(write_svg(folder, body, **head), settings, inside).polygon


def test_the_page_is_laid_with_its_lower_left_corner_at_the_origin(tmp_path):
    read = floor(tmp_path, HALL.replace("H 10", "H 7"))
    assert read.equals(box(0, 0, 7, 6))
    raised = floor(tmp_path, '<rect y="1" width="10" height="2"/>')
    assert raised.equals(box(0, 3, 10, 5))


def test_a_page_with_a_transform_is_refused(tmp_path):
    with pytest.raises(FloorPlanError, match="the page has a transform"):
        floor(tmp_path, HALL, head='viewBox="0 0 10 6" transform="scale(2)"')


@pytest.mark.parametrize(
    ("head", "settings", "width"),
    [
        ('width="10cm" height="6cm" viewBox="0 0 10 6"', FloorPlanSettings(scale=50), 5.0),
        ('width="100mm" height="60mm" viewBox="0 0 10 6"', FloorPlanSettings(scale=50), 5.0),
        ('width="1000mm" height="600mm"', FloorPlanSettings(scale=100), 10 * 100 * 0.0254 / 96),
        ('viewBox="0 0 10 6"', FloorPlanSettings(unit="ft"), 3.048),
        ("", FloorPlanSettings(unit="m", scale=2.0), 20.0),
    ],
)
def test_units_come_from_the_page_or_from_the_settings(tmp_path, head, settings, width):
    x, _, right, _ = floor(tmp_path, HALL, settings, head=head).bounds
    assert right - x == pytest.approx(width, rel=1e-12)


def test_transforms_of_groups_and_clones_are_carried_out(tmp_path):
    body = (
        f'<defs><rect id="post" width="1" height="1"/></defs>{HALL}<g transform="translate(2,1) rotate(90)">'
        '<g transform="scale(2)"><rect width="1" height="0.5"/></g></g>'
        '<use xlink:href="#post" x="5" y="2" transform="matrix(1 0 0 2 0 0)"/>'
    )
    read = floor(tmp_path, body)
    want = box(0, 0, 10, 6) - box(1, 3, 2, 5) - box(5, 0, 6, 2)  # In SVG: x 1..2, y 1..3 and x 5..6, y 4..6.
    assert read.symmetric_difference(want).area == pytest.approx(0.0, abs=1e-9)


def test_layers_are_chosen_by_label_or_id_and_hidden_ones_left_out(tmp_path):
    body = (
        f'<g inkscape:groupmode="layer" inkscape:label="Walls">{HALL}</g>'
        '<g id="desks"><rect x="1" y="1" width="1" height="1"/></g>'
        '<g style="display:none"><rect x="3" y="1" width="1" height="1"/></g>'
        '<g visibility="hidden"><rect x="5" y="1" width="1" height="1"/></g>'
    )
    assert len(floor(tmp_path, body).interiors) == 1
    seen = body.replace('<rect x="5"', '<rect visibility="visible" x="5"')
    assert len(floor(tmp_path, seen).interiors) == 2
    assert not floor(tmp_path, body, FloorPlanSettings("m", layers=("Walls",))).interiors
    assert len(floor(tmp_path, body, FloorPlanSettings("m", layers=("Walls", "desks"))).interiors) == 1
    with pytest.raises(FloorPlanError, match=r"no group has the label or id 'walls'; known: Walls, desks"):
        floor(tmp_path, body, FloorPlanSettings("m", layers=("walls",)))


def test_a_stroke_belongs_to_the_wall(tmp_path):
    body = '<g style="stroke:#000"><rect width="10" height="6" stroke-width="0.4"/></g>'
    assert floor(tmp_path, body).symmetric_difference(box(0.2, 0.2, 9.8, 5.8)).area < 1e-9


CURVES = {
    "circle": '<circle cx="5" cy="3" r="1"/>',
    "turned ellipse": '<ellipse rx="1.4" ry="0.5" transform="translate(5,3) rotate(30)"/>',
    "cubic": '<path d="M 4,3 C 4,1.5 6,1.5 6,3 S 5,4 4,3 Z"/>',
    "quadratic": '<path d="M 4,3 Q 5,1 6,3 T 4,3 Z"/>',
    "arc": '<path d="M 4,3 A 1.2 0.8 20 1 1 6,3 Z"/>',
}


def points_of(curve):
    """Many points of a curve, in W."""
    (shape,) = SVG.parse(StringIO(f'<svg xmlns="http://www.w3.org/2000/svg">{curve}</svg>')).elements(
        lambda element: isinstance(element, Shape)
    )
    outline = SvgPath(shape)
    outline.reify()
    pieces = [piece for piece in outline if type(piece).__name__ not in ("Move", "Close")]
    points = np.vstack([piece.npoint(np.linspace(0, 1, 200)) for piece in pieces])
    return np.column_stack([points[:, 0], 6.0 - points[:, 1]])


@pytest.mark.parametrize("tolerance", [0.0, 0.01, 0.1])
@pytest.mark.parametrize("curve", CURVES.values(), ids=CURVES)
def test_curves_are_enclosed_from_the_floors_side(tmp_path, curve, tolerance):
    read = floor(tmp_path, HALL + curve, FloorPlanSettings("m", tolerance=tolerance), (0.5, 0.5))
    drawn = points_of(curve)
    assert not contains_xy(read, drawn).any()
    (hole,) = read.interiors
    assert Polygon(hole).hausdorff_distance(MultiPoint(drawn).convex_hull) < 2.0 * max(tolerance, 1e-3) + 0.01


def test_a_wall_that_bends_inwards_is_enclosed_too(tmp_path):
    read = floor(tmp_path, '<circle cx="5" cy="3" r="3"/>', FloorPlanSettings("m", tolerance=0.02))
    corners = np.array(read.exterior.coords)
    assert np.hypot(*(corners - (5, 3)).T).max() <= 3.0
    assert Polygon(read.exterior).area > np.pi * 9.0 * 0.98
    assert read.contains(Point(5, 3))


REFUSED = {
    "bad path": ('<path d="M 0,0 H 10 V 6 X 0 Z"/>', "<path>: its path data"),
    "broken path": ('<path id="w" d="M 0,0 L 10"/>', "<path> 'w': its numbers make no shape"),
    "bad length": ('<rect width="wide" height="6"/>', "<rect> width: 'wide' is no length"),
    "negative": ('<rect width="-5" height="6"/>', "width is negative"),
    "huge": ('<path d="M 0,0 H 1e999 V 6 Z"/>', "not finite"),
    "bad transform": (f'<g transform="turn(3)">{HALL}</g>', "none that SVG knows"),
    "too few numbers": (
        f'<g transform="matrix(1 0 0 1)">{HALL}</g>',
        "<g>: transform .* is none that SVG knows",
    ),
    "odd corners": ('<polygon points="0,0 10,0 10"/>', "odd number"),
    "clone of nothing": ('<use href="#gone"/>', "not in the file"),
    "clone of a file": ('<use href="other.svg#a"/>', "not in the file"),
    "clone of itself": ('<g id="a"><use href="#a"/></g>', "levels"),
    "inner page": (f'<svg viewBox="0 0 1 0">{HALL}</svg>', "has no area"),
    "inner page without a size": (f'<svg width="-1">{HALL}</svg>', "its size is negative"),
    "nothing": ("<text>hall</text>", "holds no line"),
}


@pytest.mark.parametrize(("body", "message"), REFUSED.values(), ids=REFUSED)
def test_damaged_drawings_are_refused_with_the_element(tmp_path, body, message):
    with pytest.raises(FloorPlanError, match=message) as caught:
        floor(tmp_path, body)
    assert caught.value.file.endswith("hall.svg")
    assert caught.value.remedy


def test_clones_of_clones_do_not_blow_up(tmp_path):
    levels = "".join(f'<g id="l{n}">' + f'<use href="#l{n - 1}"/>' * 10 + "</g>" for n in range(1, 12))
    with pytest.raises(FloorPlanError, match="more than 2,000 clones"):
        floor(tmp_path, f'<defs><g id="l0"/>{levels}</defs><use href="#l11"/>')


@pytest.mark.parametrize(
    "head",
    [
        '<!DOCTYPE svg [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;">]>',
        '<!DOCTYPE svg [<!ENTITY a SYSTEM "file:///etc/hostname">]>',
        '<!DOCTYPE svg [<!ENTITY % a SYSTEM "http://localhost/a.dtd"> %a;]>',
    ],
    ids=["bomb", "file", "parameter"],
)
def test_entities_are_refused(tmp_path, head):
    path = write_svg(tmp_path, HALL)
    path.write_text(head + path.read_text().replace("</svg>", "<desc>&a;</desc></svg>"))
    with pytest.raises(FloorPlanError, match="declares entities"):
        read_floor_plan(path, METRES)


@pytest.mark.parametrize(
    ("head", "message"),
    [
        ("", "does not say what its unit is"),
        ('width="100" height="60"', "does not say what its unit is"),
        ('viewBox="0 0 0 6"', "has no area"),
        ('viewBox="0 0 10"', "is no box"),
        ('width="10cm" height="9cm" viewBox="0 0 10 6"', "stretch the drawing"),
        ('width="10mm" height="6mm" viewBox="0 0 10 6"', "cannot be a floor"),
    ],
)
def test_a_page_that_does_not_say_its_size_is_refused(tmp_path, head, message):
    with pytest.raises(FloorPlanError, match=message):
        floor(tmp_path, HALL, FloorPlanSettings(), head=head)


ROOM = '<rect x="0.5" y="0.5" width="9" height="5" fill="none" stroke="#000" stroke-width="0.1"/>'
FIELD = {
    "percentages": (
        'width="1200mm" height="800mm" viewBox="0 0 1200 800"',
        '<rect width="100%" height="100%" fill="white"/>'
        '<path d="M100 100 H1100 V700 H100 Z" fill="none" stroke="black" stroke-width="20"/>'
        '<rect x="50%" y="100" width="20" height="300" fill="black"/>',
        0.5626,
    ),
    "compact numbers": (
        'width="12000mm" height="8000mm" viewBox="-6 -4 12 8"',
        '<polygon fill="none" stroke="#000" stroke-width=".2" points="-5-3 5-3 5 3-5 3"/>'
        '<polyline fill="none" stroke="#000" stroke-width=".2" points="0-3 0 .5.5.5"/>',
        56.06,
    ),
    "style sheet": (
        'width="12000mm" height="8000mm" viewBox="0 0 12000 8000"',
        "<defs><style>.cls-1{fill:none;stroke:#000;stroke-width:400px;}.cls-2{display:none;}</style></defs>"
        '<rect class="cls-1" x="500" y="500" width="11000" height="7000"/>'
        '<path class="cls-1" d="M6000 500V3200M6000 4800V7500"/>'
        '<g class="cls-2"><rect x="5000" y="3000" width="2000" height="2000"/></g>',
        67.96,
    ),
    "no paint": (
        'width="10000mm" height="6000mm" viewBox="0 0 10 6"',
        ROOM + '<rect x="4" y="0" width="2" height="6" fill="none"/>',
        43.61,
    ),
    "opacity": (
        'width="10000mm" height="6000mm" viewBox="0 0 10 6"',
        ROOM + '<path d="M0 3H10" stroke="#000" stroke-width=".1" opacity="0"/>',
        43.61,
    ),
    "clip path": (
        'width="10000mm" height="6000mm" viewBox="0 0 10 6"',
        '<defs><clipPath id="c"><rect x="0" y="0" width="3" height="6"/></clipPath></defs>'
        + ROOM
        + '<g clip-path="url(#c)"><path d="M0 3H10" stroke="#000" stroke-width=".1"/></g>',
        43.365,
    ),
}


@pytest.mark.parametrize(("head", "body", "area"), FIELD.values(), ids=FIELD)
def test_drawings_of_other_programs_have_the_area_that_they_show(tmp_path, head, body, area):
    plan = read_floor_plan(write_svg(tmp_path, body, head), FloorPlanSettings(tolerance=0.0))
    assert plan.polygon.area == pytest.approx(area, rel=1e-9)
    assert not plan.polygon.interiors


def across(attributes: str = "") -> str:
    """A line across the room, in the middle."""
    return f"<path {attributes} d='M5 0V6'/>"


WIDE = "stroke:red;stroke-width:.4"
GONE, WALL = 9.45, 4.8
"""Where the room on the left ends, without the line and with one of 0.4 m."""

LOOKS = {
    "attribute": ("", across("stroke='black' stroke-width='.4'"), WALL),
    "rule above attribute": ("path{stroke-width:.4}", across("stroke='red' stroke-width='.2'"), WALL),
    "style above rule": (".w{stroke-width:9}", across(f"class='w' style='{WIDE}'"), WALL),
    "important rule above style": (
        ".w{stroke-width:.4!important}",
        across("class='w' style='stroke:red;stroke-width:.2'"),
        WALL,
    ),
    "important style above important rule": (
        ".w{stroke-width:.2!important}",
        across("class='w' style='stroke:red;stroke-width:.4 !important'"),
        WALL,
    ),
    "id above class above element": (
        "#a{stroke-width:.4}.b{stroke-width:.2}path{stroke-width:.1}",
        across("id='a' class='b' stroke='red'"),
        WALL,
    ),
    "later rule above earlier one": (
        "path{stroke-width:.2}path{stroke-width:.4}",
        across("stroke='red'"),
        WALL,
    ),
    "descendant": (f"#walls path{{{WIDE}}}", f"<g id='walls'><g>{across()}</g></g>", WALL),
    "inherited from a group's rule": (f"g{{{WIDE}}}", f"<g>{across()}</g>", WALL),
    "own attribute above inherited rule": (
        "g{stroke:red;stroke-width:.2!important}",
        "<g>" + across("stroke-width='.4'") + "</g>",
        WALL,
    ),
    "inherit": (
        "path{stroke:inherit;stroke-width:inherit}",
        f"<g style='{WIDE}'>" + across("stroke='none'") + "</g>",
        WALL,
    ),
    "initial": ("path{stroke:initial;fill:none}", f"<g stroke='red'>{across()}</g>", GONE),
    "in CDATA": (f"<![CDATA[ .w > path, .v{{{WIDE}}} ]]>", f"<g class='w v'>{across()}</g>", WALL),
    "display none of a parent": (
        "",
        "<g style='display:none'><g style='display:inline'>" + across("stroke='red'") + "</g></g>",
        GONE,
    ),
    "display by sheet above attribute": (
        ".w{display:inline}",
        "<g class='w' display='none'>" + across("style='" + WIDE + "'") + "</g>",
        WALL,
    ),
    "visible inside hidden": (
        "g{visibility:hidden}path{visibility:visible}",
        "<g>" + across("style='" + WIDE + "'") + "</g>",
        WALL,
    ),
    "opacity of a parent": (
        "g{opacity:0%}",
        "<g><g opacity='1'>" + across("stroke='red'") + "</g></g>",
        GONE,
    ),
    "transparent stroke": ("path{stroke:rgba(0,0,0,0);fill:none}", across(), GONE),
    "opacity of the stroke": ("path{stroke:red;fill:none;stroke-opacity:0.0}", across(), GONE),
    "width of zero": ("path{stroke:red;fill:none;stroke-width:0}", across(), GONE),
    "a line has no fill": ("", "<line x1='5' x2='5' y2='6' fill='red'/>", GONE),
    "current colour": ("g{color:red}path{stroke:currentColor;stroke-width:.4}", f"<g>{across()}</g>", WALL),
    "percentage of the diagonal": (
        f"path{{stroke:red;stroke-width:{40.0 * (2.0 / 136.0) ** 0.5!r}%}}",
        across(),
        WALL,
    ),
    "never on paper": (f"path:hover{{stroke-width:9}}path{{{WIDE}}}", across(), WALL),
    "sheet's transform above attribute": (
        f"path{{transform:none;{WIDE}}}",
        across("transform='scale(9)'"),
        WALL,
    ),
    "a clone inherits from its use": (
        f".w{{{WIDE}}}",
        "<defs><path id='p' d='M4 0V6'/></defs><g class='w'><use href='#p' x='1'/></g>",
        WALL,
    ),
    "rule of the original above its use": (
        f"path{{{WIDE}}}",
        "<defs><path id='p' d='M4 0V6'/></defs><use href='#p' x='10%' stroke='none'/>",
        WALL,
    ),
    "symbol with a page of its own": (
        "",
        "<symbol id='s' viewBox='0 0 10 100' preserveAspectRatio='xMidYMid slice'>"
        f"<path d='M5 0V100' style='{WIDE}'/></symbol><use href='#s' width='100%' height='6'/>",
        WALL,
    ),
    "symbol that is cut off": (
        "",
        "<symbol id='s'><path d='M-9 3H9' style='stroke:red;stroke-width:9'/></symbol>"
        "<use href='#s' x='4.8' width='.4' height='6'/>",
        WALL,
    ),
    "inner page": (
        "",
        "<svg x='4' width='2' height='6' viewBox='0 0 1 3'>"
        "<line x1='50%' x2='50%' y2='100%' stroke='red' stroke-width='.2'/></svg>",
        WALL,
    ),
    "switch": (
        "",
        "<switch><foreignObject requiredExtensions='http://x'/>"
        f"<g style='{WIDE}'>{across()}</g><path d='M2 0V6' stroke='red'/></switch>",
        WALL,
    ),
    "first of two ids": (
        "",
        f"<defs><path id='p' d='M5 0V6' style='{WIDE}'/><path id='p' d='M2 0V6'/></defs><use href='#p'/>",
        WALL,
    ),
    "clip path that is moved and cut by another one": (
        "",
        "<clipPath id='a' transform='translate(1,0)'><rect x='3.8' width='9' height='9'/></clipPath>"
        "<clipPath id='b'><path d='M0 0H5.2V9H0Z'/></clipPath><g clip-path='url(#a)'>"
        "<rect width='10' height='6' fill='red' clip-path=\"url('#b')\"/></g>",
        WALL,
    ),
    "defaults in the head": ("", across("class='head'"), WALL),
}


@pytest.mark.parametrize(("sheet", "body", "wall"), LOOKS.values(), ids=LOOKS)
def test_what_is_seen_is_as_css_says(tmp_path, sheet, body, wall):
    path = write_svg(tmp_path, f"<style>{sheet}</style>{ROOM}{body}", 'viewBox="0 0 10 6"')
    if "class='head'" in body:
        subset = "<!ATTLIST path stroke CDATA 'red' stroke-width CDATA '.4'>"
        path.write_text(f"<!DOCTYPE svg [{subset}]>{path.read_text()}")
    floor = read_floor_plan(path, METRES, (0.6, 0.7)).polygon
    assert floor.symmetric_difference(box(0.55, 0.55, wall, 5.45)).area == pytest.approx(0.0, abs=1e-9)


NOT_READ = {
    "@media": ("@media print{path{fill:none}}", "", "<style>, line 1: @media is not read"),
    "@import": ("@import 'walls.css';", "", "@import is not read"),
    "no style sheet": ("path", "", "<style>, line 1: it is no style sheet"),
    "rules inside rules": ("g{path{stroke:red}}", "", "rules inside rules are not read"),
    "pseudo-class": ("a:link{stroke:red}", "", r"the selector 'a:link' is not read \(:link\)"),
    "pseudo-element": ("path::before{stroke:red}", "", "the selector 'path::before' is not read"),
    "variable": ("path{stroke-width:var(--w)}", "", r"stroke-width: var\(--w\) is not read"),
    "unit": ("path{stroke:red;stroke-width:.4em}", across(), "<path> stroke-width: '.4em' is no length"),
    "negative width": ("path{stroke:red;stroke-width:-1}", across(), "stroke-width: it is negative"),
    "geometry in a sheet": (
        "#a{x:4px}",
        "<rect id='a' width='1' height='6'/>",
        "<rect> 'a': the property x: 4px",
    ),
    "path in a sheet": ("#a{d:path('M0 0')}", across("id='a'"), "the property d: "),
    "individual transform": ("g{rotate:30deg}", f"<g>{across()}</g>", "<g>: the property rotate: 30deg"),
    "origin of a transform": (
        "g{transform-origin:50%}",
        "<g transform='scale(2)'/>",
        "property transform-origin",
    ),
    "transform in a sheet": ("g{transform:scale(2)}", "<g/>", r"transform: scale\(2\) is not read"),
    "all": ("g{all:unset}", "<g/>", "the property all: unset"),
    "revert": ("path{stroke:revert}", across(), "stroke: revert is not read"),
    "mask": ("", "<mask id='m'/><g mask='url(#m)'/>", "<g>: a mask decides what is seen of it"),
    "filter": ("g{filter:blur(1px)}", "<g/>", "<g>: a filter decides what is seen of it"),
    "vendor": ("g{-webkit-clip-path:inset(1px)}", "<g/>", "-webkit-clip-path is not read"),
    "clip path of the property": (
        "g{clip-path:inset(1px)}",
        "<g/>",
        r"clip path inset\(1px\) is not read",
    ),
    "clip path that is not there": ("", "<g clip-path='url(#c)'/>", "is not read"),
    "clip path as a part": (
        "",
        "<clipPath id='c' clipPathUnits='objectBoundingBox'/><g clip-path='url(#c)'/>",
        "<clipPath> 'c': it is cut itself, or is a part of what it cuts",
    ),
    "clip path of a text": (
        "",
        "<clipPath id='c'><text>x</text></clipPath><g clip-path='url(#c)'/>",
        "<clipPath> 'c': it holds <text>",
    ),
    "clip path with a hole": (
        "",
        "<clipPath id='c'><path d='M0 0H9V9H0ZM1 1H2V2H1Z'/></clipPath><g clip-path='url(#c)'/>",
        "a clip path whose outlines meet is not read",
    ),
    "language": ("", "<g systemLanguage='de'/>", "<g>: it is shown to readers of some languages only"),
    "overflow": ("", "<svg overflow='hidden visible' width='1' height='1'/>", "overflow: hidden visible"),
    "stroke of the screen": ("", across(f"style='{WIDE};vector-effect:non-scaling-stroke'"), "vector-effect"),
    "unknown element": ("", f"<wall>{across()}</wall>", "<wall>: the reader knows no such element"),
    "clone that rules see by its place": (
        "#defs path{stroke:red}",
        "<defs id='defs'><path id='p' d='M4 0V6'/></defs><use href='#p'/>",
        "<path> 'p': a style sheet selects it by what stands around it, and a clone of it is shown",
    ),
    "style": ("", across("style='stroke red'"), "<path> style: its style is not read"),
}


@pytest.mark.parametrize(("sheet", "body", "message"), NOT_READ.values(), ids=NOT_READ)
def test_what_could_only_be_guessed_is_refused_by_name(tmp_path, sheet, body, message):
    path = write_svg(tmp_path, f"<style>{sheet}</style>{ROOM}{body}", 'viewBox="0 0 10 6"')
    with pytest.raises(FloorPlanError, match=message):
        read_floor_plan(path, METRES)


@pytest.mark.parametrize(
    ("before", "body", "message"),
    [
        ("<?xml-stylesheet href='walls.css'?>", "", "it names a style sheet in another file"),
        (
            "",
            "<link xmlns='http://www.w3.org/1999/xhtml' rel='stylesheet' href='walls.css'/>",
            "in another file",
        ),
        ("", "<style type='text/less'>path{stroke:red}</style>", "a style sheet of the kind 'text/less'"),
        ("", "<style media='print'>path{stroke:red}</style>", "a style sheet of the kind 'print'"),
    ],
)
def test_style_sheets_of_other_files_or_media_are_refused(tmp_path, before, body, message):
    path = write_svg(tmp_path, ROOM + body)
    path.write_text(before + path.read_text())
    with pytest.raises(FloorPlanError, match=message):
        read_floor_plan(path, METRES)


def test_rules_that_change_no_shape_are_left_alone(tmp_path):
    sheet = "@font-face{font-family:x}@keyframes a{to{opacity:0}}text::selection{top:0} a:link{cursor:help}"
    plan = read_floor_plan(write_svg(tmp_path, f"<style>{sheet} svg{{width:100%}}</style>{ROOM}"), METRES)
    assert plan.polygon.equals(box(0.55, 0.55, 9.45, 5.45))


def room_of(folder, body, point=(0.6, 0.7)):
    return read_floor_plan(write_svg(folder, ROOM + body, 'viewBox="0 0 10 6"'), METRES, point).polygon


def test_a_mitred_corner_reaches_as_far_as_svg_draws_it_and_no_further_than_its_limit(tmp_path):
    def tip(style, half=1.0):
        """How far a corner of 40 degrees with a stroke of 1 m reaches to the left of x = 5."""
        rise = 3.0 * half
        line = f"<path d='M8 {3 - rise}L5 3L8 {3 + rise}' style='fill:none;{WIDE};{style}'/>"
        (hole,) = room_of(tmp_path, line).interiors
        return 5.0 - min(x for x, _ in hole.coords)

    half = 0.36397  # tan 20 degrees
    mitred = 0.2 / 0.34202  # half a width over sin 20 degrees
    assert tip("", half) == pytest.approx(mitred, rel=1e-3)
    assert 0.2 - 1e-9 <= tip("stroke-linejoin:bevel", half) <= 2.03 * 0.2
    assert 0.2 - 1e-9 <= tip("stroke-miterlimit:2", half) <= 2.03 * 0.2
    assert tip("stroke-miterlimit:21", 0.05) == pytest.approx(0.2 / 0.0499376, rel=1e-3)


@pytest.mark.parametrize(("cap", "end"), [("butt", 3.0), ("square", 3.2), ("round", 3.2)])
def test_strokes_end_as_their_caps_say(tmp_path, cap, end):
    floor = room_of(tmp_path, f"<path d='M0 3H3' style='{WIDE};fill:none;stroke-linecap:{cap}'/>")
    assert max(x for x, y in floor.exterior.coords if abs(y - 3.0) < 0.21) == pytest.approx(end)


def test_an_open_shape_that_is_filled_has_an_edge_where_it_is_open(tmp_path):
    floor = room_of(tmp_path, "<path d='M2 2H4V4'/>")
    (hole,) = floor.interiors
    assert set(hole.coords) == {(2, 4), (4, 4), (4, 2)}
    assert not room_of(tmp_path, "<path d='M2 2H4V4' fill='none'/>").interiors


def test_a_filled_shape_that_is_cut_off_has_an_edge_along_the_cut(tmp_path):
    clip = "<clipPath id='c'><rect width='3' height='9'/></clipPath>"
    (hole,) = room_of(
        tmp_path, f"{clip}<rect x='2' y='2' width='2' height='1' clip-path='url(#c)'/>"
    ).interiors
    assert set(hole.coords) == {(2, 4), (3, 4), (3, 3), (2, 3)}
    (hole,) = room_of(tmp_path, f"{clip}<circle cx='3' cy='3' r='1' clip-path='url(#c)'/>").interiors
    assert max(x for x, _ in hole.coords) == pytest.approx(3.0, abs=1e-9)


@pytest.mark.parametrize("cap", ["flat", "square"])
@pytest.mark.parametrize("matrix", [(4, 0, 0, 1), (1, 0, -0.9, 1)], ids=["stretched", "skewed"])
def test_a_stroke_that_a_transform_distorts_is_nowhere_smaller_than_drawn(tmp_path, cap, matrix):
    a, b, c, d = matrix
    style = f"{WIDE};fill:none;stroke-linecap:{'butt' if cap == 'flat' else cap}"
    body = f"<g transform='matrix({a} {b} {c} {d} 3 0)'><path d='M1 2L1.5 4H2' style='{style}'/></g>"
    stroke = LineString([(1, 2), (1.5, 4), (2, 4)]).buffer(0.2, cap_style=cap, join_style="mitre")
    drawn = affine_transform(stroke, [a, c, -b, -d, 3, 6])
    assert room_of(tmp_path, body).intersection(drawn).area == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("transform", ["skewX(40)", "matrix(1 .5 .7 1 0 0)", "scale(3,.5) rotate(30)"])
@pytest.mark.parametrize("ry", [1.0, 0.4])
def test_arcs_are_where_a_skewed_transform_takes_them(tmp_path, transform, ry):
    arc = f"A1 {ry} 0 0 1"
    drawn = f"<path transform='translate(5,3) {transform}' d='M-1 0{arc} 1 0{arc} -1 0Z'/>"
    floor = room_of(tmp_path, drawn)
    angle = np.linspace(0.0, 2.0 * np.pi, 500)
    m = Matrix(transform)
    x, y = np.cos(angle), ry * np.sin(angle)
    assert not contains_xy(floor, 5 + m.a * x + m.c * y, 3 - m.b * x - m.d * y).any()
    (hole,) = floor.interiors
    assert Polygon(hole).area == pytest.approx(abs(m.determinant) * np.pi * ry, rel=1e-2)


def test_notes_count_what_is_left_out_and_what_is_read_as_more(tmp_path):
    body = (
        "<g style='display:none'><rect width='1' height='1'/><line x2='1'/></g><text>Hall</text><script/>"
        + across("stroke='red' stroke-dasharray='1' marker-end='url(#arrow)'")
    )
    assert read_floor_plan(write_svg(tmp_path, ROOM + body), METRES).notes == (
        "dashed shapes read as whole ones: 1",
        "1 <marker> left out",
        "1 <script> left out",
        "shapes left out because they are not seen: 2",
        "1 <text> left out",
    )


def test_a_part_of_a_size_that_is_not_stated_is_refused(tmp_path):
    path = write_svg(tmp_path, ROOM + "<rect width='50%' height='1'/>", "")
    with pytest.raises(FloorPlanError, match="<rect> width: '50%' is a part of a size that is not stated"):
        read_floor_plan(path, METRES)

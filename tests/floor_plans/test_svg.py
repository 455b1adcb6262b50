"""SVG drawings: units, transforms, layers, strokes, curves from outside, and what is refused."""

from __future__ import annotations

from io import StringIO

import numpy as np
import pytest
from shapely import MultiPoint, Point, Polygon, box, contains_xy
from svgelements import SVG, Shape
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
    "cut short": ('<g><path d="M 0', "no well-formed XML"),
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
    "half a path": ('<path d="M 0,0 H"/>', "its numbers make no shape"),
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

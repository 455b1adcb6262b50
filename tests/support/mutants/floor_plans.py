"""Floor plans that are malformed: drawings cut off or of junk, maps whose keys or pictures are none."""

from __future__ import annotations

import json
import math
import random
import re
from collections.abc import Iterator
from typing import Any

from tests.support.mutants.mutant import Mutant, block, dotted, leaves, put, without

SVG = (
    b'<svg xmlns="http://www.w3.org/2000/svg" width="10000mm" height="6000mm" viewBox="0 0 10 6">'
    b'<g transform="translate(0,0)"><path d="M 0 0 H 10 V 6 H 0 Z"/>'
    b'<rect x="2" y="2" width="1" height="0.5"/><circle cx="7" cy="3" r="0.5"/></g></svg>'
)
"""A hall with a desk and a column, in metres where the settings say so."""
WKT = b"POLYGON ((0 0, 9 0, 9.5 4, 5 5.25, 0 4, 0 0), (2 2, 3 2, 2.5 3, 2 2))"
GEOJSON: dict[str, Any] = {
    "type": "FeatureCollection",
    "features": [
        {
            "type": "Feature",
            "properties": {"layer": "walls"},
            "geometry": {"type": "Polygon", "coordinates": [[[0, 0], [10, 0], [10, 6], [0, 6], [0, 0]]]},
        },
        {
            "type": "Feature",
            "properties": {},
            "geometry": {"type": "LineString", "coordinates": [[1, 1], [2, 1], [2, 2], [1, 1]]},
        },
    ],
}
MAP: dict[str, Any] = {
    "image": "map.pgm",
    "resolution": 0.1,
    "origin": [0.0, 0.0, 0.0],
    "negate": 0,
    "occupied_thresh": 0.65,
    "free_thresh": 0.196,
}
PICTURE = b"P5\n40 30\n255\n" + bytes(254 for _ in range(40 * 30))
"""A hall of 4 m by 3 m, all of it free."""
DXF = (
    b"0 SECTION 2 HEADER 9 $ACADVER 1 AC1009 9 $INSUNITS 70 4 0 ENDSEC 0 SECTION 2 ENTITIES "
    b"0 LINE 8 walls 10 0 20 0 11 9000 21 0 0 LINE 8 walls 10 9000 20 0 11 9000 21 6000 "
    b"0 LINE 8 walls 10 9000 20 6000 11 0 21 6000 0 LINE 8 walls 10 0 20 6000 11 0 21 0 "
    b"0 CIRCLE 8 walls 10 3000 20 3000 40 500 "
    b"0 ARC 8 walls 10 6000 20 0 40 700 50 0 51 180 0 ENDSEC 0 EOF "
).replace(b" ", b"\n")
"""The hall once more, in millimetres, with a column and an alcove: lines of codes and of values."""
DXF_TAGS = DXF.decode().splitlines()
_DXF_NUMBERS = frozenset(("10", "20", "11", "21", "40", "50", "51"))
_JUNK = ("wide", None, True, [], {}, "1m")


def svg_mutants(seed: int) -> Iterator[Mutant]:
    """Drawings in SVG."""
    rng, text = random.Random(seed), SVG.decode()
    for place in sorted(rng.sample(range(1, text.rindex("</")), 30)):
        yield _text("cut off", place, "the root never closes", text[:place])
    for old, new, because in (
        ('d="M 0 0 H 10 V 6 H 0 Z"', 'd="M 0 0 Q wide"', "it is no path"),
        ('d="M 0 0 H 10 V 6 H 0 Z"', 'd="H 10 V 6"', "it begins nowhere"),
        ('d="M 0 0 H 10 V 6 H 0 Z"', 'd="M 0 0 L 10"', "a point has two coordinates"),
        ('d="M 0 0 H 10 V 6 H 0 Z"', 'd="M 0 0 H nan V 6 Z"', "it is nowhere"),
        ('width="1"', 'width="-1"', "it is a length"),
        ('r="0.5"', 'r="-0.5"', "it is a length"),
        ('r="0.5"', 'r="wide"', "it is no length"),
        ('x="2"', 'x="inf"', "it is nowhere"),
        ('height="0.5"', 'height="1e400"', "nothing is so large"),
        ("translate(0,0)", "spin(3)", "no transform has this name"),
        ("translate(0,0)", "matrix(1 0 0)", "a matrix has six numbers"),
        ("translate(0,0)", "scale(0)", "nothing is left"),
        ("</g>", "", "a group never closes"),
        ("<svg", "<!DOCTYPE s [<!ENTITY a 'b'>]><svg", "drawings declare no entities"),
        ("<svg", "<html", "it is a page"),
        ("</svg>", "</svg><svg/>", "XML has one root"),
    ):
        yield _text(f"{old} to {new}", 0, because, text.replace(old, new, 1))


def wkt_mutants(seed: int) -> Iterator[Mutant]:
    """Well-known text."""
    rng, text = random.Random(seed), WKT.decode()
    for place in sorted(rng.sample(range(1, text.rindex(")")), 25)):
        yield _text("cut off", place, "a bracket never closes", text[:place])
    for old, new, because in (
        ("POLYGON", "POLYGONE", "no geometry has this name"),
        ("POLYGON", "", "it has no kind"),
        ("9 0", "9", "a point has two coordinates"),
        ("9 0", "nine 0", "it is no number"),
        ("9 0", "nan 0", "it is nowhere"),
        ("9 0", "inf 0", "it is nowhere"),
        (", 0 0)", ")", "the ring is open"),
        ("((0 0", "(0 0", "a bracket is missing"),
        ("2 2))", "2 2))))", "brackets close that never opened"),
        ("))", ")) and more", "it is one geometry"),
    ):
        yield _text(f"{old} to {new}", 0, because, text.replace(old, new, 1))
    for kind, wkt in (("point", "POINT (1 1)"), ("line", "LINESTRING (0 0, 5 5)"), ("void", "POLYGON EMPTY")):
        yield _text(kind, 0, "it encloses nothing", wkt)


def geojson_mutants(seed: int) -> Iterator[Mutant]:
    """GeoJSON with values of the wrong kind at every place of a coordinate, and cut files."""
    rng, text = random.Random(seed), json.dumps(GEOJSON)
    for place in sorted(rng.sample(range(1, len(text)), 25)):
        yield _text("cut off", place, "a brace never closes", text[:place])
    for place, value in leaves(GEOJSON):
        if "coordinates" in place and isinstance(value, int):
            for wrong in ("wide", None, {}, math.nan, math.inf):
                changed = json.dumps(put(GEOJSON, place, wrong))
                yield Mutant(f"{wrong!r} for a number", dotted(place), "it is a number", changed.encode())
        if place and place[-1] in ("coordinates", "type") and (len(place) > 1 or place[-1] == "type"):
            changed = json.dumps(without(GEOJSON, place))
            if len(place) != 3:  # A feature without a type is caught by its collection alone.
                yield Mutant("missing key", dotted(place), "it is required", changed.encode())
        if place and place[-1] == "type":
            for wrong in ("Polygone", 3, None):
                changed = json.dumps(put(GEOJSON, place, wrong))
                yield Mutant(
                    f"{wrong!r} for a type", dotted(place), "no type has this name", changed.encode()
                )
    ring = ("features", 0, "geometry", "coordinates", 0)
    for kind, value, because in (
        ("an open ring", [[0, 0], [10, 0], [10, 6], [0, 6]], "a ring ends where it begins"),
        ("two corners", [[0, 0], [10, 0], [0, 0]], "it encloses nothing"),
        ("a corner of one number", [[0], [10, 0], [10, 6], [0]], "a corner is x and y"),
    ):
        yield Mutant(kind, dotted(ring), because, json.dumps(put(GEOJSON, ring, value)).encode())


def dxf_mutants(seed: int) -> Iterator[Mutant]:
    """Drawings in DXF: cut off, and with every number of an entity of another kind or gone."""
    rng = random.Random(seed)
    for place in sorted(rng.sample(range(1, len(DXF) - 5), 20)):
        yield Mutant("cut off", f"byte {place}", "the end is missing", DXF[:place])
    first = DXF_TAGS.index("ENTITIES") + 1
    for place in range(first, len(DXF_TAGS) - 1, 2):
        if DXF_TAGS[place] in _DXF_NUMBERS:
            for wrong in ("wide", "nan", "inf", "1e400"):
                yield _tags(f"{wrong} for a number", place + 1, "it is a number", [DXF_TAGS[place], wrong])
            yield _tags("missing", place, "nothing stands for it", [])
            yield _tags("half", place, "a code and a value are a pair", [DXF_TAGS[place]])
    for kind, value in (("cm of none", "99"), ("a word", "mm"), ("unsaid", "0")):
        place = DXF_TAGS.index("70")
        yield _tags(kind, place + 1, "it is the unit", ["70", value])


def map_mutants() -> Iterator[Mutant]:
    """Keys of occupancy maps; the picture beside them is sound."""
    for key in ("image", "resolution", "origin", "occupied_thresh", "free_thresh"):
        if "thresh" not in key:  # Thresholds have their usual values where a file says none.
            yield _map("missing key", key, "it is required", without(MAP, (key,)))
        for value in _JUNK:
            if not (key == "image" and value in ("wide", "1m")):
                yield _map(f"{value!r} for a key", key, "it is of another kind", put(MAP, (key,), value))
    for key, values in (
        ("resolution", (0.0, -0.1, math.nan, math.inf, 1e9)),
        ("origin", ([0.0], [0.0, 0.0, 0.0, 0.0, 0.0], [math.nan, 0.0, 0.0], ["left", 0.0, 0.0])),
        ("occupied_thresh", (-0.5, 1.5, math.nan, 0.1)),
        ("free_thresh", (-0.5, 1.5, math.nan, 0.9)),
        ("negate", (2, "maybe", 0.5, [])),
        ("mode", ("binary", 3, [])),
        ("image", ("none.pgm", "", "..", "/no/such/map.png")),
    ):
        for value in values:
            yield _map(f"{value!r} for a key", key, "it cannot be meant", put(MAP, (key,), value))
    text = block(MAP)
    for kind, changed, because in (
        ("empty", "", "it says nothing"),
        ("a list", "- 1\n", "it is a mapping"),
        ("an open bracket", text + "x: [1\n", "the bracket never closes"),
        ("tabs", text + "\tx: 1\n", "YAML does not indent with tabs"),
        ("a scenario", "workspace: {outer: [[0, 0], [1, 0], [1, 1]]}\n", "it names no picture"),
    ):
        yield Mutant(kind, "the file", because, changed.encode())


def picture_mutants(seed: int) -> Iterator[Mutant]:
    """Pictures of occupancy maps; the keys beside them are sound."""
    rng = random.Random(seed)
    for place in sorted(rng.sample(range(1, len(PICTURE) - 1), 12)):
        yield Mutant("cut off", f"byte {place}", "cells are missing", PICTURE[:place])
    for kind, content, because in (
        ("empty", b"", "it is no picture"),
        ("text", b"a map of the hall\n", "it is no picture"),
        ("no size", re.sub(b"40 30", b"0 0", PICTURE), "it has no cells"),
        ("a size of words", re.sub(b"40 30", b"wide tall", PICTURE), "it has no size"),
    ):
        yield Mutant(kind, "the picture", because, content)


def _text(kind: str, place: int, because: str, text: str) -> Mutant:
    return Mutant(kind, f"byte {place}", because, text.encode())


def _tags(kind: str, place: int, because: str, tag: list[str]) -> Mutant:
    """The drawing with another tag, or none, in place of the one whose line that is."""
    code = place - place % 2
    lines = [*DXF_TAGS[:code], *tag, *DXF_TAGS[code + 2 :]]
    return Mutant(kind, f"line {place + 1}", because, "\n".join(lines).encode() + b"\n")


def _map(kind: str, key: str, because: str, document: dict[str, Any]) -> Mutant:
    return Mutant(kind, key, because, block(document).encode(), key)

"""Reads GeoJSON and well-known text: rings of polygons and line strings in plane coordinates."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from coop_drake.errors import FloorPlanError
from coop_drake.floor_plans.settings import FloorPlanSettings
from coop_drake.floor_plans.walls import Drawing, Wall, refuse_many

_PARTS = ("Point", "LineString", "Polygon")
_KINDS = (*_PARTS, *(f"Multi{kind}" for kind in _PARTS), "GeometryCollection")
_DEGREES = ("4326", "CRS84", "WGS84", "4258")
"""Names by which a file says that its coordinates are degrees."""
_DEEPEST = 20
"""Levels of collections inside each other that are allowed."""


def read_wkt(path: Path, settings: FloorPlanSettings) -> Drawing:
    """Read one geometry.

    Raises:
        FloorPlanError: The text is no geometry.
    """
    file = str(path)
    if settings.layers:
        raise FloorPlanError(file, "layers", "well-known text has none", "leave layers away")
    text = _text(path)
    try:
        geometry = shapely.from_wkt(text)
    except (shapely.GEOSException, ValueError) as error:
        said = "".join(c if c.isprintable() else repr(c)[1:-1] for c in " ".join(str(error).split()))
        finding = f"no well-known text ({said})"
        raise FloorPlanError(
            file, "the text", finding, "write one geometry, for example POLYGON ((0 0, 9 0, 9 5, 0 0))"
        ) from error
    return _drawing(file, [("the geometry", geometry)], settings)


def read_geojson(path: Path, settings: FloorPlanSettings) -> Drawing:
    """Read all geometries of a file in plane coordinates; a feature's layer is its property ``layer``.

    Raises:
        FloorPlanError: The file is damaged, or in degrees.
    """
    file = str(path)
    try:
        document = json.loads(_text(path))
    except json.JSONDecodeError as error:
        finding = f"no JSON ({error.msg}); the file may be cut short"
        raise FloorPlanError(
            file, f"line {error.lineno}, column {error.colno}", finding, "export it anew"
        ) from error
    except (RecursionError, ValueError) as error:
        raise FloorPlanError(file, "the file", f"no readable JSON ({error})", "export it anew") from error
    if isinstance(document, dict) and any(code in json.dumps(document.get("crs")) for code in _DEGREES):
        finding = "its coordinates are degrees"
        raise FloorPlanError(
            file, "crs", finding, "project it to plane coordinates in metres, for example to UTM"
        )
    found = list(_geometries(document, file, "the file", None))
    known = sorted({layer for _, layer, _ in found if layer is not None})
    for layer in settings.layers:
        if layer not in known:
            raise FloorPlanError(
                file, "layers", f"no feature has the layer {layer!r}", f"known: {', '.join(known) or 'none'}"
            )
    chosen = [(place, s) for place, layer, s in found if not settings.layers or layer in settings.layers]
    return _drawing(file, chosen, settings)


def _with_whole_rings(shape: BaseGeometry) -> BaseGeometry:
    """Return the shape; a ring with two different corners only, which encloses nothing, is a ValueError."""
    for polygon in shapely.get_parts(shape):
        rings = (polygon.exterior, *polygon.interiors) if isinstance(polygon, Polygon) else ()
        if any(0 < len(ring.coords) < 4 for ring in rings):
            raise ValueError("a ring has fewer than three corners")
    return shape


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise FloorPlanError(
            str(path), f"byte {error.start}", "no text in UTF-8", "save it in UTF-8"
        ) from error


def _geometries(
    value: Any, file: str, place: str, layer: str | None, depth: int = 0
) -> Iterator[tuple[str, str | None, BaseGeometry]]:
    """Yield the place, the layer and the geometry of everything in a document."""
    kind = value.get("type") if isinstance(value, dict) else None
    if depth > _DEEPEST:
        raise FloorPlanError(file, place, f"nested more than {_DEEPEST} levels deep", "export it flat")
    if kind == "FeatureCollection" and isinstance(value.get("features"), list):
        for index, feature in enumerate(value["features"]):
            yield from _geometries(feature, file, f"features[{index}]", None, depth + 1)
    elif kind == "Feature":
        properties = value.get("properties") or {}
        name = properties.get("layer") if isinstance(properties, dict) else None
        if value.get("geometry") is not None:
            own = None if name is None else str(name)
            yield from _geometries(value["geometry"], file, f"{place}.geometry", own, depth + 1)
    elif kind == "GeometryCollection" and isinstance(value.get("geometries"), list):
        for index, geometry in enumerate(value["geometries"]):
            yield from _geometries(geometry, file, f"{place}.geometries[{index}]", layer, depth + 1)
    elif kind in _KINDS:
        try:
            yield place, layer, _with_whole_rings(shapely.from_geojson(json.dumps(value)))
        except (shapely.GEOSException, ValueError) as error:
            finding = f"no {kind} ({' '.join(str(error).split())})"
            raise FloorPlanError(file, place, finding, "give its coordinates as GeoJSON has them") from error
    else:
        finding = f"{str(kind or value)[:60]!r} is no GeoJSON"
        raise FloorPlanError(file, place, finding, f"use a FeatureCollection or one of {', '.join(_KINDS)}")


def _drawing(file: str, geometries: list[tuple[str, BaseGeometry]], settings: FloorPlanSettings) -> Drawing:
    metre = settings.metres(1.0, file)
    refuse_many(file, sum(int(shapely.get_num_coordinates(geometry)) for _, geometry in geometries))
    walls: list[Wall] = []
    points = 0
    for place, geometry in geometries:
        for part in _parts(geometry):
            coordinates = shapely.get_coordinates(part) * metre
            if part.geom_type == "Point":
                points += 1
            elif len(coordinates) > 1:
                closed = part.geom_type == "LinearRing" or (len(coordinates) > 3 and part.is_ring)
                kept: Any = coordinates[:-1] if closed else coordinates
                walls.append(Wall(np.asarray(kept), 0.0, closed, place))
    return Drawing(tuple(walls), (f"{points} points left out",) if points else ())


def _parts(geometry: BaseGeometry) -> Iterator[BaseGeometry]:
    """The rings, lines and points of a geometry."""
    if hasattr(geometry, "geoms"):
        for part in geometry.geoms:
            yield from _parts(part)
    elif isinstance(geometry, Polygon):
        if not geometry.is_empty:
            yield from (geometry.exterior, *geometry.interiors)
    else:
        yield geometry

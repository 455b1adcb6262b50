"""Reads the lines of a DXF drawing: its model space with all blocks inserted."""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

from coop_drake.errors import FloorPlanError
from coop_drake.floor_plans.curves import flatten
from coop_drake.floor_plans.settings import FloorPlanSettings
from coop_drake.floor_plans.walls import Drawing, Wall, refuse_many

_UNITS = {1: 0.0254, 2: 0.3048, 4: 1e-3, 5: 1e-2, 6: 1.0, 7: 1e3, 10: 0.9144, 14: 1e-1}
"""Units that a floor plan may have, by their codes in $INSUNITS [m]."""

_REQUIRED = {
    "LINE": ("start", "end"),
    "CIRCLE": ("center", "radius"),
    "ARC": ("center", "radius", "start_angle", "end_angle"),
    "ELLIPSE": ("center", "major_axis", "ratio"),
}
"""Attributes that ezdxf would replace by a default if they were missing."""

_MOST_ENTITIES = 200_000
"""Entities that are read at most: blocks inside blocks can multiply without end."""
_MOST_WARNINGS = 5
"""Warnings of ezdxf that become notes."""


def read_dxf(path: Path, settings: FloorPlanSettings) -> Drawing:
    """Read lines, polylines, arcs, circles, ellipses, splines and solids of the visible layers.

    Raises:
        FloorPlanError: The file is damaged, or does not say its unit.
    """
    file = str(path)
    with _warnings() as warnings:
        document = _document(path)
    metre = settings.metres(_UNITS.get(int(document.header.get("$INSUNITS", 0))), file)
    names = {layer.dxf.name: layer for layer in document.layers}
    hidden = {name for name, layer in names.items() if layer.is_off() or layer.is_frozen()}
    walls: list[Wall] = []
    ignored: Counter[str] = Counter()
    used: set[str] = set()
    points = 0
    for entity in _entities(document, file):
        layer = _layer_of(entity)
        used.add(layer)
        if layer in hidden or entity.dxf.get("invisible", 0):
            continue
        if settings.layers and layer not in settings.layers:
            continue
        made = _walls_of(entity, layer, metre, settings.sagitta, file)
        if made is None:
            ignored[entity.dxftype()] += 1
            continue
        points += sum(len(wall.points) for wall in made)
        refuse_many(file, points)
        walls += made
    for layer in settings.layers:
        if layer not in used:
            known = ", ".join(sorted(used)) or "none"
            raise FloorPlanError(file, "layers", f"nothing is drawn on layer {layer!r}", f"known: {known}")
    notes = [f"{count} {kind} left out" for kind, count in sorted(ignored.items())]
    notes += [f"while reading: {line}" for line in warnings[:_MOST_WARNINGS]]
    return Drawing(tuple(walls), tuple(notes))


@contextmanager
def _warnings() -> Iterator[list[str]]:
    """Collect the warnings of ezdxf in a block, so that they become notes and are not printed."""
    lines: list[str] = []
    handler, logger = logging.Handler(logging.WARNING), logging.getLogger("ezdxf")
    handler.emit = lambda record: lines.append(_one_line(record.getMessage()))  # type: ignore[method-assign]
    passed_on, logger.propagate = logger.propagate, False
    logger.addHandler(handler)
    try:
        yield lines
    finally:
        logger.removeHandler(handler)
        logger.propagate = passed_on


def _one_line(finding: object) -> str:
    return " ".join(str(finding).split())


def _document(path: Path) -> Any:
    """The drawing, read without repairs: a repaired number could be a wall in another place."""
    from ezdxf.filemanagement import readfile

    file, remedy = str(path), "save it anew as DXF (R2000 or later) from the CAD program"
    if b"EOF" not in path.read_bytes()[-64:]:
        raise FloorPlanError(
            file, "the end", "the drawing does not end with EOF; it is cut short or no DXF", remedy
        )
    try:
        return readfile(path)
    except Exception as error:  # On a damaged file ezdxf raises whatever it leads to.
        raise FloorPlanError(file, "the file", f"no readable DXF ({_one_line(error)})", remedy) from error


def _entities(document: Any, file: str) -> Iterator[Any]:
    """Yield all entities with blocks dissolved; refuse too many."""
    from ezdxf.disassemble import recursive_decompose
    from ezdxf.lldxf.const import DXFError

    try:
        for count, entity in enumerate(recursive_decompose(document.modelspace())):
            if count >= _MOST_ENTITIES:
                finding = f"more than {_MOST_ENTITIES:,} entities"
                raise FloorPlanError(file, "the model space", finding, "delete what are no walls")
            yield entity
    except (DXFError, RecursionError, ValueError, ZeroDivisionError) as error:
        raise FloorPlanError(
            file,
            "a block",
            f"it cannot be dissolved ({_one_line(error)})",
            "explode the blocks in the CAD program",
        ) from error


def _layer_of(entity: Any) -> str:
    """The layer that an entity is shown on; entities on layer 0 of a block take the layer of the block."""
    layer = str(entity.dxf.get("layer", "0"))
    block = entity.source_block_reference
    return layer if layer != "0" or block is None else _layer_of(block)


def _walls_of(entity: Any, layer: str, metre: float, sagitta: float, file: str) -> list[Wall] | None:
    """The walls that an entity draws; None for a kind of entity that draws no lines."""
    from ezdxf.lldxf.const import DXFError
    from ezdxf.path import make_path

    place = f"{entity.dxftype()} {entity.dxf.get('handle') or ''} on layer {layer!r}".replace("  ", " ")
    _refuse_no_numbers(entity, file, place)
    try:
        outline = make_path(entity)
        pieces = [np.array(piece) * metre for subpath in outline.sub_paths() for piece in _pieces(subpath)]
    except TypeError:
        return None
    except (DXFError, ValueError, ZeroDivisionError, OverflowError, LookupError) as error:
        raise FloorPlanError(
            file, place, f"its numbers make no line ({_one_line(error)})", "delete it or draw it anew"
        ) from error
    if not pieces:
        return []
    width = 0.5 * _width(entity) * metre
    walls = []
    for run in _runs(pieces):
        points, strays = flatten(run, sagitta, from_arcs=True)
        closed = len(points) > 3 and bool(np.hypot(*(points[0] - points[-1])) <= 1e-9)
        walls.append(Wall(points[:-1] if closed else points, width + strays, closed, place))
    return walls


def _refuse_no_numbers(entity: Any, file: str, place: str) -> None:
    """Refuse an entity whose numbers are missing or not finite."""
    numbers = entity.dxf.all_existing_dxf_attribs()
    missing = [name for name in _REQUIRED.get(entity.dxftype(), ()) if name not in numbers]
    wrong = [name for name, value in numbers.items() if isinstance(value, float) and not isfinite(value)]
    for name in (*missing, *wrong):
        finding = f"its {name.replace('_', ' ')} is no number" if name in wrong else f"it has no {name}"
        raise FloorPlanError(file, place, finding, "delete it or draw it anew")


def _runs(pieces: list[Any]) -> Iterator[list[Any]]:
    """Groups of pieces that follow each other."""
    first = 0
    for after in range(1, len(pieces) + 1):
        if after == len(pieces) or not (pieces[after - 1][-1] == pieces[after][0]).all():
            yield pieces[first:after]
            first = after


def _pieces(path: Any) -> Iterator[list[tuple[float, float]]]:
    """Control points of every piece, seen from above."""
    at = path.start
    for command in path.commands():
        controls = [getattr(command, name, None) for name in ("ctrl", "ctrl1", "ctrl2")]
        yield [(p.x, p.y) for p in (at, *(c for c in controls if c is not None), command.end)]
        at = command.end


def _width(entity: Any) -> float:
    """Widest width that a polyline is drawn with, in the file's unit."""
    if entity.dxftype() == "LWPOLYLINE":
        widths = [abs(entity.dxf.get("const_width", 0.0))]
        widths += [abs(width) for corner in entity.get_points("se") for width in corner]
    elif entity.dxftype() == "POLYLINE":
        widths = [abs(entity.dxf.get(f"default_{end}_width", 0.0)) for end in ("start", "end")]
        widths += [abs(v.dxf.get(f"{end}_width", 0.0)) for v in entity.vertices for end in ("start", "end")]
    else:
        return 0.0
    return max((width for width in widths if isfinite(width)), default=0.0)

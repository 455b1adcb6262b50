"""Reads the lines of a DXF drawing: its model space with all blocks inserted."""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from math import isfinite
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from coop_drake.errors import FloorPlanError
from coop_drake.floor_plans.settings import FloorPlanSettings
from coop_drake.floor_plans.walls import Drawing, Wall, flatten, refuse_many

_UNITS = {1: 0.0254, 2: 0.3048, 4: 1e-3, 5: 1e-2, 6: 1.0, 7: 1e3, 10: 0.9144, 14: 1e-1}
"""Units that a floor plan may have, by their codes in $INSUNITS [m]."""

_REQUIRED = {
    "LINE": ("start", "end"),
    "CIRCLE": ("center", "radius"),
    "ARC": ("center", "radius", "start_angle", "end_angle"),
    "ELLIPSE": ("center", "major_axis", "ratio"),
}
"""Attributes that ezdxf would replace by a default if they were missing."""

_NO_WALLS = (
    "DIMENSION",
    "ARC_DIMENSION",
    "LARGE_RADIAL_DIMENSION",
    "LEADER",
    "MULTILEADER",
    "MLEADER",
    "HATCH",
)
"""Entities that draw lines, which are no walls: they measure, explain or fill what is drawn beside them."""

_EXPLODE = "explode the blocks in the CAD program"
_SIMILAR = 1e-9
"""Ratio by which a block may be stretched in one direction and still count as one that is not."""
_DEEPEST = 50
"""Blocks inside each other that are allowed."""
_MOST_ENTITIES = 200_000
"""Entities that are read at most: blocks inside blocks can multiply without end."""
_MOST_WARNINGS = 5
"""Warnings of ezdxf that become notes."""


def read_dxf(path: Path, settings: FloorPlanSettings) -> Drawing:
    """Read lines, polylines, arcs, circles, ellipses, splines and solids of the visible layers.

    Dimensions, leaders, hatches and texts are no walls; a note counts them.

    Raises:
        FloorPlanError: The file is damaged, does not say its unit, or shows a part of another file.
    """
    file = str(path)
    with _warnings() as warnings:
        document = _document(path)
    metre = settings.metres(_UNITS.get(int(document.header.get("$INSUNITS", 0))), file)
    walls: list[Wall] = []
    ignored: Counter[str] = Counter()
    chosen = {layer.lower() for layer in settings.layers}
    used: dict[str, str] = {}
    points = 0
    for shown in _entities(document, file):
        used.setdefault(shown.layer.lower(), shown.layer)
        if not shown.visible or (chosen and shown.layer.lower() not in chosen):
            continue
        made = _walls_of(shown, metre, settings.sagitta, file)
        if made is None:
            ignored[shown.entity.dxftype()] += 1
            continue
        points += sum(len(wall.points) for wall in made)
        refuse_many(file, points)
        walls += made
    for layer in settings.layers:
        if layer.lower() not in used:
            known = ", ".join(sorted(used.values())) or "none"
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


class _Shown(NamedTuple):
    """An entity as it is shown.

    Attributes:
        entity: The entity, in the coordinates of its block.
        matrix: From these to the model space, a ``Matrix44``.
        layer: The layer that it is shown on: entities on layer 0 of a block take the layer of the block.
        visible: Whether it is seen: a layer that is off hides what lies on it, one that is frozen also what
            is inside the blocks on it.
    """

    entity: Any
    matrix: Any
    layer: str
    visible: bool


def _entities(document: Any, file: str) -> Iterator[_Shown]:
    """Yield all entities with blocks dissolved; refuse too many."""
    from ezdxf.lldxf.const import DXFError
    from ezdxf.math import Matrix44
    from ezdxf.protocols import virtual_entities

    layers = {layer.dxf.name.lower(): layer for layer in document.layers}
    off = {name for name, layer in layers.items() if layer.is_off() or layer.is_frozen()}
    frozen = {name for name, layer in layers.items() if layer.is_frozen()}

    def dissolved(
        entities: Iterable[Any], matrix: Any, outer: str, hidden: bool, depth: int
    ) -> Iterator[_Shown]:
        if depth > _DEEPEST:
            raise FloorPlanError(file, "a block", f"more than {_DEEPEST} blocks inside each other", _EXPLODE)
        for entity in entities:
            own = str(entity.dxf.get("layer", "0"))
            layer = outer if own == "0" else own
            unseen = hidden or bool(entity.dxf.get("invisible", 0))
            kind = entity.dxftype()
            if kind == "INSERT":
                unseen = unseen or layer.lower() in frozen
                yield from dissolved(entity.attribs, matrix, layer, unseen, depth + 1)
                for one in entity.multi_insert() if entity.mcount > 1 else (entity,):
                    block = _block_of(one, file, unseen=unseen)
                    yield from dissolved(block, one.matrix44() @ matrix, layer, unseen, depth + 1)
            elif kind not in _NO_WALLS and hasattr(entity, "__virtual_entities__"):
                yield from dissolved(virtual_entities(entity), matrix, layer, unseen, depth + 1)
            else:
                yield _Shown(entity, matrix, layer, not unseen and layer.lower() not in off)

    try:
        for count, shown in enumerate(dissolved(document.modelspace(), Matrix44(), "0", False, 0)):
            if count >= _MOST_ENTITIES:
                finding = f"more than {_MOST_ENTITIES:,} entities"
                raise FloorPlanError(file, "the model space", finding, "delete what are no walls")
            yield shown
    except (DXFError, RecursionError, ValueError, ZeroDivisionError) as error:
        raise FloorPlanError(
            file, "a block", f"it cannot be dissolved ({_one_line(error)})", _EXPLODE
        ) from error


def _block_of(insert: Any, file: str, *, unseen: bool) -> Iterable[Any]:
    """The entities of the block that is inserted; refuse one of another file, unless it is not seen."""
    block, name = insert.block(), insert.dxf.get("name")
    if block is not None and not (block.block.is_xref or block.block.is_xref_overlay):
        return (entity for entity in block if entity.dxftype() != "ATTDEF")
    if unseen:
        return ()
    finding = "it is drawn in another file" if block is not None else "the file does not define it"
    raise FloorPlanError(file, f"the block {name!r}", finding, "bind it in the CAD program, or delete it")


def _walls_of(shown: _Shown, metre: float, sagitta: float, file: str) -> list[Wall] | None:
    """The walls that an entity draws; None for a kind of entity that draws none."""
    from ezdxf.lldxf.const import DXFError
    from ezdxf.path import make_path

    entity, layer = shown.entity, shown.layer
    place = f"{entity.dxftype()} {entity.dxf.get('handle') or ''} on layer {layer!r}".replace("  ", " ")
    if entity.dxftype() in _NO_WALLS:
        return None
    _refuse_no_numbers(entity, file, place)
    try:
        outline = make_path(entity).transform(shown.matrix)
        pieces = [np.array(piece) * metre for subpath in outline.sub_paths() for piece in _pieces(subpath)]
    except TypeError:
        return None
    except (DXFError, ValueError, ZeroDivisionError, OverflowError, LookupError) as error:
        raise FloorPlanError(
            file, place, f"its numbers make no line ({_one_line(error)})", "delete it or draw it anew"
        ) from error
    if not pieces:
        return []
    most, least = np.linalg.svd([shown.matrix.get_row(k)[:2] for k in (0, 1)], compute_uv=False)
    width = 0.5 * _width(entity) * float(most) * metre
    walls = []
    for run in _runs(pieces):
        points, strays = flatten(run, sagitta, from_arcs=True)
        closed = len(points) > 3 and bool(np.hypot(*(points[0] - points[-1])) <= 1e-9)
        flat = width > 0.0 and strays == 0.0 and most - least <= _SIMILAR * most
        walls.append(Wall(points[:-1] if closed else points, width + strays, closed, place, flat=bool(flat)))
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

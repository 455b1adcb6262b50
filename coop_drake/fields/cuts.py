"""Cuts a domain with holes open by slits, so that its map is well-conditioned everywhere."""

from __future__ import annotations

import shapely
from shapely import GeometryCollection, LineString, Point, Polygon

from coop_drake.errors import FieldError
from coop_drake.fields.goals import check_question, pole_of
from coop_drake.geometry.slits import cut_holes

_REMEDY = "move the goal or the start, or map the domain with its holes"
"""What a user can do where a domain cannot be cut open."""

_ROUNDING = 1e-9
"""Distance, per length of the boundary, by which rounding may put the result outside the domain [-]."""


def cut_open(domain: Polygon, goal: Point | Polygon, start: Point | None = None) -> Polygon:
    """The domain with slits from its holes to the outer ring, where the shortest paths to the goal divide.

    A hole that collapses to a point has two disadvantages: streamlines beside the two that end on it are slow
    there, and in an aisle between two holes the map's Jacobian is as small as exp(-pi length / width), so
    that rounding errors hide its direction. In a simply connected domain neither happens. Slits lie where the
    paths to the goal on both sides are equally long, so hardly any path gets longer.

    Example:
        ```
        cell = cut_open(domain, goal)
        field = VelocityField(HarmonicMap(cell, goal))
        ```

    Args:
        domain: The cell, with or without holes [m].
        goal: Point or region to reach; no slit meets it.
        start: Where a transport begins: no slit crosses the widest passage from there to the goal, nor comes
            nearer to it than the passage's walls where there is a choice.

    Returns:
        What is left, inside the domain. Holes that the goal encloses stay.

    Raises:
        FieldError: If the domain, goal or start is not usable, or a hole cannot be joined by straight slits.
    """
    check_question(domain, goal)
    if start is not None and not domain.contains(start):
        raise FieldError(f"the start {start.wkt} must lie strictly inside the domain")
    if not domain.interiors:
        return domain
    kept, room = _what_stays_open(domain, goal, start)
    cell = cut_holes(domain, kept, room)
    _certify(domain, cell, goal, kept)
    return cell


def _what_stays_open(
    domain: Polygon, goal: Point | Polygon, start: Point | None
) -> tuple[GeometryCollection, float]:
    """The goal and the widest passage to it, which no slit may cross; and the distance to keep [m]."""
    if start is None:
        return GeometryCollection([goal]), domain.area / domain.length
    from coop_drake.geometry.passage import PassageFinder  # loads scipy's Voronoi diagrams

    target = goal if isinstance(goal, Point) else pole_of(goal)
    passage = PassageFinder(domain).find(start.coords[0], target.coords[0])
    return GeometryCollection([passage.path, goal]), passage.clearance


def _certify(domain: Polygon, cell: Polygon, goal: Point | Polygon, kept: GeometryCollection) -> None:
    """Refuse a cell that leaves the domain, closes what must stay open, or is not simply connected."""
    if cell.is_empty or not cell.is_valid or not domain.buffer(_ROUNDING * domain.length).covers(cell):
        raise FieldError(f"the slits leave no valid cell around the goal; {_REMEDY}")
    lines = [part for part in shapely.get_parts(kept) if isinstance(part, LineString)]
    if not all(cell.contains(line) for line in lines):
        raise FieldError(f"the slits cross the widest passage to the goal; {_REMEDY}")
    filled = Polygon(goal.exterior) if isinstance(goal, Polygon) else goal
    for hole in cell.interiors:
        if not filled.covers(hole):
            x, y = hole.centroid.coords[0]
            raise FieldError(
                f"the hole around ({x:.6g}, {y:.6g}) m cannot be joined to the outer ring by straight slits "
                f"that leave the passage to the goal open; {_REMEDY}"
            )

"""Projections of cells to the floor: unions of regions over the axes that a picture leaves out."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from manifold3d import CrossSection, OpType

from coop_drake.planning.cells.cells import Region
from coop_drake.planning.cells.graph import Kind
from coop_drake.watching.search_states import Leaf

_OUTLINE_TOLERANCE = 0.005
"""Distance by which outlines may move when they are simplified for drawing [m]: less than a pixel."""

_AT_ONCE = 8
"""Number of sections that are united at once; hundreds at once take ten times as long."""


@dataclass(frozen=True, eq=False)
class Projection:
    """Positions by what is known for at least one choice of the axes left out; the three do not overlap.

    Attributes:
        free: Proved free.
        guide: Free in the middle of some slice, not proved.
        mixed: All else that may be free.
    """

    free: CrossSection
    guide: CrossSection
    mixed: CrossSection


def union(regions: Iterable[Region]) -> CrossSection:
    """Return the union of regions, simplified by millimetres: for drawing, never for proofs."""
    sections = [region.section.simplify(_OUTLINE_TOLERANCE) for region in regions]
    while len(sections) > 1:
        blocks = [sections[i : i + _AT_ONCE] for i in range(0, len(sections), _AT_ONCE)]
        united = [CrossSection.batch_boolean(block, OpType.Add) for block in blocks]
        sections = [section.simplify(_OUTLINE_TOLERANCE) for section in united]
    return sections[0] if sections else CrossSection()


def projection_of(leaves: Sequence[Leaf]) -> Projection:
    """Return the projection of the cells of some slices of one exploration."""
    free, guide, mixed = (
        union(region for leaf in leaves for region in leaf.regions(kind))
        for kind in (Kind.FREE, Kind.GUIDE, Kind.MIXED)
    )
    guide = guide - free
    return Projection(free, guide, mixed - free - guide)

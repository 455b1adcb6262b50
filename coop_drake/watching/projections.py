"""Projections of cells to the floor: unions of regions over the axes that a picture leaves out."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from manifold3d import CrossSection, OpType

from coop_drake.planning.cells.cell_graph import Kind
from coop_drake.planning.cells.cells import Region
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
    return _united([region.section.simplify(_OUTLINE_TOLERANCE) for region in regions])


def _united(sections: Sequence[CrossSection]) -> CrossSection:
    while len(sections) > 1:
        sections = [
            CrossSection.batch_boolean(list(sections[i : i + _AT_ONCE]), OpType.Add).simplify(
                _OUTLINE_TOLERANCE
            )
            for i in range(0, len(sections), _AT_ONCE)
        ]
    return sections[0] if sections else CrossSection()


class Projections:
    """Projects sets of slices, and caches the projection of subsets that several sets share."""

    def __init__(self) -> None:
        self._unions: dict[tuple[Kind, tuple[int, ...]], CrossSection] = {}

    def of(self, leaves: Iterable[Leaf]) -> Projection:
        """Return the projection of the cells of some slices of one exploration."""
        by_id = {leaf.slice: leaf for leaf in leaves}
        ids = sorted(by_id)
        free, guide, mixed = (self._union(kind, by_id, ids) for kind in (Kind.FREE, Kind.GUIDE, Kind.MIXED))
        guide = guide - free
        return Projection(free, guide, mixed - free - guide)

    def _union(self, kind: Kind, by_id: dict[int, Leaf], ids: list[int]) -> CrossSection:
        """Return the union of one kind, united by blocks of neighbouring ids within larger blocks."""
        if len(ids) == 1:
            return self._kept(kind, ids, lambda: union(by_id[ids[0]].regions(kind)))
        if not ids:
            return CrossSection()
        size = 1
        while ids[0] // size != ids[-1] // size:
            size *= _AT_ONCE
        blocks: dict[int, list[int]] = {}
        for index in ids:
            blocks.setdefault(index * _AT_ONCE // size, []).append(index)
        return self._kept(
            kind, ids, lambda: _united([self._union(kind, by_id, block) for block in blocks.values()])
        )

    def _kept(self, kind: Kind, ids: list[int], make: Callable[[], CrossSection]) -> CrossSection:
        """Return the union of a block from memory; make it first if it is not there."""
        key = kind, tuple(ids)
        if key not in self._unions:
            self._unions[key] = make()
        return self._unions[key]

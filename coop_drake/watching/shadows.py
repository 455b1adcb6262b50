"""Shadows of cells on the floor: unions of regions over the axes that a picture leaves out."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from manifold3d import CrossSection, OpType

from coop_drake.planning.cells.cell_graph import Kind
from coop_drake.planning.cells.cells import Region
from coop_drake.watching.moments import Leaf

__all__ = ["Shadow", "Shadows", "union"]

_COARSE = 0.005  # What outlines may move by when they are straightened for drawing [m].
_FEW = 8  # Sections united at once; hundreds at once take ten times as long.


@dataclass(frozen=True, eq=False)
class Shadow:
    """Positions by what is known there for at least one choice of the axes left out; none of them overlap.

    Attributes:
        free: Proved free.
        guide: Free in the middle of some slice, not proved.
        mixed: All else that may be free.
    """

    free: CrossSection
    guide: CrossSection
    mixed: CrossSection


def union(regions: Iterable[Region]) -> CrossSection:
    """Union of regions, straightened by millimetres: for drawing, never for proofs."""
    return _united([region.section.simplify(_COARSE) for region in regions])


def _united(sections: Sequence[CrossSection]) -> CrossSection:
    while len(sections) > 1:
        sections = [
            CrossSection.batch_boolean(list(sections[i : i + _FEW]), OpType.Add).simplify(_COARSE)
            for i in range(0, len(sections), _FEW)
        ]
    return sections[0] if sections else CrossSection()


class Shadows:
    """Casts shadows of many sets of slices, which share most of their slices with one another."""

    def __init__(self) -> None:
        self._known: dict[tuple[Kind, tuple[int, ...]], CrossSection] = {}

    def of(self, leaves: Iterable[Leaf]) -> Shadow:
        """Shadow of the cells of some slices of one exploration."""
        by_id = {leaf.slice: leaf for leaf in leaves}
        ids = sorted(by_id)
        free, guide, mixed = (self._union(kind, by_id, ids) for kind in (Kind.FREE, Kind.GUIDE, Kind.MIXED))
        guide = guide - free
        return Shadow(free, guide, mixed - free - guide)

    def _union(self, kind: Kind, by_id: dict[int, Leaf], ids: list[int]) -> CrossSection:
        """Union of one kind, by blocks of neighbouring ids within larger blocks, each remembered."""
        if len(ids) == 1:
            return self._remembered(kind, ids, lambda: union(by_id[ids[0]].regions(kind)))
        if not ids:
            return CrossSection()
        size = 1
        while ids[0] // size != ids[-1] // size:
            size *= _FEW
        blocks: dict[int, list[int]] = {}
        for index in ids:
            blocks.setdefault(index * _FEW // size, []).append(index)
        return self._remembered(
            kind, ids, lambda: _united([self._union(kind, by_id, block) for block in blocks.values()])
        )

    def _remembered(self, kind: Kind, ids: list[int], make: Callable[[], CrossSection]) -> CrossSection:
        key = kind, tuple(ids)
        if key not in self._known:
            self._known[key] = make()
        return self._known[key]

"""What happens at a moment, in words."""

from __future__ import annotations

from coop_drake.planning.cells.cell_graph import Kind
from coop_drake.planning.cells.exploration import Verdict
from coop_drake.watching.film import BOXES, Film
from coop_drake.watching.moments import Moment

__all__ = ["counters", "headline"]


def headline(film: Film, moment: Moment) -> str:
    """What happened since the moment before, or how the search ended."""
    if moment.verdict is not None:
        return _verdict(film, moment)
    if moment.question == BOXES:
        return f"Box {len(moment.channel)} is laid: all of it is free"
    if moment.splits:
        leaf, axis = moment.splits[-1]
        along = film.axis_names[film.axes_of(moment.robots)[axis]]
        if len(moment.splits) == 1:
            return f"Slice {leaf.slice} is halved along {along}"
        return f"{len(moment.splits)} slices are halved, the last one ({leaf.slice}) along {along}"
    if moment.searched:
        return f"The cheapest channel has {len(moment.channel)} cells, {moment.undecided_links} undecided"
    return f"{len(moment.leaves)} coarse slices of θ to begin with"


def counters(moment: Moment) -> str:
    """How far the search is, in numbers."""
    if moment.question == BOXES:
        return f"{len(moment.channel)} boxes, each overlaps the one before"
    free, mixed = moment.count(Kind.FREE), moment.count(Kind.MIXED)
    parts = [
        f"{moment.slices} slices made, {len(moment.leaves)} in use",
        f"{free} free and {mixed} undecided cells",
    ]
    if moment.channel:
        undecided = f"{moment.undecided_links} undecided" if moment.undecided_links else "all free"
        parts.append(f"channel of {len(moment.channel)} cells, {undecided}, cost {moment.cost:.0f}")
    return "  ·  ".join(parts)


def _verdict(film: Film, moment: Moment) -> str:
    if moment.verdict == Verdict.FOUND.value:
        return f"Found: {len(moment.channel)} free cells join start and goal"
    if moment.verdict == Verdict.INFEASIBLE.value:
        if film.reason:
            return f"Infeasible, proved: {film.reason}"
        if film.margin > 0.0:
            return f"No way keeps {film.margin:g} m from the walls: start and goal lie in separate parts"
        return "Infeasible, proved: whatever may be free falls apart between start and goal"
    if film.reason:
        return f"Undecided: {film.reason}"
    if moment.verdict == Verdict.BUDGET.value:
        return f"Undecided: the budget of slices is spent, {moment.undecided_links} cells to prove"
    return f"Undecided: {moment.undecided_links} cells of the channel are as fine as the resolution"

"""From free cells to boxes: unwrapped theta, full polygons at margin zero, cores at the margin."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import shapely
from shapely import Polygon

from coop_drake.geometry.minkowski import to_polygon
from coop_drake.geometry.swept_tree import Interval, Intervals
from coop_drake.planning.cells import CellMaker, Region
from coop_drake.planning.channel import Channel, FreeBox
from coop_drake.planning.shortcuts import without_detours
from coop_drake.planning.slices import nearest_turn


def unwrapped(intervals: Sequence[Intervals], start_angle: float) -> list[Intervals]:
    """Shift every theta interval by whole turns so that neighbours lie next to each other."""
    result: list[Intervals] = []
    near = start_angle
    for box in intervals:
        lower, upper = box[0]
        centre = 0.5 * (lower + upper)
        shift = near + nearest_turn(centre - near) - centre
        moved: Interval = (lower + shift, upper + shift)
        result.append((moved, *box[1:]))
        near = centre + shift
    return result


def make_channel(
    boxes: Sequence[tuple[Intervals, Region]],
    full: CellMaker,
    margin: float,
    start_angle: float,
    goal_angle: float,
) -> Channel:
    """Leave out boxes that are detours and give the others their full polygons back.

    Args:
        boxes: Expanded intervals and the core of each box.
        full: Cells in the workspace without margin.
        margin: The margin that the cores keep [m].
        start_angle: Theta at the start [rad].
        goal_angle: Theta at the goal, any turn [rad].
    """
    turned = unwrapped([intervals for intervals, _ in boxes], start_angle)
    cores = [
        FreeBox(
            polygon=polygon,
            core=polygon,
            lower=np.array([lower for lower, _ in angles]),
            upper=np.array([upper for _, upper in angles]),
        )
        for polygon, angles in zip([to_polygon(core.section) for _, core in boxes], turned, strict=True)
    ]
    middle = 0.5 * (cores[-1].lower[0] + cores[-1].upper[0])
    goal = float(middle + nearest_turn(goal_angle - middle))
    kept = {id(box) for box in without_detours(Channel(tuple(cores), margin, goal)).boxes}
    free = [
        replace(box, polygon=_surrounding(full, intervals, core))
        for box, (intervals, core) in zip(cores, boxes, strict=True)
        if id(box) in kept
    ]
    return Channel(tuple(free), margin, goal)


def _surrounding(full: CellMaker, intervals: Intervals, core: Region) -> Polygon:
    """The component of the free region at margin zero that the core lies in."""
    inside = to_polygon(core.section)
    candidates = [to_polygon(region.section) for region in full.under_cells(intervals) if region.meets(core)]
    best = max(candidates, key=lambda polygon: shapely.area(shapely.intersection(polygon, inside)))
    return best

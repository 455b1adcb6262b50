"""Targets: points in the overlaps of consecutive cores, chosen such that the estimated time is short."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from shapely import Polygon

from coop_drake.errors import GeometryError, PlanError
from coop_drake.geometry.boundary import BoundaryDistance
from coop_drake.geometry.parts import parts_of
from coop_drake.geometry.passage import PassageFinder, pole
from coop_drake.planning.boxes.channel import Channel, FreeBox
from coop_drake.planning.travel_time import transition_time
from coop_drake.tree.pose import FloatArray

LARGEST_PARTS = 3
"""Of an overlap in several parts only this many are considered, those with the largest inscribed disc."""

MOST_CANDIDATES = 4
"""No overlap adopts targets of others beyond so many [-]: in long aisles all overlaps share theirs, and every
pair costs a search for a passage."""

SHARED_FRACTION = 0.7
"""A target serves another overlap too if its clearance there is this fraction of the clearance of that
overlap's own target [-]."""


def targets_of(channel: Channel, start: FloatArray, goal: FloatArray) -> tuple[FloatArray, ...]:
    """Targets chosen for a short time, or where the path of the boxes leaves them; see ``choose_targets``.

    Overlaps that are a tenth of a millimetre wide may have parts that their boxes do not join.
    """
    try:
        return choose_targets(channel, start, goal)
    except PlanError:
        if channel.ends is None:
            raise
        return (*channel.ends[:-1], goal)


def choose_targets(channel: Channel, start: FloatArray, goal: FloatArray) -> tuple[FloatArray, ...]:
    """Choose a target for every box: poles of inaccessibility of overlapping cores, the last one the goal.

    An overlap may have several parts, and a target may serve several overlaps in a row, in which case only
    angles move. The sequence of targets with the shortest estimated time is chosen.

    Args:
        channel: Boxes whose cores overlap.
        start: Start position, in the first box, shape (2,) [m].
        goal: Goal position, in the last box, shape (2,) [m].

    Returns:
        A point for every box, each of shape (2,) [m].

    Raises:
        PlanError: If consecutive cores do not overlap, or a box does not join its ends.
    """
    layers = [[start], *_candidates(channel.boxes), [goal]]
    times = np.zeros(1)
    choices = []
    for index, box in enumerate(channel.boxes):
        costs = times[:, None] + _crossing_times(box, layers[index], layers[index + 1])
        if not np.isfinite(costs).any():
            raise PlanError(f"cell {index}: its entrance and its exit are not connected inside it")
        choices.append(np.argmin(costs, axis=0))
        times = costs.min(axis=0)
    chosen = [0]
    for choice in reversed(choices[1:]):
        chosen.append(int(choice[chosen[-1]]))
    return tuple(layer[k] for layer, k in zip(layers[1:], reversed(chosen), strict=True))


def _crossing_times(box: FreeBox, entries: Sequence[FloatArray], exits: Sequence[FloatArray]) -> FloatArray:
    """Estimated time from every entry to every exit, infinite without a passage, (entries, exits) [s]."""
    if len(entries) == 1 and len(exits) == 1:
        return np.zeros((1, 1))
    finder = PassageFinder(box.polygon)

    def time(entry: FloatArray, exit_: FloatArray) -> float:
        try:
            passage = finder.find(entry, exit_)
        except GeometryError:
            return float("inf")
        return transition_time(passage.length, passage.clearance)

    return np.array([[time(entry, exit_) for exit_ in exits] for entry in entries])


def _candidates(boxes: Sequence[FreeBox]) -> list[list[FloatArray]]:
    """For every overlap its own poles, and the poles of neighbouring overlaps that fit into it."""
    overlaps = [_parts(first, second, index) for index, (first, second) in enumerate(pairwise(boxes))]
    own = [[pole(part) for part in parts] for parts in overlaps]
    layers = [[point for point, _ in poles] for poles in own]
    for order in (range(1, len(overlaps)), range(len(overlaps) - 2, -1, -1)):
        before = 1 if order.step == -1 else -1
        for index in order:
            _adopt(
                layers[index],
                layers[index + before],
                overlaps[index],
                [clearance for _, clearance in own[index]],
            )
    return layers


def _adopt(
    layer: list[FloatArray],
    others: Sequence[FloatArray],
    parts: Sequence[Polygon],
    clearances: Sequence[float],
) -> None:
    """Add points of a neighbouring overlap that have enough clearance in one of the parts, up to a number."""
    for point in others:
        known = any(np.array_equal(point, mine) for mine in layer)
        fits = any(
            BoundaryDistance(part)(point) >= SHARED_FRACTION * clearance
            for part, clearance in zip(parts, clearances, strict=True)
        )
        if fits and not known and len(layer) < MOST_CANDIDATES:
            layer.append(point)


def _parts(first: FreeBox, second: FreeBox, index: int) -> list[Polygon]:
    """Parts of the overlap of two cores, those with the largest inscribed disc first."""
    parts = [part for part in parts_of(first.core.intersection(second.core)) if part.area > 0.0]
    if not parts:
        raise PlanError(f"cells {index} and {index + 1}: their cores do not overlap")
    return sorted(parts, key=lambda part: -pole(part)[1])[:LARGEST_PARTS]

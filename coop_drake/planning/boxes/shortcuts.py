"""Fewer boxes for a channel: those go whose neighbours overlap well enough without them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from coop_drake.planning.boxes.channel import Channel, FreeBox
from coop_drake.tree.pose import FloatArray

__all__ = ["without_detours"]

LEAST_SHARED = 0.15
"""Share of the narrower interval that two boxes must have in common on every axis [-]."""

LOOKAHEAD = 24
"""So many boxes further on is looked for one to go to directly."""


def without_detours(channel: Channel) -> Channel:
    """Leave out boxes between two that overlap anyway: every box costs the time that angles need to settle.

    From each box the way goes on to the farthest one, within the lookahead, with which its core overlaps in
    the plane and its intervals by a fair share.

    Args:
        channel: Boxes of which consecutive ones overlap.

    Returns:
        A channel of some of the boxes, in the same order, the first and the last among them.
    """
    boxes = channel.boxes
    kept, here = [boxes[0]], 0
    while here + 1 < len(boxes):
        onwards = range(min(here + LOOKAHEAD, len(boxes) - 1), here + 1, -1)
        here = next((there for there in onwards if _overlap(boxes[here], boxes[there])), here + 1)
        kept.append(boxes[here])
    return replace(channel, boxes=tuple(kept))


def _overlap(first: FreeBox, second: FreeBox) -> bool:
    shared = np.minimum(first.upper, second.upper) - np.maximum(first.lower, second.lower)
    widths: FloatArray = np.minimum(first.upper - first.lower, second.upper - second.lower)
    return bool((shared >= LEAST_SHARED * widths).all()) and first.core.intersection(second.core).area > 0.0

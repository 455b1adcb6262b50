"""Cover a path with boxes that are proved free by over-sweeps; consecutive boxes overlap."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from shapely import MultiPolygon, Polygon

from coop_drake.geometry.body_pairs import BodyPairs
from coop_drake.geometry.swept_tree import Intervals, SweptTree
from coop_drake.planning.boxes.box_kernels import longest_box, padded
from coop_drake.planning.boxes.box_sweeps import BoxArrays
from coop_drake.planning.sampling.densify import densified
from coop_drake.planning.sampling.obstacle_grid import ObstacleGrid, grid_inside
from coop_drake.tree.pose import FloatArray, IntArray

LEVELS = ((0.06, 0.02), (0.03, 0.01), (0.015, 0.004), (0.004, 0.001), (0.001, 0.0003))
"""Padding of a box in every angle and joint [rad or m], and clearance that it needs at both ends [m]; the
widest comes first, because wide boxes are crossed faster."""

FIRST_LEVELS = LEVELS[2:]
"""The levels with which the longest boxes are laid: without wide paddings each holds more of the path."""

SMALLEST_LEVELS = (*LEVELS, (0.0003, 0.0001), (0.00003, 0.00001))
"""``LEVELS`` and further levels, for passages of a tenth of a millimetre [rad or m, m]."""

SPACING = 0.02
"""Distance between samples of a path in any scaled axis [m]: a box ends at a sample."""

FINEST_SPACING, SMALLEST_SPACING = 0.002, 0.00004
"""Samples closer than this are not refined any more [m]; the second one belongs to ``SMALLEST_LEVELS``."""

REFINEMENT = 4
"""Where no box holds two consecutive samples, so many intervals take the place of one."""

FIRST_REACH = 4
"""Samples in the first box that is tried, before the length of any box is known."""


@dataclass(frozen=True)
class PathBox:
    """A free box along a path.

    Attributes:
        intervals: Intervals of (theta, q...).
        positions: Positions p_WL; the team is free at every point of the polyline through them, for all
            angles in the intervals, shape (k, 2) [m].
    """

    intervals: Intervals
    positions: FloatArray


class Certifier:
    """Covers paths with boxes in one workspace.

    Every box is proved free: its over-swept footprint touches no wall along the path, and no bodies touch.
    Consecutive boxes share a sample of the path, padded in every angle. Where no box holds two consecutive
    samples, the path is sampled more closely.

    Args:
        swept: Sweeps of the team's pieces.
        pairs: Self-collision of the team.
        workspace: Where the team may be; the margin is already taken off [m].
        scale: How far a unit of each axis of z moves the team, shape (3 + n,).
        margin: Clearance that the boxes' positions have beyond that [m].

    Attributes:
        trials: Boxes tried so far.
    """

    def __init__(
        self,
        swept: SweptTree,
        pairs: BodyPairs,
        workspace: Polygon | MultiPolygon,
        scale: FloatArray,
        margin: float,
    ) -> None:
        self._boxes = box_arrays(swept, pairs)
        self._grid: ObstacleGrid = grid_inside(workspace, swept.tree.reach)
        self._scale, self._margin = scale, margin
        self._reach, self._level = FIRST_REACH, 0
        self.trials = 0

    def boxes(
        self,
        path: FloatArray,
        progress: Callable[[float], None] | None = None,
        *,
        longest: bool = False,
        smallest: bool = False,
    ) -> list[PathBox] | None:
        """Cover a path with boxes, from its first to its last configuration.

        Args:
            path: Configurations with circular axes unwrapped, the first one free, shape (m, 3 + n).
            progress: Called with the fraction of the path that is covered.
            longest: Whether to take the longest boxes, instead of those with the highest average speed.
            smallest: Whether boxes may be as small as a passage of a millimetre needs; a transport through
                them takes long.

        Returns:
            The boxes, or None if a part of the path cannot be covered.
        """
        levels = SMALLEST_LEVELS if smallest else FIRST_LEVELS if longest else LEVELS
        finest = SMALLEST_SPACING if smallest else FINEST_SPACING
        samples = densified(path, self._scale, SPACING)
        boxes: list[PathBox] = []
        i, self._level = 0, 0
        while i < len(samples) - 1:
            found = self._next_box(samples, i, longest, levels)
            if found is None:
                if np.abs((samples[i + 1] - samples[i]) * self._scale).max() < finest:
                    return None
                samples = _finer(samples, i)
                continue
            i, box = found
            boxes.append(box)
            if progress is not None:
                progress(i / (len(samples) - 1))
        return boxes

    def _next_box(
        self, samples: FloatArray, i: int, longest: bool, levels: tuple[tuple[float, float], ...]
    ) -> tuple[int, PathBox] | None:
        """The box that begins at sample i, and the sample at which it ends; None if there is none.

        Levels wider than that of the box before by more than one are not tried: they would fail in narrow
        passages again and again.
        """
        for level in range(max(self._level - 1, 0), len(levels)):
            pad, clearance = levels[level]
            fastest, furthest, trials = longest_box(
                self._boxes, self._grid, samples, i, self._reach, pad, clearance, self._margin
            )
            self.trials += trials
            self._reach = max(1, furthest - i)
            j = furthest if longest else fastest
            if j > i:
                self._level = level
                lower, upper = padded(self._boxes, samples, i, j, pad)
                intervals = tuple((float(a), float(b)) for a, b in zip(lower, upper, strict=True))
                return j, PathBox(intervals, samples[i : j + 1, :2].copy())
        return None


def _finer(samples: FloatArray, i: int) -> FloatArray:
    """Samples with more of them between sample i and the next one."""
    fraction = np.arange(1, REFINEMENT)[:, None] / REFINEMENT
    between = samples[i] + fraction * (samples[i + 1] - samples[i])
    return np.concatenate((samples[: i + 1], between, samples[i + 1 :]))


def box_arrays(swept: SweptTree, pairs: BodyPairs) -> BoxArrays:
    """Arrays of a team for the compiled boxes; a piece that several collision pairs need is swept once."""
    rows = pairs.pieces.tolist()
    needed = {(i, stages) for i, _, stages, _ in rows} | {(j, stages) for _, j, _, stages in rows}
    sweeps = sorted(needed, key=lambda sweep: (-sweep[0], sweep[1]))
    row = {sweep: k for k, sweep in enumerate(sweeps)}
    infinite = np.array([np.inf])
    return BoxArrays(
        swept.arrays,
        _table(sweeps),
        _table([(row[i, first], row[j, second]) for i, j, first, second in rows]),
        np.concatenate((-infinite, swept.tree.joint_lower)),
        np.concatenate((infinite, swept.tree.joint_upper)),
    )


def _table(rows: Sequence[tuple[int, int]]) -> IntArray:
    return np.array(rows, dtype=np.int64).reshape(-1, 2)

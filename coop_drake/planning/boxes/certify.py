"""Turn a candidate path into a chain of boxes that are proved free: over-swept, overlapping, greedy."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from shapely import MultiPolygon, Polygon

from coop_drake.geometry.body_pairs import BodyPairs
from coop_drake.geometry.sweep_kernels import IntArray
from coop_drake.geometry.swept_tree import Intervals, SweptTree
from coop_drake.planning.boxes.box_kernels import BoxArrays, longest_box, padded
from coop_drake.planning.sampling.obstacle_grid import Walls, walls_under
from coop_drake.planning.sampling.sampler import densified
from coop_drake.tree.pose import FloatArray

_LEVELS = ((0.06, 0.02), (0.03, 0.01), (0.015, 0.004), (0.004, 0.001), (0.001, 0.0003))
_LAST_LEVELS = (*_LEVELS, (0.0003, 0.0001))
_RESOLUTION = 0.02
_FINEST, _LAST_FINEST = 0.002, 0.0005
_FINER = 4


@dataclass(frozen=True)
class PathBox:
    """A free box along a path.

    Attributes:
        intervals: Intervals of (theta, q...).
        way: Positions along which the team is free for all of them, joined by straight lines, shape (k, 2).
    """

    intervals: Intervals
    way: FloatArray


class Certifier:
    """Lays boxes along paths in one workspace.

    A box is sound whatever path it was laid for: its over-swept footprint touches no wall along its way and
    no two bodies touch. Consecutive boxes share a sample of the path, padded in every angle. Where no box
    holds two samples, closer ones are taken.

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
        self._walls: Walls = walls_under(workspace, swept.tree.reach)
        self._scale, self._margin = scale, margin
        self._guess = 4
        self.trials = 0

    def boxes(
        self,
        path: FloatArray,
        progress: Callable[[float], None] | None = None,
        *,
        quick: bool = False,
        last: bool = False,
    ) -> list[PathBox] | None:
        """Chain of boxes from the path's first to its last configuration, or None if one is missing.

        Args:
            path: Configurations with theta unwrapped, the first one free, shape (m, 3 + n).
            progress: Called with the share of the path that is covered.
            quick: Whether to take the longest boxes instead of those that are passed quickest.
            last: Whether boxes may be as small as a millimetre of room asks for, too narrow to be executed
                in good time.
        """
        samples = densified(path, self._scale, _RESOLUTION)
        chain: list[PathBox] = []
        i = 0
        while i < len(samples) - 1:
            found = self._longest(samples, i, quick, _LAST_LEVELS if last else _LEVELS)
            if found is None:
                if np.abs((samples[i + 1] - samples[i]) * self._scale).max() < (
                    _LAST_FINEST if last else _FINEST
                ):
                    return None
                samples = _finer(samples, i)
                continue
            i, box = found
            chain.append(box)
            if progress is not None:
                progress(i / (len(samples) - 1))
        return chain

    def _longest(
        self, samples: FloatArray, i: int, quick: bool, levels: tuple[tuple[float, float], ...]
    ) -> tuple[int, PathBox] | None:
        """Sample that one box holds together with sample i, and that box."""
        for pad, room in levels:
            quickest, longest, trials = longest_box(
                self._boxes, self._walls, samples, i, self._guess, pad, room, self._margin
            )
            self.trials += trials
            j = longest if quick else quickest
            if j > i:
                self._guess = max(1, (longest - i) // 2)
                part = samples[i : j + 1]
                lower, upper = padded(self._boxes, part, pad)
                intervals = tuple((float(a), float(b)) for a, b in zip(lower, upper, strict=True))
                return j, PathBox(intervals, part[:, :2].copy())
        return None


def _finer(samples: FloatArray, i: int) -> FloatArray:
    """Samples with more of them between one and the next."""
    share = np.arange(1, _FINER)[:, None] / _FINER
    between = samples[i] + share * (samples[i + 1] - samples[i])
    return np.concatenate((samples[: i + 1], between, samples[i + 1 :]))


def box_arrays(swept: SweptTree, pairs: BodyPairs) -> BoxArrays:
    """Lay a team out for the compiled boxes; every piece that a pair needs is swept once."""
    frames: dict[tuple[int, int], int] = {}
    rows: list[tuple[int, int]] = []
    for i, j, first_stages, second_stages in pairs.pieces.tolist():
        first = frames.setdefault((i, first_stages), len(frames))
        rows.append((first, frames.setdefault((j, second_stages), len(frames))))
    infinite = np.array([np.inf])
    return BoxArrays(
        swept.arrays,
        _table(list(frames)),
        _table(rows),
        np.concatenate((-infinite, swept.tree.joint_lower)),
        np.concatenate((infinite, swept.tree.joint_upper)),
    )


def _table(rows: list[tuple[int, int]]) -> IntArray:
    return np.array(rows, dtype=np.int64).reshape(-1, 2)

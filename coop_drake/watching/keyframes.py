"""Keyframes of a recording: all that the figures and the scene draw, worked out before drawing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coop_drake.planning.cells.exploration import Verdict
from coop_drake.tree.pose import FloatArray
from coop_drake.watching.captions import counters, headline
from coop_drake.watching.channel_path import PathPiece, path_through
from coop_drake.watching.components import Components, components_from_start
from coop_drake.watching.projections import Projection, projection_of
from coop_drake.watching.recording import SearchRecording
from coop_drake.watching.search_states import SearchState, search_states


@dataclass(frozen=True, eq=False)
class Keyframe:
    """One state of a search, ready to draw.

    Attributes:
        state: What is known.
        headline: What just happened, or the verdict.
        counters: How far the search is.
        projection: What is known about every position, for some choice of the angles.
        path: The line through the channel, cell by cell.
        components: What start and goal lie in, once they are proved to be apart; else None.
        cut_at: Point (theta, q...) of the exploration's axes through which subdivisions are cut,
            shape (1 + n,) [rad, m].
    """

    state: SearchState
    headline: str
    counters: str
    projection: Projection
    path: tuple[PathPiece, ...]
    components: Components | None
    cut_at: FloatArray


def keyframes(recording: SearchRecording, most: int) -> list[Keyframe]:
    """Choose at most ``most`` states of a recording and work out what to draw of each."""
    frames: list[Keyframe] = []
    for state in search_states(recording.events, most):
        frames.append(_keyframe(recording, state, frames[-1] if frames else None))
    return frames


def _keyframe(recording: SearchRecording, state: SearchState, before: Keyframe | None) -> Keyframe:
    start, goal = recording.start_of(state.robots), recording.goal_of(state.robots)
    circular = recording.circular_of(state.robots)
    if before is not None and before.state.question != state.question:
        before = None
    if before is not None and before.state.channel is state.channel:
        path = before.path
    else:
        path = tuple(path_through(state.channel, start, goal, circular))
    if state.splits:
        cut_at = np.array([0.5 * (lower + upper) for lower, upper in state.splits[-1][0].intervals])
    else:
        cut_at = start[2:] if before is None else before.cut_at
    leaves = list(state.leaves.values())
    apart = state.verdict == Verdict.INFEASIBLE.value
    return Keyframe(
        state=state,
        headline=headline(recording, state),
        counters=counters(state),
        projection=projection_of(leaves),
        path=path,
        components=components_from_start(leaves, start, circular) if apart else None,
        cut_at=cut_at,
    )

"""What happens at a keyframe, in words."""

from __future__ import annotations

from coop_drake.planning.cells.exploration import Verdict
from coop_drake.planning.cells.graph import Kind
from coop_drake.watching.recording import BOXES, SearchRecording
from coop_drake.watching.search_states import SearchState


def headline(recording: SearchRecording, state: SearchState) -> str:
    """Return what happened since the keyframe before, or how the search ended."""
    if state.verdict is not None:
        return _verdict(recording, state)
    if state.question == BOXES:
        return f"Box {len(state.channel)} is added: all of it is free"
    if state.splits:
        leaf, axis = state.splits[-1]
        along = recording.axis_names[recording.axes_of(state.robots)[axis]]
        if len(state.splits) == 1:
            return f"Slice {leaf.slice} is halved along {along}"
        return f"{len(state.splits)} slices are halved, the last one ({leaf.slice}) along {along}"
    if state.searched:
        return f"The cheapest channel has {len(state.channel)} cells, {state.undecided} undecided"
    return f"{len(state.leaves)} coarse slices of θ to begin with"


def counters(state: SearchState) -> str:
    """Return how far the search is, in numbers."""
    if state.question == BOXES:
        return f"{len(state.channel)} boxes, each of which overlaps the one before"
    free, mixed = state.count(Kind.FREE), state.count(Kind.MIXED)
    parts = [
        f"{state.slices} slices made, {len(state.leaves)} in use",
        f"{free} free and {mixed} undecided cells",
    ]
    if state.channel:
        undecided = f"{state.undecided} undecided" if state.undecided else "all free"
        parts.append(f"channel of {len(state.channel)} cells, {undecided}, cost {state.cost:.0f}")
    return "  ·  ".join(parts)


def _verdict(recording: SearchRecording, state: SearchState) -> str:
    """Return how the search ended."""
    if state.verdict == Verdict.FOUND.value and state.question == BOXES:
        return f"Found: {len(state.channel)} boxes join start and goal, which the plan is made of"
    if state.verdict == Verdict.FOUND.value:
        return f"Found: {len(state.channel)} free cells join start and goal"
    if state.verdict == Verdict.INFEASIBLE.value:
        if recording.reason:
            return f"Infeasible, proved: {recording.reason}"
        if recording.margin > 0.0:
            return (
                f"No path keeps {recording.margin:g} m from the walls: start and goal lie in separate parts"
            )
        return "Infeasible, proved: start and goal lie in separate parts of what may be free"
    if recording.reason:
        return f"Undecided: {recording.reason}"
    if state.verdict == Verdict.BUDGET.value:
        return f"Undecided: the budget of slices is spent, {state.undecided} cells to prove"
    return f"Undecided: {state.undecided} cells of the channel are as fine as the resolution"

"""Which slices of a channel to halve, and along which axis: by strong branching, blame or length."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

from coop_drake.answers.problem import PlanningProblem
from coop_drake.geometry.swept_tree import Intervals
from coop_drake.planning.cells.branching import StrongBranching, Trial
from coop_drake.planning.cells.cell_graph import Cell, Kind
from coop_drake.planning.cells.cells import CellMaker
from coop_drake.planning.cells.halves import Halves
from coop_drake.planning.cells.refine import Blame
from coop_drake.planning.cells.slices import Slices
from coop_drake.tree.levers import axis_levers

SplitRule = Literal["strong", "blame", "longest"]

_BALANCE = 16.0
_DECIDED = 1e-3
_CHARGED = 2.0


class Refinement:
    """Chooses halvings for one exploration.

    What is surely in doubt goes first: as long as a channel passes cells of which not even the middle
    configuration is free, only these are halved; then those that a guide calls free.

    Args:
        problem: The question.
        slices: The subdivision.
        maker: Cells of slices.
        halves: Over-cells of halves.
        rule: How an axis is chosen.

    Attributes:
        finest: Resolution of every axis.
    """

    def __init__(
        self,
        problem: PlanningProblem,
        slices: Slices,
        maker: CellMaker,
        halves: Halves,
        rule: SplitRule = "strong",
    ) -> None:
        self._slices, self._maker, self._rule = slices, maker, rule
        self._levers = axis_levers(problem.tree)
        self._blame = Blame(maker, slices, self._levers)
        self._branching = StrongBranching(problem, slices, maker, halves)
        self.finest = finest_widths(problem)

    def splittable(self, intervals: Intervals) -> list[int]:
        """Axes that are still wider than the resolution."""
        return [
            axis
            for axis, ((lower, upper), finest) in enumerate(zip(intervals, self.finest, strict=True))
            if upper - lower > finest
        ]

    def splits(self, channel: Sequence[Cell]) -> list[tuple[int, int]]:
        """Slices of a channel to halve, each with its axis; none where all of them are below resolution."""
        places = self._doubtful(channel)
        if self._rule == "strong":
            return self._strong(channel, places)
        return [(channel[place].slice, self._axis(channel[place])) for place in places]

    def _doubtful(self, channel: Sequence[Cell]) -> list[int]:
        """Places of the cells to halve, one for each slice."""
        open_places: dict[Kind, dict[int, int]] = {Kind.MIXED: {}, Kind.GUIDE: {}}
        for place, cell in enumerate(channel):
            if cell.kind is not Kind.FREE and self.splittable(self._slices.all[cell.slice].intervals):
                open_places[cell.kind].setdefault(cell.slice, place)
        return list((open_places[Kind.MIXED] or open_places[Kind.GUIDE]).values())

    def _axis(self, cell: Cell) -> int:
        intervals = self._slices.all[cell.slice].intervals
        axes = self.splittable(intervals)
        if self._rule == "blame":
            return self._blame.axis(intervals, cell.region, axes)
        return max(axes, key=lambda axis: (intervals[axis][1] - intervals[axis][0], -axis))

    def _strong(self, channel: Sequence[Cell], places: Sequence[int]) -> list[tuple[int, int]]:
        """Where a halving cuts the channel, such halvings alone; else for every place the best one."""
        best = [(channel[place].slice, self._best(channel, place)) for place in places]
        cutting = [(index, trial.axis) for index, trial in best if trial.cuts]
        return cutting or [(index, trial.axis) for index, trial in best]

    def _best(self, channel: Sequence[Cell], place: int) -> Trial:
        """The halving that cuts; else one that may part bodies in each other's way; else what leaves least.

        Where one component alone is in the way at the middle, only its own axes are tried.

        Where no halving takes anything of the cell it is the widest.
        """
        cell = channel[place]
        intervals = self._slices.all[cell.slice].intervals
        sweeps = {
            axis: (intervals[axis][1] - intervals[axis][0]) * self._levers[axis]
            for axis in self.splittable(intervals)
        }
        if cell.kind is Kind.MIXED:
            blamed = [axis for axis in self._branching.blamed(channel, place) if axis in sweeps]
            sweeps = {axis: sweeps[axis] for axis in blamed} or sweeps
        widest = max(sweeps.values())
        trials = [
            self._branching.trial(channel, place, axis)
            for axis, sweep in sweeps.items()
            if sweep * _BALANCE >= widest
        ]
        cutting = [trial for trial in trials if trial.cuts]
        charged = None if cutting else self._charged(cell, intervals, sweeps)
        if charged is not None:
            return self._branching.trial(channel, place, charged)
        trials = cutting or trials
        areas = [trial.area for trial in trials]
        if max(areas) - min(areas) <= _DECIDED * cell.region.area:
            return max(trials, key=lambda trial: (sweeps[trial.axis], -trial.axis))
        return min(trials, key=lambda trial: (trial.area, trial.axis))

    def _charged(self, cell: Cell, intervals: Intervals, sweeps: dict[int, float]) -> int | None:
        """Axis to halve because two bodies are in each other's way; None if none are, or it is narrow.

        In a cell without a free middle that is so if they touch in the middle: walls may be to blame as well.
        In one with a free middle it is so if they touch anywhere, for then no under-cell comes of the slice.
        """
        middle = tuple((0.5 * (lower + upper), 0.5 * (lower + upper)) for lower, upper in intervals)
        probe = self._slices.expanded(intervals) if cell.kind is Kind.GUIDE else middle
        pair = self._maker.blocked_pair(probe)
        involved = [axis for axis in pair.axes if axis in sweeps] if pair is not None else []
        axis = max(involved, key=lambda axis: (sweeps[axis], -axis), default=None)
        return None if axis is None or _CHARGED * sweeps[axis] < max(sweeps.values()) else axis


def finest_widths(problem: PlanningProblem) -> tuple[float, ...]:
    """Resolution of every axis (theta, q...): intervals that are no wider are not halved [rad or m]."""
    angle, length = problem.settings.angle_resolution, problem.settings.length_resolution
    return (angle, *(angle if joint.kind == "revolute" else length for joint in problem.tree.joints))

"""Invariants that every accepted step must satisfy, as margins that are positive where they hold."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import inf
from typing import NamedTuple

import numpy as np

from coop_drake.answers.plan import Plan
from coop_drake.geometry.boundary import BoundaryDistance, signed_distance
from coop_drake.jit import compiled
from coop_drake.simulation.clearance import TeamClearance, team_distances
from coop_drake.simulation.telemetry import Sample, largest_difference
from coop_drake.tree.pose import FloatArray
from coop_drake.tree.team_arrays import TeamArrays

ACCELERATION_TOLERANCE = 1e-9
"""Largest difference between realised and commanded acceleration of the object [m/s^2, rad/s^2]: a hundred
times the rounding errors of a run."""

GRASP_TOLERANCE = 1e-4
"""Largest distance between an end effector and its grasp where grasps are constraints [m]. Clearances are
computed for end effectors in place and would be wrong by this distance. With steps of a millisecond, a
constraint yields by some 1e-8 m for each newton."""

WRENCH_TOLERANCE = 1e-8
"""Largest difference between a grasp's measured and commanded wrench [N, N m]: a hundred times the rounding
errors."""


@compiled(borrows=True)
def margins(
    team: TeamArrays, walls: FloatArray, poses: FloatArray, vertices: FloatArray, discs: FloatArray,
    z: FloatArray, cell: FloatArray, lower: FloatArray, upper: FloatArray,
    funnel_lower: FloatArray, funnel_upper: FloatArray, commanded: FloatArray, measured: FloatArray,
) -> tuple[float, int, float, int, float, float, int, float, int, float]:  # fmt: skip
    """Return what ``team_distances`` returns, then the margins of cell, funnels, slice and wrenches.

    Args:
        team: With the next five as in ``team_distances``.
        walls: Of the floor.
        poses: Room for poses.
        vertices: Room for vertices.
        discs: Room for discs.
        z: The configuration.
        cell: Edges of the cell's governed set, shape (edges, 4) [m].
        lower: Of the cell's slice, shape (1 + n,) [rad or m].
        upper: Of the cell's slice, shape (1 + n,) [rad or m].
        funnel_lower: Lower funnel bounds, shape (1 + n,) [rad or m].
        funnel_upper: Upper funnel bounds, shape (1 + n,) [rad or m].
        commanded: Commanded wrenches of the end effectors, shape (N, 3) [N, N m].
        measured: Wrenches that the grasps transmit, shape (N, 3) [N, N m].

    Returns:
        Distances; signed distance of the object to its cell's boundary [m]; smallest margin to a funnel and
        the axis; smallest margin to the slice and the axis; largest difference of wrenches.
    """
    wall, piece, between, pair = team_distances(team, walls, poses, vertices, discs, z)
    in_cell = signed_distance(cell, z[0], z[1])
    funnel, funnel_axis = _narrowest(z, funnel_lower, funnel_upper)
    margin, slice_axis = _narrowest(z, lower, upper)
    error = largest_difference(measured, commanded)
    return wall, piece, between, pair, in_cell, funnel, funnel_axis, margin, slice_axis, error


@compiled(borrows=True)
def _narrowest(z: FloatArray, lower: FloatArray, upper: FloatArray) -> tuple[float, int]:
    """Return the smallest distance of an axis to its interval's ends, and the axis; NaN if one is NaN."""
    least, axis = inf, 0
    for i in range(lower.size):
        margin = min(z[2 + i] - lower[i], upper[i] - z[2 + i])
        if np.isnan(z[2 + i] - lower[i]) or np.isnan(upper[i] - z[2 + i]):
            return np.nan, i
        if margin < least:
            least, axis = margin, i
    return least, axis


@dataclass(frozen=True)
class Margins:
    """Margins of one instant; names and units as in ``SimulationLog``.

    Attributes:
        workspace_clearance: Distance of the nearest body to the walls [m].
        body_clearance: Smallest distance between bodies that must not touch [m].
        cell_clearance: Signed distance of the object's position to the boundary of its cell [m].
        funnel_margin: Smallest distance of an axis to its funnel [rad or m].
        slice_margin: Smallest distance of an axis to its slice [rad or m].
        energy_margin: Delta E [m^2/s^2].
        acceleration_error: Realised less commanded acceleration [m/s^2 or rad/s^2].
        wrench_error: Measured less commanded wrench [N or N m].
        violation: Which invariant is broken, when and by how much; empty if none is.
    """

    workspace_clearance: float
    body_clearance: float
    cell_clearance: float
    funnel_margin: float
    slice_margin: float
    energy_margin: float
    acceleration_error: float
    wrench_error: float
    violation: str


class _Measured(NamedTuple):
    """The values that the compiled ``margins`` returns."""

    wall: float
    piece: int
    between: float
    pair: int
    in_cell: float
    funnel: float
    funnel_axis: int
    slice: float
    slice_axis: int
    wrench_error: float


class Invariants:
    """Checks samples of a run against the floor, the team and the plan.

    Args:
        clearance: Distances of the team's bodies.
        plan: The plan that is followed.
        exact: Whether the law's equations must hold to rounding, as they do for an ideal team.
    """

    def __init__(self, clearance: TeamClearance, plan: Plan, *, exact: bool = True) -> None:
        self._clearance, self._exact = clearance, exact
        self._cells = [
            (BoundaryDistance(cell.tidied).edges, np.array(cell.lower), np.array(cell.upper))
            for cell in plan.cells
        ]
        self._axes = ("object angle", *plan.joint_names)

    def check(self, sample: Sample) -> Margins:
        """Measure every margin, and say which invariant is broken if one is."""
        arguments = (
            *(sample.z, *self._cells[sample.cell], sample.funnel_lower, sample.funnel_upper),
            *(sample.commanded_wrenches, sample.measured_wrenches),
        )
        measured = _Measured(*margins(*self._clearance.kernel_arguments, *arguments))
        broken = [*self._broken(sample, measured)]
        if self._exact:
            broken.extend(_inexact(sample, measured.wrench_error))
        return Margins(
            workspace_clearance=measured.wall,
            body_clearance=measured.between,
            cell_clearance=measured.in_cell,
            funnel_margin=measured.funnel,
            slice_margin=measured.slice,
            energy_margin=sample.energy_margin,
            acceleration_error=sample.acceleration_error,
            wrench_error=measured.wrench_error,
            violation=_described(sample, broken) if broken else "",
        )

    def _broken(self, sample: Sample, measured: _Measured) -> Iterator[str]:
        if not measured.wall > 0.0:
            yield f"clearance between {self._clearance.wall_place(measured.piece)} is {measured.wall:.3g} m"
        if not measured.between > 0.0:
            place = self._clearance.pair_place(measured.pair)
            yield f"clearance between {place} is {measured.between:.3g} m"
        if not measured.in_cell > 0.0:
            where = f"the boundary of cell {sample.cell}"
            yield f"distance of the object to {where} is {measured.in_cell:.3g} m"
        if not measured.funnel > 0.0:
            axis = self._axes[measured.funnel_axis]
            yield f"distance of {axis} to its funnel is {measured.funnel:.3g} rad or m"
        if not measured.slice > 0.0:
            axis = self._axes[measured.slice_axis]
            yield f"distance of {axis} to its slice is {measured.slice:.3g} rad or m"
        if not sample.grasp_error <= GRASP_TOLERANCE:
            yield f"distance of an end effector to its grasp is {sample.grasp_error:.3g} m"


def _described(sample: Sample, broken: list[str]) -> str:
    return f"at t = {sample.time:.6g} s in cell {sample.cell}: {'; '.join(broken)}"


def _inexact(sample: Sample, wrench_error: float) -> Iterator[str]:
    if not sample.energy_margin >= 0.0:
        yield f"Delta E is {sample.energy_margin:.3g} m^2/s^2"
    if not sample.acceleration_error <= ACCELERATION_TOLERANCE:
        yield f"realised less commanded acceleration is {sample.acceleration_error:.3g} m/s^2"
    if not wrench_error <= WRENCH_TOLERANCE:
        yield f"measured less commanded grasp wrench is {wrench_error:.3g} N"

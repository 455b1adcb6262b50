"""What must hold at every accepted step, as margins that are positive where it holds."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from coop_drake.geometry.boundary import BoundaryDistance
from coop_drake.planning.plan import Plan
from coop_drake.simulation.clearance import TeamClearance
from coop_drake.simulation.telemetry import Sample

__all__ = ["ACCELERATION_TOLERANCE", "GRASP_TOLERANCE", "WRENCH_TOLERANCE", "Invariants", "Margins"]

#: Largest difference between realised and commanded acceleration of the object [m/s^2, rad/s^2].
ACCELERATION_TOLERANCE = 1e-9
#: Largest distance between a hand and its grasp where grasps are constraints [m]: clearances are those of
#: bodies whose hands are in place, and would be wrong by more. At steps of a millisecond constraints give by
#: some 1e-8 m for each newton.
GRASP_TOLERANCE = 1e-4
#: Largest difference between a grasp's measured and commanded wrench [N, N m].
WRENCH_TOLERANCE = 1e-8


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


class Invariants:
    """Checks samples of a run against the floor, the team and the plan.

    Args:
        clearance: Distances of the team's bodies.
        plan: The plan that is followed.
        exact: Whether the law's equations must hold to rounding, as they do for an ideal team.
    """

    def __init__(self, clearance: TeamClearance, plan: Plan, *, exact: bool = True) -> None:
        self._clearance, self._plan, self._exact = clearance, plan, exact
        self._cells = [BoundaryDistance(cell.safe) for cell in plan.cells]
        self._axes = ("object angle", *plan.joint_names)

    def check(self, sample: Sample) -> Margins:
        """Measure every margin, and say which invariant is broken if one is."""
        walls, bodies = self._clearance(sample.z)
        cell, axes = self._plan.cells[sample.cell], sample.z[2:]
        in_funnel = np.minimum(axes - sample.funnel_lower, sample.funnel_upper - axes)
        in_slice = np.minimum(axes - cell.lower, cell.upper - axes)
        wrench_error = float(np.abs(sample.measured_wrenches - sample.commanded_wrenches).max())
        in_cell = self._cells[sample.cell](sample.z[:2])
        funnel_axis, slice_axis = int(in_funnel.argmin()), int(in_slice.argmin())
        funnel_margin, slice_margin = float(in_funnel[funnel_axis]), float(in_slice[slice_axis])
        broken = []
        if not walls.distance > 0.0:
            broken.append(f"clearance between {walls.place} is {walls.distance:.3g} m")
        if not bodies.distance > 0.0:
            broken.append(f"clearance between {bodies.place} is {bodies.distance:.3g} m")
        if not in_cell > 0.0:
            where = f"the boundary of cell {sample.cell}"
            broken.append(f"distance of the object to {where} is {in_cell:.3g} m")
        if not funnel_margin > 0.0:
            axis = self._axes[funnel_axis]
            broken.append(f"distance of {axis} to its funnel is {funnel_margin:.3g} rad or m")
        if not slice_margin > 0.0:
            axis = self._axes[slice_axis]
            broken.append(f"distance of {axis} to its slice is {slice_margin:.3g} rad or m")
        if not sample.grasp_error <= GRASP_TOLERANCE:
            broken.append(f"distance of a hand to its grasp is {sample.grasp_error:.3g} m")
        if self._exact:
            broken.extend(_inexact(sample, wrench_error))
        return Margins(
            workspace_clearance=walls.distance,
            body_clearance=bodies.distance,
            cell_clearance=in_cell,
            funnel_margin=funnel_margin,
            slice_margin=slice_margin,
            energy_margin=sample.energy_margin,
            acceleration_error=sample.acceleration_error,
            wrench_error=wrench_error,
            violation=_told(sample, broken) if broken else "",
        )


def _told(sample: Sample, broken: list[str]) -> str:
    return f"at t = {sample.time:.6g} s in cell {sample.cell}: {'; '.join(broken)}"


def _inexact(sample: Sample, wrench_error: float) -> Iterator[str]:
    if not sample.energy_margin >= 0.0:
        yield f"Delta E is {sample.energy_margin:.3g} m^2/s^2"
    if not sample.acceleration_error <= ACCELERATION_TOLERANCE:
        yield f"realised less commanded acceleration is {sample.acceleration_error:.3g} m/s^2"
    if not wrench_error <= WRENCH_TOLERANCE:
        yield f"measured less commanded grasp wrench is {wrench_error:.3g} N"

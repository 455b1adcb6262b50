"""What is read of every accepted step of a closed loop, and the invariants that it must satisfy.

Margins are positive where an invariant holds.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from pydrake.systems.framework import Context

from coop_drake.answers.log import SimulationLog
from coop_drake.answers.plan import Plan
from coop_drake.diagram.closed_loop import Loop, PortRow
from coop_drake.geometry.polygons import BoundaryDistance, signed_distance
from coop_drake.laws import total_wrench
from coop_drake.simulation.clearance import TeamClearance, team_distances
from coop_drake.systems.block import PHASE_SIZE
from coop_drake.tree.arrays import FloatArray, IntArray


@dataclass(frozen=True)
class Sample:
    """One instant of a run.

    Its fields are the columns of ``SimulationLog`` with their names, shapes and units, without the first
    axis, and what columns are made of: the time of the sample [s], the index of the cell and the time at
    which it was entered [s], z and its rates, both of shape (3 + n,), the causes of a hold as the supervisor
    shows them, of shape (0,) where it cannot be held, what every robot's monitor of departures says, of shape
    (N, 3), or (0, 3) where there is none, and whether all robots report arrival. Where robots of a team that
    passes from cell to cell are in different cells, the cell is the earliest of these.
    """

    time: float
    cell: int
    entry: float
    z: FloatArray
    rates: FloatArray
    accelerations: FloatArray
    base_poses: FloatArray
    governor_position: FloatArray
    governor_spread: float
    funnel_lower: FloatArray
    funnel_upper: FloatArray
    energy_margin: float
    object_wrench: FloatArray
    commanded_wrenches: FloatArray
    measured_wrenches: FloatArray
    grasp_error: float
    base_wrenches: FloatArray
    joint_torques: FloatArray
    acceleration_error: float
    ready_margins: FloatArray
    held: float
    clock_lag: float
    causes: FloatArray
    alarms: FloatArray
    arrived: bool
    phases: FloatArray = field(default_factory=lambda: np.empty((0, PHASE_SIZE)))


def largest_difference(rows: FloatArray, others: FloatArray) -> float:
    """Return the largest magnitude of a component of a difference, NaN if a component is NaN.

    Args:
        rows: Shape (N, k).
        others: Rows to compare with, shape (N, k), or (k,) to compare all with the same row.
    """
    return float(np.abs(rows - others).max())


class Telemetry:
    """Evaluates the ports of a closed loop.

    Args:
        loop: The closed loop.
        root: Context of the whole diagram; every reading is of its present content.
    """

    def __init__(self, loop: Loop, root: Context) -> None:
        self._team, self._root = team, _ = loop.team, root
        self._plant_context = team.plant.GetMyContextFromRoot(root)
        rates = team.plant.num_positions() + team.velocity_index
        self._z = len(team.position_index)
        self._own = np.concatenate([team.position_index, rates])
        self._ports, self._entered = PortRow(root), (0.0, 0.0, 0.0)
        self._places = _places(loop, self._ports)
        grasps = np.array([[robot.X_LE.x, robot.X_LE.y] for robot in team.robots])
        self._load = grasps, team.object_inertia.p_LLcm

    def read(self) -> Sample:
        """Read the present instant: each field of the sample from the ports."""
        team, row = self._team, self._ports.read()
        at = {name: row[place] for name, place in self._places.items()}
        state = team.plant.GetPositionsAndVelocities(self._plant_context)[self._own]
        z, errors = state[: self._z], team.grasps.errors(self._plant_context)
        time, cell, entry = self._root.get_time(), at["cells"][:, 0].min(), float(at["cells"][0, 1])
        if len(at["phases"]):  # Robots have cells of their own: the last one enters at the read before.
            before, entry, seen = self._entered
            entry = entry if cell == before else seen
            self._entered = cell, entry, time
        return Sample(
            time=time,
            cell=int(cell),
            entry=entry,
            z=z,
            rates=state[self._z :],
            accelerations=at["accelerations"],
            base_poses=at["base_poses"],
            governor_position=at["governors"][0],
            governor_spread=largest_difference(at["governors"], at["governors"][0]),
            funnel_lower=at["funnel_lower"],
            funnel_upper=at["funnel_upper"],
            energy_margin=float(at["energy_margins"].min()),
            object_wrench=total_wrench(at["commanded_wrenches"], *self._load, float(z[2])),
            commanded_wrenches=at["commanded_wrenches"],
            measured_wrenches=team.grasps.wrenches(self._plant_context),
            grasp_error=float(errors.max()),
            base_wrenches=at["base_wrenches"],
            joint_torques=at["joint_torques"],
            acceleration_error=largest_difference(at["wanted"], at["accelerations"][:3]),
            ready_margins=at["ready_margins"],
            held=float(at["causes"].any()),
            clock_lag=float(at["clock_lag"].sum()),
            causes=at["causes"],
            alarms=at["alarms"],
            arrived=bool(at["arrived"][0]),
            phases=at["phases"],
        )


def _places(loop: Loop, ports: PortRow) -> dict[str, IntArray]:
    """Return where in a row of ports stands what a sample is made of, in the shape that it has there."""
    team, station, (robots, supervisor, efforts) = loop.team, loop.station.diagram, loop.outputs(ports)
    states = [ports.add(station, f"robot_{robot.index}_state") for robot in team.robots]
    nothing = np.empty(0, dtype=np.intp)
    lower, upper = zip(*(np.split(own["funnels"], 2) for own in robots), strict=True)
    return {
        "cells": np.array([one["current_cell"] for one in (supervisor, *robots) if "current_cell" in one]),
        "arrived": supervisor["arrived"],
        "base_poses": np.array([state[:3] for state in states]),
        "governors": np.array([own["governor_position"] for own in robots]),
        "funnel_lower": _of_all_axes(lower),
        "funnel_upper": _of_all_axes(upper),
        "energy_margins": np.concatenate([own["energy_margin"] for own in robots]),
        "commanded_wrenches": np.array([own["hand_command"][3:] for own in robots]),
        "base_wrenches": np.array([effort[:3] for effort in efforts]),
        "joint_torques": np.concatenate([effort[3:] for effort in efforts]),
        "wanted": np.array([own["object_acceleration"] for own in robots]),
        "accelerations": ports.add(station, "generalized_acceleration")[team.velocity_index],
        "ready_margins": np.array([own["ready"][1] for own in robots]),
        "clock_lag": robots[0].get("clock", nothing)[:1],
        "causes": supervisor.get("causes", nothing),
        "phases": np.concatenate([nothing, *(own.get("phase", nothing) for own in robots)]).reshape(-1, 3),
        "alarms": np.concatenate([nothing, *(own.get("alarm", nothing) for own in robots)]).reshape(-1, 3),
    }


def _of_all_axes(own: Sequence[IntArray]) -> IntArray:
    """Join what robots have of their axes (theta, q_k); the angle's are equal, and the first counts."""
    return np.concatenate([own[0][:1], *(numbers[1:] for numbers in own)])


# Invariants.

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


def _narrowest(axes: FloatArray, lower: FloatArray, upper: FloatArray) -> tuple[float, int]:
    """Return the smallest distance of an axis to its interval's ends, and the axis; NaN if one is NaN."""
    margins = np.minimum(axes - lower, upper - axes)
    axis = int(np.argmin(margins))
    return float(margins[axis]), axis


class Margins(NamedTuple):
    """Margins of one instant; names and units as in ``SimulationLog``.

    Attributes:
        workspace_clearance: Distance of the nearest body to the walls [m].
        piece: Number of its piece.
        body_clearance: Smallest distance between bodies that must not touch [m].
        pair: Number of their pair.
        cell_clearance: Signed distance of the object's position to the boundary of its cell [m].
        funnel_margin: Smallest distance of an axis to its funnel [rad or m].
        funnel_axis: This axis.
        slice_margin: Smallest distance of an axis to its slice [rad or m].
        slice_axis: This axis.
        wrench_error: Measured less commanded wrench [N or N m].
        energy_margin: Delta E [m^2/s^2].
        acceleration_error: Realised less commanded acceleration [m/s^2 or rad/s^2].
        violation: Which invariant is broken, when and by how much; empty if none is.
    """

    workspace_clearance: float
    piece: int
    body_clearance: float
    pair: int
    cell_clearance: float
    funnel_margin: float
    funnel_axis: int
    slice_margin: float
    slice_axis: int
    wrench_error: float
    energy_margin: float
    acceleration_error: float
    violation: str = ""


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
        z, (edges, lower, upper) = sample.z, self._cells[sample.cell]
        found = Margins(
            *team_distances(*self._clearance.kernel_arguments, z),
            signed_distance(edges, z[0], z[1]),
            *_narrowest(z[2:], sample.funnel_lower, sample.funnel_upper),
            *_narrowest(z[2:], lower, upper),
            largest_difference(sample.measured_wrenches, sample.commanded_wrenches),
            sample.energy_margin,
            sample.acceleration_error,
        )
        broken = [*self._broken(sample, found), *(_inexact(found) if self._exact else ())]
        where = f"at t = {sample.time:.6g} s in cell {sample.cell}: "
        return found._replace(violation=where + "; ".join(broken)) if broken else found

    def _broken(self, sample: Sample, found: Margins) -> Iterator[str]:
        if not found.workspace_clearance > 0.0:
            place = self._clearance.wall_place(found.piece)
            yield f"clearance between {place} is {found.workspace_clearance:.3g} m"
        if not found.body_clearance > 0.0:
            place = self._clearance.pair_place(found.pair)
            yield f"clearance between {place} is {found.body_clearance:.3g} m"
        if not found.cell_clearance > 0.0:
            where = f"the boundary of cell {sample.cell}"
            yield f"distance of the object to {where} is {found.cell_clearance:.3g} m"
        for margin, axis, kind in (
            (found.funnel_margin, found.funnel_axis, "funnel"),
            (found.slice_margin, found.slice_axis, "slice"),
        ):
            if not margin > 0.0:
                yield f"distance of {self._axes[axis]} to its {kind} is {margin:.3g} rad or m"
        if not sample.grasp_error <= GRASP_TOLERANCE:
            yield f"distance of an end effector to its grasp is {sample.grasp_error:.3g} m"


def _inexact(found: Margins) -> Iterator[str]:
    if not found.energy_margin >= 0.0:
        yield f"Delta E is {found.energy_margin:.3g} m^2/s^2"
    if not found.acceleration_error <= ACCELERATION_TOLERANCE:
        yield f"realised less commanded acceleration is {found.acceleration_error:.3g} m/s^2"
    if not found.wrench_error <= WRENCH_TOLERANCE:
        yield f"measured less commanded grasp wrench is {found.wrench_error:.3g} N"


# Messages.


@dataclass(frozen=True)
class MessageStatistics:
    """The messages of one transport if a message is sent only when its content changes.

    Attributes:
        reports: Reports of every robot to the cell planner, shape (N,).
        announcements: New cells, announced by the cell planner to each robot.
    """

    reports: tuple[int, ...]
    announcements: int

    @property
    def messages(self) -> int:
        """Number of all messages of the team."""
        return sum(self.reports) + self.announcements


def communication(log: SimulationLog) -> MessageStatistics:
    """Count the messages that a run needed.

    A robot reports when it becomes ready to leave the current cell, and when it is no longer ready. After a
    switch to the next cell no report is needed, because every robot then counts as not ready. The cell
    planner announces each cell but the first to every robot.
    """
    ready = log.ready_margins >= 0.0
    entered = np.diff(log.cell_index, prepend=-1) != 0
    before = np.vstack([np.zeros_like(ready[:1]), ready[:-1]])
    before[entered] = False
    reports = (ready != before).sum(axis=0)
    announcements = (int(entered.sum()) - 1) * len(reports)
    return MessageStatistics(tuple(int(count) for count in reports), announcements)

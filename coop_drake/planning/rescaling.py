"""A change of the unit of length, so that teams much larger or smaller than usual are planned like others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypeVar

import numpy as np
import shapely
from shapely import Polygon

from coop_drake.answers.plan import Cell, MixedCell, Plan
from coop_drake.answers.problem import PlannerSettings, PlanningProblem, TeamLimits
from coop_drake.answers.proof import OverCell, OverSlice
from coop_drake.laws.gains import FixedGains, GainSet
from coop_drake.planning.cells.cells import FreeBox, Region
from coop_drake.planning.cells.exploration import ChannelSearched, Event, SliceAdded, Watch
from coop_drake.planning.cells.graph import GraphCell
from coop_drake.planning.channel import Channel, CoveredPath, NoChannel
from coop_drake.planning.questions import SMALLEST_MARGIN
from coop_drake.tree.arrays import FloatArray
from coop_drake.tree.component_tree import Component, ComponentTree, ConvexShape, PlanarPose

Box = TypeVar("Box", MixedCell, FreeBox, Cell)

USUAL_MARGINS = (SMALLEST_MARGIN, 0.4)
"""Margins that make sense for a team of the usual size, smallest and largest [m]."""


@dataclass(frozen=True)
class Rescaling:
    """Expresses a question in another unit, and its answers in metres.

    Attributes:
        problem: The question in metres.
        unit: The other unit [m].
    """

    problem: PlanningProblem
    unit: float

    def question(self) -> PlanningProblem:
        """The question with all lengths in the unit; limits of speeds are kept in metres afterwards."""
        problem, scale = self.problem, 1.0 / self.unit
        tree = problem.tree
        components = tuple(_component(component, scale) for component in tree.components)
        units = 1.0 / self._units
        goals = zip(problem.goal_joints, units[3:], strict=True)
        return replace(
            problem,
            workspace=_scaled(problem.workspace, scale),
            tree=ComponentTree(components, tree.unchecked_pairs),
            start=problem.start * units,
            goal_pose=problem.goal_pose * units[:3],
            goal_joints=tuple(None if goal is None else float(goal * unit) for goal, unit in goals),
            position_tolerance=scale * problem.position_tolerance,
            joint_tolerance=problem.joint_tolerance * units[3:],
            settings=_settings(problem.settings, scale),
            limits=TeamLimits(),
            passes=False,  # Limits have units; boxes are chosen without them.
        )

    def answer(self, found: CoveredPath | Channel | NoChannel) -> CoveredPath | Channel | NoChannel:
        """An answer with all lengths in metres."""
        if isinstance(found, Channel):
            return self._channel(found)
        if isinstance(found, CoveredPath):
            return self._covered(found)
        mixed = [self._scaled_box(cell, self._robot_units(cell.robots), "polygon") for cell in found.mixed]
        proof = found.proof
        if proof is not None:
            slices = tuple(map(self._slice, proof.slices))
            proof = replace(proof, point=self.unit * proof.point, slices=slices)
        return replace(found, mixed=tuple(mixed), proof=proof)

    def usual(self, found: Channel | CoveredPath) -> Channel | CoveredPath:
        """A search's result in metres, expressed in the unit."""
        there = Rescaling(self.question(), 1.0 / self.unit)
        return there._channel(found) if isinstance(found, Channel) else there._covered(found)

    def gains(self, gain_set: GainSet) -> GainSet:
        """Gains for lengths in the unit; those of joints stay, as joints may turn or slide."""
        smoothing = gain_set.smoothing / self.unit
        if isinstance(gain_set, FixedGains):
            return replace(gain_set, smoothing=smoothing)
        return replace(gain_set, smoothing=smoothing, wall_stiffness=gain_set.wall_stiffness / self.unit)

    def room(self, room: FloatArray) -> FloatArray:
        """Room of the position and of all axes in metres, shape (2 + n,), expressed in the unit."""
        return room / self._units[1:]

    def plan(self, made: Plan) -> Plan:
        """A plan in the unit, expressed in metres, but for its gains and the digest of its problem."""
        unit, axes = self.unit, self._units[2:]
        cells = tuple(self._scaled_box(cell, axes, "tidied") for cell in made.cells)
        transitions = tuple(
            replace(
                step,
                target=unit * step.target,
                goal_lower=step.goal_lower * axes,
                goal_upper=step.goal_upper * axes,
                inradius=unit * step.inradius,
                neck=unit * step.neck,
                length=unit * step.length,
                path=unit * step.path,
            )
            for step in made.transitions
        )
        return replace(
            made,
            start=self.problem.start.copy(),
            goal_pose=np.array([*self.problem.goal_pose[:2], made.goal_pose[2]]),
            goal_joints=tuple(
                turned if joint.circular else own
                for joint, turned, own in zip(
                    self.problem.tree.joints, made.goal_joints, self.problem.goal_joints, strict=True
                )
            ),
            cells=cells,
            transitions=transitions,
        )

    def _covered(self, found: CoveredPath) -> CoveredPath:
        path, margin = found.path * self._units, self.unit * found.margin

        def another(number: int, share: float) -> CoveredPath | None:
            other = found.another(number, share)
            return None if other is None else self._covered(other)

        return CoveredPath(path, margin, lambda: self._channel(found.channel()), another)

    def _channel(self, found: Channel) -> Channel:
        scaled = (self._scaled_box(box, self._units[2:], "polygon") for box in found.boxes)
        boxes = tuple(replace(box, positions=self.unit * box.positions) for box in scaled)
        path = None if found.path is None else found.path * self._units
        ends = None if found.ends is None else found.ends * self.unit
        end = None if found.end is None else found.end * self._units
        return replace(found, boxes=boxes, path=path, ends=ends, end=end, margin=self.unit * found.margin)

    def watched(self, watch: Watch | None) -> Watch | None:
        """A function that expresses every event in metres before it is passed on."""
        if watch is None:
            return None
        robots: tuple[int, ...] = ()

        def see(event: Event) -> None:
            nonlocal robots
            robots = getattr(event, "robots", robots)
            if isinstance(event, SliceAdded):
                units = self._robot_units(robots).tolist()
                ends = zip(event.intervals, units, strict=True)
                intervals = tuple((low * unit, high * unit) for (low, high), unit in ends)
                event = replace(event, intervals=intervals, cells=self._seen(event.cells))
            elif isinstance(event, ChannelSearched):
                event = replace(event, cells=self._seen(event.cells))
            watch(event)

        return see

    def _scaled_box(self, box: Box, units: FloatArray, *polygons: str) -> Box:
        """A cell or box with its intervals times the units of its axes, and with scaled polygons."""
        scaled = {name: _scaled(getattr(box, name), self.unit) for name in polygons}
        return replace(box, lower=box.lower * units, upper=box.upper * units, **scaled)  # type: ignore[arg-type]

    def _slice(self, part: OverSlice) -> OverSlice:
        witnesses = tuple(replace(one, polygon=self.unit * one.polygon) for one in part.witnesses)
        cells = tuple(OverCell(cell.reached, _scaled(cell.polygon, self.unit)) for cell in part.cells)
        squeezes = tuple(
            replace(
                one,
                polygon=self.unit * one.polygon,
                cuts=tuple(replace(cut, limit=self.unit * cut.limit) for cut in one.cuts),
            )
            for one in part.squeezes
        )
        return OverSlice(self._ends(part.lower), self._ends(part.upper), witnesses, cells, squeezes)

    def _ends(self, ends: FloatArray) -> FloatArray:
        """Ends of a slice in metres; those that are limits are the limits, without rounding."""
        found = ends * self._units[2:]
        tree, usual = self.problem.tree, self.question().tree
        for exact, limits in ((tree.range_lower, usual.range_lower), (tree.range_upper, usual.range_upper)):
            found[1:] = np.where(ends[1:] == limits, exact, found[1:])
        return found

    def _seen(self, cells: Sequence[GraphCell]) -> tuple[GraphCell, ...]:
        scale = (self.unit, self.unit)
        return tuple(replace(cell, region=Region.of(cell.region.section.scale(scale))) for cell in cells)

    @cached_property
    def _units(self) -> FloatArray:
        """Units of (x, y, theta, q...)."""
        kinds = [joint.kind for joint in self.problem.tree.joints]
        return np.array([self.unit, self.unit, 1.0, *(self.unit if k == "prismatic" else 1.0 for k in kinds)])

    def _robot_units(self, robots: Sequence[int]) -> FloatArray:
        """Units of theta and of the joints of some robots."""
        return self._units[[2, *[3 + j.index for j in self.problem.tree.joints if j.robot in robots]]]


def _settings(settings: PlannerSettings, scale: float) -> PlannerSettings:
    """Settings in another unit; a margin that makes no sense for the usual size becomes the default."""
    margin, (least, most) = scale * settings.margin, USUAL_MARGINS
    if settings.margin > 0.0 and not least <= margin <= most:
        margin = PlannerSettings().margin
    return replace(
        settings,
        margin=margin,
        length_resolution=scale * settings.length_resolution,
        min_clearance=settings.min_clearance,  # It is meant for the usual size.
    )


def _scaled(polygon: Polygon, scale: float) -> Polygon:
    scaled: Polygon = shapely.transform(polygon, lambda points: scale * points)
    return scaled


def _component(component: Component, scale: float) -> Component:
    joint = component.joint
    if joint is not None:
        X, unit = joint.X_PJ, scale if joint.kind == "prismatic" else 1.0
        moved = PlanarPose(scale * X.x, scale * X.y, X.angle)
        joint = replace(joint, X_PJ=moved, lower=unit * joint.lower, upper=unit * joint.upper)
    bodies = tuple(
        replace(body, shapes=tuple(ConvexShape(scale * s.vertices, scale * s.radius) for s in body.shapes))
        for body in component.bodies
    )
    return replace(component, joint=joint, bodies=bodies)

"""The grasps of the robots, and what is read of them: wrenches, and errors of position."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from pydrake.multibody.parsing import GetScopedFrameByName
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import WeldJoint
from pydrake.systems.framework import Context

from coop_drake.plant.parsing import joints_of
from coop_drake.scenario import RobotAssembly
from coop_drake.tree.pose import FloatArray


class Grasps(Protocol):
    """The grasps of all robots, in the scenario's order."""

    def wrenches(self, context: Context) -> FloatArray:
        """Wrench on the object at every Ek in W, shape (N, 3) [N, N m].

        Args:
            context: The plant's, inside the diagram's, all inputs connected.
        """
        ...

    def errors(self, context: Context) -> FloatArray:
        """Distance between every robot's Ek and the same point of the object, shape (N,) [m]."""
        ...


class WeldedGrasps:
    """Grasps that are joints of one tree: they are exact, and their wrenches are the joints' reactions.

    Args:
        plant: Finalized.
        robots: The frames of every grasp; the object is its parent.
    """

    def __init__(self, plant: MultibodyPlant, robots: Sequence[RobotAssembly]) -> None:
        self._reactions = plant.get_reaction_forces_output_port()
        welds = [_weld(plant, robot) for robot in robots]
        self._places = [place for place, _ in welds]
        self._frames = [weld.frame_on_child() for _, weld in welds]

    def wrenches(self, context: Context) -> FloatArray:
        """As in :class:`Grasps`; the reaction on a weld's child acts on the robot, in the joint's frame."""
        reactions = self._reactions.Eval(context)
        rows = [
            reactions[place].Rotate(frame.CalcRotationMatrixInWorld(context)).get_coeffs()
            for place, frame in zip(self._places, self._frames, strict=True)
        ]
        return np.array([(-row[3], -row[4], -row[2]) for row in rows])

    def errors(self, context: Context) -> FloatArray:
        """As in :class:`Grasps`; zero, because the end effectors are bodies of the object's tree."""
        return np.zeros(len(self._places))


def _weld(plant: MultibodyPlant, robot: RobotAssembly) -> tuple[int, WeldJoint]:
    """A robot's grasp, and its place in the plant's ``reaction_forces`` output."""
    ends = {
        int(GetScopedFrameByName(plant, frame).body().index())
        for frame in (robot.gripper_frame, robot.object_frame)
    }
    return next(
        (place, joint)
        for place, joint in enumerate(joints_of(plant))
        if joint.type_name() == "weld"
        and {int(joint.parent_body().index()), int(joint.child_body().index())} == ends
    )

"""The team as one kinematic tree rooted at the object, and planar poses: data, no computation of shapes."""

from coop_drake.tree.component_tree import (
    Body,
    Component,
    ComponentTree,
    ConvexShape,
    TreeJoint,
    axis_levers,
    configuration_scale,
    usual_unit,
)
from coop_drake.tree.pose import FloatArray, PlanarPose

__all__ = [
    "Body",
    "Component",
    "ComponentTree",
    "ConvexShape",
    "FloatArray",
    "PlanarPose",
    "TreeJoint",
    "axis_levers",
    "configuration_scale",
    "usual_unit",
]

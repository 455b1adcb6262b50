"""The team as one kinematic tree rooted at the object, and planar poses: data, no computation of shapes."""

from coop_drake.tree.arrays import FloatArray
from coop_drake.tree.component_tree import (
    Body,
    Component,
    ComponentTree,
    ConvexShape,
    PlanarPose,
    TreeJoint,
    axis_levers,
    configuration_scale,
    usual_unit,
)

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

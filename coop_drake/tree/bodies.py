"""Mass properties of the bodies of a team, as budgets state them."""

from coop_drake.typed_data import Number

BODY = "component", "mass", "x", "y", "inertia", "robot"
"""What is stated of a body: index of its component in the team's tree, mass [kg], centre of mass in the
component's frame [m], inertia about the vertical axis through it [kg m^2], and the index of the robot that
moves it. The object stands there once for each robot, with the robot's share of its mass and inertia."""

Bodies = tuple[tuple[Number, ...], ...]
"""The bodies of a team, each with the numbers of ``BODY``; laws of the whole team need no robots."""

"""Mass properties of the bodies of a team, as budgets state them."""

from coop_drake.typed_data import Number

BODY = "component", "mass", "x", "y", "inertia"
"""What is stated of a body: index of its component in the team's tree, mass [kg], centre of mass in the
component's frame [m], and inertia about the vertical axis through it [kg m^2]."""

Bodies = tuple[tuple[Number, ...], ...]
"""The bodies of a team, each with the numbers of ``BODY``."""

"""How much the robots of a team accelerate its axes by disagreeing about the object's acceleration."""

from __future__ import annotations

import numpy as np

from coop_drake.laws.disagreement import disagreement_coupling
from coop_drake.plant.component_tree import read_component_tree
from coop_drake.plant.run_masses import joint_inertias, moved_bodies
from coop_drake.plant.team import TeamPlant
from coop_drake.scenario import Scenario

CONFIGURATIONS = 3000
"""Number of configurations that are tried [-]: ten times as many give some hundredths more for `elbow`."""


def largest_disagreement(scenario: Scenario, team: TeamPlant) -> float:
    """Return the largest ``disagreement_coupling`` of an axis [rad/m or -].

    It is the largest of ``CONFIGURATIONS`` between the joints' limits, drawn with a fixed seed.

    Args:
        scenario: The scenario, with the robots' shares of the load.
        team: Its team.
    """
    tree = read_component_tree(team)
    joints = np.random.default_rng(0).uniform(
        tree.range_lower, tree.range_upper, (CONFIGURATIONS, len(team.joints))
    )
    found = disagreement_coupling(tree, moved_bodies(scenario, team), joint_inertias(team).tolist(), joints)
    return float(found.max())

"""How much the joints of a team are accelerated by the object's turning."""

from __future__ import annotations

import numpy as np

from coop_drake.laws.rate_terms import rate_terms
from coop_drake.plant.component_tree import read_component_tree
from coop_drake.plant.run_masses import bodies_of_team, joint_inertias
from coop_drake.plant.team import TeamPlant

CONFIGURATIONS = 3000
"""Number of configurations that are tried [-]: ten times as many give 4 % more for `elbow`."""


def turning_coupling(team: TeamPlant) -> float:
    """Return the largest acceleration of a joint over the square of the rate at which the object turns [-].

    Nothing is commanded, and nothing but the object turns. The largest of ``CONFIGURATIONS`` between the
    joints' limits, drawn with a fixed seed, is a lower bound; a gain set of scheduled gains should state no
    less as its ``turning_coupling``.

    Args:
        team: A team of robots as one tree.
    """
    tree, shape = read_component_tree(team), (CONFIGURATIONS, len(team.joints))
    joints = np.random.default_rng(0).uniform(tree.range_lower, tree.range_upper, shape)
    found = rate_terms(tree, bodies_of_team(team, tree), joint_inertias(team).tolist(), joints)
    return float(found[:, 1:, 0, 0].max(initial=0.0))

"""Teams of any size round one object: unlike arms, grasps at uneven angles, unequal shares of the load."""

from __future__ import annotations

from math import cos, pi, sin
from pathlib import Path

import numpy as np

from coop_drake.plant.model_writing import polygon_body_files, write_polygon_body
from coop_drake.scenario import Scenario, load_scenario
from tests.support.robot_models import Arm

REVOLUTE = ("revolute", "0 0 1", "")
PRISMATIC = ("prismatic", "1 0 0", "<limit><lower>-0.7</lower><upper>0.7</upper></limit>")
RADIUS = 1.2
SCENARIO = """
workspace: {{outer: [[-4, -4], [14, -4], [14, 11], [-4, 11]]}}
directives:
- add_model: {{name: object, file: object.sdf}}
{robots}
load_shares: {{{shares}}}
start:
  object: {{x: 3.0, y: 3.0, theta: 0.2}}
  joints: {{{joints}}}
goal:
  object: {{x: 5.2, y: 3.6, theta: 0.7}}
"""


def ring_team(
    folder: Path,
    arms: list[tuple[tuple[str, str, str], ...]],
    seed: int = 0,
    *,
    arc: float = 2.0 * pi,
    mass: float = 9.0,
) -> Scenario:
    """Write models and scenario of one robot for each list of joints, and load it.

    Args:
        folder: Where the files are written.
        arms: The joints of every robot's arm.
        seed: Of the angles, lengths and shares.
        arc: The part of the circle round the object that is grasped [rad].
        mass: Of the object [kg].
    """
    rng, n = np.random.default_rng(seed), len(arms)
    angles = arc * (np.arange(n) + rng.uniform(-0.15, 0.15, n)) / n
    corners = [(RADIUS * cos(a), RADIUS * sin(a)) for a in 2.0 * pi * (np.arange(12) + 0.5) / 12]
    offsets = [(r * cos(a), r * sin(a), a) for a, r in zip(angles, rng.uniform(1.2, 1.3, n), strict=True)]
    write_polygon_body(polygon_body_files(corners, mass, "object", grasps=offsets), folder)
    shares = rng.dirichlet(np.full(n, 4.0))
    robots = []
    for k, joints in enumerate(arms):
        (folder / f"arm_{k}.sdf").write_text(Arm(joints=joints).text())
        robots.append(f"- add_model: {{name: robot_{k}, file: arm_{k}.sdf}}")
        robots.append(f"- add_weld: {{parent: object::grasp_{k}, child: robot_{k}::gripper}}")
    path = folder / "ring.scenario.yaml"
    path.write_text(
        SCENARIO.format(
            robots="\n".join(robots),
            shares=", ".join(f"robot_{k}: {share!r}" for k, share in enumerate(shares.tolist())),
            joints=", ".join(f"robot_{k}: {[0.0] * len(joints)}" for k, joints in enumerate(arms)),
        )
    )
    return load_scenario(path)

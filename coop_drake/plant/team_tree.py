"""Reads the whole team as one planar tree with masses, the form that ``laws/team_dynamics.py`` takes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydrake.multibody.tree import BodyIndex

from coop_drake.laws.chain_motion import (
    COLUMNS,
    COM_X,
    COM_Y,
    DAMPING,
    INERTIA,
    MASS,
    PARENT,
    POSITION,
    RATE,
    ROTOR,
    SLIDE_X,
    SLIDE_Y,
    TURN,
    X,
    Y,
)
from coop_drake.plant.planar_chain import bodies_inertia, rotor_inertia
from coop_drake.plant.run_masses import component_bodies
from coop_drake.plant.team import TeamPlant
from coop_drake.tree.component_tree import ComponentTree
from coop_drake.tree.pose import FloatArray, IntArray


@dataclass(frozen=True)
class TeamTree:
    """The team's plant in the plane, its positions and rates in the order of the plant's own state.

    Attributes:
        tree: The object in row 0, then a row for each component, shape (1 + n, ``COLUMNS``).
        bases: Row of every robot's base, then that of the object, shape (N + 1,).
        places: Where wrenches act on these, in the object's frame with all joints at zero: the origins of the
            bases and of the object, shape (N + 1, 2) [m].
        strongest: Largest effort of every joint that its model allows, in the order of q, shape (n,) [N m or
            N].
    """

    tree: FloatArray
    bases: IntArray
    places: FloatArray
    strongest: FloatArray


def read_team_tree(team: TeamPlant, components: ComponentTree) -> TeamTree:
    """Read a team's plant.

    Args:
        team: A team of robots as one tree.
        components: Its component tree.
    """
    plant, context = team.plant, team.plant.CreateDefaultContext()
    plant.SetPositionsAndVelocities(context, np.zeros(plant.num_multibody_states()))
    rates, (groups, origins) = plant.num_positions(), component_bodies(team, components)
    rows = np.zeros((len(groups), COLUMNS))
    pose = team.object_joint
    rows[0, [POSITION, RATE]] = pose.position_start(), rates + pose.velocity_start()
    for row, group, origin, component in zip(rows, groups, origins, components.components, strict=True):
        bodies = [plant.get_body(BodyIndex(i)) for i in sorted(group)]
        row[[MASS, COM_X, COM_Y, INERTIA]] = bodies_inertia(plant, context, bodies)
        row[[X, Y]] = origin
        if (moved := component.joint) is not None:
            joint, turns = team.joints[moved.index], moved.kind == "revolute"
            row[[PARENT, TURN]] = component.parent, moved.sign if turns else 0.0
            row[[SLIDE_X, SLIDE_Y]] = moved.axis
            row[[POSITION, RATE]] = joint.position_start(), rates + joint.velocity_start()
            row[DAMPING] = joint.GetDampingVector(context)[0]
            row[ROTOR] = rotor_inertia(plant, context, joint)
    bases = [robot.base_body for robot in team.robots]
    places = [body.EvalPoseInWorld(context).translation()[:2] for body in bases]
    numbers = [int(body.index()) for body in bases]
    found = [next(i for i, group in enumerate(groups) if number in group) for number in numbers]
    drives = [plant.get_joint_actuator(index) for index in plant.GetJointActuatorIndices()]
    limit_of = {int(drive.joint().index()): drive.effort_limit() for drive in drives}
    strongest = np.array([limit_of.get(int(joint.index()), np.inf) for joint in team.joints], dtype=float)
    return TeamTree(rows, np.array([*found, 0], dtype=np.int64), np.array([*places, np.zeros(2)]), strongest)

"""The masses of a team, and what robots disagree about where they believe other ones."""

from __future__ import annotations

import numpy as np
from pydrake.multibody.tree import BodyIndex, RigidBody
from pydrake.systems.framework import DiagramBuilder

from coop_drake.laws.disagreement import disagreement_coupling
from coop_drake.laws.rate_terms import rate_terms
from coop_drake.plant.component_tree import read_component_tree
from coop_drake.plant.configuration import displacement
from coop_drake.plant.parsing import bodies_of
from coop_drake.plant.planar_chain import bodies_inertia, rotor_inertia
from coop_drake.plant.scenario_digest import scenario_digest
from coop_drake.plant.team import TeamPlant, build_team_plant
from coop_drake.scenario import Floor, Messages, Scenario
from coop_drake.tree.component_tree import Bodies, ComponentTree
from coop_drake.tree.pose import FloatArray
from coop_drake.verification.runs import BodyMass, RunSetup

ROUNDED = 12
"""Digits after the point of a centre of mass in a budget [m]: models at an angle have some of 1e-17."""


def run_setup(scenario: Scenario) -> RunSetup:
    """Read a scenario's settings and masses, against which a log is checked.

    Raises:
        ScenarioError: The models do not make a team.
    """
    team = build_team_plant(scenario, DiagramBuilder())
    context, deployment = team.plant.CreateDefaultContext(), scenario.deployment
    springs = team.plant.num_force_elements() > 1  # every plant has gravity
    deaf = any(robot.deaf is not None for robot in deployment.robots.values())
    one_clock = all(robot.clock_error == robot.switch_delay == 0.0 for robot in deployment.robots.values())
    return RunSetup(
        scenario_digest=scenario_digest(scenario),
        robot_names=tuple(robot.name for robot in team.robots),
        exact=scenario.ideal,
        rigid=scenario.plant.ideal,
        mechanics=scenario.plant.ideal
        and not springs
        and deployment.floor == Floor()
        and not deployment.pushes
        and all(robot.counted == robot for robot in deployment.robots.values()),
        can_be_held=scenario.control.hold is not None,
        one_hold=not deaf and deployment.messages == Messages(),
        one_clock=one_clock,
        alike=one_clock and all(robot.sample_offset == 0.0 for robot in deployment.robots.values()),
        grasps=np.array([[robot.X_LE.x, robot.X_LE.y] for robot in team.robots]),
        bodies=tuple(team_masses(team, read_component_tree(team))),
        joint_damping=np.array([joint.GetDampingVector(context)[0] for joint in team.joints]),
        joint_friction=(deployment.joint_friction.coulomb, deployment.joint_friction.viscous),
        joint_inertia=joint_inertias(team),
        displacement=displacement(deployment, 3 + len(team.joints)),
    )


def moved_bodies(scenario: Scenario, team: TeamPlant) -> Bodies:
    """Return the bodies that robots move, robot by robot: its own, and its share of the object's masses."""
    masses, moved = team_masses(team, read_component_tree(team)), []
    for k, robot in enumerate(team.robots):
        load = scenario.load_share(robot.name, len(team.robots))
        shares = [(body, {k: 1.0, None: load}.get(body.robot, 0.0)) for body in masses]
        moved += [
            (*_properties(body, share), float(k)) for body, share in shares if share > 0.0
        ]  # a share of the load may be zero
    return tuple(moved)


def base_frames(team: TeamPlant, tree: ComponentTree) -> tuple[tuple[float, ...], ...]:
    """Return the component of every robot's base, and the origin of Bk in it [m]."""
    plant, (groups, origins) = team.plant, component_bodies(team, tree)
    context, frames = plant.CreateDefaultContext(), []
    plant.SetPositionsAndVelocities(context, np.zeros(plant.num_multibody_states()))
    for robot in team.robots:
        component = next(i for i, group in enumerate(groups) if int(robot.base_body.index()) in group)
        place = plant.EvalBodyPoseInWorld(context, robot.base_body).translation()[:2] - origins[component]
        frames.append((float(component), *place.round(ROUNDED).tolist()))
    return tuple(frames)


def joint_inertias(team: TeamPlant) -> FloatArray:
    """Return what the rotors add to every joint's inertia, shape (n,) [kg m^2 or kg]."""
    context = team.plant.CreateDefaultContext()
    return np.array([rotor_inertia(team.plant, context, joint) for joint in team.joints])


def bodies_of_team(team: TeamPlant, tree: ComponentTree) -> Bodies:
    """Return the mass properties of all bodies of a team, for its rate terms, without their robots."""
    return tuple(_properties(body, 1.0) for body in team_masses(team, tree))


def _properties(body: BodyMass, share: float) -> tuple[float, ...]:
    """Return the first five numbers of ``BODY`` for a share of a body's mass and inertia."""
    place = body.p_CBcm.round(ROUNDED).tolist()
    return float(body.component), share * body.mass, *place, share * body.inertia


def component_bodies(team: TeamPlant, tree: ComponentTree) -> tuple[list[set[int]], list[FloatArray]]:
    """Return the indices of the bodies of every component, and its origin where all joints are at zero [m].

    Args:
        team: The team.
        tree: Its component tree.
    """
    origins, groups = [np.zeros(2)], [_welded(team, team.object_body)]
    for component in tree.components[1:]:
        assert component.joint is not None
        assert component.parent is not None
        joint = team.joints[component.joint.index]
        sides = [joint.parent_body(), joint.child_body()]
        outer = sides[1] if int(sides[0].index()) in groups[component.parent] else sides[0]
        groups.append(_welded(team, outer))
        origins.append(origins[component.parent] + (component.joint.X_PJ.x, component.joint.X_PJ.y))
    return groups, origins


def team_masses(team: TeamPlant, tree: ComponentTree) -> list[BodyMass]:
    """Return masses of every robot's and the object's bodies in every component of the team's tree."""
    plant, (groups, origins) = team.plant, component_bodies(team, tree)
    context = plant.CreateDefaultContext()
    plant.SetPositionsAndVelocities(context, np.zeros(plant.num_multibody_states()))
    robots = [{int(body.index()) for body in bodies_of(plant, r.models)} for r in team.assembly.robots]
    masses = []
    for index, (group, origin) in enumerate(zip(groups, origins, strict=True)):
        owned = [
            *[(k, group & bodies) for k, bodies in enumerate(robots)],
            (None, group - set().union(*robots)),
        ]
        for robot, members in owned:
            bodies = [plant.get_body(BodyIndex(i)) for i in sorted(members)]
            mass, x, y, inertia = bodies_inertia(plant, context, bodies)
            if mass > 0.0:
                masses.append(BodyMass(index, robot, mass, np.array([x, y]) - origin, inertia))
    return masses


def _welded(team: TeamPlant, body: RigidBody) -> set[int]:
    return {int(part.index()) for part in team.plant.GetBodiesWeldedTo(body)}


# How much the robots of a team accelerate its axes by disagreeing about the object's acceleration.


CONFIGURATIONS = 3000
"""Number of configurations that are tried [-]: ten times as many give 4 % more at most for `elbow`."""


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


# How much the joints of a team are accelerated by the object's turning.


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

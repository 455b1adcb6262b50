"""What is read from a team's models: arrays for the laws, masses, digests, what budgets take."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import BodyIndex, ForceElementIndex, Frame, Joint, RigidBody
from pydrake.systems.framework import Context, DiagramBuilder

from coop_drake.answers.budget import LIMITS, Budget
from coop_drake.answers.document import content_digest, tree_document
from coop_drake.answers.problem import PlanningProblem
from coop_drake.errors import ScenarioError
from coop_drake.laws.couplings import disagreement_coupling, rate_terms
from coop_drake.laws.robot_dynamics import (
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
from coop_drake.plant.component_tree import (
    base_components,
    base_points,
    component_bodies,
    read_component_tree,
)
from coop_drake.plant.parsing import bodies_of, joints_of, read_once
from coop_drake.plant.team import RobotModel, RobotPlant, TeamPlant, build_team_plant, displacement
from coop_drake.scenario import Floor, Messages, Scenario, budget_file
from coop_drake.scenario.budget_file import TeamMasses, read_budget
from coop_drake.tree.arrays import FloatArray, IntArray
from coop_drake.tree.component_tree import Bodies, ComponentTree
from coop_drake.typed_data import to_plain

if TYPE_CHECKING:  # Simulating takes a digest from here, and should not wait for the verifier.
    from coop_drake.verification.budget_origin import Facts, OwnBudgets, ScenarioBudgets
    from coop_drake.verification.runs import BodyMass, RunSetup


# Models in the plane as arrays, the form of the compiled laws: chains of robots, the tree of a team.


# Reads planar chains, the form that the compiled laws take, from Drake's models.


@dataclass(frozen=True)
class BaseChain:
    """The chain from the object through a robot's grasp and joints to its base.

    Attributes:
        chain: Rows as in ``coop_drake.laws.robot_dynamics``, the object first, the base's frame last.
        yaw: Angle of the base in the object where all joints are at zero [rad].
        joints: Where the robot's joints and their rates stand in the team's state, shape (2, n).
    """

    chain: FloatArray
    yaw: float
    joints: IntArray

    @property
    def mounting(self) -> FloatArray:
        """The yaw, then what a unit of every joint turns the base by in the object [-], shape (1 + n,)."""
        turns = dict(zip(self.chain[1:-1, POSITION], self.chain[1:-1, TURN], strict=True))
        return np.array([self.yaw, *(turns.get(place, 0.0) for place in self.joints[0])])


def robot_chain(robot: RobotPlant) -> FloatArray:
    """The chain of a robot's own model, from its base to its end effector; masses are those of its context.

    Returns:
        Shape (n + 2, ``COLUMNS``), joints in the order of q_k, their places those in (z_k, z_k').
    """
    plant, n = robot.plant, len(robot.joints)
    context = _at_zero(plant, robot.context)
    chain = np.zeros((n + 2, COLUMNS))
    link_of: dict[int, int] = {}
    for row, body in enumerate([robot.base_body, *(joint.child_body() for joint in robot.joints)]):
        welded = plant.GetBodiesWeldedTo(body)
        link_of.update({int(part.index()): row for part in welded})
        chain[row, [MASS, COM_X, COM_Y, INERTIA]] = bodies_inertia(plant, context, welded)
    chain[0, RATE] = 3 + n
    for row, joint in enumerate(robot.joints, 1):
        chain[row, [X, Y, TURN, SLIDE_X, SLIDE_Y]] = _joint_in_plane(context, joint)
        chain[row, PARENT] = link_of[int(joint.parent_body().index())]
        chain[row, [POSITION, RATE]] = 2 + row, 5 + n + row
        chain[row, DAMPING] = joint.GetDampingVector(context)[0]
        chain[row, ROTOR] = rotor_inertia(plant, context, joint)
    chain[-1, [X, Y]] = _origin(context, robot.gripper_frame)
    chain[-1, PARENT] = link_of[int(robot.gripper_frame.body().index())]
    return chain


def base_chain(team: TeamPlant, robot: RobotModel) -> BaseChain:
    """The chain from the object to a robot's base in the team's plant, whose tree begins at the object."""
    plant = team.plant
    context = _at_zero(plant, plant.CreateDefaultContext())
    rates = plant.num_positions()
    path = _to_base(plant, robot)
    chain = np.zeros((len(path) + 2, COLUMNS))
    pose = team.object_joint
    chain[0, [POSITION, RATE]] = pose.position_start(), rates + pose.velocity_start()
    for row, joint in enumerate(path, 1):
        x, y, *motion = _joint_in_plane(context, joint)
        chain[row, [X, Y, TURN, SLIDE_X, SLIDE_Y]] = x, y, *(-part for part in motion)  # from gripper to base
        chain[row, PARENT] = row - 1
        chain[row, [POSITION, RATE]] = joint.position_start(), rates + joint.velocity_start()
    chain[-1, [X, Y]] = _origin(context, robot.base_body.body_frame())
    chain[-1, PARENT] = len(path)
    R = robot.base_body.EvalPoseInWorld(context).rotation().matrix()
    places = [(joint.position_start(), rates + joint.velocity_start()) for joint in robot.joints]
    joints = np.array(places, dtype=np.int64).reshape(-1, 2).T
    return BaseChain(chain, float(np.arctan2(R[1, 0], R[0, 0])), np.ascontiguousarray(joints))


def _to_base(plant: MultibodyPlant, robot: RobotModel) -> list[Joint]:
    """The joints between a robot's end effector and its base, the outermost first."""
    leading = {
        int(body.index()): joint
        for joint in robot.joints
        for body in plant.GetBodiesWeldedTo(joint.child_body())
    }
    path, body = [], robot.gripper_frame.body()
    while (joint := leading.get(int(body.index()))) is not None:
        path.append(joint)
        body = joint.parent_body()
    return path


def _at_zero(plant: MultibodyPlant, context: Context) -> Context:
    """A copy of a context with all positions and velocities zero."""
    copy = context.Clone()
    plant.SetPositionsAndVelocities(copy, np.zeros(plant.num_multibody_states()))
    return copy


def _origin(context: Context, frame: Frame) -> FloatArray:
    return frame.CalcPoseInWorld(context).translation()[:2]


def _joint_in_plane(context: Context, joint: Joint) -> tuple[float, float, float, float, float]:
    """Position of a joint, the sense of its rotation (0 if prismatic) and its direction (0 if revolute)."""
    X_WF = joint.frame_on_parent().CalcPoseInWorld(context)
    x, y, _ = X_WF.translation()
    revolute = joint.type_name() == "revolute"
    axis = X_WF.rotation().matrix() @ (joint.revolute_axis() if revolute else joint.translation_axis())
    if revolute:
        return float(x), float(y), float(np.sign(axis[2])), 0.0, 0.0
    return float(x), float(y), 0.0, float(axis[0]), float(axis[1])


def bodies_inertia(
    plant: MultibodyPlant, context: Context, bodies: list[RigidBody]
) -> tuple[float, float, float, float]:
    """Mass, centre of mass in W and inertia about it of bodies that do not move against each other."""
    whole = plant.CalcSpatialInertia(context, plant.world_frame(), [body.index() for body in bodies])
    if whole.get_mass() == 0.0:
        return 0.0, 0.0, 0.0, 0.0
    com = whole.get_com()
    about_com = whole.Shift(com).CalcRotationalInertia().get_moments()[2]
    return float(whole.get_mass()), float(com[0]), float(com[1]), float(about_com)


def rotor_inertia(plant: MultibodyPlant, context: Context, joint: Joint) -> float:
    """Reflected inertia of the rotors that drive a joint."""
    actuators = [plant.get_joint_actuator(index) for index in plant.GetJointActuatorIndices()]
    return sum(
        float(actuator.calc_reflected_inertia(context))
        for actuator in actuators
        if actuator.joint().index() == joint.index()
    )


# Reads the whole team as one planar tree with masses, the form that ``laws/team_dynamics.py`` takes.


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
    places = [robot.base_body.EvalPoseInWorld(context).translation()[:2] for robot in team.robots]
    drives = [plant.get_joint_actuator(index) for index in plant.GetJointActuatorIndices()]
    limit_of = {int(drive.joint().index()): drive.effort_limit() for drive in drives}
    strongest = np.array([limit_of.get(int(joint.index()), np.inf) for joint in team.joints], dtype=float)
    return TeamTree(
        rows,
        np.array([*base_components(team, groups), 0], dtype=np.int64),
        np.array([*places, np.zeros(2)]),
        strongest,
    )


# Digests of a scenario and its models: which scenario a log belongs to, and what processes must agree on.

_NOT_IN_A_RUN = ("planner", "gains", "maps", "visualization")
"""Sections that change a run only through its plan, or not at all."""

_DECIMALS = 12
"""Decimals that a digest sees of a number in SI units: last bits differ between machines."""

_OF_FORCES = ("stiffness", "damping", "free_length", "nominal_position", "p_AP", "p_BQ")
"""Constants of springs that are no parameters of the plant's context."""


def scenario_digest(scenario: Scenario, models: str | None = None) -> str:
    """Return the SHA-256 over all that a run takes from its scenario besides the plan, in hexadecimal.

    Args:
        scenario: The scenario.
        models: ``models_digest`` of a scenario with the same models; None to read them.
    """
    content = {key: value for key, value in to_plain(scenario, Scenario).items() if key not in _NOT_IN_A_RUN}
    return content_digest({"scenario": content, "models": models or models_digest(scenario)})


@read_once
def models_digest(scenario: Scenario) -> str:
    """Return the SHA-256 over all numbers and names that Drake has read from a scenario's models.

    It sees what Drake makes of the files, not the files: whatever a model includes, by whatever name, counts
    as soon as it changes a mass, a joint, a limit, a spring or a shape that can collide. It is the same
    wherever the files are. Shapes that are only shown are not in it.

    Raises:
        ScenarioError: The models make no team.
    """
    team = build_team_plant(scenario, DiagramBuilder())
    plant = team.plant
    parameters = (
        plant.CreateDefaultContext().get_parameters()
    )  # Masses, inertias, frames, axes, damping, rotors
    groups = range(parameters.num_numeric_parameter_groups())
    motors = [plant.get_joint_actuator(index) for index in plant.GetJointActuatorIndices()]
    return content_digest(
        {
            "parameters": [_numbers(parameters.get_numeric_parameter(i).CopyToVector()) for i in groups],
            "joints": [_joint(joint) for joint in joints_of(plant)],
            "efforts": [[motor.joint().name(), *_numbers(motor.effort_limit())] for motor in motors],
            "forces": [_force(plant, index) for index in range(plant.num_force_elements())],
            "tree": tree_document(read_component_tree(team)),
        }
    )


def _joint(joint: Joint) -> list[Any]:
    bodies = [
        f"{int(body.model_instance())} {body.name()}" for body in (joint.parent_body(), joint.child_body())
    ]
    limits = [
        getattr(joint, f"{kind}_{end}_limits")()
        for kind in ("position", "velocity", "acceleration")
        for end in ("lower", "upper")
    ]
    return [joint.type_name(), joint.name(), *bodies, *map(_numbers, limits)]


def _force(plant: MultibodyPlant, index: int) -> list[Any]:
    force = plant.get_force_element(ForceElementIndex(index))
    constants = [_numbers(getattr(force, name)()) for name in _OF_FORCES if hasattr(force, name)]
    return [type(force).__name__, force.joint().name() if hasattr(force, "joint") else "", *constants]


def _numbers(values: Any) -> list[str]:
    """Return numbers as texts, which JSON has for infinity, too."""
    return [repr(round(float(value), _DECIMALS) + 0.0) for value in np.atleast_1d(values)]


# The masses of a team, and what robots disagree about where they believe other ones.

ROUNDED = 12
"""Digits after the point of a centre of mass in a budget [m]: models at an angle have some of 1e-17."""


def run_setup(scenario: Scenario) -> RunSetup:
    """Read a scenario's settings and masses, against which a log is checked.

    Raises:
        ScenarioError: The models do not make a team.
    """
    from coop_drake.verification.runs.rows import RunSetup

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


def moved_bodies(scenario: Scenario, team: TeamPlant, tree: ComponentTree | None = None) -> Bodies:
    """Return the bodies that robots move, robot by robot: its own, and its share of the object's masses."""
    masses, moved = team_masses(team, tree or read_component_tree(team)), []
    for k, robot in enumerate(team.robots):
        load = scenario.load_share(robot.name, len(team.robots))
        shares = [(body, {k: 1.0, None: load}.get(body.robot, 0.0)) for body in masses]
        moved += [
            (*_properties(body, share), float(k)) for body, share in shares if share > 0.0
        ]  # a share of the load may be zero
    return tuple(moved)


def base_frames(team: TeamPlant, tree: ComponentTree) -> tuple[tuple[float, ...], ...]:
    """Return the component of every robot's base, and the origin of Bk in it [m]."""
    frames = zip(*base_points(team, tree), strict=True)
    return tuple((float(component), *point.round(ROUNDED).tolist()) for component, point in frames)


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


def team_masses(team: TeamPlant, tree: ComponentTree) -> list[BodyMass]:
    """Return masses of every robot's and the object's bodies in every component of the team's tree."""
    from coop_drake.verification.runs.rows import BodyMass

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


# The budget that a plan shall hold under: the one that is asked for, or the one that a scenario requires.


def budget_of(choice: str | None, scenario: Scenario, problem: PlanningProblem) -> Budget | None:
    """Return the budget of a plan, None where none is asked for.

    Args:
        choice: What ``plan --budget`` says; None for what the scenario requires in ``deployment.budget``.
        scenario: The scenario.
        problem: Its planning problem.

    Raises:
        ScenarioError: The budget cannot be read, or no budget can be shown for the scenario's gains.
    """
    from coop_drake.verification.budget_origin import wrong_facts

    required = scenario.deployment.budget
    if choice is None and required == "none":
        return None
    if not scenario.passes:
        allowed = "null: budgets hold for teams that pass from cell to cell"
        raise ScenarioError(str(scenario.path), "gains.selected", scenario.gains.selected, allowed)
    choice, masses = choice or required, _of_models(scenario)
    budget = read_budget(choice, scenario, problem.tree, masses)
    if wrong := wrong_facts(budget, _facts(scenario, masses)):
        raise ScenarioError(choice, wrong[0], getattr(budget, wrong[0]), wrong[1])
    if budget.limited and masses.springs:
        allowed = "none where an effort is limited: no budget bounds what springs in the models take"
        raise ScenarioError(str(scenario.path), "directives", "springs", allowed)
    return budget


def scenario_budgets(scenario: Scenario, problem: PlanningProblem) -> ScenarioBudgets:
    """Return what a scenario says about budgets, with which ``verify`` compares that of a plan."""
    from coop_drake.verification.budget_origin import ScenarioBudgets

    return ScenarioBudgets(scenario.deployment.budget, partial(_own_budgets, scenario, problem))


def _own_budgets(scenario: Scenario, problem: PlanningProblem) -> OwnBudgets:
    """Return the budgets of a scenario's deployment, and the masses that belong into every budget.

    Raises:
        ScenarioError: The scenario requires a budget, but has departures that none counts.
    """
    from coop_drake.verification.budget_origin import OwnBudgets

    masses, own, missing = _of_models(scenario), dict[str, Budget](), ""
    for choice in (budget_file.ALL, budget_file.POSITION):
        try:
            own[choice] = read_budget(choice, scenario, problem.tree, masses)
        except ScenarioError as error:
            if scenario.deployment.budget == choice:
                raise
            missing = missing or f"{error.key} is {error.shown}"
    return OwnBudgets(own, missing, _facts(scenario, masses))


def _facts(scenario: Scenario, masses: TeamMasses) -> Facts:
    """Return what no budget of a scenario may state otherwise."""
    from coop_drake.verification.budget_origin import Facts

    limits = {name: getattr(scenario.deployment.actuators, name) for name in LIMITS}
    return Facts(masses.bodies, masses.bases, masses.rotors, masses.dampings, limits)


def _of_models(scenario: Scenario) -> TeamMasses:
    team = build_team_plant(scenario, DiagramBuilder())
    context = team.plant.CreateDefaultContext()
    return TeamMasses(
        bodies=moved_bodies(scenario, team),
        bases=base_frames(team, read_component_tree(team)),
        rotors=tuple(joint_inertias(team).tolist()),
        dampings=tuple(float(joint.GetDampingVector(context)[0]) for joint in team.joints),
        disagreement=largest_disagreement(scenario, team),
        springs=team.plant.num_force_elements() > 1,  # every plant has gravity
    )

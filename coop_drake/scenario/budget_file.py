"""Budgets: read from files, or taken from a scenario's section ``deployment``."""

from __future__ import annotations

from collections.abc import Iterator
from math import hypot
from pathlib import Path
from typing import NamedTuple

from coop_drake.answers.budget import LIMITS, Budget
from coop_drake.errors import ScenarioError
from coop_drake.scenario.deployment import Floor, JointFriction, RobotDepartures, Waves
from coop_drake.scenario.document import read_file
from coop_drake.scenario.model import Scenario
from coop_drake.tree import ComponentTree
from coop_drake.tree.component_tree import Bodies, axis_levers

ALL = "all"
"""The choice that stands for the departures of the scenario's section ``deployment``."""

POSITION = "position"
"""The choice that stands for these, for the object's position alone."""

PLANE_DEVIATIONS = 3.44
"""Standard deviations of the coordinates that count as the bound of a vector in the plane [-]: as rarely
beyond it as a normal number is beyond ``DEVIATIONS``."""

DEVIATIONS = 3.0
"""Standard deviations of a normal noise that count as its bound [-]: one sample in 370 is beyond."""

GRASP_DEVIATIONS = 7.0
"""Standard deviations that count as the bound of where a robot's own measurements place its grasp [-]:
nothing else enters this check, and every one beyond is a false alarm. Of vectors in the plane 2e-11 are."""

GRASP_PLAY = 1e-4
"""What grasps and rounding may add to it [m, rad]."""

REPORTS_LOST = 5
"""Reports lost in a row for which a budget provides [-]: one in 3000 times where a fifth of them is lost."""

ACCELERATION_ERROR = 0.2
"""Error of accelerations that a budget from a deployment provides for beside that of the model: for friction,
and efforts for another configuration than the team's [rad/s^2 or m/s^2]. It is an assumption."""

DISAGREEMENT = 0.13
"""By how much the accelerations that robots command for the object's origin differ from those of all, for
longer than the memory of the loops, because they measure differently [m/s^2]. It is an assumption: random
errors of 0.7 m/s^2 in every period are left by a sixth by loops that remember forty periods."""


class TeamMasses(NamedTuple):
    """What a budget takes from the models of a team.

    Attributes:
        bodies: As the field of ``Budget``; so are the next three.
        bases: Frames of the bases.
        rotors: Inertia of the rotors.
        dampings: Damping of the joints.
        disagreement: Largest acceleration of an axis over that by which the robots' commands for the object's
            origin differ, see ``laws/couplings.py`` [rad/m or -].
        springs: Whether joints have springs.
    """

    bodies: Bodies
    bases: tuple[tuple[float, ...], ...]
    rotors: tuple[float, ...]
    dampings: tuple[float, ...]
    disagreement: float
    springs: bool


def names_file(choice: str) -> bool:
    """Whether a choice of a budget names a file."""
    return choice not in (ALL, POSITION)


def read_budget(choice: str, scenario: Scenario, tree: ComponentTree, masses: TeamMasses) -> Budget:
    """Return the budget that ``plan --budget`` names.

    Args:
        choice: ``all`` for what the scenario's section ``deployment`` departs from the ideal team by,
            ``position`` for the same without the axes, or a file with the keys of ``Budget``.
        scenario: The scenario.
        tree: The team.
        masses: What follows from the masses of the models.

    Raises:
        ScenarioError: There is no such file, it is wrong, or the scenario has no control rate or has
            departures that no budget counts.
    """
    if not names_file(choice):
        return _of_deployment(scenario, tree, masses, axes=choice == ALL)
    if not Path(choice).is_file():
        allowed = "all, position, or a file with a budget"
        raise ScenarioError(str(scenario.path), "--budget", choice, allowed)
    _refuse_other_loops(scenario)
    budget: Budget = read_file(Budget, Path(choice))
    return budget


def _of_deployment(scenario: Scenario, tree: ComponentTree, masses: TeamMasses, *, axes: bool) -> Budget:
    deployment = scenario.deployment
    if deployment.control_rate is None or deployment.period is None:
        allowed = "a number, for a budget of the scenario's own departures"
        raise ScenarioError(str(scenario.path), "deployment.control_rate", None, allowed)
    _refuse_uncounted(scenario, axes=axes)
    measured, messages = deployment.measurements, deployment.messages
    moved = [sum(body[1] for body in masses.bodies if body[5] == k) for k in range(len(masses.bases))]
    share = hypot(*moved) / sum(moved)  # errors of several robots rarely add up
    mean = PLANE_DEVIATIONS * share
    lost = REPORTS_LOST * deployment.period if messages.loss > 0.0 else 0.0
    waves, start = wave_bounds(measured.waves, tree), deployment.start_offset
    noises = GRASP_DEVIATIONS * measured.position_noise, GRASP_DEVIATIONS * measured.angle_noise
    grasp, turn = grasp_bounds(measured.waves, tree, *noises)
    return Budget(
        control_rate=deployment.control_rate,
        delay=measured.delay,
        lag=deployment.actuators.lag,
        # A team at rest that has measured with a constant error stands off by it: errors cover starts.
        angle_noise=max(
            DEVIATIONS * measured.angle_noise + waves.angle, *map(abs, (start.theta, *start.joints))
        ),
        rate_noise=DEVIATIONS * measured.rate_noise + waves.rate,
        position_noise=max(mean * measured.position_noise + waves.position, hypot(start.x, start.y)),
        velocity_noise=mean * measured.rate_noise * rate_levers(tree) + waves.velocity,
        single_noise=1.0 / share,
        model_error=abs(deployment.mass_error),
        acceleration_error=ACCELERATION_ERROR,
        axis_error=max(ACCELERATION_ERROR, DISAGREEMENT * masses.disagreement),
        joint_coulomb=deployment.joint_friction.coulomb,
        joint_viscous=deployment.joint_friction.viscous,
        report_age=messages.delay + lost,
        clock_error=deployment.clock_error,
        base_force=deployment.actuators.base_force,
        base_torque=deployment.actuators.base_torque,
        joint_effort=deployment.actuators.joint_effort,
        axes=axes,
        bodies=masses.bodies if axes else (),
        bases=masses.bases if axes else (),
        rotors=masses.rotors if axes else (),
        grasp_noise=grasp + GRASP_PLAY,
        turn_noise=turn + GRASP_PLAY,
        dampings=masses.dampings if axes else (),
    )


def _refuse_uncounted(scenario: Scenario, *, axes: bool) -> None:
    """Refuse what no budget counts, so that no plan is called tolerant of it.

    While a team is held its clock runs slower, and its axes are commanded otherwise than the tubes say.
    Wheels that are blocked or slip are faults, of which nobody calls a plan tolerant: they are simulated to
    see that the team stops.
    """
    _refuse_other_loops(scenario)
    deployment, control = scenario.deployment, scenario.control
    measured, actuators = deployment.measurements, deployment.actuators
    limits = {f"deployment.actuators.{name}": getattr(actuators, name) for name in LIMITS}
    uncounted = {
        "deployment.measurements.loss": measured.loss,
        "deployment.measurements.late": measured.late,
        "deployment.messages.repeat": deployment.messages.repeat,
        "deployment.robots": {
            name: own for name, own in deployment.robots.items() if own.counted != RobotDepartures()
        },
        "deployment.floor": None if deployment.floor == Floor() else deployment.floor,
        "deployment.pushes": deployment.pushes,
    }
    for key, value in uncounted.items():
        if value:
            allowed = (
                "nothing where a budget is asked for: none counts this; state a budget in a file instead"
            )
            raise ScenarioError(str(scenario.path), key, value, allowed)
    if deployment.joint_friction != JointFriction() and not axes:
        allowed = "none with the budget position, which bounds no rate of a joint; or budget: all"
        raise ScenarioError(
            str(scenario.path), "deployment.joint_friction", deployment.joint_friction, allowed
        )
    stated = {key: value for key, value in limits.items() if value is not None}
    for key, value in stated.items():
        if not axes:
            allowed = (
                "null with the budget position, which bounds no effort of angles and joints; or budget: all"
            )
            raise ScenarioError(str(scenario.path), key, value, allowed)
        if control.hold is not None:
            allowed = f"null where a budget is asked for and {key.removeprefix('deployment.')} is limited"
            raise ScenarioError(str(scenario.path), "control.hold", control.hold, allowed)


def _refuse_other_loops(scenario: Scenario) -> None:
    """Refuse predictors and observers, which change the loops that departures are computed for."""
    for key in ("predictor", "observer"):
        if getattr(scenario.control, key):
            allowed = "false where a budget is asked for: its bounds are those of the loop without it"
            raise ScenarioError(str(scenario.path), f"control.{key}", True, allowed)


class MeasuredBounds(NamedTuple):
    """Largest errors, as budgets have them.

    Attributes:
        angle: Of an angle or a joint position [rad or m].
        rate: Of a rate of these [rad/s or m/s].
        position: Of the object's position [m].
        velocity: Of its velocity [m/s].
    """

    angle: float
    rate: float
    position: float
    velocity: float


def wave_bounds(waves: Waves, tree: ComponentTree) -> MeasuredBounds:
    """Return the largest errors that waves cause, whatever their signs.

    The object's angular rate is that of a base less those of the joints between, so that their errors add
    up; so do those of its velocity, by the distances of the joints from it.
    """
    rate = velocity = 0.0
    for reach, levers, turning in _branches(tree):
        rate = max(rate, waves.turn_rate.size + turning * waves.joint_rates.size)
        turn = reach * waves.turn_rate.size
        velocity = max(velocity, turn + sum(levers) * waves.joint_rates.size)
    return MeasuredBounds(
        angle=max(waves.angle.size, waves.joints.size),
        rate=max(rate, waves.joint_rates.size),
        position=hypot(waves.x.size, waves.y.size),
        velocity=hypot(waves.velocity_x.size, waves.velocity_y.size) + velocity,
    )


def rate_levers(tree: ComponentTree) -> float:
    """Return the object's velocity error [m/s] for a unit error of all rates that a robot measures.

    The velocity of the base counts once, that of every angle by its largest distance from the object; their
    errors are independent.
    """
    return max(hypot(1.0, reach, *levers) for reach, levers, _ in _branches(tree))


def grasp_bounds(waves: Waves, tree: ComponentTree, position: float, angle: float) -> tuple[float, float]:
    """Return the largest errors of a grasp's place [m] and of a base's angle [rad] by what a robot measures.

    They are what the measured pose of the base and the joints on one side, and the object's pose on the other
    differ by. Errors of noise are independent; those of waves add up. A grasp is not farther from L, and a
    base or a joint not farther from its grasp than twice, than the team reaches.

    Args:
        waves: Bounded errors.
        tree: The team.
        position: Largest error of a position by noise [m].
        angle: Largest error of an angle or a joint's position by noise [rad or m].
    """
    grasp = turn = 0.0
    for reach, levers, turning in _branches(tree):
        arms = [2.0 * reach, *(reach + lever for lever in levers)]
        noise = hypot(position, position, *(angle * arm for arm in (reach, *arms)))
        same = hypot(waves.x.size, waves.y.size) + reach * waves.angle.size
        grasp = max(grasp, noise + same + sum(arms[1:]) * waves.joints.size)
        turns = angle * hypot(1.0, *[1.0] * (1 + turning))
        turn = max(turn, turns + waves.angle.size + turning * waves.joints.size)
    return grasp, turn


def _branches(tree: ComponentTree) -> Iterator[tuple[float, list[float], int]]:
    """Yield for the joints from the object to each component what counts of their rates.

    That is the largest distance of a base from the object [m], that of every joint [m], 1 for a prismatic
    one, and how many are revolute.
    """
    reach, levers = axis_levers(tree)[0], [0.0] * len(tree.components)
    yield reach, [], 0
    for index, component in enumerate(tree.components):
        if component.joint is None or component.parent is None:
            continue
        pose = component.joint.X_PJ
        levers[index] = levers[component.parent] + hypot(pose.x, pose.y)
        joints = [(i, tree.components[i].joint) for i in tree.ancestors[index]]
        turning = [joint is not None and joint.kind == "revolute" for _, joint in joints]
        own = [
            levers[i] if turns else 1.0
            for (i, joint), turns in zip(joints, turning, strict=True)
            if joint is not None
        ]
        yield reach, own, sum(turning)

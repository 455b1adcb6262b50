"""How large errors of what robots measure make those of the object's motion and of the axes."""

from __future__ import annotations

from collections.abc import Iterator
from math import hypot
from typing import NamedTuple

from coop_drake.scenario.waves import Waves
from coop_drake.tree import ComponentTree
from coop_drake.tree.levers import axis_levers


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
    """Return the error of the object's velocity over that of the rates of a robot, by which it is known [-].

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

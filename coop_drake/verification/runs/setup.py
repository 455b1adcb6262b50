"""What a run's log cannot state itself: its scenario's settings, and the masses of the bodies."""

from __future__ import annotations

from dataclasses import dataclass

from coop_drake.tree.pose import FloatArray


@dataclass(frozen=True)
class BodyMass:
    """Mass properties of one body in the plane.

    Attributes:
        component: Index of its component in the team's tree.
        robot: Index of the robot that it belongs to, None for the object's bodies.
        mass: Mass [kg].
        p_CBcm: Centre of mass in the component's frame, shape (2,) [m].
        inertia: About the vertical axis through the centre of mass [kg m^2].
    """

    component: int
    robot: int | None
    mass: float
    p_CBcm: FloatArray  # noqa: N815
    inertia: float


@dataclass(frozen=True)
class RunSetup:
    """A scenario as the check of a log needs it.

    Attributes:
        scenario_digest: Digest of the scenario.
        robot_names: Names of the robots.
        exact: Whether the team is ideal, so that the equations of the control law hold to rounding.
        rigid: Whether grasps are exactly rigid.
        mechanics: Whether grasps are rigid and nothing but actuators, damping and friction of joints, and
            grasps acts on the bodies, so that the equations of motion hold to rounding.
        can_be_held: Whether the scenario knows holds.
        one_hold: Whether all robots hear at once that they are held, and not.
        one_clock: Whether all robots have the same time since a cell was entered, but for holds.
        alike: Whether they also compute at the same instants, so that all have the same nominal motions.
        grasps: Every robot's grasp in L, shape (N, 2) [m].
        bodies: Mass properties of all bodies.
        joint_damping: Of every joint, shape (n,) [N m s or N s/m].
        joint_friction: Largest dry friction of a joint [N m or N], and its friction for each unit of the rate
            besides [N m s or N s/m].
        joint_inertia: That the joint's rotor adds, shape (n,) [kg m^2 or kg].
        displacement: How far the team stands off the plan's start, shape (3 + n,) [m, rad].
    """

    scenario_digest: str
    robot_names: tuple[str, ...]
    exact: bool
    rigid: bool
    mechanics: bool
    can_be_held: bool
    one_hold: bool
    one_clock: bool
    alike: bool
    grasps: FloatArray
    bodies: tuple[BodyMass, ...]
    joint_damping: FloatArray
    joint_friction: tuple[float, float]
    joint_inertia: FloatArray
    displacement: FloatArray

"""A budget: the departures from the ideal team that a plan tolerates, and the sets that follow from it."""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
from math import inf
from typing import Annotated

import numpy as np

from coop_drake.tree.component_tree import BODY, Bodies
from coop_drake.typed_data import (
    EXACT,
    DataError,
    Limits,
    NotNegative,
    Number,
    Positive,
    Vector,
    check_fields,
)

_Exact = Annotated[NotNegative, EXACT]

SCALED = (
    "delay", "lag", "angle_noise", "rate_noise", "position_noise", "velocity_noise", "model_error",
    "acceleration_error", "axis_error", "joint_coulomb", "joint_viscous", "report_age", "clock_error",
    "grasp_noise", "turn_noise",
)  # fmt: skip
"""Departures that a budget of the same control rate has more or less of."""


LIMITS = "base_force", "base_torque", "joint_effort"
"""Limits of efforts, which a plan with this budget keeps."""

UNSAID = ("axes", "bodies", "bases", "rotors", "dampings")
"""Fields that a budget in a line says in other words, or not at all: what the models give."""


@dataclass(frozen=True)
class Budget:
    """Bounds of what departs from the ideal team; no departure may be larger, at any time.

    Attributes:
        control_rate: How often a robot computes its command, which is held in between [Hz].
        delay: Age of the measurements on which a command rests, rounded up to whole periods [s].
        lag: Time constant with which accelerations follow their commands [s].
        angle_noise: Largest error of a measured angle or joint position [rad or m].
        rate_noise: Largest error of a measured rate of these [rad/s or m/s].
        position_noise: Largest distance of the measured position of the object from the true one, as the mean
            over the robots by the masses that they move [m].
        velocity_noise: Largest error of its measured velocity, as such a mean [m/s].
        single_noise: Largest of these errors of one robot over the mean's [-].
        model_error: Largest error of an acceleration over its command, as a wrong mass causes [-].
        acceleration_error: Largest error of the acceleration of the object's origin besides: what robots that
            disagree and the floor's friction leave [m/s^2].
        axis_error: Largest such error of the acceleration of an axis, where the coupling of axes counts, too;
            null for the number of ``acceleration_error`` [rad/s^2 or m/s^2].
        joint_coulomb: Largest Coulomb friction of a joint, of any sign at any time [N m or N].
        joint_viscous: Largest friction of a joint for each unit of its rate, beside ``dampings`` [N m s or N
            s/m].
        report_age: How long a report of readiness may be used after it was made [s].
        clock_error: Largest error of a robot's clock; what it accepts by it may be older or younger than
            ``delay`` by ``age_error`` [s].
        base_force: Largest force that a base is ever told to give, as the length of a vector; null for no
            limit [N].
        base_torque: Largest torque of a base, likewise [N m].
        joint_effort: Largest effort of a joint, likewise [N m or N].
        axes: Whether angles and joints are part of the budget; false for the position alone.
        bodies: The team's bodies, from which follows how much the rates of the axes accelerate them and what
            efforts move them, each as [component in the tree, mass [kg], centre of mass x, y [m], inertia
            [kg m^2], robot that moves it], the object once for each robot with its share of the load; empty
            where ``axis_error`` counts what the model's error leaves of the rates' accelerations.
        bases: The frame of every robot's base, as [component, x, y [m]]; needed where an effort is limited.
        grasp_noise: Largest error with which the measured pose of a base, its joints and the object's pose
            place a grasp; null where nobody looks at it [m].
        turn_noise: Largest error with which they give the angle of the base; likewise [rad].
        rotors: Inertia that its rotor adds to every joint, empty or of shape (n,) [kg m^2 or kg].
        dampings: Damping of every joint in the models, empty or of shape (n,) [N m s or N s/m].
    """

    control_rate: Annotated[float, Limits(at_least=1.0, at_most=1e4)] = 200.0
    delay: NotNegative = 0.0
    lag: NotNegative = 0.0
    angle_noise: NotNegative = 0.0
    rate_noise: NotNegative = 0.0
    position_noise: NotNegative = 0.0
    velocity_noise: NotNegative = 0.0
    single_noise: Annotated[float, Limits(at_least=1.0)] = 1.0
    model_error: Annotated[float, Limits(at_least=0.0, below=1.0)] = 0.0
    acceleration_error: NotNegative = 0.0
    axis_error: NotNegative | None = None
    joint_coulomb: NotNegative = 0.0
    joint_viscous: NotNegative = 0.0
    report_age: NotNegative = 0.0
    clock_error: NotNegative = 0.0
    base_force: Positive | None = None
    base_torque: Positive | None = None
    joint_effort: Positive | None = None
    axes: bool = True
    bodies: Bodies = ()
    bases: tuple[tuple[Number, ...], ...] = ()
    rotors: tuple[_Exact, ...] = ()
    grasp_noise: NotNegative | None = None
    turn_noise: NotNegative | None = None
    dampings: tuple[_Exact, ...] = ()

    def __post_init__(self) -> None:
        check_fields(self)
        for i, body in enumerate(self.bodies):
            whole = len(body) == len(BODY) and not (body[0] % 1.0 or body[5] % 1.0)
            if not whole or min(body[0], body[1], body[4], body[5]) < 0.0:
                allowed = f"{', '.join(BODY)}, of which only x and y may be negative"
                raise DataError(f"bodies[{i}]", body, allowed)
        for i, base in enumerate(self.bases):
            if len(base) != 3 or base[0] < 0.0 or base[0] % 1.0:
                raise DataError(f"bases[{i}]", base, "component, x, y")
        for name in LIMITS:
            limit = getattr(self, name)
            if limit is not None and not (self.axes and self.bodies and len(self.bases) == self.robots):
                allowed = (
                    "null without axes, bodies and the base of every robot: no effort is bounded without"
                )
                raise DataError(name, limit, allowed)

        for name in ("joint_coulomb", "joint_viscous"):
            if getattr(self, name) and not (self.axes and self.bodies):
                allowed = (
                    "0 without axes and bodies: what friction accelerates follows from the team's masses"
                )
                raise DataError(name, getattr(self, name), allowed)

    @property
    def robots(self) -> int:
        """Number of robots that move the bodies, 0 for a budget without bodies."""
        return 1 + max((int(body[5]) for body in self.bodies), default=-1)

    @property
    def limited(self) -> bool:
        """Whether an effort is limited."""
        return any(getattr(self, name) is not None for name in LIMITS)

    @property
    def period(self) -> float:
        """Control period [s]."""
        return 1.0 / self.control_rate

    def effort_limits(self, joints: int) -> list[float]:
        """Return the limits of all efforts in the order of ``Departures.effort``, infinite for no limit."""
        counts = self.robots, self.robots, joints
        limits = [inf if getattr(self, name) is None else getattr(self, name) for name in LIMITS]
        return [limit for limit, count in zip(limits, counts, strict=True) for _ in range(count)]

    @property
    def ahead(self) -> float:
        """How far ahead robots compute efforts from the nominal axes: half a period and the lag [s]."""
        return 0.5 * self.period + self.lag

    @property
    def age_error(self) -> float:
        """Largest error of the age of measurements [s].

        A robot accepts ages that seem to be wrong by the error of its clock; this one may hide as much again.
        """
        return 2.0 * self.clock_error

    @property
    def words_window(self) -> float:
        """W, the time in which what one robot says is used by all [s], see ``laws/words.py``."""
        return self.report_age + 2.0 * self.clock_error + 2.0 * self.period

    @property
    def axis_acceleration_error(self) -> float:
        """Largest error of the acceleration of an axis besides that of the model [rad/s^2 or m/s^2]."""
        return self.acceleration_error if self.axis_error is None else self.axis_error

    def scaled(self, factor: float) -> Budget:
        """Return the budget with every departure this many times as large, at the same control rate."""
        sizes = {name: getattr(self, name) for name in SCALED}
        return replace(self, **{name: factor * size for name, size in sizes.items() if size is not None})

    def describe(self) -> str:
        """All bounds in a line."""
        stated = {one.name: getattr(self, one.name) for one in fields(self) if one.name not in UNSAID}
        text = ", ".join(f"{name} {value:.4g}" for name, value in stated.items() if value is not None)
        return text if self.axes else f"{text}, axes false"


@dataclass(frozen=True)
class Departures:
    """How far a team may depart from its motion under a plan's budget.

    Rows are of the position, as a vector's length, then of theta and q, each of shape (2 + n,).

    Attributes:
        pull: Largest part of a command that pulls the team to its motion [m/s^2, rad/s^2].
        position: Largest departure of positions and angles [m, rad].
        rate: Largest departure of rates [m/s, rad/s].
        acceleration: Largest departure of accelerations [m/s^2, rad/s^2].
        ahead: Largest departure to which rates take the team until a robot knows of it [m, rad].
        rest: Largest departure of positions and angles where the motion rests [m, rad].
        alarm: Levels above which a measured departure is an alarm [m, rad].
        rate_alarm: The same for rates [m/s, rad/s].
        ahead_alarm: The same for where rates take the team [m, rad].
        room: Distance that the motion keeps from the boundaries of the cells [m, rad].
        usual_rate: What random noise, of which the budget states three standard deviations, rarely exceeds of
            departures of rates; with it limits of speed are kept [m/s, rad/s].
        usual_acceleration: The same of accelerations, by noise alone [m/s^2, rad/s^2].
        effort: Largest efforts that robots are told to give: the forces of all bases, their torques, then the
            efforts of all joints; empty where the budget limits none [N, N m].
    """

    pull: Vector
    position: Vector
    rate: Vector
    acceleration: Vector
    ahead: Vector
    rest: Vector
    alarm: Vector
    rate_alarm: Vector
    ahead_alarm: Vector
    room: Vector
    usual_rate: Vector
    usual_acceleration: Vector
    effort: Vector = field(default_factory=lambda: np.zeros(0))
